//! `skiagraph twin`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use super::folders::expect_set;
use super::output_arguments::OutputArguments;
use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::twin::twin;

/// Make a synthetic scene like a recording, with a truth
///
/// From the set of a recording and a run on it: the cameras as the run corrected them, the tracked motion on a body of
/// the tracked proportions, and errors of masks and keypoints as they were measured against the tracked body. The
/// folder has a scenario, twin.toml, and the files that it names, for render, run and sweep. Its truth is exact
/// (docs/recordings.md).
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph twin sets/person runs/person --out twin\n  \
                        skiagraph run twin/twin.toml")]
pub(super) struct Arguments {
    /// Directory of the recording's set
    #[arg(value_name = "SET")]
    set: PathBuf,

    /// Directory of a run on it, or a file of poses as evaluate reads; the first seed is taken
    #[arg(value_name = "RUN")]
    run: PathBuf,

    /// Output directory
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    #[command(flatten)]
    output: OutputArguments,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    expect_set(&arguments.set)?;
    let progress = TerminalProgress::new(volume);
    let to = arguments.output.destination(&arguments.out);
    let notes = twin(&arguments.set, &arguments.run, to, &progress).map_err(|e| e.about(&arguments.set))?;
    drop(progress);
    volume.notes(&notes);
    volume.written(&arguments.out);
    let scenario = arguments.out.join("twin.toml").display().to_string();
    let facts = json!({ "schema": "skiagraph.twin/1", "scenario": scenario, "notes": notes });
    output::print_as(arguments.output.json, &facts, |_| format!("{scenario}\n  run it: skiagraph run {scenario}"))?;
    Ok(ExitCode::SUCCESS)
}
