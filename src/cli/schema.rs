//! `skiagraph schema`.

use std::process::ExitCode;

use clap::Args;

use super::{CommandError, output};
use crate::scenario::Scenario;
use crate::sweep::Sweep;

/// Print the JSON schema of scenario files or of sweep files
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph schema > scenario.schema.json\n  \
                        skiagraph schema --sweep > sweep.schema.json\n\n\
                        Editors with TOML support then complete and check a scenario that begins with\n  \
                        #:schema ./scenario.schema.json")]
pub(super) struct Arguments {
    /// The schema of sweep files
    #[arg(long)]
    sweep: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    output::print_json(&if arguments.sweep { Sweep::json_schema() } else { Scenario::json_schema() })?;
    Ok(ExitCode::SUCCESS)
}
