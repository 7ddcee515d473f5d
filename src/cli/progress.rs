//! A progress bar on a terminal, silence elsewhere, and Ctrl-C.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::notes;
use crate::experiment::{Stage, Watch};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Shows progress on standard error if that is a terminal and the user did not ask for quiet.
pub(super) struct Progress {
    bar: Mutex<ProgressBar>,
    visible: bool,
    quiet: bool,
}

impl Progress {
    /// From now on Ctrl-C asks the work to stop at the next frame; a second one ends the process at once.
    pub(super) fn new(quiet: bool) -> Self {
        // Only fails if a handler is there already, which then does the same.
        ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
            notes::tell(&["stopping after this frame; again to stop at once".to_owned()]);
        })
        .ok();
        Self { bar: Mutex::new(ProgressBar::hidden()), visible: !quiet && std::io::stderr().is_terminal(), quiet }
    }

    fn bar(&self) -> MutexGuard<'_, ProgressBar> {
        self.bar.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watch for Progress {
    fn begin(&self, stage: Stage, frames: usize) {
        let mut bar = self.bar();
        bar.finish_and_clear();
        if self.visible {
            let template = "{prefix:>9} {wide_bar} {pos}/{len} frames, {eta} left {msg}";
            let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
            *bar = ProgressBar::with_draw_target(Some(frames as u64), ProgressDrawTarget::stderr())
                .with_style(style)
                .with_prefix(match stage {
                    Stage::Render => "rendering",
                    Stage::Track => "tracking",
                    Stage::Evaluate => "measuring",
                    Stage::Learn => "learning",
                });
        }
    }

    fn advance(&self) {
        self.bar().inc(1);
    }

    fn tell(&self, state: &str) {
        self.bar().set_message(state.to_owned());
    }

    fn say(&self, note: &str) {
        if !self.quiet {
            self.bar().suspend(|| notes::tell(&[note.to_owned()]));
        }
    }

    fn interrupted(&self) -> bool {
        INTERRUPTED.load(Ordering::SeqCst)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar().finish_and_clear();
    }
}
