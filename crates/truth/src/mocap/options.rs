//! What the user says of a file that the file leaves open, or gets wrong.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::MocapError;

/// Above the rate of any recording.
pub(super) const GREATEST_RATE: f64 = 1e5;

/// The axis of a file's world that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// The second axis, as in most recordings.
    Y,
    /// The third axis.
    Z,
}

/// What a file may leave open, or get wrong. Everything unset is taken from the file, or guessed and said in
/// [`super::Clip::notes`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Frames a second. 120 for AMC files, which do not define it.
    pub frames_per_second: Option<f64>,
    /// Length of the file's unit, metres.
    pub metres_per_unit: Option<f64>,
    /// The file's up axis.
    pub up: Option<UpAxis>,
    /// The `.asf` file of an `.amc` file; unset: `SUBJECT.asf` beside `SUBJECT_TAKE.amc`, else the only one there.
    pub skeleton: Option<PathBuf>,
    /// Keep a rest pose that was put before the motion ([`super::Clip::has_inserted_rest_pose`]).
    pub keep_rest_pose: bool,
    /// Markers and landmarks of a C3D or TRC file to its labels, `A+B` for the middle of two; beside those that are
    /// known by their names.
    pub markers: BTreeMap<String, String>,
}

impl ReadOptions {
    /// Refuses impossible rates and units.
    pub(super) fn check(&self) -> Result<(), MocapError> {
        check_within("frames_per_second", self.frames_per_second, 1e-3..=GREATEST_RATE)?;
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
