//! From a recording to a motion of a body: the steps that test and training motions share.

use super::clip_file::UsedRecording;
use super::contact_facts;
use super::robots::RobotChoice;
use crate::common::ExperimentError;
use crate::scenario::{ContactMode, KeyError, MotionSettings};
use skiagraph_core::body::{Humanoid, LinkFrames, Markers, Motion, SHIPPED_ROBOTS};
use skiagraph_core::contact::{ContactRule, GroundContacts, GroundQuality, Pace};
use skiagraph_core::input::excerpt;
use skiagraph_physics::plant_feet_at_pace;
use skiagraph_set::ContactFacts;
use skiagraph_truth::mocap;
use skiagraph_truth::retarget::{
    FitOptions, RetargetError, RetargetOptions, Retargeted, fit_motion_to_markers, plausibility, retarget,
};

/// Retargets a recording to a robot. Errors name the key of the clip or of the robot.
pub(crate) fn retargeted(
    clip_key: &str,
    settings: &MotionSettings,
    robot: &RobotChoice<'_>,
    recording: &UsedRecording,
    template: &Humanoid,
) -> Result<Retargeted, KeyError> {
    let options = RetargetOptions {
        landmarks: settings.joint_map.clone(),
        speed: settings.speed.unwrap_or(1.0),
        ground: recording.ground,
        ..RetargetOptions::default()
    };
    let mut fitted = retarget(&recording.clip, template, &options).map_err(|error| {
        let (key, name) = match error {
            RetargetError::MissingMarkers(_) => (robot.key(), robot.robot),
            _ => (clip_key.to_owned(), settings.clip.as_str()),
        };
        KeyError::new(key, format!("{}: {error}", excerpt(name)))
    })?;
    let is_human = SHIPPED_ROBOTS.iter().any(|(shipped, _)| *shipped == robot.robot);
    match plausibility::judge_fit(&fitted.report, options.ground, is_human) {
        Some(finding) if finding.is_refusal && !settings.accept_implausible => {
            return Err(KeyError::new(clip_key, refusal_of(&settings.clip, &finding.text, &recording.clip.notes)));
        }
        finding => fitted.report.notes.extend(finding.map(|finding| finding.note())),
    }
    Ok(fitted)
}

/// The message of a refusal. `notes` are those of the recording.
pub(crate) fn refusal_of(clip: &str, why: &str, notes: &[String]) -> String {
    let (clip, frames) = (excerpt(clip), frames_in_view(notes));
    format!("{clip}: {frames}no human body moves so: {why}; or use it all the same: `accept_implausible = true`")
}

/// The frames that notes of a recording advise to use, for the beginning of a refusal.
pub(crate) fn frames_in_view(notes: &[String]) -> String {
    let frames = notes.iter().flat_map(|note| note.split("; ")).find(|part| part.starts_with(mocap::IN_VIEW));
    frames.map(|frames| format!("{frames}; with others, ")).unwrap_or_default()
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

pub(crate) fn markers(body: &Humanoid, motion: &Motion) -> Vec<Markers> {
    let mut frames = LinkFrames::default();
    let of = |pose| {
        body.link_frames_into(pose, &mut frames);
        body.markers(&frames)
    };
    motion.poses.iter().map(of).collect()
}

#[cfg(test)]
#[test]
fn a_refusal_begins_with_the_frames_in_which_all_points_are_seen() {
    let note = format!("no markers; {} 2 to 9: set", mocap::IN_VIEW);
    assert!(refusal_of("a.trc", "why", &[note]).contains("frames 2 to 9: set; with others, no human body"));
}
