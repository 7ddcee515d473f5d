//! The content of the page of a sweep, and the data for an optimiser that chooses the next setting.

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::common::ExperimentError;
use crate::evaluation::{Direction, Metric, Unit, describe_seeds, find_metric};
use crate::input::shell_word;
use crate::scenario::{ScenarioError, exec_arguments};
use crate::sweep::definition::{Expansion, Sweep};
use crate::sweep::file::{SweepAxis, SweepFile};
use crate::sweep::ladder::SILHOUETTES;
use crate::sweep::plan::PlannedSweep;
use crate::sweep::plan_file::{PlanRecord, table_text};
use crate::sweep::results::Environment;
use crate::sweep::summary::{SettingSummary, SweepSummary};

/// Default of how much worse than the best a setting may be, in the objective's unit: millimetres, degrees.
const WITHIN: f64 = 5.0;
/// The same for shares and other objectives.
const WITHIN_SHARE: f64 = 0.02;
/// Maximum number of seeds that are listed individually.
const MOST_SEEDS: usize = 100;
/// Suffix of the source of a sweep of the built-in scenario.
const BUILT_IN: &str = "(built in)";

/// A sweep's results and their provenance.
#[derive(Clone, Debug)]
pub struct SweepPageInput {
    /// The settings; those that differ only in averaged axes are merged.
    pub summary: SweepSummary,
    /// Short names of its axes.
    pub axes: Vec<String>,
    /// The settings before averaging; `None` if no axis is averaged.
    pub every: Option<SweepSummary>,
    /// Short names of the averaged axes.
    pub over: Vec<String>,
    /// Whether every seed has its own noise.
    pub draws: bool,
    /// The sweep's description.
    pub description: String,
    /// Metric to compare settings by.
    pub objective: &'static Metric,
    /// How much worse than the best a setting may be, in the objective's unit.
    pub within: f64,
    /// The command that repeats the sweep.
    pub command: String,
    /// Provenance: names and values.
    pub facts: Vec<(String, String)>,
}

impl SweepPageInput {
    /// Reads the existing results; `within` is how much worse than the best a setting may be.
    ///
    /// # Errors
    /// [`ExperimentError`] if the plan cannot be read, or no cell has a result.
    pub fn new(sweep: &PlannedSweep, within: Option<f64>) -> Result<Self, ExperimentError> {
        let every = SweepSummary::new(sweep)?;
        let over = sweep.definition()?.sweep.average_over;
        let plan = &sweep.plan;
        let objective = find_metric(&plan.objective).ok_or_else(|| ExperimentError::Argument {
            argument: "objective",
            detail: format!("`{}` is not a metric", plan.objective),
        })?;
        if every.missing == every.cells {
            return Err(ExperimentError::SweepIncomplete {
                path: sweep.root.clone(),
                done: 0,
                cells: every.cells,
                missing: "all".to_owned(),
            });
        }
        let usual = if matches!(objective.unit, Unit::Fraction | Unit::Energy) { WITHIN_SHARE } else { WITHIN };
        let (summary, command) = (every.averaged_over(&over), sweep.command());
        Ok(Self {
            axes: short_names(&summary.axes),
            summary,
            over: short_names(&over),
            draws: plan.draws,
            description: plan.description.clone(),
            objective,
            within: within.unwrap_or(usual),
            facts: facts(sweep, &every, &command),
            command,
            every: (!over.is_empty()).then_some(every),
        })
    }

    /// The settings, in the order of the plan.
    pub fn settings(&self) -> &[SettingSummary] {
        &self.summary.settings
    }

    /// Axes and settings before averaging.
    pub(super) fn unaveraged(&self) -> (Vec<String>, &[SettingSummary]) {
        let every = self.every.as_ref().unwrap_or(&self.summary);
        (if self.every.is_some() { short_names(&every.axes) } else { self.axes.clone() }, &every.settings)
    }

    /// A sentence on the averaged axes; empty if there are none.
    pub(super) fn averages(&self) -> String {
        if self.over.is_empty() {
            return String::new();
        }
        format!("Results are means over all values of {}.", self.over.join(", "))
    }

    /// Axes and values of a setting with the short names of the axes.
    pub(super) fn words(&self, setting: &SettingSummary) -> String {
        let axes = self.summary.axes.iter().zip(&self.axes).zip(&setting.labels);
        let present = axes.filter(|((axis, _), _)| setting.axes.contains_key(*axis));
        let words: Vec<String> = present.map(|((_, name), label)| format!("{name}={label}")).collect();
        if words.is_empty() { setting.words.clone() } else { words.join(" ") }
    }

    /// Whether the value of an axis is a number in every setting.
    pub(super) fn is_numeric(&self, axis: usize) -> bool {
        let is_number =
            |setting: &SettingSummary| setting.axes.get(&self.summary.axes[axis]).is_some_and(Value::is_number);
        self.settings().iter().all(is_number)
    }
}

/// The last part of a dotted key.
fn short_names(axes: &[String]) -> Vec<String> {
    let short = |key: &String| key.strip_prefix("tracker.annealed_particle_filter.").unwrap_or(key).to_owned();
    axes.iter().map(short).collect()
}

impl PlannedSweep {
    /// The command that runs the sweep again.
    fn command(&self) -> String {
        let PlanRecord { source, .. } = &self.plan;
        let file = if source.ends_with(BUILT_IN) { String::new() } else { format!(" {}", shell_word(source)) };
        let of_scenario = match &self.plan.base.file {
            Some(file) => Path::new(source).file_name() == file.file_name(),
            None => source.ends_with(BUILT_IN),
        };
        let definition = self.definition().ok();
        let sweep = definition.as_ref().map(|definition| &definition.sweep);
        let (kind, words) = match sweep {
            Some(sweep) if sweep.named => ("suite", typed_trackers(sweep)),
            Some(sweep) if of_scenario => match sweep.ladder_axes() {
                Some(axes) => ("ladder", typed_ladder(sweep, axes)),
                None => ("sweep", definition.as_ref().and_then(typed_axes).unwrap_or_default()),
            },
            Some(sweep) => ("sweep", typed_trackers(sweep)),
            None => ("sweep", Vec::new()),
        };
        let words: String = words.iter().map(|word| format!(" {word}")).collect();
        format!("skiagraph {kind}{file}{words} --out {}", shell_word(&self.root.display().to_string()))
    }
}

/// Arguments of trackers, and the overrides after them. Earlier ones are of the sweep's or suite's file.
fn typed_trackers(sweep: &Sweep) -> Vec<String> {
    let first = sweep.set.iter().position(|set| exec_arguments(set).is_some()).unwrap_or(sweep.set.len());
    sweep.set.iter().skip(first).map(|set| typed(set)).chain(typed_objective(sweep)).collect()
}

fn typed(set: &str) -> String {
    exec_arguments(set).unwrap_or_else(|| shell_word(set))
}

fn typed_objective(sweep: &Sweep) -> Option<String> {
    (sweep.objective != Sweep::named("").objective).then(|| format!("--objective {}", sweep.objective))
}

/// Arguments of a ladder with these axes.
fn typed_ladder(sweep: &Sweep, axes: Vec<String>) -> Vec<String> {
    let mut words: Vec<String> = axes.into_iter().map(|axis| format!("--axis {axis}")).collect();
    words.extend(sweep.set.iter().filter(|set| *set != SILHOUETTES).map(|set| typed(set)));
    words.extend(sweep.seed.map(|seed| format!("--seed {seed}")));
    words.extend(sweep.seeds.map(|draws| format!("--draws {draws}")));
    words.into_iter().chain(typed_objective(sweep)).collect()
}

/// Arguments of a sweep that was defined on the command line; `None` if an axis has a range.
fn typed_axes(definition: &SweepFile) -> Option<Vec<String>> {
    let mut words = Vec::new();
    for (key, axis) in definition.axes().ok()? {
        let SweepAxis::Values(values) = axis else { return None };
        let values: Vec<String> = values.iter().map(|value| table_text(&value.label)).collect();
        words.push(shell_word(&format!("{key}={}", values.join(","))));
    }
    let sweep = &definition.sweep;
    words.extend(sweep.set.iter().map(|set| typed(set)));
    words.extend(sweep.keep.iter().map(|condition| format!("--keep {}", shell_word(condition))));
    words.extend((sweep.method == Expansion::Zip).then(|| "--zip".to_owned()));
    words.extend(sweep.seed.map(|seed| format!("--seed {seed}")));
    words.extend(sweep.seeds.map(|seeds| format!("--seeds {seeds}")));
    words.extend(sweep.draws.then(|| "--draws".to_owned()));
    Some(words.into_iter().chain(typed_objective(sweep)).collect())
}

fn facts(sweep: &PlannedSweep, every: &SweepSummary, command: &str) -> Vec<(String, String)> {
    let plan = &sweep.plan;
    let seconds = |of: fn(&Environment) -> f64| every.all_cells().map(|(_, cell)| of(&cell.env)).sum::<f64>();
    let (processor_s, track_s) = (seconds(|env| env.processor_s), seconds(|env| env.track_processor_s));
    let cells = every.cells - every.missing;
    let hours = |seconds: f64| match seconds {
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    };
    let base = plan
        .base
        .file
        .as_deref()
        .and_then(|path| path.file_name())
        .map_or_else(|| "the built-in walk".to_owned(), |name| name.to_string_lossy().into_owned());
    let mut facts = vec![
        ("scenario".to_owned(), format!("{base}, SHA-256 {}", plan.base.sha256)),
        (
            "cells".to_owned(),
            format!("{cells} of {}, on {} set{}", plan.cells, plan.sets, if plan.sets == 1 { "" } else { "s" }),
        ),
        ("seeds".to_owned(), seeds(&plan.seeds)),
        (
            "processor time".to_owned(),
            format!("{} of one core, of which tracking {}", hours(processor_s), hours(track_s)),
        ),
        ("command".to_owned(), command.to_owned()),
        ("plan".to_owned(), plan.digest.clone()),
        ("version".to_owned(), plan.version.clone()),
    ];
    if !plan.base.set.is_empty() {
        facts.insert(1, ("for all settings".to_owned(), plan.base.set.join(" ")));
    }
    let inputs = plan.inputs.iter().map(|input| {
        let name = input.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        ("input".to_owned(), format!("{name}, SHA-256 {}", input.sha256))
    });
    facts.extend(inputs);
    facts
}

/// The list of seeds, or a summary if there are many.
fn seeds(all: &[u64]) -> String {
    if all.len() <= MOST_SEEDS {
        all.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
    } else {
        describe_seeds(all)
    }
}

/// Data for an optimiser: the axes with their ranges, the better direction, and every tried setting with its mean
/// (`skiagraph.sweep_ask/1`).
///
/// # Errors
/// [`ExperimentError`] if the plan cannot be read.
pub fn ask(sweep: &PlannedSweep) -> Result<Value, ExperimentError> {
    let definition = sweep.definition()?;
    let over = &definition.sweep.average_over;
    let summary = SweepSummary::new(sweep)?.averaged_over(over);
    let axes = definition.axes().map_err(ScenarioError::from)?.into_iter();
    let axes: Map<String, Value> =
        axes.filter(|(key, _)| !over.contains(key)).map(|(key, axis)| (key, range(&axis))).collect();
    let tried = |setting: &SettingSummary| {
        json!({
            "params": setting.axes,
            "value": setting.mean,
            "values": setting.values,
            "ci95": setting.ci95,
            "evaluations_per_frame": setting.evaluations_per_frame,
        })
    };
    let higher = summary.metric().is_some_and(|metric| metric.direction == Direction::HigherIsBetter);
    Ok(json!({
        "schema": "skiagraph.sweep_ask/1",
        "objective": summary.objective,
        "direction": if higher { "maximize" } else { "minimize" },
        "axes": axes,
        "trials": summary.settings.iter().filter(|setting| setting.mean.is_some()).map(tried).collect::<Vec<_>>(),
    }))
}

fn range(axis: &SweepAxis) -> Value {
    match axis {
        SweepAxis::Values(values) => json!({ "choices": values.iter().map(|v| v.label.clone()).collect::<Vec<_>>() }),
        SweepAxis::Range { ends: [low, high], logarithmic, integer } => {
            json!({ "low": low, "high": high, "log": logarithmic, "integer": integer })
        }
    }
}
