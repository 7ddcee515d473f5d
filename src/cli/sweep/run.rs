//! `skiagraph sweep run`, and `skiagraph sweep` itself.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

use clap::Args;
use serde_json::json;

use super::super::progress::TerminalProgress;
use super::super::summary::number;
use super::super::volume::Volume;
use super::super::{CommandError, output};
use super::definition::Definition;
use super::jobs_or_all_cores;
use crate::artefacts::ArtefactError;
use crate::common::ExperimentError;
use crate::sweep::page::percent;
use crate::sweep::{
    ByAxis, CellOptions, Draft, PlannedSweep, RUNS_TABLE, Ran, RunOptions, SettingSummary, SweepSummary, gather,
    part_of, run_cell, run_some, run_sweep, sweep_status,
};
use skiagraph_eval::FEWEST_RUNS;

/// Number of settings in the table; `runs.csv` has all.
const SHOWN: usize = 12;
const FAILURES: usize = 5;

/// Run all cells of a sweep that have no result, one cell per core
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep run sweeps/mine\n  skiagraph sweep run sweeps/mine -j 8\n  \
                        skiagraph sweep run sweeps/mine --part $SLURM_ARRAY_TASK_ID/20 -j 1\n  \
                        skiagraph sweep run sweeps/mine --report 17\n\n\
                        Safe to repeat and to kill. Once all cells have results, runs.csv and runs.jsonl have all of them,\n\
                        with the same bytes wherever cells were run, and timing.csv their cost. Exit code 1: some cells\n\
                        cannot be run; 3: no setting has an estimate in every frame; 75: try again.")]
pub(super) struct Arguments {
    /// Directory of the sweep
    #[arg(value_name = "DIR")]
    sweep: PathBuf,

    /// Run only part K of M, from 1: consecutive cells, about the same work in every part. Parts may run at the same
    /// time on any machines that share DIR
    #[arg(long, value_name = "K/M", conflicts_with = "report")]
    part: Option<PartOf>,

    /// Run only this cell, from 0, and keep a complete run with its report in DIR/reports
    #[arg(long, value_name = "CELL")]
    report: Option<usize>,

    #[command(flatten)]
    options: ExecutionOptions,
}

#[derive(Clone, Copy, Debug)]
pub(in crate::cli) struct PartOf {
    pub(in crate::cli) part: usize,
    pub(in crate::cli) parts: usize,
}

impl FromStr for PartOf {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text.split_once('/').and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
        match parsed {
            Some((part, parts)) if part >= 1 && part <= parts && parts <= 1_000_000 => Ok(Self { part, parts }),
            _ => Err("expected K/M with K from 1 to M, such as 3/40".to_owned()),
        }
    }
}

/// Options of a command that runs cells.
#[derive(Args, Clone, Debug)]
pub(super) struct ExecutionOptions {
    /// Parallel jobs, each on one core [default: all cores]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,

    /// Retry cells that could not be run
    #[arg(long)]
    retry_failed: bool,

    /// Print one JSON object: every setting with its mean and interval
    #[arg(long)]
    json: bool,
}

impl ExecutionOptions {
    fn run_options(&self) -> RunOptions {
        RunOptions { jobs: jobs_or_all_cores(self.jobs), retry_failed: self.retry_failed }
    }
}

/// Options of `skiagraph sweep` without a subcommand.
#[derive(Args, Clone, Debug)]
pub(super) struct Direct {
    /// Directory of the sweep [default: sweeps/NAME, or sweeps/NAME-2 and so on if it holds another sweep]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    #[command(flatten)]
    options: ExecutionOptions,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let root = &arguments.sweep;
    if let Some(index) = arguments.report {
        return one_cell(root, index, volume);
    }
    let Some(PartOf { part, parts }) = arguments.part else {
        return run_and_rank(root, &arguments.options, volume);
    };
    let sweep = PlannedSweep::open(root)?;
    let cells = sweep.cells()?;
    let range = part_of(&cells, part, parts);
    let progress = TerminalProgress::new(volume);
    let ran = run_some(&sweep, &cells[range], arguments.options.run_options(), &progress);
    drop(progress);
    let ran = ran.map_err(|error| resumable(error, root))?;
    // the last part writes the tables
    let status = gather(&sweep)?;
    let (run, cached, failed, left) = (ran.run, ran.cached, ran.failed.len(), status.cells - status.done);
    output::print(&format!(
        "part {part}/{parts}: {run} run, {cached} had results, {failed} cannot be run; {left} of all cells have no result"
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// Runs one cell, unless it has a result and a report.
fn one_cell(root: &Path, index: usize, volume: Volume) -> Result<ExitCode, CommandError> {
    let sweep = PlannedSweep::open(root)?;
    let cells = sweep.cells()?;
    let cell = cells.get(index).ok_or_else(|| ExperimentError::Argument {
        argument: "--report",
        detail: format!("expected 0 to {}, found {index}", cells.len().saturating_sub(1)),
    })?;
    let progress = TerminalProgress::new(volume);
    // a cell runs on one core, as when a sweep runs many
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build()?;
    let done = pool.install(|| run_cell(&sweep, cell, CellOptions { report: true }, &progress))?;
    drop(progress);
    let found = match (&done.record.error, done.record.metrics.get(&sweep.plan.objective)) {
        (Some(error), _) => error.clone(),
        (None, value) => format!("{} {}", sweep.plan.objective, value.map_or("-".to_owned(), |value| number(*value))),
    };
    output::print(&format!("cell {index} {}: {}: {found}", done.record.cell, done.record.status.name()))?;
    Ok(ExitCode::SUCCESS)
}

/// List which cells of a sweep have results
///
/// Counts result files only.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep status sweeps/mine\n  \
                        skiagraph sweep status sweeps/mine --missing\n  \
                        skiagraph sweep status sweeps/mine --json")]
pub(super) struct StatusArguments {
    /// Directory of the sweep
    #[arg(value_name = "DIR")]
    sweep: PathBuf,

    /// Print the indices of cells without a result: 3,7-8
    #[arg(long, conflicts_with = "json")]
    missing: bool,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn status(arguments: &StatusArguments) -> Result<ExitCode, CommandError> {
    let status = sweep_status(&PlannedSweep::open_results(&arguments.sweep)?)?;
    if arguments.json {
        output::print_json(&status)?;
    } else if arguments.missing {
        output::print(&status.missing)?;
    } else {
        let mut text = format!("{}: {} of {} cells have results", status.name, status.done, status.cells);
        if status.diverged > 0 {
            text.push_str(&format!("; {} graded lost", status.diverged));
        }
        if status.failed > 0 {
            text.push_str(&format!("; {} cannot be run: {}", status.failed, status.failed_cells));
        }
        if !status.missing.is_empty() {
            text.push_str(&format!("\n  missing: {}", status.missing));
        }
        output::print(&text)?;
    }
    Ok(ExitCode::SUCCESS)
}

pub(super) fn directly(definition: &Definition, direct: &Direct, volume: Volume) -> Result<ExitCode, CommandError> {
    let root = planned(definition, direct, volume)?;
    run_and_rank(&root, &direct.options, volume)
}

/// Plans a sweep in `--out`, or else in the first default folder that is free or has the same plan.
fn planned(definition: &Definition, direct: &Direct, volume: Volume) -> Result<PathBuf, CommandError> {
    let draft = definition.draft()?;
    let root = freeze(&draft, direct.out.as_deref())?;
    let record = &draft.record;
    if !volume.quiet && !direct.options.json {
        volume.notes(&[format!(
            "{}: {} ({} x {})",
            root.display(),
            output::counted(record.cells, "cell"),
            output::counted(record.settings, "setting"),
            output::counted(record.seeds.len(), if record.draws { "draw" } else { "seed" }),
        )]);
    }
    Ok(root)
}

/// Writes the plan to `out`, or else to the first default folder that is free or has the same plan.
fn freeze(draft: &Draft, out: Option<&Path>) -> Result<PathBuf, ExperimentError> {
    if let Some(path) = out {
        return match draft.freeze(path, false) {
            Err(ExperimentError::Artefact(ArtefactError::Occupied { .. })) => Err(ExperimentError::Argument {
                argument: "--out",
                detail: format!("{} holds other files; choose a new or empty directory", path.display()),
            }),
            frozen => frozen.map(|_| path.to_owned()),
        };
    }
    let name = &draft.record.name;
    let first = Path::new("sweeps").join(name);
    for number in 1_u32.. {
        let path = if number == 1 { first.clone() } else { first.with_file_name(format!("{name}-{number}")) };
        match draft.freeze(&path, false) {
            Err(ExperimentError::OtherPlan { .. }) => {}
            other => return other.map(|_| path),
        }
    }
    Ok(first)
}

fn run_and_rank(root: &Path, options: &ExecutionOptions, volume: Volume) -> Result<ExitCode, CommandError> {
    let sweep = PlannedSweep::open(root)?;
    let progress = TerminalProgress::new(volume);
    let ran = run_sweep(&sweep, options.run_options(), &progress);
    drop(progress);
    let ran = ran.map_err(|error| resumable(error, root))?;
    gather(&sweep)?;
    let every = SweepSummary::new(&sweep)?;
    let summary = every.averaged_over(&sweep.definition()?.sweep.average_over);
    let is_judged = !summary.ranked().is_empty();
    if options.json {
        output::print_json(&json!({
            "schema": "skiagraph.sweep_run/1",
            "run": ran.run,
            "cached": ran.cached,
            "diverged": ran.diverged,
            "failed": ran.failed,
            "by_axis": ByAxis::new(&sweep, &every)?,
            "summary": summary,
        }))?;
    } else {
        output::print(&describe(root, &ran, &summary))?;
    }
    Ok(match (ran.failed.is_empty(), is_judged) {
        (false, _) => ExitCode::from(1),
        (true, false) => ExitCode::from(3),
        (true, true) => ExitCode::SUCCESS,
    })
}

fn describe(root: &Path, ran: &Ran, summary: &SweepSummary) -> String {
    let had = if ran.cached > 0 { format!(", {} had results", ran.cached) } else { String::new() };
    let lost = if ran.diverged > 0 {
        format!(", {} lost the body", output::counted(ran.diverged, "cell"))
    } else {
        String::new()
    };
    format!(
        "{}: ran {}{had}{lost}\n\n{}{}{}\n\n  table: {}\n  page: skiagraph report {}",
        summary.name,
        output::counted(ran.run, "cell"),
        ranking(summary),
        summary.remarks.iter().map(|remark| format!("\n  {remark}")).collect::<String>(),
        describe_failures(&ran.failed),
        root.join(RUNS_TABLE).display(),
        root.display(),
    )
}

/// Unlike elsewhere, finished cells are kept after an interruption.
fn resumable(error: ExperimentError, root: &Path) -> ExperimentError {
    match error {
        ExperimentError::Interrupted => ArtefactError::ProgressSaved { partial: root.to_owned() }.into(),
        error => error,
    }
}

fn ranking(summary: &SweepSummary) -> String {
    let ranked = summary.ranked();
    let width =
        summary.settings.iter().take(1000).map(|setting| setting.words.chars().count()).max().unwrap_or(0).max(8);
    let title = summary.metric().map_or(summary.objective.as_str(), |metric| metric.name);
    let mut lines = vec![format!(
        "  {:<width$}  {title:>14}   {:^20}  {:>8}  {:>11}  {:>12}  {:>4}",
        "setting",
        if summary.has_intervals() { "95 % interval" } else { "range over seeds" },
        "coverage",
        "evaluations",
        "processor ms",
        "lost"
    )];
    lines.extend(ranked.iter().take(SHOWN).map(|setting| row(setting, width, summary.has_intervals())));
    if ranked.len() > SHOWN {
        lines.push(format!("  and {} more", output::counted(ranked.len() - SHOWN, "setting")));
    }
    if ranked.is_empty() {
        lines.push("  nothing is judged: no setting has an estimate in every frame".to_owned());
    }
    let left_out: Vec<&SettingSummary> = summary.settings.iter().filter(|setting| !setting.is_judged()).collect();
    if !left_out.is_empty() {
        let left = output::counted(left_out.len(), "setting");
        lines.push(format!("  not judged: {left} that cannot be run, or leave frames without an estimate"));
        lines.extend(left_out.iter().take(FAILURES).map(|setting| row(setting, width, summary.has_intervals())));
    }
    lines.push(format!(
        "\n  means over {}{}; evaluations and processor time are per frame; lost: seeds lost the body",
        output::counted(summary.seeds.len(), "seed"),
        if summary.has_intervals() { String::new() } else { format!(" (an interval needs {FEWEST_RUNS})") }
    ));
    lines.join("\n")
}

fn row(setting: &SettingSummary, width: usize, has_intervals: bool) -> String {
    let ends = setting.interval_or_range(has_intervals);
    let interval = ends.map_or("-".to_owned(), |[low, high]| format!("{} to {}", number(low), number(high)));
    let value = |value: Option<f64>| value.map_or("-".to_owned(), number);
    format!(
        "  {:<width$}  {:>14}   {:^20}  {:>8}  {:>11}  {:>12}  {:>4}",
        setting.words,
        value(setting.mean),
        interval,
        setting.coverage.map_or("-".to_owned(), percent),
        value(setting.evaluations_per_frame),
        value(setting.processor_ms_per_frame),
        setting.diverged,
    )
}

fn describe_failures(failed: &[(usize, String)]) -> String {
    if failed.is_empty() {
        return String::new();
    }
    let mut lines = vec![format!("\n\n  {} cannot be run:", output::counted(failed.len(), "cell"))];
    lines.extend(failed.iter().take(FAILURES).map(|(index, error)| format!("  cell {index}: {error}")));
    if failed.len() > FAILURES {
        lines.push(format!("  and {} more", failed.len() - FAILURES));
    }
    lines.join("\n")
}
