//! `skiagraph check`.

use std::process::ExitCode;

use clap::Args;

use super::scenario_arguments::ScenarioArguments;
use super::{CommandError, notes, output};
use crate::experiment::{Soundness, check};

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
    let soundness = check(&file, arguments.scenario.mocap_directory().as_deref()).map_err(|e| e.about(&file.origin))?;
    if arguments.json {
        output::print_json(&soundness)?;
    } else {
        output::print(&in_words(&file.origin, &soundness))?;
        notes::tell(&soundness.notes);
    }
    Ok(ExitCode::SUCCESS)
}

fn in_words(origin: &str, s: &Soundness) -> String {
    let model = if s.matched { "matched" } else { "mismatched" };
    let cost = match s.likelihood_evaluations {
        0 => String::new(),
        n => format!(", {n} likelihood evaluations"),
    };
    format!(
        "{origin} is sound\n  motion   {}: {} frames at {} Hz, {:.2} s; {:.1} mm from the recording\n  \
         bodies   actor {}, tracker {}: {model}\n  cameras  {}\n  tracker  {}, {} seed(s){cost}",
        s.clip,
        s.frames,
        s.frames_per_second,
        s.duration_s,
        s.retarget_residual_mm,
        s.actor,
        s.tracker_body,
        s.cameras.join(", "),
        s.tracker,
        s.seeds,
    )
}
