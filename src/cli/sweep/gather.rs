//! `skiagraph sweep gather`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::super::{CommandError, output};
use crate::experiment::sweep::{PlannedSweep, RUNS_LINES, RUNS_TABLE, TIMING_TABLE, gather};

/// Collect the results of all cells into one table
///
/// Writes DIR/runs.csv and DIR/runs.jsonl, the same bytes wherever the cells were run, and DIR/timing.csv with what
/// they cost.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep gather sweeps/mine\n  \
                        skiagraph sweep gather sweeps/mine --allow-partial\n\n\
                        Exit code 1: cells are missing, and --allow-partial is not given.")]
pub(super) struct Arguments {
    /// Directory of the sweep
    #[arg(value_name = "DIR")]
    sweep: PathBuf,

    /// Gather the available results; cells without a result have no row
    #[arg(long)]
    allow_partial: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let sweep = PlannedSweep::open(&arguments.sweep)?;
    let gathered = gather(&sweep, arguments.allow_partial)?;
    let missing = match gathered.missing.len() {
        0 => String::new(),
        missing => format!(", {missing} missing"),
    };
    output::print(&format!(
        "{}: {} gathered{missing}, the tracker lost the body in {}, {} cannot be run\n  {RUNS_TABLE}, {RUNS_LINES}, \
         {TIMING_TABLE}",
        arguments.sweep.display(),
        output::counted(gathered.done, "cell"),
        gathered.diverged,
        gathered.failed,
    ))?;
    Ok(ExitCode::SUCCESS)
}
