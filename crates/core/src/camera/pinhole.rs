//! The ideal projection.

use nalgebra::Point2;

use super::CameraError;
use super::error::{about, all_within};

/// Default distance of the near plane, metres.
pub const DEFAULT_NEAR: f64 = 0.05;

/// Greatest width and height of an image, pixels.
pub const MAX_IMAGE_SIZE: u32 = 16384;

/// Greatest focal length and coordinate of a principal point, pixels.
const GREATEST_PIXELS: f64 = 1e7;

/// The ideal (distortion-free) projection of a camera, used for rasterisation. Lengths in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Focal lengths along x and y, in pixels; both > 0.
    pub focal: [f64; 2],
    /// Principal point, in pixels from the outer corner of the top-left pixel.
    pub principal_point: [f64; 2],
    /// Image width in pixels, `1..=MAX_IMAGE_SIZE`.
    pub width: u32,
    /// Image height in pixels, `1..=MAX_IMAGE_SIZE`.
    pub height: u32,
    /// Distance of the near plane in metres, > 0; nearer points are not visible.
    pub near: f64,
}

impl Pinhole {
    /// Pixel of the normalised image coordinates (x/z, y/z).
    #[inline]
    pub fn pixel(&self, x: f64, y: f64) -> Point2<f64> {
        let ([fx, fy], [cx, cy]) = (self.focal, self.principal_point);
        Point2::new(fx * x + cx, fy * y + cy)
    }

    /// Normalised image coordinates (x/z, y/z) of a pixel: the inverse of [`Self::pixel`].
    #[inline]
    pub fn normalised(&self, pixel: &Point2<f64>) -> (f64, f64) {
        let ([fx, fy], [cx, cy]) = (self.focal, self.principal_point);
        ((pixel.x - cx) / fx, (pixel.y - cy) / fy)
    }

    /// Whether a pixel position lies inside the image.
    #[inline]
    pub fn contains(&self, pixel: &Point2<f64>) -> bool {
        (0.0..f64::from(self.width)).contains(&pixel.x) && (0.0..f64::from(self.height)).contains(&pixel.y)
    }

    pub(super) fn validate(&self, camera: &str) -> Result<(), CameraError> {
        let ([fx, fy], [cx, cy]) = (self.focal, self.principal_point);
        let numbers = [fx, fy, cx, cy, self.near];
        all_within(GREATEST_PIXELS, camera, "focal length, principal point or near plane", &numbers)?;
        if fx <= 0.0 || fy <= 0.0 {
            let problem = format!("the focal length is {fx} x {fy} pixels; expected two numbers above 0");
            return Err(CameraError::Matrix(about(camera, problem)));
        }
        let sizes = 1..=MAX_IMAGE_SIZE;
        if !sizes.contains(&self.width) || !sizes.contains(&self.height) {
            let size = format!("{} x {}", self.width, self.height);
            return Err(CameraError::of(camera, format!("the image is {size} pixels; expected sizes from 1 to 16384")));
        }
        if self.near <= 0.0 {
            let problem = format!("the near plane is at {} m; expected a distance above 0", self.near);
            return Err(CameraError::of(camera, problem));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PINHOLE: Pinhole =
        Pinhole { focal: [500.0, 510.0], principal_point: [320.0, 240.5], width: 640, height: 480, near: 0.05 };

    #[test]
    fn the_image_includes_its_left_and_upper_edges_only() {
        assert!(PINHOLE.contains(&Point2::new(0.0, 0.0)));
        assert!(!PINHOLE.contains(&Point2::new(640.0, 10.0)));
        assert!(!PINHOLE.contains(&Point2::new(f64::NAN, 10.0)));
    }

    #[test]
    fn zero_focal_length_empty_images_and_a_near_plane_behind_are_refused() {
        let refused = |pinhole: Pinhole| pinhole.validate("c").unwrap_err().to_string();
        assert!(refused(Pinhole { focal: [0.0, 500.0], ..PINHOLE }).contains("focal length"));
        assert!(refused(Pinhole { width: 0, ..PINHOLE }).contains("16384"));
        assert!(refused(Pinhole { height: 20_000, ..PINHOLE }).contains("16384"));
        assert!(refused(Pinhole { near: 0.0, ..PINHOLE }).contains("near plane"));
        assert!(refused(Pinhole { focal: [f64::INFINITY, 1.0], ..PINHOLE }).contains("finite"));
        assert!(PINHOLE.validate("c").is_ok());
    }
}
