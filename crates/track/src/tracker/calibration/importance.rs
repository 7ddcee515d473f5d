//! Weights of a body's parts in comparisons with a different body.

use nalgebra::{Point3, Vector3};

use super::shape::REACHES_M;
use crate::tracker::descent::OutlineSample;
use skiagraph_core::body::{Humanoid, Landmark, LinkPoint, Skin, Solid};

/// Weight of hands and feet without their own joints: bodies with and without such joints differ in kind, not in size.
const EXTREMITY_IMPORTANCE: f64 = 0.1;

/// Weight of each part of a body's surface when the compared body may differ. Hands and feet that cannot move relative
/// to the forearm and shank get a low weight, because they would displace these. By default all weights are 1.
#[derive(Debug, Default)]
pub(in crate::tracker) struct OutlineImportance {
    /// By link and index of the solid on it.
    solids: Vec<Vec<f64>>,
    /// By vertex, for a body with a skin.
    vertices: Option<Vec<f64>>,
}

impl OutlineImportance {
    pub(in crate::tracker) fn new(body: &Humanoid) -> Self {
        Self { solids: of_solids(body), vertices: body.skin.as_ref().map(|skin| of_vertices(body, skin)) }
    }

    pub(in crate::tracker) fn of(&self, sample: &OutlineSample) -> f64 {
        let found = match &self.vertices {
            Some(vertices) => vertices.get(sample.spot.ends[0] as usize),
            None => self.solids.get(sample.link).and_then(|solids| solids.get(sample.spot.solid as usize)),
        };
        found.copied().unwrap_or(1.0)
    }
}

fn ends(body: &Humanoid) -> impl Iterator<Item = LinkPoint> {
    const ENDS: [Landmark; 4] = [Landmark::LeftWrist, Landmark::RightWrist, Landmark::LeftAnkle, Landmark::RightAnkle];
    ENDS.into_iter().filter_map(|end| body.markers[end as usize])
}

fn of_vertices(body: &Humanoid, skin: &Skin) -> Vec<f64> {
    let mut importance = vec![1.0; skin.vertices().len()];
    for marker in ends(body) {
        // a marker at the origin of its link has a joint there
        let Some(along) = marker.point_in_link.coords.try_normalize(REACHES_M) else { continue };
        let link_from_bind = skin.bind()[marker.link].inverse();
        for ((value, vertex), part) in importance.iter_mut().zip(skin.vertices()).zip(skin.parts()) {
            let beyond = || (link_from_bind * vertex - marker.point_in_link).dot(&along) > 0.0;
            if *part as usize == marker.link && beyond() {
                *value = EXTREMITY_IMPORTANCE;
            }
        }
    }
    importance
}

fn of_solids(body: &Humanoid) -> Vec<Vec<f64>> {
    let mut importance: Vec<Vec<f64>> = body.links.iter().map(|link| vec![1.0; link.solids.len()]).collect();
    for marker in ends(body) {
        for (number, solid) in body.links[marker.link].solids.iter().enumerate() {
            if is_beyond(&marker.point_in_link, solid) {
                importance[marker.link][number] = EXTREMITY_IMPORTANCE;
            }
        }
    }
    importance
}

/// Whether the middle of a solid is farther from the link's origin than the marker is, in the marker's direction.
fn is_beyond(marker: &Point3<f64>, solid: &Solid) -> bool {
    let middle = match solid {
        Solid::TaperedCapsule(c) => nalgebra::center(&c.a, &c.b),
        Solid::Box { link_from_box: frame, .. } | Solid::Cylinder { link_from_cylinder: frame, .. } => {
            frame.translation.vector.into()
        }
        Solid::Mesh { vertices, .. } => {
            let sum = vertices.iter().fold(Vector3::zeros(), |sum, vertex| sum + vertex.coords);
            (sum / vertices.len().max(1) as f64).into()
        }
    };
    match marker.coords.try_normalize(REACHES_M) {
        Some(along) => (middle - marker).dot(&along) > 0.0,
        // A marker at the origin of its link has a joint there.
        None => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::fixture::March;
    use skiagraph_core::body::{shipped, shipped_skin};

    #[test]
    fn hands_and_feet_without_joints_have_low_weight() {
        for (name, few) in [("tracker25", 4), ("tracker40", 0), ("actor", 0)] {
            let body = shipped(name).unwrap();
            let importance = of_solids(&body);
            let light: Vec<&str> = (0..body.links.len())
                .filter(|link| importance[*link].iter().any(|value| *value < 1.0))
                .map(|link| body.links[link].name.as_str())
                .collect();
            assert_eq!(light.len(), few, "{light:?}");
            let arm = body.find_link("left_upper_arm").unwrap();
            assert!(importance[arm].iter().all(|value| *value == 1.0));
        }
        let body = shipped("tracker25").unwrap();
        let forearm = body.find_link("left_forearm").unwrap();
        assert_eq!(of_solids(&body)[forearm], [1.0, EXTREMITY_IMPORTANCE]);
    }

    #[test]
    fn skin_vertices_beyond_wrists_and_ankles_without_joints_have_low_weight() {
        for (name, some) in [("tracker25", true), ("actor", false)] {
            let body = shipped(name).unwrap();
            let bind = body.link_frames(&March::standing(&body));
            let skin = Skin::bound(&shipped_skin("person_coarse").unwrap(), &body, &bind).unwrap();
            let importance = of_vertices(&body, &skin);
            let light = || (0..importance.len()).filter(|vertex| importance[*vertex] < 1.0);
            assert_eq!(light().next().is_some(), some, "{name}");
            assert!(light().count() < importance.len() / 2);
            for vertex in light() {
                let link = &body.links[skin.parts()[vertex] as usize].name;
                assert!(link.contains("forearm") || link.contains("shank"), "{link}");
            }
        }
    }
}
