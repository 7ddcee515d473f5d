//! Runs one cell: tracks its set with its setting and seed, and measures. Every distinct set is rendered once, and
//! every distinct motion model is learned once.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use super::identity::DIGITS;
use super::plan::PlannedSweep;
use super::plan_file::SweepCell;
use super::results::{CellRecord, Environment, Status, SweepResults};
use crate::artefacts::{Artefact, ArtefactError, ArtefactKind, Destination, REPORTS};
use crate::common::{ExperimentError, OnlyInterruption, Progress, stays_unreadable};
use crate::measure::results::verdict_on;
use crate::measure::{Measures, Tracked};
use crate::prepare::scenario_copy::made_by_run;
use crate::rendering::{RenderOptions, render};
use crate::runs::run::MethodRun;
use crate::scenario::{Scenario, ScenarioFile, TrackerSettings};
use crate::tracking::program::ProgramRun;
use crate::tracking::track::{prepare, track_running};
use crate::train::Models;
use skiagraph_core::input::hex_sha256;
use skiagraph_report::is_lost;
use skiagraph_set::{BenchmarkSet, Estimates, is_set};
use skiagraph_truth::mocap::MocapError;

pub(super) const SETS: &str = "sets";
const MODELS: &str = "models";
/// Time between checks whether another process has rendered a set.
pub(super) const POLL_INTERVAL: Duration = Duration::from_millis(200);

#[derive(Clone, Copy, Debug, Default)]
pub struct CellOptions {
    /// Keep a complete run with its report, even if the plan does not request reports.
    pub report: bool,
}

#[derive(Clone, Debug)]
pub struct CellDone {
    pub record: CellRecord,
    /// Whether the result already existed.
    pub cached: bool,
}

/// Runs one cell in the calling thread's pool, unless it has a result. A tracker that loses the body, and a setting
/// that cannot be run, are results.
///
/// # Errors
/// [`ExperimentError`] for transient errors: files that cannot be read or written, another process, an interruption.
pub fn run_cell(
    sweep: &PlannedSweep,
    cell: &SweepCell,
    options: CellOptions,
    progress: &dyn Progress,
) -> Result<CellDone, ExperimentError> {
    run_shared(sweep, cell, options, &Shared::default(), &mut None, &OnlyInterruption(progress))
}

/// Like [`run_cell`], with sets and models shared with other cells; `held` keeps the last set in memory.
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
    let has_report = !wants_report || sweep.root.join(REPORTS).join(cell.report_folder()).exists();
    if let Some(record) = results.get(&cell.cell)
        && (has_report || record.status == Status::Failed)
    {
        return Ok(CellDone { record, cached: true });
    }
    let work = CellWork { sweep, cell, report: wants_report, progress };
    let record = match work.run(shared, held) {
        Ok(record) => record,
        Err(error) if is_transient(&error) => return Err(error),
        Err(error) => {
            let error = Some(error.to_string().replace(&format!("{}/", sweep.root.display()), ""));
            CellRecord { error, ..CellRecord::new(cell, Status::Failed) }
        }
    };
    Ok(CellDone { record: results.put(record)?, cached: false })
}

/// Whether an error is due to the machine, not to the setting, so that another attempt may succeed.
pub(super) fn is_transient(error: &ExperimentError) -> bool {
    match error {
        ExperimentError::With { source, .. } | ExperimentError::Unfinished { source, .. } => is_transient(source),
        ExperimentError::Mocap(MocapError::Unreadable { source, .. }) => !stays_unreadable(source),
        ExperimentError::ModelFile(source) => {
            matches!(&**source, ExperimentError::Unreadable { source, .. } if !stays_unreadable(source))
        }
        ExperimentError::Artefact(error) => {
            use ArtefactError::{Busy, InTheWay, Occupied, Output};
            matches!(error, Busy { .. } | InTheWay { .. } | Occupied { .. } | Output { .. })
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
        let mut models = set.models(&file.scenario.tracker(), self.progress)?;
        // shared sets and models are not part of a cell's cost
        let begin = thread_processor_s();
        let mut record = self.measure(&file.scenario, &set, &mut models)?;
        record.env.processor_s = thread_processor_s() - begin;
        if self.report {
            self.write_report(&file.scenario, &set, &mut models)?;
        }
        Ok(record)
    }

    fn measure(
        &self,
        scenario: &Scenario,
        shared: &SharedSet,
        models: &mut Models,
    ) -> Result<CellRecord, ExperimentError> {
        let set = &shared.set;
        let (clock, processor) = (Instant::now(), thread_processor_s());
        let truth = set.truth.refitted.as_ref();
        let (tracker, seeds, hidden) = (scenario.tracker(), [self.cell.seed], [self.sweep.root.as_path()]);
        let program = ProgramRun::hiding(&hidden);
        let tracked = track_running(&set.blind, &tracker, &seeds, truth, models, program, self.progress)?;
        let env = Environment {
            track_s: clock.elapsed().as_secs_f64(),
            track_processor_s: thread_processor_s() - processor,
            processor_s: 0.0,
            host: host(),
        };
        let measures = Measures::new(set, &tracked, self.progress)?;
        let verdict = verdict_on(set, &tracked, &measures);
        let metric = |name: &str| measures.summary.metrics.get(name).map(|metric| metric.mean);
        if metric("coverage").is_some_and(|coverage| coverage == 0.0) {
            let error = Some("the tracker estimated no frame".to_owned());
            return Ok(CellRecord { error, ..CellRecord::new(self.cell, Status::Failed) });
        }
        let status = if is_lost(&measures.summary) { Status::Diverged } else { Status::Ok };
        let means = measures.summary.metrics.iter().map(|(name, metric)| (name.clone(), metric.mean));
        Ok(CellRecord {
            set_hash: Some(set.blind.set_hash.clone()),
            grade: verdict.grade.map(|grade| grade.name().to_owned()),
            frames: set.blind.frame_count,
            cameras: set.blind.rig.cameras.len(),
            likelihood_evaluations: tracked.record.as_ref().map_or(0, |r| r.timing.likelihood_evaluations),
            metrics: means.filter(|(_, mean)| mean.is_finite()).collect(),
            frozen: measures.frozen.metrics.get(&self.sweep.plan.objective).map(|metric| metric.mean),
            estimates: tracked.program.is_some().then(|| self.hash_of(&tracked, set)).transpose()?,
            env,
            ..CellRecord::new(self.cell, status)
        })
    }

    /// First digits of the SHA-256 of the estimates, whatever their seed is.
    fn hash_of(&self, tracked: &Tracked, set: &BenchmarkSet) -> Result<String, ExperimentError> {
        let estimates = Estimates { seeds: vec![0], ..tracked.estimates.clone() };
        let poses = estimates.to_bytes("poses.npz", &set.blind.start.body, None)?;
        let mut digest = hex_sha256(&poses);
        digest.truncate(DIGITS);
        Ok(digest)
    }

    /// Writes the folder of a run, as `skiagraph run` does.
    fn write_report(
        &self,
        scenario: &Scenario,
        shared: &SharedSet,
        models: &mut Models,
    ) -> Result<(), ExperimentError> {
        let path = self.sweep.root.join(REPORTS).join(self.cell.report_folder());
        let directory = Artefact::begin(Destination { path: &path, force: false }, ArtefactKind::Run)?;
        let directory = directory.made_by(made_by_run(scenario)?);
        let seeds = [self.cell.seed];
        let attempt = MethodRun {
            directory: &directory,
            folder: "",
            scenario,
            set: &shared.set,
            seeds: &seeds,
            unfinished: None,
            hidden: &self.sweep.root,
        };
        attempt.run(models, self.progress)?;
        Ok(directory.finish()?)
    }
}

/// Processor time of the calling thread, s; independent of other load on the machine.
#[cfg(unix)]
pub(super) fn thread_processor_s() -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Wall-clock time since the first call, s: a substitute on systems without a clock of the thread's processor time.
#[cfg(not(unix))]
pub(super) fn thread_processor_s() -> f64 {
    static FIRST: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    FIRST.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// The name of this machine; empty if unknown.
fn host() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    name.trim().to_owned()
}

#[derive(Debug)]
pub(super) struct SharedSet {
    set: BenchmarkSet,
    models: Mutex<Models>,
}

/// Sets and models of a sweep, kept while a worker uses them.
#[derive(Debug, Default)]
pub(super) struct Shared {
    sets: Mutex<HashMap<String, Arc<Mutex<Weak<SharedSet>>>>>,
}

impl Shared {
    /// The set of a cell: from memory, from the disk, or rendered now by a single thread of a single process.
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
        let set = read_or_render(sweep, cell, file, progress)?;
        let models = Models::new(&file.folder, &set.truth.recordings).sharing(sweep.root.join(MODELS));
        let models = Mutex::new(models);
        let shared = Arc::new(SharedSet { set, models });
        *slot = Arc::downgrade(&shared);
        Ok(shared)
    }
}

impl SharedSet {
    /// The motion models that a scenario's tracker needs, learned now unless another cell has learned them. Other cells
    /// that need models of the same set wait meanwhile.
    fn models(&self, tracker: &TrackerSettings, progress: &dyn Progress) -> Result<Models, ExperimentError> {
        let mut models = lock(&self.models);
        if tracker.kind().learned.is_some() {
            prepare(&self.set.blind, tracker, self.set.truth.refitted.as_ref(), &mut models, progress)?;
        }
        Ok(models.clone())
    }
}

fn read_or_render(
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
        let to = Destination { path: &path, force: false };
        match render(file, sweep.plan.mocap_directory.as_deref(), to, &RenderOptions::default(), progress) {
            Ok((set, _)) => return Ok(set),
            // another process is rendering it, or has just finished
            Err(ExperimentError::Artefact(ArtefactError::Busy { .. }) | ExperimentError::SetThere { .. }) => {
                std::thread::sleep(POLL_INTERVAL);
            }
            // rendering can be resumed, and so can the sweep
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
