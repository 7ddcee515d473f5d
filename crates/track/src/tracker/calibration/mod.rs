//! Calibration of the tracker's body: lengths, girths, joint positions and one inflation of all radii, solved jointly
//! with the poses of the first frames on the observed outlines. The outline of a skinned body is that of its skin,
//! which follows the shape like the skins of a population model.
//!
//! Only the tracker's own data are used: its body, the cameras, the observations, and its first estimates. The shape is
//! solved on the first frames and judged on later, held-out ones ([`CalibrationVerdict`]): a shape that fits only the
//! frames it was solved on is not used, and a correct body stays unchanged. A single camera cannot do that: later
//! frames fit any size, at another distance. There, a known start pose is all that tells, and the shape is judged on
//! that frame itself.

mod cameras;
mod importance;
mod shape;
mod shape_derivatives;
mod solve;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub use self::cameras::CameraCorrection;
use self::cameras::CameraModel;
pub(super) use self::importance::OutlineImportance;
use self::shape::ShapeModel;
use self::solve::{CalibrationProblem, CalibrationSolution};
use super::descent::length_px;
use super::{Likelihood, SilhouetteLikelihood, SilhouetteSettings, TrackError};
use crate::motion_model::SettingError;
use skiagraph_core::body::{Calibrated, Humanoid, Pose, ProposalScales, SilhouettePainter};
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::observation::Observation;
use skiagraph_core::raster::Mask;

/// Number of frames used; the last third is held out.
pub const CALIBRATION_FRAMES: usize = 30;
/// Interval between these frames, seconds: every fourth frame of a 60 Hz video.
pub const CALIBRATION_SPACING_S: f64 = 1.0 / 15.0;
/// Minimum number of frames: poses close in time do not separate a limb's length from its angles.
pub const MIN_CALIBRATION_FRAMES: usize = 6;
/// Maximum ratio of the calibrated body's energy to the given body's on the held-out frames, for the calibrated one to
/// be used.
const MAX_ENERGY_RATIO: f64 = 0.9;
/// Weight of the prior that holds a pose to the tracked one: squared lengths of the residuals times the variance of
/// human motion between frames at 60 Hz.
const POSE_PRIOR_WEIGHT: f64 = 0.005;
const POSE_PRIOR_RATE_HZ: f64 = 60.0;
/// Standard deviations of a start pose that says how large a body is that one camera sees: position, metres, and
/// angles, radians.
const HELD_START_M: f64 = 0.005;
const HELD_START_RAD: f64 = 0.01;
/// Distance, metres, by which the image may contradict such a start: at 5 m, 50 mm are a size that is wrong by 1 %.
const MAX_START_SHIFT_M: f64 = 0.05;
/// A length of the residuals, per cent of the image height.
const PERCENT_OF_HEIGHT: f64 = 100.0 / 240.0;

/// Whether the calibrated body is used, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CalibrationVerdict {
    /// Its silhouettes and outlines fit better on the held-out frames.
    Kept,
    /// They do not, as expected for a correct body.
    NoBetter,
    /// Fewer than two cameras see an outline, and one camera separates size from distance only if the start pose is
    /// known.
    TooFewViews,
    /// There are too few frames to solve a shape and to check it on others.
    TooFewFrames,
}

/// Result of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationReport {
    /// Whether the calibrated body is used, and why.
    pub verdict: CalibrationVerdict,
    /// Frames on which the shape was solved.
    pub frames: usize,
    /// Later frames on which it was judged, without those whose images are all empty; 0 in runs of older versions,
    /// which judged it on the same frames.
    #[serde(default)]
    pub held_back: usize,
    /// Mean weighted squared residual on the held-out frames, with the body as given and with the calibrated one,
    /// squared lengths (a length is 1/240 of the image height); `None` if the body was not calibrated.
    pub cost: Option<[f64; 2]>,
    /// Mean energy on these frames with the body as given and with the calibrated one, each in its best poses; `None`
    /// if the body was not calibrated or no image of these frames shows anything.
    pub energy: Option<[f64; 2]>,
    /// Relative changes of lengths and girths.
    pub shares: Vec<(String, f64)>,
    /// Changes in metres: joint positions and the inflation of all radii.
    pub metres: Vec<(String, f64)>,
    /// What was asked for.
    #[serde(default = "both", skip_serializing_if = "is_both")]
    pub solved: Calibrated,
    /// Corrections of the cameras' poses; empty if the given poses are used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<CameraCorrection>,
    /// Distance, metres, of the body in the first image from the place of its start pose, across the line of sight, if
    /// that pose told the size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_shift_m: Option<f64>,
}

fn both() -> Calibrated {
    Calibrated::Both
}

fn is_both(solved: &Calibrated) -> bool {
    *solved == Calibrated::Both
}

/// A calibration of a tracker's body and of the cameras' poses.
#[derive(Clone, Debug)]
pub struct BodyCalibration {
    /// The body to use: the calibrated one if it was kept, otherwise the given one.
    pub body: Humanoid,
    /// Its pose in the first frame used.
    pub start: Pose,
    /// Verdict and solved values.
    pub report: CalibrationReport,
}

/// What a calibration solves, and what it can rely on.
#[derive(Clone, Copy, Debug)]
pub struct CalibrationTask {
    /// The body, the cameras or both.
    pub what: Calibrated,
    /// Whether the body has the person's stature, which is kept then.
    pub has_known_stature: bool,
    /// Whether the start pose is known to centimetres, as in synthetic sets: it then says where the world is when all
    /// cameras are off. Otherwise the cameras together keep their place, orientation and scale.
    pub has_known_start: bool,
}

/// Why a body cannot be calibrated.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// An observation does not match the cameras.
    #[error(transparent)]
    Observation(#[from] TrackError),
    /// There are no frames.
    #[error("calibration of the tracker's body: expected at least one frame, found none")]
    NoFrame,
}

/// Calibrates `body`, the poses of `rig`'s cameras, or both, on frames `seen`, each with the tracked pose, in temporal
/// order; the first is that of the `start` pose. The last third is held out and only used to judge the result. The
/// given poses of the cameras are kept unless others fit clearly better on these frames. If one camera alone sees an
/// outline, the body is calibrated on the first frame, if its start pose is known.
///
/// # Errors
/// [`CalibrationError`] without frames, or if settings or observations are invalid.
pub fn calibrate(
    body: &Humanoid,
    rig: &CameraRig,
    settings: SilhouetteSettings,
    CalibrationTask { what, has_known_stature, has_known_start }: CalibrationTask,
    start: &Pose,
    seen: &[(Observation, Pose)],
) -> Result<BodyCalibration, CalibrationError> {
    let first = seen.first().ok_or(CalibrationError::NoFrame)?;
    let likelihood = || SilhouetteLikelihood::new(body.clone(), rig, settings).map(SilhouetteLikelihood::with_descent);
    // a likelihood of its own for each frame: it is consumed, because its outlines outlive the frame
    let observed = seen.iter().map(|(observation, _)| Ok(likelihood()?.into_outlines(observation)?));
    let observed: Vec<Vec<_>> = observed.collect::<Result<_, CalibrationError>>()?;
    let sees: Vec<bool> =
        (0..rig.cameras.len()).map(|view| observed.iter().any(|frame| frame[view].is_some())).collect();
    let seeing = sees.iter().filter(|sees| **sees).count();
    let as_given = |report| BodyCalibration { body: body.clone(), start: first.1.clone(), report };
    let by_start = seeing == 1 && has_known_start && what.has_body();
    if seeing < 2 && !by_start {
        return Ok(as_given(CalibrationReport::not_calibrated(CalibrationVerdict::TooFewViews, what)));
    }
    if seen.len() < MIN_CALIBRATION_FRAMES && !by_start {
        return Ok(as_given(CalibrationReport::not_calibrated(CalibrationVerdict::TooFewFrames, what)));
    }
    let model = ShapeModel::new(body);
    let corrections = CameraModel::new(rig, &sees, start.world_from_root.translation.vector.into());
    // masks are rectified, so outlines are compared in cameras without lenses
    let ideal = CameraRig { cameras: likelihood()?.cameras().cloned().collect() };
    let importance = OutlineImportance::new(body);
    let outline_noise = outline_noise(&ideal);
    let precision: Vec<f64> = ProposalScales::for_human(body, POSE_PRIOR_RATE_HZ)
        .in_step_order()
        .iter()
        .map(|d| POSE_PRIOR_WEIGHT / (d * d))
        .collect();
    // The last third in time is held out, not every third frame: neighbours are so alike that a wrong shape fits them
    // too.
    let (solved_on, held_back) = seen.split_at(seen.len() - seen.len() / 3);
    let mut observed = observed.into_iter();
    let mut problem = |frames: &[(Observation, Pose)], start| CalibrationProblem {
        model: &model,
        corrections: &corrections,
        cameras: frames.iter().map(|(observation, _)| observation.rig(&ideal).into_owned().cameras).collect(),
        importance: &importance,
        observed: observed.by_ref().take(frames.len()).collect(),
        tracked: frames.iter().map(|(_, pose)| pose.clone()).collect(),
        start,
        stature_m: body.stature().filter(|_| has_known_stature),
        with_shape: what.has_body(),
        outline_noise,
        precision: &precision,
    };
    if by_start {
        let held: Vec<f64> = (0..body.step_len()).map(held_start_precision).collect();
        let frame = [(first.0.clone(), start.clone())];
        let problem = CalibrationProblem { precision: &held, ..problem(&frame, None) };
        let view = sees.iter().position(|sees| *sees).unwrap_or(0);
        let shift = start_shift(body, start, &rig.cameras[view], &first.0.silhouettes[view]);
        return calibrate_by_start(&problem, start, shift, |body, pose| {
            let mut likelihood = SilhouetteLikelihood::new(body, rig, settings)?;
            Ok(mean_energy(&mut likelihood, &frame, std::slice::from_ref(pose))?.0)
        });
    }
    let (solving, judging) = (problem(solved_on, Some(start).filter(|_| has_known_start)), problem(held_back, None));
    // Every candidate gets its own best poses on the held-out frames: with poses fitted to another shape it would lose.
    let judge = |solved: CalibrationSolution| -> Result<JudgedCalibration, CalibrationError> {
        let refitted = judging.solve_poses(&solved.values);
        let (shaped, cameras) = (model.shaped(&solved.values), judging.corrections_of(&solved.values));
        let mut likelihood = SilhouetteLikelihood::new(shaped, rig, settings)?.with_corrected_cameras(&cameras);
        let (energy, judged_on) = mean_energy(&mut likelihood, held_back, &refitted.poses)?;
        Ok(JudgedCalibration { solved, cost: refitted.cost, energy, judged_on })
    };
    // From few to many free numbers, and each step must pay: cameras are moved only if that fits clearly better than
    // the shape alone, because a wrong shape can be explained by wrong cameras.
    let given = judge(CalibrationSolution { values: solving.as_given(), poses: Vec::new(), cost: f64::NAN })?;
    let as_asked = if what.has_body() { solving.solve() } else { given.solved.clone() };
    let shape = judge(as_asked)?;
    let shape_fits = shape.fits_better_than(&given, MAX_ENERGY_RATIO);
    let both = if what.has_cameras() { Some(judge(solving.solve_with_cameras())?) } else { None };
    let both =
        both.filter(|both| both.fits_better_than(if shape_fits { &shape } else { &given }, max_camera_ratio(seeing)));
    let cameras_fit = both.is_some();
    let chosen = both.unwrap_or(shape);
    let verdict = if shape_fits || cameras_fit { CalibrationVerdict::Kept } else { CalibrationVerdict::NoBetter };
    let values = &chosen.solved.values;
    let (shares, metres) = model.changes(values);
    let report = CalibrationReport {
        verdict,
        frames: solved_on.len(),
        held_back: chosen.judged_on,
        cost: if_finite([given.cost, chosen.cost]),
        energy: if_finite([given.energy, chosen.energy]),
        shares,
        metres,
        solved: what,
        cameras: if cameras_fit { judging.corrections_of(values) } else { Vec::new() },
        start_shift_m: None,
    };
    Ok(match (verdict, chosen.solved.poses.first()) {
        (CalibrationVerdict::Kept, Some(start)) => {
            // the shape of no change equals the given body up to rounding
            let body = if what.has_body() { model.shaped(values) } else { body.clone() };
            BodyCalibration { body, start: start.clone(), report }
        }
        _ => as_given(report),
    })
}

/// Calibrates a body that one camera sees, on the first frame of `problem` alone: only the start pose tells its size
/// from its distance. `shift` is how far, metres, the image shows it beside that pose; `energy` is that of a body in a
/// pose.
fn calibrate_by_start(
    problem: &CalibrationProblem<'_>,
    start: &Pose,
    shift: f64,
    energy: impl Fn(Humanoid, &Pose) -> Result<f64, CalibrationError>,
) -> Result<BodyCalibration, CalibrationError> {
    let (model, solved) = (problem.model, problem.solve());
    let pose = solved.poses.first().unwrap_or(start);
    let energies = [energy(model.shaped(&problem.as_given()), start)?, energy(model.shaped(&solved.values), pose)?];
    let is_start = shift < MAX_START_SHIFT_M;
    let fits = is_start && energies[1] < MAX_ENERGY_RATIO * energies[0];
    let verdict = if fits { CalibrationVerdict::Kept } else { CalibrationVerdict::NoBetter };
    let (shares, metres) = model.changes(&solved.values);
    let not = CalibrationReport::not_calibrated(verdict, Calibrated::Body);
    // the energy says nothing of a body that another start would need
    let energy = if_finite(energies).filter(|_| is_start);
    let report = CalibrationReport { frames: 1, energy, start_shift_m: Some(shift), shares, metres, ..not };
    let (body, start) = if fits { (model.shaped(&solved.values), pose) } else { (model.body.clone(), start) };
    Ok(BodyCalibration { body, start: start.clone(), report })
}

/// How far, metres, a mask is beside the body in a pose, across the line of sight: between the centres of both
/// rectangles, which do not depend on the body's size. A start that is off would pass for another size.
fn start_shift(body: &Humanoid, pose: &Pose, camera: &Camera, observed: &Mask) -> f64 {
    let mut drawn = Mask::new(observed.width(), observed.height());
    let mut painter = SilhouettePainter::new(camera);
    painter.place(&camera.camera_from_world);
    painter.paint(body, &body.link_frames(pose), &mut drawn);
    let [there, here] = [observed, &drawn].map(Mask::bounds);
    let centre = |first: u32, end: u32| 0.5 * (f64::from(first) + f64::from(end));
    let across = centre(there.left, there.right) - centre(here.left, here.right);
    let down = centre(there.top, there.bottom) - centre(here.top, here.bottom);
    let depth = camera.camera_from_world.transform_point(&pose.world_from_root.translation.vector.into()).z;
    depth * (across / camera.pinhole.focal[0]).hypot(down / camera.pinhole.focal[1])
}

/// A body and cameras, judged on the held-out frames.
struct JudgedCalibration {
    solved: CalibrationSolution,
    /// Mean weighted squared residual of the outlines.
    cost: f64,
    energy: f64,
    /// Number of held-out frames in which any camera sees something.
    judged_on: usize,
}

impl JudgedCalibration {
    fn fits_better_than(&self, other: &Self, most: f64) -> bool {
        self.cost < other.cost && self.energy < most * other.energy
    }
}

/// As [`MAX_ENERGY_RATIO`], for other poses of the cameras, of which `seeing` see the body. A point has two coordinates
/// in each of n images, and three say where it is: 2n - 3 can contradict the cameras, five in four images and one in
/// two. Masks of one camera that are too wide look like a camera that is too far, in all frames alike, so later frames
/// do not refute that. Hence the fewer contradictions there can be, the more they must weigh.
fn max_camera_ratio(seeing: usize) -> f64 {
    let contradictions = 2.0 * seeing as f64 - 3.0;
    1.0 - (1.0 - MAX_ENERGY_RATIO) * (5.0 / contradictions).max(1.0)
}

/// Precision by which a component of a known start pose is held while a single view calibrates the body: depth and size
/// change an outline alike, and so do a limb's length and its angle to the image.
fn held_start_precision(number: usize) -> f64 {
    let deviation = if number < 3 { HELD_START_M } else { HELD_START_RAD };
    1.0 / (deviation * deviation)
}

/// Variance of the outlines' noise, as a multiple of that in images of 480 rows: an outline is known to a fraction of a
/// pixel, while residuals are measured in shares of an image's height. In finer images other errors dominate. With four
/// views of 120, 240 and 480 rows the error fell from 10.3 to 7.6, from 7.7 to 6.6 and stayed at 4.8 mm.
fn outline_noise(rig: &CameraRig) -> f64 {
    let fine_px = 2.0;
    let of_view = |camera: &Camera| (fine_px / length_px(camera)).powi(2).max(1.0);
    rig.cameras.iter().map(of_view).sum::<f64>() / rig.cameras.len() as f64
}

fn if_finite(values: [f64; 2]) -> Option<[f64; 2]> {
    values.iter().all(|value| value.is_finite()).then_some(values)
}

/// Mean energy over the frames in which any camera sees something, and their number. Empty images are left out: they
/// add the same to the energies of all bodies, which would hide how these differ.
fn mean_energy(
    likelihood: &mut SilhouetteLikelihood,
    seen: &[(Observation, Pose)],
    poses: &[Pose],
) -> Result<(f64, usize), CalibrationError> {
    let (mut sum, mut frames) = (0.0, 0);
    for ((observation, _), pose) in seen.iter().zip(poses) {
        likelihood.prepare(observation)?;
        if likelihood.leave_out_empty_images(observation) {
            sum += likelihood.energy(pose, &mut likelihood.scratch());
            frames += 1;
        }
    }
    Ok((sum / frames as f64, frames))
}

impl CalibrationReport {
    fn not_calibrated(verdict: CalibrationVerdict, solved: Calibrated) -> Self {
        let (shares, metres, cameras) = (Vec::new(), Vec::new(), Vec::new());
        let (cost, energy, start_shift_m) = (None, None, None);
        Self { verdict, frames: 0, held_back: 0, cost, energy, shares, metres, solved, cameras, start_shift_m }
    }

    /// The verdict with the numbers that it depends on, in one line of fixed form.
    pub fn describe(&self) -> String {
        let mut words = match self.verdict {
            CalibrationVerdict::Kept if self.solved == Calibrated::Cameras => {
                "the corrected cameras are used".to_owned()
            }
            CalibrationVerdict::Kept => "the calibrated body is used".to_owned(),
            CalibrationVerdict::NoBetter => "the uncalibrated body is used".to_owned(),
            CalibrationVerdict::TooFewViews => {
                "the uncalibrated body is used: fewer than two cameras see an outline".to_owned()
            }
            CalibrationVerdict::TooFewFrames => format!(
                "the uncalibrated body is used: it needs at least {MIN_CALIBRATION_FRAMES} frames, a fifteenth of a second \
                 apart"
            ),
        };
        if let Some([before, after]) = self.energy {
            let limit = MAX_ENERGY_RATIO * before;
            words += &format!("; energy {before:.4}, calibrated {after:.4} (at most {limit:.4})");
        }
        if let Some([before, after]) = self.cost.map(|costs| costs.map(|cost| cost.sqrt() * PERCENT_OF_HEIGHT)) {
            words += &format!("; outlines off by {before:.3} %, calibrated {after:.3} % of the image's height");
        }
        if let Some(shift) = self.start_shift_m {
            let most = 1000.0 * MAX_START_SHIFT_M;
            words +=
                &format!("; on the start pose, which is {:.0} mm off in the image (at most {most:.0})", 1000.0 * shift);
        }
        if self.held_back > 0 {
            words += &format!("; over {} test frames", self.held_back);
        }
        if !self.cameras.is_empty() {
            let moved = self.cameras.iter().map(CameraCorrection::moved_mm).fold(0.0, f64::max);
            let turned = self.cameras.iter().map(CameraCorrection::turned_deg).fold(0.0, f64::max);
            words +=
                &format!("; cameras moved by up to {moved:.0} mm, turned by up to {turned:.1} degrees about the body");
        }
        words
    }

    /// Every solved number with its unit: lengths and girths in per cent, positions in millimetres.
    pub fn describe_numbers(&self) -> Vec<(String, String)> {
        let shares = self.shares.iter().map(|(name, share)| (name.clone(), format!("{:+.1} %", 100.0 * share)));
        let metres = self.metres.iter().map(|(name, metres)| (name.clone(), format!("{:+.1} mm", 1000.0 * metres)));
        shares.chain(metres).collect()
    }
}
