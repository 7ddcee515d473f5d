//! `[training]`: from recordings to motions of the tracker's own body, at the rate of the test.

use std::path::Path;

use super::staging::{refit, settle};
use super::{ExperimentError, MotionSettings, ScenarioError, ScenarioFile, clip_file};
use crate::benchmark_set::Training;
use crate::body::retarget::{RetargetOptions, retarget};
use crate::body::{Humanoid, LinkFrames, Markers, Motion};

/// The recordings of `[training]` as motions of `body`, which is the tracker's. As for the test, a recording is first given to
/// the actor's robot and settled as `[actor] contact` says, and the tracker's body is then fitted to the markers: what differs
/// between training and test is the motion alone. `None` where the scenario has no training.
///
/// # Errors
/// [`ExperimentError`] that names the file and key, also where training and test share frames or differ in rate.
pub(super) fn load(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    actor_template: &Humanoid,
    body: &Humanoid,
) -> Result<Option<Training>, ExperimentError> {
    let Some(settings) = &file.scenario.training else { return Ok(None) };
    let test = &file.scenario.motion;
    let mut motions = Vec::new();
    for (index, clip) in settings.clips.iter().enumerate() {
        let table = format!("training.clips[{index}]");
        let unsound = |key: &str, message: String| -> ExperimentError {
            ScenarioError::from(file.complaint(&format!("{table}.{key}"), message)).into()
        };
        if clip.frames_per_second != test.frames_per_second {
            let message = format!(
                "expected the rate of [motion], {} Hz, found {} Hz; what is learned at one rate does not hold at another",
                test.frames_per_second, clip.frames_per_second
            );
            return Err(unsound("frames_per_second", message));
        }
        if let Some((first, last)) = shared_frames(clip, test) {
            let last = if last == usize::MAX { "the last".to_owned() } else { last.to_string() };
            let message = format!(
                "frames {first} to {last} (of the file, from 1) of `{}` are frames of [motion] too; learn from other frames than \
                 those of the test",
                clip.clip
            );
            return Err(unsound("clip", message));
        }
        let recording = clip_file::load(file, &table, clip, mocap_directory)?;
        let mut performed = retarget(&recording, actor_template, &RetargetOptions::default())?;
        settle(file.scenario.actor.contact, &mut performed)?;
        let motion = refit(body, &markers(&performed.humanoid, &performed.motion), clip.frames_per_second);
        if motion.poses.len() < 3 {
            let message = format!("expected at least 3 frames to learn from, found {}", motion.poses.len());
            return Err(unsound("clip", message));
        }
        motions.push(motion);
    }
    Ok(Some(Training::new(motions)))
}

/// Where a body's markers are, frame by frame.
fn markers(body: &Humanoid, motion: &Motion) -> Vec<Markers> {
    let mut frames = LinkFrames::default();
    let of = |pose| {
        body.link_frames_into(pose, &mut frames);
        body.markers(&frames)
    };
    motion.poses.iter().map(of).collect()
}

/// First and last frame that two parts of the same recording have in common. Files are told apart by hash where both are
/// known, else by their names without folders.
pub(super) fn shared_frames(a: &MotionSettings, b: &MotionSettings) -> Option<(usize, usize)> {
    let name = |m: &MotionSettings| m.clip.rsplit(['/', '\\']).next().map(str::to_owned);
    let same = match (&a.sha256, &b.sha256) {
        (Some(a), Some(b)) => a.eq_ignore_ascii_case(b),
        _ => name(a) == name(b),
    };
    let first = a.first_frame.unwrap_or(1).max(b.first_frame.unwrap_or(1));
    let last = a.last_frame.unwrap_or(usize::MAX).min(b.last_frame.unwrap_or(usize::MAX));
    (same && first <= last).then_some((first, last))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(clip: &str, first: Option<usize>, last: Option<usize>) -> MotionSettings {
        let text = format!("clip = \"{clip}\"");
        MotionSettings { first_frame: first, last_frame: last, ..toml::from_str(&text).unwrap() }
    }

    #[test]
    fn parts_of_one_recording_share_frames_and_those_of_two_do_not() {
        let test = part("a/walk.bvh", Some(100), Some(200));
        assert_eq!(shared_frames(&part("walk.bvh", Some(150), None), &test), Some((150, 200)));
        assert_eq!(shared_frames(&part("walk.bvh", None, Some(100)), &test), Some((100, 100)));
        assert_eq!(shared_frames(&part("walk.bvh", None, Some(99)), &test), None);
        assert_eq!(shared_frames(&part("run.bvh", None, None), &test), None);
    }

    #[test]
    fn hashes_tell_files_of_one_name_apart() {
        let with = |hash: &str| MotionSettings { sha256: Some(hash.to_owned()), ..part("walk.bvh", None, None) };
        assert_eq!(shared_frames(&with("aa"), &with("AA")), Some((1, usize::MAX)));
        assert_eq!(shared_frames(&with("aa"), &with("bb")), None);
    }
}
