//! Progress of a sweep: a bar with the time left and the best setting so far.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::super::interrupt;
use super::super::volume::{Volume, note_on_stderr};
use crate::experiment::{Progress, Stage};
use crate::sweep::{RunProgress, SweepWatch};

/// Shows how a sweep stands on standard error if that is a terminal, unless `--quiet` is given; with `--verbose`
/// elsewhere a line a cell.
pub(super) struct SweepProgress {
    bar: ProgressBar,
    volume: Volume,
    objective: String,
}

impl SweepProgress {
    pub(super) fn new(volume: Volume, objective: &str) -> Self {
        let visible = !volume.quiet && std::io::stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        Self { bar: ProgressBar::with_draw_target(None, target), volume, objective: objective.to_owned() }
    }

    fn describe(&self, standing: &RunProgress) -> String {
        let left = Duration::from_secs_f64(standing.left_s.clamp(0.0, 1e9));
        let left = (standing.done < standing.cells).then(|| format!("{} left", HumanDuration(left)));
        let best =
            standing.best.as_ref().map(|best| format!("best {} {:.1}: {}", self.objective, best.mean, best.setting));
        [left, best].into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

impl SweepWatch for SweepProgress {
    fn begin(&self, cells: usize, done: usize) {
        let style = ProgressStyle::with_template("{wide_bar} {pos}/{len} cells  {msg}");
        self.bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        self.bar.set_length(cells as u64);
        self.bar.set_position(done as u64);
        self.bar.tick();
    }

    fn advance(&self, standing: &RunProgress) {
        let words = self.describe(standing);
        if self.bar.is_hidden() && self.volume.verbose {
            note_on_stderr(&format!("{} of {} cells; {words}", standing.done, standing.cells));
        }
        self.bar.set_position(standing.done as u64);
        self.bar.set_message(words);
    }

    fn note(&self, note: &str) {
        self.bar.suspend(|| self.volume.notes(&[note.to_owned()]));
    }

    fn interrupted(&self) -> bool {
        interrupt::interrupted()
    }
}

/// Of a single cell nothing is shown.
impl Progress for SweepProgress {
    fn begin(&self, _: Stage, _: usize) {}

    fn advance(&self) {}

    fn interrupted(&self) -> bool {
        interrupt::interrupted()
    }
}

impl Drop for SweepProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
