//! A body's configuration, and a sequence of configurations.

use nalgebra::{DVector, Isometry3};

/// A configuration of a humanoid: the frame of its root link, and one number per degree of freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// The root link's frame in the world; metres.
    pub world_from_root: Isometry3<f64>,
    /// One value per [`super::Humanoid::degrees_of_freedom`]: radians (metres if prismatic). Three consecutive values
    /// of a spherical joint are its rotation vector.
    pub joint_angles: DVector<f64>,
}

impl Pose {
    /// The root's heading: its rotation about the vertical without the tilt, radians from the world's +X towards +Y,
    /// in (-pi, pi]. A root at the zero pose faces +X. `None` for a body upside down, which has no heading.
    pub fn heading(&self) -> Option<f64> {
        let rotation = &self.world_from_root.rotation;
        let turn = 2.0 * libm::atan2(rotation.k, rotation.w);
        (libm::hypot(rotation.w, rotation.k) > 1e-9).then(|| libm::remainder(turn, std::f64::consts::TAU))
    }

    /// [`Self::heading`] as a unit vector on the ground.
    pub fn forward(&self) -> Option<[f64; 3]> {
        self.heading().map(|heading| [libm::cos(heading), libm::sin(heading), 0.0])
    }
}

/// Poses of one humanoid at a fixed rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Frames a second, > 0.
    pub frames_per_second: f64,
    /// One pose per frame, all of the same humanoid.
    pub poses: Vec<Pose>,
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    #[test]
    fn a_heading_is_the_rotation_about_the_vertical_at_any_tilt() {
        let turned = |axis: Vector3<f64>| UnitQuaternion::from_scaled_axis(axis);
        let pose = |rotation| Pose {
            world_from_root: Isometry3::from_parts(Vector3::new(1.0, 2.0, 3.0).into(), rotation),
            joint_angles: DVector::zeros(0),
        };
        for heading in [-3.0, -0.4, 0.0, 1.5, 3.1] {
            let leaning = turned(Vector3::z() * heading) * turned(Vector3::new(0.3, -0.5, 0.0));
            for pose in [pose(leaning), pose(UnitQuaternion::new_unchecked(-leaning.into_inner()))] {
                assert!((pose.heading().unwrap() - heading).abs() < 1e-12);
                let [x, y, z] = pose.forward().unwrap();
                assert!((x - heading.cos()).abs() + (y - heading.sin()).abs() + z.abs() < 1e-12);
            }
        }
        assert_eq!(pose(turned(Vector3::x() * std::f64::consts::PI)).heading(), None, "upside down");
    }
}
