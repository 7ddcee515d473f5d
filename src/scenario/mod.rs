//! A scenario: the definition of one experiment, as in `scenarios/*.toml`.
//!
//! The doc comments of these types are the documentation of the file format: `skiagraph schema` prints them. Lengths
//! are metres, times seconds, angles of the file degrees (and then in the name); frame numbers are those of the clip's
//! file, from 1. Key by key the file is checked by type here and by range in `Scenario::first_problem`.
//!
//! ```
//! use skiagraph::scenario::ScenarioFile;
//! let text = r#"
//! schema = "skiagraph.scenario/1"
//! name = "short"
//! motion.clip = "embedded:walk"
//! tracker.frozen = {}
//! "#;
//! let file = ScenarioFile::parse(text, "short.toml", ".".into(), &["seeds=3".to_owned()])?;
//! assert_eq!(file.scenario.all_seeds().count(), 3);
//! let wrong = ScenarioFile::parse(text, "short.toml", ".".into(), &["seedz=3".to_owned()]);
//! println!("{}", wrong.unwrap_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bodies;
mod camera_file;
mod complaint;
mod distractor;
mod filming;
pub(crate) mod json_tree;
mod latent;
mod methods;
mod motion;
mod named_on_command_line;
mod negative_numbers;
mod override_keys;
mod override_value;
mod props;
mod range_checks;
mod ranges;
mod read;
mod rig;
mod similar_file;
mod survey;
mod template;
mod tracker;
mod tracker_kind;
mod tracker_ranges;
mod tree;

pub use bodies::{
    ActorSettings, ContactMode, Mismatch, MismatchBy, PopulationName, PushSettings, SexName, ShapeSettings,
    SkinBlending, SolidsSource, TrackerBodySettings,
};
pub use camera_file::{CameraFileKind, CameraFileSettings};
pub use complaint::{Diagnostic, LineSpan};
pub(crate) use complaint::{did_you_mean, locate};
pub use distractor::DistractorSettings;
pub use filming::{CameraMotionSettings, CameraTimingSettings, KeyframeSettings};
pub use latent::{
    GpdmGraphSettings, GpdmSettings, LatentKind, LatentRefinementSettings, LatentTrackerSettings, RootMode,
    SwitchingGpdmSettings,
};
pub use motion::{JoinKeys, MotionSettings, TakeSettings, TrainingSettings, UpwardAxis, VariationSettings};
pub(crate) use named_on_command_line::NamedOnCommandLine;
pub use override_value::as_toml;
pub(crate) use override_value::{parse_value, split_at_commas};
pub use props::{PropSettings, PropShape};
pub use range_checks::InvalidValue;
pub(crate) use ranges::MOST_SEEDS;
pub use read::{DEFAULT_SCENARIO, ScenarioError, ScenarioFile};
pub use rig::{CameraSettings, RigSettings, RingSettings};
pub(crate) use similar_file::similar_file;
pub use survey::{Survey, survey};
pub use template::ScenarioTemplate;
pub use tracker::{
    AnnealedParticleFilterSettings, FrozenSettings, NearestTrainingPoseSettings, OracleSettings, TrackerSettings,
};
pub use tracker_kind::{TrackerKind, TrainingUse};
pub(crate) use tree::{settings_of, tree_of};

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::benchmark_set::Layer;
use crate::observation::ObservationSettings;

/// One experiment: motion, bodies, cameras and tracker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// The version of this format; always `"skiagraph.scenario/1"`.
    pub schema: SchemaTag,
    /// Short name: letters, digits, `-` and `_`. Runs are written to `runs/NAME` unless `--out` says otherwise.
    pub name: String,
    /// Description in one or two sentences. Default: empty.
    #[serde(default)]
    pub description: String,
    /// First random seed. Default: 0.
    #[serde(default)]
    pub seed: u32,
    /// Number of seeds: `seed`, `seed + 1`, and so on. Default: 1.
    #[serde(default = "one")]
    pub seeds: u32,
    /// Ground-truth images that `render` writes in addition to the masks, one OpenEXR file per camera and frame:
    /// `"depth"` (metres along the camera's axis; also a 16-bit PNG in millimetres), `"parts"` (index of the visible
    /// link), `"normals"`, `"flow"` (to the next frame), `"coverage"` (anti-aliased) and `"colour"`. `run` does not use
    /// them. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<Layer>,
    /// The recording that the actor performs.
    pub motion: MotionSettings,
    /// The recordings that proposals and motion models are learned from. Default: the spread of proposals is that of
    /// `[motion]` itself; motion models need training clips.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub training: Option<TrainingSettings>,
    /// The body that is seen.
    #[serde(default)]
    pub actor: ActorSettings,
    /// The body that the tracker believes in.
    #[serde(default)]
    pub tracker_body: TrackerBodySettings,
    /// Props: fixed solids in the scene. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prop: Vec<PropSettings>,
    /// Other people in the scene. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub distractor: Vec<DistractorSettings>,
    /// The cameras.
    #[serde(default, deserialize_with = "rig::with_cameras")]
    pub rig: RigSettings,
    /// The observations that trackers are given. Default: exact silhouettes.
    #[serde(default, skip_serializing_if = "is_default")]
    pub observation: ObservationSettings,
    /// The tracker: one of `[tracker.annealed_particle_filter]`, `[tracker.gpdm]`, `[tracker.switching_gpdm]`,
    /// `[tracker.gpdm_graph]`, `[tracker.frozen]`, `[tracker.nearest_training_pose]`, `[tracker.oracle]`. Default: the
    /// annealed particle filter with its defaults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracker: Option<TrackerSettings>,
    /// Several trackers instead of `[tracker]`, by name: `[methods.NAME.gpdm_graph]`. Default: none.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub methods: BTreeMap<String, TrackerSettings>,
}

/// The version of the scenario format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum SchemaTag {
    /// The only one so far.
    #[serde(rename = "skiagraph.scenario/1")]
    V1,
}

impl Scenario {
    /// The seeds of this experiment, in order.
    pub fn all_seeds(&self) -> impl Iterator<Item = u64> + use<> {
        (0..u64::from(self.seeds)).map({
            let first = u64::from(self.seed);
            move |i| first + i
        })
    }

    /// The JSON schema of the format, for editors.
    pub fn json_schema() -> serde_json::Value {
        schemars::schema_for!(Self).to_value()
    }
}

fn one() -> u32 {
    1
}

fn is_default(observation: &ObservationSettings) -> bool {
    *observation == ObservationSettings::default()
}
