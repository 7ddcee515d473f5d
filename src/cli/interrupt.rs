//! Ctrl-C and SIGTERM: the work stops at the next check; the process ends within a second in any case.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::artefacts::abandon;

/// Time that the work has to stop by itself; it checks before every frame and every file.
const PATIENCE: Duration = Duration::from_millis(600);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Installs the handler: Ctrl-C (or SIGTERM) asks the work to stop. If it does not stop in time, or at a second Ctrl-C,
/// the process removes its unfinished files and exits.
pub(super) fn install() {
    // Fails only if a handler is installed already; that one does the same.
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

/// A file that reaches `ulimit -f` is an error of writing, as on a full disk, and does not kill the process.
pub(super) fn outlive_file_limit() {
    #[cfg(unix)]
    {
        let reached = std::sync::Arc::new(AtomicBool::new(false));
        // where it cannot be installed, the limit kills as before
        signal_hook::flag::register(signal_hook::consts::SIGXFSZ, reached).ok();
    }
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
