//! `[[distractor]]`: other people in the scene, each with a body and a motion.

use std::path::Path;

use super::retargeted_motion::{Recordings, RetargetedMotion};
use super::robots::{RobotChoice, robot};
use super::skins::attach_skin;
use crate::body::{Blending, Humanoid};
use crate::common::{ExperimentError, scenario_error};
use crate::scenario::{DistractorSettings, MotionSettings, ScenarioFile};
use crate::scene::Distractor;

/// The other people of a scene.
#[derive(Default)]
pub(crate) struct SceneDistractors {
    /// One per table.
    pub(crate) distractors: Vec<Distractor>,
    /// Notes for the user.
    pub(crate) notes: Vec<String>,
}

/// The distractors of a scenario, for a motion of `frames` frames.
///
/// # Errors
/// [`ExperimentError`] that names the file or key.
pub(crate) fn distractors(
    file: &ScenarioFile,
    frames: usize,
    mocap_directory: Option<&Path>,
) -> Result<SceneDistractors, ExperimentError> {
    let mut scene = SceneDistractors::default();
    for (index, settings) in file.scenario.distractor.iter().enumerate() {
        let (table, name) = (format!("distractor[{index}]"), settings.name.clone());
        let name = name.unwrap_or_else(|| format!("distractor{index:02}"));
        if scene.distractors.iter().any(|known| known.name == name) {
            let message = format!("two distractors are named `{name}`; their names must be unique");
            return Err(scenario_error(file, &format!("{table}.name"), message));
        }
        let template = robot(file, &RobotChoice::of_distractor(&table, settings))?;
        let (distractor, notes) = distractor(file, (&table, name), settings, template, mocap_directory)?;
        let last = distractor.poses.len();
        if last < frames {
            let (name, rate) = (&distractor.name, file.scenario.motion.frames_per_second);
            let seconds = last as f64 / rate;
            scene.notes.push(format!("{table}: `{name}` stands still after {seconds:.2} s, {last} of {frames} frames"));
        }
        scene.notes.extend(notes.into_iter().map(|note| format!("{table}: {note}")));
        scene.distractors.push(Distractor { poses: distractor.poses.into_iter().take(frames).collect(), ..distractor });
    }
    Ok(scene)
}

fn distractor(
    file: &ScenarioFile,
    (table, name): (&str, String),
    settings: &DistractorSettings,
    template: Humanoid,
    mocap_directory: Option<&Path>,
) -> Result<(Distractor, Vec<String>), ExperimentError> {
    // distractors have the recorded subject's body: [actor] shape does not apply; they move at the set's frame rate
    let mut alone = file.clone();
    alone.scenario.actor.shape = None;
    let frames_per_second = file.scenario.motion.frames_per_second;
    let motion = MotionSettings { frames_per_second, ..settings.motion.clone() };
    let key = format!("{table}.robot");
    let (template, skin_notes) = attach_skin(file, table, template, settings.skin.as_ref(), Blending::Linear)?;
    let recordings = Recordings::load(&alone, &format!("{table}.motion"), &motion, mocap_directory)?;
    let RetargetedMotion { retargeted, .. } = recordings.retarget_to(&alone, (&key, &settings.robot), &template)?;
    let poses = retargeted.motion.poses;
    let skin_notes = skin_notes.into_iter().map(|note| format!("skin: {note}"));
    let notes = skin_notes.chain(retargeted.report.notes).collect();
    Ok((Distractor { name, body: retargeted.humanoid, poses }, notes))
}
