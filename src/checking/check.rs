//! `skiagraph check`: all errors of a scenario, or its views and cost, before any work.

use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::cost::{RunCost, cost};
use crate::common::{ExperimentError, NoProgress};
use crate::prepare::clip_file::Folders;
use crate::prepare::robots::{RobotChoice, robot};
use crate::prepare::scene_check::{CamerasInside, prop_notes, unseen, views};
use crate::prepare::{ActorPath, CameraView, PreparedScene, clip_file};
use crate::scenario::{Scenario, ScenarioFile, TrackerSettings};
use crate::tracking::calibrating;
use crate::tracking::program::keypoints_of_one_camera;
use crate::train::{LearnedModel, Models};
use skiagraph_core::body::{DrawnShares, Humanoid};

/// Facts about a valid scenario.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckReport {
    /// `skiagraph.check/1`.
    pub schema: &'static str,
    /// `true`.
    pub sound: bool,
    pub scenario: String,
    /// The recording's name.
    pub clip: String,
    pub frames: usize,
    pub frames_per_second: f64,
    /// Seconds from the first frame to the end of the last.
    pub duration_s: f64,
    /// The name of the actor's body.
    pub actor: String,
    pub tracker_body: String,
    /// Whether they are the same body.
    pub matched: bool,
    /// Shares of the actor that its solids draw; absent for a body with a skin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub actor_drawn: Option<DrawnShares>,
    /// Shares of the tracker's body that its solids draw; absent for a body with a skin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracker_body_drawn: Option<DrawnShares>,
    /// Mean distance of the actor's markers from the recorded ones, millimetres.
    pub retarget_residual_mm: f64,
    pub path: ActorPath,
    pub cameras: Vec<String>,
    pub views: Vec<CameraView>,
    /// The tracker's name, or those of all methods, in the order of the methods' names.
    pub tracker: String,
    pub seeds: u32,
    /// Likelihood evaluations of all frames and seeds.
    pub likelihood_evaluations: u64,
    pub cost: RunCost,
    /// Notes about guesses, repaired frames and doubtful views.
    pub notes: Vec<String>,
}

/// Height of a body in an image below which its forearms are about a pixel wide.
const SMALL_BODY_PX: u32 = 20;

/// Reads all files of a scenario, prepares its scene, renders some frames for the views, and tracks a sample for the
/// cost.
///
/// # Errors
/// Everything that `run` would refuse, each an [`ExperimentError`] that names the file, line or key.
pub fn check(file: &ScenarioFile, mocap_directory: Option<&Path>) -> Result<CheckReport, Vec<ExperimentError>> {
    let missing = unusable_files(file, mocap_directory);
    if !missing.is_empty() {
        return Err(missing);
    }
    let begin = Instant::now();
    let mut scene = PreparedScene::new(file, mocap_directory).map_err(|error| vec![error])?;
    let staging_s = begin.elapsed().as_secs_f64();
    let views = views(&scene);
    let CamerasInside { errors, notes } = CamerasInside::new(file.scenario.rig.ring.as_ref(), &scene);
    scene.notes.extend(notes);
    let mut errors: Vec<ExperimentError> = errors.into_iter().map(ExperimentError::from).collect();
    errors.extend(unseen(&file.scenario.rig, &scene, &views).map(ExperimentError::from));
    errors.extend(unfit_models(&file.scenario.trackers(), Models::new(&file.folder, &scene.sources), &scene));
    let cameras = scene.rig.rig().cameras.len();
    errors.extend(keypoints_of_one_camera(&file.scenario, cameras).map(ExperimentError::from));
    if !errors.is_empty() {
        return Err(errors.into_iter().map(|error| error.located(file)).collect());
    }
    let cost = cost(&file.scenario, &scene, staging_s).map_err(|error| vec![error])?;
    let path = ActorPath::new(&scene);
    Ok(check_report(&file.scenario, scene, path, views, cost))
}

fn check_report(
    scenario: &Scenario,
    scene: PreparedScene,
    path: ActorPath,
    views: Vec<CameraView>,
    cost: RunCost,
) -> CheckReport {
    let trackers = scenario.trackers();
    let per_frame: u64 = trackers.iter().map(|(_, tracker)| tracker.kind().evaluations_per_frame()).sum();
    let names: Vec<&str> = trackers.iter().map(|(_, t)| t.name()).collect();
    let (frames, frames_per_second) = (scene.frames(), scene.ground_truth.frames_per_second);
    let mut notes = scene.notes.clone();
    notes.extend(prop_notes(&scene));
    notes.extend(views.iter().filter_map(small_body_note));
    notes.extend(other_people_note(&scene));
    notes.extend(calibration_note(scenario, &scene, &views));
    CheckReport {
        schema: "skiagraph.check/1",
        sound: true,
        scenario: scenario.name.clone(),
        frames,
        frames_per_second,
        duration_s: frames as f64 / frames_per_second,
        actor: scene.ground_truth.actor.name.clone(),
        tracker_body: scene.start.body.name.clone(),
        actor_drawn: drawn(&scene.ground_truth.actor),
        tracker_body_drawn: drawn(&scene.start.body),
        matched: scene.facts.matched,
        retarget_residual_mm: scene.report.mean_residual_mm,
        path,
        cameras: scene.rig.rig().cameras.iter().map(|camera| camera.name.clone()).collect(),
        views,
        tracker: names.join(", "),
        seeds: scenario.seeds,
        likelihood_evaluations: per_frame * frames as u64 * u64::from(scenario.seeds),
        cost,
        notes,
        clip: scene.clip,
    }
}

/// A note on a camera in whose images the body is small.
fn small_body_note(view: &CameraView) -> Option<String> {
    let [_, median, _] = view.height_px.filter(|[_, median, _]| *median < SMALL_BODY_PX)?;
    Some(format!(
        "{}: the actor is only {median} px high (median), so its limbs hardly show; move the camera nearer, or choose \
         larger images",
        view.camera
    ))
}

fn other_people_note(scene: &PreparedScene) -> Option<String> {
    let names: Vec<&str> = scene.ground_truth.distractors.iter().map(|other| other.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!("silhouettes also show people who are not tracked, wherever cameras see them: {}", names.join(", "))
    })
}

fn one_view_note(views: &[CameraView]) -> Option<String> {
    let seeing = views.iter().filter(|view| view.height_px.is_some()).count();
    let note = "tracker_body.calibrate: one camera sees the actor; the body is calibrated on the start pose alone, because \
                later frames do not tell size from distance";
    (seeing == 1).then(|| note.to_owned())
}

/// A note if the tracker's body will not be calibrated although the scenario asks for it, in words or by default.
fn calibration_note(scenario: &Scenario, scene: &PreparedScene, views: &[CameraView]) -> Option<String> {
    let is_filter = |tracker: &TrackerSettings| matches!(tracker, TrackerSettings::AnnealedParticleFilter(_));
    if !scenario.trackers().iter().any(|(_, tracker)| is_filter(tracker)) {
        let is_asked = scenario.tracker_body.calibrate.is_some_and(|asked| !asked.is_nothing());
        return is_asked
            .then(|| "tracker_body.calibrate: only annealed_particle_filter calibrates the body".to_owned());
    }
    if scenario.tracker_body.calibrated().is_nothing() {
        return None;
    }
    if let Some(note) = one_view_note(views).filter(|_| scenario.tracker_body.calibrated().has_body()) {
        return Some(note);
    }
    let cameras = scene.rig.rig().cameras.len();
    let obstacle = calibrating::obstacle(cameras, scene.frames(), scene.ground_truth.frames_per_second)?;
    Some(format!("tracker_body.calibrate: not possible, so the uncalibrated body is used: {obstacle}"))
}

fn drawn(body: &Humanoid) -> Option<DrawnShares> {
    body.skin.is_none().then(|| DrawnShares::new(body))
}

/// Errors of the files that a scenario names, each checked separately: missing recordings, unreadable robots and
/// models.
pub fn unusable_files(file: &ScenarioFile, mocap_directory: Option<&Path>) -> Vec<ExperimentError> {
    let (scenario, places) = (&file.scenario, Folders::of(file, mocap_directory));
    let mut errors = Vec::new();
    errors.extend(clip_file::missing(places, "motion", &scenario.motion));
    for (index, clip) in scenario.training.iter().flat_map(|training| &training.clips).enumerate() {
        errors.extend(clip_file::missing(places, &format!("training.clips[{index}]"), clip));
    }
    let (of_actor, of_tracker) =
        (RobotChoice::of_actor(&scenario.actor), RobotChoice::of_tracker(&scenario.tracker_body));
    errors.extend(robot(places.folder, &of_actor).err());
    for (index, other) in scenario.distractor.iter().enumerate() {
        let table = format!("distractor[{index}]");
        errors.extend(clip_file::missing(places, &format!("{table}.motion"), &other.motion));
        errors.extend(robot(places.folder, &RobotChoice::of_distractor(&table, other)).err());
    }
    if !of_actor.is_same_robot(&of_tracker) || of_actor.has_skin {
        errors.extend(robot(places.folder, &of_tracker).err());
    }
    let mut seen = Vec::new();
    for (_, tracker) in scenario.trackers() {
        let Some(path) = tracker.kind().model_file().map(|name| file.folder.join(name)) else { continue };
        if !seen.contains(&path) {
            errors.extend(LearnedModel::read(&path).err());
            seen.push(path);
        }
    }
    errors.into_iter().map(|error: ExperimentError| error.located(file)).collect()
}

/// Errors of model files that do not fit this body, frame rate and test.
fn unfit_models(
    trackers: &[(&str, TrackerSettings)],
    mut models: Models,
    scene: &PreparedScene,
) -> Vec<ExperimentError> {
    let (body, rate) = (&scene.start.body, scene.ground_truth.frames_per_second);
    trackers.iter().filter_map(|(_, tracker)| models.check_file(tracker, body, rate, &NoProgress).err()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_that_never_sees_the_actor_cannot_help_to_calibrate() {
        let view = |height_px| CameraView {
            camera: "cam".to_owned(),
            frames_looked_at: 3,
            in_view: 1.0,
            at_border: 0.0,
            height_px,
        };
        let (seeing, blind) = (view(Some([90, 95, 99])), view(None));
        assert_eq!(one_view_note(&[seeing.clone(), blind.clone(), seeing.clone()]), None);
        assert!(one_view_note(&[seeing, blind]).unwrap().contains("one camera sees the actor"));
    }
}
