//! Runs trackers on a set.

use std::time::Instant;

use super::calibrating::Beginning;
use super::program::{ProgramRun, track_program};
use super::tracker_factory::TrackerFactory;
use crate::common::{ExperimentError, Progress, Stage, advance};
use crate::external::TrackTiming;
use crate::measure::{TrackRecord, Tracked};
use crate::scenario::{TrackerSettings, TrainingUse};
use crate::train::Models;
use skiagraph_core::body::Motion;
use skiagraph_set::BlindSet;
use skiagraph_track::tracker::{CalibrationVerdict, Estimate, Tracker};

/// Runs a tracker with every seed over the blind side of a set; all seeds advance together, frame by frame.
///
/// `truth` (one pose of the tracker's body per frame) is only for reference trackers. Motion models in `models` are not
/// learned again.
pub fn track(
    set: &BlindSet,
    settings: &TrackerSettings,
    seeds: &[u64],
    truth: Option<&Motion>,
    models: &mut Models,
    progress: &dyn Progress,
) -> Result<Tracked, ExperimentError> {
    track_running(set, settings, seeds, truth, models, ProgramRun::default(), progress)
}

/// As [`track`]; `program` says how a program is run, if the tracker is one.
pub(crate) fn track_running(
    set: &BlindSet,
    settings: &TrackerSettings,
    seeds: &[u64],
    truth: Option<&Motion>,
    models: &mut Models,
    program: ProgramRun<'_>,
    progress: &dyn Progress,
) -> Result<Tracked, ExperimentError> {
    if let TrackerSettings::Program(settings) = settings {
        return track_program(set, settings, seeds, program, progress);
    }
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
        left_out: Vec::new(),
        calibration: calibrations.iter().map(|calibration| calibration.report.clone()).collect(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        timing,
    };
    let sources = settings.kind().model_file().map(|name| models.sources_of(name).to_vec()).unwrap_or_default();
    let kept = calibrations.iter().any(|calibration| calibration.report.verdict == CalibrationVerdict::Kept);
    let bodies = if kept { calibrations.into_iter().map(|calibration| calibration.body).collect() } else { Vec::new() };
    Ok(Tracked { record: Some(record), sources, ..Tracked::new(set, seeds, bodies, estimates) })
}

/// Runs any tracker over the blind side of a set: `new_tracker` makes one for each seed.
/// [`crate::measure::Measures::new`] measures the result against the truth.
pub(crate) fn track_with(
    set: &BlindSet,
    seeds: &[u64],
    progress: &dyn Progress,
    new_tracker: impl FnMut(u64) -> Result<Box<dyn Tracker>, ExperimentError>,
) -> Result<Tracked, ExperimentError> {
    let mut trackers = seeds.iter().copied().map(new_tracker).collect::<Result<Vec<Box<dyn Tracker>>, _>>()?;
    trackers.iter_mut().for_each(|tracker| tracker.start(&set.start.pose));
    let (estimates, _) = follow(set, trackers, Instant::now(), progress)?;
    Ok(Tracked::new(set, seeds, Vec::new(), estimates))
}

/// Runs started trackers over the set's observations, all together, frame by frame; `begin` is the start of the timing.
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
            // on a thread of the pool: from outside it, every parallel step of a frame waits for threads to change
            estimates.push(rayon::scope(|_| tracker.track(&observation))?);
            advance(progress)?;
        }
    }
    for (tracker, estimates) in trackers.iter_mut().zip(&mut estimates) {
        tracker.look_back(estimates);
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

/// Learns or reads the motion models that a tracker needs and `models` lacks.
pub(crate) fn prepare(
    set: &BlindSet,
    settings: &TrackerSettings,
    truth: Option<&Motion>,
    models: &mut Models,
    progress: &dyn Progress,
) -> Result<(), ExperimentError> {
    TrackerFactory { set, truth, progress }.build(settings, models, &Beginning::from_set(set), 0).map(drop)
}

/// Descriptions of a tracker's training recordings, one entry per recording.
fn learned_from(set: &BlindSet, settings: &TrackerSettings, models: &Models) -> Vec<String> {
    let kind = settings.kind();
    match kind.model_file() {
        Some(name) => models.sources_of(name).iter().map(|source| format!("{name}: {}", source.describe())).collect(),
        None if kind.training == TrainingUse::Unused => Vec::new(),
        None => set.describe_training(),
    }
}
