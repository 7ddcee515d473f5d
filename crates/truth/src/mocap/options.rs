//! User settings for properties that a file does not define, or defines wrongly.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::MocapError;

/// Highest accepted frame rate, above that of any recording.
pub(super) const MAX_RATE: f64 = 1e5;

/// The up axis of a file's world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// The second axis, as in most recordings.
    Y,
    /// The third axis.
    Z,
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
    /// The `.asf` file of an `.amc` file. Default: `SUBJECT.asf` beside `SUBJECT_TAKE.amc`, else the folder's only
    /// `.asf`.
    pub skeleton: Option<PathBuf>,
    /// Keep a rest pose inserted before the motion ([`super::Clip::has_inserted_rest_pose`]).
    pub keep_rest_pose: bool,
    /// Map from marker or landmark to the label of a C3D or TRC file, `A+B` for the midpoint of two labels; in addition
    /// to labels recognised by name.
    pub markers: BTreeMap<String, String>,
}

impl ReadOptions {
    /// Rejects impossible rates and units.
    pub(super) fn check(&self) -> Result<(), MocapError> {
        check_within("frames_per_second", self.frames_per_second, 1e-3..=MAX_RATE)?;
        check_within("metres_per_unit", self.metres_per_unit, 1e-6..=1e3)
    }
}

fn check_within(
    setting: &'static str,
    value: Option<f64>,
    allowed: std::ops::RangeInclusive<f64>,
) -> Result<(), MocapError> {
    match value {
        Some(value) if !allowed.contains(&value) => Err(MocapError::Setting {
            setting,
            expected: format!("a number from {} to {}", allowed.start(), allowed.end()),
            found: value.to_string(),
        }),
        _ => Ok(()),
    }
}
