//! Calibration of the tracker's body: lengths, girths, places of joints and one inflation of all radii, solved together
//! with the poses of the first frames on the outlines that were observed. The outline of a body with a skin is the
//! skin's, which follows the shape as that of a population's people does.
//!
//! Nothing but what a tracker has is used: its body, the cameras, observations, and its own first answers. A gate
//! decides whether the body that was found is kept ([`CalibrationVerdict`]): without that decision calibration would
//! make a correct body worse.

mod importance;
mod shape;
mod solve;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub(super) use self::importance::OutlineImportance;
use self::shape::ShapeModel;
use self::solve::{CalibrationProblem, CalibrationSolution};
use super::{Likelihood, SilhouetteLikelihood, SilhouetteSettings, TrackError};
use crate::body::{Humanoid, Pose, ProposalScales};
use crate::camera::CameraRig;
use crate::motion_model::SettingError;
use crate::observation::Observation;

/// How many frames are looked at.
pub const CALIBRATION_FRAMES: usize = 20;
/// How far apart they are, seconds: every fourth frame of a video of 60 Hz.
pub const CALIBRATION_SPACING_S: f64 = 1.0 / 15.0;
/// By which factor the energy must fall for a calibrated body to be kept. Right bodies gain nothing: on 16_15, 14_24
/// and 16_57 the factor was 1.3 to 1.4 for them, and 0.6 to 0.8 for bodies of other lengths and girths.
const GAIN: f64 = 0.9;
/// How far a pose is held to the one that was tracked: squared lengths of the residuals times the spread of a human's
/// motion between frames of 60 Hz.
const PULL: f64 = 0.005;
const PULL_RATE_HZ: f64 = 60.0;
/// A length of the residuals, per cent of an image's height.
const PERCENT_OF_HEIGHT: f64 = 100.0 / 240.0;

/// Why a calibrated body was kept or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CalibrationVerdict {
    /// The calibrated body's silhouettes and outlines fit better.
    Kept,
    /// They do not: as for a body that is right.
    NoBetter,
    /// Fewer than two cameras see an outline: one cannot tell size from distance.
    TooFewViews,
}

/// What a calibration found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationReport {
    /// Whether the body was kept, and why.
    pub verdict: CalibrationVerdict,
    /// Frames that were looked at.
    pub frames: usize,
    /// Mean weighted square of the residuals with the body as given and with the calibrated one, squared lengths (1/240
    /// of an image's height); `None` where nothing was seen.
    pub cost: Option<[f64; 2]>,
    /// Mean energy with the body as given and with the calibrated one, each in its best poses of these frames.
    pub energy: Option<[f64; 2]>,
    /// What was found, as shares of lengths and girths.
    pub shares: Vec<(String, f64)>,
    /// What was found, metres: places of joints and the inflation of all radii.
    pub metres: Vec<(String, f64)>,
}

/// A calibration of a tracker's body.
#[derive(Clone, Debug)]
pub struct BodyCalibration {
    /// The body to go on with: the calibrated one where it is kept, else the one that was given.
    pub body: Humanoid,
    /// Its pose in the first frame that was looked at.
    pub start: Pose,
    /// What was decided and found.
    pub report: CalibrationReport,
}

/// Why a body cannot be calibrated.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// An observation does not fit the cameras.
    #[error(transparent)]
    Observation(#[from] TrackError),
    /// There is no frame to look at.
    #[error("calibration of the tracker's body: expected at least one frame, found none")]
    NoFrame,
}

/// Calibrates `body` on frames that were `seen` by the cameras of `rig` and in which it was tracked, in the order of
/// time.
///
/// # Errors
/// [`CalibrationError`] without a frame, and where settings or observations make no sense.
pub fn calibrate(
    body: &Humanoid,
    rig: &CameraRig,
    settings: SilhouetteSettings,
    seen: &[(Observation, Pose)],
) -> Result<BodyCalibration, CalibrationError> {
    let first = seen.first().ok_or(CalibrationError::NoFrame)?;
    let likelihood = || SilhouetteLikelihood::new(body.clone(), rig, settings).map(SilhouetteLikelihood::with_descent);
    let observed = seen.iter().map(|(observation, _)| Ok(likelihood()?.into_outlines(observation)?));
    let observed: Vec<Vec<_>> = observed.collect::<Result<_, CalibrationError>>()?;
    let seeing = (0..rig.cameras.len()).filter(|view| observed.iter().any(|frame| frame[*view].is_some())).count();
    let model = ShapeModel::new(body);
    let ideal = CameraRig { cameras: likelihood()?.cameras().cloned().collect() };
    let problem = CalibrationProblem {
        model: &model,
        cameras: seen.iter().map(|(observation, _)| observation.rig(&ideal).into_owned().cameras).collect(),
        importance: OutlineImportance::new(body),
        observed,
        tracked: seen.iter().map(|(_, pose)| pose.clone()).collect(),
        precision: ProposalScales::for_human(body, PULL_RATE_HZ)
            .in_step_order()
            .iter()
            .map(|d| PULL / (d * d))
            .collect(),
    };
    let as_given = |report| BodyCalibration { body: body.clone(), start: first.1.clone(), report };
    if seeing < 2 {
        let report = CalibrationReport {
            verdict: CalibrationVerdict::TooFewViews,
            frames: seen.len(),
            cost: None,
            energy: None,
            shares: Vec::new(),
            metres: Vec::new(),
        };
        return Ok(as_given(report));
    }
    let (held, free) = (problem.solve(false), problem.solve(true));
    let calibrated = model.shaped(&free.values);
    let energy =
        [mean_energy(body, rig, settings, seen, &held)?, mean_energy(&calibrated, rig, settings, seen, &free)?];
    let verdict = verdict([held.cost, free.cost], energy);
    let of = |shares: bool| {
        let both = model.numbers.iter().zip(&free.values).filter(|(number, _)| number.is_share() == shares);
        both.map(|(number, value)| (number.name.clone(), *value)).collect()
    };
    let (shares, metres) = (of(true), of(false));
    let cost = Some([held.cost, free.cost]).filter(|cost| cost.iter().all(|cost| cost.is_finite()));
    let report = CalibrationReport { verdict, frames: seen.len(), cost, energy: Some(energy), shares, metres };
    Ok(match (verdict, free.poses.into_iter().next()) {
        (CalibrationVerdict::Kept, Some(start)) => BodyCalibration { body: calibrated, start, report },
        _ => as_given(report),
    })
}

/// The gate; costs and energies with the body as given and with the calibrated one.
fn verdict(cost: [f64; 2], energy: [f64; 2]) -> CalibrationVerdict {
    match cost[1] < cost[0] && energy[1] < GAIN * energy[0] {
        true => CalibrationVerdict::Kept,
        false => CalibrationVerdict::NoBetter,
    }
}

fn mean_energy(
    body: &Humanoid,
    rig: &CameraRig,
    settings: SilhouetteSettings,
    seen: &[(Observation, Pose)],
    solution: &CalibrationSolution,
) -> Result<f64, CalibrationError> {
    let mut likelihood = SilhouetteLikelihood::new(body.clone(), rig, settings)?;
    let mut sum = 0.0;
    for ((observation, _), pose) in seen.iter().zip(&solution.poses) {
        likelihood.prepare(observation)?;
        sum += likelihood.energy(pose, &mut likelihood.scratch());
    }
    Ok(sum / seen.len() as f64)
}

impl CalibrationReport {
    /// What was decided and why, in a sentence.
    pub fn in_words(&self) -> String {
        let costs = self.cost.map(|[before, after]| {
            format!(
                "outlines are off by {:.2} % of the image's height with the body as given, {:.2} % calibrated",
                before.sqrt() * PERCENT_OF_HEIGHT,
                after.sqrt() * PERCENT_OF_HEIGHT
            )
        });
        let energies = self.energy.map(|[before, after]| format!("energy {before:.4} and {after:.4}"));
        let told: Vec<String> = costs.into_iter().chain(energies).collect();
        let told = if told.is_empty() { String::new() } else { format!(" ({})", told.join("; ")) };
        let decided = match self.verdict {
            CalibrationVerdict::Kept => "the calibrated body is kept: it fits better",
            CalibrationVerdict::NoBetter => {
                "the body as given is kept: calibrated, its silhouettes fit no better, as those of a body that is right"
            }
            CalibrationVerdict::TooFewViews => {
                "the body as given is kept: fewer than two cameras see an outline, and one cannot tell size from distance"
            }
        };
        format!("{decided}{told}")
    }

    /// The numbers that were found, in words: lengths and girths in per cent, places in millimetres.
    pub fn numbers_in_words(&self) -> Vec<(String, String)> {
        let shares = self.shares.iter().map(|(name, share)| (name.clone(), format!("{:+.1} %", 100.0 * share)));
        let metres = self.metres.iter().map(|(name, metres)| (name.clone(), format!("{:+.1} mm", 1000.0 * metres)));
        shares.chain(metres).collect()
    }
}
