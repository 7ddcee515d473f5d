//! `[actor]`, `[tracker_body]` and `[[distractor]]`: the visible body, the tracker's body, and other people.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{MotionSettings, is_default};
use crate::body::{Blending, Sex};

/// The body that the cameras see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ActorSettings {
    /// `actor`, `tracker25`, `tracker40`, or the path of a URDF file relative to the scenario. Its segments are scaled
    /// to the recorded subject.
    pub robot: String,
    /// The robot's solids: `"urdf"`, the `<visual>` or `<collision>` elements of its file; or `"from_joints"`, capsules
    /// from joint to joint, for robots with too few solids or missing meshes. Masses and inertias are always the
    /// file's. Default: `"urdf"`.
    #[serde(skip_serializing_if = "is_default")]
    pub solids: SolidsSource,
    /// The surface that cameras see and the ground touches: `person` (5,000 triangles), `person_coarse` (1,000), or the
    /// path of a `.glb`, `.gltf` or `.toml` relative to the scenario (`robots/README.md`). Default: the robot's solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin: Option<String>,
    /// Stature, mass, lengths and girths of the person, given or drawn from a population. Default: the recorded
    /// subject's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<ShapeSettings>,
    /// How the transforms of several links are blended. Default: `"linear"`.
    #[serde(skip_serializing_if = "is_default")]
    pub skin_blending: Blending,
    /// Treatment of ground contact. `"off"`: none. `"measure"`: the motion is unchanged; notes report how much it
    /// skates, sinks and floats. `"fix"`: standing feet are planted and nothing is below the ground; notes report the
    /// changes. `"simulate"`: a physics simulation drives the body towards the fixed motion; the simulated motion is
    /// the ground truth.
    pub contact: ContactMode,
    /// Coefficient of friction of a simulated body on the ground and against itself. Default: 0.8.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Greatest residual wrench at the root, body weights, that may act at the root of a simulated body in addition to
    /// contact forces; a note reports how much was used. Default: 0, none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub root_wrench: Option<f64>,
    /// A push on a simulated body. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub push: Option<PushSettings>,
}

/// Another person in the scene, who appears in silhouettes and images and may hide the actor. Trackers do not estimate
/// them, and contacts with them are ignored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistractorSettings {
    /// Unique name. Default: `distractor00` and so on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// `actor`, `tracker25`, `tracker40`, or the path of a URDF file relative to the scenario.
    #[serde(default = "actor")]
    pub robot: String,
    /// The robot's solids, as `actor.solids`. Default: `"urdf"`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub solids: SolidsSource,
    /// The surface, as `actor.skin`. Default: the robot's solids.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin: Option<String>,
    /// The motion, with the keys of `[motion]` and at its frame rate. At its end the person stands still.
    pub motion: MotionSettings,
}

fn actor() -> String {
    "actor".to_owned()
}

/// The source of a robot's solids.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolidsSource {
    /// The geometry of its file.
    #[default]
    Urdf,
    /// Capsules from joint to joint.
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

/// A person: drawn from a population, given, or both. Values that are not given are the recorded subject's, or drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ShapeSettings {
    /// Population from which stature, mass, lengths and girths are drawn. Default: none, the recorded subject.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub population: Option<PopulationName>,
    /// Seed of the draw. Default: 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u32>,
    /// Age of a child or youth, years, 2 to 20, by the growth charts of the United States; not valid with adults.
    /// Default: drawn, with `population = "children"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub age_years: Option<f64>,
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
    /// Girls and boys of 2 to 20 years, in an adult's proportions.
    Children,
}

/// A push: a constant force for 0.1 s at a link's centre of mass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PushSettings {
    /// Start, seconds from the first frame.
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
    /// Standing feet are planted on the ground.
    Fix,
    /// A physics simulation drives the body towards the fixed motion.
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
    /// The robot's solids, as `actor.solids`. Default: `"urdf"`.
    #[serde(skip_serializing_if = "is_default")]
    pub solids: SolidsSource,
    /// The surface of the tracker's body, as `actor.skin`. Default: the robot's solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin: Option<String>,
    /// Mismatch of the tracker's body: `"none"`, `"standard"`, `"population"` (another adult of the actor's stature) or
    /// `{ percent = { length = 3.0, girth = 10.0 } }`.
    pub mismatch: Mismatch,
    /// Seed of the mismatch, separate from the tracker's seeds: all seeds of a run share one body.
    pub seed: u32,
    /// What the mismatch depends on: `"seed"`, the same factors for all subjects; or `"subject"`, different factors for
    /// every subject, identified by the lengths of the limbs, and for every `observation.key`. Default: `"seed"`.
    #[serde(skip_serializing_if = "is_default")]
    pub mismatch_by: MismatchBy,
    /// Whether the tracker calibrates its body first: lengths, girths, joint positions and one offset in mm added to
    /// all radii (with a skin: along its normals) are fitted to the observed outlines, together with the poses of 20
    /// frames from the beginning, a fifteenth of a second apart, separately for every seed. A test on later frames
    /// decides whether the calibrated body is used; the run reports the decision and the result. Only for the annealed
    /// particle filter. Default: true, but false with `mismatch = "none"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibrate: Option<bool>,
}

impl TrackerBodySettings {
    /// Whether the tracker calibrates its body. A body without a mismatch has nothing to correct.
    pub fn is_calibrated(&self) -> bool {
        self.calibrate.unwrap_or(self.mismatch != Mismatch::None)
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
    /// The lengths, girths and mass of another adult of the actor's stature, drawn from the population of
    /// `actor.shape`.
    Population,
    /// By up to these shares.
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
    /// The seed alone.
    #[default]
    Seed,
    /// The seed, the subject and the observation's key.
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
            mismatch: Mismatch::Standard,
            seed: 1,
            mismatch_by: MismatchBy::Seed,
            calibrate: None,
        }
    }
}
