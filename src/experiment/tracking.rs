//! Runs a tracker on a set and writes its files: `track.json`, `poses.npz` and `search.npz`; and `learned_from.npz`
//! where it moves on a model from a file; and `bodies.json` where it calibrated its body: one body a seed, of which the
//! poses are.
//!
//! `poses.npz` holds the answers; anybody's tracker may write it. `search.npz` says how ours searched:
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `energy` | (S, T) | energy of the estimate; NaN where there is none |
//! | `evaluations` | (S, T) | likelihood evaluations |
//! | `layers` | (S, T, L, 6) | one row an annealing layer, columns `layer_columns` |
//! | `occupancy` | (S, T, K, 3) | one row a motion model, columns `occupancy_columns`; K = 0 without such models |

use std::path::Path;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::calibrating::{self, Beginning};
use super::error::read_file;
use super::external::{EXTERNAL_FILE, ExternalRecord};
use super::nearest_training_pose::NearestTrainingPose;
use super::oracle::Oracle;
use super::watch::{Stage, Watch, advance};
use super::{ExperimentError, Models, NamedFiles};
use crate::benchmark_set::{
    BlindSet, EstimatedSequence, Estimates, SourceRecording, Training, bodies_from_json, bodies_to_json,
    recordings_from_npz, recordings_to_npz,
};
use crate::body::{Humanoid, Motion};
use crate::input::limits;
use crate::motion_model::{Diffusion, Prediction, ProposalScales};
use crate::npz::{Array, Npz, Values};
use crate::scenario::{LatentKind, LatentTrackerSettings, TrackerSettings, TrainingUse, json_tree};
use crate::tracker::{
    AnnealedParticleFilter, BodyCalibration, CalibrationReport, CalibrationVerdict, Estimate, FilterSettings, Frozen,
    LayerRecord, Likelihood, ModelOccupancy, PlausibleLikelihood, Refinement, SilhouetteLikelihood, Tracker,
};

pub(super) const TRACK_FILE: &str = "track.json";
pub(super) const POSES_FILE: &str = "poses.npz";
pub(super) const SEARCH_FILE: &str = "search.npz";
/// What the tracker's model file learned from, where it has one: the format of a set's `truth/recording.npz`.
/// The bodies of a run whose tracker calibrated its body, where one was kept.
pub(super) const BODIES_FILE: &str = "bodies.json";
pub(super) const LEARNED_FROM_FILE: &str = "learned_from.npz";

const LAYER_COLUMNS: [&str; 6] =
    ["lambda", "effective_sample_size", "energy_min", "energy_mean", "energy_std", "degenerate"];

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

/// How long tracking took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackTiming {
    /// Seconds for all frames of all seeds, reading of observations and calibration of the body included, learning of
    /// motion models not.
    pub seconds: f64,
    /// Frames of all seeds per second.
    pub frames_per_second: f64,
    /// Likelihood evaluations of all frames and seeds.
    pub likelihood_evaluations: u64,
    /// Threads.
    pub threads: usize,
}

/// How the search for one frame went.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchRecord {
    /// Energy of the estimate.
    pub energy: Option<f64>,
    /// Likelihood evaluations.
    pub evaluations: u64,
    /// Layer by layer.
    pub layers: Vec<LayerRecord>,
    /// Model by model, for trackers in latent spaces.
    pub occupancy: Vec<ModelOccupancy>,
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
    watch: &dyn Watch,
) -> Result<Tracked, ExperimentError> {
    let factory = TrackerFactory { set, truth, watch };
    let as_given = Beginning::from_set(set);
    let mut trackers = Vec::new();
    for seed in seeds {
        trackers.push(factory.begin(settings, models, &as_given, *seed)?);
    }
    let begin = Instant::now();
    let calibrations = factory.calibrate(settings, &mut trackers, seeds)?;
    for ((tracker, calibration), seed) in trackers.iter_mut().zip(&calibrations).zip(seeds) {
        *tracker = factory.begin(settings, models, &Beginning::from_calibration(calibration), *seed)?;
    }
    let (estimates, timing) = follow(set, trackers, begin, watch)?;
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
    watch: &dyn Watch,
    new_tracker: impl FnMut(u64) -> Box<dyn Tracker>,
) -> Result<Tracked, ExperimentError> {
    let mut trackers: Vec<Box<dyn Tracker>> = seeds.iter().copied().map(new_tracker).collect();
    trackers.iter_mut().for_each(|tracker| tracker.start(&set.start.pose));
    let (estimates, _) = follow(set, trackers, Instant::now(), watch)?;
    Ok(Tracked::new(set, seeds, Vec::new(), estimates))
}

/// Has trackers that have started follow the set's observations, all of them frame by frame; `begin` is when the work
/// began.
fn follow(
    set: &BlindSet,
    mut trackers: Vec<Box<dyn Tracker>>,
    begin: Instant,
    watch: &dyn Watch,
) -> Result<(Vec<Vec<Estimate>>, TrackTiming), ExperimentError> {
    let frames = set.frame_count * trackers.len();
    watch.begin(Stage::Track, frames);
    let mut estimates: Vec<Vec<Estimate>> = vec![Vec::new(); trackers.len()];
    for observation in set.observations() {
        let observation = observation?;
        for (tracker, estimates) in trackers.iter_mut().zip(&mut estimates) {
            estimates.push(tracker.track(&observation)?);
            advance(watch)?;
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
pub(super) fn prepare(
    set: &BlindSet,
    settings: &TrackerSettings,
    truth: Option<&Motion>,
    models: &mut Models,
    watch: &dyn Watch,
) -> Result<(), ExperimentError> {
    TrackerFactory { set, truth, watch }.build(settings, models, &Beginning::from_set(set), 0).map(drop)
}

/// What a tracker learned from, in words, one entry a recording.
fn learned_from(set: &BlindSet, settings: &TrackerSettings, models: &Models) -> Vec<String> {
    let kind = settings.kind();
    match kind.model_file() {
        Some(name) => models.sources_of(name).iter().map(|source| format!("{name}: {}", source.in_words())).collect(),
        None if kind.training() == TrainingUse::Unused => Vec::new(),
        None => set.start.training.in_words(),
    }
}

/// What a tracker may be built from.
struct TrackerFactory<'a> {
    set: &'a BlindSet,
    /// One pose of the tracker's body a frame: for oracles alone.
    truth: Option<&'a Motion>,
    watch: &'a dyn Watch,
}

impl TrackerFactory<'_> {
    /// A tracker that has started.
    fn begin(
        &self,
        settings: &TrackerSettings,
        models: &mut Models,
        beginning: &Beginning,
        seed: u64,
    ) -> Result<Box<dyn Tracker>, ExperimentError> {
        let mut tracker = self.build(settings, models, beginning, seed)?;
        tracker.start(&beginning.pose);
        Ok(tracker)
    }

    /// Calibrates the body with each of the trackers, which have started with the body as given; nothing where that is
    /// not asked for, or the tracker keeps its body.
    fn calibrate(
        &self,
        settings: &TrackerSettings,
        trackers: &mut [Box<dyn Tracker>],
        seeds: &[u64],
    ) -> Result<Vec<BodyCalibration>, ExperimentError> {
        if !self.set.start.calibrate {
            return Ok(Vec::new());
        }
        let TrackerSettings::AnnealedParticleFilter(filter) = settings else {
            let name = settings.name();
            self.watch.note(&format!(
                "tracker_body.calibrate: {name} keeps the body as it is; annealed_particle_filter calibrates it"
            ));
            return Ok(Vec::new());
        };
        let frames = calibrating::frames(self.set).last().map_or(0, |last| last + 1);
        self.watch.begin(Stage::Calibrate, frames * seeds.len());
        let mut calibrations = Vec::with_capacity(seeds.len());
        for (tracker, seed) in trackers.iter_mut().zip(seeds) {
            let found = calibrating::calibrated(self.set, filter.likelihood(), tracker.as_mut(), self.watch)?;
            self.watch.note(&format!("calibration, seed {seed}: {}", found.report.in_words()));
            calibrations.push(found);
        }
        Ok(calibrations)
    }

    /// Builds a tracker from its settings.
    fn build(
        &self,
        settings: &TrackerSettings,
        models: &mut Models,
        beginning: &Beginning,
        seed: u64,
    ) -> Result<Box<dyn Tracker>, ExperimentError> {
        let (body, training) = (&beginning.body, &self.set.start.training);
        let truth = || self.truth.ok_or(ExperimentError::OracleNeedsTruth);
        Ok(match settings {
            TrackerSettings::AnnealedParticleFilter(s) => {
                let scales = match (training, s.prediction) {
                    (Training::Motions(t), prediction) => ProposalScales::from_motions(body, &t.motions, prediction)?,
                    (Training::Spread(t), Prediction::None) => ProposalScales::from_root_mean_squares(&t.change),
                    (Training::Spread(t), Prediction::ConstantVelocity) => {
                        ProposalScales::from_root_mean_squares(&t.change_of_change)
                    }
                };
                let model = Diffusion::new(body.clone(), &scales, &s.diffusion())?;
                let mut likelihood = SilhouetteLikelihood::new(body.clone(), &self.set.rig, s.likelihood())?;
                if s.refinement().is_some() {
                    likelihood = likelihood.with_descent();
                }
                if beginning.is_calibrated {
                    likelihood = likelihood.with_light_extremities();
                }
                let seen = || training.motions().iter().flat_map(|motion| motion.poses.iter().cloned()).collect();
                let refinement =
                    s.refinement().map(|settings| Refinement::new(settings, body, seen(), seed)).transpose()?;
                match s.plausibility {
                    None => filter(s.filter(), model, likelihood, seed, refinement)?,
                    Some(plausibility) => {
                        let likelihood = PlausibleLikelihood::new(likelihood, plausibility)?;
                        filter(s.filter(), model, likelihood, seed, refinement)?
                    }
                }
            }
            TrackerSettings::Gpdm(s) => self.latent(s, models, seed)?,
            TrackerSettings::SwitchingGpdm(s) => self.latent(s, models, seed)?,
            TrackerSettings::GpdmGraph(s) => self.latent(s, models, seed)?,
            TrackerSettings::Frozen(_) => Box::new(Frozen::default()),
            TrackerSettings::NearestTrainingPose(_) => match training {
                Training::Motions(t) => Box::new(NearestTrainingPose::new(body, &t.motions, truth()?)),
                Training::Spread(_) => return Err(ExperimentError::NoTraining),
            },
            TrackerSettings::Oracle(s) => Box::new(Oracle::new(truth()?.poses.clone(), s.clone(), seed)),
        })
    }

    fn latent<T: LatentKind>(
        &self,
        settings: &LatentTrackerSettings<T>,
        models: &mut Models,
        seed: u64,
    ) -> Result<Box<dyn Tracker>, ExperimentError> {
        let model = models.latent(settings, self.set, self.truth, self.watch)?;
        let body = self.set.start.body.clone();
        let likelihood = SilhouetteLikelihood::new(body, &self.set.rig, settings.likelihood())?;
        Ok(Box::new(AnnealedParticleFilter::new(settings.filter(), model, likelihood, seed)?))
    }
}

/// A filter, with refinement where that is asked for.
fn filter<L: Likelihood + 'static>(
    settings: FilterSettings,
    model: Diffusion,
    likelihood: L,
    seed: u64,
    refinement: Option<Refinement>,
) -> Result<Box<dyn Tracker>, ExperimentError> {
    let filter = AnnealedParticleFilter::new(settings, model, likelihood, seed)?;
    Ok(match refinement {
        None => Box::new(filter),
        Some(refinement) => Box::new(filter.with_refinement(refinement)?),
    })
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
        Self { record: None, estimates, search, sources: Vec::new(), program: None }
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
        let bodies = match path.is_file() {
            false => Vec::new(),
            true => bodies_from_json(&path.display().to_string(), &read_file(&path, limits::JSON)?)?,
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
        let sources = match path.is_file() {
            false => Vec::new(),
            true => recordings_from_npz(&path.display().to_string(), &read_file(&path, limits::ARRAYS)?)?,
        };
        Ok(Self { record: Some(record), estimates, search, sources, program: None })
    }

    /// Reads what a program estimated in a run of `skiagraph track --exec`.
    ///
    /// # Errors
    /// [`ExperimentError`] naming the file that is missing or not what it should be.
    pub fn read_program(folder: &Path, body: &Humanoid) -> Result<Self, ExperimentError> {
        let path = folder.join(EXTERNAL_FILE);
        let malformed = |detail| ExperimentError::Malformed { path: path.clone(), detail };
        let program = json_tree::value_of_file(&read_file(&path, limits::RECORD)?).map_err(malformed)?;
        Ok(Self { program: Some(program), ..Self::from_others(&folder.join(POSES_FILE), body)? })
    }

    /// Reads a `poses.npz` alone, by any program, for the tracker's body.
    ///
    /// # Errors
    /// [`ExperimentError`] if it cannot be read or is not what it should be.
    pub fn from_others(file: &Path, body: &Humanoid) -> Result<Self, ExperimentError> {
        let estimates = Estimates::from_bytes(&file.display().to_string(), &read_file(file, limits::ARRAYS)?, body)?;
        Ok(Self { record: None, estimates, search: Vec::new(), sources: Vec::new(), program: None })
    }
}

fn search_to_npz(search: &[Vec<SearchRecord>]) -> Npz {
    let (seeds, frames) = (search.len(), search.first().map_or(0, Vec::len));
    let all = || search.iter().flatten();
    let layers = all().map(|r| r.layers.len()).max().unwrap_or(0);
    let row = |l: &LayerRecord| {
        let degenerate = if l.degenerate { 1.0 } else { 0.0 };
        [l.lambda, l.effective_sample_size, l.energy_min, l.energy_mean, l.energy_std, degenerate]
    };
    // A frame with fewer layers than others is filled up with rows of NaN.
    let rows = |r: &SearchRecord| {
        let missing = layers - r.layers.len();
        r.layers.iter().map(row).chain(std::iter::repeat_n([f64::NAN; 6], missing)).collect::<Vec<_>>()
    };
    let models = all().map(|r| r.occupancy.len()).max().unwrap_or(0);
    let in_model = |m: &ModelOccupancy| [f64::from(m.particles), m.weight, f64::from(m.recovered)];
    let in_models = |r: &SearchRecord| {
        let missing = models - r.occupancy.len();
        r.occupancy.iter().map(in_model).chain(std::iter::repeat_n([0.0; 3], missing)).collect::<Vec<_>>()
    };
    let energies: Vec<f64> = all().map(|r| r.energy.unwrap_or(f64::NAN)).collect();
    let evaluations: Vec<i64> = all().map(|r| i64::try_from(r.evaluations).unwrap_or(i64::MAX)).collect();
    Npz::from_iter([
        ("energy", Array::new(&[seeds, frames], energies)),
        ("evaluations", Array::new(&[seeds, frames], evaluations)),
        ("layers", Array::new(&[seeds, frames, layers, 6], all().flat_map(rows).flatten().collect::<Vec<f64>>())),
        ("layer_columns", Array::names(LAYER_COLUMNS)),
        (
            "occupancy",
            Array::new(&[seeds, frames, models, 3], all().flat_map(in_models).flatten().collect::<Vec<f64>>()),
        ),
        ("occupancy_columns", Array::names(["particles", "weight", "recovered"])),
    ])
}

/// `shape`: seeds and frames of the poses beside it.
fn search_from_npz(npz: &Npz, shape: [usize; 2]) -> Option<Vec<Vec<SearchRecord>>> {
    let Values::F64(energy) = &npz.get("energy")?.values else { return None };
    let Values::I64(evaluations) = &npz.get("evaluations")?.values else { return None };
    let array = npz.get("layers")?;
    let (Values::F64(layers), [seeds, frames, layer_count, 6]) = (&array.values, array.shape.as_slice()) else {
        return None;
    };
    let (occupancy, models) = match npz.get("occupancy") {
        None => (&[][..], 0),
        Some(array) => match (&array.values, array.shape.as_slice()) {
            (Values::F64(values), [s, f, models, 3]) if s == seeds && f == frames => (values.as_slice(), *models),
            _ => return None,
        },
    };
    if [*seeds, *frames] != shape || energy.len() != seeds * frames || evaluations.len() != seeds * frames {
        return None;
    }
    let record = |index: usize| {
        let rows = layers[index * layer_count * 6..(index + 1) * layer_count * 6].as_chunks::<6>().0;
        let layers = rows.iter().filter(|row| !row[0].is_nan()).map(|row| LayerRecord {
            lambda: row[0],
            effective_sample_size: row[1],
            energy_min: row[2],
            energy_mean: row[3],
            energy_std: row[4],
            degenerate: row[5] != 0.0,
        });
        let rows = occupancy[index * models * 3..(index + 1) * models * 3].as_chunks::<3>().0;
        let in_models = rows.iter().map(|row| ModelOccupancy {
            particles: row[0] as u32,
            weight: row[1],
            recovered: row[2] as u32,
        });
        SearchRecord {
            energy: Some(energy[index]).filter(|e| !e.is_nan()),
            evaluations: u64::try_from(evaluations[index]).unwrap_or(0),
            layers: layers.collect(),
            occupancy: in_models.collect(),
        }
    };
    Some((0..*seeds).map(|seed| (0..*frames).map(|frame| record(seed * frames + frame)).collect()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_a_search_went_is_read_back_as_it_was() {
        let layer = |lambda| LayerRecord {
            lambda,
            effective_sample_size: 50.0,
            energy_min: 0.1,
            energy_mean: 0.2,
            energy_std: 0.05,
            degenerate: lambda == 0.0,
        };
        let frame = |energy, layers| SearchRecord {
            energy,
            evaluations: 300,
            layers,
            occupancy: vec![ModelOccupancy { particles: 7, weight: 0.25, recovered: 1 }; 2],
        };
        let search = vec![
            vec![frame(Some(0.25), vec![layer(1.0), layer(0.0)]), frame(None, vec![layer(3.0)])],
            vec![frame(Some(0.5), vec![]), frame(Some(0.125), vec![layer(2.0), layer(9.0)])],
        ];
        assert_eq!(search_from_npz(&search_to_npz(&search), [2, 2]), Some(search));
    }

    #[test]
    fn arrays_that_do_not_fit_together_are_refused() {
        let mut npz =
            search_to_npz(&[vec![SearchRecord { energy: None, evaluations: 1, layers: vec![], occupancy: vec![] }]]);
        assert!(search_from_npz(&npz, [1, 1]).is_some());
        assert!(search_from_npz(&npz, [1, 2]).is_none());
        npz = Npz::from_iter([
            ("energy", Array::new(&[2], vec![0.0; 2])),
            ("evaluations", Array::new(&[1], vec![1_i64])),
            ("layers", Array::new(&[1, 1, 1, 6], vec![0.0; 6])),
        ]);
        assert_eq!(search_from_npz(&npz, [1, 1]), None);
    }
}
