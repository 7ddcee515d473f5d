//! Shares out work among threads, one core each.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::common::{ExperimentError, Progress, Stage};

/// Calls `work` for 0 to `count`, on `jobs` threads of one core each, and advances `progress` after each; every thread
/// has its own value of `begin`. The progress that `work` gets only tells it to stop: this one counts whole pieces.
///
/// # Errors
/// The first error of `work`, after which no other piece begins; [`ExperimentError::Interrupted`].
pub(super) fn one_per_core<S>(
    jobs: usize,
    count: usize,
    progress: &dyn Progress,
    begin: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, usize, &dyn Progress) -> Result<(), ExperimentError> + Sync,
) -> Result<(), ExperimentError> {
    let stop = Stop { stopped: AtomicBool::new(false), progress };
    let (next, error) = (AtomicUsize::new(0), Mutex::new(None));
    let fail = |found: ExperimentError| {
        stop.stopped.store(true, Ordering::SeqCst);
        error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(found);
    };
    let thread = || {
        let pool = match rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build() {
            Ok(pool) => pool,
            Err(e) => return fail(ExperimentError::Malformed { path: "threads".into(), detail: e.to_string() }),
        };
        pool.install(|| {
            let mut own = begin();
            while !stop.interrupted() {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= count {
                    return;
                }
                match work(&mut own, index, &stop) {
                    Ok(()) => progress.advance(),
                    Err(error) => return fail(error),
                }
            }
        });
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, count.max(1)) {
            scope.spawn(thread);
        }
    });
    match error.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(error) => Err(error),
        None if progress.interrupted() => Err(ExperimentError::Interrupted),
        None => Ok(()),
    }
}

/// Forwards interruptions, and the end of the work after an error.
struct Stop<'a> {
    stopped: AtomicBool,
    progress: &'a dyn Progress,
}

impl Progress for Stop<'_> {
    fn begin(&self, _: Stage, _: usize) {}

    fn advance(&self) {}

    fn interrupted(&self) -> bool {
        self.stopped.load(Ordering::Relaxed) || self.progress.interrupted()
    }
}
