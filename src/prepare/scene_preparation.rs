//! Builds bodies, motion, cameras and ground truth from a scenario.

use std::path::Path;

use nalgebra::{Unit, Vector3};

use super::clip_file::Folders;
use super::distractors::{SceneDistractors, distractors};
use super::mismatch_seed::mismatch_seed;
use super::people::{another_adult, with_mass_of};
use super::retargeted_motion::{Recordings, RetargetedMotion};
use super::retargeting::{apply_contact_mode, refit};
use super::rig::{rig, rig_notes};
use super::rig_doubts::doubts;
use super::robots::{RobotChoice, robot};
use super::skins::{WornSkin, attach_skin};
use super::{contact_facts, training};
use crate::common::{ExperimentError, key_error};
use crate::scenario::{
    ContactMode, KeyError, Mismatch, MismatchBy, MotionSettings, PropSettings, PushSettings, Scenario, ScenarioFile,
    did_you_mean,
};
use skiagraph_core::body::{Blending, BodyShape, Humanoid, Markers, Motion};
use skiagraph_core::camera::{Camera, CameraRig, TimedRig};
use skiagraph_core::contact::{Pace, check_feet};
use skiagraph_core::rng::ObservationKey;
use skiagraph_physics::{Push, SimulationSettings, simulate};
use skiagraph_set::{
    ContactFacts, RetargetFacts, RigMoments, SetParts, SourceRecording, Start, StepSpread, Training, TruthFacts,
    TruthImage,
};
use skiagraph_truth::editing::{Seam, Variation};
use skiagraph_truth::observing::{
    BackgroundSettings, Corruption, ImageSettings, LEAST_BACKGROUND, ObservationFacts, SilhouetteSource, tracker_start,
};
use skiagraph_truth::retarget::plausibility::ACCEPTED;
use skiagraph_truth::retarget::{RetargetReport, Retargeted, SegmentLengths, fit_shape};
use skiagraph_truth::scene::GroundTruth;

/// The scene of a scenario, ready to be rendered.
#[derive(Clone, Debug)]
pub struct PreparedScene {
    /// Names of the recordings.
    pub clip: String,
    /// The true cameras, how they move and when they take images.
    pub rig: TimedRig,
    pub ground_truth: GroundTruth,
    /// The frames of the recorded files that the actor performs.
    pub sources: Vec<SourceRecording>,
    /// Where takes were joined.
    pub seams: Vec<Seam>,
    /// Each frame's speed relative to the recording; empty if all frames have the recorded speed.
    pub pace: Vec<f64>,
    /// The frames of the recorded files that the training motions perform.
    pub training_sources: Vec<SourceRecording>,
    /// What the tracker is given.
    pub start: Start,
    /// The tracker's body fitted to the truth; one pose per frame.
    pub refitted: Motion,
    /// How well the recording was retargeted to the actor.
    pub report: RetargetReport,
    pub facts: TruthFacts,
    /// The secret key of the observations' random numbers.
    pub key: ObservationKey,
    /// Notes about guesses, repaired frames and doubtful views.
    pub notes: Vec<String>,
}

impl PreparedScene {
    /// Reads the files of a scenario and prepares its scene. Clips are also searched below `mocap_directory`.
    pub fn new(file: &ScenarioFile, mocap_directory: Option<&Path>) -> Result<Self, ExperimentError> {
        Self::of(&file.scenario, Folders::of(file, mocap_directory)).map_err(|error| error.located(file))
    }

    /// As [`Self::new`]; errors name keys without the file and line.
    fn of(scenario: &Scenario, places: Folders<'_>) -> Result<Self, ExperimentError> {
        let recordings = Recordings::load(places, "motion", &scenario.motion)?;
        let of_actor = RobotChoice::of_actor(&scenario.actor);
        let of_tracker = RobotChoice::of_tracker(&scenario.tracker_body);
        let (actor, tracker) = (&scenario.actor, &scenario.tracker_body);
        let skin = WornSkin { name: actor.skin.as_ref(), joint_map: &actor.joint_map, blending: actor.skin_blending };
        let actor_template = Template::read(places.folder, "actor", &of_actor, skin)?;
        let blending = Blending::Linear;
        let skin = WornSkin { name: tracker.skin.as_ref(), joint_map: &tracker.joint_map, blending };
        let tracker_template = Template::read(places.folder, "tracker_body", &of_tracker, skin)?;
        let same_robot = actor_template.bare.is_same_body(&tracker_template.bare);
        let RetargetedMotion { mut retargeted, seams, pace } =
            recordings.retarget_to(&of_actor, &actor_template.body, actor.shape.as_ref())?;
        retargeted.humanoid = retargeted.humanoid.with_masses_of_skin();
        let contact = apply_contact(scenario, &mut retargeted, &pace)?;
        let body = tracker_body(scenario, &tracker_template.body, &retargeted, same_robot)?.with_masses_of_skin();
        let learned = training::load(scenario, places, &actor_template.body, &body, &recordings.sources())?;
        let (training, training_sources) = match learned {
            Some(learned) => (Training::Motions(learned.training), learned.sources),
            None if same_robot => (Training::Spread(StepSpread::of_motion(&body, &retargeted.motion)?), Vec::new()),
            None => {
                let RetargetedMotion { retargeted: mut own, pace, .. } =
                    recordings.retarget_to(&of_tracker, &tracker_template.body, actor.shape.as_ref())?;
                if check_feet(&own.humanoid).is_ok() {
                    apply_contact_mode(scenario.actor.contact, &mut own, Pace(&pace))?;
                }
                (Training::Spread(StepSpread::of_motion(&body, &own.motion)?), Vec::new())
            }
        };
        let rig = rig(&scenario.rig, places.folder, &retargeted.motion)?;
        let doubts = doubts(&scenario.rig, places.folder, &retargeted.motion)?;
        let props = scenario.prop.iter().map(PropSettings::prop).collect();
        let frames = retargeted.motion.poses.len();
        let SceneDistractors { distractors, notes: distractor_notes } = distractors(scenario, places, frames)?;
        let ground_truth = GroundTruth::among(retargeted.humanoid, &retargeted.motion, &rig, props, distractors)?;
        let matched = body.is_same_body(&ground_truth.actor);
        let refitted = if matched {
            retargeted.motion
        } else {
            let markers: Vec<Markers> = ground_truth.frames.iter().map(|frame| frame.markers).collect();
            refit(&body, &markers, ground_truth.frames_per_second)
        };
        let Some(pose) = refitted.poses.first().cloned() else {
            return Err(key_error("motion", "expected at least one frame, found none"));
        };
        let scenario_observation = &scenario.observation;
        let (corruption, seed) = (&scenario_observation.corruption, scenario_observation.keyed_seed());
        let pose = tracker_start(&body, &pose, corruption, seed);
        let given_moments = RigMoments::for_tracker(&rig, &ground_truth, Some(&scenario_observation.facts()), seed);
        let mut notes = retargeted.report.notes.clone();
        notes.extend(doubts);
        notes.extend(lens_note(corruption, rig.rig()));
        notes.extend(rig.rig().cameras.iter().filter_map(lens_doubt));
        notes.extend(image_notes(scenario));
        let rate = ground_truth.frames_per_second;
        notes.extend(given_moments.iter().flat_map(|given_moments| rig_notes(given_moments, rig.rig(), rate)));
        notes.extend(contact.iter().map(|contact| format!("contact: {}", contact.outcome)));
        notes.extend(actor_template.robot_notes("actor"));
        if !same_robot {
            notes.extend(tracker_template.robot_notes("tracker_body"));
        }
        notes.extend(actor_template.skin_notes.iter().map(|note| format!("actor.skin: {note}")));
        notes.extend(tracker_template.skin_notes.iter().map(|note| format!("tracker_body.skin: {note}")));
        notes.extend(distractor_notes);
        notes.extend(footless_note("actor.robot", &ground_truth.actor));
        notes.extend(footless_note("tracker_body.robot", &body));
        notes.extend(unseen_note(&ground_truth, &rig));
        Ok(Self {
            clip: recordings.name(),
            rig,
            start: Start {
                body,
                pose,
                training,
                calibrate: scenario.tracker_body.calibrated(),
                has_known_stature: false,
            },
            sources: recordings.sources(),
            seams,
            pace,
            training_sources,
            refitted,
            facts: TruthFacts {
                motion: describe_motion(&scenario.motion) + accepted_words(&retargeted.report),
                matched,
                mismatch: if matched { String::new() } else { describe_mismatch(scenario) },
                contact,
                observation_seed: scenario_observation.seed_to_tell(!ground_truth.distractors.is_empty()),
                images: scenario_observation.images_of_truth(),
                retargeting: Some(RetargetFacts::new(&retargeted.report)),
            },
            key: seed.key,
            report: retargeted.report,
            notes,
            ground_truth,
        })
    }

    /// The parts of the scene's set; `name` is that of the scenario.
    pub(crate) fn set_parts<'a>(&'a self, name: &'a str, observation: Option<&'a ObservationFacts>) -> SetParts<'a> {
        SetParts {
            name,
            rig: &self.rig,
            start: &self.start,
            ground_truth: &self.ground_truth,
            refitted: Some(&self.refitted),
            facts: &self.facts,
            recordings: &self.sources,
            observation,
            key: self.key,
        }
    }

    pub fn frames(&self) -> usize {
        self.ground_truth.frames.len()
    }
}

/// Refuses a body that no camera can see.
fn check_surface(key: &str, body: &Humanoid) -> Result<(), KeyError> {
    if body.skin.is_some() || body.links.iter().any(|link| !link.solids.is_empty()) {
        return Ok(());
    }
    let message = "expected a body that cameras can see, found no link with geometry: give its links <collision> or \
                   <visual> elements, or a skin";
    Err(KeyError::new(key, message))
}

/// A robot as its file has it, and with its skin.
struct Template {
    bare: Humanoid,
    body: Humanoid,
    skin_notes: Vec<String>,
}

impl Template {
    fn read(folder: &Path, table: &str, choice: &RobotChoice<'_>, skin: WornSkin<'_>) -> Result<Self, ExperimentError> {
        let bare = robot(folder, choice)?;
        let (body, skin_notes) = attach_skin(folder, table, bare.clone(), skin)?;
        check_surface(&format!("{table}.robot"), &body)?;
        Ok(Self { bare, body, skin_notes })
    }

    /// Notes about the robot's file. The body's last notes, those of its skin, are left out.
    fn robot_notes(&self, table: &str) -> Vec<String> {
        let own = self.body.notes.len().saturating_sub(self.skin_notes.len());
        self.body.notes[..own].iter().map(|note| format!("{table}.robot: {note}")).collect()
    }
}

fn unseen_note(truth: &GroundTruth, rig: &TimedRig) -> Option<String> {
    let (unseen, frames) = (truth.unseen_frames(rig).len(), truth.frames.len());
    let note = format!("no camera sees the subject in {unseen} of {frames} frames; move the cameras or look_at_m");
    (unseen > 0).then_some(note)
}

fn footless_note(key: &str, body: &Humanoid) -> Option<String> {
    check_feet(body).err().map(|e| format!("{key}: {e}; contact is not measured"))
}

/// As [`apply_contact_mode`], and simulates the motion for [`ContactMode::Simulate`].
fn apply_contact(
    scenario: &Scenario,
    retargeted: &mut Retargeted,
    pace: &[f64],
) -> Result<Option<ContactFacts>, ExperimentError> {
    if scenario.actor.contact != ContactMode::Simulate {
        return apply_contact_mode(scenario.actor.contact, retargeted, Pace(pace));
    }
    let settings = SimulationSettings {
        pace: pace.to_vec(),
        ..simulation_settings(scenario, &retargeted.humanoid, retargeted.motion.duration_s())?
    };
    let simulated = simulate(&retargeted.humanoid, &retargeted.motion, &settings)?;
    retargeted.motion = simulated.motion;
    Ok(Some(contact_facts::simulated(&retargeted.humanoid, &settings, &simulated.report)))
}

fn simulation_settings(scenario: &Scenario, actor: &Humanoid, duration_s: f64) -> Result<SimulationSettings, KeyError> {
    let settings = &scenario.actor;
    let pushes = settings.push.iter().map(|push| simulated_push(push, actor, &settings.robot, duration_s));
    let default = SimulationSettings::default();
    Ok(SimulationSettings {
        friction: settings.friction.unwrap_or(default.friction),
        root_wrench: settings.root_wrench.unwrap_or(default.root_wrench),
        pushes: pushes.collect::<Result<_, _>>()?,
        props: scenario.prop.iter().map(PropSettings::prop).collect(),
        pace: default.pace,
    })
}

/// A push of the body of `robot` in a motion of this duration.
fn simulated_push(push: &PushSettings, body: &Humanoid, robot: &str, duration_s: f64) -> Result<Push, KeyError> {
    let Some(link) = body.find_link(&push.link) else {
        let meant = did_you_mean(&push.link, body.links.iter().map(|link| link.name.as_str()));
        let meant = meant.map(|name| format!("; did you mean `{name}`?")).unwrap_or_default();
        let message = format!("expected a link of `{robot}`, found `{}`{meant}", push.link);
        return Err(KeyError::new("actor.push.link", message));
    };
    if push.at >= duration_s {
        let message = format!(
            "expected a time before the motion's end at {duration_s:.3} s, found {} s: the push of {} N s on `{}` \
            would never occur",
            push.at, push.impulse_ns, push.link
        );
        return Err(KeyError::new("actor.push.at", message));
    }
    let direction = Unit::new_normalize(Vector3::from(push.direction));
    Ok(Push { at_s: push.at, link, impulse_ns: push.impulse_ns, direction })
}

/// Settings of images and of background subtraction that have no effect, and too few images of the background.
fn image_notes(scenario: &Scenario) -> Vec<String> {
    let observation = &scenario.observation;
    let segmented = observation.silhouette == SilhouetteSource::Segmented;
    let takes_images =
        segmented || observation.colour_images.is_some() || scenario.truth_images.contains(&TruthImage::Colour);
    let has_no_effect = |key: &str| {
        format!(
            "observation.{key}: the silhouettes are not segmented from images (silhouette = \"segmented\"), so this has no effect"
        )
    };
    let mut notes = Vec::new();
    if !takes_images && observation.images != ImageSettings::default() {
        notes.push(has_no_effect("images"));
    }
    if !segmented && observation.background != BackgroundSettings::default() {
        notes.push(has_no_effect("background"));
    }
    let frames = observation.images.background_frames;
    if segmented && (frames as usize) < LEAST_BACKGROUND {
        notes.push(format!(
            "observation.images.background_frames: {frames} image(s) tell little of the background's noise; 20 are usual"
        ));
    }
    notes
}

fn lens_note(corruption: &Corruption, rig: &CameraRig) -> Option<String> {
    let ideal = rig.cameras.iter().all(|camera| camera.distortion.is_none());
    let note = "observation.corruption.lens_ignored: no camera has lens distortion, so this has no effect";
    (corruption.lens_ignored != 0.0 && ideal).then(|| note.to_owned())
}

/// Greatest tangential coefficient of a real lens: cheap ones have 0.005; more only beside a k3 that is fitted too. The
/// third and fourth coefficients of a fisheye lens (`cv2.fisheye`) have the places of p1 and p2.
const MOST_TANGENTIAL: f64 = 0.01;
/// The pincushion distortion of photographic lenses is a few percent.
const MOST_STRETCH: f64 = 1.2;

fn lens_doubt(camera: &Camera) -> Option<String> {
    let [k1, k2, p1, p2, k3] = camera.distortion.coefficients();
    let fisheye = "if its coefficients are k1 k2 k3 k4 of a fisheye lens, undistort the images by that model and give \
                   the new K without distortion";
    if p1.abs().max(p2.abs()) > MOST_TANGENTIAL && k3 == 0.0 {
        return Some(format!(
            "camera {:?}: its distortion is read as k1 = {k1}, k2 = {k2}, p1 = {p1}, p2 = {p2}, and a real lens has \
             tangential p1 and p2 below {MOST_TANGENTIAL}: {fisheye}",
            camera.name
        ));
    }
    if let Some(stretch) = camera.corner_stretch().filter(|stretch| *stretch > MOST_STRETCH) {
        return Some(format!(
            "camera {:?}: its lens moves the corner of the image outwards, to {stretch:.2} times its distance, and a real lens \
             to at most {MOST_STRETCH}; check its distortion",
            camera.name
        ));
    }
    let radius = camera.fold_radius_px()?;
    let fisheye = if k3 == 0.0 && (p1, p2) != (0.0, 0.0) { format!("; {fisheye}") } else { String::new() };
    Some(format!(
        "camera {:?}: its lens model folds back {radius:.1} px from the principal point, within the image, which shows \
         nothing beyond; check its distortion{fisheye}",
        camera.name
    ))
}

/// The tracker's body: scaled to the actor's subject, then with the mismatch of the settings.
fn tracker_body(
    scenario: &Scenario,
    template: &Humanoid,
    actor: &Retargeted,
    same_robot: bool,
) -> Result<Humanoid, KeyError> {
    let settings = &scenario.tracker_body;
    let body = if settings.mismatch == Mismatch::Population {
        another_adult(scenario, template, &actor.humanoid)
            .map_err(|detail| KeyError::new("tracker_body.mismatch", detail))?
    } else if same_robot {
        template.reshaped(&actor.shape)
    } else {
        let body = template.reshaped(&fit_shape(template, &SegmentLengths::from_body(&actor.humanoid)));
        match scenario.actor.shape {
            Some(_) => with_mass_of(&body, &actor.humanoid).map_err(|detail| {
                KeyError::new("actor.shape", format!("the tracker's body cannot have the actor's mass: {detail}"))
            })?,
            None => body,
        }
    };
    let body = match settings.mismatch.percents() {
        None => body,
        Some((length, girth)) => {
            let seed = mismatch_seed(scenario, &actor.humanoid);
            body.reshaped(&BodyShape::random_mismatch(&body, seed, length / 100.0, girth / 100.0))
        }
    };
    let observation = &scenario.observation;
    Ok(match observation.corruption.wrong_body_percent / 100.0 {
        0.0 => body,
        share => body.reshaped(&BodyShape::random_corruption(&body, observation.keyed_seed(), share)),
    })
}

fn describe_motion(motion: &MotionSettings) -> String {
    let frames = match (motion.first_frame, motion.last_frame) {
        (None, None) => String::new(),
        (first, last) => {
            let last = last.map_or("the last".to_owned(), |l| l.to_string());
            format!(", the file's frames {} to {last} (from 1)", first.unwrap_or(1))
        }
    };
    let repeated = motion.loop_to_s.map(|s| format!(", repeated to {s} s")).unwrap_or_default();
    let edits = describe_edits(motion);
    let source = if motion.source.is_empty() { String::new() } else { format!(" ({})", motion.source) };
    format!("{}{frames}{repeated}{edits}{source}", motion.clip)
}

fn accepted_words(report: &RetargetReport) -> &'static str {
    let is_accepted = report.notes.iter().any(|note| note.contains(ACCEPTED));
    if is_accepted { "; no human body moves so, accepted by `accept_implausible`" } else { "" }
}

fn describe_edits(motion: &MotionSettings) -> String {
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

fn describe_mismatch(scenario: &Scenario) -> String {
    let (actor, tracker) = (&scenario.actor.robot, &scenario.tracker_body.robot);
    let by = match scenario.tracker_body.mismatch_by {
        MismatchBy::Seed => "",
        MismatchBy::Subject => ", by subject",
    };
    let robots = (actor != tracker).then(|| format!("actor `{actor}` against tracker's `{tracker}`"));
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
