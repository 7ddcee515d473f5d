//! Ctrl-C and SIGTERM: the work stops at the next check; the process ends within a second in any case.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::artefacts::abandon;

/// Time for the work to stop by itself; it checks for an interruption before every frame and every file.
const GRACE_PERIOD: Duration = Duration::from_millis(600);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Installs the handler: at Ctrl-C or SIGTERM the work is requested to stop. If it does not stop in time, or at a
/// second signal, the process removes its unfinished files and exits.
pub(super) fn install() {
    #[cfg(unix)]
    {
        use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
        end_with_caller();
        // Fails only for signals that cannot be handled; then they end the process as usual.
        let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGHUP]) else { return };
        std::thread::spawn(move || signals.forever().for_each(|_| interrupt()));
    }
    #[cfg(not(unix))]
    // Fails only if this handler is already installed.
    ctrlc::set_handler(interrupt).ok();
}

/// Asks for SIGTERM when the process ends that `SKIAGRAPH_PARENT` names, if it started this one: a Python process that
/// is killed leaves no work behind.
#[cfg(unix)]
fn end_with_caller() {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Signal, getppid, set_parent_process_death_signal};
        let caller = std::env::var("SKIAGRAPH_PARENT").ok().and_then(|id| id.parse::<i32>().ok());
        if caller.is_some() && caller == getppid().map(|id| id.as_raw_nonzero().get()) {
            // without it the work goes on, as it does on other systems
            set_parent_process_death_signal(Some(Signal::TERM)).ok();
        }
    }
}

fn interrupt() {
    if INTERRUPTED.swap(true, Ordering::SeqCst) {
        end();
    }
    std::thread::spawn(|| {
        std::thread::sleep(GRACE_PERIOD);
        end();
    });
}

/// Turns reaching `ulimit -f` into a write error, as on a full disk, instead of killing the process.
pub(super) fn outlive_file_limit() {
    #[cfg(unix)]
    {
        let reached = std::sync::Arc::new(AtomicBool::new(false));
        // if this fails, the limit still kills the process
        signal_hook::flag::register(signal_hook::consts::SIGXFSZ, reached).ok();
    }
}

pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

fn end() -> ! {
    let message = abandon();
    writeln!(std::io::stderr(), "error: {message}").ok();
    std::process::exit(130)
}
