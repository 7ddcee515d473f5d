//! From a recording to a motion of a body: the steps that the test and what is learned from share.

use super::contact_facts;
use crate::benchmark_set::ContactFacts;
use crate::body::{Humanoid, LinkFrames, Markers, Motion};
use crate::common::{ExperimentError, scenario_error};
use crate::contact::{ContactRule, GroundContacts, GroundQuality, Pace};
use crate::input::excerpt;
use crate::mocap::Clip;
use crate::physics::plant_feet_at_pace;
use crate::retarget::{FitOptions, RetargetError, RetargetOptions, Retargeted, fit_motion_to_markers, retarget};
use crate::scenario::{ContactMode, MotionSettings, ScenarioFile};

/// A recording given to a robot; what is wrong is told of the key that names the one or the other.
pub(crate) fn retargeted(
    file: &ScenarioFile,
    (clip_key, settings): (&str, &MotionSettings),
    (robot_key, robot_name): (&str, &str),
    clip: &Clip,
    template: &Humanoid,
) -> Result<Retargeted, ExperimentError> {
    let options = RetargetOptions {
        landmarks: settings.joint_map.clone(),
        speed: settings.speed.unwrap_or(1.0),
        ..RetargetOptions::default()
    };
    retarget(clip, template, &options).map_err(|error| {
        let (key, name) = match error {
            RetargetError::MissingMarkers { .. } => (robot_key, robot_name),
            _ => (clip_key, settings.clip.as_str()),
        };
        scenario_error(file, key, format!("{}: {error}", excerpt(name)))
    })
}

/// Does to the motion what `[actor] contact` says; what came of it. `pace` is that of [`super::retargeted_motion`]. Where
/// the test is simulated, what is only learned from is fixed.
pub(crate) fn plant_feet_if_asked(
    mode: ContactMode,
    performed: &mut Retargeted,
    pace: Pace<'_>,
) -> Result<Option<ContactFacts>, ExperimentError> {
    let rule = ContactRule::default();
    Ok(match mode {
        ContactMode::Off => None,
        ContactMode::Measure => {
            let contacts = GroundContacts::from_motion_at_pace(&performed.humanoid, &performed.motion, &rule, pace)?;
            Some(ContactFacts::measured(&GroundQuality::from_contacts(&contacts)))
        }
        ContactMode::Fix | ContactMode::Simulate => {
            let fixed = plant_feet_at_pace(&performed.humanoid, &performed.motion, &rule, pace)?;
            performed.motion = fixed.motion;
            Some(contact_facts::fixed(&fixed.report))
        }
    })
}

/// The motion of `body` whose markers come nearest to those of another.
pub(crate) fn refit(body: &Humanoid, markers: &[Markers], frames_per_second: f64) -> Motion {
    let fits = fit_motion_to_markers(body, markers, &body.zero_pose(), &FitOptions::default());
    let poses = fits.into_iter().map(|fit| fit.pose).collect();
    Motion { frames_per_second, poses }.made_continuous(body)
}

/// Where a body's markers are, frame by frame.
pub(crate) fn markers(body: &Humanoid, motion: &Motion) -> Vec<Markers> {
    let mut frames = LinkFrames::default();
    let of = |pose| {
        body.link_frames_into(pose, &mut frames);
        body.markers(&frames)
    };
    motion.poses.iter().map(of).collect()
}
