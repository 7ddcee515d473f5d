//! Mass and its centre.

use nalgebra::{Point3, Vector3};

use super::{Humanoid, LinkFrames};

impl Humanoid {
    /// Total mass of all links, kilograms.
    pub fn total_mass(&self) -> f64 {
        // an empty sum is negative zero
        self.links.iter().filter_map(|l| l.inertia.as_ref()).map(|i| i.mass).sum::<f64>() + 0.0
    }

    /// Centre of mass in the world, metres; `None` if no link has mass.
    pub fn centre_of_mass(&self, frames: &LinkFrames) -> Option<Point3<f64>> {
        let mut moment = Vector3::zeros();
        let mut total = 0.0;
        for (link, world_from_link) in self.links.iter().zip(&frames.0) {
            if let Some(inertia) = &link.inertia {
                moment += (world_from_link * inertia.centre_of_mass).coords * inertia.mass;
                total += inertia.mass;
            }
        }
        (total > 0.0).then(|| (moment / total).into())
    }
}

#[cfg(test)]
mod tests {
    use crate::body::shipped;

    /// "mass -0.00 kg"
    #[test]
    fn the_mass_of_a_massless_body_is_printed_without_a_sign() {
        let mut body = shipped("actor").unwrap();
        body.links.iter_mut().for_each(|link| link.inertia = None);
        assert!(body.total_mass() == 0.0 && body.total_mass().is_sign_positive());
        assert_eq!(format!("{:.2}", body.total_mass()), "0.00");
    }

    #[test]
    fn both_robots_weigh_73_kg_and_have_an_adults_centre_of_mass() {
        for name in ["tracker25", "actor"] {
            let body = shipped(name).unwrap();
            assert!((body.total_mass() - 73.0).abs() < 0.01, "{name}: {}", body.total_mass());
            let centre = body.centre_of_mass(&body.link_frames(&body.zero_pose())).unwrap();
            // 0.55 to 0.58 of the stature above the soles, which are 0.9275 m below the root.
            let height = (centre.z + 0.9275) / 1.75;
            assert!((0.54..0.59).contains(&height), "{name}: {height}");
            assert!(centre.x.abs() < 0.02 && centre.y.abs() < 1e-6, "{name}: {centre}");
        }
    }
}
