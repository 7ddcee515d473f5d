//! One run of the tracker on a set with some inputs replaced by the truth.

use std::path::PathBuf;

use super::errors::ErrorProfile;
use super::player::Player;
use super::source::RepeatableRun;
use super::swap::swapped;
use crate::benchmark_set::{BenchmarkSet, EstimatedSequence};
use crate::common::{ExperimentError, Progress};
use crate::experiment::program_tracking::ProgramRun;
use crate::experiment::tracking::track_running;
use crate::experiment::truth_descent::descend_from_truth;
use crate::measure::Tracked;
use crate::prepare::retargeting::refit;
use crate::train::Models;

/// Runs the tracker of a run again.
pub(super) struct Cells<'a> {
    pub(super) run: &'a RepeatableRun,
    pub(super) seeds: Vec<u64>,
    /// What a program in a sandbox may not see.
    pub(super) hidden: Vec<PathBuf>,
    /// Motion models of the given body, and of the true one.
    models: [Models; 2],
}

impl<'a> Cells<'a> {
    pub(super) fn new(run: &'a RepeatableRun, seeds: Vec<u64>, hidden: Vec<PathBuf>) -> Self {
        Self { run, seeds, hidden, models: [run.models.clone(), run.models.clone()] }
    }

    /// Tracks a set with some of the run's seeds.
    pub(super) fn track(
        &mut self,
        set: &BenchmarkSet,
        seeds: &[u64],
        has_true_body: bool,
        progress: &dyn Progress,
    ) -> Result<Tracked, ExperimentError> {
        let hidden: Vec<_> = self.hidden.iter().map(PathBuf::as_path).collect();
        let (truth, program) = (set.truth.refitted.as_ref(), ProgramRun::hiding(&hidden));
        let models = &mut self.models[usize::from(has_true_body)];
        track_running(&set.blind, &self.run.tracker, seeds, truth, models, program, progress)
    }

    /// The error of every seed with these inputs true.
    pub(super) fn errors(
        &mut self,
        players: &[Player],
        progress: &dyn Progress,
    ) -> Result<Vec<ErrorProfile>, ExperimentError> {
        let set = swapped(&self.run.set, players, progress)?;
        let seeds = self.seeds.clone();
        let tracked = self.track(&set, &seeds, players.contains(&Player::Body), progress)?;
        Ok(tracked.estimates.sequences.iter().map(|sequence| self.error(sequence)).collect())
    }

    /// The error of descents from the truth with these inputs true, which is the same for every seed; `None` for
    /// trackers without such a descent.
    pub(super) fn error_of_descent(
        &self,
        players: &[Player],
        progress: &dyn Progress,
    ) -> Result<Option<ErrorProfile>, ExperimentError> {
        let set = swapped(&self.run.set, players, progress)?;
        let truth = set.truth.refitted.clone().unwrap_or_else(|| {
            let markers: Vec<_> = set.truth.ground_truth.frames.iter().map(|frame| frame.markers).collect();
            refit(&set.blind.start.body, &markers, set.blind.frames_per_second)
        });
        let poses = descend_from_truth(&set.blind, &truth, &self.run.tracker, progress)?;
        Ok(poses.map(|poses| self.error(&EstimatedSequence::from_poses(&set.blind.start.body, poses))))
    }

    pub(super) fn error(&self, sequence: &EstimatedSequence) -> ErrorProfile {
        ErrorProfile::new(&self.run.set.truth.ground_truth, sequence)
    }
}
