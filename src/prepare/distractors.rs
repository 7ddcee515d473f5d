//! `[[distractor]]`: other people in the scene, each with a body and a motion.

use super::clip_file::Folders;
use super::retargeted_motion::{Recordings, RetargetedMotion};
use super::robots::{RobotChoice, robot};
use super::skins::{WornSkin, attach_skin};
use crate::common::{ExperimentError, key_error};
use crate::scenario::{DistractorSettings, MotionSettings, Scenario};
use skiagraph_core::body::Blending;
use skiagraph_truth::scene::Distractor;

#[derive(Default)]
pub(crate) struct SceneDistractors {
    pub(crate) distractors: Vec<Distractor>,
    pub(crate) notes: Vec<String>,
}

pub(crate) fn distractors(
    scenario: &Scenario,
    places: Folders<'_>,
    frames: usize,
) -> Result<SceneDistractors, ExperimentError> {
    let mut scene = SceneDistractors::default();
    for (index, settings) in scenario.distractor.iter().enumerate() {
        let (table, name) = (format!("distractor[{index}]"), settings.name.clone());
        let name = name.unwrap_or_else(|| format!("distractor{index:02}"));
        if scene.distractors.iter().any(|known| known.name == name) {
            let message = format!("two distractors are named `{name}`; their names must be unique");
            return Err(key_error(format!("{table}.name"), message));
        }
        // distractors move at the set's frame rate
        let frames_per_second = scenario.motion.frames_per_second;
        let motion = MotionSettings { frames_per_second, ..settings.motion.clone() };
        let (distractor, notes) = distractor(&table, name, settings, &motion, places)?;
        let last = distractor.poses.len();
        if last < frames {
            let (name, rate) = (&distractor.name, frames_per_second);
            let seconds = last as f64 / rate;
            scene.notes.push(format!("{table}: `{name}` stands still after {seconds:.2} s, {last} of {frames} frames"));
        }
        scene.notes.extend(notes.into_iter().map(|note| format!("{table}: {note}")));
        scene.distractors.push(Distractor { poses: distractor.poses.into_iter().take(frames).collect(), ..distractor });
    }
    Ok(scene)
}

fn distractor(
    table: &str,
    name: String,
    settings: &DistractorSettings,
    motion: &MotionSettings,
    places: Folders<'_>,
) -> Result<(Distractor, Vec<String>), ExperimentError> {
    let choice = RobotChoice::of_distractor(table, settings);
    let template = robot(places.folder, &choice)?;
    let (template, skin_notes) = attach_skin(
        places.folder,
        table,
        template,
        WornSkin { name: settings.skin.as_ref(), joint_map: &settings.joint_map, blending: Blending::Linear },
    )?;
    let recordings = Recordings::load(places, &format!("{table}.motion"), motion)?;
    // distractors have the recorded subject's body: [actor] shape does not apply
    let RetargetedMotion { retargeted, .. } = recordings.retarget_to(&choice, &template, None)?;
    let poses = retargeted.motion.poses;
    let skin_notes = skin_notes.into_iter().map(|note| format!("skin: {note}"));
    let notes = skin_notes.chain(retargeted.report.notes).collect();
    Ok((Distractor { name, body: retargeted.humanoid, poses }, notes))
}
