//! What cells share: every distinct set is rendered once, every distinct motion model learned once.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use super::plan::PlannedSweep;
use super::plan_file::SweepCell;
use crate::benchmark_set::{BenchmarkSet, is_set};
use crate::experiment::Progress;
use crate::experiment::tracking::prepare;
use crate::experiment::{Destination, ExperimentError, Models, render};
use crate::scenario::ScenarioFile;

/// The folder of all sets.
const SETS: &str = "sets";
/// The folder of all motion models that cells learned.
const MODELS: &str = "models";
/// How often it is looked whether another process has rendered a set.
const PATIENCE: Duration = Duration::from_millis(200);

/// A set with the motion models that were learned for it.
#[derive(Debug)]
pub(super) struct SharedSet {
    pub(super) set: BenchmarkSet,
    models: Mutex<Models>,
}

/// Sets and models of a sweep, as long as somebody uses them.
#[derive(Debug, Default)]
pub(super) struct Shared {
    sets: Mutex<HashMap<String, Arc<Mutex<Weak<SharedSet>>>>>,
}

impl Shared {
    /// The set of a cell: from memory, from the disk, or rendered now, by one thread of one process.
    ///
    /// # Errors
    /// [`ExperimentError`] where it cannot be rendered or read.
    pub(super) fn set(
        &self,
        sweep: &PlannedSweep,
        cell: &SweepCell,
        file: &ScenarioFile,
        progress: &dyn Progress,
    ) -> Result<Arc<SharedSet>, ExperimentError> {
        let slot = lock(&self.sets).entry(cell.set.clone()).or_default().clone();
        let mut slot = lock(&slot);
        if let Some(known) = slot.upgrade() {
            return Ok(known);
        }
        let set = on_disk(sweep, cell, file, progress)?;
        let models = Models::new(file, &set.truth.recordings).sharing(sweep.root.join(MODELS));
        let models = Mutex::new(models);
        let shared = Arc::new(SharedSet { set, models });
        *slot = Arc::downgrade(&shared);
        Ok(shared)
    }
}

impl SharedSet {
    /// The motion models that a scenario's tracker needs, learned now if no other cell has had them learned. Others
    /// that need models of the same set wait meanwhile.
    ///
    /// # Errors
    /// [`ExperimentError`] where a model cannot be learned or read.
    pub(super) fn models(&self, file: &ScenarioFile, progress: &dyn Progress) -> Result<Models, ExperimentError> {
        let mut models = lock(&self.models);
        let tracker = file.scenario.tracker();
        if tracker.kind().learning().is_some() {
            prepare(&self.set.blind, &tracker, self.set.truth.refitted.as_ref(), &mut models, progress)?;
        }
        Ok(models.clone())
    }
}

fn on_disk(
    sweep: &PlannedSweep,
    cell: &SweepCell,
    file: &ScenarioFile,
    progress: &dyn Progress,
) -> Result<BenchmarkSet, ExperimentError> {
    let path: PathBuf = sweep.root.join(SETS).join(&cell.set);
    loop {
        if is_set(&path) {
            return Ok(BenchmarkSet::read(&path)?);
        }
        if progress.interrupted() {
            return Err(ExperimentError::Interrupted);
        }
        match render(file, sweep.mocap_directory(), Destination { path: &path, force: false }, progress) {
            Ok((set, _)) => return Ok(set),
            // another process renders it, or has just done so
            Err(ExperimentError::Busy { .. } | ExperimentError::SetThere { .. }) => std::thread::sleep(PATIENCE),
            // the set goes on where it stopped, and so does the sweep
            Err(ExperimentError::ProgressSaved { .. }) => return Err(ExperimentError::Interrupted),
            Err(error) => return Err(error),
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
