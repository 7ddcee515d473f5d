//! From a recording to a motion of a body: the steps that test and training motions share.

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

/// Retargets a recording to a robot. Errors name the key of the clip or of the robot.
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

/// Measures the ground contacts of a motion, or plants its feet, by `[actor] contact`. `pace` is that of
/// [`super::retargeted_motion`]. With `simulate`, motions that are only learned from are planted.
pub(crate) fn apply_contact_mode(
    mode: ContactMode,
    retargeted: &mut Retargeted,
    pace: Pace<'_>,
) -> Result<Option<ContactFacts>, ExperimentError> {
    let rule = ContactRule::default();
    Ok(match mode {
        ContactMode::Off => None,
        ContactMode::Measure => {
            let contacts = GroundContacts::from_motion_at_pace(&retargeted.humanoid, &retargeted.motion, &rule, pace)?;
            Some(ContactFacts::measured(&GroundQuality::from_contacts(&contacts)))
        }
        ContactMode::Fix | ContactMode::Simulate => {
            let planted = plant_feet_at_pace(&retargeted.humanoid, &retargeted.motion, &rule, pace)?;
            retargeted.motion = planted.motion;
            Some(contact_facts::planted(&planted.report))
        }
    })
}

/// The motion of `body` whose markers are nearest to the given ones.
pub(crate) fn refit(body: &Humanoid, markers: &[Markers], frames_per_second: f64) -> Motion {
    let fits = fit_motion_to_markers(body, markers, &body.zero_pose(), &FitOptions::default());
    let poses = fits.into_iter().map(|fit| fit.pose).collect();
    Motion { frames_per_second, poses }.made_continuous(body)
}

/// The positions of a body's markers in every frame.
pub(crate) fn markers(body: &Humanoid, motion: &Motion) -> Vec<Markers> {
    let mut frames = LinkFrames::default();
    let of = |pose| {
        body.link_frames_into(pose, &mut frames);
        body.markers(&frames)
    };
    motion.poses.iter().map(of).collect()
}
