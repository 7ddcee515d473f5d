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
    /// First frame used, as the file counts, from 1. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_frame: Option<usize>,
    /// Last frame used, inclusive, as the file counts. Default: the clip's last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_frame: Option<usize>,
    /// Frame rate of the set, Hz; the clip is resampled.
    #[serde(default = "default_frames_per_second")]
    pub frames_per_second: f64,
    /// Repeat the clip, each cycle continuing the previous one, until it lasts this long. Seconds. A clip that is one
    /// cycle is repeated as such; any other by a transition from its second half back into its first, where its poses
    /// are most alike. Default: the clip is played once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loop_to_s: Option<f64>,
    /// Length of the file's unit in metres. Default: defined by the format (CMU's Acclaim: 0.0254 / 0.45); for BVH
    /// guessed from motion and bones, with a note; required if no usual unit makes a body of 1.2 to 2.3 m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_unit: Option<f64>,
    /// The file's upward axis. Default: defined by the format; with a note for BVH, guessed from the skeleton, and for
    /// TRC, usually Y, from the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<UpAxis>,
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
    /// Exchange left and right: the recording in a mirror. Default: false.
    #[serde(default, skip_serializing_if = "is_default")]
    pub mirror: bool,
    /// Play the recording this many times as fast. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    /// Further takes, performed one after another behind the clip by the same body: each is turned and moved over the
    /// ground and blended in where its poses are nearest to those of the take before, which is left in its second half
    /// and entered in its first. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<TakeSettings>,
    /// How takes are joined.
    #[serde(default, skip_serializing_if = "is_default")]
    pub join: JoinSettings,
    /// Waypoints `[[x, y], ...]` on the ground that the motion is led along, from the first on, by a smooth curve; the
    /// body faces along it as it faced along its recorded way, and goes straight on after the last. Metres. Default:
    /// the recorded way.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path_m: Vec<[f64; 2]>,
    /// Slow random drifts of tempo, amplitude and posture. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variation: Option<Variation>,
    /// Number of frames of the motion, after all editing: what is longer is cut at its end, what is shorter is refused.
    /// Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<usize>,
    /// Landmark (`left_knee` and so on, HumanEva's fifteen) to the joint of the recording that it follows: `Joint`,
    /// `Joint:tip`, or `Joint+Joint` for the middle. Default: by the joints' names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    /// Markers (`LKNE`) and landmarks (`left_knee`) to the labels of a `.c3d` or `.trc` file that they are, `A+B` for
    /// the middle of two. Default: by the labels of Plug-in Gait, CMU and joint centres.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub marker_map: BTreeMap<String, String>,
    /// SHA-256 of the clip's file in hexadecimal; another file of that name is used, with a note. Default: not
    /// checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// Where the file can be obtained; part of the message when it is missing. Default: empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
}

// The keys of a recording stand here and in `MotionSettings`. One struct for both, flattened, would lose what unknown
// keys are answered with (serde does not combine `flatten` with `deny_unknown_fields`) and the order of the keys.
/// A further take: a recording and the used part of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TakeSettings {
    /// As `motion.clip`.
    pub clip: String,
    /// As `motion.skeleton`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skeleton: Option<String>,
    /// First frame used, as the file counts, from 1. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_frame: Option<usize>,
    /// Last frame used, inclusive, as the file counts. Default: the clip's last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_frame: Option<usize>,
    /// As `motion.loop_to_s`, of this take alone. Seconds.
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

/// The recordings that proposals and motion models are learned from. No frame of them may be a frame of the test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrainingSettings {
    /// One or several recordings or parts of them, each as in `[motion]` and at its rate: `[[training.clips]]`.
    pub clips: Vec<MotionSettings>,
}

impl MotionSettings {
    /// All of a clip, once, at 60 frames a second.
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

    /// Every take with its key, the clip itself first, as settings of their own at the motion's rate.
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
