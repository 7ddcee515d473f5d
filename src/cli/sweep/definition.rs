//! `SWEEP|SCENARIO [KEY=VALUE,VALUE...]` and the options that define a sweep;
//! `skiagraph sweep check` and `plan`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use super::super::file_access::FileAccess;
use super::super::program_arguments::TrackerArguments;
use super::super::volume::duration;
use super::super::{CommandError, output};
use super::jobs_or_all_cores;
use crate::common::ExperimentError;
use crate::scenario::{ScenarioError, ScenarioFile, ScenarioTemplate, split_at_commas};
use crate::sweep::{Draft, Expansion, LadderAxis, Planned, Suite, Sweep, SweepCost, SweepFile, sweep_cost};

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

    /// Keep only settings that satisfy this condition, such as "particles * layers <= 2000"; may be repeated
    #[arg(long, value_name = "CONDITION")]
    pub(in crate::cli) keep: Vec<String>,

    /// Metric to compare settings by [default: humaneva_mm]
    #[arg(long, value_name = "METRIC")]
    pub(in crate::cli) objective: Option<String>,

    /// Keep a complete run with its report for every cell, about 1 MB each
    #[arg(long)]
    pub(in crate::cli) reports: bool,

    /// Directory to search recursively for clips of the scenario [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    pub(in crate::cli) mocap_dir: Option<PathBuf>,

    /// Axes of a ladder, which `skiagraph ladder` sets.
    #[arg(skip)]
    pub(in crate::cli) ladder: Vec<LadderAxis>,

    /// Whether the file is a suite, as of `skiagraph suite`.
    #[arg(skip)]
    pub(in crate::cli) is_suite: bool,

    #[command(flatten)]
    pub(in crate::cli) access: FileAccess,
}

impl Definition {
    /// Reads the definition and expands its cells.
    ///
    /// # Errors
    /// [`ExperimentError`] that names the file, key or option.
    pub(super) fn draft(&self) -> Result<Draft, ExperimentError> {
        let file = self.read()?;
        let base = file.sweep.base.as_ref().map_or_else(PathBuf::new, |base| file.folder.join(base));
        let folder = base.parent().unwrap_or(Path::new(""));
        let mut allowed = self.access.allowed(folder, &self.parts().1, self.mocap_directory().as_deref());
        // the varied scenario itself
        self.parts().0.iter().for_each(|path| allowed.allow(path));
        let file = file.allowing(&allowed);
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
        let of_file = of_file.iter().map(String::as_str).filter(|_| !self.is_suite);
        let of_file = of_file.filter(|axis| !given.contains(&(axis, true))).map(|axis| (axis, true));
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
        let is_suite = self.is_suite || path.is_some_and(Suite::is_one);
        let file = match path {
            Some(path) if is_suite => Suite::open(path)?,
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
            if is_suite {
                Suite::refuse_overridden(&sweep, assignment)?;
            }
            let key = assignment.split('=').next().unwrap_or_default().trim();
            let is_axis = assignment.split_once('=').is_some_and(|(_, values)| split_at_commas(values).len() > 1);
            if self.is_suite && is_axis {
                let detail = format!(
                    "a suite varies only its conditions: give one value for {key} and run one suite per value, or use \
                     skiagraph sweep"
                );
                return Err(ExperimentError::Argument { argument: "KEY=VALUE", detail });
            }
            sweep.assign(assignment, &self.trackers.shared_setting(key)).map_err(ScenarioError::from)?;
        }
        sweep.seed = self.seed.or(sweep.seed);
        sweep.seeds = self.seeds.or(sweep.seeds);
        sweep.keep.extend(self.keep.iter().cloned());
        sweep.reports |= self.reports;
        sweep.draws |= self.draws;
        if self.zip {
            sweep.method = Expansion::Zip;
        }
        if let Some(objective) = &self.objective {
            sweep.objective.clone_from(objective);
        }
        if !self.ladder.is_empty() {
            let refuse = |detail| ExperimentError::Argument { argument: "--axis", detail };
            sweep = sweep.with_ladder(&self.ladder).map_err(refuse)?;
        }
        Ok(file.starting(self.trackers.commands()).with(sweep)?)
    }

    fn parts(&self) -> (Option<&Path>, Vec<String>) {
        match &self.file {
            Some(first) => match first.to_str().filter(|text| text.contains('=') && !first.exists()) {
                Some(assignment) => (None, [vec![assignment.to_owned()], self.assignments.clone()].concat()),
                None => (Some(first), self.assignments.clone()),
            },
            None => (None, self.assignments.clone()),
        }
    }

    fn mocap_directory(&self) -> Option<PathBuf> {
        self.mocap_dir.clone().or_else(|| std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from))
    }
}

/// Count the cells of a sweep and estimate its time from a timed sample
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep check scenarios/sweeps/particles-layers.toml\n  \
                        skiagraph sweep check scenarios/walk.toml particles=50,100 --seeds 5 -j 16")]
pub(super) struct CheckArguments {
    #[command(flatten)]
    definition: Definition,

    /// Number of parallel jobs to estimate the time for [default: all cores]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    jobs: Option<u32>,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl CheckArguments {
    /// Prints the number of cells, and their cost with this many parallel jobs.
    pub(super) fn run(&self) -> Result<ExitCode, CommandError> {
        let cost = sweep_cost(&self.definition.draft()?, jobs_or_all_cores(self.jobs))?;
        if self.json {
            output::print_json(&cost)?;
        } else {
            output::print(&describe_cost(&cost))?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Plan a sweep: write its cells into a directory
#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  skiagraph sweep plan scenarios/sweeps/particles-layers.toml --out sweeps/mine\n  \
                        skiagraph sweep plan scenarios/walk.toml particles=50,100 --seeds 10 --out sweeps/mine --extend\n\n\
                        Writes DIR/plan.json and DIR/cells.jsonl. Run the sweep with `skiagraph sweep run DIR`, cell by\n\
                        cell with `skiagraph sweep cell DIR --index N`, or on a cluster."
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
    output::print(&format!(
        "{out}: {} ({} x {}) on {}, {what}\n  run it: skiagraph sweep run {out}",
        output::counted(record.cells, "cell"),
        output::counted(record.settings, "setting"),
        output::counted(record.seeds.len(), "seed"),
        output::counted(record.sets, "set"),
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// `skiagraph check SWEEP`.
pub(in crate::cli) fn check_file(
    path: &Path,
    mocap_dir: Option<PathBuf>,
    access: FileAccess,
    json: bool,
) -> Result<ExitCode, CommandError> {
    let definition = Definition { file: Some(path.to_owned()), mocap_dir, access, ..Definition::default() };
    CheckArguments { definition, jobs: None, json }.run()
}

fn describe_cost(cost: &SweepCost) -> String {
    let learning = match cost.models_to_learn {
        0 => String::new(),
        _ => ", plus the time to learn motion models".to_owned(),
    };
    let [least, most] = cost.cell_s;
    format!(
        "{} is valid: {} ({} x {}) on {}\n  cost     a cell takes {} to {} on one core (measured on {})\n  \
         cost     all: about {} on one core, {} with {} in parallel{learning}",
        cost.name,
        output::counted(cost.cells, "cell"),
        output::counted(cost.settings, "setting"),
        output::counted(cost.seeds, "seed"),
        output::counted(cost.sets, "set"),
        duration(least),
        duration(most),
        output::counted(cost.sampled, "setting"),
        duration(cost.core_s),
        duration(cost.run_s),
        output::counted(cost.jobs, "cell"),
    )
}
