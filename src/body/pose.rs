//! A body's configuration, and a sequence of them.

use nalgebra::{DVector, Isometry3};

/// A configuration of a humanoid: where its root link is, and one number per degree of freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// The root link's frame in the world; metres.
    pub world_from_root: Isometry3<f64>,
    /// One value per [`super::Humanoid::degrees_of_freedom`]: radians (metres where prismatic). Three consecutive
    /// values of a spherical joint are its rotation vector.
    pub joint_angles: DVector<f64>,
}

/// Poses of one humanoid at a fixed rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Frames a second, > 0.
    pub frames_per_second: f64,
    /// One pose a frame, all of the same humanoid.
    pub poses: Vec<Pose>,
}
