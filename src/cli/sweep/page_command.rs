//! What `skiagraph ladder` and `skiagraph suite` have in common: sweeps that write a page of their own.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde::Serialize;

use super::super::file_access::FileAccess;
use super::super::program_arguments::TrackerArguments;
use super::super::volume::Volume;
use super::super::{CommandError, output};
use super::definition::Definition;
use super::run::{ExecutionOptions, planned, run_and_gather};
use crate::artefacts::{Destination, put_file};
use crate::sweep::{PlannedSweep, Ran};

/// The options of both.
#[derive(Args, Debug)]
pub(in crate::cli) struct PageCommand {
    /// Overrides of scenario keys for all runs, and settings of programs
    #[arg(value_name = "KEY=VALUE")]
    overrides: Vec<String>,

    #[command(flatten)]
    trackers: TrackerArguments,

    /// Metric of tables and curves [default: humaneva_mm]
    #[arg(long, value_name = "METRIC")]
    objective: Option<String>,

    /// Directory of the results [default: ladders/NAME or suites/NAME, or NAME-2 and so on if it holds others]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Directory to search recursively for clips [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    mocap_dir: Option<PathBuf>,

    #[command(flatten)]
    access: FileAccess,

    #[command(flatten)]
    options: ExecutionOptions,
}

impl PageCommand {
    /// Plans `own` with these options, by default below `folder`, and runs all cells.
    pub(in crate::cli) fn run(
        &self,
        own: Definition,
        folder: &str,
        volume: Volume,
    ) -> Result<(PlannedSweep, Ran), CommandError> {
        let definition = Definition {
            assignments: self.overrides.clone(),
            trackers: self.trackers.clone(),
            objective: self.objective.clone(),
            mocap_dir: self.mocap_dir.clone(),
            access: self.access,
            ..own
        };
        let root = planned(&definition, Path::new(folder), self.out.as_deref(), &self.options, volume)?;
        run_and_gather(&root, &self.options, self.access, volume)
    }

    /// Writes the page and prints `results`, as JSON or as `words`. Exit code 1 if they are incomplete.
    pub(in crate::cli) fn finish(
        &self,
        (path, page): (&Path, &str),
        results: &impl Serialize,
        words: &str,
        incomplete: usize,
        volume: Volume,
    ) -> Result<ExitCode, CommandError> {
        put_file(Destination { path, force: false }, page.as_bytes())?;
        volume.written(path);
        if self.options.json {
            output::print_json(results)?;
        } else {
            output::print(&format!("{words}\n\n  page: {}", path.display()))?;
        }
        Ok(if incomplete == 0 { ExitCode::SUCCESS } else { ExitCode::from(1) })
    }
}
