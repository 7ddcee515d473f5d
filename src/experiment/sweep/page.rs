//! The page of a sweep, and what a program that looks for the next setting wants to know.

use serde_json::{Map, Value, json};

use super::cell::REPORTS;
use super::gather::plain;
use super::plan::PlannedSweep;
use super::record::{Status, SweepResults};
use super::summary::{SettingSummary, SweepSummary};
use crate::evaluation::{Direction, Unit, find_metric, seeds_in_words};
use crate::experiment::{ExperimentError, REPORT_FILE};
use crate::report::{EverySetting, SweepCellState, SweepPageInput, SweepPoint};
use crate::scenario::SweepAxis;

/// By how much a setting may be worse than the best unless it is said, in the objective's unit: millimetres, degrees.
const WITHIN: f64 = 5.0;
/// The same for shares and other objectives.
const WITHIN_SHARE: f64 = 0.02;
/// Seeds that are named one by one.
const MOST_SEEDS: usize = 100;

/// What the page of a sweep shows. `within` is by how much a setting may be worse than the best.
///
/// # Errors
/// [`ExperimentError`] where the plan cannot be read, or no cell has a result.
pub fn page_input(sweep: &PlannedSweep, within: Option<f64>) -> Result<SweepPageInput, ExperimentError> {
    let every = SweepSummary::new(sweep)?;
    let over = sweep.definition()?.sweep.average_over;
    let summary = every.averaged_over(&over);
    let plan = &sweep.plan;
    let objective = find_metric(&plan.objective).ok_or_else(|| ExperimentError::Argument {
        argument: "objective",
        detail: format!("`{}` is no metric", plan.objective),
    })?;
    if summary.missing == summary.cells {
        return Err(ExperimentError::SweepIncomplete {
            path: sweep.root.clone(),
            done: 0,
            cells: summary.cells,
            missing: "all".to_owned(),
        });
    }
    let usual = if matches!(objective.unit, Unit::Fraction | Unit::Energy) { WITHIN_SHARE } else { WITHIN };
    Ok(SweepPageInput {
        title: plan.name.clone(),
        description: plan.description.clone(),
        objective,
        seeds: plan.seeds.clone(),
        axes: short_names(&summary.axes),
        settings: summary.settings.iter().map(|setting| point(setting, &summary.axes)).collect(),
        every: (!over.is_empty()).then(|| EverySetting {
            over: short_names(&over),
            axes: short_names(&every.axes),
            settings: every.settings.iter().map(|setting| point(setting, &every.axes)).collect(),
        }),
        within: within.unwrap_or(usual),
        facts: facts(sweep)?,
    })
}

fn short_names(axes: &[String]) -> Vec<String> {
    axes.iter().map(|axis| short_name(axis).to_owned()).collect()
}

/// The last part of a dotted key.
fn short_name(key: &str) -> &str {
    key.strip_prefix("tracker.annealed_particle_filter.").unwrap_or(key)
}

fn point(setting: &SettingSummary, axes: &[String]) -> SweepPoint {
    let words = |key: &String| format!("{}={}", short_name(key), setting.axes.get(key).map(plain).unwrap_or_default());
    let present = axes.iter().filter(|axis| setting.axes.contains_key(*axis));
    let words: Vec<String> = present.map(words).collect();
    SweepPoint {
        words: if words.is_empty() { setting.words.clone() } else { words.join(" ") },
        labels: axes.iter().map(|axis| setting.axes.get(axis).map(plain).unwrap_or_default()).collect(),
        numbers: axes.iter().map(|axis| setting.axes.get(axis).and_then(Value::as_f64)).collect(),
        values: setting.values.iter().flatten().copied().collect(),
        mean: setting.mean,
        interval: setting.ci95,
        evaluations: setting.evaluations_per_frame,
        processor_ms: setting.processor_ms_per_frame,
        frozen: setting.frozen,
        cells: setting
            .cells
            .iter()
            .map(|cell| SweepCellState {
                index: cell.index,
                seed: cell.seed,
                state: cell.status.map_or("missing", Status::name),
                error: cell.error.clone(),
                report: cell.report.then(|| format!("{REPORTS}/{}/{REPORT_FILE}", cell.cell)),
            })
            .collect(),
    }
}

fn facts(sweep: &PlannedSweep) -> Result<Vec<(String, String)>, ExperimentError> {
    let plan = &sweep.plan;
    let (mut processor_s, mut track_s, mut cells) = (0.0, 0.0, 0_usize);
    SweepResults::new(sweep).for_each(&sweep.cells()?, |_, record| {
        if let Some(record) = record {
            cells += 1;
            processor_s += record.env.processor_s;
            track_s += record.env.track_processor_s;
        }
        Ok(())
    })?;
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
        ("command".to_owned(), sweep.command()),
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
    Ok(facts)
}

/// The seeds one by one, or of very many the first and the last.
fn seeds(all: &[u64]) -> String {
    match all.len() <= MOST_SEEDS {
        true => all.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        false => seeds_in_words(all),
    }
}

/// What an optimiser wants to know: the axes with their ranges, which direction is better, and every setting that was
/// tried with its mean (`skiagraph.sweep_ask/1`).
///
/// # Errors
/// [`ExperimentError`] where the plan cannot be read.
pub fn ask(sweep: &PlannedSweep) -> Result<Value, ExperimentError> {
    let definition = sweep.definition()?;
    let over = &definition.sweep.average_over;
    let summary = SweepSummary::new(sweep)?.averaged_over(over);
    let axes = definition.axes().map_err(crate::scenario::ScenarioError::from)?.into_iter();
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
