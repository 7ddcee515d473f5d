//! A sweep on this machine: one cell a core.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use serde_json::{Map, Value};

use super::cell::{CellOptions, run_shared};
use super::plan::PlannedSweep;
use super::plan_file::SweepCell;
use super::record::{CellRecord, Status, SweepResults};
use super::shared::Shared;
use crate::artefacts::LockedPlace;
use crate::evaluation::find_metric;
use crate::experiment::ExperimentError;
use crate::experiment::progress::{Progress, Stage};

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
    /// Mean of the objective over the seeds that are done.
    pub mean: f64,
    /// How many these are.
    pub seeds: usize,
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
/// [`crate::artefacts::ArtefactError::Busy`] while another process runs the sweep; otherwise as [`super::run_cell`].
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
    let mut course = Course::new(sweep, cells, sweep.definition()?.sweep.average_over);
    let mut missing: Vec<&SweepCell> = Vec::new();
    let mut all = cells.iter();
    results.for_each(cells, |cell, record| {
        let here = all.next();
        match record {
            Some(record) if options.retry_failed && record.status == Status::Failed => {
                results.remove(&cell.cell);
                missing.extend(here);
            }
            Some(record) => course.add(cell, &record, true),
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
        course.add(cell, record, false);
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
    sweep: &'a PlannedSweep,
    ran: Ran,
    cells: usize,
    begin: Instant,
    /// Weight of cells that were run, and of those that are left.
    run: f64,
    left: f64,
    /// Which settings are one but for what is averaged over: by setting its group, and by group its number of cells.
    groups: HashMap<usize, usize>,
    sizes: HashMap<usize, usize>,
    /// Axes that are averaged over.
    over: Vec<String>,
    /// By group: sum of the objective and number of cells.
    sums: HashMap<usize, (f64, usize)>,
    best: Option<(f64, usize, String)>,
}

impl<'a> Course<'a> {
    fn new(sweep: &'a PlannedSweep, cells: &[SweepCell], over: Vec<String>) -> Self {
        let (mut groups, mut sizes, mut named) = (HashMap::new(), HashMap::new(), HashMap::new());
        for cell in cells {
            let group = *groups.entry(cell.setting).or_insert_with(|| match over.is_empty() {
                true => cell.setting,
                false => *named.entry(axes_in_words(&without(&cell.axes, &over))).or_insert(cell.setting),
            });
            *sizes.entry(group).or_insert(0) += 1;
        }
        Self {
            groups,
            sizes,
            over,
            sweep,
            ran: Ran::default(),
            cells: cells.len(),
            begin: Instant::now(),
            run: 0.0,
            left: 0.0,
            sums: HashMap::new(),
            best: None,
        }
    }

    fn add(&mut self, cell: &SweepCell, record: &CellRecord, cached: bool) {
        match cached {
            true => self.ran.cached += 1,
            false => {
                self.ran.run += 1;
                self.run += cell.weight as f64;
                self.left -= cell.weight as f64;
            }
        }
        match record.status {
            Status::Ok => {}
            Status::Diverged => self.ran.diverged += 1,
            Status::Failed => self.ran.failed.push((cell.index, record.error.clone().unwrap_or_default())),
        }
        if let Some(value) = record.metrics.get(&self.sweep.plan.objective) {
            let group = self.groups.get(&cell.setting).copied().unwrap_or(cell.setting);
            let (sum, count) = self.sums.entry(group).or_default();
            *sum += value;
            *count += 1;
            self.weigh(cell, group);
        }
    }

    /// A setting counts once all its cells are done.
    fn weigh(&mut self, cell: &SweepCell, group: usize) {
        let Some((sum, count)) = self.sums.get(&group).copied() else { return };
        if self.sizes.get(&group).is_some_and(|size| count < *size) {
            return;
        }
        let (mean, seeds) = (sum / count as f64, self.sweep.plan.seeds.len());
        let metric = find_metric(&self.sweep.plan.objective);
        let is_worse = |than: f64| metric.is_some_and(|metric| metric.is_worse(mean, than)) || mean == than;
        if self.best.as_ref().is_none_or(|(best, ..)| !is_worse(*best)) {
            self.best = Some((mean, seeds, axes_in_words(&without(&cell.axes, &self.over))));
        }
    }

    fn standing(&self) -> RunProgress {
        let done = self.ran.run + self.ran.cached;
        let a_weight = self.begin.elapsed().as_secs_f64() / self.run.max(1.0);
        let best = self.best.clone().map(|(mean, seeds, setting)| Best { setting, mean, seeds });
        RunProgress { done, cells: self.cells, left_s: self.left.max(0.0) * a_weight, best }
    }
}

/// Axes and values but for some.
pub(super) fn without(axes: &Map<String, Value>, over: &[String]) -> Map<String, Value> {
    axes.iter().filter(|(key, _)| !over.contains(key)).map(|(key, value)| (key.clone(), value.clone())).collect()
}

/// Axes and values of a cell: `particles=50 rig.ring.count=2`.
pub fn in_words(cell: &SweepCell) -> String {
    axes_in_words(&cell.axes)
}

/// The same of axes and values alone.
pub(super) fn axes_in_words(axes: &Map<String, Value>) -> String {
    let plain = |value: &Value| value.as_str().map_or_else(|| crate::scenario::as_toml(value), str::to_owned);
    let words: Vec<String> = axes.iter().map(|(key, value)| format!("{key}={}", plain(value))).collect();
    if words.is_empty() { "the scenario as it is".to_owned() } else { crate::input::plain(words.join(" ")) }
}
