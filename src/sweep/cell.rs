//! One cell: track its set with its setting and seed, and measure. Every distinct set is rendered once, and every
//! distinct motion model learned once.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use super::plan::PlannedSweep;
use super::plan_file::SweepCell;
use super::results::{CellRecord, Environment, Status, SweepResults};
use crate::artefacts::{Artefact, ArtefactError, ArtefactKind, Destination};
use crate::benchmark_set::{BenchmarkSet, is_set};
use crate::common::{ExperimentError, Progress, Stage, stays_unreadable};
use crate::experiment::run::MethodRun;
use crate::experiment::tracking::prepare;
use crate::experiment::{render, track};
use crate::measure::Measures;
use crate::measure::results::verdict_on;
use crate::mocap::MocapError;
use crate::report::Grade;
use crate::scenario::ScenarioFile;
use crate::train::Models;

/// The folder of all reports.
pub(super) const REPORTS: &str = "reports";
/// The folder of all sets.
const SETS: &str = "sets";
/// The folder of all motion models that cells learned.
const MODELS: &str = "models";
/// How often it is looked whether another process has rendered a set.
const PATIENCE: Duration = Duration::from_millis(200);

/// How a cell is to be run.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellOptions {
    /// Run it even where there is a result.
    pub again: bool,
    /// Leave a whole run with its report beside the numbers, whatever the plan says.
    pub report: bool,
}

/// A cell that is done.
#[derive(Clone, Debug)]
pub struct CellDone {
    /// Its result.
    pub record: CellRecord,
    /// Whether there was a result already.
    pub cached: bool,
}

/// Runs one cell, on the calling thread's cores; does nothing where there is a result. A tracker that loses the body,
/// and a setting that cannot be run, are results.
///
/// # Errors
/// [`ExperimentError`] for what may be otherwise next time: files that cannot be read or written, another process, an
/// interruption.
pub fn run_cell(
    sweep: &PlannedSweep,
    cell: &SweepCell,
    options: CellOptions,
    progress: &dyn Progress,
) -> Result<CellDone, ExperimentError> {
    run_shared(sweep, cell, options, &Shared::default(), &mut None, &Quiet(progress))
}

/// As [`run_cell`], with sets and models that others use too; `held` keeps the last set in memory.
pub(super) fn run_shared(
    sweep: &PlannedSweep,
    cell: &SweepCell,
    options: CellOptions,
    shared: &Shared,
    held: &mut Option<Arc<SharedSet>>,
    progress: &dyn Progress,
) -> Result<CellDone, ExperimentError> {
    let results = SweepResults::new(sweep);
    let wants_report = options.report || sweep.plan.reports;
    let has_report = !wants_report || sweep.root.join(REPORTS).join(&cell.cell).exists();
    if let Some(record) = results.get(&cell.cell).filter(|_| !options.again)
        && (has_report || record.status == Status::Failed)
    {
        return Ok(CellDone { record, cached: true });
    }
    let work = CellWork { sweep, cell, report: wants_report, progress };
    let record = match work.run(shared, held) {
        Ok(record) => record,
        Err(error) if may_be_otherwise_next_time(&error) => return Err(error),
        Err(error) => {
            let error = Some(error.to_string().replace(&format!("{}/", sweep.root.display()), ""));
            CellRecord { error, ..CellRecord::new(cell, Status::Failed) }
        }
    };
    Ok(CellDone { record: results.put(record)?, cached: false })
}

/// Whether the machine is at fault, not the setting.
fn may_be_otherwise_next_time(error: &ExperimentError) -> bool {
    match error {
        ExperimentError::With { source, .. } => may_be_otherwise_next_time(source),
        ExperimentError::Mocap(MocapError::Unreadable { source, .. }) => !stays_unreadable(source),
        ExperimentError::ModelFile(source) => {
            matches!(&**source, ExperimentError::Unreadable { source, .. } if !stays_unreadable(source))
        }
        ExperimentError::Artefact(error) => {
            use ArtefactError::{Busy, Occupied, Output};
            matches!(error, Busy { .. } | Occupied { .. } | Output { .. })
        }
        ExperimentError::Unreadable { .. }
        | ExperimentError::Set(_)
        | ExperimentError::Malformed { .. }
        | ExperimentError::Interrupted => true,
        _ => false,
    }
}

struct CellWork<'a> {
    sweep: &'a PlannedSweep,
    cell: &'a SweepCell,
    report: bool,
    progress: &'a dyn Progress,
}

impl CellWork<'_> {
    fn run(&self, shared: &Shared, held: &mut Option<Arc<SharedSet>>) -> Result<CellRecord, ExperimentError> {
        let file = self.sweep.scenario(self.cell)?;
        let set = shared.set(self.sweep, self.cell, &file, self.progress)?;
        *held = Some(set.clone());
        let mut models = set.models(&file, self.progress)?;
        // what others use too is nobody's cost
        let begin = of_this_thread();
        let mut record = self.measured(&file, &set, &mut models)?;
        record.env.processor_s = of_this_thread() - begin;
        if self.report {
            self.leave_report(&file, &set, &mut models)?;
        }
        Ok(record)
    }

    fn measured(
        &self,
        file: &ScenarioFile,
        shared: &SharedSet,
        models: &mut Models,
    ) -> Result<CellRecord, ExperimentError> {
        let set = &shared.set;
        let (clock, processor) = (Instant::now(), of_this_thread());
        let truth = set.truth.refitted.as_ref();
        let tracked = track(&set.blind, &file.scenario.tracker(), &[self.cell.seed], truth, models, self.progress)?;
        let env = Environment {
            track_s: clock.elapsed().as_secs_f64(),
            track_processor_s: of_this_thread() - processor,
            processor_s: 0.0,
            host: host(),
        };
        let measures = Measures::new(set, &tracked, self.progress)?;
        let verdict = verdict_on(set, &tracked, &measures);
        let status = if verdict.grade == Grade::Lost { Status::Diverged } else { Status::Ok };
        let means = measures.summary.metrics.iter().map(|(name, metric)| (name.clone(), metric.mean));
        Ok(CellRecord {
            set_hash: Some(set.blind.set_hash.clone()),
            grade: Some(verdict.grade.title().to_lowercase()),
            frames: set.blind.frame_count,
            cameras: set.blind.rig.cameras.len(),
            likelihood_evaluations: tracked.record.as_ref().map_or(0, |r| r.timing.likelihood_evaluations),
            metrics: means.filter(|(_, mean)| mean.is_finite()).collect(),
            frozen: measures.frozen.metrics.get(&self.sweep.plan.objective).map(|metric| metric.mean),
            env,
            ..CellRecord::new(self.cell, status)
        })
    }

    /// A run's folder, as `skiagraph run` would leave it.
    fn leave_report(
        &self,
        file: &ScenarioFile,
        shared: &SharedSet,
        models: &mut Models,
    ) -> Result<(), ExperimentError> {
        let path = self.sweep.root.join(REPORTS).join(&self.cell.cell);
        let directory = Artefact::begin(Destination { path: &path, force: false }, ArtefactKind::Run)?;
        let seeds = [self.cell.seed];
        let attempt =
            MethodRun { directory: &directory, folder: "", scenario: &file.scenario, set: &shared.set, seeds: &seeds };
        attempt.run(models, self.progress)?;
        Ok(directory.finish()?)
    }
}

/// Seconds that the calling thread has kept a processor busy, whatever else the machine does.
#[cfg(unix)]
pub(super) fn of_this_thread() -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Seconds since the first call: elsewhere the clock has to do.
#[cfg(not(unix))]
pub(super) fn of_this_thread() -> f64 {
    static FIRST: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    FIRST.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// The name of this machine; empty where the system does not tell it.
fn host() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    name.trim().to_owned()
}

/// A set with the motion models that were learned for it.
#[derive(Debug)]
pub(super) struct SharedSet {
    set: BenchmarkSet,
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
    fn set(
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
    fn models(&self, file: &ScenarioFile, progress: &dyn Progress) -> Result<Models, ExperimentError> {
        let mut models = lock(&self.models);
        let tracker = file.scenario.tracker();
        if tracker.kind().learned.is_some() {
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
        match render(file, sweep.plan.mocap_directory.as_deref(), Destination { path: &path, force: false }, progress) {
            Ok((set, _)) => return Ok(set),
            // another process renders it, or has just done so
            Err(ExperimentError::Artefact(ArtefactError::Busy { .. }) | ExperimentError::SetThere { .. }) => {
                std::thread::sleep(PATIENCE);
            }
            // the set goes on where it stopped, and so does the sweep
            Err(ExperimentError::Artefact(ArtefactError::ProgressSaved { .. })) => {
                return Err(ExperimentError::Interrupted);
            }
            Err(error) => return Err(error),
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Hears of interruptions alone, as the cells of [`super::run_sweep`].
struct Quiet<'a>(&'a dyn Progress);

impl Progress for Quiet<'_> {
    fn begin(&self, _: Stage, _: usize) {}

    fn advance(&self) {}

    fn interrupted(&self) -> bool {
        self.0.interrupted()
    }
}
