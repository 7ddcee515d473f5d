//! `skiagraph schema`.

use std::process::ExitCode;

use clap::Args;

use super::{CommandError, output};
use crate::scenario::{Recording, Scenario};
use crate::sweep::Sweep;

/// Print the JSON schema of scenario files, sweep files or recordings
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph schema > scenario.schema.json\n  \
                        skiagraph schema --sweep > sweep.schema.json\n  \
                        skiagraph schema --recording > recording.schema.json\n\n\
                        Editors with TOML support then complete and check a scenario that begins with\n  \
                        #:schema ./scenario.schema.json")]
pub(super) struct Arguments {
    /// The schema of sweep files
    #[arg(long)]
    sweep: bool,

    /// The schema of recordings, for skiagraph import
    #[arg(long, conflicts_with = "sweep")]
    recording: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    output::print_json(&match (arguments.sweep, arguments.recording) {
        (true, _) => Sweep::json_schema(),
        (_, true) => Recording::json_schema(),
        _ => Scenario::json_schema(),
    })?;
    Ok(ExitCode::SUCCESS)
}
