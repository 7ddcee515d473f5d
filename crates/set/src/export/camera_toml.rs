//! Cameras in the TOML that anipose, Pose2Sim and Caliscope read.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Rotation3};

use crate::BenchmarkSet;
use crate::camera::Camera;

/// One table a camera, in order: `cam_00` and so on, because readers sort the keys or take them in the file's order.
pub(super) fn text(set: &BenchmarkSet, names: &[String]) -> String {
    let mut text = String::new();
    for (index, (camera, name)) in set.blind.rig.cameras.iter().zip(names).enumerate() {
        writeln!(text, "[cam_{index:02}]\n{}", table(camera, name)).ok();
    }
    text + "[metadata]\nadjusted = false\nerror = 0.0\n"
}

fn table(camera: &Camera, name: &str) -> String {
    let rotation = Matrix3::from_row_slice(camera.opencv_rotation().as_flattened());
    let turn: [f64; 3] = Rotation3::from_matrix_unchecked(rotation).scaled_axis().into();
    format!(
        "name = {name:?}\nsize = [{:?}, {:?}]\nmatrix = {:?}\ndistortions = {:?}\nrotation = {turn:?}\ntranslation = \
         {:?}\nfisheye = false\n",
        f64::from(camera.pinhole.width),
        f64::from(camera.pinhole.height),
        camera.opencv_matrix(),
        camera.distortion.coefficients(),
        camera.opencv_translation(),
    )
}
