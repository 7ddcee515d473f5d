//! User settings for properties that a file does not define, or defines wrongly.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use super::MocapError;
pub use skiagraph_core::camera::UpAxis;

/// Highest accepted frame rate, above that of any recording.
pub(super) const MAX_RATE: f64 = 1e5;

/// Who says which axis of a file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpSource {
    /// The user.
    User,
    /// The file or its format.
    #[default]
    File,
    /// Nobody: guessed from the body.
    Guess,
}

/// What is wrong with left and right in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SidesInFile {
    /// Nothing.
    #[default]
    Right,
    /// The file is a mirror image, as axes that are left-handed make it; names are those of the person.
    Mirrored,
    /// The names of left and right are exchanged.
    Exchanged,
}

/// Overrides for properties that a file does not define, or defines wrongly. Unset ones are taken from the file, or
/// guessed with an entry in [`super::Clip::notes`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Frames per second. Default 120 for AMC files, which do not define it.
    pub frames_per_second: Option<f64>,
    /// Length of the file's unit, metres.
    pub metres_per_unit: Option<f64>,
    /// The file's up axis.
    pub up: Option<UpAxis>,
    /// What is wrong with left and right in the file.
    pub sides: SidesInFile,
    /// The `.asf` file of an `.amc` file (default: `SUBJECT.asf` beside `SUBJECT_TAKE.amc`, else the folder's only
    /// `.asf`), or the body model of an `.npz` file.
    pub skeleton: Option<PathBuf>,
    /// Keep a rest pose inserted before the motion ([`super::Clip::has_inserted_rest_pose`]).
    pub keep_rest_pose: bool,
    /// Map from marker or landmark to the label of a C3D or TRC file, `A+B` for the midpoint of two labels; in addition
    /// to labels recognised by name.
    pub markers: BTreeMap<String, String>,
    /// The subject of a C3D or TRC file whose labels are used: `Anna` of `Anna:LKNE`; needed if several have the same
    /// markers. The name of an animation of a glTF file that has several.
    pub subject: Option<String>,
    /// Frames that are used, counted from 0. Markers must be seen in these alone; other frames repeat the nearest one.
    pub used_frames: Option<Range<usize>>,
    /// Stature of the subject, metres, for a file of AMASS or SMPL without its body model. Default: the mean of adults.
    pub stature_m: Option<f64>,
}

impl ReadOptions {
    /// Rejects impossible rates and units.
    pub(super) fn check(&self) -> Result<(), MocapError> {
        check_within("frames_per_second", self.frames_per_second, 1e-3..=MAX_RATE)?;
        check_within("metres_per_unit", self.metres_per_unit, 1e-6..=1e3)?;
        check_within("stature_m", self.stature_m, 0.5..=3.0)
    }
}

fn check_within(
    setting: &'static str,
    value: Option<f64>,
    allowed: std::ops::RangeInclusive<f64>,
) -> Result<(), MocapError> {
    match value {
        Some(value) if !allowed.contains(&value) => {
            let expected = format!("a number from {} to {}", allowed.start(), allowed.end());
            Err(MocapError::of_setting(setting, expected, value))
        }
        _ => Ok(()),
    }
}
