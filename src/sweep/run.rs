//! A sweep on this machine: one cell a core.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::cell::{CellOptions, Shared, run_shared};
use super::plan::PlannedSweep;
use super::plan_file::{SweepCell, describe_axes, without};
use super::results::{CellRecord, Status, SweepResults};
use super::summary::badness;
use crate::evaluation::find_metric;
use crate::experiment::ExperimentError;
use crate::experiment::place::LockedPlace;
use crate::experiment::{Progress, Stage};

/// Observes a sweep, from any thread.
pub trait SweepWatch: Sync {
    /// Work begins: number of cells, and how many of them have results.
    fn begin(&self, cells: usize, done: usize);

    /// One more cell is done.
    fn advance(&self, standing: &RunProgress);

    /// Something that a user should know now.
    fn note(&self, note: &str);

    /// Whether the work should stop.
    fn interrupted(&self) -> bool;
}

/// How a sweep stands.
#[derive(Clone, Debug, PartialEq)]
pub struct RunProgress {
    /// Cells that have results.
    pub done: usize,
    /// All cells.
    pub cells: usize,
    /// Seconds until the rest is done, by what was done so far.
    pub left_s: f64,
    /// The best setting so far.
    pub best: Option<Best>,
}

/// The best setting so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Best {
    /// Axes and values.
    pub setting: String,
    /// Mean of the objective over its cells.
    pub mean: f64,
}

/// What came of running a sweep.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ran {
    /// Cells that were run now.
    pub run: usize,
    /// Cells that had results.
    pub cached: usize,
    /// Cells of all whose tracker lost the body.
    pub diverged: usize,
    /// Index and message of all that failed.
    pub failed: Vec<(usize, String)>,
}

/// How a sweep is to be run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// Cells at a time, each on one thread.
    pub jobs: usize,
    /// Whether cells that failed are tried again.
    pub retry_failed: bool,
}

/// Runs all cells of a sweep that have no result. Results of cells that are done stay whatever happens.
///
/// # Errors
/// [`ExperimentError::Busy`] while another process runs the sweep; otherwise as [`super::run_cell`].
pub fn run_sweep(sweep: &PlannedSweep, options: RunOptions, progress: &dyn SweepWatch) -> Result<Ran, ExperimentError> {
    // held while it runs: a second process would do the same cells
    let _place = LockedPlace::take(&sweep.root.join("run"))?;
    let cells = sweep.cells()?;
    run_some(sweep, &cells, options, progress)
}

/// As [`run_sweep`], some cells, beside other processes that run others.
///
/// # Errors
/// As [`super::run_cell`].
pub fn run_some(
    sweep: &PlannedSweep,
    cells: &[SweepCell],
    options: RunOptions,
    progress: &dyn SweepWatch,
) -> Result<Ran, ExperimentError> {
    let results = SweepResults::new(sweep);
    results.clear_leftovers();
    let mut course = Course::new(sweep, cells, &sweep.definition()?.sweep.average_over);
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
                course.ran.cached += 1;
                course.add(cell, &record);
            }
            None => missing.extend(here),
        }
        Ok(())
    })?;
    course.left = missing.iter().map(|cell| cell.weight as f64).sum();
    progress.begin(cells.len(), cells.len() - missing.len());
    let workers = Workers {
        sweep,
        cells: &missing,
        next: AtomicUsize::new(0),
        stop: AtomicBool::new(false),
        shared: Shared::default(),
        course: Mutex::new(course),
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
    Ok(workers.course.into_inner().unwrap_or_else(PoisonError::into_inner).ran)
}

struct Workers<'a> {
    sweep: &'a PlannedSweep,
    cells: &'a [&'a SweepCell],
    next: AtomicUsize,
    stop: AtomicBool,
    shared: Shared,
    course: Mutex<Course<'a>>,
    error: Mutex<Option<ExperimentError>>,
    progress: &'a dyn SweepWatch,
}

impl Workers<'_> {
    /// Runs cells until none is left, all work of each on this thread.
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
                    Ok(done) => self.tell(cell, &done.record),
                    Err(error) => return self.fail(error),
                }
            }
        });
    }

    fn tell(&self, cell: &SweepCell, record: &CellRecord) {
        let mut course = self.course.lock().unwrap_or_else(PoisonError::into_inner);
        course.ran.run += 1;
        course.run += cell.weight as f64;
        course.left -= cell.weight as f64;
        course.add(cell, record);
        if let Some(error) = record.error.as_ref().filter(|_| course.ran.failed.len() <= 3) {
            self.progress.note(&format!("cell {} cannot be run: {error}", cell.index));
        }
        self.progress.advance(&course.standing());
    }

    fn fail(&self, error: ExperimentError) {
        self.stop.store(true, Ordering::SeqCst);
        self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }
}

impl Progress for Workers<'_> {
    fn begin(&self, _: Stage, _: usize) {}

    fn advance(&self) {}

    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.progress.interrupted()
    }
}

/// What is known so far.
struct Course<'a> {
    objective: &'a str,
    ran: Ran,
    cells: usize,
    begin: Instant,
    /// Weight of cells that were run, and of those that are left.
    run: f64,
    left: f64,
    /// Settings, those that differ in what is averaged over alone as one.
    groups: Vec<SettingCourse>,
    /// By the number of a setting: its group.
    group_of: HashMap<usize, usize>,
    best: Option<Best>,
}

/// What is known of a setting so far.
struct SettingCourse {
    words: String,
    cells: usize,
    measured: usize,
    sum: f64,
}

impl<'a> Course<'a> {
    fn new(sweep: &'a PlannedSweep, cells: &[SweepCell], over: &[String]) -> Self {
        let (mut groups, mut group_of, mut named) = (Vec::new(), HashMap::new(), HashMap::new());
        for cell in cells {
            let group = *group_of.entry(cell.setting).or_insert_with(|| {
                let words = describe_axes(&without(&cell.axes, over));
                *named.entry(words.clone()).or_insert_with(|| {
                    groups.push(SettingCourse { words, cells: 0, measured: 0, sum: 0.0 });
                    groups.len() - 1
                })
            });
            groups[group].cells += 1;
        }
        Self {
            objective: &sweep.plan.objective,
            ran: Ran::default(),
            cells: cells.len(),
            begin: Instant::now(),
            run: 0.0,
            left: 0.0,
            groups,
            group_of,
            best: None,
        }
    }

    fn add(&mut self, cell: &SweepCell, record: &CellRecord) {
        match record.status {
            Status::Ok => {}
            Status::Diverged => self.ran.diverged += 1,
            Status::Failed => self.ran.failed.push((cell.index, record.error.clone().unwrap_or_default())),
        }
        let group = self.group_of.get(&cell.setting).and_then(|group| self.groups.get_mut(*group));
        let (Some(value), Some(group)) = (record.metrics.get(self.objective), group) else { return };
        group.sum += value;
        group.measured += 1;
        // a setting counts once all its cells are done
        if group.measured == group.cells {
            let mean = group.sum / group.cells as f64;
            let rank = |mean| find_metric(self.objective).map_or(mean, |metric| badness(mean, metric));
            if self.best.as_ref().is_none_or(|best| rank(mean) < rank(best.mean)) {
                self.best = Some(Best { setting: group.words.clone(), mean });
            }
        }
    }

    fn standing(&self) -> RunProgress {
        let done = self.ran.run + self.ran.cached;
        let a_weight = self.begin.elapsed().as_secs_f64() / self.run.max(1.0);
        RunProgress { done, cells: self.cells, left_s: self.left.max(0.0) * a_weight, best: self.best.clone() }
    }
}
