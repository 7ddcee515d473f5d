//! HumanEva's calibration files: `fc(2) cc(2) alpha(1) kc(5) R(9) T(3) om(3)`, one number a line, millimetres.

use super::camera_toml;
use super::folder::{Folder, camera_files, millimetres};
use crate::{BlindSet, SetError};
use skiagraph_core::camera::Camera;

const README: &str = "\
Calibration_Data/NAME.cal of every camera, 25 numbers, one a line: focal lengths fc (2), principal point cc (2), skew alpha
(1, always 0), distortion kc (5: k1 k2 p1 p2 k3), rotation R (9, row by row), translation T (3), rotation vector om (3)

x_camera = R x_world + T in millimetres, x right, y down, z forward, the world's Z up. Pixel (0, 0) is the centre of the
top-left pixel. The size of the images is not part of the format.";

pub(super) fn write(set: &BlindSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(set, README)?;
    let cameras = set.rig.cameras.iter().zip(camera_files(set));
    cameras
        .into_iter()
        .try_for_each(|(camera, name)| folder.write(&format!("Calibration_Data/{name}.cal"), text(camera).as_bytes()))
}

/// The 25 numbers of a camera.
pub(super) fn text(camera: &Camera) -> String {
    let k = camera.opencv_matrix();
    let rotation = camera.opencv_rotation();
    let numbers = [k[0][0], k[1][1], k[0][2], k[1][2], 0.0]
        .into_iter()
        .chain(camera.distortion.coefficients())
        .chain(rotation.into_iter().flatten())
        .chain(camera.opencv_translation().map(millimetres))
        .chain(camera_toml::rotation_vector(camera));
    numbers.map(|number| format!("{number:?}\n")).collect()
}
