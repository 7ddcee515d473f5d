//! Cameras in the TOML that anipose, Pose2Sim and Caliscope read.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Rotation3};

use crate::BlindSet;
use crate::camera::Camera;

/// One table a camera, in order: `cam_00` and so on, because readers sort the keys or take them in the file's order.
pub(super) fn text(set: &BlindSet, names: &[String]) -> String {
    let mut text = String::new();
    for (index, (camera, name)) in set.rig.cameras.iter().zip(names).enumerate() {
        let [width, height] = [camera.pinhole.width, camera.pinhole.height].map(f64::from);
        let table = table(camera);
        writeln!(text, "[cam_{index:02}]\nname = {name:?}\nsize = [{width:?}, {height:?}]\n{table}").ok();
    }
    text + "[metadata]\nadjusted = false\nerror = 0.0\n"
}

/// Caliscope's tables, by the number of the camera.
pub(super) fn numbered(set: &BlindSet, names: &[String]) -> String {
    let mut text = String::new();
    for (index, (camera, name)) in set.rig.cameras.iter().zip(names).enumerate() {
        let (size, table) = ([camera.pinhole.width, camera.pinhole.height], table(camera));
        writeln!(text, "[cameras.{index}]\ncam_id = {index}\nname = {name:?}\nsize = {size:?}\n{table}").ok();
    }
    text
}

/// Lens and place.
fn table(camera: &Camera) -> String {
    let rotation = Matrix3::from_row_slice(camera.opencv_rotation().as_flattened());
    let turn: [f64; 3] = Rotation3::from_matrix_unchecked(rotation).scaled_axis().into();
    format!(
        "matrix = {:?}\ndistortions = {:?}\nrotation = {turn:?}\ntranslation = {:?}\nfisheye = false\n",
        camera.opencv_matrix(),
        camera.distortion.coefficients(),
        camera.opencv_translation(),
    )
}
