//! Cameras: a pinhole with OpenCV's lens distortion, placed in the world, and rigs of them.
//!
//! Camera axes are OpenCV's: x right, y down, z forward. Pixel (0, 0) is the *outer corner* of the top-left pixel, so
//! pixel centres lie at +0.5; files that follow OpenCV put (0, 0) at that pixel's centre, and loaders and writers shift
//! the principal point by half a pixel.

use nalgebra::{Isometry3, Point2, Point3};

/// The ideal (distortion-free) projection of a camera: what raster/ draws with. Lengths in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Focal lengths along x and y, in pixels; both > 0.
    pub focal: [f64; 2],
    /// Principal point, in pixels from the outer corner of the top-left pixel.
    pub principal_point: [f64; 2],
    /// Image width in pixels, >= 1.
    pub width: u32,
    /// Image height in pixels, >= 1.
    pub height: u32,
    /// Distance of the near plane in metres, > 0: nothing nearer is seen.
    pub near: f64,
}

/// OpenCV's radial-tangential lens distortion, `k1 k2 p1 p2 k3`; all zero is an ideal lens.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// First radial coefficient.
    pub k1: f64,
    /// Second radial coefficient.
    pub k2: f64,
    /// First tangential coefficient.
    pub p1: f64,
    /// Second tangential coefficient.
    pub p2: f64,
    /// Third radial coefficient.
    pub k3: f64,
}

/// One camera of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Unique in its rig, for people and file names.
    pub name: String,
    /// The ideal projection.
    pub pinhole: Pinhole,
    /// The lens.
    pub distortion: Distortion,
    /// World to camera frame; metres.
    pub camera_from_world: Isometry3<f64>,
}

/// Cameras that see the same scene at the same instants.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraRig {
    /// In the order in which observations list their views.
    pub cameras: Vec<Camera>,
}

impl Camera {
    /// Pixel of a world point, lens included; `None` behind the near plane.
    pub fn project(&self, point_in_world: &Point3<f64>) -> Option<Point2<f64>> {
        let p = self.camera_from_world * point_in_world;
        if p.z < self.pinhole.near {
            return None;
        }
        let (x, y) = self.distortion.apply(p.x / p.z, p.y / p.z);
        let [fx, fy] = self.pinhole.focal;
        let [cx, cy] = self.pinhole.principal_point;
        Some(Point2::new(fx * x + cx, fy * y + cy))
    }
}

impl Distortion {
    /// Distorts normalised image coordinates (x/z, y/z), as OpenCV documents for `projectPoints`.
    pub fn apply(&self, x: f64, y: f64) -> (f64, f64) {
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        (
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )
    }

    /// Whether the lens is ideal.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}
