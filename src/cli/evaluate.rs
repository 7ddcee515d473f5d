//! `skiagraph evaluate`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::progress::Progress;
use super::volume::Volume;
use super::{CommandError, output, summary};
use crate::experiment::{REPORT_FILE, evaluate_run};

/// Measure a run against the truth of its set
///
/// Writes run.json, per_frame.csv, poses.npz and report.html into RUN. Of a run that another program made only
/// poses.npz (fps, seeds, estimate_root, estimate_angles) need be there.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph evaluate sets/walk runs/walk\n  \
                        skiagraph evaluate sets/walk runs/walk --json")]
pub(super) struct Arguments {
    /// The benchmark set's directory
    #[arg(value_name = "SET")]
    set: PathBuf,

    /// The run's directory
    #[arg(value_name = "RUN")]
    run: PathBuf,

    /// Print run.json instead of a table
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let progress = Progress::new(volume);
    let record = evaluate_run(&arguments.set, &arguments.run, &progress)?;
    drop(progress);
    volume.written(&arguments.run);
    if arguments.json {
        output::print_json(&record)?;
    } else {
        output::print(&summary::table(&record))?;
        output::print(&format!("\n  report: {}", arguments.run.join(REPORT_FILE).display()))?;
    }
    Ok(ExitCode::SUCCESS)
}
