//! `skiagraph.recording/1`: the files of a recording of a person, from which `skiagraph import` makes a set.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::diagnostic::{Diagnostic, LineSpan, locate};
use super::json_tree::TreeError;
use super::overrides::{full_key, keys_in};
use super::range_checks::{RangeCheck, require, within};
use super::ranges::{MOST_CAMERAS, camera_file, plain_name};
use super::read::{covers, set};
use super::tree::{settings_of, tree_of};
use super::{KeyError, ScenarioError};
use skiagraph_core::body::{Calibrated, KeypointLayout};
use skiagraph_core::camera::CameraFile;
use skiagraph_core::input::{self, limits};

/// A recording of a person by calibrated cameras that do not move: what `skiagraph import` reads
/// (`docs/recordings.md`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Recording")]
pub struct Recording {
    /// Version of this format.
    pub schema: RecordingTag,
    /// Short name: letters, digits, `-` and `_`.
    pub name: String,
    /// Rate of the images, frames per second.
    pub frames_per_second: f64,
    /// The first image of each camera that is used, counted from 0 in the order of their names.
    #[serde(default)]
    pub first_frame: usize,
    /// The last image that is used. Default: the last of all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_frame: Option<usize>,
    /// Numbers of images at the beginning of cameras that started before the others, by the name of the camera: they
    /// are left out, with their keypoints, and `first_frame` counts the images after them. Default: none.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub skip: BTreeMap<String, usize>,
    /// One pixel of the set is this many pixels of the images wide and high. People of 200 to 500 pixels are enough;
    /// more takes longer.
    #[serde(default = "one")]
    pub reduce: u32,
    /// The cameras.
    pub rig: RecordedRig,
    /// The masks of the person.
    pub masks: MaskSettings,
    /// What a 2D detector found in the images. Default: nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub keypoints: Option<RecordedKeypoints>,
    /// The body that trackers are given.
    #[serde(default)]
    pub tracker_body: RecordedBody,
    /// The pose that trackers start from.
    #[serde(default)]
    pub start: RecordedStart,
}

/// The version of the format of recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum RecordingTag {
    /// The only one so far.
    #[serde(rename = "skiagraph.recording/1")]
    V1,
}

/// The calibrated cameras of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecordedRig {
    /// Cameras from other tools' files.
    pub file: Vec<CameraFile>,
    /// Names of cameras that are left out. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub leave_out: Vec<String>,
}

/// Masks of the person: one image per camera and frame, PNG, JPEG, PPM or PGM; or a video per camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaskSettings {
    /// A folder with a folder or video of masks for each camera, of the camera's name; or as many as there are cameras,
    /// taken in the order of their names. The masks of a camera may also be in a folder `silhouette` there, as in the
    /// `observations` of a set. Videos (`.mp4`, `.mov`, `.avi`, `.mkv`, `.webm`, `.m4v`) are read by your ffmpeg.
    pub path: String,
    /// Pixels at least this bright are the person; white is 1.
    #[serde(default = "half")]
    pub threshold: f64,
    /// Whether the person is dark and the background bright. Default: false.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub inverted: bool,
    /// How images of another size than the calibration's came about.
    #[serde(default)]
    pub fit: ImageFit,
}

/// How images came about that have another size than those of the calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImageFit {
    /// They have the same size; others are refused.
    #[default]
    Same,
    /// Stretched to the other size.
    Scaled,
    /// Scaled alike in both directions until they fitted, with bars at two sides.
    Letterboxed,
    /// Cut at opposite sides alike.
    Cropped,
}

/// Keypoints of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecordedKeypoints {
    /// A folder with a folder of OpenPose's JSON for each camera, `NAME` or `NAME_json` as Pose2Sim has them, one file
    /// a frame, or with a file `NAME.json` of COCO's keypoints; one such file whose images name the camera in their
    /// path; or an `.npz` with `keypoints` (frames, cameras, points, 2), pixels with pixel centres at integers, and
    /// `confidence` (frames, cameras, points). COCO's images belong to the masks of the same name or number, or else of
    /// the same place in the order; without a list of images, `image_id` is the number. Of several people the one is
    /// taken in whom the cameras agree, and who is in the masks.
    pub path: String,
    /// Which points, in which order. Default: by their number: 17 are COCO's, 26 HALPE's, 25 OpenPose's, and 33
    /// MediaPipe's, which are stored as HALPE's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layout: Option<KeypointLayout>,
}

/// The body that trackers of a recording are given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RecordedBody {
    /// As in a scenario: `tracker25`, `tracker40`, `actor`, or the path of a URDF file.
    pub robot: String,
    /// As in a scenario, or `"none"` for the robot's own solids. Default: `"person_coarse"`.
    pub skin: Option<String>,
    /// Height of the person from sole to crown, metres. Default: estimated from the keypoints, else from the masks of
    /// the first frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stature_m: Option<f64>,
    /// Whether the annealed particle filter calibrates the body and the cameras before tracking, or one of
    /// them: `"body"`, `"cameras"`. A given stature is kept.
    pub calibrate: Calibrated,
}

/// The pose that trackers of a recording start from: upright, with the joint angles of the zero pose, where the hips of
/// the first frame are.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RecordedStart {
    /// Where the person faces in the first frame: the angle from X to Y, degrees. Default: by hips and shoulders of the
    /// keypoints, else by the masks, in which front and back look alike.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heading_deg: Option<f64>,
    /// The directory of a set whose `start` is taken as it is: its body, pose and spread. Then nothing is estimated.
    /// Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<String>,
}

fn one() -> u32 {
    1
}

fn half() -> f64 {
    0.5
}

impl Default for RecordedBody {
    fn default() -> Self {
        let skin = Some("person_coarse".to_owned());
        Self { robot: "tracker40".to_owned(), skin, stature_m: None, calibrate: Calibrated::Both }
    }
}

impl Recording {
    pub fn json_schema() -> Value {
        super::with_defaults(schemars::schema_for!(Self).to_value())
    }

    fn first_problem(&self) -> RangeCheck {
        plain_name("name", &self.name)?;
        within("frames_per_second", self.frames_per_second, 1.0..=10_000.0)?;
        within("reduce", self.reduce, 1..=64)?;
        let last = self.last_frame.unwrap_or(usize::MAX);
        require("last_frame", last >= self.first_frame, "first_frame or a later image", last)?;
        within("rig.file", self.rig.file.len(), 1..=MOST_CAMERAS)?;
        for (index, file) in self.rig.file.iter().enumerate() {
            camera_file(&format!("rig.file[{index}]"), file)?;
        }
        within("masks.threshold", self.masks.threshold, 0.001..=1.0)?;
        if let Some(stature) = self.tracker_body.stature_m {
            within("tracker_body.stature_m", stature, 0.5..=2.5)?;
        }
        within("start.heading_deg", self.start.heading_deg.unwrap_or_default(), -360.0..=360.0)
    }
}

/// A recording's file, and the folder that its paths are relative to.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingFile {
    pub recording: Recording,
    /// The file as named by the user.
    pub origin: String,
    pub folder: PathBuf,
    text: String,
    overrides: Vec<String>,
}

impl RecordingFile {
    /// Reads a recording; every override is `key=value` as for a scenario.
    pub fn open(path: &Path, overrides: &[String]) -> Result<Self, ScenarioError> {
        let text = input::read_to_string(path, limits::SETTINGS)
            .map_err(|source| ScenarioError::Unreadable { path: path.to_owned(), source })?;
        let origin = path.display().to_string();
        let mut tree = tree_of(&text, &origin)?;
        let folder = path.parent().map(Path::to_owned).unwrap_or_default();
        let schema = tree["schema"].as_str().unwrap_or_default();
        if !schema.starts_with("skiagraph.recording/") {
            let place = locate(&text, "schema").map(|spot| LineSpan::of_file(&text, &spot.value));
            let message = match schema.starts_with("skiagraph.scenario/") {
                true => "expected a recording, found a scenario; use skiagraph render FILE",
                false => "expected schema = \"skiagraph.recording/1\" (docs/recordings.md)",
            };
            let (key, message) = ("schema".to_owned(), message.to_owned());
            return Err(Diagnostic { origin, place, key, message, ..Diagnostic::default() }.into());
        }
        let keys = keys_in(&Recording::json_schema());
        let in_file = |mistake: TreeError| mistake.in_text(&origin, &text);
        let mut recording: Recording = settings_of(tree.clone()).map_err(in_file)?;
        let mut full = Vec::new();
        for assignment in overrides {
            let of_override = |message: String| Diagnostic::of_override(assignment, message);
            let (key, value) =
                assignment.split_once('=').ok_or_else(|| of_override("expected key=value".to_owned()))?;
            let key = full_key(key.trim(), &keys).map_err(of_override)?;
            full.push(format!("{key}={value}"));
            set(&mut tree, &format!("{key}={value}"))?;
            recording = settings_of(tree.clone()).map_err(|mistake| mistake.of_override(assignment))?;
        }
        recording.tracker_body.skin = recording.tracker_body.skin.filter(|skin| skin != "none");
        let file = Self { recording, folder, overrides: full, text: text.clone(), origin: origin.clone() };
        file.recording.first_problem().map_err(|problem| file.located(&problem))?;
        Ok(file)
    }

    /// An error at a key with its position in the file or in the override.
    pub(crate) fn located(&self, error: &KeyError) -> ScenarioError {
        let (key, message) = (error.key.clone(), error.message());
        if let Some(assignment) = self.overrides.iter().rev().find(|own| covers(own, &key)) {
            return Diagnostic { key, ..Diagnostic::of_override(assignment, message) }.into();
        }
        let place = locate(&self.text, &key).map(|spot| LineSpan::of_file(&self.text, &spot.value));
        Diagnostic { origin: self.origin.clone(), place, key, message, ..Diagnostic::default() }.into()
    }

    /// The paths that it names, for what must not be overwritten.
    pub(crate) fn paths(&self) -> BTreeMap<String, PathBuf> {
        let Recording { rig, masks, keypoints, start, .. } = &self.recording;
        let files = rig.file.iter().enumerate().map(|(index, file)| (format!("rig.file[{index}].path"), &file.path));
        let others = [
            ("masks.path", Some(&masks.path)),
            ("keypoints.path", keypoints.as_ref().map(|keypoints| &keypoints.path)),
            ("start.set", start.set.as_ref()),
        ];
        let others = others.into_iter().filter_map(|(key, path)| Some((key.to_owned(), path?)));
        files.chain(others).map(|(key, path)| (key, self.folder.join(path))).collect()
    }
}
