//! The summary of a scenario's edited motion: its contacts, and the seams of its takes.

use std::ops::Range;
use std::path::Path;

use serde::Serialize;

use super::contact_chart::ContactChart;
use super::{INSPECT_SCHEMA, expect_kind};
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs};
use crate::common::ExperimentError;
use crate::prepare::PreparedScene;
use crate::prepare::scenario_copy::inputs_of;
use crate::scenario::ScenarioFile;
use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_core::contact::{ContactRule, ContactTrack, GroundContacts, GroundQuality, Pace};
use skiagraph_truth::editing::Seam;

/// The motion of a scenario in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EditedSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `scenario`.
    pub what: &'static str,
    pub name: String,
    pub body: String,
    pub frames: usize,
    pub frames_per_second: f64,
    /// Time from the first frame to the last.
    pub duration_s: f64,
    /// Length of the root's path over the ground.
    pub path_m: f64,
    pub takes: Vec<String>,
    pub seams: Vec<SeamSummary>,
    /// Ground contacts; `null` for a body without feet.
    pub contact: Option<EditedContact>,
    pub fastest: Option<FastestAngle>,
    /// Mean distance of the first take's landmarks from the recorded ones.
    pub retarget_residual_mm: f64,
    /// Joint angles that reach a limit in the first take, with the number of frames.
    pub limits_hit: Vec<(String, usize)>,
    /// Notes about guesses, repairs and edits.
    pub notes: Vec<String>,
}

/// A transition between takes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeamSummary {
    /// First blended frame, from 0.
    pub first: usize,
    pub last: usize,
    pub from: String,
    pub to: String,
    pub distance_mm: f64,
    /// Mean speed of standing feet along the ground in the transition; `null` if none stands.
    pub slip_mm_per_s: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EditedContact {
    /// Mean speed of standing feet along the ground.
    pub skate_mm_per_s: f64,
    /// The greatest mean over one stance.
    pub worst_stance_mm_per_s: f64,
    /// Greatest depth of any link under the ground.
    pub penetration_mm: f64,
    /// Greatest height of a standing foot above the ground.
    pub float_mm: f64,
    /// Share of the frames in which a foot stands.
    pub standing: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FastestAngle {
    pub name: String,
    /// Its speed, rad/s (m/s of a sliding joint).
    pub speed: f64,
    /// The frame at the end of the fastest step, from 0.
    pub frame: usize,
}

impl FastestAngle {
    fn new(body: &Humanoid, motion: &Motion) -> Option<Self> {
        let steps = motion.poses.windows(2).zip(1..).flat_map(|(pair, frame)| {
            let step = (&pair[1].joint_angles - &pair[0].joint_angles).abs() * motion.frames_per_second;
            step.iter().copied().enumerate().map(move |(angle, speed)| (angle, speed, frame)).collect::<Vec<_>>()
        });
        let (angle, speed, frame) = steps.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(Self { name: body.degrees_of_freedom[angle].name.clone(), speed, frame })
    }
}

/// Summarises the edited motion of a scenario; `picture` is an `.svg` file for its stances, seams, gaps and slip over
/// time.
///
/// # Errors
/// [`ExperimentError`] if `run` would refuse its motion, bodies or cameras, or for a picture of another kind.
pub fn inspect_scenario(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    picture: Option<Destination<'_>>,
) -> Result<EditedSummary, ExperimentError> {
    let place = picture.map(|to| place_of(&inputs_of(file, mocap_directory), to)).transpose()?;
    let scene = PreparedScene::new(file, mocap_directory)?;
    let (body, motion) = (&scene.ground_truth.actor, scene.ground_truth.motion());
    let (rule, pace) = (ContactRule::default(), Pace(&scene.pace));
    let contacts = GroundContacts::from_motion_at_pace(body, &motion, &rule, pace).ok();
    if let Some(place) = place {
        let (frames, frames_per_second) = (motion.poses.len(), motion.frames_per_second);
        let seams = scene.seams.iter().map(|seam| seam.first..seam.end).collect();
        let chart = ContactChart { frames, frames_per_second, contacts: contacts.as_ref(), seams };
        place.put(chart.svg()?.as_bytes())?;
    }
    let roots: Vec<_> = motion.poses.iter().map(|pose| pose.world_from_root.translation.vector.xy()).collect();
    let hits = &scene.report.limit_hits;
    Ok(EditedSummary {
        schema: INSPECT_SCHEMA,
        what: "scenario",
        name: file.scenario.name.clone(),
        body: body.name.clone(),
        frames: motion.poses.len(),
        frames_per_second: motion.frames_per_second,
        duration_s: motion.duration_s(),
        path_m: roots.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum(),
        takes: scene.sources.iter().map(|source| source.describe()).collect(),
        seams: scene.seams.iter().map(|seam| seam_summary(seam, contacts.as_ref())).collect(),
        contact: contacts.as_ref().map(contact_summary),
        fastest: FastestAngle::new(body, &motion),
        retarget_residual_mm: scene.report.mean_residual_mm,
        limits_hit: hits
            .iter()
            .map(|hit| (hit.degree_of_freedom.clone(), hit.lower_frames + hit.upper_frames))
            .collect(),
        notes: scene.notes.clone(),
    })
}

fn place_of(inputs: &Inputs, to: Destination<'_>) -> Result<Artefact, ExperimentError> {
    expect_kind(to.path, "svg", "an .svg file for a scenario")?;
    inputs.keep_from(to.path)?;
    Ok(Artefact::begin(to, ArtefactKind::File)?)
}

fn contact_summary(contacts: &GroundContacts) -> EditedContact {
    let quality = GroundQuality::from_contacts(contacts);
    let stances = contacts
        .feet
        .iter()
        .flat_map(|foot| foot.stances().into_iter().filter_map(|stance| mean_slip(std::slice::from_ref(foot), stance)));
    EditedContact {
        skate_mm_per_s: quality.skate_mm_per_s,
        worst_stance_mm_per_s: stances.fold(0.0, f64::max),
        penetration_mm: quality.penetration_mm,
        float_mm: quality.float_mm,
        standing: quality.standing,
    }
}

/// Mean speed of standing feet along the ground in some frames, mm/s; `None` if none stands.
fn mean_slip(feet: &[ContactTrack], frames: Range<usize>) -> Option<f64> {
    let seen = feet.iter().flat_map(|foot| foot.frames.get(frames.clone()).into_iter().flatten());
    let slips: Vec<f64> = seen.filter(|f| f.in_contact).map(|f| 1000.0 * f.slip_m_per_s()).collect();
    (!slips.is_empty()).then(|| slips.iter().sum::<f64>() / slips.len() as f64)
}

fn seam_summary(seam: &Seam, contacts: Option<&GroundContacts>) -> SeamSummary {
    let slip = contacts.and_then(|contacts| mean_slip(&contacts.feet, seam.first..seam.end));
    SeamSummary {
        first: seam.first,
        last: seam.end.saturating_sub(1),
        from: seam.from.0.clone(),
        to: seam.to.0.clone(),
        distance_mm: 1000.0 * seam.distance_m,
        slip_mm_per_s: slip,
    }
}
