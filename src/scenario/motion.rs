//! `[motion]` and `[training]`: recordings and the used parts of them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A recording and the used part of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionSettings {
    /// The clip: `embedded:walk`, `embedded:run` or `embedded:jump`; or a `.bvh`, `.amc` or DeepMimic (`.txt`, `.json`)
    /// file, by its path relative to the scenario, or by its name below `--mocap-dir` (or `SKIAGRAPH_MOCAP`).
    pub clip: String,
    /// The `.asf` skeleton of an `.amc` clip, located like the clip. Default: the clip's subject, `49.asf` for
    /// `49_01.amc`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skeleton: Option<String>,
    /// First frame used, as the file counts, from 1. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_frame: Option<usize>,
    /// Last frame used, inclusive, as the file counts. Default: the clip's last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_frame: Option<usize>,
    /// Frame rate of the set, Hz; the clip is resampled. Default: 60.
    #[serde(default = "default_frames_per_second")]
    pub frames_per_second: f64,
    /// Repeat the clip, each cycle continuing the previous one, until it lasts this long. Seconds. Default: the clip is
    /// played once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loop_to_s: Option<f64>,
    /// Length of the file's unit in metres. Default: defined by the format (CMU's Acclaim: 0.0254 / 0.45); for BVH
    /// guessed from motion and bones, with a note; required if no usual unit makes a body of 1.2 to 2.3 m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_unit: Option<f64>,
    /// The file's upward axis. Default: defined by the format; for BVH guessed from the skeleton, with a note.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<Axis>,
    /// Ground position `[x, y]` of the body's root in the first frame used: the motion is moved there. Metres. Default:
    /// as recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_m: Option<[f64; 2]>,
    /// Heading of the body in the first frame used, from +X towards +Y: the motion is turned about the vertical.
    /// Degrees. Default: the recording's heading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_deg: Option<f64>,
    /// Frame rate of a file that does not define it, Hz. Default: 120 for `.amc`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source_hz: Option<f64>,
    /// SHA-256 of the clip's file in hexadecimal; another file of that name is used, with a note. Default: not
    /// checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// Where the file can be obtained; part of the message when it is missing. Default: empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
}

/// The recordings that proposals and motion models are learned from. No frame of them may be a frame of the test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrainingSettings {
    /// One or several recordings or parts of them, each as in `[motion]` and at its rate: `[[training.clips]]`.
    pub clips: Vec<MotionSettings>,
}

/// An upward axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// The y axis, as in most recordings.
    Y,
    /// The z axis.
    Z,
}

impl MotionSettings {
    /// All of a clip, once, at 60 frames a second.
    pub fn of_clip(clip: &str) -> Self {
        Self {
            clip: clip.to_owned(),
            skeleton: None,
            first_frame: None,
            last_frame: None,
            frames_per_second: default_frames_per_second(),
            loop_to_s: None,
            metres_per_unit: None,
            up: None,
            start_m: None,
            heading_deg: None,
            source_hz: None,
            sha256: None,
            source: String::new(),
        }
    }
}

fn default_frames_per_second() -> f64 {
    60.0
}
