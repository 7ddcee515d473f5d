//! `[training]`: from recordings to motions of the tracker's own body, at the rate of the test.

use std::path::Path;

use super::ExperimentError;
use super::error::scenario_error;
use super::retargeted_motion::{Recordings, RetargetedMotion};
use super::retargeting::{markers, plant_feet_if_asked, refit};
use crate::benchmark_set::{SourceRecording, TrainingMotions};
use crate::body::Humanoid;
use crate::contact::Pace;
use crate::scenario::ScenarioFile;

/// What a scenario's tracker may learn from.
pub(super) struct TrainingSources {
    pub(super) training: TrainingMotions,
    /// Which frames of which file each motion is.
    pub(super) sources: Vec<SourceRecording>,
}

/// The recordings of `[training]` as motions of `body`, which is the tracker's. As for the test, a recording is first
/// retargeted to the actor's robot and treated as `[actor] contact` says, and the tracker's body is then fitted to the
/// markers: what differs between training and test is the motion alone. `None` where the scenario has no training.
///
/// # Errors
/// [`ExperimentError`] that names the file and key, also where training shares frames with `test` or differs in rate.
pub(super) fn load(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    actor_template: &Humanoid,
    body: &Humanoid,
    test: &[SourceRecording],
) -> Result<Option<TrainingSources>, ExperimentError> {
    let Some(settings) = &file.scenario.training else { return Ok(None) };
    let rate = file.scenario.motion.frames_per_second;
    let mut learned = TrainingSources { training: TrainingMotions::default(), sources: Vec::new() };
    for (index, clip) in settings.clips.iter().enumerate() {
        let table = format!("training.clips[{index}]");
        let scenario_error_at = |key: &str, message: String| -> ExperimentError {
            scenario_error(file, &format!("{table}.{key}"), message)
        };
        if clip.frames_per_second != rate {
            let message = format!(
                "expected the rate of [motion], {rate} Hz, found {} Hz; motion models depend on the frame rate",
                clip.frames_per_second
            );
            return Err(scenario_error_at("frames_per_second", message));
        }
        let recordings = Recordings::load(file, &table, clip, mocap_directory)?;
        let sources = recordings.sources();
        if let Some((source, test, (first, last))) = shared(&sources, test) {
            let message = format!(
                "frames {first} to {last} (of the file, from 1) of `{}` are also frames of [motion] (`{}`); learn from \
                frames that are not in the test",
                source.clip,
                test.describe()
            );
            return Err(scenario_error_at("clip", message));
        }
        let robot = ("actor.robot", file.scenario.actor.robot.as_str());
        let RetargetedMotion { retargeted: mut performed, pace, .. } =
            recordings.performed_by(file, robot, actor_template)?;
        plant_feet_if_asked(file.scenario.actor.contact, &mut performed, Pace(&pace))?;
        let motion = refit(body, &markers(&performed.humanoid, &performed.motion), clip.frames_per_second);
        if motion.poses.len() < 3 {
            let (found, rate) = (motion.poses.len(), motion.frames_per_second);
            let message = format!(
                "expected at least 3 frames ({:.3} s) to learn from, found {found} ({:.3} s)",
                3.0 / rate,
                found as f64 / rate
            );
            return Err(scenario_error_at("clip", message));
        }
        learned.training.motions.push(motion);
        let words: Vec<String> = sources.iter().map(SourceRecording::describe).collect();
        learned.training.sources.push(words.join(", then "));
        learned.sources.extend(sources);
    }
    Ok(Some(learned))
}

/// The first of some recordings that shares frames with the test, and which of its frames.
fn shared<'a>(
    sources: &'a [SourceRecording],
    test: &'a [SourceRecording],
) -> Option<(&'a SourceRecording, &'a SourceRecording, (usize, usize))> {
    let pairs = sources.iter().flat_map(|source| test.iter().map(move |test| (source, test)));
    pairs.into_iter().find_map(|(source, test)| Some((source, test, source.shared_frames(test)?)))
}
