//! Cameras: pinholes with OpenCV's lens distortion, placed in the world, and rigs of them.
//!
//! Camera axes are OpenCV's: x right, y down, z forward. Pixel (0, 0) is the *outer corner* of the top-left pixel, so
//! pixel centres lie at +0.5; files that follow OpenCV put (0, 0) at that pixel's centre, and [`Camera::from_opencv`]
//! and [`Camera::opencv_matrix`] shift the principal point by half a pixel.
//!
//! ```
//! use skiagraph_core::camera::{Camera, FieldOfView};
//! use nalgebra::{Point3, Vector3};
//! let eye = Point3::new(4.5, 0.0, 1.0);
//! let target = Point3::new(0.0, 0.0, 1.0);
//! let camera = Camera::look_at("front", eye, target, Vector3::z(), FieldOfView::Horizontal(0.8), 640, 480)?;
//! let pixel = camera.project(&target).ok_or("behind")?;
//! assert!((pixel - nalgebra::Point2::new(320.0, 240.0)).norm() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod distortion;
mod error;
mod files;
mod filming;
mod look_at;
mod opencv;
mod path;
mod pinhole;
mod rig;
mod up_axis;

pub use distortion::Distortion;
pub use error::CameraError;
pub use files::{CameraFile, CameraFileFormat, read_cameras};
pub use filming::{RigMoment, TimedRig};
pub use look_at::FieldOfView;
pub use pinhole::Pinhole;
pub use rig::{CameraRig, RingParameters};
pub use up_axis::UpAxis;

// How cameras move and take images, for the other crates: scenarios describe it to users.
#[doc(hidden)]
pub use self::{
    files::{FirstCamera, PoseDirection, with_first_camera},
    filming::CameraTiming,
    path::{CameraKeyframe, CameraPath},
    pinhole::{DEFAULT_NEAR, MAX_IMAGE_SIZE},
};

use nalgebra::{Isometry3, Point2, Point3, Unit, Vector3};

/// Greatest coordinate of a camera, metres.
const FARTHEST: f64 = 1e4;
/// Greatest coefficient of a lens's distortion.
const GREATEST_DISTORTION: f64 = 1e4;

/// One camera of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Unique in its rig; used in messages and file names.
    pub name: String,
    /// The ideal projection.
    pub pinhole: Pinhole,
    /// The lens.
    pub distortion: Distortion,
    /// World to camera frame; metres.
    pub camera_from_world: Isometry3<f64>,
}

impl Camera {
    /// Pixel of a world point, lens included; `None` nearer than the near plane, and where the lens model folds back,
    /// which no lens does. The pixel may be outside the image.
    #[inline]
    pub fn project(&self, point_in_world: &Point3<f64>) -> Option<Point2<f64>> {
        let p = self.camera_from_world * point_in_world;
        if p.z < self.pinhole.near {
            return None;
        }
        let (x, y) = (p.x / p.z, p.y / p.z);
        if !self.distortion.is_none() && !self.distortion.is_before_fold(x, y) {
            return None;
        }
        let (x, y) = self.distortion.apply(x, y);
        Some(self.pinhole.pixel(x, y))
    }

    /// Whether the camera sees this world point: beyond the near plane and inside the image.
    #[inline]
    pub fn sees(&self, point_in_world: &Point3<f64>) -> bool {
        self.project(point_in_world).is_some_and(|pixel| self.pinhole.contains(&pixel))
    }

    /// The centre of projection in the world, metres.
    #[inline]
    pub fn centre(&self) -> Point3<f64> {
        self.camera_from_world.inverse_transform_point(&Point3::origin())
    }

    /// World direction from [`Self::centre`] of the ray through `pixel`; `None` where the lens model has no inverse.
    pub fn ray_through(&self, pixel: &Point2<f64>) -> Option<Unit<Vector3<f64>>> {
        let (x, y) = self.pinhole.normalised(pixel);
        let (x, y) = self.distortion.undistort(x, y)?;
        Some(Unit::new_normalize(self.camera_from_world.inverse_transform_vector(&Vector3::new(x, y, 1.0))))
    }

    /// Distance in pixels from the principal point at which a lens model folds back within the image, by its radial
    /// part; `None` if every corner of the image has a ray.
    pub fn fold_radius_px(&self) -> Option<f64> {
        let (width, height) = (f64::from(self.pinhole.width), f64::from(self.pinhole.height));
        let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]].map(Point2::from);
        if corners.iter().all(|corner| self.ray_through(corner).is_some()) {
            return None;
        }
        let radial = Distortion { p1: 0.0, p2: 0.0, ..self.distortion };
        let (mut before, mut beyond) = (0.0, 1e-6);
        while radial.is_before_fold(beyond, 0.0) && beyond < 1e6 {
            (before, beyond) = (beyond, 2.0 * beyond);
        }
        for _ in 0..60 {
            let middle = 0.5 * (before + beyond);
            if radial.is_before_fold(middle, 0.0) { before = middle } else { beyond = middle }
        }
        (beyond < 1e6).then(|| self.pinhole.focal[0] * radial.apply(before, 0.0).0)
    }

    /// How many times as far from the principal point as without the lens the farthest corner of the image is;
    /// `None` if a corner has no ray.
    pub fn corner_stretch(&self) -> Option<f64> {
        let (width, height) = (f64::from(self.pinhole.width), f64::from(self.pinhole.height));
        let mut greatest: f64 = 0.0;
        for corner in [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]].map(Point2::from) {
            let ray = self.camera_from_world * self.ray_through(&corner)?.into_inner();
            let straight = self.pinhole.pixel(ray.x / ray.z, ray.y / ray.z);
            let middle = Point2::from(self.pinhole.principal_point);
            greatest = greatest.max((corner - middle).norm() / (straight - middle).norm());
        }
        Some(greatest)
    }

    /// Checks every number of the camera: the one rule for cameras from any file.
    ///
    /// # Errors
    /// [`CameraError`] naming the first number that is not finite or out of range.
    pub fn validate(&self) -> Result<(), CameraError> {
        self.pinhole.validate(&self.name)?;
        let Isometry3 { rotation, translation } = &self.camera_from_world;
        error::all_within(f64::MAX, &self.name, "R", rotation.coords.as_slice())?;
        error::all_within(FARTHEST, &self.name, "t, in metres,", translation.vector.as_slice())?;
        error::all_within(GREATEST_DISTORTION, &self.name, "distortion", &self.distortion.coefficients())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wide_camera() -> Camera {
        let distortion = Distortion { k1: -0.2, k2: 0.05, p1: 0.002, p2: -0.001, k3: 0.003 };
        let eye = Point3::new(3.0, -2.0, 1.5);
        let target = Point3::new(0.1, 0.2, 0.9);
        let camera = Camera::look_at("c", eye, target, Vector3::z(), FieldOfView::Vertical(0.9), 640, 480);
        Camera { distortion, ..camera.unwrap() }
    }

    #[test]
    fn nothing_before_the_near_plane_is_projected() {
        let camera = wide_camera();
        let forward = camera.ray_through(&Point2::new(320.0, 240.0)).unwrap().into_inner();
        assert_eq!(camera.project(&(camera.centre() + forward * 0.01)), None);
        assert_eq!(camera.project(&(camera.centre() - forward)), None);
        assert!(camera.sees(&(camera.centre() + forward)));
    }

    #[test]
    fn a_point_beyond_the_fold_of_the_lens_model_is_not_folded_back_into_the_image() {
        let distortion = Distortion { k1: -0.35, ..Distortion::default() };
        let camera = Camera { distortion, ..wide_camera() };
        let across = |x: f64| {
            let direction = camera.camera_from_world.inverse_transform_vector(&Vector3::new(x, 0.0, 1.0));
            camera.project(&(camera.centre() + 3.0 * direction))
        };
        // x (1 - 0.35 x^2) is greatest at 0.976, and 0 again at 1.69
        assert!(across(0.97).is_some() && across(0.98).is_none() && across(1.69).is_none());
    }

    // k1 = -40 was drawn without a word.
    #[test]
    fn lens_that_folds_within_the_image_has_a_radius() {
        let folding = |k1: f64| {
            let distortion = Distortion { k1, ..Distortion::default() };
            Camera { distortion, ..wide_camera() }.fold_radius_px()
        };
        // x (1 - 40 x^2) is greatest at 1 / sqrt(120), where it is 2 / 3 of that
        let expected = wide_camera().pinhole.focal[0] * 2.0 / 3.0 / 120.0_f64.sqrt();
        assert!((folding(-40.0).unwrap() - expected).abs() < 1e-6, "{:?}", folding(-40.0));
        assert_eq!([-0.1, 0.0, 0.5].map(folding), [None; 3]);
    }

    #[test]
    fn a_camera_with_a_number_that_is_not_finite_or_absurd_is_refused() {
        let mut camera = wide_camera();
        assert!(camera.validate().is_ok());
        for k3 in [f64::NAN, 1e19] {
            camera.distortion.k3 = k3;
            assert!(camera.validate().unwrap_err().to_string().contains("distortion"));
        }
    }
}
