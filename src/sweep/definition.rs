//! A sweep: many settings of one scenario, as in `scenarios/sweeps/*.toml`.
//!
//! The doc comments of these types are the documentation of the format: `skiagraph schema --sweep` prints them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::splits::Splits;
use crate::scenario::{Diagnostic, parse_value, split_at_commas};

/// A sweep runs many settings of one scenario, each with several seeds (`scenarios/README.md#sweeps`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Version of this format.
    pub schema: SweepTag,
    /// Short name: letters, digits, `-` and `_`. Results go to `sweeps/NAME`, or to `sweeps/NAME-2` and so on if
    /// another sweep is there.
    pub name: String,
    /// Description in one or two sentences. Default: empty.
    #[serde(default)]
    pub description: String,
    /// The scenario that is varied: a path relative to this file. Default: the built-in walk.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<String>,
    /// Overrides of the scenario for all cells, as on the command line: `["motion.loop_to_s=2"]`. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
    /// First random seed. Default: the scenario's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u32>,
    /// Number of seeds per setting. Default: the scenario's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seeds: Option<u32>,
    /// Whether every seed also has its own noise: `observation.seed` counts up with the seed, and intervals are over
    /// draws of the noise. For trackers that give the same estimates for every seed. Default: false.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub draws: bool,
    /// How axes are combined into settings.
    #[serde(default)]
    pub method: Expansion,
    /// Values by dotted key, or by its last parts: `particles = [50, 100]`, `rig.ring.count = [2, 4]`. A named value
    /// may set several keys: `clip = [{ name = "run", set = ["motion.clip=embedded:run"] }]`; its axis may have any
    /// name. Such values and tables are applied before the others. With `method = "random"` an axis may be a range: `{
    /// uniform = [low, high] }` or `{ log_uniform = [low, high], integer = true }`. Default: none; a scenario with
    /// `[methods]` has the axis `method`.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    pub axes: Map<String, Value>,
    /// The settings of `method = "list"`: tables of keys and values. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Map<String, Value>>,
    /// Number of settings to draw with `method = "random"`. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<u32>,
    /// Seed of `method = "random"`.
    #[serde(default)]
    pub random_seed: u32,
    /// Metric to compare settings by.
    #[serde(default = "default_objective")]
    pub objective: String,
    /// Axes that are test conditions rather than choices: `["clip"]`. Settings that differ only in these count as one,
    /// with the mean over their values for each seed; intervals are over seeds. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub average_over: Vec<String>,
    /// Whether to keep a complete run with its report for every cell, about 1 MB each.
    #[serde(default)]
    pub reports: bool,
    /// Whether cells have names: their scenario is named after the values of the axes, and their report is in
    /// `reports/METHOD/NAME`. Values must then be names of letters, digits, `-` and `_`. Default: false.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub named: bool,
    /// Splits of the sets that `skiagraph render` makes of the sweep: `by = "clip"`, `parts = { test = ["jump"] }`,
    /// `rest = "train"`. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub splits: Option<Splits>,
}

/// The version of the sweep format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum SweepTag {
    /// The only version so far.
    #[serde(rename = "skiagraph.sweep/1")]
    V1,
}

/// How axes are combined into settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Expansion {
    /// Every combination of the values.
    #[default]
    Grid,
    /// The first values of all axes, then the second values, and so on.
    Zip,
    /// The first value of every axis, then every other value of each axis with the first values of all others: the
    /// levels of several errors, one error at a time.
    OneAtATime,
    /// `samples` different draws from lists and ranges.
    Random,
    /// The settings of `[[points]]`.
    List,
}

impl Sweep {
    /// A sweep without axes.
    pub fn named(name: &str) -> Self {
        Self {
            schema: SweepTag::V1,
            name: name.to_owned(),
            description: String::new(),
            base: None,
            set: Vec::new(),
            seed: None,
            seeds: None,
            draws: false,
            method: Expansion::Grid,
            axes: Map::new(),
            points: Vec::new(),
            samples: None,
            random_seed: 0,
            objective: default_objective(),
            average_over: Vec::new(),
            reports: false,
            named: false,
            splits: None,
        }
    }

    /// Applies `key=value` (for all cells) or `key=value,value,...` (an axis) of the command line. With `keys`, the
    /// values are those of all these keys, which are one axis.
    pub fn assign(&mut self, assignment: &str, keys: &[String]) -> Result<(), Diagnostic> {
        let complain =
            |message: String| Diagnostic { origin: format!("axis {assignment}"), message, ..Diagnostic::default() };
        let (key, values) = assignment
            .split_once('=')
            .ok_or_else(|| complain("expected key=value,value,... such as particles=50,100,200".to_owned()))?;
        let values = split_at_commas(values);
        let of_all = |value: &str| keys.iter().map(|key| format!("{key}={value}")).collect::<Vec<String>>();
        if let [value] = values.as_slice() {
            self.set.extend(if keys.is_empty() { vec![assignment.to_owned()] } else { of_all(value) });
            return Ok(());
        }
        let axis_value = |text: &&str| {
            let value = parse_value(text.trim())?;
            Ok(if keys.is_empty() { value } else { json!({ "name": value, "set": of_all(text.trim()) }) })
        };
        let values = values.iter().map(axis_value).collect::<Result<Vec<Value>, _>>().map_err(complain)?;
        self.axes.insert(key.trim().to_owned(), Value::Array(values));
        Ok(())
    }

    pub fn json_schema() -> Value {
        crate::scenario::with_defaults(schemars::schema_for!(Self).to_value())
    }
}

fn default_objective() -> String {
    "humaneva_mm".to_owned()
}
