//! How a sweep was made: the command, the inputs, and the time that it took.

use std::path::Path;

use crate::scenario::exec_arguments;
use crate::sweep::definition::{Expansion, Sweep};
use crate::sweep::file::{SweepAxis, SweepFile};
use crate::sweep::plan::PlannedSweep;
use crate::sweep::plan_file::{PlanRecord, table_text};
use crate::sweep::results::Environment;
use crate::sweep::summary::SweepSummary;
use skiagraph_core::input::shell_word;
use skiagraph_eval::describe_seeds;

const MOST_SEEDS: usize = 100;
/// Suffix of the source of a sweep of the built-in scenario.
const BUILT_IN: &str = "(built in)";

impl PlannedSweep {
    fn command(&self) -> String {
        let PlanRecord { source, .. } = &self.plan;
        let file = if source.ends_with(BUILT_IN) { String::new() } else { format!(" {}", shell_word(source)) };
        let of_scenario = match &self.plan.base.file {
            Some(file) => Path::new(source).file_name() == file.file_name(),
            None => source.ends_with(BUILT_IN),
        };
        let definition = self.definition().ok();
        let sweep = definition.as_ref().map(|definition| &definition.sweep);
        let words = match sweep {
            Some(_) if of_scenario => definition.as_ref().and_then(typed_axes).unwrap_or_default(),
            Some(sweep) => typed_trackers(sweep),
            None => Vec::new(),
        };
        let words: String = words.iter().map(|word| format!(" {word}")).collect();
        format!("skiagraph sweep{file}{words} --out {}", shell_word(&self.root.display().to_string()))
    }
}

/// Arguments of trackers, and the overrides after them. Earlier ones are of the sweep's file.
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
    words.extend((sweep.method == Expansion::Zip).then(|| "--zip".to_owned()));
    words.extend(sweep.seed.map(|seed| format!("--seed {seed}")));
    words.extend(sweep.seeds.map(|seeds| format!("--seeds {seeds}")));
    words.extend(sweep.draws.then(|| "--draws".to_owned()));
    Some(words.into_iter().chain(typed_objective(sweep)).collect())
}

pub(super) fn facts(sweep: &PlannedSweep, every: &SweepSummary) -> Vec<(String, String)> {
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
