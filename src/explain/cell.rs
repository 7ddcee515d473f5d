//! Runs of the tracker on a set with some inputs replaced by the truth.

use std::path::PathBuf;

use super::errors::ErrorProfile;
use super::player::Player;
use super::source::RepeatableRun;
use super::swap::swapped;
use crate::common::{ExperimentError, Progress, Stage, read_file};
use crate::measure::Tracked;
use crate::prepare::retargeting::refit;
use crate::scenario::TrackerSettings;
use crate::tracking::program::ProgramRun;
use crate::tracking::track::track_running;
use crate::tracking::truth_descent::descend_from_truth;
use crate::tracking::unfinished_run::{KeptSeeds, UnfinishedRun};
use crate::train::Models;
use skiagraph_core::input::limits;
use skiagraph_set::{BenchmarkSet, EstimatedSequence};

const ERROR_FILE: &str = "error.npz";

/// Runs the tracker of a run again, seed by seed. Finished repetitions survive an interruption.
pub(super) struct Cells<'a> {
    pub(super) run: &'a RepeatableRun,
    pub(super) seeds: Vec<u64>,
    /// What a program in a sandbox may not see.
    pub(super) hidden: Vec<PathBuf>,
    kept: &'a UnfinishedRun,
    /// Motion models of the given body, and of the true one.
    models: [Models; 2],
}

impl<'a> Cells<'a> {
    pub(super) fn new(run: &'a RepeatableRun, seeds: Vec<u64>, hidden: Vec<PathBuf>, kept: &'a UnfinishedRun) -> Self {
        Self { run, seeds, hidden, kept, models: [run.models.clone(), run.models.clone()] }
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
        let progress = WithoutNotes(progress);
        track_running(&set.blind, &self.run.tracker, seeds, truth, models, program, &progress)
    }

    pub(super) fn errors(
        &mut self,
        players: &[Player],
        progress: &dyn Progress,
    ) -> Result<Vec<ErrorProfile>, ExperimentError> {
        let name = name_of(players);
        let kept = self.kept.of_method(&name);
        let seeds = self.seeds.clone();
        let missing: Vec<u64> = seeds.iter().copied().filter(|seed| kept.seed(*seed).is_none()).collect();
        if !missing.is_empty() {
            let set = swapped(&self.run.set, players, progress)?;
            // few at a time, so that little is lost by an interruption
            for seeds in missing.chunks(self.at_once()) {
                let tracked = self.track(&set, seeds, players.contains(&Player::Body), progress)?;
                for (seed, sequence) in seeds.iter().zip(&tracked.estimates.sequences) {
                    put(kept, *seed, &self.error(sequence))?;
                }
            }
        }
        seeds.into_iter().map(|seed| kept_error(kept, seed)?.ok_or_else(|| no_estimates(seed))).collect()
    }

    /// Number of seeds that are tracked together: as many as there are cores, of a program one.
    fn at_once(&self) -> usize {
        match self.run.tracker {
            TrackerSettings::Program(_) => 1,
            _ => rayon::current_num_threads().max(1),
        }
    }

    /// Number of finished repetitions with these inputs true.
    pub(super) fn finished(&self, players: &[Player]) -> usize {
        let name = name_of(players);
        self.seeds.iter().filter(|seed| self.kept.of_method(&name).seed(**seed).is_some()).count()
    }

    /// The error of descents from the truth with these inputs true, which is the same for every seed; `None` for
    /// trackers without such a descent.
    pub(super) fn error_of_descent(
        &self,
        players: &[Player],
        progress: &dyn Progress,
    ) -> Result<Option<ErrorProfile>, ExperimentError> {
        let kept = self.kept.of_method("descent");
        if let Some(error) = kept_error(kept, 0)? {
            return Ok(Some(error));
        }
        let set = swapped(&self.run.set, players, progress)?;
        let truth = set.truth.refitted.clone().unwrap_or_else(|| {
            let markers: Vec<_> = set.truth.ground_truth.frames.iter().map(|frame| frame.markers).collect();
            refit(&set.blind.start.body, &markers, set.blind.frames_per_second)
        });
        let poses = descend_from_truth(&set.blind, &truth, &self.run.tracker, progress)?;
        let error = poses.map(|poses| self.error(&EstimatedSequence::from_poses(&set.blind.start.body, poses)));
        error.iter().try_for_each(|error| put(kept, 0, error))?;
        Ok(error)
    }

    pub(super) fn error(&self, sequence: &EstimatedSequence) -> ErrorProfile {
        ErrorProfile::new(&self.run.set.truth.ground_truth, sequence)
    }
}

/// Passes on everything but notes, which every repetition makes again.
struct WithoutNotes<'a>(&'a dyn Progress);

impl Progress for WithoutNotes<'_> {
    fn begin(&self, stage: Stage, frames: usize) {
        self.0.begin(stage, frames);
    }

    fn advance(&self) {
        self.0.advance();
    }

    fn set_status(&self, state: &str) {
        self.0.set_status(state);
    }

    fn note(&self, _: &str) {}

    fn command(&self) -> Option<String> {
        self.0.command()
    }

    fn interrupted(&self) -> bool {
        self.0.interrupted()
    }
}

/// `body+cameras`: the name under which repetitions with these inputs true are kept.
fn name_of(players: &[Player]) -> String {
    players.iter().map(|player| format!("{player:?}").to_lowercase()).collect::<Vec<_>>().join("+")
}

fn put(kept: KeptSeeds<'_>, seed: u64, error: &ErrorProfile) -> Result<(), ExperimentError> {
    kept.put(seed, &vec![(ERROR_FILE.into(), error.to_npz(ERROR_FILE)?)])?;
    Ok(())
}

/// The error of a finished repetition; `None` if it is not finished.
fn kept_error(kept: KeptSeeds<'_>, seed: u64) -> Result<Option<ErrorProfile>, ExperimentError> {
    let Some(path) = kept.seed(seed).map(|folder| folder.join(ERROR_FILE)) else { return Ok(None) };
    let bytes = read_file(&path, limits::ARRAYS)?;
    Ok(Some(ErrorProfile::from_npz(&path.display().to_string(), &bytes)?))
}

fn no_estimates(seed: u64) -> ExperimentError {
    ExperimentError::Argument { argument: "RUN", detail: format!("the tracker gives no estimates with seed {seed}") }
}
