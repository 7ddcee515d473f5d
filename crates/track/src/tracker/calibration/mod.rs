//! Calibration of the tracker's body: lengths, girths, places of joints and one inflation of all radii, solved together
//! with the poses of the first frames on the outlines that were observed. The outline of a body with a skin is the
//! skin's, which follows the shape as that of a population's people does.
//!
//! Only what a tracker has is used: its body, the cameras, observations, and its own first answers. The shape is solved
//! on the first frames, and judged on later ones that were held back ([`CalibrationVerdict`]): a shape that only
//! explains the frames it was solved on is not used, and a correct body stays as it is.

mod importance;
mod shape;
mod solve;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub(super) use self::importance::OutlineImportance;
use self::shape::ShapeModel;
use self::solve::{CalibrationProblem, CalibrationSolution};
use super::descent::length_px;
use super::{Likelihood, SilhouetteLikelihood, SilhouetteSettings, TrackError};
use crate::body::{Humanoid, Pose, ProposalScales};
use crate::camera::{Camera, CameraRig};
use crate::motion_model::SettingError;
use crate::observation::Observation;

/// How many frames are looked at; the last third of them is held back.
pub const CALIBRATION_FRAMES: usize = 30;
/// How far apart they are, seconds: every fourth frame of a video of 60 Hz.
pub const CALIBRATION_SPACING_S: f64 = 1.0 / 15.0;
/// With fewer frames the body is not calibrated: neighbouring poses cannot tell a limb's length from its angles.
const FEWEST_FRAMES: usize = 6;
/// By which factor the energy in the frames that were held back must fall for a calibrated body to be used.
const GAIN: f64 = 0.9;
/// How far a pose is held to the one that was tracked: squared lengths of the residuals times the spread of a human's
/// motion between frames of 60 Hz.
const PULL: f64 = 0.005;
const PULL_RATE_HZ: f64 = 60.0;
/// A length of the residuals, per cent of an image's height.
const PERCENT_OF_HEIGHT: f64 = 100.0 / 240.0;

/// Why a calibrated body is used or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CalibrationVerdict {
    /// Its silhouettes and outlines fit better in the frames that were held back.
    Kept,
    /// They do not: as for a body that is right.
    NoBetter,
    /// Fewer than two cameras see an outline: one cannot tell size from distance.
    TooFewViews,
    /// There are too few frames to solve a shape and to check it on others.
    TooFewFrames,
}

/// What a calibration found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationReport {
    /// Whether the calibrated body is used, and why.
    pub verdict: CalibrationVerdict,
    /// Frames on which the shape was solved.
    pub frames: usize,
    /// Later frames, on which it was judged; 0 in runs of older versions, which judged it on the same frames.
    #[serde(default)]
    pub held_back: usize,
    /// Mean weighted square of the residuals in the frames that were held back, with the body as given and with the
    /// calibrated one, squared lengths (1/240 of an image's height); `None` if the body was not calibrated.
    pub cost: Option<[f64; 2]>,
    /// Mean energy in these frames with the body as given and with the calibrated one, each in its best poses.
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
/// time. The last third of them only judges the result.
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
    let as_given = |report| BodyCalibration { body: body.clone(), start: first.1.clone(), report };
    if seeing < 2 {
        return Ok(as_given(CalibrationReport::not_calibrated(CalibrationVerdict::TooFewViews)));
    }
    if seen.len() < FEWEST_FRAMES {
        return Ok(as_given(CalibrationReport::not_calibrated(CalibrationVerdict::TooFewFrames)));
    }
    let model = ShapeModel::new(body);
    let ideal = CameraRig { cameras: likelihood()?.cameras().cloned().collect() };
    let importance = OutlineImportance::new(body);
    let outline_noise = outline_noise(&ideal);
    let precision: Vec<f64> =
        ProposalScales::for_human(body, PULL_RATE_HZ).in_step_order().iter().map(|d| PULL / (d * d)).collect();
    let (solved_on, held_back) = seen.split_at(seen.len() - seen.len() / 3);
    let mut observed = observed.into_iter();
    let mut problem = |frames: &[(Observation, Pose)]| CalibrationProblem {
        model: &model,
        cameras: frames.iter().map(|(observation, _)| observation.rig(&ideal).into_owned().cameras).collect(),
        importance: &importance,
        observed: observed.by_ref().take(frames.len()).collect(),
        tracked: frames.iter().map(|(_, pose)| pose.clone()).collect(),
        outline_noise,
        precision: &precision,
    };
    let found = problem(solved_on).solve();
    let calibrated = model.shaped(&found.values);
    let judged = problem(held_back);
    let (before, after) = (judged.solve_poses(&vec![0.0; found.values.len()]), judged.solve_poses(&found.values));
    let energy = [
        mean_energy(body, rig, settings, held_back, &before)?,
        mean_energy(&calibrated, rig, settings, held_back, &after)?,
    ];
    let verdict = verdict([before.cost, after.cost], energy);
    let of = |shares: bool| {
        let both = model.numbers.iter().zip(&found.values).filter(|(number, _)| number.is_share() == shares);
        both.map(|(number, value)| (number.name.clone(), *value)).collect()
    };
    let report = CalibrationReport {
        verdict,
        frames: solved_on.len(),
        held_back: held_back.len(),
        cost: Some([before.cost, after.cost]).filter(|cost| cost.iter().all(|cost| cost.is_finite())),
        energy: Some(energy),
        shares: of(true),
        metres: of(false),
    };
    Ok(match (verdict, found.poses.into_iter().next()) {
        (CalibrationVerdict::Kept, Some(start)) => BodyCalibration { body: calibrated, start, report },
        _ => as_given(report),
    })
}

/// Variance of the outlines' noise, as a multiple of that in images of 480 rows: an outline is known to a fraction of a
/// pixel, while residuals are measured in shares of an image's height. In finer images other errors dominate. With four
/// views of 120, 240 and 480 rows the error fell from 10.3 to 7.6, from 7.7 to 6.6 and stayed at 4.8 mm.
fn outline_noise(rig: &CameraRig) -> f64 {
    let fine_px = 2.0;
    let of_view = |camera: &Camera| (fine_px / length_px(camera)).powi(2).max(1.0);
    rig.cameras.iter().map(of_view).sum::<f64>() / rig.cameras.len() as f64
}

/// The decision; costs and energies with the body as given and with the calibrated one.
fn verdict(cost: [f64; 2], energy: [f64; 2]) -> CalibrationVerdict {
    if cost[1] < cost[0] && energy[1] < GAIN * energy[0] {
        CalibrationVerdict::Kept
    } else {
        CalibrationVerdict::NoBetter
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
    fn not_calibrated(verdict: CalibrationVerdict) -> Self {
        let (shares, metres) = (Vec::new(), Vec::new());
        Self { verdict, frames: 0, held_back: 0, cost: None, energy: None, shares, metres }
    }

    /// What was decided and why, in a sentence.
    pub fn describe(&self) -> String {
        let decision = match self.verdict {
            CalibrationVerdict::Kept => "the calibrated body is used, because it fits better",
            CalibrationVerdict::NoBetter => {
                "the body is used as given, because the calibrated one does not fit clearly better"
            }
            CalibrationVerdict::TooFewViews => {
                "the body is used as given: fewer than two cameras see an outline, and one camera cannot tell size from distance"
            }
            CalibrationVerdict::TooFewFrames => {
                "the body is used as given: a calibration needs a third of a second of video to solve a shape and to check it"
            }
        };
        let where_judged = match self.held_back {
            0 => String::new(),
            held_back => format!(" in {held_back} frames held back from the calibration"),
        };
        let costs = self.cost.map(|[before, after]| {
            format!(
                "its outlines are off by {:.2} % of the image's height, those of the body as given by {:.2} %",
                after.sqrt() * PERCENT_OF_HEIGHT,
                before.sqrt() * PERCENT_OF_HEIGHT
            )
        });
        let energies = self.energy.map(|[before, after]| format!("energy {after:.4} and {before:.4}"));
        let measured: Vec<String> = costs.into_iter().chain(energies).collect();
        let measured = if measured.is_empty() { String::new() } else { format!(" ({})", measured.join("; ")) };
        format!("{decision}{where_judged}{measured}")
    }

    /// Every number that was found with its unit: lengths and girths in per cent, places in millimetres.
    pub fn describe_numbers(&self) -> Vec<(String, String)> {
        let shares = self.shares.iter().map(|(name, share)| (name.clone(), format!("{:+.1} %", 100.0 * share)));
        let metres = self.metres.iter().map(|(name, metres)| (name.clone(), format!("{:+.1} mm", 1000.0 * metres)));
        shares.chain(metres).collect()
    }
}
