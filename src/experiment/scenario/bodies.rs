//! `[actor]` and `[tracker_body]`: the body that is seen and the body that the tracker believes in.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The body that is seen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ActorSettings {
    /// `actor`, `tracker25`, or the path of a URDF file relative to the scenario. Its segments are scaled to the recorded
    /// subject. Default: `actor`.
    pub robot: String,
    /// What contact with the ground does to the motion. `"off"`: nothing. `"measure"`: nothing, but
    /// the notes say how it skates, sinks and floats. `"fix"`: feet that stand are planted, nothing sinks, and what was moved is
    /// said. Default: `"off"`.
    pub contact: ContactMode,
}

/// What contact with the ground does to the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactMode {
    /// Nothing: the motion stays as it was recorded.
    #[default]
    Off,
    /// Nothing, but how it skates, sinks and floats is said.
    Measure,
    /// Standing feet are planted on the ground.
    Fix,
}

/// The body that the tracker believes in. The model counts as *matched* when it is the actor's robot without mismatch;
/// every report says which.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TrackerBodySettings {
    /// `tracker25`, `actor`, or the path of a URDF file relative to the scenario. Its segments are scaled to the recorded
    /// subject before the mismatch. Default: `tracker25`.
    pub robot: String,
    /// How wrong the tracker's measures of the subject are: `"none"`, `"standard"` or
    /// `{ percent = { length = 3.0, girth = 10.0 } }`. Default: `"standard"`.
    pub mismatch: Mismatch,
    /// Seed of the mismatch, apart from the tracker's seeds: all seeds of a run share one body. Default: 1.
    pub seed: u32,
}

/// How wrong the tracker's measures of the subject are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Mismatch {
    /// Not at all.
    None,
    /// Lengths by up to 3 %, girths by up to 10 %.
    #[default]
    Standard,
    /// By up to these shares.
    #[serde(rename = "percent")]
    Percent {
        /// Greatest error of a segment's length, %.
        length: f64,
        /// Greatest error of a segment's girth, %.
        girth: f64,
    },
}

impl Mismatch {
    /// Greatest error of lengths and of girths, %, or none.
    pub fn percents(self) -> Option<(f64, f64)> {
        match self {
            Self::None => None,
            Self::Standard => Some((3.0, 10.0)),
            Self::Percent { length, girth } => Some((length, girth)),
        }
    }
}

impl Default for ActorSettings {
    fn default() -> Self {
        Self { robot: "actor".to_owned(), contact: ContactMode::Off }
    }
}

impl Default for TrackerBodySettings {
    fn default() -> Self {
        Self { robot: "tracker25".to_owned(), mismatch: Mismatch::Standard, seed: 1 }
    }
}
