//! `[[rig.file]]`: cameras from other tools' files.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::UpwardAxis;
use crate::camera::{CameraFileFormat, CameraFileOptions};

/// The cameras of a file of another tool. They stand in the rig after the ring's and before those of `[[rig.camera]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraFileSettings {
    /// The file, relative to the scenario.
    pub path: String,
    /// `"opencv"`: OpenCV's YAML, one camera; `"humaneva"`: a `.cal`, one camera; `"qualisys"`: Qualisys' XML, all its
    /// cameras. Default: by the name's ending (`.yml`, `.yaml`; `.cal`; `.xml`, `.qca.txt`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<CameraFileKind>,
    /// Name of the camera. Default: what the file says, else the file's name without its ending.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Image width and height, pixels. Default: what the file says; a `.cal` does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_px: Option<[u32; 2]>,
    /// Length of the file's unit, metres. Default: 1 for OpenCV, 0.001 for the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_unit: Option<f64>,
    /// The upward axis of the file's world; Y up is turned to Z up, X stays. Default: Z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<UpwardAxis>,
    /// The row of `extrinsic_parameters`, from 0, that places the camera, for an OpenCV file without R and T. Default:
    /// none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<usize>,
}

/// A format of camera files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CameraFileKind {
    /// OpenCV's `FileStorage` in YAML.
    OpenCv,
    /// HumanEva's and PARSEC bodytrack's `.cal`.
    HumanEva,
    /// Qualisys' calibration in XML.
    Qualisys,
}

impl CameraFileSettings {
    /// The format, said or by the file's name.
    pub fn format(&self) -> Option<CameraFileFormat> {
        match self.format {
            Some(CameraFileKind::OpenCv) => Some(CameraFileFormat::OpenCv),
            Some(CameraFileKind::HumanEva) => Some(CameraFileFormat::HumanEva),
            Some(CameraFileKind::Qualisys) => Some(CameraFileFormat::Qualisys),
            None => CameraFileFormat::from_name(&self.path),
        }
    }

    /// What the file does not say.
    pub fn options(&self) -> CameraFileOptions {
        CameraFileOptions {
            name: self.name.clone(),
            size: self.size_px,
            metres_per_unit: self.metres_per_unit,
            y_up: self.up == Some(UpwardAxis::Y),
            view: self.view,
        }
    }
}
