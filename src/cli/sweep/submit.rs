//! `skiagraph sweep submit`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::super::{CommandError, output};
use crate::sweep::{PlannedSweep, SubmitOptions, submit};

/// Submit a sweep to a Slurm cluster
///
/// Writes DIR/submit/shard.sh and close.sh and submits them: a job array with one task per shard, and a closing job
/// that waits for it, submits missing cells again, and gathers the results. A timed sample determines the size of
/// shards.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep submit sweeps/mine --dry-run\n  \
                        skiagraph sweep submit sweeps/mine -- --partition=cpu --mem=2G\n\n\
                        Show the progress with skiagraph sweep status DIR.")]
pub(super) struct Arguments {
    /// Directory of the sweep, on a file system shared by all nodes
    #[arg(value_name = "DIR")]
    sweep: PathBuf,

    /// Accepted for closing scripts of earlier versions
    #[arg(long, value_name = "ENGINE", default_value = "slurm", value_parser = ["slurm"], hide = true)]
    engine: String,

    /// Target time of a shard, in minutes
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u32).range(5..=30))]
    minutes: u32,

    /// Number of shards, overriding the automatic count
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    shards: Option<u32>,

    /// Print the scripts and commands without writing or submitting them
    #[arg(long)]
    dry_run: bool,

    #[arg(long, hide = true, default_value_t = 0)]
    round: usize,

    /// Additional arguments for sbatch
    #[arg(last = true, value_name = "ARGUMENT")]
    extra: Vec<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let sweep = PlannedSweep::open(&arguments.sweep)?;
    let options = SubmitOptions {
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
    let text = if done.array.is_empty() {
        format!("{}: all cells have results; nothing was submitted", arguments.sweep.display())
    } else {
        format!(
            "{}: {} submitted (of {}), jobs {}\n  progress: skiagraph sweep status {}",
            arguments.sweep.display(),
            done.array,
            output::counted(done.shards, "shard"),
            done.jobs.join(", "),
            arguments.sweep.display(),
        )
    };
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}
