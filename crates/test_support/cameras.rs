//! Cameras for tests.

use nalgebra::{Point3, Vector3};

use skiagraph_core::camera::{Camera, CameraRig, Distortion, FieldOfView};

/// An ideal 320x240 camera that looks at (0, 0, 1) with the world's Z upwards in the image.
pub fn camera_at(name: &str, centre: Point3<f64>) -> Camera {
    let target = Point3::new(0.0, 0.0, 1.0);
    let view = FieldOfView::Vertical(0.9);
    let mut camera = Camera::look_at(name, centre, target, Vector3::z(), view, 320, 240).unwrap();
    camera.pinhole.principal_point = [160.3, 119.4];
    camera
}

/// Three cameras around the person; the one called "side" has a lens that distorts.
pub fn rig() -> CameraRig {
    let mut side = camera_at("side", Point3::new(0.3, 3.5, 1.4));
    side.distortion = Distortion { k1: -0.12, k2: 0.03, p1: 0.001, p2: -0.002, k3: 0.004 };
    let cameras =
        vec![camera_at("front", Point3::new(3.7, 0.2, 1.1)), side, camera_at("back", Point3::new(-3.0, -2.0, 2.0))];
    CameraRig { cameras }
}
