//! Estimates the cost of a scenario: times from a measured sample, memory and disk space from the amount of data.

use std::time::Instant;

use serde::Serialize;

use crate::common::{ExperimentError, NoProgress};
use crate::measure::Measures;
use crate::prepare::PreparedScene;
use crate::rendering::memory;
use crate::rendering::observer::observer;
use crate::scenario::{AnnealedParticleFilterSettings, NoSettings, Scenario, SearchSettings, TrackerSettings};
use crate::tracking::calibrating;
use crate::tracking::track::track;
use crate::train::Models;
use skiagraph_core::body::{Motion, Solid};
use skiagraph_set::{BenchmarkSet, SetParts, TRUTH_IMAGE_MEMORY_BYTES};
use skiagraph_track::tracker::FilterSettings;
use skiagraph_truth::observing::SilhouetteSource;
use skiagraph_truth::scene::GroundTruth;

/// Time limit for drawing the sample, and for tracking it with each kind of likelihood, seconds.
const SAMPLE_S: f64 = 0.25;
/// Number of particles of the first measurement, and the seconds after which no more particles are measured.
const FEW_PARTICLES: usize = 8;
const SLOW_S: f64 = 1.0;
/// Memory of an empty run: the program, its tables, the report; bytes.
const BASE_MEMORY: f64 = 55e6;
/// Approximate number of columns of `per_frame.csv`, and bytes of a number as text.
const CSV_COLUMNS: f64 = 60.0;
const CSV_BYTES: f64 = 17.0;
/// Approximate size of a report and a contact sheet, bytes.
const PAGE_BYTES: f64 = 1.6e6;
const METRICS: f64 = 60.0;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunCost {
    /// Seconds to read the files, retarget, plant or simulate; measured, because `check` does it.
    pub staging_s: f64,
    /// Seconds to draw all frames.
    pub render_s: f64,
    /// Seconds to track with all methods and seeds, without learning motion models.
    pub track_s: f64,
    pub measure_s: f64,
    /// Total seconds of `skiagraph run`, without learning motion models.
    pub run_s: f64,
    /// Number of trackers that first learn a motion model, which takes from seconds to many minutes.
    pub models_to_learn: usize,
    /// Likelihood evaluations of all frames, seeds and methods.
    pub likelihood_evaluations: u64,
    /// Greatest memory of `run`, bytes.
    pub memory_bytes: u64,
    /// Greatest memory of `render`, bytes; memory for truth images is bounded.
    pub render_memory_bytes: u64,
    /// Size of the results of `run`, bytes.
    pub run_bytes: u64,
    /// Size of the set of `render` with truth images, bytes.
    pub set_bytes: u64,
    /// Number of threads for which the times are estimated.
    pub threads: usize,
}

struct MeasuredTimes {
    frame_render_s: f64,
    frame_measure_s: f64,
    /// Size of the set's files without truth images.
    set_bytes: f64,
    silhouette_bytes: f64,
    truth_image_bytes: f64,
}

/// Estimates the cost of a scenario whose scene was prepared in `staging_s` seconds; takes about a second.
pub(crate) fn cost(scenario: &Scenario, scene: &PreparedScene, staging_s: f64) -> Result<RunCost, ExperimentError> {
    let (frames, seeds) = (scene.frames() as f64, f64::from(scenario.seeds));
    let (cameras, rate) = (scene.rig.cameras(), scene.ground_truth.frames_per_second);
    let trackers = scenario.trackers();
    let two = timed(|| set_of(scenario, scene, 2));
    let two = (two.0?, two.1);
    let sample = sample(scenario, scene, &two)?;
    let (two, _) = two;
    let mut known: Vec<(SearchSettings, Speed)> = Vec::new();
    let (mut track_s, mut likelihood_evaluations) = (0.0, 0);
    for (_, tracker) in &trackers {
        let kind = tracker.kind();
        if let TrackerSettings::Program(_) = tracker {
            let tracked = track(&two.blind, tracker, &[0], None, &mut Models::default(), &NoProgress)?;
            let seconds = tracked.program.map_or(0.0, |program| program.timing.seconds);
            track_s += frames * seeds * seconds / two.blind.frame_count as f64;
        }
        let Some(search) = kind.search else { continue };
        let evaluations = search.filter.particles as u64 * search.filter.layers as u64;
        let work = SearchSettings { filter: FilterSettings::default(), ..search };
        let speed = match known.iter().find(|(known, _)| *known == work) {
            Some((_, speed)) => *speed,
            None => {
                let speed = Speed::new(&two, work, evaluations)?;
                known.push((work, speed));
                speed
            }
        };
        let calibrates = !two.blind.start.calibrate.is_nothing() && calibrating::calibrated(tracker).is_some();
        let again = if calibrates { calibrating::tracked_frames(cameras, scene.frames(), rate) as f64 } else { 0.0 };
        track_s += (frames + again) * seeds * speed.seconds(evaluations);
        likelihood_evaluations += kind.evaluations_per_frame() * scene.frames() as u64 * u64::from(scenario.seeds);
    }
    let methods = trackers.len() as f64;
    let (render_s, measure_s) =
        (frames * sample.frame_render_s, frames * sample.frame_measure_s * (seeds + 1.0) * methods);
    let render_s = render_s + background_s(scenario, scene)?;
    let [render_memory, drawing_memory] = [sample.set_bytes, sample.set_bytes - sample.silhouette_bytes]
        .map(|in_memory| render_memory(scenario, scene, in_memory));
    Ok(RunCost {
        staging_s,
        render_s,
        track_s,
        measure_s,
        run_s: staging_s + render_s + track_s + measure_s,
        models_to_learn: trackers.iter().filter(|(_, tracker)| tracker.kind().learns()).count(),
        likelihood_evaluations,
        memory_bytes: (render_memory + tracking_memory(scenario, scene)) as u64,
        render_memory_bytes: (drawing_memory + truth_images_memory(scenario, scene)) as u64,
        run_bytes: run_bytes(scenario, scene) as u64,
        set_bytes: (sample.set_bytes + frames * sample.truth_image_bytes) as u64,
        threads: rayon::current_num_threads(),
    })
}

/// Draws and measures as many frames as fit the time limit; `two` is a set of two frames and the seconds that it took.
fn sample(
    scenario: &Scenario,
    scene: &PreparedScene,
    two: &(BenchmarkSet, f64),
) -> Result<MeasuredTimes, ExperimentError> {
    let (few, few_s) = two;
    let threads = rayon::current_num_threads().max(1);
    // seconds per frame and thread: half the time of two frames, or all of it if they were drawn in parallel
    let frame_s = few_s / if threads == 1 { 2.0 } else { 1.0 };
    let fitting = (SAMPLE_S * threads as f64 / frame_s.max(1e-6)) as usize;
    let frames = fitting.clamp(2, 8 * threads + 3).min(scene.frames());
    let (set, set_s) = timed(|| set_of(scenario, scene, frames));
    let set = set?;
    let more = frames.saturating_sub(2);
    let growth = match more {
        0 => few.bytes() as f64 / few.blind.frame_count as f64,
        more => (set.bytes() as f64 - few.bytes() as f64) / more as f64,
    };
    let frozen = TrackerSettings::Frozen(NoSettings {});
    let tracked = track(&set.blind, &frozen, &[0], None, &mut Models::default(), &NoProgress)?;
    let (_, measure_s) = timed(|| Measures::new(&set, &tracked, &NoProgress).is_ok());
    Ok(MeasuredTimes {
        frame_render_s: if frames < threads { frame_s / threads as f64 } else { set_s / frames as f64 },
        // one seed and the frozen tracker
        frame_measure_s: measure_s / (2 * frames) as f64,
        set_bytes: few.bytes() as f64 + growth * (scene.frames() as f64 - 2.0).max(0.0),
        silhouette_bytes: few.silhouette_bytes() as f64 * scene.frames() as f64 / few.blind.frame_count as f64,
        truth_image_bytes: few.truth_image_bytes(0, &scenario.truth_images)? as f64,
    })
}

/// Seconds to record and learn the background, extrapolated from one and two images per period.
fn background_s(scenario: &Scenario, scene: &PreparedScene) -> Result<f64, ExperimentError> {
    let observation = &scenario.observation;
    if observation.silhouette != SilhouetteSource::Segmented {
        return Ok(0.0);
    }
    let learn = |background_frames| {
        let mut observation = observation.clone();
        observation.images.background_frames = background_frames;
        let (learned, seconds) = timed(|| observer(&scene.ground_truth, &scene.rig, &observation).map(drop));
        learned.map(|()| seconds)
    };
    let (one, two) = (learn(1)?, learn(2)?);
    let more = f64::from(observation.images.background_frames.saturating_sub(1));
    Ok(one + more * (two - one).max(0.0))
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begin = Instant::now();
    let made = work();
    (made, begin.elapsed().as_secs_f64())
}

fn set_of(scenario: &Scenario, scene: &PreparedScene, count: usize) -> Result<BenchmarkSet, ExperimentError> {
    let count = count.min(scene.frames());
    let whole = &scene.ground_truth;
    let ground_truth = GroundTruth {
        actor: whole.actor.clone(),
        props: whole.props.clone(),
        distractors: whole.distractors.clone(),
        frames_per_second: whole.frames_per_second,
        frames: whole.frames[..count].to_vec(),
    };
    let refitted = Motion { poses: scene.refitted.poses[..count].to_vec(), ..scene.refitted };
    let mut observation = scenario.observation.clone();
    let is_told = observation.corruption.changes_cameras() || observation.keypoints.is_some();
    let facts = is_told.then(|| observation.facts());
    let parts = SetParts {
        name: &scenario.name,
        rig: &scene.rig,
        start: &scene.start,
        ground_truth: &ground_truth,
        refitted: Some(&refitted),
        facts: &scene.facts,
        recordings: &scene.sources,
        observation: facts.as_ref(),
        key: scene.key,
    };
    // the sample need not segment well, and learning the whole background would take longer than the sample
    observation.images.background_frames = observation.images.background_frames.min(2);
    let observer = observer(&ground_truth, &scene.rig, &observation)?;
    Ok(BenchmarkSet::assemble(&parts, |frame| observer.observe(frame))?)
}

/// Speed of a filter: fixed time per frame, with its refinement, and time per evaluation; seconds.
#[derive(Clone, Copy)]
struct Speed {
    frame_s: f64,
    evaluation_s: f64,
}

impl Speed {
    /// Measures by tracking two frames with few particles, then with more, within the time limit.
    fn new(two: &BenchmarkSet, work: SearchSettings, evaluations: u64) -> Result<Self, ExperimentError> {
        let seconds = |particles: usize| -> Result<f64, ExperimentError> {
            let filter = FilterSettings { particles, layers: 1, ..work.filter };
            let settings = AnnealedParticleFilterSettings::from_search(&SearchSettings { filter, ..work });
            let settings = TrackerSettings::AnnealedParticleFilter(settings);
            let tracked = track(&two.blind, &settings, &[0], None, &mut Models::default(), &NoProgress)?;
            let seconds = tracked.record.map_or(0.0, |record| record.timing.seconds);
            Ok(seconds / two.blind.frame_count as f64)
        };
        let most = usize::try_from(evaluations).unwrap_or(usize::MAX);
        let few = FEW_PARTICLES.min(most);
        let few_s = seconds(few)?;
        if few == most {
            return Ok(Self { frame_s: few_s, evaluation_s: 0.0 });
        }
        if few_s > SLOW_S {
            return Ok(Self { frame_s: 0.0, evaluation_s: few_s / few as f64 });
        }
        let (mut particles, mut many_s) = (few, few_s);
        while particles < most && many_s < few_s + 0.5 * SAMPLE_S && many_s < SLOW_S {
            particles = most.min(4 * particles);
            many_s = seconds(particles)?;
        }
        let evaluation_s = ((many_s - few_s) / (particles - few) as f64).max(0.0);
        Ok(Self { frame_s: (many_s - particles as f64 * evaluation_s).max(0.0), evaluation_s })
    }

    fn seconds(self, evaluations: u64) -> f64 {
        self.frame_s + self.evaluation_s * evaluations as f64
    }
}

fn pixels(scene: &PreparedScene) -> impl Iterator<Item = f64> + Clone + '_ {
    scene.rig.rig().cameras.iter().map(|camera| f64::from(camera.pinhole.width) * f64::from(camera.pinhole.height))
}

/// Peak memory while a set is drawn: the truth twice, files of `in_memory` bytes, tables of the cameras, and an image
/// per thread.
fn render_memory(scenario: &Scenario, scene: &PreparedScene, in_memory: f64) -> f64 {
    let truth = &scene.ground_truth;
    let (links, cameras) = (truth.actor.links.len() as f64, scene.rig.cameras() as f64);
    let frame = 90.0 * links + 30.0 * cameras + 16.0 * truth.actor.degrees_of_freedom.len() as f64 + 600.0;
    let capsules = |solid: &Solid| matches!(solid, Solid::TaperedCapsule(_));
    let all_capsules = truth.actor.links.iter().flat_map(|link| &link.solids).all(capsules);
    let by_rays = !all_capsules || !scenario.prop.is_empty();
    let distorts = scene.rig.rig().cameras.iter().any(|camera| !camera.distortion.is_none());
    let rays = if by_rays || distorts { 16.0 * pixels(scene).sum::<f64>() } else { 0.0 };
    let threads = rayon::current_num_threads() as f64;
    let largest = pixels(scene).fold(0.0, f64::max);
    let screens = if scenario.prop.is_empty() { 0.0 } else { 8.0 * (pixels(scene).sum::<f64>() + threads * largest) };
    let observation = &scenario.observation;
    let segmentation = match observation.silhouette {
        SilhouetteSource::Segmented => {
            memory::needed(scene.rig.rig(), &observation.images, rayon::current_num_threads())
        }
        _ => 0.0,
    };
    segmentation + BASE_MEMORY + 2.0 * frame * scene.frames() as f64 + 1.5 * in_memory + rays + screens
}

fn truth_images_memory(scenario: &Scenario, scene: &PreparedScene) -> f64 {
    let largest = pixels(scene).fold(0.0, f64::max);
    let per_thread = 40.0 * largest;
    let all = per_thread * rayon::current_num_threads() as f64;
    if scenario.truth_images.is_empty() { 0.0 } else { all.min(per_thread.max(TRUTH_IMAGE_MEMORY_BYTES as f64)) }
}

/// Additional memory of tracking and measuring: observed views, particles, and the data kept of every frame.
fn tracking_memory(scenario: &Scenario, scene: &PreparedScene) -> f64 {
    let (frames, seeds) = (scene.frames() as f64, f64::from(scenario.seeds));
    let degrees = scene.start.body.degrees_of_freedom.len() as f64;
    let trackers = scenario.trackers();
    let searches = trackers.iter().filter_map(|(_, tracker)| tracker.kind().search);
    let particles = searches.clone().map(|search| search.filter.particles).max().unwrap_or(0) as f64;
    let layers = searches.map(|search| search.filter.layers).max().unwrap_or(0) as f64;
    let views = 4.0 * pixels(scene).sum::<f64>();
    let kept = frames * (8.0 * degrees + 56.0 * layers + 16.0 * METRICS + 15.0 * 32.0);
    let table = frames * CSV_COLUMNS * CSV_BYTES;
    seeds * (views + particles * (24.0 * degrees + 200.0)) + (seeds + 1.0) * (kept + 2.0 * table)
}

/// Size of `poses.npz`, `search.npz`, `per_frame.csv`, report and contact sheet of all methods.
fn run_bytes(scenario: &Scenario, scene: &PreparedScene) -> f64 {
    let (frames, seeds) = (scene.frames() as f64, f64::from(scenario.seeds));
    let numbers =
        |body: &skiagraph_core::body::Humanoid| (7 + body.degrees_of_freedom.len() + 3 * body.joints.len() + 45) as f64;
    let poses = 8.0 * frames * (seeds * numbers(&scene.start.body) + numbers(&scene.ground_truth.actor));
    let of_tracker = |tracker: &TrackerSettings| {
        let layers = tracker.kind().search.map_or(0.0, |search| search.filter.layers as f64);
        let search = 8.0 * frames * seeds * (2.0 + 6.0 * layers);
        poses + search + frames * seeds * (CSV_COLUMNS + layers) * CSV_BYTES + PAGE_BYTES
    };
    scenario.trackers().iter().map(|(_, tracker)| of_tracker(tracker)).sum()
}
