//! `skiagraph sweep status`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::super::{CommandError, output};
use crate::experiment::sweep::{PlannedSweep, sweep_status};

/// List which cells of a sweep have results
///
/// Counts result files only and does not ask the cluster's queue.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep status sweeps/mine\n  \
                        sbatch --array=$(skiagraph sweep status sweeps/mine --missing) cell.sh\n  \
                        skiagraph sweep status sweeps/mine --json")]
pub(super) struct Arguments {
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

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let status = sweep_status(&PlannedSweep::open(&arguments.sweep)?)?;
    if arguments.json {
        output::print_json(&status)?;
    } else if arguments.missing {
        output::print(&status.missing)?;
    } else {
        let mut text = format!("{}: {} of {} cells have results", status.name, status.done, status.cells);
        if status.diverged > 0 {
            text.push_str(&format!("; the tracker lost the body in {}", status.diverged));
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
