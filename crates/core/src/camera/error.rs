//! Errors of cameras.

use crate::input::excerpt;

/// Errors of cameras and rigs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A number is NaN, infinite or too great.
    #[error("camera {}: {what} contains {value:?}; expected finite numbers of at most {most:?}", excerpt(camera))]
    Number {
        /// The camera's name.
        camera: String,
        /// The checked numbers.
        what: &'static str,
        /// The invalid number.
        value: f64,
        /// Greatest magnitude.
        most: f64,
    },
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
    /// A field of view is not between 0 and pi.
    #[error(
        "camera {}: the field of view is {radians} rad; expected more than 0 and less than 3.14159",
        excerpt(camera)
    )]
    FieldOfView {
        /// The camera's name.
        camera: String,
        /// Radians.
        radians: f64,
    },
    /// The image has no pixels or too many.
    #[error("camera {}: the image is {width} x {height} pixels; expected sizes from 1 to 16384", excerpt(camera))]
    ImageSize {
        /// The camera's name.
        camera: String,
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
    },
    /// The near plane is not in front of the camera.
    #[error("camera {}: the near plane is at {near} m; expected a distance above 0", excerpt(camera))]
    NearPlane {
        /// The camera's name.
        camera: String,
        /// Metres.
        near: f64,
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
    /// Eye, target and up direction do not define a view.
    #[error("camera {}: cannot look at its target: {why}", excerpt(camera))]
    LookAt {
        /// The camera's name.
        camera: String,
        /// The degeneracy.
        why: &'static str,
    },
    /// A camera path without keyframes.
    #[error("camera {}: motion requires keyframes; give at least one", excerpt(camera))]
    NoKeyframe {
        /// The camera's name.
        camera: String,
    },
    /// Keyframes that are not in chronological order.
    #[error("camera {}: keyframes are not in chronological order: {after} s follows {before} s", excerpt(camera))]
    KeyframeOrder {
        /// The camera's name.
        camera: String,
        /// Time of a keyframe, seconds.
        before: f64,
        /// Time of the next keyframe, seconds.
        after: f64,
    },
    /// The images need too much memory.
    #[error(
        "the rig has {cameras} cameras with {pixels} pixels; expected at most 999 cameras and {most} pixels in total"
    )]
    RigSize {
        /// Number of cameras.
        cameras: usize,
        /// Pixels of all images together.
        pixels: u64,
        /// The greatest number of pixels.
        most: u64,
    },
    /// A ring without cameras, or with too many.
    #[error("a ring of {count} cameras is not possible; expected 1 to 999 cameras")]
    RingCount {
        /// The requested number of cameras.
        count: u32,
    },
}

/// Refuses the first number that is NaN, infinite or greater than `most` in magnitude.
pub(super) fn all_within(most: f64, camera: &str, what: &'static str, numbers: &[f64]) -> Result<(), CameraError> {
    match numbers.iter().find(|n| n.is_nan() || n.abs() > most) {
        Some(&value) => Err(CameraError::Number { camera: camera.into(), what, value, most }),
        None => Ok(()),
    }
}
