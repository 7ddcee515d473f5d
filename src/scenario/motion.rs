//! `[motion]` and `[training]`: recordings and the used parts of them.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::is_default;
use skiagraph_truth::editing::{JoinSettings, Variation};
use skiagraph_truth::mocap::{SidesInFile, UpAxis};
use skiagraph_truth::retarget::plausibility::GroundChoice;

/// A recording and the used part of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionSettings {
    /// The clip: `embedded:walk`, `embedded:run` or `embedded:jump`; or a `.bvh`, `.amc`, `.c3d`, `.trc`, DeepMimic
    /// (`.txt`, `.json`) or AMASS (`.npz`) file, or an animation in a `.glb`, `.gltf`, `.vrm` or `.vrma`, by its path
    /// relative to the scenario, or by its name below `--mocap-dir` (or `SKIAGRAPH_MOCAP`).
    pub clip: String,
    /// The `.asf` skeleton of an `.amc` clip, or the body model (`.npz`, such as `SMPLX_NEUTRAL.npz`) of an AMASS clip,
    /// located like the clip. Default: the clip's subject, `49.asf` for `49_01.amc`; an adult's proportions for AMASS.
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
    /// Repeat the clip until the motion lasts this long, seconds. Cyclic clips are repeated directly. Others return
    /// from their second half to their first where poses are most similar. Default: the clip is played once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loop_to_s: Option<f64>,
    /// Length of the file's unit in metres, which must give a body of 0.5 to 3 m. Default: defined by the format (CMU's
    /// Acclaim: 0.0254 / 0.45); for BVH guessed from motion and bones, with a note; required if no usual unit gives a
    /// body of 1.2 to 2.3 m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_unit: Option<f64>,
    /// The file's vertical axis. Default: defined by the format; for BVH and C3D files that do not state it, guessed,
    /// with a note; for TRC the axis along which the body stands, usually Y, with a note.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<UpAxis>,
    /// Ground position `[x, y]` to which the body's root is moved in the first frame used. Metres. Default: as
    /// recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_m: Option<[f64; 2]>,
    /// Heading to which the body is turned in the first frame used, from +X towards +Y. Degrees. `forward` in the set's
    /// `set.toml` has the result for the tracker's body (`docs/sets.md`). Default: the recording's heading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_deg: Option<f64>,
    /// Frame rate of a file that does not define it, or defines a wrong one, Hz. Default: 120 for `.amc`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source_hz: Option<f64>,
    /// Mirror the recording: left and right are exchanged. Joints are paired by name: `LeftArm`, `larm`, `arm_l`.
    /// Default: false.
    #[serde(default, skip_serializing_if = "is_default")]
    pub mirror: bool,
    /// What is wrong with left and right in the file, which is put right: `mirrored` if it is a mirror image, as axes
    /// that are left-handed make it, with the person's own names; `exchanged` if its names of left and right are
    /// exchanged. Default: `right`, nothing.
    #[serde(default, skip_serializing_if = "is_default")]
    pub sides: SidesInFile,
    /// The ground: `file` for height 0 of the file, `feet` for the plane beneath the soles. Default: `feet` if feet
    /// rest at one height, that of the whole file if they do not rest in the frames used; `file` if they rest at
    /// several heights, as on stairs, or never.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<GroundChoice>,
    /// Use a recording that no human body can perform (`scenarios/README.md#recordings-that-no-body-can-perform`).
    /// Every report then says so. Default: false.
    #[serde(default, skip_serializing_if = "is_default")]
    pub accept_implausible: bool,
    /// Play the recording this many times as fast. Stances are found at the recording's own speed (`actor.contact`);
    /// contacts in `truth/` and metrics keep their thresholds in m/s. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    /// Further takes, which the same body performs after the clip. Each is turned, moved over the ground and blended in
    /// where poses are nearest. A transition leaves the second half of a take and enters the first half of the next.
    /// Feet slide a little during a blend, so use `contact = "fix"`. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<TakeSettings>,
    /// How takes are joined.
    #[serde(default, skip_serializing_if = "is_default")]
    pub join: JoinSettings,
    /// Waypoints `[[x, y], ...]` on the ground, metres: the motion follows a smooth curve through them, from the first
    /// on. The body keeps its heading relative to the path, and continues straight after the last. It may turn by at
    /// most 45 degrees while a foot is in stance. Not with `start_m` or `heading_deg`. Default: the recorded path.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path_m: Vec<[f64; 2]>,
    /// Slow random variation of tempo, amplitude and posture. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variation: Option<Variation>,
    /// Number of frames after all editing: longer motions are cut at their end, shorter ones are refused. Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<usize>,
    /// Maps landmarks (HumanEva's fifteen, such as `left_knee`) to joints of the recording: `Joint`, `Joint:tip`, or
    /// `Joint+Joint` for the middle. `{ left_knee = "LeftShin", head_top = "Head:tip" }`. `skiagraph inspect` prints
    /// the map that was found. A missing crown or neck is placed by proportion, with a note. Default: found in the tree
    /// of joints by lengths and movement, whatever the joints are called; names break ties and tell left from right.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    /// Maps markers (`LKNE`) and landmarks (`left_knee`) to labels of a `.c3d` or `.trc` file: `{ LASI = "L_asis",
    /// left_knee = "knee_lat+knee_med" }`, with `+` for the middle of two. `KNEE#2` is the second of two points with
    /// the label `KNEE`. A message lists unknown labels. Parts of the upper body without markers are placed by
    /// proportion to the legs, with a note (`scenarios/README.md#accuracy-of-marker-files`). Default: by the labels of
    /// Plug-in Gait, CMU, OpenSim's gait models, Helen Hayes, Davis, IOR and joint centres, with any subject before the
    /// colon.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub marker_map: BTreeMap<String, String>,
    /// The subject whose markers of a `.c3d` or `.trc` file are used, if several people have the same: `Anna` for
    /// labels such as `Anna:LKNE`. Of a glTF file with several animations, the name of one. Default: the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subject: Option<String>,
    /// Stature of the subject of an AMASS clip without `skeleton`, metres. Default: the mean of adults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stature_m: Option<f64>,
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
    /// As in `[motion]`.
    pub clip: String,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skeleton: Option<String>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_frame: Option<usize>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_frame: Option<usize>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loop_to_s: Option<f64>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_unit: Option<f64>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<UpAxis>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source_hz: Option<f64>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub mirror: bool,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub sides: SidesInFile,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<GroundChoice>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub accept_implausible: bool,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub marker_map: BTreeMap<String, String>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subject: Option<String>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stature_m: Option<f64>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// As in `[motion]`.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
}

/// The recordings from which proposals and motion models are learned. No frame may be a frame of the test. Frames are
/// compared by content, whatever their name, format, rate or number. Without this table a set has only the root mean
/// squares of the test's frame-to-frame changes. They are enough for proposals, not for motion models.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrainingSettings {
    /// One or more recordings, at the rate of the set.
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
            sides: SidesInFile::Right,
            ground: None,
            accept_implausible: false,
            speed: None,
            then: Vec::new(),
            join: JoinSettings::default(),
            path_m: Vec::new(),
            variation: None,
            frames: None,
            joint_map: BTreeMap::new(),
            marker_map: BTreeMap::new(),
            subject: None,
            stature_m: None,
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
            sides: take.sides,
            ground: take.ground,
            accept_implausible: take.accept_implausible,
            speed: take.speed,
            joint_map: take.joint_map,
            marker_map: take.marker_map,
            subject: take.subject,
            stature_m: take.stature_m,
            sha256: take.sha256,
            source: take.source,
            ..MotionSettings::from_clip(&take.clip)
        }
    }
}

fn default_frames_per_second() -> f64 {
    60.0
}
