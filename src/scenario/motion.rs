//! `[motion]` and `[training]`: recordings and the used parts of them.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::is_default;
use crate::editing::{JoinSettings, Variation};
use crate::mocap::UpAxis;

/// A recording and the used part of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionSettings {
    /// The clip: `embedded:walk`, `embedded:run` or `embedded:jump`; or a `.bvh`, `.amc`, `.c3d`, `.trc` or DeepMimic
    /// (`.txt`, `.json`) file, by its path relative to the scenario, or by its name below `--mocap-dir` (or
    /// `SKIAGRAPH_MOCAP`).
    pub clip: String,
    /// The `.asf` skeleton of an `.amc` clip, located like the clip. Default: the clip's subject, `49.asf` for
    /// `49_01.amc`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skeleton: Option<String>,
    /// First frame used, numbered as in the file, from 1. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_frame: Option<usize>,
    /// Last frame used, inclusive, numbered as in the file. Default: the clip's last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_frame: Option<usize>,
    /// Frame rate of the set, Hz; the clip is resampled.
    #[serde(default = "default_frames_per_second")]
    pub frames_per_second: f64,
    /// Repeat the clip, each cycle continuing the previous one, until it lasts this long. Seconds. Cyclic clips are
    /// repeated directly; others with a transition from the second half back to the first half, where poses are most
    /// similar. Default: the clip is played once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loop_to_s: Option<f64>,
    /// Length of the file's unit in metres. Default: defined by the format (CMU's Acclaim: 0.0254 / 0.45); for BVH
    /// guessed from motion and bones, with a note; required if no usual unit gives a body of 1.2 to 2.3 m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_unit: Option<f64>,
    /// The file's vertical axis. Default: defined by the format; for BVH guessed from the skeleton, and for TRC, where
    /// it is usually Y, from the body, with a note.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<UpAxis>,
    /// Ground position `[x, y]` to which the body's root is moved in the first frame used. Metres. Default: as
    /// recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_m: Option<[f64; 2]>,
    /// Heading to which the body is turned in the first frame used, from +X towards +Y. Degrees. Default: the
    /// recording's heading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_deg: Option<f64>,
    /// Frame rate of a file that does not define it, Hz. Default: 120 for `.amc`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source_hz: Option<f64>,
    /// Mirror the recording: left and right are exchanged. Default: false.
    #[serde(default, skip_serializing_if = "is_default")]
    pub mirror: bool,
    /// Play the recording this many times as fast. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    /// Further takes, which the same body performs after the clip. Each is turned, moved over the ground and blended in
    /// where its poses are most similar to those of the take before: from the second half of that take to the first
    /// half of the new one. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<TakeSettings>,
    /// How takes are joined.
    #[serde(default, skip_serializing_if = "is_default")]
    pub join: JoinSettings,
    /// Waypoints `[[x, y], ...]` on the ground: the motion follows a smooth curve through them, beginning at the first.
    /// The body keeps its heading relative to the path, and continues straight after the last. Metres. Default: the
    /// recorded path.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path_m: Vec<[f64; 2]>,
    /// Slow random variation of tempo, amplitude and posture. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variation: Option<Variation>,
    /// Number of frames after all editing: longer motions are cut at their end, shorter ones are refused. Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<usize>,
    /// Maps landmarks (HumanEva's fifteen, such as `left_knee`) to joints of the recording: `Joint`, `Joint:tip`, or
    /// `Joint+Joint` for the middle. Default: by the joints' names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    /// Maps markers (`LKNE`) and landmarks (`left_knee`) to labels of a `.c3d` or `.trc` file, `A+B` for the middle of
    /// two. Default: by the labels of Plug-in Gait, CMU and joint centres.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub marker_map: BTreeMap<String, String>,
    /// SHA-256 of the clip's file in hexadecimal; a different file is used with a note. Default: not checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// Where the file can be obtained; part of the message when it is missing. Default: empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
}

// The keys of a recording are repeated here and in `MotionSettings`. A shared, flattened struct would lose the errors
// for unknown keys (serde does not combine `flatten` with `deny_unknown_fields`) and the order of the keys.
/// A further take: a recording and the used part of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TakeSettings {
    /// As `motion.clip`.
    pub clip: String,
    /// As `motion.skeleton`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skeleton: Option<String>,
    /// First frame used, numbered as in the file, from 1. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_frame: Option<usize>,
    /// Last frame used, inclusive, numbered as in the file. Default: the clip's last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_frame: Option<usize>,
    /// As `motion.loop_to_s`, for this take alone. Seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loop_to_s: Option<f64>,
    /// As `motion.metres_per_unit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_unit: Option<f64>,
    /// As `motion.up`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<UpAxis>,
    /// As `motion.source_hz`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source_hz: Option<f64>,
    /// Exchange left and right. Default: false.
    #[serde(default, skip_serializing_if = "is_default")]
    pub mirror: bool,
    /// Play the recording this many times as fast. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    /// As `motion.joint_map`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    /// As `motion.marker_map`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub marker_map: BTreeMap<String, String>,
    /// As `motion.sha256`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// As `motion.source`.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
}

/// The recordings from which proposals and motion models are learned. They must not share frames with the test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrainingSettings {
    /// One or more recordings, each with the keys of `[motion]` and at its frame rate: `[[training.clips]]`.
    pub clips: Vec<MotionSettings>,
}

impl MotionSettings {
    /// A whole clip, played once, at 60 frames per second.
    pub fn from_clip(clip: &str) -> Self {
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
            mirror: false,
            speed: None,
            then: Vec::new(),
            join: JoinSettings::default(),
            path_m: Vec::new(),
            variation: None,
            frames: None,
            joint_map: BTreeMap::new(),
            marker_map: BTreeMap::new(),
            sha256: None,
            source: String::new(),
        }
    }

    /// Every take with its key, beginning with the clip itself, as separate settings at the motion's rate.
    pub fn takes(&self, table: &str) -> Vec<(String, Self)> {
        let own = Self {
            then: Vec::new(),
            join: JoinSettings::default(),
            path_m: Vec::new(),
            variation: None,
            frames: None,
            start_m: None,
            heading_deg: None,
            ..self.clone()
        };
        let rate = self.frames_per_second;
        let further = self.then.iter().enumerate();
        let further = further.map(|(index, take)| (format!("{table}.then[{index}]"), take.at_rate(rate)));
        std::iter::once((table.to_owned(), own)).chain(further).collect()
    }
}

impl TakeSettings {
    fn at_rate(&self, frames_per_second: f64) -> MotionSettings {
        let take = self.clone();
        MotionSettings {
            skeleton: take.skeleton,
            first_frame: take.first_frame,
            last_frame: take.last_frame,
            frames_per_second,
            loop_to_s: take.loop_to_s,
            metres_per_unit: take.metres_per_unit,
            up: take.up,
            source_hz: take.source_hz,
            mirror: take.mirror,
            speed: take.speed,
            joint_map: take.joint_map,
            marker_map: take.marker_map,
            sha256: take.sha256,
            source: take.source,
            ..MotionSettings::from_clip(&take.clip)
        }
    }
}

fn default_frames_per_second() -> f64 {
    60.0
}
