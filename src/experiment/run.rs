//! Rendering, tracking and measuring, from and to directories that are whole or absent; and the three in one.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::output;
use super::inputs::Inputs;
use super::measuring::{Measures, SeedMeasures, check_fit};
use super::ours::Kind;
use super::partial_directory::PartialDirectory;
use super::results::{Results, RunRecord, tracker_in_words};
use super::scene_check::{CamerasInside, unseen_in};
use super::staging::Staged;
use super::tracking::{Tracked, track};
use super::watch::{Stage, Watch};
use super::{ExperimentError, Files, Models, Scenario, ScenarioFile, TrackerSettings};
use crate::benchmark_set::{BenchmarkSet, BlindSet, SetParts, TruthSet, is_set};
use crate::observation::Observer;

pub(super) const SCENARIO_FILE: &str = "scenario.toml";

/// Where a result goes.
#[derive(Clone, Copy, Debug)]
pub struct Destination<'a> {
    /// The directory.
    pub path: &'a Path,
    /// Replace a set that is there and move aside what is not ours, instead of refusing.
    pub force: bool,
}

/// A run that is done.
#[derive(Clone, Debug)]
pub struct Done {
    /// Its numbers.
    pub record: RunRecord,
    /// What a user should know.
    pub notes: Vec<String>,
}

/// Draws what the cameras see of a scenario: a benchmark set in memory, and notes for the user.
///
/// # Errors
/// [`ExperimentError`] that names the file, line or key.
pub fn draw(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    watch: &dyn Watch,
) -> Result<(BenchmarkSet, Vec<String>), ExperimentError> {
    let staged = Staged::new(file, mocap_directory)?;
    let inside = CamerasInside::of(file, &staged);
    if let Some(refused) = inside.refused.into_iter().next() {
        return Err(refused);
    }
    watch.begin(Stage::Render, staged.frames());
    let parts = SetParts {
        name: &file.scenario.name,
        rig: &staged.rig,
        start: &staged.start,
        ground_truth: &staged.ground_truth,
        refitted: Some(&staged.refitted),
        facts: &staged.facts,
    };
    let observer = Observer::new(&staged.ground_truth, &staged.rig);
    let seen = AtomicBool::new(false);
    let set = BenchmarkSet::assemble_unless(&parts, &|| watch.interrupted(), |frame| {
        watch.advance();
        let observation = observer.observe(frame);
        if observation.silhouettes.iter().any(|silhouette| !silhouette.is_empty()) {
            seen.store(true, Ordering::Relaxed);
        }
        observation
    })?;
    if watch.interrupted() {
        return Err(ExperimentError::Interrupted);
    }
    if !seen.into_inner() {
        return Err(unseen_in(file, staged.frames()));
    }
    Ok((set, [staged.notes, inside.told].concat()))
}

/// `skiagraph render`: writes a scenario's benchmark set; returns its hash and notes for the user.
///
/// # Errors
/// [`ExperimentError`]; then nothing has changed on the disk.
pub fn render(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    to: Destination<'_>,
    watch: &dyn Watch,
) -> Result<(BenchmarkSet, Vec<String>), ExperimentError> {
    // A run takes minutes to repeat; the runs that were made from a set are worth nothing without it.
    if is_set(to.path) && !to.force {
        return Err(ExperimentError::SetThere { path: to.path.to_owned() });
    }
    Inputs::of_scenario(file, mocap_directory).keep_from(to.path)?;
    let directory = PartialDirectory::begin(to.path, Kind::Set, to.force)?;
    let (set, notes) = draw(file, mocap_directory, watch)?;
    set.write_unless(directory.folder(), &file.scenario.layers, &|| watch.interrupted())?;
    directory.finish()?;
    Ok((set, notes))
}

/// `skiagraph track`: runs a tracker over a set. Of the set it reads cameras, observations and start alone, unless the
/// tracker is the oracle.
///
/// # Errors
/// [`ExperimentError`]; then nothing has changed on the disk.
pub fn track_set(
    set: &Path,
    settings: &TrackerSettings,
    seeds: &[u64],
    to: Destination<'_>,
    watch: &dyn Watch,
) -> Result<Tracked, ExperimentError> {
    Inputs::of_set(set, settings).keep_from(to.path)?;
    let directory = PartialDirectory::begin(to.path, Kind::Run, to.force)?;
    let blind = BlindSet::read(set)?;
    let truth = if settings.needs_truth() { TruthSet::read(set)?.refitted } else { None };
    let tracked = track(&blind, settings, seeds, truth.as_ref(), &mut Models::default(), watch)?;
    write_all(&directory, &tracked.files(&blind)?)?;
    directory.finish()?;
    Ok(tracked)
}

/// `skiagraph evaluate`: measures a run against the truth of its set and writes the results into the run's directory.
///
/// # Errors
/// [`ExperimentError`]; then nothing has changed on the disk.
pub fn evaluate_run(set: &Path, run: &Path, watch: &dyn Watch) -> Result<RunRecord, ExperimentError> {
    let whole = BenchmarkSet::read(set)?;
    let tracked = Tracked::read(run)?;
    check_fit(&whole, &tracked).map_err(|detail| ExperimentError::AnotherSet {
        run: run.to_owned(),
        set: set.to_owned(),
        detail,
    })?;
    let results = measure(&whole, &tracked, watch)?;
    replace_files(run, &results.files)?;
    Ok(results.record)
}

/// `skiagraph run`: renders, tracks and measures a scenario with all its seeds.
///
/// # Errors
/// [`ExperimentError`]; then nothing has changed on the disk.
pub fn run(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    to: Destination<'_>,
    watch: &dyn Watch,
) -> Result<Done, ExperimentError> {
    Inputs::of_scenario(file, mocap_directory).keep_from(to.path)?;
    let directory = PartialDirectory::begin(to.path, Kind::Run, to.force)?;
    let (set, notes) = draw(file, mocap_directory, watch)?;
    let seeds: Vec<u64> = file.scenario.all_seeds().collect();
    let attempt = Attempt { directory: &directory, folder: "", scenario: &file.scenario, set: &set, seeds: &seeds };
    let record = attempt.run(&mut Models::of(file), watch)?.record;
    directory.finish()?;
    Ok(Done { record, notes })
}

/// One tracker to be run on a set with all seeds.
pub(super) struct Attempt<'a> {
    pub(super) directory: &'a PartialDirectory,
    /// Folder of the run inside the directory, which is there; empty for the directory itself.
    pub(super) folder: &'a str,
    pub(super) scenario: &'a Scenario,
    pub(super) set: &'a BenchmarkSet,
    pub(super) seeds: &'a [u64],
}

/// What came of an attempt.
pub(super) struct Outcome {
    pub(super) record: RunRecord,
    pub(super) tracked: Tracked,
    pub(super) tracker_in_words: String,
    /// HumanEva error, mm, `[seed][frame]`.
    pub(super) errors: Vec<Vec<Option<f64>>>,
}

impl Attempt<'_> {
    /// Tracks, measures and writes the run's files.
    pub(super) fn run(&self, models: &mut Models, watch: &dyn Watch) -> Result<Outcome, ExperimentError> {
        let truth = self.set.truth.refitted.as_ref();
        let tracked = track(&self.set.blind, &self.scenario.tracker(), self.seeds, truth, models, watch)?;
        // As somebody does who tracks first and evaluates later: what is measured is what is on the disk.
        self.write(&tracked.files(&self.set.blind)?)?;
        let tracked = Tracked::read(&self.directory.folder().join(self.folder))?;
        let measures = Measures::new(self.set, &tracked, watch)?;
        let results = Results::new(self.set, &tracked, &measures)?;
        self.write(&vec![(SCENARIO_FILE, scenario_text(self.scenario)?.into_bytes())])?;
        self.write(&results.files)?;
        let error = |seed: &SeedMeasures| seed.evaluation.metrics.get("humaneva_mm").map(|m| m.per_frame.clone());
        Ok(Outcome {
            record: results.record,
            tracker_in_words: tracker_in_words(&tracked),
            errors: measures.seeds.iter().filter_map(error).collect(),
            tracked,
        })
    }

    fn write(&self, files: &Files) -> Result<(), ExperimentError> {
        let path = |name: &str| Path::new(self.folder).join(name).to_string_lossy().into_owned();
        files.iter().try_for_each(|(name, bytes)| self.directory.write(&path(name), bytes))
    }
}

fn measure(set: &BenchmarkSet, tracked: &Tracked, watch: &dyn Watch) -> Result<Results, ExperimentError> {
    let measures = Measures::new(set, tracked, watch)?;
    Results::new(set, tracked, &measures)
}

/// The scenario with its overrides, to be run again.
pub(super) fn scenario_text(scenario: &Scenario) -> Result<String, ExperimentError> {
    let malformed = |detail| ExperimentError::Malformed { path: SCENARIO_FILE.into(), detail };
    let tree = serde_json::to_value(scenario).map_err(|e| malformed(e.to_string()))?;
    toml::to_string(&tree).map_err(|e| malformed(e.to_string()))
}

fn write_all(directory: &PartialDirectory, files: &Files) -> Result<(), ExperimentError> {
    files.iter().try_for_each(|(name, bytes)| directory.write(name, bytes))
}

/// Puts files into a directory that is there already: all of them or none. Each is written beside its place first, and only when
/// all are on the disk are they moved; `run.json`, the last, is what makes a run.
fn replace_files(folder: &Path, files: &Files) -> Result<(), ExperimentError> {
    let partial = |name: &str| folder.join(format!(".{name}.partial"));
    let replaced = write_partial(&partial, files).and_then(|()| {
        files.iter().try_for_each(|(name, _)| {
            let path = folder.join(name);
            fs::rename(partial(name), &path).map_err(output(&path, "write"))
        })
    });
    if replaced.is_err() {
        files.iter().for_each(|(name, _)| drop(fs::remove_file(partial(name))));
    }
    replaced
}

fn write_partial(partial: &impl Fn(&str) -> PathBuf, files: &Files) -> Result<(), ExperimentError> {
    files.iter().try_for_each(|(name, bytes)| {
        let path = partial(name);
        let written = fs::File::create(&path).and_then(|mut file| {
            std::io::Write::write_all(&mut file, bytes)?;
            file.sync_all()
        });
        written.map_err(output(&path, "write"))
    })
}
