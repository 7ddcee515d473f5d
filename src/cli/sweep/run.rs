//! `skiagraph sweep run`, and `skiagraph sweep` itself.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use super::super::file_access::FileAccess;
use super::super::progress::TerminalProgress;
use super::super::summary::number;
use super::super::volume::Volume;
use super::super::{CommandError, output};
use super::definition::Definition;
use super::jobs_or_all_cores;
use crate::artefacts::ArtefactError;
use crate::common::ExperimentError;
use crate::evaluation::FEWEST_RUNS;
use crate::sweep::{Draft, PlannedSweep, RUNS_TABLE, Ran, RunOptions, SettingSummary, SweepSummary, gather, run_sweep};

/// Number of settings in the table; `runs.csv` has all.
const SHOWN: usize = 12;
/// Number of failed cells that are printed.
const FAILURES: usize = 5;

/// Run all cells of a sweep that have no result, one cell per core
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep run sweeps/mine\n  skiagraph sweep run sweeps/mine -j 8\n\n\
                        To resume after an interruption, run the same command again. Exit code 1: some cells cannot be\n\
                        run; their messages are in runs.csv.")]
pub(super) struct Arguments {
    /// Directory of the sweep
    #[arg(value_name = "DIR")]
    sweep: PathBuf,

    #[command(flatten)]
    options: ExecutionOptions,

    #[command(flatten)]
    access: FileAccess,
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
    pub(super) json: bool,
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
    run_and_rank(&arguments.sweep, &arguments.options, arguments.access, volume)
}

/// Plans, runs, gathers and ranks.
pub(super) fn directly(definition: &Definition, direct: &Direct, volume: Volume) -> Result<ExitCode, CommandError> {
    let root = planned(definition, Path::new("sweeps"), direct.out.as_deref(), &direct.options, volume)?;
    run_and_rank(&root, &direct.options, definition.access, volume)
}

/// Plans a sweep in `out`, or else in the first default folder below `folder` that is free or has the same plan.
pub(super) fn planned(
    definition: &Definition,
    folder: &Path,
    out: Option<&Path>,
    options: &ExecutionOptions,
    volume: Volume,
) -> Result<PathBuf, CommandError> {
    let draft = definition.draft()?;
    let root = freeze(&draft, folder, out)?;
    let record = &draft.record;
    if !volume.quiet && !options.json {
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
fn freeze(draft: &Draft, folder: &Path, out: Option<&Path>) -> Result<PathBuf, ExperimentError> {
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
    let first = folder.join(name);
    for number in 1_u32.. {
        let path = if number == 1 { first.clone() } else { first.with_file_name(format!("{name}-{number}")) };
        match draft.freeze(&path, false) {
            Err(ExperimentError::OtherPlan { .. }) => {}
            other => return other.map(|_| path),
        }
    }
    Ok(first)
}

fn run_and_rank(
    root: &Path,
    options: &ExecutionOptions,
    access: FileAccess,
    volume: Volume,
) -> Result<ExitCode, CommandError> {
    let (sweep, ran) = run_and_gather(root, options, access, volume)?;
    let summary = SweepSummary::new(&sweep)?.averaged_over(&sweep.definition()?.sweep.average_over);
    if options.json {
        output::print_json(&json!({
            "schema": "skiagraph.sweep_run/1",
            "run": ran.run,
            "cached": ran.cached,
            "diverged": ran.diverged,
            "failed": ran.failed,
            "summary": summary,
        }))?;
    } else {
        output::print(&describe(root, &ran, &summary))?;
    }
    Ok(if ran.failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Runs the cells without a result, and gathers all results.
pub(super) fn run_and_gather(
    root: &Path,
    options: &ExecutionOptions,
    access: FileAccess,
    volume: Volume,
) -> Result<(PlannedSweep, Ran), CommandError> {
    let sweep = access.open_sweep(root)?;
    let jobs = jobs_or_all_cores(options.jobs);
    let progress = TerminalProgress::new(volume);
    let ran = run_sweep(&sweep, RunOptions { jobs, retry_failed: options.retry_failed }, &progress);
    drop(progress);
    let ran = ran.map_err(|error| resumable(error, root))?;
    gather(&sweep, false)?;
    Ok((sweep, ran))
}

fn describe(root: &Path, ran: &Ran, summary: &SweepSummary) -> String {
    let had = if ran.cached > 0 { format!(", {} had results", ran.cached) } else { String::new() };
    let lost = if ran.diverged > 0 {
        format!(", {} graded lost", output::counted(ran.diverged, "cell"))
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

/// The best settings, best first.
fn ranking(summary: &SweepSummary) -> String {
    let ranked = summary.ranked();
    let width = ranked.iter().take(SHOWN).map(|setting| setting.words.chars().count()).max().unwrap_or(0).max(8);
    let title = summary.metric().map_or(summary.objective.as_str(), |metric| metric.name);
    let mut lines = vec![format!(
        "  {:<width$}  {title:>14}   {:^20}  {:>11}  {:>12}  {:>4}",
        "setting",
        if summary.has_intervals() { "95 % interval" } else { "range over seeds" },
        "evaluations",
        "processor ms",
        "lost"
    )];
    lines.extend(ranked.iter().take(SHOWN).map(|setting| row(setting, width, summary.has_intervals())));
    if ranked.len() > SHOWN {
        lines.push(format!("  and {} more", output::counted(ranked.len() - SHOWN, "setting")));
    }
    let without: Vec<&SettingSummary> = summary.settings.iter().filter(|setting| setting.mean.is_none()).collect();
    if !without.is_empty() {
        let named: Vec<&str> = without.iter().take(FAILURES).map(|setting| setting.words.as_str()).collect();
        let more = if without.len() > named.len() { ", ..." } else { "" };
        lines.push(format!(
            "  without a value: {} ({}{more})",
            output::counted(without.len(), "setting"),
            named.join("; ")
        ));
    }
    lines.push(format!(
        "\n  means over {}{}; evaluations and processor time are per frame; lost: seeds graded lost",
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
        "  {:<width$}  {:>14}   {:^20}  {:>11}  {:>12}  {:>4}",
        setting.words,
        value(setting.mean),
        interval,
        value(setting.evaluations_per_frame),
        value(setting.processor_ms_per_frame),
        setting.diverged,
    )
}

pub(in crate::cli) fn describe_failures(failed: &[(usize, String)]) -> String {
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
