//! `skiagraph sweep status` and `gather`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::super::{CommandError, output};
use crate::sweep::{PlannedSweep, RUNS_LINES, RUNS_TABLE, TIMING_TABLE, gather, sweep_status};

/// List which cells of a sweep have results
///
/// Counts result files only; does not query the cluster's queue.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep status sweeps/mine\n  \
                        sbatch --array=$(skiagraph sweep status sweeps/mine --missing) cell.sh\n  \
                        skiagraph sweep status sweeps/mine --json")]
pub(super) struct StatusArguments {
    /// Directory of the sweep
    #[arg(value_name = "DIR")]
    sweep: PathBuf,

    /// Print the indices of cells without a result in the format of job arrays: 3,7-8
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

/// Collect the results of all cells into one table
///
/// Writes DIR/runs.csv and DIR/runs.jsonl, with the same bytes wherever the cells were run, and DIR/timing.csv with
/// their cost.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep gather sweeps/mine\n  \
                        skiagraph sweep gather sweeps/mine --allow-partial\n\n\
                        Exit code 1: cells are missing and --allow-partial is not given.")]
pub(super) struct GatherArguments {
    /// Directory of the sweep
    #[arg(value_name = "DIR")]
    sweep: PathBuf,

    /// Gather the available results; cells without a result have no row
    #[arg(long)]
    allow_partial: bool,
}

pub(super) fn gather_all(arguments: &GatherArguments) -> Result<ExitCode, CommandError> {
    let sweep = PlannedSweep::open_results(&arguments.sweep)?;
    let gathered = gather(&sweep, arguments.allow_partial)?;
    let missing = match gathered.cells - gathered.done {
        0 => String::new(),
        missing => format!(", {missing} missing"),
    };
    output::print(&format!(
        "{}: {} gathered{missing}, {} graded lost, {} cannot be run\n  {RUNS_TABLE}, {RUNS_LINES}, \
         {TIMING_TABLE}",
        arguments.sweep.display(),
        output::counted(gathered.done, "cell"),
        gathered.diverged,
        gathered.failed,
    ))?;
    Ok(ExitCode::SUCCESS)
}
