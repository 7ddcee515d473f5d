//! Errors of cameras.

use std::fmt::Display;

use crate::input::excerpt;

/// Errors of cameras and rigs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A focal length is zero or negative.
    #[error("camera {}: the focal length is {fx} x {fy} pixels; expected two numbers above 0", excerpt(camera))]
    FocalLength {
        /// The camera's name.
        camera: String,
        /// Along x, pixels.
        fx: f64,
        /// Along y, pixels.
        fy: f64,
    },
    /// K is not of the form `[fx 0 cx; 0 fy cy; 0 0 1]`.
    #[error("camera {}: K is {k:?}; expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] without skew", excerpt(camera))]
    MatrixForm {
        /// The camera's name.
        camera: String,
        /// The given matrix.
        k: [[f64; 3]; 3],
    },
    /// R is not a rotation.
    #[error(
        "camera {}: R is not a rotation (orthonormal within {tolerance}, determinant +1); it is off by {error:.2e}",
        excerpt(camera)
    )]
    Rotation {
        /// The camera's name.
        camera: String,
        /// Greatest entry of `R^T R - 1`, or 2 for a reflection.
        error: f64,
        /// Tolerance.
        tolerance: f64,
    },
    /// Numbers that are not finite, an impossible view, image, path or ring, or a rig that is too large.
    #[error("{0}")]
    Refused(String),
}

impl CameraError {
    pub(super) fn of(camera: &str, problem: impl Display) -> Self {
        Self::Refused(format!("camera {}: {problem}", excerpt(camera)))
    }
}

/// Refuses the first number that is NaN, infinite or greater than `most` in magnitude.
pub(super) fn all_within(most: f64, camera: &str, what: &'static str, numbers: &[f64]) -> Result<(), CameraError> {
    let Some(value) = numbers.iter().find(|n| n.is_nan() || n.abs() > most) else { return Ok(()) };
    let problem = format!("{what} contains {value:?}; expected finite numbers of at most {most:?}");
    Err(CameraError::of(camera, problem))
}
