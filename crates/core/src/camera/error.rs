//! Errors of cameras.

use std::fmt::Display;

use crate::input::excerpt;

/// Errors of cameras and rigs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// K is not of the form `[fx 0 cx; 0 fy cy; 0 0 1]` with focal lengths above 0.
    #[error("{0}")]
    Matrix(String),
    /// R is not a rotation.
    #[error("{0}")]
    Rotation(String),
    /// Numbers that are not finite, an impossible view, image, path or ring, or a rig that is too large.
    #[error("{0}")]
    Refused(String),
}

impl CameraError {
    pub(super) fn of(camera: &str, problem: impl Display) -> Self {
        Self::Refused(about(camera, problem))
    }
}

/// The message of a problem with this camera.
pub(super) fn about(camera: &str, problem: impl Display) -> String {
    format!("camera {}: {problem}", excerpt(camera))
}

/// Refuses the first number that is NaN, infinite or greater than `most` in magnitude.
pub(super) fn all_within(most: f64, camera: &str, what: &'static str, numbers: &[f64]) -> Result<(), CameraError> {
    let Some(value) = numbers.iter().find(|n| n.is_nan() || n.abs() > most) else { return Ok(()) };
    let problem = format!("{what} contains {value:?}; expected finite numbers of at most {most:?}");
    Err(CameraError::of(camera, problem))
}
