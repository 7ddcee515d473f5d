//! `cameras.json`: the rig in OpenCV's convention, for any program.
//!
//! `x_camera = R x_world + t` (x right, y down, z forward, metres); `K` and `distortion` (k1 k2 p1 p2 k3) as OpenCV's
//! `projectPoints` takes them, **pixel centres at integers**: the principal point of [`Camera`], which counts from the
//! outer corner of the top-left pixel, less half a pixel. `camera_from_world` repeats `R` and `t` as position and
//! quaternion; [`from_json`] uses it to avoid rounding.

use serde::{Deserialize, Serialize};

use super::rigid::RigidRecord;
use crate::SetError;
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::input::excerpt;

pub(crate) const PATH: &str = "cameras.json";
/// The cameras that saw the actor, if trackers are given others.
pub(crate) const TRUTH_PATH: &str = "truth/cameras.json";
const SCHEMA: &str = "skiagraph.cameras/1";
/// Schema for cameras that move or have their own exposure times: `frames` names the file with the cameras of every
/// frame, and the entries here are those of frame 0.
const FILMED: &str = "skiagraph.cameras/2";
pub(crate) const PIXEL_CENTRES: &str = "integers: the centre of the top-left pixel is (0, 0)";
pub(crate) const AXES: &str = "OpenCV: x right, y down, z forward; x_camera = R x_world + t; world Z up; metres";

#[derive(Serialize, Deserialize)]
struct CamerasFile {
    schema: String,
    axes: String,
    pixel_centres: String,
    /// The file with the camera poses of every frame; absent for static cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    frames: Option<String>,
    cameras: Vec<CameraRecord>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraRecord {
    name: String,
    /// Directory of its observations, relative to the set.
    observations: String,
    width: u32,
    height: u32,
    #[serde(rename = "K")]
    k: [[f64; 3]; 3],
    #[serde(rename = "R")]
    r: [[f64; 3]; 3],
    t: [f64; 3],
    distortion: [f64; 5],
    camera_from_world: RigidRecord,
    /// Distance of the near plane, metres.
    near: f64,
}

pub(crate) fn observations_directory(index: usize) -> String {
    format!("observations/cam{index:02}")
}

/// `frames` is the file with the camera poses of every frame; `None` for static cameras.
pub(crate) fn to_json(rig: &CameraRig, frames: Option<&str>) -> Result<Vec<u8>, SetError> {
    let cameras = rig.cameras.iter().enumerate().map(|(index, camera)| CameraRecord::new(index, camera)).collect();
    let schema = if frames.is_some() { FILMED } else { SCHEMA }.into();
    let frames = frames.map(str::to_owned);
    let file = CamerasFile { schema, axes: AXES.into(), pixel_centres: PIXEL_CENTRES.into(), frames, cameras };
    super::json::to_bytes(PATH, &file)
}

pub(crate) fn from_json(path: &str, bytes: &[u8]) -> Result<CameraRig, SetError> {
    let file: CamerasFile = super::json::from_bytes(path, &[SCHEMA, FILMED], bytes)?;
    if (file.schema == FILMED) != file.frames.is_some() {
        let detail = format!("the key frames is only valid in schema {FILMED}, which requires it");
        return Err(SetError::malformed(path, detail));
    }
    let cameras = file.cameras.iter().map(|record| {
        record.camera().map_err(|e| SetError::malformed(path, format!("camera {:?}: {e}", excerpt(&record.name))))
    });
    let rig = CameraRig { cameras: cameras.collect::<Result<_, _>>()? };
    rig.check_size().map_err(|e| SetError::malformed(path, e.to_string()))?;
    Ok(rig)
}

impl CameraRecord {
    fn new(index: usize, camera: &Camera) -> Self {
        Self {
            name: camera.name.clone(),
            observations: observations_directory(index),
            width: camera.pinhole.width,
            height: camera.pinhole.height,
            k: camera.opencv_matrix(),
            r: camera.opencv_rotation(),
            t: camera.opencv_translation(),
            distortion: camera.distortion.coefficients(),
            camera_from_world: RigidRecord::new(&camera.camera_from_world),
            near: camera.pinhole.near,
        }
    }

    fn camera(&self) -> Result<Camera, String> {
        let Self { k, r, t, distortion, width, height, .. } = *self;
        let mut camera =
            Camera::from_opencv(&self.name, k, r, t, distortion, width, height).map_err(|e| e.to_string())?;
        camera.camera_from_world = self.camera_from_world.transform()?;
        camera.pinhole.near = self.near;
        camera.validate().map_err(|e| e.to_string())?;
        let differ = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-9);
        if differ(r.as_flattened(), camera.opencv_rotation().as_flattened()) || differ(&t, &camera.opencv_translation())
        {
            return Err("R and t do not match camera_from_world".to_string());
        }
        Ok(camera)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_cameras;

    #[test]
    fn a_rig_is_read_back_to_the_bit_once_it_has_been_in_a_file() {
        let written = from_json(PATH, &to_json(&test_cameras::rig(), None).unwrap()).unwrap();
        assert_eq!(from_json(PATH, &to_json(&written, None).unwrap()).unwrap(), written);
        for (a, b) in test_cameras::rig().cameras.iter().zip(&written.cameras) {
            assert_eq!((&a.name, a.distortion, a.pinhole.focal), (&b.name, b.distortion, b.pinhole.focal));
            assert!((a.pinhole.principal_point[0] - b.pinhole.principal_point[0]).abs() < 1e-12);
        }
    }
}
