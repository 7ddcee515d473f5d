//! Progress and interruption of long work.

use super::ExperimentError;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    Render,
    /// Truth images are drawn: one per camera and frame.
    TruthImages,
    /// A motion model is learned from frames.
    Learn,
    /// The first frames are tracked, to calibrate the tracker's body.
    Calibrate,
    Track,
    Evaluate,
    Segment,
    /// Frames of a set are drawn again and compared.
    Verify,
    /// Frames of a set are written in another format.
    Export,
    Sweep,
    /// The sets of a sweep are made.
    Collect,
    /// Faults are planted, and a tracker runs with each.
    Faults,
}

/// Observes an experiment, from any thread.
pub trait Progress: Sync {
    /// A stage of `frames` frames, or cells, begins.
    fn begin(&self, stage: Stage, frames: usize);

    /// One more of them is done.
    fn advance(&self);

    /// A short text about the state of the work.
    fn set_status(&self, _state: &str) {}

    /// A note that the user should see at once.
    fn note(&self, _note: &str) {}

    /// The command that started the work, for reports; `None` if there is none.
    fn command(&self) -> Option<String> {
        None
    }

    /// Whether the work should stop.
    fn interrupted(&self) -> bool;
}

/// No progress output and no interruption.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn begin(&self, _: Stage, _: usize) {}

    fn advance(&self) {}

    fn interrupted(&self) -> bool {
        false
    }
}

/// Passes on an interruption, and nothing else: the work is a part of larger work.
pub(crate) struct OnlyInterruption<'a>(pub(crate) &'a dyn Progress);

impl Progress for OnlyInterruption<'_> {
    fn begin(&self, _: Stage, _: usize) {}

    fn advance(&self) {}

    fn interrupted(&self) -> bool {
        self.0.interrupted()
    }
}

pub(crate) fn advance(progress: &dyn Progress) -> Result<(), ExperimentError> {
    progress.advance();
    if progress.interrupted() { Err(ExperimentError::Interrupted) } else { Ok(()) }
}
