//! The built-in humanoids.

use std::io;

use super::{Humanoid, UrdfError};
use crate::input::excerpt;

/// Name and URDF of every built-in humanoid (`robots/`).
pub const SHIPPED_ROBOTS: [(&str, &str); 3] = [
    ("tracker25", skiagraph_robots::TRACKER25_URDF),
    ("actor", skiagraph_robots::ACTOR_URDF),
    ("tracker40", skiagraph_robots::TRACKER40_URDF),
];

/// The built-in humanoid with this name.
///
/// # Errors
/// [`UrdfError::NotShipped`] for a name that is not in [`SHIPPED_ROBOTS`].
pub fn shipped(name: &str) -> Result<Humanoid, UrdfError> {
    let (_, text) = SHIPPED_ROBOTS.iter().find(|r| r.0 == name).ok_or_else(|| {
        let known = SHIPPED_ROBOTS.map(|r| r.0).join(", ");
        UrdfError::NotShipped(format!("no built-in robot `{}`; known: {known}", excerpt(name)))
    })?;
    let no_meshes = |_: &str| Err(io::Error::new(io::ErrorKind::NotFound, "shipped robots have no meshes"));
    Humanoid::from_urdf(text, &format!("robots/{name}.urdf"), &no_meshes)
}

impl Humanoid {
    /// The tracker's body of `[Skinned APF]`, section 4: 10 segments, 25 degrees of freedom with the root.
    ///
    /// # Errors
    /// None in practice: a test loads it.
    pub fn tracker25() -> Result<Self, UrdfError> {
        shipped("tracker25")
    }

    /// The detailed body: spine, neck, clavicles, wrists, ankles and toes.
    ///
    /// # Errors
    /// None in practice: a test loads it.
    pub fn actor() -> Result<Self, UrdfError> {
        shipped("actor")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::LANDMARKS;

    #[test]
    fn built_in_robots_load_and_match_their_readme() {
        for (name, angles, links) in [("tracker25", 19, 20), ("actor", 44, 45), ("tracker40", 34, 35)] {
            let body = shipped(name).unwrap();
            assert_eq!(body.degrees_of_freedom.len(), angles, "{name}");
            assert_eq!(body.links.len(), links, "{name}");
            assert_eq!(body.links[0].name, "pelvis");
            assert!(body.markers.iter().all(Option::is_some), "{name}");
            assert!(body.notes.is_empty(), "{:?}", body.notes);
            assert_eq!(body.name, name);
        }
        assert_eq!(Humanoid::tracker25().unwrap().links.iter().filter(|l| l.inertia.is_some()).count(), 10);
    }

    #[test]
    fn all_robots_are_1_75_m_tall_with_the_same_markers_and_mass() {
        let stand = |body: &Humanoid| {
            let markers = body.markers(&body.link_frames(&body.zero_pose()));
            LANDMARKS.map(|l| markers[l as usize].unwrap())
        };
        let actor = Humanoid::actor().unwrap();
        for (name, _) in SHIPPED_ROBOTS {
            let body = shipped(name).unwrap();
            for (a, b) in stand(&body).iter().zip(&stand(&actor)) {
                assert!((a - b).norm() < 1e-9, "{name}: {a} {b}");
            }
            assert!((body.total_mass() - actor.total_mass()).abs() < 0.01, "{name}");
        }
    }

    #[test]
    fn an_unknown_robot_is_refused_with_the_known_names() {
        let message = shipped("giant").unwrap_err().to_string();
        assert!(message.contains("tracker25, actor"), "{message}");
    }
}
