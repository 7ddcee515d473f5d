//! Runs a sweep on this machine, one cell per core.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::cell::{CellOptions, Shared, run_shared};
use super::plan::PlannedSweep;
use super::plan_file::SweepCell;
use super::results::{CellRecord, Status, SweepResults};
use crate::artefacts::LockedPlace;
use crate::common::{ExperimentError, Progress, Stage};

/// Outcome of running a sweep.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ran {
    /// Number of cells that were run.
    pub run: usize,
    /// Number of cells that already had results.
    pub cached: usize,
    /// Number of all cells that are graded lost.
    pub diverged: usize,
    /// Index and error message of every failed cell.
    pub failed: Vec<(usize, String)>,
}

/// Options for running a sweep.
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
///
/// # Errors
/// Those of [`super::run_cell`].
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
    let workers = Workers {
        sweep,
        cells: &missing,
        next: AtomicUsize::new(0),
        stop: AtomicBool::new(false),
        shared: Shared::default(),
        ran: Mutex::new(ran),
        error: Mutex::new(None),
        progress,
    };
    std::thread::scope(|scope| {
        for _ in 0..options.jobs.clamp(1, missing.len().max(1)) {
            scope.spawn(|| workers.work());
        }
    });
    if let Some(error) = workers.error.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    if progress.interrupted() {
        return Err(ExperimentError::Interrupted);
    }
    Ok(workers.ran.into_inner().unwrap_or_else(PoisonError::into_inner))
}

struct Workers<'a> {
    sweep: &'a PlannedSweep,
    cells: &'a [&'a SweepCell],
    next: AtomicUsize,
    stop: AtomicBool,
    shared: Shared,
    ran: Mutex<Ran>,
    error: Mutex<Option<ExperimentError>>,
    progress: &'a dyn Progress,
}

impl Workers<'_> {
    /// Runs cells on this thread until none is left.
    fn work(&self) {
        let pool = match rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build() {
            Ok(pool) => pool,
            Err(error) => {
                return self.fail(ExperimentError::Malformed { path: "threads".into(), detail: error.to_string() });
            }
        };
        pool.install(|| {
            let mut held = None;
            while !self.interrupted() {
                let Some(cell) = self.cells.get(self.next.fetch_add(1, Ordering::Relaxed)) else { return };
                match run_shared(self.sweep, cell, CellOptions::default(), &self.shared, &mut held, self) {
                    Ok(done) => self.add(cell, &done.record),
                    Err(error) => return self.fail(error),
                }
            }
        });
    }

    fn add(&self, cell: &SweepCell, record: &CellRecord) {
        let mut ran = self.ran.lock().unwrap_or_else(PoisonError::into_inner);
        ran.run += 1;
        ran.add(cell, record);
        if let Some(error) = record.error.as_ref().filter(|_| ran.failed.len() <= 3) {
            self.progress.note(&format!("cell {} cannot be run: {error}", cell.index));
        }
        self.progress.advance();
    }

    fn fail(&self, error: ExperimentError) {
        self.stop.store(true, Ordering::SeqCst);
        self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }
}

/// Forwards interruptions only: progress counts cells, not their frames.
impl Progress for Workers<'_> {
    fn begin(&self, _: Stage, _: usize) {}

    fn advance(&self) {}

    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.progress.interrupted()
    }
}
