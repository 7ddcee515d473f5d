//! Runs a tracker on a set and writes its files: `track.json`, `poses.npz` and `search.npz`; and `learned_from.npz`
//! where it moves on a model from a file; and `bodies.json` where it calibrated its body: one body a seed, of which the
//! poses are.
//!
//! `poses.npz` holds the answers; anybody's tracker may write it. `search.npz` says how ours searched
//! (`search_file.rs`).

use std::path::Path;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::calibrating::Beginning;
use super::error::read_file;
use super::external::{EXTERNAL_FILE, ExternalRecord};
use super::poses_file::ReadAs;
use super::progress::{Progress, Stage, advance};
use super::search_file::{SearchRecord, search_from_npz, search_to_npz};
use super::track_timing::TrackTiming;
use super::tracker_factory::TrackerFactory;
use super::{ExperimentError, Models, NamedFiles};
use crate::benchmark_set::{
    BlindSet, EstimatedSequence, Estimates, SourceRecording, bodies_from_json, bodies_to_json, recordings_from_npz,
    recordings_to_npz,
};
use crate::body::{Humanoid, Motion};
use crate::input::limits;
use crate::npz::Npz;
use crate::scenario::{TrackerSettings, TrainingUse, json_tree};
use crate::tracker::{CalibrationReport, CalibrationVerdict, Estimate, Tracker};

pub(super) const TRACK_FILE: &str = "track.json";
pub(super) const POSES_FILE: &str = "poses.npz";
pub(super) const SEARCH_FILE: &str = "search.npz";
/// The bodies of a run whose tracker calibrated its body, where one was kept.
pub(super) const BODIES_FILE: &str = "bodies.json";
/// What the tracker's model file learned from, where it has one: the format of a set's `truth/recording.npz`.
pub(super) const LEARNED_FROM_FILE: &str = "learned_from.npz";

/// A tracker's estimates and search records.
#[derive(Clone, Debug)]
pub struct Tracked {
    /// Who tracked what; `None` for poses that another program made, and for [`track_with`].
    pub record: Option<TrackRecord>,
    /// The answers.
    pub estimates: Estimates,
    /// `[seed][frame]`: how the search went; empty for poses that another program made.
    pub search: Vec<Vec<SearchRecord>>,
    /// Which recordings a model from a file learned from; empty without such a model.
    pub sources: Vec<SourceRecording>,
    /// Which program tracked, where one did.
    pub program: Option<ExternalRecord>,
    /// The file or folder that is measured, as the command named it, where the results go elsewhere.
    pub estimate: Option<String>,
    /// How the file was read, where another program wrote it.
    pub read_as: Option<ReadAs>,
}

/// Who tracked what: `track.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackRecord {
    /// `skiagraph.track/1`.
    pub schema: String,
    /// The tracker and all its settings, as a scenario writes them.
    pub tracker: TrackerSettings,
    /// Which set, by the hash of its files.
    pub set_hash: String,
    /// What the tracker learned from, in words; empty where it learns nothing.
    #[serde(default)]
    pub learned_from: Vec<String>,
    /// What the calibration of the tracker's body found, one entry a seed; absent without one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub calibration: Vec<CalibrationReport>,
    /// Version of the program.
    pub version: String,
    /// What differs from run to run.
    pub timing: TrackTiming,
}

/// Runs a tracker with every seed over a set, blindfolded; all seeds advance together, frame by frame.
///
/// `truth` (one pose of the tracker's body a frame) is for oracles alone. Motion models that are among `models` are not
/// learned again.
///
/// # Errors
/// [`ExperimentError`] if the set cannot be read, the settings make no sense, or tracking cannot go on.
pub fn track(
    set: &BlindSet,
    settings: &TrackerSettings,
    seeds: &[u64],
    truth: Option<&Motion>,
    models: &mut Models,
    progress: &dyn Progress,
) -> Result<Tracked, ExperimentError> {
    let factory = TrackerFactory { set, truth, progress };
    let as_given = Beginning::from_set(set);
    let mut trackers = Vec::new();
    for seed in seeds {
        trackers.push(factory.begin(settings, models, &as_given, *seed)?);
    }
    let begin = Instant::now();
    let calibrations = factory.calibrate(settings, &mut trackers, seeds)?;
    for ((tracker, calibration), seed) in trackers.iter_mut().zip(&calibrations).zip(seeds) {
        *tracker = factory.begin(settings, models, &Beginning::from_calibration(set, calibration), *seed)?;
    }
    let (estimates, timing) = follow(set, trackers, begin, progress)?;
    let record = TrackRecord {
        schema: "skiagraph.track/1".to_owned(),
        tracker: settings.clone(),
        set_hash: set.set_hash.clone(),
        learned_from: learned_from(set, settings, models),
        calibration: calibrations.iter().map(|calibration| calibration.report.clone()).collect(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        timing,
    };
    let sources = settings.kind().model_file().map(|name| models.sources_of(name).to_vec()).unwrap_or_default();
    let kept = calibrations.iter().any(|calibration| calibration.report.verdict == CalibrationVerdict::Kept);
    let bodies = if kept { calibrations.into_iter().map(|calibration| calibration.body).collect() } else { Vec::new() };
    Ok(Tracked { record: Some(record), sources, ..Tracked::new(set, seeds, bodies, estimates) })
}

/// Runs any tracker over a set, blindfolded: `new_tracker` makes one for each seed. [`super::Measures::new`] measures
/// the result against the truth.
///
/// # Errors
/// [`ExperimentError`] if an observation cannot be read, the tracker fails, or `watch` stops the work.
pub fn track_with(
    set: &BlindSet,
    seeds: &[u64],
    progress: &dyn Progress,
    new_tracker: impl FnMut(u64) -> Box<dyn Tracker>,
) -> Result<Tracked, ExperimentError> {
    let mut trackers: Vec<Box<dyn Tracker>> = seeds.iter().copied().map(new_tracker).collect();
    trackers.iter_mut().for_each(|tracker| tracker.start(&set.start.pose));
    let (estimates, _) = follow(set, trackers, Instant::now(), progress)?;
    Ok(Tracked::new(set, seeds, Vec::new(), estimates))
}

/// Has trackers that have started follow the set's observations, all of them frame by frame; `begin` is when the work
/// began.
fn follow(
    set: &BlindSet,
    mut trackers: Vec<Box<dyn Tracker>>,
    begin: Instant,
    progress: &dyn Progress,
) -> Result<(Vec<Vec<Estimate>>, TrackTiming), ExperimentError> {
    let frames = set.frame_count * trackers.len();
    progress.begin(Stage::Track, frames);
    let mut estimates: Vec<Vec<Estimate>> = vec![Vec::new(); trackers.len()];
    for observation in set.observations() {
        let observation = observation?;
        for (tracker, estimates) in trackers.iter_mut().zip(&mut estimates) {
            estimates.push(tracker.track(&observation)?);
            advance(progress)?;
        }
    }
    let seconds = begin.elapsed().as_secs_f64();
    let timing = TrackTiming {
        seconds,
        frames_per_second: frames as f64 / seconds,
        likelihood_evaluations: estimates.iter().flatten().map(|e| e.evaluations).sum(),
        threads: rayon::current_num_threads(),
    };
    Ok((estimates, timing))
}

/// Learns or reads the motion models that a tracker needs, where `models` does not have them.
///
/// # Errors
/// As [`track`], before the first frame.
pub(crate) fn prepare(
    set: &BlindSet,
    settings: &TrackerSettings,
    truth: Option<&Motion>,
    models: &mut Models,
    progress: &dyn Progress,
) -> Result<(), ExperimentError> {
    TrackerFactory { set, truth, progress }.build(settings, models, &Beginning::from_set(set), 0).map(drop)
}

/// What a tracker learned from, in words, one entry a recording.
fn learned_from(set: &BlindSet, settings: &TrackerSettings, models: &Models) -> Vec<String> {
    let kind = settings.kind();
    match kind.model_file() {
        Some(name) => models.sources_of(name).iter().map(|source| format!("{name}: {}", source.describe())).collect(),
        None if kind.training == TrainingUse::Unused => Vec::new(),
        None => set.start.training.describe(),
    }
}

impl Tracked {
    /// Estimates of every seed, of whom is not said; `bodies` are those of the seeds where they are not the set's.
    fn new(set: &BlindSet, seeds: &[u64], bodies: Vec<Humanoid>, estimates: Vec<Vec<Estimate>>) -> Self {
        let mut sequences = Vec::new();
        let mut search = Vec::new();
        for (index, of_seed) in estimates.into_iter().enumerate() {
            let poses = of_seed.iter().map(|e| e.pose.clone()).collect();
            let body = bodies.get(index).unwrap_or(&set.start.body);
            let known = of_seed.iter().any(|e| e.covariances.is_some());
            let covariances = of_seed.iter().filter(|_| known).map(|e| e.covariances.unwrap_or_default());
            let covariances = covariances.collect();
            sequences.push(EstimatedSequence { covariances, ..EstimatedSequence::from_poses(body, poses) });
            let records = of_seed.into_iter().map(|e| SearchRecord {
                energy: e.energy,
                evaluations: e.evaluations,
                layers: e.layers,
                occupancy: e.occupancy,
            });
            search.push(records.collect());
        }
        let (frames_per_second, seeds) = (set.frames_per_second, seeds.to_vec());
        let estimates = Estimates { frames_per_second, seeds, sequences, bodies, notes: Vec::new() };
        Self { record: None, estimates, search, sources: Vec::new(), program: None, estimate: None, read_as: None }
    }

    /// Runs of one tracker with a seed each, put together in their order.
    ///
    /// # Errors
    /// [`ExperimentError::Malformed`] where there is none.
    pub(super) fn of_seeds(set: &BlindSet, seeds: Vec<Self>) -> Result<Self, ExperimentError> {
        let own_body = |one: &Self| one.estimates.bodies.first().unwrap_or(&set.start.body).clone();
        let are_calibrated = seeds.iter().any(|one| !one.estimates.bodies.is_empty());
        let bodies = if are_calibrated { seeds.iter().map(own_body).collect() } else { Vec::new() };
        let mut seeds = seeds.into_iter();
        let mut all = seeds
            .next()
            .ok_or_else(|| ExperimentError::Malformed { path: POSES_FILE.into(), detail: "no seed".to_owned() })?;
        for one in seeds {
            all.estimates.seeds.extend(one.estimates.seeds);
            all.estimates.sequences.extend(one.estimates.sequences);
            all.search.extend(one.search);
            if let (Some(record), Some(of_seed)) = (&mut all.record, one.record) {
                record.calibration.extend(of_seed.calibration);
                record.timing = record.timing.and(of_seed.timing);
            }
        }
        all.estimates.bodies = bodies;
        Ok(all)
    }

    /// The files of a run that has not been measured yet.
    ///
    /// # Errors
    /// [`ExperimentError::Set`] for more than a file can hold.
    pub fn files(&self, set: &BlindSet) -> Result<NamedFiles, ExperimentError> {
        let mut files = vec![(POSES_FILE, self.estimates.to_bytes(POSES_FILE, &set.start.body, None)?)];
        if let Some(record) = &self.record {
            files.push((TRACK_FILE, super::to_json(record)?));
            files.push((SEARCH_FILE, search_to_npz(&self.search).to_bytes(SEARCH_FILE)?));
        }
        if let Some(program) = &self.program {
            files.push((EXTERNAL_FILE, super::to_json(program)?));
        }
        if !self.estimates.bodies.is_empty() {
            files.push((BODIES_FILE, bodies_to_json(BODIES_FILE, &self.estimates.bodies)?));
        }
        if !self.sources.is_empty() {
            files.push((LEARNED_FROM_FILE, recordings_to_npz(LEARNED_FROM_FILE, &self.sources)?));
        }
        Ok(files)
    }

    /// Reads a run of this program; `body` is the tracker's, of the set that it was made from.
    ///
    /// # Errors
    /// [`ExperimentError`] naming the file that is missing or not what it should be.
    pub fn read(folder: &Path, body: &Humanoid) -> Result<Self, ExperimentError> {
        let path = folder.join(BODIES_FILE);
        let bodies = if path.is_file() {
            bodies_from_json(&path.display().to_string(), &read_file(&path, limits::JSON)?)?
        } else {
            Vec::new()
        };
        let path = folder.join(POSES_FILE);
        let bytes = read_file(&path, limits::ARRAYS)?;
        let estimates = Estimates::from_bodies(&path.display().to_string(), &bytes, body, bodies)?;
        let path = folder.join(TRACK_FILE);
        let malformed = |detail| ExperimentError::Malformed { path: path.clone(), detail };
        let record = json_tree::value_of_file(&read_file(&path, limits::RECORD)?).map_err(malformed)?;
        let path = folder.join(SEARCH_FILE);
        let npz = Npz::from_bytes(&path.display().to_string(), &read_file(&path, limits::ARRAYS)?)?;
        let shape = [estimates.seeds.len(), estimates.frames()];
        let search = search_from_npz(&npz, shape).ok_or_else(|| ExperimentError::Malformed {
            path,
            detail: "expected the arrays energy, evaluations and layers as `skiagraph track` writes them".to_owned(),
        })?;
        let path = folder.join(LEARNED_FROM_FILE);
        let sources = if path.is_file() {
            recordings_from_npz(&path.display().to_string(), &read_file(&path, limits::ARRAYS)?)?
        } else {
            Vec::new()
        };
        Ok(Self { record: Some(record), estimates, search, sources, program: None, estimate: None, read_as: None })
    }

    /// Reads what a program estimated in a run of `skiagraph track --exec`.
    ///
    /// # Errors
    /// [`ExperimentError`] naming the file that is missing or not what it should be.
    pub fn read_program(folder: &Path, body: &Humanoid) -> Result<Self, ExperimentError> {
        let path = folder.join(EXTERNAL_FILE);
        let malformed = |detail| ExperimentError::Malformed { path: path.clone(), detail };
        let program: ExternalRecord =
            json_tree::value_of_file(&read_file(&path, limits::RECORD)?).map_err(malformed)?;
        Ok(Self { program: Some(program.harmless()), ..Self::from_others(&folder.join(POSES_FILE), body)? })
    }

    /// Reads a `poses.npz` alone, by any program, for the tracker's body.
    ///
    /// # Errors
    /// [`ExperimentError`] if it cannot be read or is not what it should be.
    pub fn from_others(file: &Path, body: &Humanoid) -> Result<Self, ExperimentError> {
        let estimates = Estimates::from_bytes(&file.display().to_string(), &read_file(file, limits::ARRAYS)?, body)?;
        Ok(Self {
            record: None,
            estimates,
            search: Vec::new(),
            sources: Vec::new(),
            program: None,
            estimate: None,
            read_as: None,
        })
    }
}
