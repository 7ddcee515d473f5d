//! Builds bodies, motion, cameras and ground truth from a scenario.

use std::path::Path;

use nalgebra::{Unit, Vector3};

use super::contact_facts;
use super::distractors::{SceneDistractors, distractors};
use super::error::scenario_error;
use super::mismatch_seed::mismatch_seed;
use super::people::{another_adult, of_its_mass};
use super::retargeted_motion::{Recordings, RetargetedMotion};
use super::retargeting::{plant_feet_if_asked, refit};
use super::rig::{rig, rig_notes};
use super::robots::{RobotChoice, robot};
use super::skins::dressed;
use super::{ExperimentError, training};
use crate::benchmark_set::{
    AGAINST_ROBOT, ContactFacts, RetargetFacts, RigMoments, SourceRecording, Start, StepSpread, Training, TruthFacts,
};
use crate::body::{Blending, BodyShape, Humanoid, Markers, Motion};
use crate::camera::{CameraRig, TimedRig};
use crate::contact::{Pace, check_feet};
use crate::editing::{Seam, Variation};
use crate::observation::{Corruption, tracker_start};
use crate::physics::{Push, SimulationSettings, simulate};
use crate::retarget::{RetargetReport, Retargeted, SegmentLengths, fit_shape};
use crate::rng::ObservationKey;
use crate::scenario::{
    ContactMode, Mismatch, MismatchBy, MotionSettings, PropSettings, PushSettings, ScenarioFile, did_you_mean,
};
use crate::scene::GroundTruth;

/// A scenario whose files are read: ready to be drawn.
#[derive(Clone, Debug)]
pub struct PreparedScene {
    /// Whose motion, in words.
    pub clip: String,
    /// The true cameras, how they move and take their images.
    pub rig: TimedRig,
    /// The truth, frame by frame.
    pub ground_truth: GroundTruth,
    /// Which frames of which files the actor performs.
    pub sources: Vec<SourceRecording>,
    /// Where takes were joined.
    pub seams: Vec<Seam>,
    /// How many times as fast as recorded each frame is; empty where all are as fast.
    pub pace: Vec<f64>,
    /// The same of every training motion.
    pub training_sources: Vec<SourceRecording>,
    /// What the tracker is told.
    pub start: Start,
    /// The tracker's body brought nearest to the truth; one pose a frame.
    pub refitted: Motion,
    /// How well the recording was retargeted to the actor.
    pub report: RetargetReport,
    /// Facts for the set.
    pub facts: TruthFacts,
    /// The secret that everything drawn for the observations depends on.
    pub key: ObservationKey,
    /// Notes: guesses, repaired frames, doubtful views.
    pub notes: Vec<String>,
}

impl PreparedScene {
    /// Reads what the scenario names. Clips that are named without a path are looked for below `mocap_directory`.
    ///
    /// # Errors
    /// [`ExperimentError`] that names the file, line or key.
    pub fn new(file: &ScenarioFile, mocap_directory: Option<&Path>) -> Result<Self, ExperimentError> {
        let scenario = &file.scenario;
        let recordings = Recordings::load(file, "motion", &scenario.motion, mocap_directory)?;
        let of_actor = RobotChoice::of_actor(&scenario.actor);
        let of_tracker = RobotChoice::of_tracker(&scenario.tracker_body);
        let actor_template = robot(file, &of_actor)?;
        let tracker_template = robot(file, &of_tracker)?;
        let same_robot = actor_template.is_same_body(&tracker_template);
        let (actor, tracker) = (&scenario.actor, &scenario.tracker_body);
        let (actor_template, notes_of_skin) =
            dressed(file, "actor", actor_template, actor.skin.as_ref(), actor.skin_blending)?;
        check_surface(file, "actor.robot", &actor_template)?;
        let (tracker_template, notes_of_tracker) =
            dressed(file, "tracker_body", tracker_template, tracker.skin.as_ref(), Blending::Linear)?;
        check_surface(file, "tracker_body.robot", &tracker_template)?;
        let RetargetedMotion { retargeted: mut performed, seams, pace } =
            recordings.performed_by(file, ("actor.robot", &scenario.actor.robot), &actor_template)?;
        performed.humanoid = performed.humanoid.with_masses_of_skin();
        let contact = apply_contact(file, &mut performed, &pace)?;
        let body = tracker_body(file, &tracker_template, &performed, same_robot)?.with_masses_of_skin();
        let learned = training::load(file, mocap_directory, &actor_template, &body, &recordings.sources())?;
        let (training, training_sources) = match learned {
            Some(learned) => (Training::Motions(learned.training), learned.sources),
            None if same_robot => (Training::Spread(StepSpread::of_motion(&body, &performed.motion)?), Vec::new()),
            None => {
                let robot = ("tracker_body.robot", scenario.tracker_body.robot.as_str());
                let RetargetedMotion { retargeted: mut own, pace, .. } =
                    recordings.performed_by(file, robot, &tracker_template)?;
                if check_feet(&own.humanoid).is_ok() {
                    plant_feet_if_asked(scenario.actor.contact, &mut own, Pace(&pace))?;
                }
                (Training::Spread(StepSpread::of_motion(&body, &own.motion)?), Vec::new())
            }
        };
        let rig = rig(file, &performed.motion)?;
        let props = scenario.prop.iter().map(PropSettings::prop).collect();
        let frames = performed.motion.poses.len();
        let SceneDistractors { distractors, notes: other_notes } = distractors(file, frames, mocap_directory)?;
        let ground_truth = GroundTruth::among(performed.humanoid, &performed.motion, &rig, props, distractors)?;
        let matched = body.is_same_body(&ground_truth.actor);
        let refitted = if matched {
            performed.motion
        } else {
            let markers: Vec<Markers> = ground_truth.frames.iter().map(|frame| frame.markers).collect();
            refit(&body, &markers, ground_truth.frames_per_second)
        };
        let Some(pose) = refitted.poses.first().cloned() else {
            return Err(scenario_error(file, "motion", "expected at least one frame, found none".to_owned()));
        };
        let scenario_observation = &scenario.observation;
        let (corruption, seed) = (&scenario_observation.corruption, scenario_observation.keyed_seed());
        let pose = tracker_start(&body, &pose, corruption, seed);
        let told = RigMoments::for_tracker(&rig, &ground_truth, Some(&scenario_observation.facts()), seed);
        let mut notes = performed.report.notes.clone();
        notes.extend(lens_without_effect(corruption, rig.rig()));
        let rate = ground_truth.frames_per_second;
        notes.extend(told.iter().flat_map(|told| rig_notes(told, rig.rig(), rate)));
        notes.extend(contact.iter().map(|contact| format!("contact: {}", contact.outcome)));
        notes.extend(robot_notes("actor", &actor_template, &notes_of_skin));
        if !same_robot {
            notes.extend(robot_notes("tracker_body", &tracker_template, &notes_of_tracker));
        }
        notes.extend(notes_of_skin.iter().map(|note| format!("actor.skin: {note}")));
        notes.extend(notes_of_tracker.iter().map(|note| format!("tracker_body.skin: {note}")));
        notes.extend(other_notes);
        notes.extend(footless("actor.robot", &ground_truth.actor));
        notes.extend(footless("tracker_body.robot", &body));
        let unseen = ground_truth.unseen_frames(&rig).len();
        if unseen > 0 {
            let frames = ground_truth.frames.len();
            notes.push(format!(
                "no camera sees the subject in {unseen} of {frames} frames; move the cameras or look_at_m"
            ));
        }
        Ok(Self {
            clip: recordings.name(),
            rig,
            start: Start { body, pose, training, calibrate: scenario.tracker_body.calibrate },
            sources: recordings.sources(),
            seams,
            pace,
            training_sources,
            refitted,
            facts: TruthFacts {
                motion: motion_in_words(file),
                matched,
                mismatch: if matched { String::new() } else { mismatch_in_words(file) },
                contact,
                observation_seed: scenario_observation.seed_to_tell(!ground_truth.distractors.is_empty()),
                images: scenario_observation.images_of_truth(),
                retargeting: Some(RetargetFacts::new(&performed.report)),
            },
            key: seed.key,
            report: performed.report,
            notes,
            ground_truth,
        })
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.ground_truth.frames.len()
    }
}

/// Refuses a body that no camera can see.
fn check_surface(file: &ScenarioFile, key: &str, body: &Humanoid) -> Result<(), ExperimentError> {
    if body.skin.is_some() || body.links.iter().any(|link| !link.solids.is_empty()) {
        return Ok(());
    }
    let message = "expected a body that cameras can see, found no link with geometry: give its links <collision> or \
                   <visual> elements, or a skin";
    Err(scenario_error(file, key, message.to_owned()))
}

/// Notes of a robot's file; the body's last notes are those of its skin.
fn robot_notes(table: &str, body: &Humanoid, of_skin: &[String]) -> Vec<String> {
    let own = body.notes.len().saturating_sub(of_skin.len());
    body.notes[..own].iter().map(|note| format!("{table}.robot: {note}")).collect()
}

/// What to tell the user about a body that cannot stand.
fn footless(key: &str, body: &Humanoid) -> Option<String> {
    check_feet(body).err().map(|e| format!("{key}: {e}; contact is not measured"))
}

/// As [`plant_feet_if_asked`], but a body that is to be simulated is.
fn apply_contact(
    file: &ScenarioFile,
    performed: &mut Retargeted,
    pace: &[f64],
) -> Result<Option<ContactFacts>, ExperimentError> {
    if file.scenario.actor.contact != ContactMode::Simulate {
        return plant_feet_if_asked(file.scenario.actor.contact, performed, Pace(pace));
    }
    let settings = SimulationSettings {
        pace: pace.to_vec(),
        ..simulation_settings(file, &performed.humanoid, performed.motion.duration_s())?
    };
    let simulated = simulate(&performed.humanoid, &performed.motion, &settings)?;
    performed.motion = simulated.motion;
    Ok(Some(contact_facts::simulated(&performed.humanoid, &settings, &simulated.report)))
}

fn simulation_settings(
    file: &ScenarioFile,
    actor: &Humanoid,
    duration_s: f64,
) -> Result<SimulationSettings, ExperimentError> {
    let settings = &file.scenario.actor;
    let push = |push: &PushSettings| {
        let Some(link) = actor.find_link(&push.link) else {
            let meant = did_you_mean(&push.link, actor.links.iter().map(|link| link.name.as_str()));
            let meant = meant.map(|name| format!("; did you mean `{name}`?")).unwrap_or_default();
            let message = format!("expected a link of `{}`, found `{}`{meant}", settings.robot, push.link);
            return Err(scenario_error(file, "actor.push.link", message));
        };
        if push.at >= duration_s {
            let message = format!(
                "expected a time before the motion's end at {duration_s:.3} s, found {} s: the push of {} N s on `{}` \
                would never occur",
                push.at, push.impulse_ns, push.link
            );
            return Err(scenario_error(file, "actor.push.at", message));
        }
        let direction = Unit::new_normalize(Vector3::from(push.direction));
        Ok(Push { at_s: push.at, link, impulse_ns: push.impulse_ns, direction })
    };
    let default = SimulationSettings::default();
    Ok(SimulationSettings {
        friction: settings.friction.unwrap_or(default.friction),
        root_wrench: settings.root_wrench.unwrap_or(default.root_wrench),
        pushes: settings.push.iter().map(push).collect::<Result<_, _>>()?,
        props: file.scenario.prop.iter().map(PropSettings::prop).collect(),
        pace: default.pace,
    })
}

/// What to tell a user whose cameras have no lens to ignore.
fn lens_without_effect(corruption: &Corruption, rig: &CameraRig) -> Option<String> {
    let ideal = rig.cameras.iter().all(|camera| camera.distortion.is_none());
    let note = "observation.corruption.lens_ignored: no camera's lens distorts, so that nothing changes";
    (corruption.lens_ignored != 0.0 && ideal).then(|| note.to_owned())
}

/// The tracker's body: scaled to the subject that the actor was scaled to, then made wrong.
fn tracker_body(
    file: &ScenarioFile,
    template: &Humanoid,
    actor: &Retargeted,
    same_robot: bool,
) -> Result<Humanoid, ExperimentError> {
    let settings = &file.scenario.tracker_body;
    let unmet = |detail: String| scenario_error(file, "tracker_body.mismatch", detail);
    let body = match same_robot {
        _ if settings.mismatch == Mismatch::Population => {
            another_adult(file, template, &actor.humanoid).map_err(unmet)?
        }
        true => template.reshaped(&actor.shape),
        false => {
            let body = template.reshaped(&fit_shape(template, &SegmentLengths::from_body(&actor.humanoid)));
            match file.scenario.actor.shape {
                Some(_) => of_its_mass(&body, &actor.humanoid).map_err(|detail| {
                    let detail = format!("the tracker's body cannot have the actor's mass: {detail}");
                    scenario_error(file, "actor.shape", detail)
                })?,
                None => body,
            }
        }
    };
    let body = match settings.mismatch.percents() {
        None => body,
        Some((length, girth)) => {
            let seed = mismatch_seed(file, &actor.humanoid);
            body.reshaped(&BodyShape::random_mismatch(&body, seed, length / 100.0, girth / 100.0))
        }
    };
    let observation = &file.scenario.observation;
    Ok(match observation.corruption.wrong_body_percent / 100.0 {
        0.0 => body,
        share => body.reshaped(&BodyShape::random_corruption(&body, observation.keyed_seed(), share)),
    })
}

fn motion_in_words(file: &ScenarioFile) -> String {
    let motion = &file.scenario.motion;
    let frames = match (motion.first_frame, motion.last_frame) {
        (None, None) => String::new(),
        (first, last) => {
            let last = last.map_or("the last".to_owned(), |l| l.to_string());
            format!(", the file's frames {} to {last} (from 1)", first.unwrap_or(1))
        }
    };
    let repeated = motion.loop_to_s.map(|s| format!(", repeated to {s} s")).unwrap_or_default();
    let edits = edits_in_words(motion);
    let source = if motion.source.is_empty() { String::new() } else { format!(" ({})", motion.source) };
    format!("{}{frames}{repeated}{edits}{source}", motion.clip)
}

/// What was done to a recording beyond cutting and repeating it.
fn edits_in_words(motion: &MotionSettings) -> String {
    let mut words = String::new();
    if motion.mirror {
        words += ", mirrored";
    }
    if let Some(speed) = motion.speed {
        words += &format!(", {speed} times as fast");
    }
    for take in &motion.then {
        words += &format!(", then {}", take.clip);
    }
    if let Some(v) = &motion.variation {
        let Variation { seed, tempo_percent, amplitude_percent, posture_deg } = v;
        words += &format!(
            ", varied (seed {seed}: tempo {tempo_percent} %, amplitude {amplitude_percent} %, posture {posture_deg} \
             degrees)"
        );
    }
    if !motion.path_m.is_empty() {
        words += &format!(", along {} waypoints", motion.path_m.len());
    }
    words
}

fn mismatch_in_words(file: &ScenarioFile) -> String {
    let scenario = &file.scenario;
    let (actor, tracker) = (&scenario.actor.robot, &scenario.tracker_body.robot);
    let by = match scenario.tracker_body.mismatch_by {
        MismatchBy::Seed => "",
        MismatchBy::Subject => ", by subject",
    };
    let robots = (actor != tracker).then(|| format!("actor `{actor}`{AGAINST_ROBOT}`{tracker}`"));
    let percents = scenario.tracker_body.mismatch.percents().map(|(length, girth)| {
        let name = if scenario.tracker_body.mismatch == Mismatch::Standard { "standard mismatch: " } else { "" };
        let seed = scenario.tracker_body.seed;
        format!("{name}lengths within {length} %, girths within {girth} %, seed {seed}{by}")
    });
    let another = (scenario.tracker_body.mismatch == Mismatch::Population)
        .then(|| format!("another adult of the same stature, seed {}{by}", scenario.tracker_body.seed));
    let named = |skin: &Option<String>| skin.as_ref().map_or("solids".to_owned(), |skin| format!("skin `{skin}`"));
    let (own, believed) = (&scenario.actor.skin, &scenario.tracker_body.skin);
    let skins = (own != believed).then(|| format!("{} against {}", named(own), named(believed)));
    let (drawn, believed) = (scenario.actor.solids, scenario.tracker_body.solids);
    let solids = (drawn != believed).then(|| format!("solids `{}` against `{}`", drawn.name(), believed.name()));
    let wrong = scenario.observation.corruption.wrong_body_percent;
    let wrong = (wrong != 0.0).then(|| format!("then lengths and girths within {wrong} % (corruption)"));
    robots
        .into_iter()
        .chain(skins)
        .chain(solids)
        .chain(another)
        .chain(percents)
        .chain(wrong)
        .collect::<Vec<_>>()
        .join("; ")
}
