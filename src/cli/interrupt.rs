//! Ctrl-C and requests to end: the work stops where it can, and the process ends within a second whatever it does.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::experiment::abandon;

/// How long the work may take to stop by itself: it asks before every frame and every file.
const PATIENCE: Duration = Duration::from_millis(600);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C (or SIGTERM) asks the work to stop; if it has not stopped soon, or at a second Ctrl-C, the process removes
/// what it has begun to write and ends.
pub(super) fn install() {
    // Only fails if a handler is there already, which then does the same.
    ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::SeqCst) {
            end();
        }
        std::thread::spawn(|| {
            std::thread::sleep(PATIENCE);
            end();
        });
    })
    .ok();
}

/// Whether the user wants the work to stop.
pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

fn end() -> ! {
    let said = abandon();
    writeln!(std::io::stderr(), "error: {said}").ok();
    std::process::exit(130)
}
