//! `skiagraph sweep cell`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

use clap::Args;

use super::super::file_access::FileAccess;
use super::super::progress::TerminalProgress;
use super::super::volume::Volume;
use super::super::{CommandError, output};
use crate::common::ExperimentError;
use crate::sweep::{CellOptions, RunOptions, Status, run_cell, run_some, shard};

/// Run one cell or one shard of a sweep; cluster jobs call this
///
/// Safe to repeat and to kill: a cell with a result is not run again, and no partial result remains. A tracker that
/// loses the body is a result (exit code 0), and so is a setting that cannot be run. Exit code 75: try again; 2: bad
/// input.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph sweep cell sweeps/mine --index 17\n  \
                        skiagraph sweep cell sweeps/mine --shard 3/40\n  \
                        skiagraph sweep cell sweeps/mine --index 17 --report\n  \
                        parallel skiagraph sweep cell sweeps/mine --index {} ::: $(seq 0 99)")]
pub(super) struct Arguments {
    /// Directory of the sweep
    #[arg(value_name = "DIR")]
    sweep: PathBuf,

    /// Index of the cell, from 0
    #[arg(long, value_name = "N", required_unless_present = "shard", conflicts_with = "shard")]
    index: Option<usize>,

    /// Shard K of M, from 1: consecutive cells, about the same work in every shard
    #[arg(long, value_name = "K/M")]
    shard: Option<ListPart>,

    /// Also keep a complete run with its report in DIR/reports
    #[arg(long, conflicts_with = "shard")]
    report: bool,

    /// Run the cell even if it has a result
    #[arg(long, conflicts_with = "shard")]
    again: bool,

    /// Parallel jobs, each on one core
    #[arg(short, long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: u16,

    #[command(flatten)]
    access: FileAccess,
}

#[derive(Clone, Copy, Debug)]
struct ListPart {
    part: usize,
    parts: usize,
}

impl FromStr for ListPart {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text.split_once('/').and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
        match parsed {
            Some((part, parts)) if part >= 1 && part <= parts && parts <= 1_000_000 => Ok(Self { part, parts }),
            _ => Err("expected K/M with K from 1 to M, such as 3/40".to_owned()),
        }
    }
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let sweep = arguments.access.open_sweep(&arguments.sweep)?;
    let cells = sweep.cells()?;
    let progress = TerminalProgress::new(volume);
    if let Some(ListPart { part, parts }) = arguments.shard {
        let part_of = &cells[shard(&cells, part, parts)];
        let options = RunOptions { jobs: usize::from(arguments.jobs), retry_failed: false };
        let ran = run_some(&sweep, part_of, options, &progress)?;
        drop(progress);
        let (run, cached, failed) = (ran.run, ran.cached, ran.failed.len());
        output::print(&format!("shard {part}/{parts}: {run} run, {cached} had results, {failed} cannot be run"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let index = arguments.index.unwrap_or_default();
    let cell = cells.get(index).ok_or_else(|| ExperimentError::Argument {
        argument: "--index",
        detail: format!("expected 0 to {}, found {index}", cells.len().saturating_sub(1)),
    })?;
    let options = CellOptions { again: arguments.again, report: arguments.report };
    // a cell runs on one core, as when a sweep runs many
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build()?;
    let done = pool.install(|| run_cell(&sweep, cell, options, &progress))?;
    drop(progress);
    let record = &done.record;
    let value = match (record.metrics.get(&sweep.plan.objective), &record.error) {
        (_, Some(error)) => error.clone(),
        (Some(value), None) => format!("{} {value:.3}", sweep.plan.objective),
        (None, None) => format!("no {}", sweep.plan.objective),
    };
    let state = if done.cached { "cached" } else { record.status.name() };
    output::print(&format!("cell {index} {}: {state}: {value}", record.cell))?;
    debug_assert!(record.error.is_some() == (record.status == Status::Failed));
    Ok(ExitCode::SUCCESS)
}
