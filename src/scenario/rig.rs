//! `[rig]`: the cameras, as a ring, from other tools' files, or single.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use super::{CameraMotionSettings, CameraTimingSettings};
use skiagraph_core::camera::CameraFile;

/// The cameras: a ring, cameras from files, single cameras, or several of these (in this order). Default: a ring of
/// four.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigSettings {
    /// Cameras on a circle, all looking at one point. Default: none if there is a `[[rig.file]]` or
    /// `[[rig.camera]]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ring: Option<RingSettings>,
    /// Cameras from other tools' files. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub file: Vec<CameraFile>,
    /// Single cameras in OpenCV's convention. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub camera: Vec<CameraSettings>,
    /// Names of cameras that are left out, to measure the value of each: `["cam01"]`. Those of a ring are `cam00`,
    /// `cam01` and so on. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub leave_out: Vec<String>,
    /// Moving cameras, at most one entry for each. Default: all are static.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub motion: Vec<CameraMotionSettings>,
    /// When cameras take their images, at most one entry for each. Default: an image at every frame's time, all rows at
    /// once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub timing: Vec<CameraTimingSettings>,
}

/// Cameras at equal angles on a horizontal circle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RingSettings {
    /// Number of cameras.
    pub count: u32,
    /// Radius of the circle, metres.
    pub radius_m: f64,
    /// Height of the cameras above the ground, metres.
    pub height_m: f64,
    /// Centre of the ring, at which the cameras look: `[x, y, z]` in the world, metres. Default: 0.95 m above the
    /// middle of the actor's path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub look_at_m: Option<[f64; 3]>,
    /// Angle from the world's X axis to the first camera, degrees.
    pub first_azimuth_deg: f64,
    /// Angle over which the cameras are spread evenly, the first and the last at its ends, degrees. Default: a full
    /// circle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arc_deg: Option<f64>,
    /// Horizontal field of view, degrees.
    pub field_of_view_deg: f64,
    /// Image width and height, pixels.
    pub size_px: [u32; 2],
}

/// One camera, in the convention of OpenCV: x right, y down, z forward, pixel (0, 0) the centre of the top-left pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSettings {
    /// Name. Default: `camNN`, with its index in the rig.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Image width and height, pixels.
    pub size_px: [u32; 2],
    /// Intrinsic matrix K, rows: `[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]`, pixels.
    pub matrix: [[f64; 3]; 3],
    /// Rotation R of `p_in_camera = R p_in_world + t`, rows. It may be rounded, to three digits or more, here and in
    /// files: the nearest rotation is taken.
    pub rotation: [[f64; 3]; 3],
    /// Translation t of `p_in_camera = R p_in_world + t`, metres.
    pub translation_m: [f64; 3],
    /// Lens distortion k1, k2, p1, p2, k3. Default: none.
    #[serde(default)]
    pub distortion: [f64; 5],
}

/// Reads a rig; one without cameras gets the default ring.
pub(super) fn with_cameras<'de, D: Deserializer<'de>>(written: D) -> Result<RigSettings, D::Error> {
    let rig = RigSettings::deserialize(written)?;
    let is_without = rig.ring.is_none() && rig.file.is_empty() && rig.camera.is_empty();
    Ok(if is_without { RigSettings { ring: RigSettings::default().ring, ..rig } } else { rig })
}

impl Default for RigSettings {
    fn default() -> Self {
        Self {
            ring: Some(RingSettings::default()),
            file: Vec::new(),
            camera: Vec::new(),
            leave_out: Vec::new(),
            motion: Vec::new(),
            timing: Vec::new(),
        }
    }
}

impl Default for RingSettings {
    fn default() -> Self {
        Self {
            count: 4,
            radius_m: 4.5,
            height_m: 1.6,
            look_at_m: None,
            first_azimuth_deg: 45.0,
            arc_deg: None,
            field_of_view_deg: 60.0,
            size_px: [640, 480],
        }
    }
}

impl RigSettings {
    /// Number of cameras. A file counts as one, because its number of cameras is only known when it is read.
    pub fn count(&self) -> usize {
        let all = self.ring.as_ref().map_or(0, |r| r.count as usize) + self.file.len() + self.camera.len();
        all.saturating_sub(self.leave_out.len())
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use crate::scenario::ScenarioFile;

    #[test]
    fn only_a_rig_without_cameras_gets_the_ring_of_four() {
        let count = |rig: &str| {
            let text =
                format!("schema = \"skiagraph.scenario/1\"\nname = \"a\"\n[motion]\nclip = \"embedded:walk\"\n{rig}");
            ScenarioFile::parse(&text, "text", PathBuf::new(), &[]).unwrap().scenario.rig.count()
        };
        assert_eq!(count(""), 4);
        assert_eq!(count("[rig]\n"), 4);
        assert_eq!(count("[rig]\nleave_out = [\"cam01\"]\n"), 3);
        assert_eq!(count("[rig.ring]\ncount = 2\n"), 2);
        assert_eq!(count("[[rig.file]]\npath = \"cameras.xml\"\n"), 1);
    }
}
