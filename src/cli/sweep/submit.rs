//! `skiagraph sweep submit`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};

use super::super::{CommandError, output};
use crate::experiment::sweep::{Engine, PlannedSweep, SubmitOptions, submit};

/// Submit a sweep to a cluster: Slurm's job arrays, or HyperQueue
///
/// Writes DIR/submit/shard.sh and close.sh and submits them: an array with one task a shard, and with Slurm a job that
/// waits for it, submits again what is missing, and gathers. A timed sample sizes the shards: 5 to 30 minutes each.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep submit sweeps/mine --engine slurm --dry-run\n  \
                        skiagraph sweep submit sweeps/mine --engine slurm -- --partition=cpu --mem=2G\n  \
                        skiagraph sweep submit sweeps/mine --engine hq\n\n\
                        Results are in DIR as they come: skiagraph sweep status DIR. With HyperQueue, gather when its job is\n\
                        done: hq job wait last && bash DIR/submit/close.sh")]
pub(super) struct Arguments {
    /// Directory of the sweep, on a file system that all nodes see
    #[arg(value_name = "DIR")]
    sweep: PathBuf,

    /// What runs the tasks
    #[arg(long, value_name = "ENGINE")]
    engine: Name,

    /// Minutes that a shard should take
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u32).range(5..=30))]
    minutes: u32,

    /// Number of shards, instead of as many as the time asks for
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    shards: Option<u32>,

    /// Print scripts and commands, write and submit nothing
    #[arg(long)]
    dry_run: bool,

    #[arg(long, hide = true, default_value_t = 0)]
    round: usize,

    /// More arguments of sbatch or hq submit
    #[arg(last = true, value_name = "ARGUMENT")]
    extra: Vec<String>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Name {
    Slurm,
    Hq,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let sweep = PlannedSweep::open(&arguments.sweep)?;
    let options = SubmitOptions {
        engine: match arguments.engine {
            Name::Slurm => Engine::Slurm,
            Name::Hq => Engine::HyperQueue,
        },
        minutes: arguments.minutes,
        shards: arguments.shards.map(|shards| shards as usize),
        round: arguments.round,
        dry_run: arguments.dry_run,
        extra: arguments.extra.clone(),
    };
    let done = submit(&sweep, &options)?;
    if arguments.dry_run {
        for (path, text) in &done.scripts {
            output::print(&format!("# {}\n{text}", path.display()))?;
        }
        output::print(&done.commands.join("\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let text = match done.array.is_empty() {
        true => format!("{}: all cells have results; nothing was submitted", arguments.sweep.display()),
        false => format!(
            "{}: {} submitted (of {}), jobs {}\n  how far it is: skiagraph sweep status {}",
            arguments.sweep.display(),
            done.array,
            output::counted(done.shards, "shard"),
            done.jobs.join(", "),
            arguments.sweep.display(),
        ),
    };
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}
