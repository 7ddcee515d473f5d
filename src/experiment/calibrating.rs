//! Calibrates the tracker's body of a set, from its blind side alone, by what a tracker answers in the first frames.

use super::ExperimentError;
use super::progress::{Progress, advance};
use crate::benchmark_set::BlindSet;
use crate::body::{Humanoid, Pose};
use crate::tracker::{
    BodyCalibration, CALIBRATION_FRAMES, CALIBRATION_SPACING_S, CalibrationVerdict, SilhouetteSettings, Tracker,
    calibrate,
};

/// The numbers of the frames of a set that a calibration looks at.
pub(super) fn frames(set: &BlindSet) -> Vec<usize> {
    let every = (set.frames_per_second * CALIBRATION_SPACING_S).round().max(1.0) as usize;
    (0..set.frame_count).step_by(every).take(CALIBRATION_FRAMES).collect()
}

/// Tracks the first frames of a set with a tracker that has started, and calibrates its body on them.
pub(super) fn calibrated(
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
    Ok(calibrate(&set.start.body, &set.rig, settings, &seen)?)
}

/// With which body and from which pose a tracker begins.
pub(super) struct Beginning {
    pub(super) body: Humanoid,
    pub(super) pose: Pose,
    /// Whether the body was calibrated, and kept.
    pub(super) is_calibrated: bool,
}

impl Beginning {
    /// As the set says.
    pub(super) fn from_set(set: &BlindSet) -> Self {
        Self { body: set.start.body.clone(), pose: set.start.pose.clone(), is_calibrated: false }
    }

    /// With the body that was found where it was kept, else as the set says.
    pub(super) fn from_calibration(set: &BlindSet, calibration: &BodyCalibration) -> Self {
        if calibration.report.verdict == CalibrationVerdict::Kept {
            Self { body: calibration.body.clone(), pose: calibration.start.clone(), is_calibrated: true }
        } else {
            Self::from_set(set)
        }
    }
}
