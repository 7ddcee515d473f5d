//! Scenarios: definitions of experiments, as in `scenarios/*.toml`.
//!
//! The doc comments of these types are the documentation of the file format: `skiagraph schema` prints them. Units are
//! metres, seconds and, in keys named `_deg`, degrees; frame numbers are those of the clip's file, from 1. The schema
//! adds plain default values. Types are checked when reading, ranges by `Scenario::first_problem`.
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
mod camera_motion;
mod diagnostic;
mod gone;
pub(crate) mod json_tree;
mod latent;
mod motion;
mod overrides;
mod place;
mod program;
mod props;
mod range_checks;
mod ranges;
mod read;
mod recording;
mod rig;
mod similar_file;
mod survey;
mod template;
mod tracker;
mod tracker_kind;
mod tracker_ranges;
mod tree;
mod value_text;

pub use bodies::{
    ActorSettings, ContactMode, DistractorSettings, Mismatch, MismatchBy, PopulationName, PushSettings, ShapeSettings,
    SolidsSource, TrackerBodySettings,
};
pub use camera_motion::{CameraMotionSettings, CameraTimingSettings, KeyframeSettings};
pub use diagnostic::{Diagnostic, LineSpan};
pub(crate) use diagnostic::{did_you_mean, locate};
pub use latent::{
    GpdmGraphSettings, GpdmSettings, LatentRefinementSettings, LatentTrackerSettings, RootMode, SwitchingGpdmSettings,
};
pub use motion::{MotionSettings, TakeSettings, TrainingSettings};
pub use overrides::as_toml;
pub use program::ProgramTrackerSettings;
pub(crate) use program::{REFUSED, command_with, exec_arguments, program_in, setting_text};
pub use props::{PropSettings, PropShape};
pub use range_checks::KeyError;
pub(crate) use ranges::{MOST_SEEDS, is_tracker_name};
pub use read::{DEFAULT_SCENARIO, ScenarioError, ScenarioFile};
pub use recording::{ImageFit, MaskSettings, RecordedBody, RecordedKeypoints, Recording, RecordingFile};
pub use rig::{CameraSettings, RigSettings, RingSettings};
pub(crate) use similar_file::similar_file;
pub use survey::{Survey, survey};
pub use template::ScenarioTemplate;
pub use tracker::{AnnealedParticleFilterSettings, EvidenceSource, NoSettings, OracleSettings, TrackerSettings};
pub use tracker_kind::{LearnedMotion, SearchSettings, TrackerKind, TrainingUse};
pub(crate) use tree::{RUN_COMMAND, settings_of, tree_of};
pub(crate) use value_text::{parse_value, split_at_commas};

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use skiagraph_set::TruthImage;
use skiagraph_truth::observing::ObservationSettings;

/// One experiment: motion, bodies, cameras and tracker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of this format.
    pub schema: SchemaTag,
    /// Short name: letters, digits, `-` and `_`. Results go to `runs/NAME`, or to `runs/NAME-2` and so on if other
    /// results are there; `--out` overrides it.
    pub name: String,
    /// Description in one or two sentences. Default: empty.
    #[serde(default)]
    pub description: String,
    /// First random seed.
    #[serde(default)]
    pub seed: u32,
    /// Number of seeds: `seed`, `seed + 1`, and so on.
    #[serde(default = "one")]
    pub seeds: u32,
    /// Truth images that `render` writes for every camera and frame, as OpenEXR files (`docs/sets.md#truth-images`).
    /// `run` does not use them. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub truth_images: Vec<TruthImage>,
    /// The recording that the actor performs.
    pub motion: MotionSettings,
    /// The recordings from which proposals and motion models are learned. Default: none; proposals then have the spread
    /// of `[motion]` itself, and motion models cannot be learned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub training: Option<TrainingSettings>,
    /// The visible body.
    #[serde(default)]
    pub actor: ActorSettings,
    /// The body that the tracker uses.
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
    /// The tracker: one of these tables. `--exec` sets `[tracker.program]`. Default: the annealed particle filter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracker: Option<TrackerSettings>,
    /// Several trackers on the same observations and seeds, by name, in place of `[tracker]`:
    /// `[methods.NAME.gpdm_graph]`. `run` writes `OUT/NAME` for each, and `comparison.json` and `comparison.html`
    /// beside them. Every distinct motion model is learned once. Default: none.
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

    /// The scenario without description, trackers and their seeds: everything that its set depends on.
    pub(crate) fn of_set(&self) -> Self {
        Self { description: String::new(), seed: 0, seeds: 1, tracker: None, methods: BTreeMap::new(), ..self.clone() }
    }

    /// The one tracker of a scenario without methods.
    pub fn tracker(&self) -> TrackerSettings {
        self.tracker.clone().unwrap_or_default()
    }

    /// All trackers, with the names of methods if there are any.
    pub fn trackers(&self) -> Vec<(&str, TrackerSettings)> {
        if self.methods.is_empty() {
            return vec![("tracker", self.tracker())];
        }
        self.methods.iter().map(|(name, settings)| (name.as_str(), settings.clone())).collect()
    }

    pub(crate) fn programs(&mut self) -> impl Iterator<Item = &mut ProgramTrackerSettings> {
        let all = self.tracker.iter_mut().chain(self.methods.values_mut());
        all.filter_map(|tracker| match tracker {
            TrackerSettings::Program(program) => Some(program),
            _ => None,
        })
    }

    pub fn json_schema() -> Value {
        with_defaults(schemars::schema_for!(Self).to_value())
    }
}

fn one() -> u32 {
    1
}

/// A schema whose descriptions end with plain default values, unless they already state a default.
pub(crate) fn with_defaults(mut part: Value) -> Value {
    if let Value::Object(table) = &mut part {
        let default = table.get("default").and_then(plain_default);
        if let (Some(default), Some(Value::String(description))) = (default, table.get_mut("description"))
            && !description.contains("Default:")
        {
            *description += &format!(" Default: {default}.");
        }
        table.values_mut().for_each(|inner| *inner = with_defaults(inner.take()));
    }
    if let Value::Array(elements) = &mut part {
        elements.iter_mut().for_each(|inner| *inner = with_defaults(inner.take()));
    }
    part
}

/// A default value as TOML; `None` for tables.
fn plain_default(value: &Value) -> Option<String> {
    match value {
        Value::Number(number) => number.as_f64().map(|number| number.to_string()),
        Value::String(text) => Some(format!("`\"{text}\"`")),
        Value::Bool(value) => Some(value.to_string()),
        Value::Array(elements) => {
            let elements: Option<Vec<String>> = elements.iter().map(plain_default).collect();
            elements.map(|elements| format!("`[{}]`", elements.join(", ")))
        }
        Value::Null | Value::Object(_) => None,
    }
}

/// Whether a setting has its default value and need not be written.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_adds_defaults_that_comments_do_not_state() {
        let schema = Scenario::json_schema();
        let ends =
            [("RingSettings", "size_px", "pixels. Default: `[640, 480]`."), ("RingSettings", "count", "Default: 4.")];
        let filter = "AnnealedParticleFilterSettings";
        let others = [(filter, "contour_reach", "Default: 1/24."), (filter, "kernel", "Default: `\"geometric\"`.")];
        for (table, key, end) in ends.into_iter().chain(others) {
            let described = schema["$defs"][table]["properties"][key]["description"].as_str().unwrap();
            assert!(described.ends_with(end) && described.matches("Default:").count() == 1, "{key}: {described}");
        }
    }

    #[test]
    fn a_set_depends_on_its_scene_and_layers_and_not_on_trackers() {
        let of = |change: &str| ScenarioFile::built_in(&[change.to_owned()]).unwrap().scenario.of_set();
        let base = ScenarioFile::built_in(&[]).unwrap().scenario.of_set();
        for same in ["seed=3", "seeds=2", "particles=7", "tracker.frozen={}"] {
            assert_eq!(of(same), base, "{same}");
        }
        for other in ["rig.ring.count=3", "truth_images=[\"depth\"]", "tracker_body.seed=2", "name=other"] {
            assert_ne!(of(other), base, "{other}");
        }
    }
}
