//! A sweep: many settings of one scenario, as in `scenarios/sweeps/*.toml`.
//!
//! The doc comments of these types are the documentation of the format: `skiagraph schema --sweep` prints them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::scenario::{Diagnostic, parse_value, split_at_commas};

/// Many settings of one scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Version of this format; always `"skiagraph.sweep/1"`.
    pub schema: SweepTag,
    /// Short name: letters, digits, `-` and `_`. Results go to `sweeps/NAME` unless `--out` is given.
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
    /// draws of the noise. For trackers that give the same estimates for every seed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub draws: bool,
    /// How axes are combined into settings.
    #[serde(default)]
    pub method: Expansion,
    /// Axes by dotted key, or by its last parts if they are unambiguous. A value is any TOML value; a table
    /// `{ name = "...", set = ["key=value", ...] }` sets several keys at once, and its axis may have any name. With
    /// `method = "random"` an axis may be `{ uniform = [low, high] }` or `{ log_uniform = [low, high] }`, with
    /// `integer = true` for whole numbers. Default: none.
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
    /// A product of keys that is the same in all cells. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<SweepBudget>,
    /// Conditions that every kept setting satisfies: `["particles * layers <= 2000"]`. Names are axes, or dotted keys
    /// of the scenario. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keep: Vec<String>,
    /// Metric to compare settings by.
    #[serde(default = "default_objective")]
    pub objective: String,
    /// Axes to average over, such as clips: settings that differ only in these axes are merged into one, with the mean
    /// over their values. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub average_over: Vec<String>,
    /// Whether to keep a complete run with its report for every cell, about 1 MB each.
    #[serde(default)]
    pub reports: bool,
    /// Whether cells have names: their scenario is named after the values of the axes, and their report is in
    /// `reports/METHOD/NAME`. Values of axes must then be names of letters, digits, `-` and `_`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub named: bool,
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
    /// Values drawn at random.
    Random,
    /// The settings of `[[points]]`.
    List,
}

/// A product of keys that is held constant, so that every setting needs the same amount of work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepBudget {
    /// Keys to multiply: `["particles", "layers"]`.
    pub product: Vec<String>,
    /// Required value of the product.
    pub equals: f64,
    /// Key that is set so that the product meets the budget, rounded to a whole number; it must not be an axis.
    /// Default: none; settings that miss the budget are left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solve: Option<String>,
    /// Relative tolerance of the product. Default: 0 without `solve`, 0.05 with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
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
            budget: None,
            keep: Vec::new(),
            objective: default_objective(),
            average_over: Vec::new(),
            reports: false,
            named: false,
        }
    }

    /// Applies `key=value` (for all cells) or `key=value,value,...` (an axis) of the command line. With `keys`, the
    /// values are those of all these keys, which are one axis.
    ///
    /// # Errors
    /// [`Diagnostic`] for an assignment that is neither.
    pub fn assign(&mut self, assignment: &str, keys: &[String]) -> Result<(), Diagnostic> {
        let complain = |message: String| Diagnostic {
            origin: format!("axis {assignment}"),
            place: None,
            key: String::new(),
            message,
        };
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

    /// The JSON schema of the format, for editors.
    pub fn json_schema() -> Value {
        crate::scenario::with_defaults(schemars::schema_for!(Self).to_value())
    }
}

fn default_objective() -> String {
    "humaneva_mm".to_owned()
}
