//! `[training]`: from recordings to motions of the tracker's body, at the frame rate of the test.

use super::clip_file::Folders;
use super::retargeted_motion::{Recordings, RetargetedMotion};
use super::retargeting::{apply_contact_mode, markers, refit};
use super::robots::RobotChoice;
use crate::common::ExperimentError;
use crate::scenario::{KeyError, Scenario};
use skiagraph_core::body::Humanoid;
use skiagraph_core::contact::Pace;
use skiagraph_set::{SourceRecording, TrainingMotions};

pub(crate) struct TrainingSources {
    pub(crate) training: TrainingMotions,
    /// The motions' frames in the recorded files.
    pub(crate) sources: Vec<SourceRecording>,
}

/// The recordings of `[training]` as motions of `body`, the tracker's. As for the test, each recording is first
/// retargeted to the actor's robot with `[actor] contact`, and the tracker's body is then fitted to its markers, so
/// training and test differ in the motion alone. `None` if the scenario has no training.
///
/// # Errors
/// [`ExperimentError`] that names the file and key, also if training shares frames with `test` or has another rate.
pub(crate) fn load(
    scenario: &Scenario,
    places: Folders<'_>,
    actor_template: &Humanoid,
    body: &Humanoid,
    test: &[SourceRecording],
) -> Result<Option<TrainingSources>, ExperimentError> {
    let Some(settings) = &scenario.training else { return Ok(None) };
    let rate = scenario.motion.frames_per_second;
    let mut learned = TrainingSources { training: TrainingMotions::default(), sources: Vec::new() };
    for (index, clip) in settings.clips.iter().enumerate() {
        let table = format!("training.clips[{index}]");
        if clip.frames_per_second != rate {
            let message = format!(
                "expected the rate of [motion], {rate} Hz, found {} Hz; motion models depend on the frame rate",
                clip.frames_per_second
            );
            return Err(KeyError::new("frames_per_second", message).within(&table).into());
        }
        let recordings = Recordings::load(places, &table, clip)?;
        let sources = recordings.sources();
        if let Some((source, test, (first, last))) = shared(&sources, test) {
            let message = format!(
                "frames {first} to {last} (of the file, from 1) of `{}` are also frames of [motion] (`{}`); learn from \
                frames that are not in the test",
                source.clip,
                test.describe()
            );
            return Err(KeyError::new("clip", message).within(&table).into());
        }
        let actor = &scenario.actor;
        let RetargetedMotion { mut retargeted, pace, .. } =
            recordings.retarget_to(&RobotChoice::of_actor(actor), actor_template, actor.shape.as_ref())?;
        apply_contact_mode(actor.contact, &mut retargeted, Pace(&pace))?;
        let motion = refit(body, &markers(&retargeted.humanoid, &retargeted.motion), clip.frames_per_second);
        if motion.poses.len() < 3 {
            let (found, rate) = (motion.poses.len(), motion.frames_per_second);
            let message = format!(
                "expected at least 3 frames ({:.3} s) to learn from, found {found} ({:.3} s)",
                3.0 / rate,
                found as f64 / rate
            );
            return Err(KeyError::new("clip", message).within(&table).into());
        }
        learned.training.motions.push(motion);
        let words: Vec<String> = sources.iter().map(SourceRecording::describe).collect();
        learned.training.sources.push(words.join(", then "));
        learned.sources.extend(sources);
    }
    Ok(Some(learned))
}

/// The first recording that shares frames with the test, the test recording, and the shared frames.
fn shared<'a>(
    sources: &'a [SourceRecording],
    test: &'a [SourceRecording],
) -> Option<(&'a SourceRecording, &'a SourceRecording, (usize, usize))> {
    let pairs = sources.iter().flat_map(|source| test.iter().map(move |test| (source, test)));
    pairs.into_iter().find_map(|(source, test)| Some((source, test, source.shared_frames(test)?)))
}
