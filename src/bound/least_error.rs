//! `skiagraph bound`: what a rig can tell about a motion, whatever the tracker.

use std::path::Path;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::noise::{DetectedPoints, describe_keypoints, keypoints, notes, outline_noise};
use super::scene::BoundScene;
use super::unseen::{FrameDirections, UnseenDirection, unseen};
use crate::common::{ExperimentError, Progress, Stage};
use crate::measure::{RUN_FILE, RunRecord};
use crate::runs::reading::read_record;
use skiagraph_core::body::{LANDMARKS, MarkerCovariances};
use skiagraph_core::parallel;
use skiagraph_track::tracker::{InformedBody, OutlineNoise, covariance, filtered, mean_length};

#[derive(Clone, Copy, Debug)]
pub struct BoundOptions<'a> {
    /// Standard deviation and correlation length of the outlines, pixels; by default those of the observations.
    pub outline_px: Option<[f64; 2]>,
    /// Only every Nth frame is computed.
    pub every: usize,
    /// A measured run whose error is compared with the bound.
    pub run: Option<&'a Path>,
}

/// The least error that any unbiased tracker can have: `bound.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoundReport {
    /// `skiagraph.bound/1`.
    pub schema: String,
    pub name: String,
    pub frames: usize,
    pub frames_per_second: f64,
    pub cameras: Vec<String>,
    /// One per kind of observation.
    pub sources: Vec<SourceBound>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub run: Option<ComparedRun>,
    pub notes: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SourceBound {
    /// `silhouettes`, `keypoints` or `both`.
    pub source: &'static str,
    pub noise: String,
    /// Mean over markers and the computed frames after frame 0, whose pose is given.
    #[serde(flatten)]
    pub mean: ErrorBound,
    /// Means of every marker over the same frames.
    pub joints: Vec<JointBound>,
    /// What the cameras cannot see, without prior.
    pub unseen: Vec<UnseenDirection>,
    pub per_frame: Vec<FrameBound>,
}

/// Least mean distance of an estimated marker from the true one, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorBound {
    /// From the cameras' images of the frame alone.
    pub alone_mm: f64,
    /// For a filter that knows the start pose and the spread of the motion, and has seen all earlier frames.
    pub filtered_mm: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointBound {
    pub joint: String,
    #[serde(flatten)]
    pub bound: ErrorBound,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrameBound {
    /// The frame, from 0.
    pub frame: usize,
    #[serde(flatten)]
    pub mean: ErrorBound,
    /// The marker with the greatest bound of the frame alone.
    pub worst_joint: String,
    pub worst_alone_mm: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedRun {
    pub tracker: String,
    /// HumanEva's error, mean over seeds, mm.
    pub error_mm: f64,
    /// For every source: error over the bound of the frame alone, and over that of a filter.
    pub times_the_bound: Vec<[f64; 2]>,
}

type FrameInformation = Vec<DMatrix<f64>>;

/// Computes the bounds of a scene.
///
/// # Errors
/// [`ExperimentError`] if no camera sees the body, the body has nothing to see, or the run does not fit the set.
pub fn bound(
    scene: &BoundScene,
    options: BoundOptions<'_>,
    progress: &dyn Progress,
) -> Result<BoundReport, ExperimentError> {
    let run = options.run.map(|run| Ok::<_, ExperimentError>((run, read_record(&run.join(RUN_FILE))?))).transpose()?;
    let informed = InformedBody::new(&scene.body);
    if !informed.is_visible() {
        let detail = format!("{} has no solid and no skin, so no silhouette shows a limb of it", scene.body.name);
        return Err(ExperimentError::Argument { argument: "SCENARIO", detail });
    }
    let rig = scene.rig.rig();
    let (noise, noise_words) = outline_noise(&scene.observation, options.outline_px);
    let points = keypoints(scene);
    let mut notes = notes(scene);
    let frames: Vec<usize> = (0..scene.motion.poses.len()).step_by(options.every.max(1)).collect();
    if frames.len() < 2 {
        let detail = format!("expected at least two of the {} frames: choose less than that", scene.motion.poses.len());
        return Err(ExperimentError::Argument { argument: "--every", detail });
    }
    progress.begin(Stage::Evaluate, frames.len());
    let informations: Vec<Option<FrameInformation>> = parallel::map(frames.len(), |index| {
        if progress.interrupted() {
            return None;
        }
        let found = information(scene, &informed, frames[index], noise, points.as_ref());
        progress.advance();
        Some(found)
    });
    let informations: Vec<FrameInformation> =
        informations.into_iter().collect::<Option<_>>().ok_or(ExperimentError::Interrupted)?;
    let blind = informations.iter().filter(|found| found[0].iter().all(|value| *value == 0.0)).count();
    if blind == frames.len() {
        let detail = format!("no camera sees {} in any frame; move the cameras or look_at_m", scene.body.name);
        return Err(ExperimentError::Argument { argument: "SCENARIO", detail });
    }
    if blind > 0 {
        notes.push(format!("no camera sees the body in {blind} of {} frames", frames.len()));
    }
    let scales = scene.scales()?;
    let mut kinds = vec![("silhouettes", noise_words)];
    if let Some(points) = &points {
        kinds.push(("keypoints", describe_keypoints(&points.settings)));
        kinds.push(("both", "as above".to_owned()));
    }
    let mut sources = Vec::new();
    for (kind, (source, noise)) in kinds.into_iter().enumerate() {
        let of_kind: Vec<&DMatrix<f64>> = informations.iter().filter_map(|found| found.get(kind)).collect();
        sources.push(source_bound(scene, &informed, source, noise, &frames, &of_kind, &scales)?);
    }
    let mut report = BoundReport {
        schema: "skiagraph.bound/1".to_owned(),
        name: scene.name.clone(),
        frames: scene.motion.poses.len(),
        frames_per_second: scene.motion.frames_per_second,
        cameras: rig.cameras.iter().map(|camera| camera.name.clone()).collect(),
        sources,
        run: None,
        notes,
    };
    if let Some((path, record)) = run {
        compare(scene, &mut report, path, record)?;
    }
    Ok(report)
}

/// Information of the silhouettes, and of keypoints and of both if there are any.
fn information(
    scene: &BoundScene,
    informed: &InformedBody<'_>,
    frame: usize,
    noise: OutlineNoise,
    points: Option<&DetectedPoints>,
) -> FrameInformation {
    let Some(pose) = scene.motion.poses.get(frame) else { return Vec::new() };
    let links = scene.body.link_frames(pose);
    let rig = scene.rig.rig_at(frame as f64 / scene.motion.frames_per_second);
    let seeing = || rig.cameras.iter().enumerate().filter(|(index, _)| scene.rig.has_image(*index, frame));
    let nothing = || DMatrix::zeros(scene.body.step_len(), scene.body.step_len());
    let outlines = seeing().fold(nothing(), |sum, (_, camera)| sum + informed.of_silhouette(&links, camera, noise));
    let Some(DetectedPoints { places, deviations, settings }) = points else { return vec![outlines] };
    // a point of the wrong side tells as much to whoever notices the exchange
    let seen = (1.0 - settings.gross) * (1.0 - settings.missing);
    let percent = settings.white_percent.hypot(settings.slow_percent) / seen.max(1e-6).sqrt();
    let found = seeing().fold(nothing(), |sum, (_, camera)| {
        sum + informed.of_keypoints(&links, camera, places, |index, height| 0.01 * percent * deviations[index] * height)
    });
    let both = &outlines + &found;
    vec![outlines, found, both]
}

fn source_bound(
    scene: &BoundScene,
    informed: &InformedBody<'_>,
    source: &'static str,
    noise: String,
    frames: &[usize],
    informations: &[&DMatrix<f64>],
    scales: &[f64],
) -> Result<SourceBound, ExperimentError> {
    let ignorance = informed.ignorance();
    let singular =
        || ExperimentError::Argument { argument: "SCENARIO", detail: "the information is singular".to_owned() };
    let alone = parallel::map(frames.len(), |index| covariance(informations[index], &ignorance));
    let alone: Vec<DMatrix<f64>> = alone.into_iter().collect::<Option<_>>().ok_or_else(singular)?;
    let in_time = over_time(scene, frames, informations, scales).ok_or_else(singular)?;
    let (mut per_frame, mut directions) = (Vec::new(), Vec::new());
    let mut sums = vec![(ErrorBound::default(), 0.0); LANDMARKS.len()];
    for ((frame, alone), filtered) in frames.iter().zip(&alone).zip(&in_time) {
        let Some(pose) = scene.motion.poses.get(*frame) else { continue };
        let links = scene.body.link_frames(pose);
        let covariances = scene.body.marker_covariances(&links, alone);
        let [own, of_filter] = [lengths_mm(&covariances), lengths_mm(&scene.body.marker_covariances(&links, filtered))];
        // the pose of frame 0 is given, and no error of a run counts it
        for (index, (sum, count)) in sums.iter_mut().enumerate().filter(|_| *frame > 0) {
            if let (Some(alone), Some(filtered)) = (own[index], of_filter[index]) {
                sum.alone_mm += alone;
                sum.filtered_mm += filtered;
                *count += 1.0;
            }
        }
        let markers = LANDMARKS.iter().zip(&own).filter_map(|(marker, value)| Some((marker, (*value)?)));
        let Some((worst, worst_mm)) = markers.max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
        per_frame.push(FrameBound {
            frame: *frame,
            mean: ErrorBound { alone_mm: mean_of(&own), filtered_mm: mean_of(&of_filter) },
            worst_joint: worst.name().to_owned(),
            worst_alone_mm: worst_mm,
        });
        let rig = scene.rig.rig_at(*frame as f64 / scene.motion.frames_per_second);
        directions.push(FrameDirections::new(&scene.body, &links, &rig, alone, &covariances));
    }
    let joint = |(marker, (sum, count)): (&skiagraph_core::body::Landmark, &(ErrorBound, f64))| JointBound {
        joint: marker.name().to_owned(),
        bound: ErrorBound { alone_mm: sum.alone_mm / count, filtered_mm: sum.filtered_mm / count },
    };
    let is_known = |found: &(&skiagraph_core::body::Landmark, &(ErrorBound, f64))| found.1.1 > 0.0;
    let joints: Vec<JointBound> = LANDMARKS.iter().zip(&sums).filter(is_known).map(joint).collect();
    let over = |value: fn(&ErrorBound) -> f64| {
        joints.iter().map(|joint| value(&joint.bound)).sum::<f64>() / joints.len().max(1) as f64
    };
    let mean = ErrorBound { alone_mm: over(|bound| bound.alone_mm), filtered_mm: over(|bound| bound.filtered_mm) };
    Ok(SourceBound { source, noise, mean, joints, unseen: unseen(&directions, frames), per_frame })
}

/// The covariances of a filter in the computed frames; frames between them tell as much as the last computed one.
fn over_time(
    scene: &BoundScene,
    frames: &[usize],
    informations: &[&DMatrix<f64>],
    scales: &[f64],
) -> Option<Vec<DMatrix<f64>>> {
    let numbers = scene.body.step_len();
    // the start is known to a hundredth of a usual change, which keeps the matrix regular
    let start = DVector::from_iterator(numbers, scales.iter().map(|scale| 1e-4 * scale * scale));
    let (mut now, mut all) = (DMatrix::from_diagonal(&start), Vec::new());
    for (index, information) in informations.iter().enumerate() {
        let steps = match index {
            0 => 0,
            index => frames[index] - frames[index - 1],
        };
        for _ in 0..steps {
            now = filtered(&now, scales, information)?;
        }
        all.push(now.clone());
    }
    Some(all)
}

fn lengths_mm(covariances: &MarkerCovariances) -> Vec<Option<f64>> {
    covariances.iter().map(|of_marker| of_marker.map(|covariance| 1000.0 * mean_length(&covariance))).collect()
}

fn mean_of(values: &[Option<f64>]) -> f64 {
    let known = values.iter().flatten();
    known.clone().sum::<f64>() / known.count().max(1) as f64
}

fn compare(scene: &BoundScene, report: &mut BoundReport, run: &Path, record: RunRecord) -> Result<(), ExperimentError> {
    if let Some(hash) = scene.set_hash.as_ref().filter(|hash| **hash != record.set_hash) {
        let detail =
            format!("{} is a run on another set (hash {:.12}, not {hash:.12})", run.display(), record.set_hash);
        return Err(ExperimentError::Argument { argument: "--run", detail });
    }
    let length = [scene.motion.poses.len(), record.frames];
    if scene.set_hash.is_none() && (length[0] != length[1] || scene.name != record.scenario) {
        let detail = format!(
            "{} is a run of {} with {} frames, the scene is {} with {}; give the run's own set instead of a scenario",
            run.display(),
            record.scenario,
            length[1],
            scene.name,
            length[0]
        );
        return Err(ExperimentError::Argument { argument: "--run", detail });
    }
    let cameras = [scene.rig.cameras(), record.summary.per_camera.len()];
    if cameras[1] > 0 && cameras[0] != cameras[1] {
        let detail = format!("{} is a run with {} cameras, the scene has {}", run.display(), cameras[1], cameras[0]);
        return Err(ExperimentError::Argument { argument: "--run", detail });
    }
    let Some(error) = record.summary.metrics.get("humaneva_mm") else {
        let detail = format!("{} has no humaneva_mm", run.display());
        return Err(ExperimentError::Argument { argument: "--run", detail });
    };
    let times = |source: &SourceBound| [error.mean / source.mean.alone_mm, error.mean / source.mean.filtered_mm];
    if !record.matched {
        report.notes.push("the run's error includes that of its body, which is not the actor's".to_owned());
    }
    report.run = Some(ComparedRun {
        tracker: record.tracker,
        error_mm: error.mean,
        times_the_bound: report.sources.iter().map(times).collect(),
    });
    Ok(())
}
