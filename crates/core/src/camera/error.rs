//! Errors of cameras.

use crate::input::excerpt;

/// Errors of cameras and rigs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A number is NaN or infinite.
    #[error("camera {}: {what} contains {value}; every number must be finite", excerpt(camera))]
    NotFinite {
        /// The camera's name.
        camera: String,
        /// The checked numbers.
        what: &'static str,
        /// The offending number.
        value: f64,
    },
    /// A focal length is zero or negative.
    #[error("camera {}: the focal length is {fx} x {fy} pixels; both must be greater than 0", excerpt(camera))]
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
        "camera {}: the field of view is {radians} rad; it must lie between 0 and 3.14159, both excluded",
        excerpt(camera)
    )]
    FieldOfView {
        /// The camera's name.
        camera: String,
        /// Radians.
        radians: f64,
    },
    /// The image has no pixels or too many.
    #[error("camera {}: the image is {width} x {height} pixels; both must lie in 1..=16384", excerpt(camera))]
    ImageSize {
        /// The camera's name.
        camera: String,
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
    },
    /// The near plane is not before the camera.
    #[error("camera {}: the near plane is at {near} m; it must be greater than 0", excerpt(camera))]
    NearPlane {
        /// The camera's name.
        camera: String,
        /// Metres.
        near: f64,
    },
    /// K has another form than `[fx 0 cx; 0 fy cy; 0 0 1]`.
    #[error("camera {}: K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] (no skew), got {k:?}", excerpt(camera))]
    MatrixForm {
        /// The camera's name.
        camera: String,
        /// What was given.
        k: [[f64; 3]; 3],
    },
    /// R is no rotation.
    #[error(
        "camera {}: R must be a rotation (orthonormal within {tolerance}, determinant +1); it is off by {error:.2e}",
        excerpt(camera)
    )]
    Rotation {
        /// The camera's name.
        camera: String,
        /// Greatest entry of `R^T R - 1`, or 2 for a reflection.
        error: f64,
        /// Greatest allowed.
        tolerance: f64,
    },
    /// Eye, target and up direction do not span a view.
    #[error("camera {}: it cannot look at its target: {why}", excerpt(camera))]
    LookAt {
        /// The camera's name.
        camera: String,
        /// What is degenerate.
        why: &'static str,
    },
    /// A way without keyframes.
    #[error("camera {}: motion requires keyframes; give at least one", excerpt(camera))]
    NoKeyframe {
        /// The camera's name.
        camera: String,
    },
    /// Keyframes that are not in the order of time.
    #[error("camera {}: its keyframes are not in order of time: one at {after} s after {before} s", excerpt(camera))]
    KeyframeOrder {
        /// The camera's name.
        camera: String,
        /// Seconds, of a keyframe.
        before: f64,
        /// Seconds, of the next.
        after: f64,
    },
    /// The images need too much memory.
    #[error("{cameras} cameras with {pixels} pixels in total; expected at most 999 cameras and {most} pixels in total")]
    RigSize {
        /// How many there are.
        cameras: usize,
        /// Of all images together.
        pixels: u64,
        /// The greatest number of pixels.
        most: u64,
    },
    /// A ring without cameras, or with too many.
    #[error("a ring of cameras needs 1 to 999 cameras, got {count}")]
    RingCount {
        /// What was asked.
        count: u32,
    },
}

/// Refuses the first number that is NaN or infinite.
pub(super) fn all_finite(camera: &str, what: &'static str, numbers: &[f64]) -> Result<(), CameraError> {
    match numbers.iter().find(|n| !n.is_finite()) {
        Some(&value) => Err(CameraError::NotFinite { camera: camera.into(), what, value }),
        None => Ok(()),
    }
}
