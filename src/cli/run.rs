//! `skiagraph run`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::output_arguments::OutputArguments;
use super::progress::Progress;
use super::scenario_arguments::ScenarioArguments;
use super::{CommandError, notes, output, summary};
use crate::experiment::{COMPARISON_PAGE, Destination, REPORT_FILE, ScenarioFile, compare, run as run_experiment};

/// Render, track, evaluate and report in one go
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph run\n  skiagraph run scenarios/walk.toml --seeds 5\n  \
                        skiagraph run scenarios/walk.toml tracker.annealed_particle_filter.particles=400 --out runs/400\n  \
                        skiagraph run scenarios/cmu/walk4.toml --mocap-dir ~/cmu tracker_body.mismatch=none\n  \
                        skiagraph run scenarios/walk.toml tracker.frozen={}")]
pub(super) struct Arguments {
    #[command(flatten)]
    scenario: ScenarioArguments,

    /// First random seed, instead of the scenario's
    #[arg(long, value_name = "N")]
    seed: Option<u32>,

    /// How many seeds, instead of the scenario's
    #[arg(long, value_name = "N")]
    seeds: Option<u32>,

    /// Where the results go [default: runs/NAME]; a run of ours that is there is replaced
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    #[command(flatten)]
    output: OutputArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let mut more = Vec::new();
    more.extend(arguments.seed.map(|seed| format!("seed={seed}")));
    more.extend(arguments.seeds.map(|seeds| format!("seeds={seeds}")));
    let file = arguments.scenario.open_with(more)?;
    let out = arguments.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(&file.scenario.name));
    let progress = arguments.output.progress();
    let to = arguments.output.destination(&out);
    if !file.scenario.methods.is_empty() {
        return run_methods(arguments, &file, to, progress);
    }
    let done = run_experiment(&file, arguments.scenario.mocap_directory().as_deref(), to, &progress)
        .map_err(|e| e.about(&file.origin))?;
    drop(progress);
    if !arguments.output.quiet {
        notes::tell(&done.notes);
    }
    if arguments.output.json {
        output::print_json(&done.record)?;
    } else {
        output::print(&summary::table(&done.record))?;
        output::print(&format!("\n  report: {}", out.join(REPORT_FILE).display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn run_methods(
    arguments: &Arguments,
    file: &ScenarioFile,
    to: Destination<'_>,
    progress: Progress,
) -> Result<ExitCode, CommandError> {
    let done = compare(file, arguments.scenario.mocap_directory().as_deref(), to, &progress)
        .map_err(|e| e.about(&file.origin))?;
    drop(progress);
    if !arguments.output.quiet {
        notes::tell(&done.notes);
    }
    if arguments.output.json {
        output::print_json(&done.comparison)?;
    } else {
        output::print(&summary::methods(&done.comparison))?;
        output::print(&format!("\n  report: {}", to.path.join(COMPARISON_PAGE).display()))?;
    }
    Ok(ExitCode::SUCCESS)
}
