//! `skiagraph inspect MOTION --contacts`: ground contact of a motion, and its worst frames.

use std::path::Path;

use serde::Serialize;

use super::{INSPECT_SCHEMA, picture_kind, place_for};
use crate::artefacts::Destination;
use crate::benchmark_set::BenchmarkSet;
use crate::body::{Humanoid, Motion, shipped};
use crate::common::ExperimentError;
use crate::contact::{ContactRule, ContactTrack, GroundContact, GroundContacts, GroundQuality, SelfCollision};
use crate::dynamics::{Dynamics, DynamicsFrame, GROUND_FRICTION};
use crate::prepare::clip_file;
use crate::report::{ContactChart, FootCourse};
use crate::retarget::{RetargetOptions, retarget};

/// The contacts of a motion in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `contacts`.
    pub what: &'static str,
    /// The motion.
    pub name: String,
    /// The body that moves.
    pub body: String,
    /// Number of frames.
    pub frames: usize,
    /// Frames per second.
    pub frames_per_second: f64,
    /// Mean speed of standing feet along the ground.
    pub skate_mm_per_s: f64,
    /// Greatest depth of any link under the ground.
    pub penetration_mm: f64,
    /// Greatest height of a standing foot above the ground.
    pub float_mm: f64,
    /// Share of the frames in which a foot stands.
    pub standing: f64,
    /// Balance and forces; `null` for a body without mass.
    pub balance: Option<BalanceSummary>,
    /// All stances of both feet, by their first frame.
    pub stances: Vec<StanceSummary>,
    /// The greatest value of each fault that occurs.
    pub worst: Vec<WorstContact>,
    /// Notes of the reader and the retargeting.
    pub notes: Vec<String>,
}

/// Balance and forces over the whole motion ([`Dynamics`] has the definitions).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BalanceSummary {
    /// Mean distance of the zero-moment point inside the edge of the support polygon, over frames that have both;
    /// negative outside.
    pub zmp_margin_mm: f64,
    /// Share of those frames in which it is outside.
    pub zmp_outside: f64,
    /// Mean wrench that ground forces cannot explain, body weights.
    pub residual_wrench_body_weights: f64,
    /// Greatest effort of a joint, N m (N) per kilogram of the body.
    pub greatest_effort_per_kg: f64,
    /// Share of frames with a joint beyond its limits.
    pub beyond_limits: f64,
    /// Share of frames with a joint faster than its greatest speed.
    pub too_fast: f64,
}

impl BalanceSummary {
    fn new(dynamics: &Dynamics) -> Self {
        let summary = dynamics.summary();
        let [beyond_limits, too_fast] = summary.violations;
        Self {
            zmp_margin_mm: 1000.0 * summary.margin_m,
            zmp_outside: summary.outside,
            residual_wrench_body_weights: summary.residual,
            greatest_effort_per_kg: summary.greatest_effort_per_kg,
            beyond_limits,
            too_fast,
        }
    }
}

/// One stance of one foot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StanceSummary {
    /// `left foot` or `right foot`.
    pub foot: String,
    /// First frame, from 0.
    pub first: usize,
    /// Last frame.
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

/// The worst frame of one fault.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstContact {
    /// `slip`, `penetration`, `float`, `self-penetration`, `imbalance` (distance of the zero-moment point outside the
    /// support polygon) or `residual force`.
    pub fault: &'static str,
    /// A foot, a link, two links or the whole body.
    pub part: String,
    /// Frame, from 0.
    pub frame: usize,
    /// Time of the frame, seconds.
    pub time_s: f64,
    /// The value.
    pub value: f64,
    /// `mm`, `mm/s` or `body weights`.
    pub unit: &'static str,
}

impl WorstContact {
    /// Number of meaningful decimals of its value.
    pub fn decimals(&self) -> usize {
        if self.unit == "body weights" { 2 } else { 1 }
    }
}

/// Measures the ground contacts of a recording on the robot `actor` (`name`: a file or `embedded:NAME`), or of the
/// truth of a benchmark set (`name`: its directory). `metres_per_unit` overrides a recording's unit. `picture` is an
/// `.svg` or `.html` file for a chart over time.
///
/// # Errors
/// [`ExperimentError`] that names the unreadable file, or a picture of another kind.
pub fn inspect_contacts(
    name: &Path,
    metres_per_unit: Option<f64>,
    picture: Option<Destination<'_>>,
) -> Result<ContactSummary, ExperimentError> {
    // report an unwritable output before the work
    let place_of = |to: Destination<'_>| {
        let kind = picture_kind(to.path, &["svg", "html"], "an .svg or .html file")?;
        Ok::<_, ExperimentError>((place_for(to, [Some(name)])?, kind))
    };
    let place = picture.map(place_of).transpose()?;
    let (body, motion, notes) = body_and_motion(name, metres_per_unit)?;
    let contacts = GroundContacts::from_motion(&body, &motion, &ContactRule::default())?;
    let dynamics = Dynamics::from_motion(&body, &motion, &contacts, GROUND_FRICTION).ok();
    let summary = ContactSummary {
        notes,
        ..ContactSummary::new(&name.display().to_string(), &body, &motion, &contacts, dynamics.as_ref())
    };
    if let Some((place, kind)) = place {
        let chart = chart(&summary, &contacts, dynamics.as_ref());
        let text = if kind == "html" { chart.page()? } else { chart.svg()? };
        place.put(text.as_bytes())?;
    }
    Ok(summary)
}

/// The moving body, its motion, and notes.
fn body_and_motion(
    name: &Path,
    metres_per_unit: Option<f64>,
) -> Result<(Humanoid, Motion, Vec<String>), ExperimentError> {
    if name.is_dir() {
        let truth = BenchmarkSet::read(name)?.truth.ground_truth;
        let motion = truth.motion();
        return Ok((truth.actor, motion, Vec::new()));
    }
    let clip = clip_file::read_whole(name, metres_per_unit)?.without_inserted_rest_pose();
    let retargeted = retarget(&clip, &shipped("actor")?, &RetargetOptions::default())?;
    Ok((retargeted.humanoid, retargeted.motion, retargeted.report.notes))
}

impl ContactSummary {
    fn new(
        name: &str,
        body: &Humanoid,
        motion: &Motion,
        contacts: &GroundContacts,
        dynamics: Option<&Dynamics>,
    ) -> Self {
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
            balance: dynamics.map(BalanceSummary::new),
            stances,
            worst: worst(body, motion, contacts, dynamics),
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

fn worst(
    body: &Humanoid,
    motion: &Motion,
    contacts: &GroundContacts,
    dynamics: Option<&Dynamics>,
) -> Vec<WorstContact> {
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
    let whole = |value: fn(&DynamicsFrame) -> Option<f64>| {
        let frames = dynamics.into_iter().flat_map(|dynamics| dynamics.frames.iter().enumerate());
        let values = frames.filter_map(|(frame, d)| Some((body.name.clone(), frame, value(d)?)));
        values.collect::<Vec<_>>()
    };
    let all = [
        found("slip", "mm/s", of(&contacts.feet, true, |frame| 1000.0 * frame.slip_m_per_s())),
        found("penetration", "mm", of(&contacts.links, false, |frame| 1000.0 * frame.penetration_m())),
        found("float", "mm", of(&contacts.feet, true, |frame| 1000.0 * frame.gap_m)),
        found("self-penetration", "mm", depths.collect()),
        found("imbalance", "mm", whole(|frame| frame.margin_m.map(|margin| -1000.0 * margin))),
        found("residual force", "body weights", whole(|frame| Some(frame.residual))),
    ];
    all.into_iter().flatten().collect()
}

fn chart(summary: &ContactSummary, contacts: &GroundContacts, dynamics: Option<&Dynamics>) -> ContactChart {
    let course = |foot: &ContactTrack| FootCourse {
        name: foot.name.clone(),
        stances: foot.stances().into_iter().map(|stance| [stance.start, stance.end]).collect(),
        gap_mm: foot.frames.iter().map(|frame| 1000.0 * frame.gap_m).collect(),
        slip_mm_per_s: foot.frames.iter().map(|frame| 1000.0 * frame.slip_m_per_s()).collect(),
    };
    let [left, right] = &contacts.feet;
    let heads =
        ["foot", "first frame, from 0", "last frame, from 0", "time, s", "slip, mm", "deepest, mm", "highest, mm"];
    let row = |s: &StanceSummary| {
        vec![
            s.foot.clone(),
            s.first.to_string(),
            s.last.to_string(),
            format!("{:.2}", s.seconds),
            format!("{:.1}", s.slip_mm),
            format!("{:.1}", s.deepest_mm),
            format!("{:.1}", s.highest_mm),
        ]
    };
    let worst = summary.worst.iter().map(|w| {
        let decimals = w.decimals();
        let (value, unit) = (format!("{:.decimals$}", w.value), w.unit);
        format!("Greatest {}: {value} {unit}, {}, frame {} from 0 ({:.2} s).", w.fault, w.part, w.frame, w.time_s)
    });
    let over_time = |label: &str, value: fn(&DynamicsFrame) -> Option<f64>| {
        dynamics.map(|dynamics| (label.to_owned(), dynamics.frames.iter().map(value).collect()))
    };
    let others = [
        over_time("zero-moment point inside the support polygon, mm (below 0: outside)", |frame| {
            frame.margin_m.map(|margin| 1000.0 * margin)
        }),
        over_time("residual force at the root, % of body weight", |frame| Some(100.0 * frame.residual)),
    ];
    ContactChart {
        title: summary.name.clone(),
        frames_per_second: summary.frames_per_second,
        feet: [course(left), course(right)],
        others: others.into_iter().flatten().collect(),
        summary: worst.collect(),
        table: (heads.map(str::to_owned).to_vec(), summary.stances.iter().map(row).collect()),
    }
}
