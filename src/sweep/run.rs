//! Runs a sweep on this machine, one cell per core.

use std::sync::{Mutex, PoisonError};

use super::cell::{CellOptions, Shared, run_shared};
use super::plan::PlannedSweep;
use super::plan_file::SweepCell;
use super::results::{CellRecord, Status, SweepResults};
use super::workers::one_per_core;
use crate::artefacts::LockedPlace;
use crate::common::{ExperimentError, Progress, Stage};

/// Outcome of running a sweep.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ran {
    pub run: usize,
    /// Number of cells that already had results.
    pub cached: usize,
    /// Number of all cells that are graded lost.
    pub diverged: usize,
    /// Index and error message of every failed cell.
    pub failed: Vec<(usize, String)>,
}

#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// Parallel jobs, each on one thread.
    pub jobs: usize,
    /// Whether failed cells are retried.
    pub retry_failed: bool,
}

impl Ran {
    fn add(&mut self, cell: &SweepCell, record: &CellRecord) {
        match record.status {
            Status::Ok => {}
            Status::Diverged => self.diverged += 1,
            Status::Failed => self.failed.push((cell.index, record.error.clone().unwrap_or_default())),
        }
    }
}

/// Runs all cells of a sweep that have no result. Results of finished cells are kept in any case.
///
/// # Errors
/// [`crate::artefacts::ArtefactError::Busy`] while another process runs the sweep; otherwise as [`super::run_cell`].
pub fn run_sweep(sweep: &PlannedSweep, options: RunOptions, progress: &dyn Progress) -> Result<Ran, ExperimentError> {
    // held while the sweep runs: a second process would run the same cells
    let _place = LockedPlace::take(&sweep.root.join("run"))?;
    let cells = sweep.cells()?;
    run_some(sweep, &cells, options, progress)
}

/// Like [`run_sweep`], for some cells; other processes may run other cells at the same time.
pub fn run_some(
    sweep: &PlannedSweep,
    cells: &[SweepCell],
    options: RunOptions,
    progress: &dyn Progress,
) -> Result<Ran, ExperimentError> {
    let results = SweepResults::new(sweep);
    results.clear_leftovers();
    let mut ran = Ran::default();
    let mut missing: Vec<&SweepCell> = Vec::new();
    let mut all = cells.iter();
    let found = |_: &SweepCell, record| record;
    results.for_each(cells, found, |cell, record: Option<CellRecord>| {
        let here = all.next();
        match record {
            Some(record) if options.retry_failed && record.status == Status::Failed => {
                results.remove(&cell.cell);
                missing.extend(here);
            }
            Some(record) => {
                ran.cached += 1;
                ran.add(cell, &record);
            }
            None => missing.extend(here),
        }
        Ok(())
    })?;
    progress.begin(Stage::Sweep, missing.len());
    let (shared, ran) = (Shared::default(), Mutex::new(ran));
    let run = |held: &mut _, index: usize, stop: &dyn Progress| {
        let cell: &SweepCell = missing[index];
        let record = run_shared(sweep, cell, CellOptions::default(), &shared, held, stop)?.record;
        let mut ran = ran.lock().unwrap_or_else(PoisonError::into_inner);
        ran.run += 1;
        ran.add(cell, &record);
        if let Some(error) = record.error.as_ref().filter(|_| ran.failed.len() <= 3) {
            progress.note(&format!("cell {} cannot be run: {error}", cell.index));
        }
        Ok(())
    };
    one_per_core(options.jobs, missing.len(), progress, || None, run)?;
    Ok(ran.into_inner().unwrap_or_else(PoisonError::into_inner))
}
