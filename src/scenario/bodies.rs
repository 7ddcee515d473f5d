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
    /// said. `"simulate"`: the body is driven towards the fixed motion in a simulation, on the ground, under gravity, and what it
    /// does there is the truth. Default: `"off"`.
    pub contact: ContactMode,
    /// Coefficient of friction of a simulated body on the ground and against itself. Default: 0.8.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Greatest residual wrench at the root, body weights, that helps a simulated body to follow the motion ("training
    /// wheels"); how much of it was used is said. Default: 0, none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub root_wrench: Option<f64>,
    /// What hits a simulated body. Default: nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub push: Option<PushSettings>,
}

/// A push: a constant force for 0.1 s at a link's centre of mass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PushSettings {
    /// When it begins, seconds from the first frame.
    pub at: f64,
    /// The actor's link, such as `thorax`.
    pub link: String,
    /// Force times time, N s.
    pub impulse_ns: f64,
    /// Where to, in the world (X ahead of a motion that starts forwards, Z up); any length but zero. Default: `[0, 1, 0]`.
    #[serde(default = "sideways")]
    pub direction: [f64; 3],
}

fn sideways() -> [f64; 3] {
    [0.0, 1.0, 0.0]
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
    /// The body is driven towards the fixed motion in a simulation.
    Simulate,
}

/// The body that the tracker believes in. The model counts as *matched* when it is the actor's body in links, joints,
/// flesh and markers, whatever the files are called; every report says which.
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
        Self { robot: "actor".to_owned(), contact: ContactMode::Off, friction: None, root_wrench: None, push: None }
    }
}

impl Default for TrackerBodySettings {
    fn default() -> Self {
        Self { robot: "tracker25".to_owned(), mismatch: Mismatch::Standard, seed: 1 }
    }
}
