//! Cameras in the TOML that anipose, Pose2Sim and Caliscope read.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

use skiagraph_core::body;
use skiagraph_core::camera::Camera;

/// One table a camera, in order: `cam_00` and so on, because readers sort the keys or take them in the file's order.
pub(super) fn text(cameras: &[Camera], names: &[String]) -> String {
    let mut text = String::new();
    for (index, (camera, name)) in cameras.iter().zip(names).enumerate() {
        let [width, height] = [camera.pinhole.width, camera.pinhole.height].map(f64::from);
        let table = table(camera);
        writeln!(text, "[cam_{index:02}]\nname = {name:?}\nsize = [{width:?}, {height:?}]\n{table}").ok();
    }
    text + "[metadata]\nadjusted = false\nerror = 0.0\n"
}

/// Caliscope's tables, by the number of the camera.
pub(super) fn numbered(cameras: &[Camera], names: &[String]) -> String {
    let mut text = String::new();
    for (index, (camera, name)) in cameras.iter().zip(names).enumerate() {
        let (size, table) = ([camera.pinhole.width, camera.pinhole.height], table(camera));
        writeln!(text, "[cameras.{index}]\ncam_id = {index}\nname = {name:?}\nsize = {size:?}\n{table}").ok();
    }
    text
}

/// OpenCV's `rvec`: axis times angle, radians.
pub(super) fn rotation_vector(camera: &Camera) -> [f64; 3] {
    let rotation = Matrix3::from_row_slice(camera.opencv_rotation().as_flattened());
    // by way of a quaternion: a matrix of 180 degrees is symmetric, and nalgebra finds no axis in it
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    body::rotation_vector(&turn).into()
}

/// Lens and place.
fn table(camera: &Camera) -> String {
    let turn = rotation_vector(camera);
    format!(
        "matrix = {:?}\ndistortions = {:?}\nrotation = {turn:?}\ntranslation = {:?}\nfisheye = false\n",
        camera.opencv_matrix(),
        camera.distortion.coefficients(),
        camera.opencv_translation(),
    )
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Rotation3, Vector3};

    use super::*;
    use skiagraph_core::camera::FieldOfView;

    // the side of a hall that looks straight along an axis: its camera was written with no turn at all
    #[test]
    fn a_turn_of_180_degrees_is_kept() {
        let target = Point3::new(0.0, 0.0, 1.0);
        for eye in [Point3::new(0.0, 3.0, 1.0), Point3::new(0.0, -3.0, 1.0), Point3::new(3.0, 1e-9, 1.0)] {
            let camera = Camera::look_at("a", eye, target, Vector3::z(), FieldOfView::Vertical(0.9), 64, 48).unwrap();
            let matrix = Matrix3::from_row_slice(camera.opencv_rotation().as_flattened());
            let again = Rotation3::from_scaled_axis(Vector3::from(rotation_vector(&camera)));
            assert!((again.matrix() - matrix).norm() < 1e-12, "{eye}: {:?}", rotation_vector(&camera));
        }
    }
}
