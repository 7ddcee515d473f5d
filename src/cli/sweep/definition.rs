//! `SWEEP|SCENARIO [KEY=VALUE,VALUE...]` and the options that define a sweep; `skiagraph sweep plan`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use super::super::program_arguments::TrackerArguments;
use super::super::scenario_arguments::parts;
use super::super::{CommandError, output};
use crate::common::ExperimentError;
use crate::scenario::{ScenarioError, ScenarioFile, ScenarioTemplate, split_at_commas};
use crate::sweep::{Draft, Expansion, PlanRecord, Planned, Sweep, SweepFile};

/// Arguments that define a sweep.
#[derive(Args, Clone, Debug, Default)]
pub(in crate::cli) struct Definition {
    /// Sweep file, or a scenario to vary [default: the built-in walk]
    #[arg(value_name = "SWEEP|SCENARIO")]
    pub(in crate::cli) file: Option<PathBuf>,

    /// Axes (key=value,value,...) and overrides for all settings (key=value): a dotted key, or its last parts if they
    /// are unambiguous
    #[arg(value_name = "KEY=VALUES")]
    pub(in crate::cli) assignments: Vec<String>,

    /// First random seed, overriding the sweep or scenario
    #[arg(long, value_name = "N")]
    pub(in crate::cli) seed: Option<u32>,

    /// Number of seeds per setting, overriding the sweep or scenario
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(in crate::cli) seeds: Option<u32>,

    /// Draw new noise for every seed: observation.seed counts up with the seed, and intervals are over draws of the
    /// noise
    #[arg(long)]
    pub(in crate::cli) draws: bool,

    #[command(flatten)]
    pub(in crate::cli) trackers: TrackerArguments,

    /// Pair the values of all axes one to one instead of taking every combination
    #[arg(long)]
    pub(in crate::cli) zip: bool,

    /// Metric to compare settings by [default: humaneva_mm]
    #[arg(long, value_name = "METRIC")]
    pub(in crate::cli) objective: Option<String>,

    /// Keep a complete run with its report for every cell, about 1 MB each
    #[arg(long)]
    pub(in crate::cli) reports: bool,

    /// Directory to search recursively for clips of the scenario [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    pub(in crate::cli) mocap_dir: Option<PathBuf>,
}

impl Definition {
    pub(in crate::cli) fn draft(&self) -> Result<Draft, ExperimentError> {
        let file = self.read()?;
        // two axes of one key make equal settings, which the draft refuses in other words
        if let Some(base) = self.base_of_several(&file) {
            self.refuse_repeated(|key| base.full_key(key), &[])?;
        }
        let draft = Draft::new(&file, self.mocap_directory().as_deref()).map_err(|error| error.about(&file.origin))?;
        self.refuse_repeated(|key| draft.full_key(key), &draft.record.axes)?;
        Ok(draft)
    }

    /// The varied scenario, if several keys are given and it can be read.
    fn base_of_several(&self, file: &SweepFile) -> Option<ScenarioTemplate> {
        if self.parts().1.len() < 2 {
            return None;
        }
        let base = match &file.sweep.base {
            Some(base) => ScenarioFile::open(&file.folder.join(base), &file.sweep.set),
            None => ScenarioFile::built_in(&file.sweep.set),
        };
        base.and_then(ScenarioTemplate::new).ok()
    }

    /// Refuses a key that is given twice: one of the two would have no effect. `of_file` are the axes of all settings.
    fn refuse_repeated(&self, full_key: impl Fn(&str) -> String, of_file: &[String]) -> Result<(), ExperimentError> {
        let full_keys = |key: &str| match self.trackers.shared_setting(key) {
            shared if shared.is_empty() => vec![full_key(key)],
            shared => shared,
        };
        let assignments = self.parts().1;
        let parted = assignments.iter().filter_map(|given| given.split_once('='));
        let given: Vec<(&str, bool)> =
            parted.map(|(key, values)| (key.trim(), split_at_commas(values).len() > 1)).collect();
        // an axis of the command line replaces the one of the file with its name
        let of_file =
            of_file.iter().map(String::as_str).filter(|axis| !given.contains(&(axis, true))).map(|axis| (axis, true));
        let mut earlier: Vec<(&str, bool, Vec<String>)> = Vec::new();
        for (key, is_axis) in given.iter().copied().chain(of_file) {
            let keys = full_keys(key);
            // of two values, one may be for all programs and the other for one of them
            let twice = earlier.iter().filter(|(_, other_is_axis, known)| is_axis || *other_is_axis || *known == keys);
            let mut twice = twice.filter_map(|(other, other_is_axis, known)| {
                Some((other, is_axis || *other_is_axis, known.iter().find(|k| keys.contains(k))?))
            });
            if let Some((other, has_axis, full)) = twice.next() {
                let axis = if has_axis { ", which is an axis" } else { "" };
                let detail = format!("`{other}` and `{key}` both set {full}{axis}, so one would be lost; give it once");
                return Err(ExperimentError::Argument { argument: "KEY=VALUES", detail });
            }
            earlier.push((key, is_axis, keys));
        }
        Ok(())
    }

    fn read(&self) -> Result<SweepFile, ExperimentError> {
        let (path, assignments) = self.parts();
        let file = match path {
            Some(path) if SweepFile::is_one(path) => SweepFile::open(path)?,
            Some(path) => {
                // the scenario's own errors come first
                let scenario = ScenarioFile::open(path, &[])?;
                let base = Some(path.display().to_string());
                let sweep = Sweep { base, ..Sweep::named(&scenario.scenario.name) };
                SweepFile::new(sweep, &path.display().to_string(), PathBuf::new())?
            }
            None => SweepFile::new(Sweep::named("walk"), "walk.toml (built in)", PathBuf::new())?,
        };
        let mut sweep = file.sweep.clone();
        if !self.trackers.is_empty() {
            let base = match &sweep.base {
                Some(base) => ScenarioFile::open(&file.folder.join(base), &[])?,
                None => ScenarioFile::built_in(&[])?,
            };
            sweep.set.extend(self.trackers.assignment(&base.scenario)?);
        }
        for assignment in &assignments {
            refuse_overridden(&sweep, assignment)?;
            let key = assignment.split('=').next().unwrap_or_default().trim();
            sweep.assign(assignment, &self.trackers.shared_setting(key)).map_err(ScenarioError::from)?;
        }
        sweep.seed = self.seed.or(sweep.seed);
        sweep.seeds = self.seeds.or(sweep.seeds);
        sweep.reports |= self.reports;
        sweep.draws |= self.draws;
        if self.zip {
            sweep.method = Expansion::Zip;
        }
        if let Some(objective) = &self.objective {
            sweep.objective.clone_from(objective);
        }
        Ok(file.starting(self.trackers.commands()).with(sweep)?)
    }

    fn parts(&self) -> (Option<&Path>, Vec<String>) {
        parts(self.file.as_deref(), &self.assignments)
    }

    fn mocap_directory(&self) -> Option<PathBuf> {
        self.mocap_dir.clone().or_else(|| std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from))
    }
}

/// Refuses an override of a key that a value of an axis of the file sets, because the axis would win in silence.
fn refuse_overridden(sweep: &Sweep, assignment: &str) -> Result<(), ExperimentError> {
    let key_of = |assignment: &str| assignment.split('=').next().unwrap_or_default().trim().to_owned();
    let key = key_of(assignment);
    let ends =
        |long: &str, short: &str| long.strip_suffix(short).is_some_and(|rest| rest.is_empty() || rest.ends_with('.'));
    for (axis, values) in &sweep.axes {
        for set in values.as_array().into_iter().flatten().filter_map(|value| value["set"].as_array()).flatten() {
            let other = key_of(set.as_str().unwrap_or_default());
            if *axis != key && (ends(&key, &other) || ends(&other, &key)) {
                let detail = format!(
                    "{key} is set by a value of the axis {axis}, which would win; change it in a copy of the file"
                );
                return Err(ExperimentError::Argument { argument: "KEY=VALUES", detail });
            }
        }
    }
    Ok(())
}

/// Plan a sweep: write its cells into a directory
#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  skiagraph sweep plan scenarios/sweeps/particles-layers.toml --out sweeps/mine\n  \
                        skiagraph sweep plan scenarios/walk.toml particles=50,100 --seeds 10 --out sweeps/mine --extend\n\n\
                        Writes DIR/plan.json and DIR/cells.jsonl. Run the sweep with `skiagraph sweep run DIR`,\n\
                        or a part of it with `skiagraph sweep run DIR --part 3/20`."
)]
pub(super) struct PlanArguments {
    #[command(flatten)]
    definition: Definition,

    /// Directory of the sweep
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Replace a different plan in DIR, keeping the results of cells that are in both plans
    #[arg(long)]
    extend: bool,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn plan(arguments: &PlanArguments) -> Result<ExitCode, CommandError> {
    let draft = arguments.definition.draft()?;
    let planned = draft.freeze(&arguments.out, arguments.extend)?;
    let record = &draft.record;
    if arguments.json {
        output::print_json(&json!({
            "schema": "skiagraph.sweep_planned/1",
            "out": arguments.out,
            "cells": record.cells,
            "settings": record.settings,
            "seeds": record.seeds,
            "sets": record.sets,
            "new": planned != Planned::Same,
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let out = arguments.out.display();
    let what = match planned {
        Planned::New => "planned",
        Planned::Same => "already planned",
        Planned::Replaced => "planned again; results of unchanged cells are kept",
    };
    output::print(&format!("{out}: {}, {what}\n  run it: skiagraph sweep run {out}", describe_size(record),))?;
    Ok(ExitCode::SUCCESS)
}

/// `skiagraph check SWEEP`: reads all settings and counts the cells.
pub(in crate::cli) fn check_file(
    path: &Path,
    mocap_dir: Option<PathBuf>,
    json: bool,
) -> Result<ExitCode, CommandError> {
    let definition = Definition { file: Some(path.to_owned()), mocap_dir, ..Definition::default() };
    let record = definition.draft()?.record;
    if json {
        output::print_json(&json!({
            "schema": "skiagraph.sweep_check/2",
            "sound": true,
            "name": record.name,
            "cells": record.cells,
            "settings": record.settings,
            "seeds": record.seeds.len(),
            "sets": record.sets,
        }))?;
    } else {
        output::print(&format!("{} is valid: {}", record.name, describe_size(&record)))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn describe_size(record: &PlanRecord) -> String {
    format!(
        "{} ({} x {}) on {}",
        output::counted(record.cells, "cell"),
        output::counted(record.settings, "setting"),
        output::counted(record.seeds.len(), "seed"),
        output::counted(record.sets, "set"),
    )
}
