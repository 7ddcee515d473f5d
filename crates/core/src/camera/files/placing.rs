//! From a camera as a file has it to one in this crate's world.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::{CameraFileFormat, PlainCamera, transposed};
use crate::camera::{Camera, CameraError, FieldOfView, UpAxis};
use crate::input::excerpt;

/// The cameras of another tool's file, and what that file may lack. In the rig they follow the ring's cameras and
/// precede those of `[[rig.camera]]`.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// The file, relative to the scenario: one of the two of COLMAP, EasyMocap and `stereo_calib`, the other is read
    /// with it; or a folder, all of whose camera files are read.
    pub path: String,
    /// The program that wrote the file. Default: by its content, else by its name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<CameraFileFormat>,
    /// Name of the camera, in files with one. Default: the name in the file, else the file's name without its
    /// extension.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Image width and height, pixels. Default: the size in the file, which it must not contradict.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_px: Option<[u32; 2]>,
    /// Width and height of the images that the file's K is of, pixels: K is scaled to the size of the images. Default:
    /// that size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibrated_at_px: Option<[u32; 2]>,
    /// Length of the file's unit, metres. Default: 0.001 for HumanEva, Qualisys, JARVIS, Human3.6M, and TOML whose
    /// board has squares in millimetres; 1 for the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_unit: Option<f64>,
    /// The axis of the file's world that points up; it is turned to Z. Default: Z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<UpAxis>,
    /// What the file's rotations and translations transform. Default: from the world to the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseDirection>,
    /// Where the file's first camera is; the others keep their places relative to it. Default: where the file says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_camera: Option<FirstCamera>,
    /// The row of `extrinsic_parameters`, from 0, with the camera's pose, for an OpenCV file without R and T; the image
    /// of each camera of COLMAP that moves. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<usize>,
    /// Whose poses are read from a file of Human3.6M with those of several subjects. Default: the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subject: Option<String>,
}

/// What a rotation R and a translation t of a camera file do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PoseDirection {
    /// `p_in_camera = R p_in_world + t`.
    WorldToCamera,
    /// `p_in_world = R p_in_camera + t`: t is where the camera is.
    CameraToWorld,
}

/// Where the first camera of a file is, in the world with Z up.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FirstCamera {
    /// Its centre, metres.
    pub position_m: [f64; 3],
    /// The point at the centre of its view, metres. The camera is level.
    pub look_at_m: [f64; 3],
}

impl PlainCamera {
    /// The camera in metres in a world with Z up.
    pub(super) fn placed(self, options: &CameraFile) -> Result<Camera, String> {
        let name = options.name.clone().or(self.name).unwrap_or_default();
        let shown = || if name.is_empty() { "the camera".to_owned() } else { format!("camera {:?}", excerpt(&name)) };
        let [width, height] = match (self.size, options.size_px) {
            (Some(own), Some(given)) if own != given => {
                let found = format!("the file has {own:?} pixels for {}", shown());
                return Err(format!("size_px: {found}, not {given:?}; remove this key"));
            }
            (Some(size), _) | (None, Some(size)) => size,
            (None, None) => {
                return Err(format!("size_px: the file lacks the image size of {}; add this key", shown()));
            }
        };
        let mut k = self.k;
        if let Some(calibrated) = options.calibrated_at_px {
            for (row, (size, of_k)) in k.iter_mut().zip([width, height].into_iter().zip(calibrated)) {
                let scale = f64::from(size) / f64::from(of_k);
                *row = row.map(|entry| entry * scale);
                // the corner of the image stays where it is, and pixel 0 is half a pixel from it
                row[2] += 0.5 * scale - 0.5;
            }
        }
        let unit = options.metres_per_unit.unwrap_or(self.metres_per_unit);
        let (mut r, mut t) = (self.r, self.t);
        if options.pose == Some(PoseDirection::CameraToWorld) {
            r = transposed(r);
            t = (-(Matrix3::from_row_slice(r.as_flattened()) * Vector3::from(t))).into();
        }
        // rows of R are the camera's axes in the world
        let up = options.up.unwrap_or_default();
        let r = r.map(|axis| up.upright(&axis.into()).into());
        let camera = Camera::from_opencv(&name, k, r, t.map(|t| t * unit), self.distortion, width, height);
        camera.map_err(|e: CameraError| e.to_string())
    }
}

/// Moves the world so that the first of the cameras is at `first`.
pub fn with_first_camera(mut cameras: Vec<Camera>, first: Option<&FirstCamera>) -> Result<Vec<Camera>, String> {
    let (Some(first), Some(own)) = (first, cameras.first()) else { return Ok(cameras) };
    let (eye, target) = (Point3::from(first.position_m), Point3::from(first.look_at_m));
    let view = Camera::look_at(&own.name, eye, target, Vector3::z(), FieldOfView::Vertical(1.0), 2, 2);
    let view = view.map_err(|e| format!("first_camera: {e}"))?;
    let file_from_world: Isometry3<f64> = own.camera_from_world.inverse() * view.camera_from_world;
    for camera in &mut cameras {
        camera.camera_from_world *= file_from_world;
        camera.validate().map_err(|e| e.to_string())?;
    }
    Ok(cameras)
}
