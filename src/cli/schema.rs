//! `skiagraph schema`.

use std::process::ExitCode;

use clap::Args;

use super::{CommandError, output};
use crate::scenario::Scenario;

/// Print the JSON schema of scenario files
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph schema > scenario.schema.json\n\n\
                        Editors with TOML support then complete and check a scenario that begins with\n  \
                        #:schema ./scenario.schema.json")]
pub(super) struct Arguments {}

pub(super) fn run(_: &Arguments) -> Result<ExitCode, CommandError> {
    output::print_json(&Scenario::json_schema())?;
    Ok(ExitCode::SUCCESS)
}
