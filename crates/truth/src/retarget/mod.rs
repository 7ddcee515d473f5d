//! Retargeting of a recording to a motion of a humanoid.
//!
//! The body's landmarks are found in the tree of recorded joints, and a template humanoid is scaled to the subject's
//! segment lengths. For every frame, joint angles are fitted to the recorded landmark positions and the orientations of
//! pelvis, thorax, head, hands and feet, within the joint limits and near the previous frame.
//!
//! ```no_run
//! use skiagraph_truth::retarget::{RetargetOptions, retarget};
//! use skiagraph_core::body::shipped;
//! use skiagraph_truth::mocap::{ReadOptions, read};
//! let clip = read("49_01.amc".as_ref(), &ReadOptions::default())?;
//! let walk = retarget(&clip, &shipped("actor")?, &RetargetOptions::default())?;
//! println!("{:.1} mm on average", walk.report.mean_residual_mm);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod anatomy;
mod calibration;
mod continuity;
#[cfg(test)]
mod crops;
mod fingerprint;
mod fit;
mod goals;
mod ground;
mod lengths;
mod person;
#[cfg(test)]
mod planted;
#[doc(hidden)]
pub mod plausibility;
mod residuals;
mod shape_fit;
mod skin_check;
mod skin_fit;
mod skin_landmarks;
mod spine;
mod turning;

use std::collections::BTreeMap;

use anatomy::{Anatomy, SubjectFrame};
use calibration::SegmentCalibration;

pub use residuals::RetargetReport;

// Parts of retargeting, for the application, tests and studies.
#[doc(hidden)]
pub use self::{
    fingerprint::{FINGERPRINT_DISTANCES, MotionFingerprint, SharedFrames},
    fit::{Fit, fit_motion_to_markers, fit_to_markers},
    goals::FitOptions,
    lengths::SegmentLengths,
    person::{Physique, physique_shape},
    residuals::{FootHeight, LandmarkResidual, LimitHits},
    shape_fit::fit_shape,
    skin_fit::with_skin,
};

use crate::mocap::Clip;
use skiagraph_core::body::{BodyShape, Humanoid, Joint, JointKind, LANDMARKS, Markers, Motion, Pose};
use skiagraph_core::input::excerpt;

/// Number of frames, spread over the clip, that are fitted to positions only, for the calibration of joint frames.
const CALIBRATION_FRAMES: usize = 100;

/// Options of retargeting.
#[derive(Clone, Debug, PartialEq)]
pub struct RetargetOptions {
    /// Map from landmark name ([`Landmark::name`](skiagraph_core::body::Landmark::name)) to a position on the recorded
    /// skeleton: `Joint`, `Joint:tip`, or `Joint+Joint` for the midpoint. The others are found in accordance with them.
    pub landmarks: BTreeMap<String, String>,
    /// Give left and right limbs the same lengths.
    pub symmetric: bool,
    /// What becomes z = 0.
    pub ground: Ground,
    /// Shift the motion horizontally so that the centre of the root's path is at the origin.
    pub centre_path: bool,
    /// Playback speed of the clip relative to the recording, > 0. Jumps are judged at the recorded speed.
    pub speed: f64,
    /// Weights of changes from the zero pose and from the previous frame.
    pub fit: FitOptions,
}

impl Default for RetargetOptions {
    fn default() -> Self {
        Self {
            landmarks: BTreeMap::new(),
            symmetric: false,
            ground: Ground::Feet,
            centre_path: false,
            speed: 1.0,
            fit: FitOptions::default(),
        }
    }
}

/// What becomes the ground, z = 0.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ground {
    /// z = 0 of the recording.
    Recorded,
    /// The plane beneath the soles of flat feet, levelled if it shows a tilt of the recording (up to 3 degrees).
    Feet,
    /// Beneath soles whose ankles are at this height of the recording, metres.
    BelowAnkles(f64),
}

/// A clip retargeted to a humanoid of the subject's size.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Retargeted {
    /// The template scaled to the subject.
    pub humanoid: Humanoid,
    /// The scale factors.
    pub shape: BodyShape,
    /// One pose per frame of the clip, at the clip's rate.
    pub motion: Motion,
    /// Quality measures.
    pub report: RetargetReport,
    /// The landmarks that were found on the recorded skeleton, as [`RetargetOptions::landmarks`] takes them.
    pub joint_map: BTreeMap<String, String>,
}

/// Why a clip cannot be retargeted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RetargetError {
    /// The clip has no frames, landmarks cannot be found, or an override names what there is not.
    #[error("{0}")]
    Refused(String),
    /// The humanoid lacks markers.
    #[error("{0}")]
    MissingMarkers(String),
}

/// The subject's markers in every frame of a clip, metres, and what was guessed or invented to find them. `joint_map`
/// is as in [`RetargetOptions::landmarks`].
#[doc(hidden)]
pub fn subject_markers(
    clip: &Clip,
    joint_map: &BTreeMap<String, String>,
) -> Result<(Vec<Markers>, Vec<String>), RetargetError> {
    let anatomy = Anatomy::from_clip(clip, joint_map)?;
    let markers = (0..clip.frames.len()).map(|frame| anatomy.observe(clip, frame).markers).collect();
    Ok((markers, anatomy.notes().to_vec()))
}

/// Retargets a clip to `template`, scaled to the subject. At its zero pose the template must stand upright with flat
/// feet.
///
/// # Errors
/// [`RetargetError`] if the clip is empty, its landmarks cannot be found, or the template lacks markers.
pub fn retarget(clip: &Clip, template: &Humanoid, options: &RetargetOptions) -> Result<Retargeted, RetargetError> {
    if clip.frames.is_empty() {
        return Err(RetargetError::Refused(format!("clip `{}` has no frames", excerpt(&clip.name))));
    }
    require_markers(template)?;
    let anatomy = Anatomy::from_clip(clip, &options.landmarks)?;
    let subject: Vec<SubjectFrame> = (0..clip.frames.len()).map(|frame| anatomy.observe(clip, frame)).collect();
    let measured = SegmentLengths::from_subject(&subject);
    let lengths = if options.symmetric { measured.symmetric() } else { measured };
    let shape = fit_shape(template, &lengths);
    let humanoid = template.reshaped(&shape);
    let posed = pose_from_positions(&humanoid, &subject, &options.fit);
    let calibration = SegmentCalibration::new(&humanoid, &subject, &posed);
    let hold = options.fit.continuity_m_per_rad * libm::sqrt(clip.frames_per_second / 120.0);
    let fit = FitOptions { continuity_m_per_rad: hold, ..options.fit };
    let recorded = turning::recorded_rotations(clip, &anatomy.joints());
    let turns: Vec<f64> = recorded.iter().map(|turn| turn + turning::MARGIN / clip.frames_per_second).collect();
    let poses = continuity::pose_all(&humanoid, &subject, &calibration, &posed, &turns, &fit);
    let mut motion = Motion { frames_per_second: clip.frames_per_second, poses }.made_continuous(&humanoid);
    let mut report = RetargetReport::new(&humanoid, &subject, &motion, lengths);
    report.notes.extend(clip.notes.iter().chain(anatomy.notes()).cloned());
    report.notes.extend(residuals::jump_note(&subject, clip.frames_per_second / options.speed));
    report.notes.extend(turning::note(&humanoid, &motion, &recorded));
    if let Some(bone) = anatomy.restored_bone_m() {
        report
            .notes
            .push(format!("the recording lacks the bone from the thorax joint to its children; {bone:.4} m restored"));
    }
    let grounding = ground::stand_on_ground(&humanoid, &mut motion, options.ground);
    report.ground_shift_m = grounding.raised;
    report.notes.extend(grounding.note());
    report.ground_levelled_deg = grounding.levelled.to_degrees();
    if options.centre_path {
        let shift = ground::centre_path(&mut motion);
        report.path_shift_m = [shift.x, shift.y];
    }
    report.foot_height = FootHeight::from_heights(&ground::foot_heights(&humanoid, &motion));
    let joint_map = anatomy.joint_map(&clip.skeleton);
    Ok(Retargeted { humanoid, shape, motion, report, joint_map })
}

fn require_markers(template: &Humanoid) -> Result<(), RetargetError> {
    let lacking = LANDMARKS.iter().zip(&template.markers).filter(|(_, marker)| marker.is_none());
    let missing: Vec<&str> = lacking.map(|(landmark, _)| landmark.name()).collect();
    if missing.is_empty() {
        return Ok(());
    }
    // files for learning to walk have arms that do not move
    let is_missing = |joint: &&Joint| {
        let parts = missing.iter().filter_map(|landmark| landmark.split_once('_')).map(|(_, part)| part);
        joint.kind == JointKind::Fixed && parts.into_iter().any(|part| joint.name.to_lowercase().contains(part))
    };
    let why = template.joints.iter().find(is_missing).map_or_else(
        || "and none can be derived from its link names or shape; ".to_owned(),
        |joint| format!("because `{}` is a fixed joint: take a file in which it moves; or ", excerpt(&joint.name)),
    );
    Err(RetargetError::MissingMarkers(format!(
        "robot `{}` has no marker for: {}, {why}for each, add an empty link marker_NAME on a fixed joint to its URDF",
        excerpt(&template.name),
        missing.join(", ")
    )))
}

/// Poses fitted to landmarks only, for frames spread over the clip, including the first.
fn pose_from_positions(humanoid: &Humanoid, subject: &[SubjectFrame], options: &FitOptions) -> Vec<(usize, Pose)> {
    let stride = subject.len().div_ceil(CALIBRATION_FRAMES);
    let frames: Vec<usize> = (0..subject.len()).step_by(stride).collect();
    let targets: Vec<_> = frames.iter().map(|&frame| subject[frame].markers).collect();
    // these frames are far apart in time, so continuity does not apply
    let independent = FitOptions { continuity_m_per_rad: 0.0, ..*options };
    let fits = fit_motion_to_markers(humanoid, &targets, &humanoid.zero_pose(), &independent);
    frames.into_iter().zip(fits.into_iter().map(|fit| fit.pose)).collect()
}

/// Quantile with linear interpolation (type 7 of `[Hyndman 1996]`); `None` without values.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let position = share * values.len().checked_sub(1)? as f64;
    let below = libm::floor(position) as usize;
    let above = (below + 1).min(values.len() - 1);
    Some(values[below] + (position - below as f64) * (values[above] - values[below]))
}
