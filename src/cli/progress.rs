//! A progress bar on a terminal; with `--verbose`, the time of each stage.

use std::io::IsTerminal;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::interrupt;
use super::volume::{Volume, note_on_stderr};
use crate::common::{Progress, Stage};
use skiagraph_core::input::shell_word;

/// Shows progress on standard error if that is a terminal, unless `--quiet` is given.
pub(super) struct TerminalProgress {
    state: Mutex<ProgressState>,
    visible: bool,
    volume: Volume,
}

struct ProgressState {
    bar: ProgressBar,
    /// The current stage, its number of frames, and its start time.
    stage: Option<(Stage, usize, Instant)>,
}

impl TerminalProgress {
    pub(super) fn new(volume: Volume) -> Self {
        let state = ProgressState { bar: ProgressBar::hidden(), stage: None };
        let visible = !volume.quiet && std::io::stderr().is_terminal();
        Self { state: Mutex::new(state), visible, volume }
    }

    fn state(&self) -> MutexGuard<'_, ProgressState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn unit(stage: Stage) -> &'static str {
    match stage {
        Stage::TruthImages => "images",
        Stage::Sweep => "cells",
        Stage::Collect => "sets",
        Stage::Faults => "runs",
        _ => "frames",
    }
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::Render | Stage::Collect => "rendering",
        Stage::TruthImages => "drawing truth images",
        Stage::Calibrate => "calibrating",
        Stage::Track => "tracking",
        Stage::Evaluate => "measuring",
        Stage::Learn => "learning",
        Stage::Segment => "segmenting",
        Stage::Verify => "verifying",
        Stage::Export => "exporting",
        Stage::Sweep => "running",
        Stage::Faults => "planting faults",
    }
}

impl ProgressState {
    fn end_stage(&mut self, volume: Volume) {
        self.bar.finish_and_clear();
        if let Some((stage, frames, since)) = self.stage.take().filter(|_| volume.verbose) {
            let (name, unit, seconds) = (name(stage), unit(stage), since.elapsed().as_secs_f64());
            note_on_stderr(&format!("{name}: {frames} {unit} in {seconds:.2} s"));
        }
    }
}

impl Progress for TerminalProgress {
    fn begin(&self, stage: Stage, frames: usize) {
        let mut state = self.state();
        state.end_stage(self.volume);
        state.stage = Some((stage, frames, Instant::now()));
        if self.visible {
            let template = format!("{{prefix:>9}} {{wide_bar}} {{pos}}/{{len}} {}, {{eta}} left {{msg}}", unit(stage));
            let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
            state.bar = ProgressBar::with_draw_target(Some(frames as u64), ProgressDrawTarget::stderr())
                .with_style(style)
                .with_prefix(name(stage));
        }
    }

    fn advance(&self) {
        self.state().bar.inc(1);
    }

    fn set_status(&self, state: &str) {
        self.state().bar.set_message(state.to_owned());
    }

    fn note(&self, note: &str) {
        self.state().bar.suspend(|| self.volume.notes(&[note.to_owned()]));
    }

    fn command(&self) -> Option<String> {
        let words = std::env::args_os().skip(1).map(|word| shell_word(&word.to_string_lossy()));
        Some(std::iter::once("skiagraph".to_owned()).chain(words).collect::<Vec<_>>().join(" "))
    }

    fn interrupted(&self) -> bool {
        interrupt::interrupted()
    }
}

impl Drop for TerminalProgress {
    fn drop(&mut self) {
        let volume = self.volume;
        self.state().end_stage(volume);
    }
}
