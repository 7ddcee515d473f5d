//! Footholds: where the feet of a particle stand, remembered from frame to frame.

use nalgebra::{Isometry3, Vector3};

use super::footing::{Feet, Footing};
use crate::body::rotation_about;

/// Deviation of a foot about its foothold within one frame, metres: what a particle's noise is like. Errors are the
/// same from 3 to 30 mm.
const NOISE_OF_PLACE: f64 = 0.01;

/// The same of its heading, radians.
const NOISE_OF_HEADING: f64 = 0.03;

impl Footing {
    /// The footholds after a frame that ended with the feet at `feet`.
    ///
    /// A foothold is the state of a Kalman filter that forgets how sure it is: in one frame a foot of that height moves
    /// by its looseness (variance `q`), and is seen with a particle's noise (variance `r`). So the foothold moves
    /// towards the foot by `q / (q + r)`, its place and its heading apart. A foot that stands firm keeps its foothold,
    /// however much noise the root has; one in flight takes it along and is planted where it comes down. Height and
    /// tilt are the foot's.
    pub(super) fn updated(&self, footholds: &Feet, feet: &Feet) -> Feet {
        let steps = footholds.steps_to(feet);
        let update = |foot: usize| {
            let (step, place) = (&steps[foot], &feet.0[foot]);
            let loose = self.looseness(step);
            let left = (step.before - step.after).xy() * kept(loose.slide, NOISE_OF_PLACE);
            let turned = -step.turned * kept(loose.turn, NOISE_OF_HEADING);
            let translation = place.translation.vector + Vector3::new(left.x, left.y, 0.0);
            Isometry3::from_parts(translation.into(), rotation_about(&Vector3::z_axis(), turned) * place.rotation)
        };
        Feet([update(0), update(1)])
    }
}

/// The share of what parts foothold and foot that is left after a frame.
fn kept(variance: f64, noise: f64) -> f64 {
    noise * noise / (variance + noise * noise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Humanoid, rotation_from_vector};

    /// Feet whose slide and turn have this mean square below 0.2 m and are loose above 0.3 m.
    fn feet_of(square: f64) -> Footing {
        let knots = [(0.0, square), (0.2, square), (0.3, 1e6)];
        Footing::with_knots(&Humanoid::tracker25().unwrap(), &knots).unwrap()
    }

    fn foot(x: f64, y: f64, z: f64, yaw: f64) -> Isometry3<f64> {
        let tilt = rotation_from_vector(&Vector3::new(0.4, -0.9, 0.0));
        Isometry3::from_parts(Vector3::new(x, y, z).into(), rotation_about(&Vector3::z_axis(), yaw) * tilt)
    }

    #[test]
    fn a_foothold_moves_by_the_share_of_the_slide_in_slide_and_noise() {
        // by hand: a slide of 5 mm against 10 mm of noise, 25 / (25 + 100) = 0.2; turns of 5 mrad against 30, 25 / 925
        let footing = feet_of(0.005 * 0.005);
        let (before, now) = (foot(1.0, 2.0, 0.1, 0.3), foot(1.05, 1.98, 0.12, 0.35));
        let footholds = footing.updated(&Feet([before, before]), &Feet([now, before]));
        let updated = footholds.0[0];
        assert!((updated.translation.vector - Vector3::new(1.01, 1.996, 0.12)).norm() < 1e-12, "{updated}");
        let heading = rotation_about(&Vector3::z_axis(), 0.3 + 0.05 * 25.0 / 925.0);
        let tilt = rotation_about(&Vector3::z_axis(), 0.35).inverse() * now.rotation;
        assert!(updated.rotation.angle_to(&(heading * tilt)) < 1e-9);
        assert!((footholds.0[1].translation.vector - before.translation.vector).norm() < 1e-15, "nothing moved it");
    }

    #[test]
    fn a_foot_in_flight_takes_its_foothold_along() {
        let footing = feet_of(1e-9);
        let (before, now) = (foot(0.0, 0.0, 0.5, 0.0), foot(0.8, -0.3, 0.5, 1.0));
        let updated = footing.updated(&Feet([before; 2]), &Feet([now; 2]));
        for place in updated.0 {
            assert!((place.translation.vector - now.translation.vector).norm() < 1e-9);
            assert!(place.rotation.angle_to(&now.rotation) < 1e-8);
        }
    }

    #[test]
    fn a_foothold_that_is_left_alone_closes_in_geometrically() {
        // what is left after n frames is (r / (q + r))^n of what was apart, here 0.8^n
        let footing = feet_of(0.005 * 0.005);
        let now = foot(0.1, 0.0, 0.1, 0.0);
        let mut footholds = Feet([foot(0.0, 0.0, 0.1, 0.0); 2]);
        for n in 1..20 {
            footholds = footing.updated(&footholds, &Feet([now; 2]));
            let apart = 0.1 - footholds.0[0].translation.x;
            assert!((apart - 0.1 * 0.8_f64.powi(n)).abs() < 1e-12, "frame {n}: {apart}");
        }
    }
}
