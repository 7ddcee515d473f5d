//! `skiagraph check`.

use std::process::ExitCode;

use clap::Args;

use super::scenario_arguments::ScenarioArguments;
use super::{CommandError, output};

/// Say whether a scenario is sound, before any work
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph check scenarios/walk.toml\n  \
                        skiagraph check scenarios/cmu/walk4.toml --mocap-dir ~/cmu\n  \
                        skiagraph check scenarios/walk.toml rig.ring.count=2 --json")]
pub(super) struct Arguments {
    #[command(flatten)]
    scenario: ScenarioArguments,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let file = arguments.scenario.open()?;
    let _ = arguments.scenario.mocap_directory();
    if arguments.json {
        output::print_json(&file.scenario)?;
    } else {
        output::print(&format!("{} is sound", file.origin))?;
    }
    Ok(ExitCode::SUCCESS)
}
