//! `skiagraph inspect MOTION --contacts`: ground contact of a motion, and its worst frames.

use std::path::Path;

use serde::Serialize;

use super::contact_chart::ContactChart;
use super::{INSPECT_SCHEMA, expect_kind, place_for};
use crate::artefacts::Destination;
use crate::common::ExperimentError;
use crate::prepare::clip_file;
use skiagraph_core::body::{Humanoid, Motion, shipped};
use skiagraph_core::contact::{ContactRule, ContactTrack, GroundContact, GroundContacts, GroundQuality, SelfCollision};
use skiagraph_set::BenchmarkSet;
use skiagraph_truth::mocap::ReadOptions;
use skiagraph_truth::retarget::{RetargetOptions, retarget};

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `contacts`.
    pub what: &'static str,
    pub name: String,
    pub body: String,
    pub frames: usize,
    pub frames_per_second: f64,
    /// Mean speed of standing feet along the ground.
    pub skate_mm_per_s: f64,
    /// Greatest depth of any link under the ground.
    pub penetration_mm: f64,
    /// Greatest height of a standing foot above the ground.
    pub float_mm: f64,
    /// Share of the frames in which a foot stands.
    pub standing: f64,
    /// All stances of both feet, by their first frame.
    pub stances: Vec<StanceSummary>,
    /// The greatest value of each fault that occurs.
    pub worst: Vec<WorstContact>,
    /// Notes of the reader and the retargeting.
    pub notes: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StanceSummary {
    /// `left foot` or `right foot`.
    pub foot: String,
    /// First frame, from 0.
    pub first: usize,
    pub last: usize,
    /// Time from the first frame to the last.
    pub seconds: f64,
    /// Length of the path of its lowest point along the ground.
    pub slip_mm: f64,
    /// Greatest depth under the ground.
    pub deepest_mm: f64,
    /// Greatest height above it.
    pub highest_mm: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstContact {
    /// `slip`, `penetration`, `float` or `self-penetration`.
    pub fault: &'static str,
    /// A foot, a link, two links or the whole body.
    pub part: String,
    /// Frame, from 0.
    pub frame: usize,
    /// Time of the frame, seconds.
    pub time_s: f64,
    pub value: f64,
    /// `mm` or `mm/s`.
    pub unit: &'static str,
}

/// Measures the ground contacts of a recording on the robot `actor` (`name`: a file or `embedded:NAME`), or of the
/// truth of a benchmark set (`name`: its directory). `reading` is how a recording is read. `picture` is an
/// `.svg` file for a chart over time.
pub fn inspect_contacts(
    name: &Path,
    reading: &ReadOptions,
    picture: Option<Destination<'_>>,
) -> Result<ContactSummary, ExperimentError> {
    // report an unwritable output before the work
    let place_of = |to: Destination<'_>| {
        expect_kind(to.path, "svg", "an .svg file for contacts")?;
        Ok::<_, ExperimentError>(place_for(to, [Some(name)])?)
    };
    let place = picture.map(place_of).transpose()?;
    let (body, motion, notes) = body_and_motion(name, reading)?;
    let contacts = GroundContacts::from_motion(&body, &motion, &ContactRule::default())?;
    let summary =
        ContactSummary { notes, ..ContactSummary::new(&name.display().to_string(), &body, &motion, &contacts) };
    if let Some(place) = place {
        let (frames, frames_per_second) = (motion.poses.len(), motion.frames_per_second);
        let chart = ContactChart { frames, frames_per_second, contacts: Some(&contacts), seams: Vec::new() };
        place.put(chart.svg()?.as_bytes())?;
    }
    Ok(summary)
}

fn body_and_motion(name: &Path, reading: &ReadOptions) -> Result<(Humanoid, Motion, Vec<String>), ExperimentError> {
    if name.is_dir() {
        let truth = BenchmarkSet::read(name)?.truth.ground_truth;
        let motion = truth.motion();
        return Ok((truth.actor, motion, Vec::new()));
    }
    let clip = clip_file::read_whole(name, reading)?.without_inserted_rest_pose();
    let retargeted = retarget(&clip, &shipped("actor")?, &RetargetOptions::default())?;
    Ok((retargeted.humanoid, retargeted.motion, retargeted.report.notes))
}

impl ContactSummary {
    fn new(name: &str, body: &Humanoid, motion: &Motion, contacts: &GroundContacts) -> Self {
        let quality = GroundQuality::from_contacts(contacts);
        let rate = contacts.frames_per_second;
        let mut stances: Vec<StanceSummary> = contacts.feet.iter().flat_map(|foot| of_foot(foot, rate)).collect();
        stances.sort_by_key(|stance| stance.first);
        Self {
            schema: INSPECT_SCHEMA,
            what: "contacts",
            name: name.to_owned(),
            body: body.name.clone(),
            frames: motion.poses.len(),
            frames_per_second: rate,
            skate_mm_per_s: quality.skate_mm_per_s,
            penetration_mm: quality.penetration_mm,
            float_mm: quality.float_mm,
            standing: quality.standing,
            stances,
            worst: worst(body, motion, contacts),
            notes: Vec::new(),
        }
    }
}

fn of_foot(foot: &ContactTrack, frames_per_second: f64) -> impl Iterator<Item = StanceSummary> {
    foot.stances().into_iter().map(move |stance| {
        let frames = &foot.frames[stance.clone()];
        let slip: f64 = frames.iter().map(|frame| 1000.0 * frame.slip_m_per_s()).sum();
        let greatest = |value: fn(&GroundContact) -> f64| frames.iter().map(value).fold(0.0, f64::max);
        StanceSummary {
            foot: foot.name.clone(),
            first: stance.start,
            last: stance.end - 1,
            seconds: (stance.len() - 1) as f64 / frames_per_second,
            slip_mm: slip / frames_per_second,
            deepest_mm: 1000.0 * greatest(GroundContact::penetration_m),
            highest_mm: 1000.0 * greatest(|frame| frame.gap_m),
        }
    })
}

fn worst(body: &Humanoid, motion: &Motion, contacts: &GroundContacts) -> Vec<WorstContact> {
    let found = |fault, unit, candidates: Vec<(String, usize, f64)>| {
        let (part, frame, value) = candidates.into_iter().max_by(|a, b| a.2.total_cmp(&b.2))?;
        let time_s = frame as f64 / contacts.frames_per_second;
        (value > 0.0).then_some(WorstContact { fault, part, frame, time_s, value, unit })
    };
    let of = |tracks: &[ContactTrack], stands: bool, value: fn(&GroundContact) -> f64| {
        let frames = |track: &ContactTrack| -> Vec<(String, usize, f64)> {
            let seen = track.frames.iter().enumerate().filter(|(_, frame)| frame.in_contact || !stands);
            seen.map(|(index, frame)| (track.name.clone(), index, value(frame))).collect()
        };
        tracks.iter().flat_map(frames).collect::<Vec<_>>()
    };
    let own = SelfCollision::new(body);
    let depths = motion.poses.iter().enumerate().flat_map(|(frame, pose)| {
        let collisions = own.collisions(&body.link_frames(pose)).into_iter();
        collisions.map(|c| (own.names(c.links).join(" and "), frame, 1000.0 * c.depth_m)).collect::<Vec<_>>()
    });
    let all = [
        found("slip", "mm/s", of(&contacts.feet, true, |frame| 1000.0 * frame.slip_m_per_s())),
        found("penetration", "mm", of(&contacts.links, false, |frame| 1000.0 * frame.penetration_m())),
        found("float", "mm", of(&contacts.feet, true, |frame| 1000.0 * frame.gap_m)),
        found("self-penetration", "mm", depths.collect()),
    ];
    all.into_iter().flatten().collect()
}
