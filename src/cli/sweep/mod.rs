//! `skiagraph sweep`.

mod definition;
mod run;

use std::process::ExitCode;

use clap::{Args, Subcommand};

use super::CommandError;
use super::volume::Volume;

pub(super) use self::definition::{Definition, check_file};
pub(super) use self::run::PartOf;

/// Run many settings of a scenario: a grid on the command line, or a sweep file
///
/// Without a subcommand: plan, run on this machine, and rank the settings. A value with commas is an axis; a value
/// without commas applies to all settings. Clips, places, bodies, cameras and errors of observations are axes too; with
/// --exec and --tracker, all trackers run on every setting. Cells with results are not run again: repeat the command to
/// resume. Settings that leave frames without an estimate are not ranked. skiagraph report DIR writes the page.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:\n  skiagraph sweep scenarios/walk.toml particles=50,100,200 rig.ring.count=2,4 --seeds 5\n  \
                  skiagraph sweep scenarios/sweeps/particles-layers.toml --out sweeps/mine -j 2\n  \
                  skiagraph sweep scenarios/walk.toml --exec \"python3 mine.py --alpha {alpha}\" alpha=0.1,0.3 --seeds 5 --draws\n  \
                  skiagraph sweep scenarios/sweeps/quick.toml --exec ./a --exec ./b --name a --name b --tracker frozen\n  \
                  skiagraph sweep plan scenarios/sweeps/particles-layers.toml --out sweeps/mine\n  \
                  skiagraph sweep run sweeps/mine -j 8\n  \
                  skiagraph sweep run sweeps/mine --part 3/20\n  \
                  skiagraph sweep status sweeps/mine --missing"
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    action: Option<SweepAction>,

    #[command(flatten)]
    definition: Definition,

    #[command(flatten)]
    direct: run::Direct,
}

#[derive(Debug, Subcommand)]
enum SweepAction {
    Plan(definition::PlanArguments),
    Run(run::Arguments),
    Status(run::StatusArguments),
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    match &arguments.action {
        None => run::directly(&arguments.definition, &arguments.direct, volume),
        Some(SweepAction::Plan(arguments)) => definition::plan(arguments),
        Some(SweepAction::Run(arguments)) => run::run(arguments, volume),
        Some(SweepAction::Status(arguments)) => run::status(arguments),
    }
}

/// Number of parallel jobs; by default `--threads`, or the number of cores.
pub(super) fn jobs_or_all_cores(jobs: Option<impl Into<u32>>) -> usize {
    jobs.map_or_else(rayon::current_num_threads, |jobs| jobs.into() as usize)
}
