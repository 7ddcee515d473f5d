//! Calibrates the tracker's body from a set's blind side and a tracker's estimates of the first frames.

use crate::common::{ExperimentError, Progress, advance};
use crate::scenario::{AnnealedParticleFilterSettings, EvidenceSource, TrackerSettings};
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_set::{BlindSet, Start};
use skiagraph_track::tracker::{
    BodyCalibration, CALIBRATION_FRAMES, CALIBRATION_SPACING_S, CalibrationReport, CalibrationTask, CalibrationVerdict,
    CameraCorrection, MIN_CALIBRATION_FRAMES, SilhouetteSettings, Tracker, calibrate,
};
use skiagraph_truth::observing::ObservationFacts;

/// The frames of a set that a calibration uses; the first alone if they cannot determine a shape, so that they are not
/// tracked for nothing.
fn frames(set: &BlindSet) -> Vec<usize> {
    usable_frames(set.rig.cameras.len(), set.frame_count, set.frames_per_second)
}

/// Number of frames that are tracked for a calibration, before all frames are tracked.
pub(crate) fn tracked_frames(cameras: usize, frame_count: usize, frames_per_second: f64) -> usize {
    usable_frames(cameras, frame_count, frames_per_second).last().map_or(0, |last| last + 1)
}

/// The settings of a tracker that calibrates its body: a particle filter that uses silhouettes.
pub(crate) fn calibrated(settings: &TrackerSettings) -> Option<&AnnealedParticleFilterSettings> {
    match settings {
        TrackerSettings::AnnealedParticleFilter(filter) if filter.evidence != EvidenceSource::Keypoints => Some(filter),
        _ => None,
    }
}

fn usable_frames(cameras: usize, frame_count: usize, frames_per_second: f64) -> Vec<usize> {
    let mut frames = frames_of(frame_count, frames_per_second);
    // one camera calibrates the body in the start pose alone
    if obstacle(cameras, frame_count, frames_per_second).is_some() {
        frames.truncate(1);
    }
    frames
}

fn frames_of(frame_count: usize, frames_per_second: f64) -> Vec<usize> {
    let every = (frames_per_second * CALIBRATION_SPACING_S).round().max(1.0) as usize;
    (0..frame_count).step_by(every).take(CALIBRATION_FRAMES).collect()
}

/// Why a body cannot be calibrated with this number of cameras and frames; `None` if it can.
pub(crate) fn obstacle(cameras: usize, frame_count: usize, frames_per_second: f64) -> Option<String> {
    if cameras < 2 {
        return Some("one camera cannot tell size from distance".to_owned());
    }
    let found = frames_of(frame_count, frames_per_second).len();
    (found < MIN_CALIBRATION_FRAMES).then(|| {
        format!(
            "expected at least {MIN_CALIBRATION_FRAMES} frames that are 1/15 s apart, found {found} in {:.2} s",
            frame_count as f64 / frames_per_second
        )
    })
}

/// Tracks the first frames of a set with a started tracker, and calibrates its body on them.
pub(super) fn calibrate_body(
    set: &BlindSet,
    settings: SilhouetteSettings,
    tracker: &mut dyn Tracker,
    progress: &dyn Progress,
) -> Result<BodyCalibration, ExperimentError> {
    let frames = frames(set);
    let mut seen = Vec::with_capacity(frames.len());
    for frame in 0..=frames.last().copied().unwrap_or(0) {
        let observation = set.observation(frame)?;
        let pose = tracker.track(&observation)?.pose;
        if frames.contains(&frame) {
            seen.push((observation, pose));
        }
        advance(progress)?;
    }
    let Start { body, pose, calibrate: what, has_known_stature, .. } = &set.start;
    // the start of a recording is guessed
    let has_known_start = !set.observation.as_ref().is_some_and(ObservationFacts::is_footage);
    let task = CalibrationTask { what: *what, has_known_stature: *has_known_stature, has_known_start };
    Ok(calibrate(body, &set.rig, settings, task, pose, &seen)?)
}

pub(crate) struct Beginning {
    pub(crate) body: Humanoid,
    pub(crate) pose: Pose,
    /// Corrections of the cameras' poses, one per camera; empty if the given poses are used.
    pub(crate) cameras: Vec<CameraCorrection>,
    pub(crate) is_calibrated: bool,
}

impl Beginning {
    pub(crate) fn from_set(set: &BlindSet) -> Self {
        let (body, pose) = (set.start.body.clone(), set.start.pose.clone());
        Self { body, pose, cameras: Vec::new(), is_calibrated: false }
    }

    /// The body and the cameras of a run's seed whose calibration was kept.
    pub(crate) fn from_run(set: &BlindSet, body: &Humanoid, report: &CalibrationReport) -> Self {
        let (body, pose) = (body.clone(), set.start.pose.clone());
        Self { body, pose, cameras: report.cameras.clone(), is_calibrated: true }
    }

    /// The calibrated body and its start pose if it was kept, else those of the set.
    pub(super) fn from_calibration(set: &BlindSet, calibration: &BodyCalibration) -> Self {
        if calibration.report.verdict == CalibrationVerdict::Kept {
            let BodyCalibration { body, start, report } = calibration.clone();
            Self { body, pose: start, cameras: report.cameras, is_calibrated: true }
        } else {
            Self::from_set(set)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_camera_and_short_videos_are_obstacles() {
        assert_eq!(obstacle(4, 21, 60.0), None);
        let short = "expected at least 6 frames that are 1/15 s apart, found 5 in 0.33 s";
        assert_eq!(obstacle(4, 20, 60.0).as_deref(), Some(short));
        assert_eq!(obstacle(1, 300, 60.0).as_deref(), Some("one camera cannot tell size from distance"));
    }

    #[test]
    fn frames_that_cannot_determine_a_shape_are_not_tracked() {
        assert_eq!(usable_frames(4, 301, 60.0).len(), CALIBRATION_FRAMES);
        assert_eq!(usable_frames(1, 301, 60.0), [0]);
        assert_eq!(usable_frames(4, 20, 60.0), [0]);
        assert_eq!(
            [tracked_frames(4, 301, 60.0), tracked_frames(4, 31, 60.0), tracked_frames(1, 301, 60.0)],
            [117, 29, 1]
        );
    }
}
