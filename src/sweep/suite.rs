//! Suites: trackers on clips x places x bodies x cameras, as in `scenarios/suites/*.toml`. A suite is a sweep whose
//! axes are these conditions.
//!
//! The doc comments of [`Suite`] are the documentation of the format: `skiagraph schema --suite` prints them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::definition::Sweep;
use super::file::{SweepFile, has_schema};
use super::plan::PlannedSweep;
use super::summary::{CellSummary, SettingSummary, SweepSummary};
use crate::common::ExperimentError;
use crate::evaluation::{Interval, Metric, ValueRange, find_metric, mean, mean_interval};
use crate::input::{self, AllowedFolders, limits};
use crate::scenario::{Diagnostic, LineSpan, ScenarioError, locate, settings_of, tree_of};

/// Longest name of a condition, so that the names of all four make the name of a scenario.
const LONGEST_NAME: usize = 15;
/// The axis of clips, over which intervals are.
const CLIP: &str = "clip";

/// The conditions of one kind by name, each with overrides of the scenario: `walk = ["motion.clip=embedded:walk"]`.
type Conditions = BTreeMap<String, Vec<String>>;

/// Clips x places x bodies x cameras.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Suite {
    /// Version of this format; always `"skiagraph.suite/1"`.
    pub schema: SuiteTag,
    /// Short name: letters, digits, `-` and `_`. Results go to `suites/NAME` unless `--out` is given.
    pub name: String,
    /// Description in one or two sentences. Default: empty.
    #[serde(default)]
    pub description: String,
    /// The scenario that is varied: a path relative to this file. Default: the built-in walk.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<String>,
    /// Overrides of the scenario for all runs. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
    /// Number of seeds of every run, each also with its own noise; they are averaged, because the clip is the unit.
    #[serde(default = "one")]
    pub seeds: u32,
    /// The clips by name, each with overrides of the scenario: `walk = ["motion.clip=embedded:walk"]`.
    pub clips: Conditions,
    /// Places: props, light and noise. Default: that of the scenario.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub places: Conditions,
    /// Bodies of actor and tracker. Default: those of the scenario.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub bodies: Conditions,
    /// Cameras. Default: those of the scenario.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub cameras: Conditions,
}

/// The version of the suite format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum SuiteTag {
    /// The only version so far.
    #[serde(rename = "skiagraph.suite/1")]
    V1,
}

fn one() -> u32 {
    1
}

impl Suite {
    /// Whether a file has the schema of a suite; `false` if it cannot be read.
    pub fn is_one(path: &Path) -> bool {
        has_schema(path, "skiagraph.suite/")
    }

    /// Reads a suite as a sweep of its conditions.
    ///
    /// # Errors
    /// [`ScenarioError`] if the file cannot be read, is not TOML, or has an unknown key or an invalid value.
    pub fn open(path: &Path) -> Result<SweepFile, ScenarioError> {
        let text = input::read_to_string(path, limits::SETTINGS)
            .map_err(|source| ScenarioError::Unreadable { path: path.to_owned(), source })?;
        let origin = path.display().to_string();
        let tree = tree_of(&text, &origin)?;
        let suite: Self = settings_of(tree, |mistake| mistake.in_text(&origin, &text))?;
        let complain = |key: String, message: String| {
            let place = locate(&text, &key).map(|spot| LineSpan::of_file(&text, &spot.value));
            ScenarioError::from(Diagnostic { origin: origin.clone(), place, key, message })
        };
        if let Some((key, message)) = suite.first_problem() {
            return Err(complain(key, message));
        }
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
        let allowed = AllowedFolders::of_folder(&folder);
        Ok(SweepFile::new(suite.sweep(), &origin, folder)?.allowing(&allowed))
    }

    /// Refuses an override of a key that a condition of the suite sets, because the condition would win in silence.
    ///
    /// # Errors
    /// [`ExperimentError`] that names the key and the conditions.
    pub fn refuse_overridden(sweep: &Sweep, assignment: &str) -> Result<(), ExperimentError> {
        let key = key_of(assignment);
        let is_same = |set: &Value| set.as_str().map(key_of).is_some_and(|other| are_one_key(key, other));
        let sets =
            |values: &Value| values.as_array().into_iter().flatten().any(|value| has_any(&value["set"], is_same));
        match sweep.axes.iter().find(|(_, values)| sets(values)) {
            None => Ok(()),
            Some((axis, _)) => Err(ExperimentError::Argument {
                argument: "KEY=VALUE",
                detail: format!(
                    "{key} is set by a {axis} of the suite, which would win; change it in a copy of the suite"
                ),
            }),
        }
    }

    /// Whether a sweep has the conditions of a suite, and no other axis, over which its tables would average.
    pub(super) fn is_whole(sweep: &Sweep) -> bool {
        let is_condition = |axis: &String| [CLIP, "place", "body", "cameras"].contains(&axis.as_str());
        // only suites have cells with names
        sweep.named && sweep.axes.keys().all(is_condition)
    }

    /// The conditions by the name of their axis.
    fn conditions(&self) -> [(&'static str, &'static str, &Conditions); 4] {
        [
            (CLIP, "clips", &self.clips),
            ("place", "places", &self.places),
            ("body", "bodies", &self.bodies),
            ("cameras", "cameras", &self.cameras),
        ]
    }

    fn first_problem(&self) -> Option<(String, String)> {
        if self.clips.is_empty() {
            return Some(("clips".to_owned(), "expected at least one clip, found none".to_owned()));
        }
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        let is_name = |name: &str| !name.is_empty() && name.len() <= LONGEST_NAME && name.chars().all(plain);
        let named = self.conditions();
        let mut names = named.iter().flat_map(|(_, key, all)| all.keys().map(move |name| (key, name)));
        let (key, name) = names.find(|(_, name)| !is_name(name))?;
        let found = input::excerpt(name);
        let message = format!("expected names of 1 to {LONGEST_NAME} letters, digits, `-` or `_`, found {found:?}");
        Some(((*key).to_owned(), message))
    }

    /// The sweep of its conditions, with a report for every cell.
    fn sweep(&self) -> Sweep {
        let values = |all: &Conditions| all.iter().map(|(name, set)| json!({ "name": name, "set": set })).collect();
        let axes = self.conditions().into_iter().filter(|(_, _, all)| !all.is_empty());
        let axes: Map<String, Value> =
            axes.map(|(axis, _, all)| (axis.to_owned(), Value::Array(values(all)))).collect();
        Sweep {
            description: self.description.clone(),
            base: self.base.clone(),
            set: self.set.clone(),
            seeds: Some(self.seeds),
            draws: true,
            axes,
            reports: true,
            named: true,
            ..Sweep::named(&self.name)
        }
    }

    /// The JSON schema of the format, for editors.
    pub fn json_schema() -> Value {
        crate::scenario::with_defaults(schemars::schema_for!(Self).to_value())
    }
}

fn key_of(assignment: &str) -> &str {
    assignment.split('=').next().unwrap_or_default().trim()
}

/// Whether two keys, dotted or only their last parts, may be one.
fn are_one_key(one: &str, other: &str) -> bool {
    let ends =
        |long: &str, short: &str| long.strip_suffix(short).is_some_and(|rest| rest.is_empty() || rest.ends_with('.'));
    ends(one, other) || ends(other, one)
}

fn has_any(values: &Value, is_one: impl Fn(&Value) -> bool) -> bool {
    values.as_array().is_some_and(|values| values.iter().any(is_one))
}

/// The results of a suite.
#[derive(Clone, Debug, Serialize)]
pub struct SuiteResults {
    /// `skiagraph.suite_results/1`.
    pub schema: &'static str,
    /// The suite's name.
    pub name: String,
    /// The metric.
    pub objective: String,
    /// The trackers.
    pub trackers: Vec<String>,
    /// Number of cells.
    pub cells: usize,
    /// Cells without a value: the suite is incomplete.
    pub incomplete: usize,
    /// Remarks on programs that ignore their settings.
    pub remarks: Vec<String>,
    /// Everything, then every value of every condition.
    pub strata: Vec<Stratum>,
    /// All cells, failures first, then from the worst value to the best.
    pub runs: Vec<SuiteRun>,
}

/// One condition, with all others averaged.
#[derive(Clone, Debug, Serialize)]
pub struct Stratum {
    /// `all`, or the condition: `place = street`.
    pub name: String,
    /// Its values, one per tracker.
    pub values: Vec<StratumValue>,
}

/// A tracker in a stratum.
#[derive(Clone, Debug, Serialize)]
pub struct StratumValue {
    /// Mean over clips of each clip's mean.
    pub mean: Option<f64>,
    /// 95 % interval over clips; absent below three.
    pub ci95: Option<Interval>,
    /// Number of clips with values.
    pub clips: usize,
    /// Number of cells with values.
    pub runs: usize,
    /// Cells that are graded lost.
    pub lost: usize,
    /// Cells without a value, whatever the reason: the mean then covers fewer clips or conditions than others' means.
    pub missing: usize,
    /// Mean share of the markers that have an estimate.
    pub coverage: Option<f64>,
}

/// One cell.
#[derive(Clone, Debug, Serialize)]
pub struct SuiteRun {
    /// The tracker.
    pub tracker: String,
    /// Its conditions.
    pub conditions: String,
    /// The seed.
    pub seed: u64,
    /// `ok`, `diverged` (graded lost), `failed` (cannot be run) or `missing`.
    pub state: &'static str,
    /// The value of the metric.
    pub value: Option<f64>,
    /// Why it cannot be run.
    pub error: Option<String>,
    /// Its report, relative to the suite's folder.
    pub report: Option<String>,
}

/// A cell with its setting and value.
type Valued<'a> = (&'a SettingSummary, &'a CellSummary, Option<f64>);

impl SuiteResults {
    /// Reads the results of a suite.
    ///
    /// # Errors
    /// [`ExperimentError`] if the plan cannot be read.
    pub fn new(sweep: &PlannedSweep) -> Result<Self, ExperimentError> {
        let summary = SweepSummary::new(sweep)?;
        let trackers = sweep.tracker_names();
        let valued = |setting: &'_ SettingSummary, at: usize| setting.values.get(at).copied().flatten();
        let cells: Vec<Valued<'_>> = summary
            .settings
            .iter()
            .flat_map(|setting| {
                setting.cells.iter().enumerate().map(move |(at, cell)| (setting, cell, valued(setting, at)))
            })
            .collect();
        let range = find_metric(&summary.objective).map_or(ValueRange::Any, Metric::value_range);
        let mut strata = vec![stratum("all".to_owned(), &trackers, &cells, range)];
        let axes = summary.axes.iter().filter(|axis| *axis != "method" && *axis != CLIP);
        for axis in axes.chain(summary.axes.iter().filter(|axis| *axis == CLIP)) {
            let mut known: Vec<&str> = Vec::new();
            for label in cells.iter().filter_map(|(setting, ..)| setting.axes.get(axis)?.as_str()) {
                if !known.contains(&label) {
                    known.push(label);
                }
            }
            for label in known {
                let is_in = |cell: &&Valued<'_>| cell.0.axes.get(axis).is_some_and(|value| value == label);
                let of_value: Vec<Valued<'_>> = cells.iter().filter(is_in).copied().collect();
                strata.push(stratum(format!("{axis} = {label}"), &trackers, &of_value, range));
            }
        }
        let incomplete = cells.iter().filter(|(.., value)| value.is_none()).count();
        Ok(Self {
            schema: "skiagraph.suite_results/1",
            cells: cells.len(),
            incomplete,
            strata,
            runs: runs(&cells, &trackers),
            trackers,
            name: summary.name.clone(),
            objective: summary.objective.clone(),
            remarks: summary.remarks.clone(),
        })
    }
}

impl SuiteResults {
    /// The cells without a value, and those that are graded lost.
    pub fn failures(&self) -> impl Iterator<Item = &SuiteRun> {
        self.runs.iter().filter(|run| run.state != "ok")
    }
}

fn stratum(name: String, trackers: &[String], cells: &[Valued<'_>], range: ValueRange) -> Stratum {
    let value = |tracker: &String| {
        let own: Vec<&Valued<'_>> = cells.iter().filter(|(setting, ..)| setting.is_of(tracker)).collect();
        let mut of_clips: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for (setting, _, value) in &own {
            let clip = setting.axes.get(CLIP).and_then(Value::as_str).unwrap_or_default();
            of_clips.entry(clip).or_default().extend(*value);
        }
        let means: Vec<f64> = of_clips.values().filter_map(|values| mean(values)).collect();
        let ci95 = mean_interval(std::slice::from_ref(&means), range).map(|(interval, _)| interval);
        StratumValue {
            mean: mean(&means),
            ci95,
            clips: means.len(),
            runs: own.iter().filter(|(.., value)| value.is_some()).count(),
            lost: own.iter().filter(|(_, cell, _)| cell.state() == "diverged").count(),
            missing: own.iter().filter(|(.., value)| value.is_none()).count(),
            coverage: mean(&own.iter().filter_map(|(_, cell, _)| cell.coverage).collect::<Vec<f64>>()),
        }
    };
    Stratum { name, values: trackers.iter().map(value).collect() }
}

fn runs(cells: &[Valued<'_>], trackers: &[String]) -> Vec<SuiteRun> {
    let run = |(setting, cell, value): &Valued<'_>| {
        let mut conditions = setting.axes.clone();
        let method = conditions.remove("method").and_then(|method| Some(method.as_str()?.to_owned()));
        let words: Vec<String> = conditions.values().filter_map(|value| Some(value.as_str()?.to_owned())).collect();
        SuiteRun {
            tracker: method.or_else(|| trackers.first().cloned()).unwrap_or_default(),
            conditions: words.join(", "),
            seed: cell.seed,
            state: cell.state(),
            value: *value,
            error: cell.error.clone(),
            report: cell.report_file(),
        }
    };
    let mut runs: Vec<SuiteRun> = cells.iter().map(run).collect();
    let order = |run: &SuiteRun| match run.state {
        "failed" => 0,
        "missing" => 1,
        "diverged" => 2,
        _ => 3,
    };
    runs.sort_by(|a, b| {
        let worst_first = b.value.unwrap_or(f64::INFINITY).total_cmp(&a.value.unwrap_or(f64::INFINITY));
        order(a).cmp(&order(b)).then(worst_first)
    });
    runs
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::sweep::plan::Draft;
    use crate::sweep::plan_file::SweepCell;
    use crate::sweep::results::Status;

    fn cell(clip: &str, place: &str, value: Option<f64>, status: Status) -> (SettingSummary, CellSummary, Option<f64>) {
        let axes = [(CLIP, clip), ("place", place)].map(|(key, value)| (key.to_owned(), Value::from(value)));
        let setting = SettingSummary { axes: axes.into_iter().collect(), ..SettingSummary::default() };
        (setting, CellSummary { status: Some(status), ..CellSummary::default() }, value)
    }

    #[test]
    fn every_shipped_suite_can_be_planned() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/suites");
        for (name, cells) in [("quick", 4 * 2 * 2), ("standard", 5 * 3 * 2 * 2), ("full", 8 * 4 * 3 * 3 * 2)] {
            let file = Suite::open(&folder.join(format!("{name}.toml"))).unwrap();
            let draft = Draft::new(&file, None).unwrap();
            assert_eq!((draft.record.cells, &draft.record.name), (cells, &name.to_owned()));
            let folders: BTreeSet<&str> = draft.cells.iter().map(SweepCell::report_folder).collect();
            assert_eq!(folders.len(), cells, "every cell has its own report");
            assert!(draft.cells.iter().all(|cell| draft.scenario(cell).is_ok()), "{name}");
        }
    }

    #[test]
    fn the_unit_of_an_interval_is_the_clip() {
        let made = [
            cell("a", "x", Some(10.0), Status::Ok),
            cell("a", "y", Some(20.0), Status::Ok),
            cell("b", "x", Some(30.0), Status::Diverged),
            cell("b", "y", None, Status::Failed),
            cell("c", "x", Some(50.0), Status::Ok),
        ];
        let cells: Vec<Valued<'_>> = made.iter().map(|(setting, cell, value)| (setting, cell, *value)).collect();
        let found = stratum("all".to_owned(), &["t".to_owned()], &cells, ValueRange::NonNegative);
        let value = &found.values[0];
        // the means of clips are 15, 30 and 50
        assert!((value.mean.unwrap() - 95.0 / 3.0).abs() < 1e-12);
        let expected = mean_interval(&[vec![15.0, 30.0, 50.0]], ValueRange::NonNegative).unwrap().0;
        assert_eq!(value.ci95, Some(expected));
        assert_eq!((value.clips, value.runs, value.lost, value.missing), (3, 4, 1, 1));
        let listed = runs(&cells, &["t".to_owned()]);
        let states: Vec<&str> = listed.iter().map(|run| run.state).collect();
        assert_eq!(states, ["failed", "diverged", "ok", "ok", "ok"]);
        assert_eq!((listed[2].value, listed[2].conditions.as_str()), (Some(50.0), "c, x"));
    }
}
