//! `[actor]`, `[tracker_body]` and `[[distractor]]`: the visible body, the tracker's body, and other people.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{MotionSettings, is_default};
use skiagraph_core::body::{Blending, Calibrated, Sex};

/// The body that the cameras see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ActorSettings {
    /// `actor`, `tracker25`, `tracker40`, or the path of a URDF file relative to the scenario. Its segments are scaled
    /// to the recorded subject. Without a skin, solids must cover at least half of its links. They must also span 70 %
    /// of the height from ankles to crown and 50 % of the reach from wrist to wrist. `check` and `inspect ROBOT` show
    /// the shares (`robots/README.md#how-much-of-a-robot-is-drawn`).
    pub robot: String,
    /// The robot's solids; masses and inertias are always the file's. Default: `"urdf"`.
    #[serde(skip_serializing_if = "is_default")]
    pub solids: SolidsSource,
    /// The surface that cameras see and the ground touches, deformed by the skeleton: `person` (5,000 triangles),
    /// `person_coarse` (1,000), `woman` or `man` (3,000), or the path of a `.glb`, `.gltf`, `.vrm` or `.toml`
    /// (`robots/README.md`). Masses, centres of mass and inertias are those of the volume inside the skin, at the
    /// body's mass. Self-collision and the solids of a simulation are the robot's. Default: the robot's solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin: Option<String>,
    /// Joints of the skin's file by landmark, as in `[motion]`: only what is not found, or found wrongly. `inspect`
    /// prints what is found. Default: found in the tree of joints.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    /// Stature, mass, lengths and girths of the person, given or drawn from a population: `{ population = "adults",
    /// seed = 3 }` (`scenarios/README.md#shape-of-the-actor`). Default: the recorded subject's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<ShapeSettings>,
    /// How a skin blends the transforms of several links. Default: `"linear"`.
    #[serde(skip_serializing_if = "is_default")]
    pub skin_blending: Blending,
    /// Contact of the motion with the ground, z = 0 (`scenarios/README.md#contact-with-the-ground`).
    pub contact: ContactMode,
    /// Coefficient of friction of a simulated body on the ground and against itself. Default: 0.8.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Greatest residual wrench at the root of a simulated body, body weights: it supplies what contact with the ground
    /// cannot (`scenarios/README.md#contact-with-the-ground`). A note reports how much was used. Default: 0, none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub root_wrench: Option<f64>,
    /// A push on a simulated body. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub push: Option<PushSettings>,
}

/// Another person in the scene. Images and silhouettes show them too, as background subtraction would, and they hide
/// the actor (`joint_sight` and `marker_sight` 2). Layers, joints, contacts and everything else in the truth describe
/// the actor alone. Bodies and motions of the others are in `truth/distractors.json` and `.npz`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistractorSettings {
    /// Unique name. Default: `distractor00` and so on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// As in `[actor]`.
    #[serde(default = "actor")]
    pub robot: String,
    /// As in `[actor]`. Default: `"urdf"`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub solids: SolidsSource,
    /// As in `[actor]`. Default: the robot's solids.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin: Option<String>,
    /// As in `[actor]`. Default: found in the tree of joints.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    /// The motion, at the frame rate of the scenario: `{ clip = "embedded:walk", start_m = [1.5, -1.0]
    /// }`. At its end the person stands still.
    pub motion: MotionSettings,
}

fn actor() -> String {
    "actor".to_owned()
}

/// The source of a robot's solids.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolidsSource {
    /// The `<visual>` or `<collision>` elements of its file.
    #[default]
    Urdf,
    /// Capsules from joint to joint, for robots with too little geometry or missing meshes. The file's geometry is not
    /// read.
    FromJoints,
}

impl SolidsSource {
    /// The name in scenarios.
    pub fn name(self) -> &'static str {
        match self {
            Self::Urdf => "urdf",
            Self::FromJoints => "from_joints",
        }
    }
}

/// A person: drawn from a population, given, or both (`scenarios/README.md#shape-of-the-actor`). Values that are not
/// given are the recorded subject's, or drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ShapeSettings {
    /// Population from which stature, mass, lengths and girths are drawn. Default: none, the recorded subject.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub population: Option<PopulationName>,
    /// Seed of the draw. Default: 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u32>,
    /// Sex of the drawn person; also determines the distribution of the mass over segments. Default: drawn, or as
    /// recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sex: Option<Sex>,
    /// Height from sole to crown, metres. Default: drawn, or as recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stature_m: Option<f64>,
    /// Mass of the body, kilograms. Default: drawn, or proportional to the volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// Lengths of segments, metres: `trunk`, `head`, `shoulder_width`, `hip_width`, `upper_arm`, `forearm`, `thigh`,
    /// `shank`, `foot`. Default: drawn, or as recorded.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub lengths_m: BTreeMap<String, f64>,
    /// Factors on girths, before all girths are scaled to the mass: `head`, `trunk`, `upper_arm`, `forearm`, `hand`,
    /// `thigh`, `shank`, `foot`. Default: 1.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub girths: BTreeMap<String, f64>,
}

/// A population.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PopulationName {
    /// Women and men with equal chance.
    Adults,
    /// Women.
    Women,
    /// Men.
    Men,
}

/// A push: a constant force for 0.1 s at a link's centre of mass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PushSettings {
    /// Start, seconds from the first frame, before the motion's end.
    pub at: f64,
    /// The actor's link, such as `thorax`.
    pub link: String,
    /// Force times time, N s.
    pub impulse_ns: f64,
    /// Direction in the world (Z up), any nonzero vector.
    #[serde(default = "sideways")]
    pub direction: [f64; 3],
}

fn sideways() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

/// Treatment of ground contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactMode {
    /// None: the motion is unchanged.
    #[default]
    Off,
    /// The motion is unchanged; notes report how much it skates, sinks and floats.
    Measure,
    /// Standing feet are planted and nothing is below the ground; notes report the changes.
    Fix,
    /// A physics simulation drives the body towards the fixed motion, and the simulated motion is the truth.
    Simulate,
}

/// The body that the tracker uses. The model is *matched* if it equals the actor's body in links, joints, geometry and
/// markers, regardless of file names; every report states it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TrackerBodySettings {
    /// `tracker25` (rigid trunk, no wrists or ankles), `tracker40` (a spine that bends, clavicles, wrists and ankles),
    /// `actor`, or the path of a URDF file relative to the scenario. Its segments are scaled to the recorded subject
    /// before the mismatch.
    pub robot: String,
    /// As in `[actor]`. Default: `"urdf"`.
    #[serde(skip_serializing_if = "is_default")]
    pub solids: SolidsSource,
    /// As in `[actor]`. Default: the robot's solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin: Option<String>,
    /// As in `[actor]`. Default: found in the tree of joints.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    /// How the tracker's body differs from the actor's.
    pub mismatch: Mismatch,
    /// Seed of the mismatch, separate from the tracker's seeds: all seeds of a run share one body.
    pub seed: u32,
    /// What the mismatch depends on. Default: `"seed"`.
    #[serde(skip_serializing_if = "is_default")]
    pub mismatch_by: MismatchBy,
    /// Whether the annealed particle filter calibrates its body and the cameras before tracking
    /// (`scenarios/README.md#calibrating-the-trackers-body`), or one of them: `"body"`, `"cameras"`. Other trackers
    /// keep their body. `track SET --calibrate` overrides it. Default: true, but false with `mismatch = "none"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibrate: Option<Calibrated>,
}

impl TrackerBodySettings {
    /// What the tracker calibrates. A body without a mismatch has nothing to correct.
    pub fn calibrated(&self) -> Calibrated {
        self.calibrate.unwrap_or((self.mismatch != Mismatch::None).into())
    }
}

/// Mismatch of the tracker's body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Mismatch {
    /// None.
    None,
    /// Lengths by up to 3 %, girths by up to 10 %.
    #[default]
    Standard,
    /// The lengths, girths and mass of another adult of the actor's stature, drawn by `seed` as `actor.shape` draws.
    Population,
    /// By up to these shares: `{ percent = { length = 3.0, girth = 10.0 } }`.
    #[serde(rename = "percent")]
    Percent {
        /// Greatest error of a segment's length, %.
        length: f64,
        /// Greatest error of a segment's girth, %.
        girth: f64,
    },
}

/// What a mismatch depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MismatchBy {
    /// The seed alone: the same factors for all subjects.
    #[default]
    Seed,
    /// The seed, the subject and `observation.key`. A subject is known by the lengths of arms and legs, to the
    /// millimetre.
    Subject,
}

impl Mismatch {
    /// Greatest error of lengths and of girths, %, or none.
    pub fn percents(self) -> Option<(f64, f64)> {
        match self {
            Self::None | Self::Population => None,
            Self::Standard => Some((3.0, 10.0)),
            Self::Percent { length, girth } => Some((length, girth)),
        }
    }
}

impl Default for ActorSettings {
    fn default() -> Self {
        Self {
            robot: actor(),
            solids: SolidsSource::Urdf,
            skin: None,
            joint_map: BTreeMap::new(),
            shape: None,
            skin_blending: Blending::Linear,
            contact: ContactMode::Off,
            friction: None,
            root_wrench: None,
            push: None,
        }
    }
}

impl Default for TrackerBodySettings {
    fn default() -> Self {
        Self {
            robot: "tracker40".to_owned(),
            solids: SolidsSource::Urdf,
            skin: None,
            joint_map: BTreeMap::new(),
            mismatch: Mismatch::Standard,
            seed: 1,
            mismatch_by: MismatchBy::Seed,
            calibrate: None,
        }
    }
}
