//! OpenCV's `FileStorage` in YAML, one file a camera.

use super::camera_toml;
use super::folder::{Folder, camera_files};
use crate::{BlindSet, SetError};
use skiagraph_core::camera::Camera;

const README: &str = "\
NAME.yml of every camera, to be read with cv2.FileStorage(path, cv2.FILE_STORAGE_READ).getNode(key).mat():
image_width, image_height, camera_matrix (3 x 3, pixels), distortion_coefficients (5 x 1: k1 k2 p1 p2 k3),
R (3 x 3) and rvec (3 x 1, Rodrigues), T (3 x 1, metres)

x_camera = R x_world + T; x right, y down, z forward; the world is right-handed with Z up. Pixel (0, 0) is the centre of the
top-left pixel: cv2.projectPoints(points, rvec, T, camera_matrix, distortion_coefficients) gives pixels of the silhouettes.";

pub(super) fn write(set: &BlindSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(set, README)?;
    let cameras = set.rig.cameras.iter().zip(camera_files(set));
    cameras.into_iter().try_for_each(|(camera, name)| folder.write(&format!("{name}.yml"), text(camera).as_bytes()))
}

fn text(camera: &Camera) -> String {
    let [mut text, name] = [String::from("%YAML:1.0\n---\n"), camera.name.replace(['"', '\\', '\n'], "_")];
    text += &format!("name: \"{name}\"\n");
    text += &format!("image_width: {}\nimage_height: {}\n", camera.pinhole.width, camera.pinhole.height);
    text += &matrix("camera_matrix", 3, 3, camera.opencv_matrix().as_flattened());
    text += &matrix("distortion_coefficients", 5, 1, &camera.distortion.coefficients());
    text += &matrix("R", 3, 3, camera.opencv_rotation().as_flattened());
    text += &matrix("rvec", 3, 1, &camera_toml::rotation_vector(camera));
    text += &matrix("T", 3, 1, &camera.opencv_translation());
    text
}

fn matrix(name: &str, rows: usize, columns: usize, values: &[f64]) -> String {
    // OpenCV reads "1.0" as floating point and "1" as an integer
    let values: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
    let values = values.join(", ");
    format!("{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {values} ]\n")
}
