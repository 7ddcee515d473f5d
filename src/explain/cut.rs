//! Some frames of a set as a set of its own.

use std::ops::RangeInclusive;

use super::player::facts;
use super::swap::assembled;
use crate::common::{ExperimentError, Progress};
use crate::prepare::retargeting::refit;
use skiagraph_core::body::{Calibrated, Humanoid, Pose};
use skiagraph_core::camera::{CameraError, CameraKeyframe, CameraPath, TimedRig};
use skiagraph_core::observation::Observation;
use skiagraph_set::{BenchmarkSet, SetParts, Start};
use skiagraph_truth::observing::KeypointSettings;
use skiagraph_truth::scene::{Distractor, TruthFrame};

/// The nearest frame at or before `frame` for which every camera has an image, so that their order stays the same.
pub(super) fn first_with_images(set: &BenchmarkSet, frame: usize) -> usize {
    let rig = &set.truth.rig;
    let has_all = |frame: &usize| (0..rig.cameras()).all(|camera| rig.has_image(camera, *frame));
    (0..=frame).rev().find(has_all).unwrap_or(0)
}

/// The cameras of a set that begins with this frame of another.
///
/// # Errors
/// [`ExperimentError::Argument`] if none can: keypoints with errors depend on all frames before.
pub(super) fn rig_from(set: &BenchmarkSet, first: usize) -> Result<TimedRig, ExperimentError> {
    let refused = |detail| ExperimentError::Argument { argument: "--worst", detail };
    if first > 0 && facts(set).keypoints.as_ref().is_some_and(KeypointSettings::is_drawn) {
        let detail = "errors of keypoints depend on all frames before, so they cannot be cut out; use --from-start for \
                      sets that begin with the run's first frame";
        return Err(refused(detail.to_owned()));
    }
    let begin_s = first as f64 / set.blind.frames_per_second;
    from_time(&set.truth.rig, begin_s).map_err(|e| refused(format!("the motion of the cameras cannot be cut: {e}")))
}

/// These frames of a set, with its observations. `start` is the body and pose that trackers start with; the set's own
/// start if there is none, for frames from 0 on.
pub(super) fn cut(
    set: &BenchmarkSet,
    frames: RangeInclusive<usize>,
    name: &str,
    start: Option<(&Humanoid, &Pose)>,
    progress: &dyn Progress,
) -> Result<BenchmarkSet, ExperimentError> {
    let first = *frames.start();
    let (blind, truth) = (&set.blind, &set.truth);
    let rig = rig_from(set, first)?;
    let mut ground_truth = truth.ground_truth.clone();
    ground_truth.frames = truth.ground_truth.frames[frames.clone()]
        .iter()
        .enumerate()
        .map(|(index, frame)| TruthFrame { time_s: index as f64 / blind.frames_per_second, ..frame.clone() })
        .collect();
    ground_truth.distractors.iter_mut().for_each(|other| cut_poses(other, frames.clone()));
    let body = start.map_or(&blind.start.body, |(body, _)| body);
    let refitted = if body.is_same_body(&ground_truth.actor) {
        ground_truth.motion()
    } else {
        let markers: Vec<_> = ground_truth.frames.iter().map(|frame| frame.markers).collect();
        refit(body, &markers, blind.frames_per_second)
    };
    let start = match start {
        None => blind.start.clone(),
        Some((body, pose)) => {
            Start { body: body.clone(), pose: pose.clone(), calibrate: Calibrated::Nothing, ..blind.start.clone() }
        }
    };
    let parts = SetParts {
        name,
        rig: &rig,
        start: &start,
        ground_truth: &ground_truth,
        refitted: Some(&refitted),
        facts: &truth.facts,
        recordings: &truth.recordings,
        observation: blind.observation.as_ref(),
        key: truth.key,
    };
    assembled(&parts, progress, |frame| Ok(Observation { frame, ..blind.observation(first + frame)? }))
}

/// Keeps the poses of these frames; a distractor holds its last pose.
fn cut_poses(other: &mut Distractor, frames: RangeInclusive<usize>) {
    let held = other.poses.len().saturating_sub(1);
    other.poses = frames.filter_map(|frame| other.poses.get(frame.min(held)).cloned()).collect();
}

/// The rig from a time on.
fn from_time(rig: &TimedRig, begin_s: f64) -> Result<TimedRig, CameraError> {
    let later = |frame: &CameraKeyframe| CameraKeyframe { time_s: frame.time_s - begin_s, ..*frame };
    let path = |camera: usize| {
        let keyframes = rig.path(camera).map(|path| path.keyframes().iter().map(later).collect());
        keyframes.map(|keyframes| CameraPath::new(&rig.rig().cameras[camera].name, keyframes)).transpose()
    };
    let paths = (0..rig.cameras()).map(path).collect::<Result<_, _>>()?;
    TimedRig::new(rig.rig().clone(), paths, (0..rig.cameras()).map(|camera| *rig.timing(camera)).collect())
}
