//! `skiagraph schema`.

use std::process::ExitCode;

use clap::Args;

use super::{CommandError, output};
use crate::scenario::Scenario;
use crate::sweep::{Suite, Sweep};

/// Print the JSON schema of scenario files, of sweep files or of suite files
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph schema > scenario.schema.json\n  \
                        skiagraph schema --sweep > sweep.schema.json\n  \
                        skiagraph schema --suite > suite.schema.json\n\n\
                        Editors with TOML support then complete and check a scenario that begins with\n  \
                        #:schema ./scenario.schema.json")]
pub(super) struct Arguments {
    /// The schema of sweep files
    #[arg(long)]
    sweep: bool,

    /// The schema of suite files
    #[arg(long, conflicts_with = "sweep")]
    suite: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    output::print_json(&match (arguments.sweep, arguments.suite) {
        (true, _) => Sweep::json_schema(),
        (_, true) => Suite::json_schema(),
        _ => Scenario::json_schema(),
    })?;
    Ok(ExitCode::SUCCESS)
}
