//! A skeleton from points: joint positions are joint centres, rotations are segment orientations.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::anatomical::{LEG, MarkerFrame, SIDES, along};
use super::frames::MetricPoints;
use super::names::{KnownPoints, short_list};
use super::{PointFile, malformed};
use crate::mocap::recording::held;
use crate::mocap::rotation::make_signs_continuous;
use crate::mocap::{Clip, MocapError, ReadOptions, Skeleton, SkeletonJoint, clip};

/// Joints with their parents; each side's joints are contiguous.
const JOINTS: [(&str, Option<usize>); 16] = [
    ("pelvis", None),
    ("left_hip", Some(0)),
    ("left_knee", Some(1)),
    ("left_ankle", Some(2)),
    ("right_hip", Some(0)),
    ("right_knee", Some(4)),
    ("right_ankle", Some(5)),
    ("chest", Some(0)),
    ("neck", Some(7)),
    ("head", Some(8)),
    ("left_shoulder", Some(7)),
    ("left_elbow", Some(10)),
    ("left_wrist", Some(11)),
    ("right_shoulder", Some(7)),
    ("right_elbow", Some(13)),
    ("right_wrist", Some(14)),
];
const HEAD: usize = 9;
const ANKLES: [usize; 2] = [3, 6];

/// Converts the points of a file to a clip; `before` frames were left out before them.
pub(in crate::mocap) fn clip_from_points(
    file: &str,
    points: PointFile,
    before: usize,
    options: &ReadOptions,
) -> Result<Clip, MocapError> {
    let known = KnownPoints::of(file, &points.names, &options.markers, options.sides)?;
    let unknown = known.unknown.clone();
    let rate = options.frames_per_second.or(points.frames_per_second);
    let rate = rate.ok_or_else(|| malformed(file, "the file declares no frame rate; set `source_hz`"))?;
    if points.frames.is_empty() {
        return Err(MocapError::too_few_frames(file, 0));
    }
    let mut placed = MetricPoints::of(file, points, &known, options)?;
    if placed.frames.len() == 1 {
        placed.frames = held(&placed.frames, rate, &mut placed.notes);
    }
    let stature = stature_for_missing_parts(&mut placed, before);
    let (mut worlds, mut tips) = (Vec::new(), [Vector3::zeros(); 3]);
    for (index, points) in placed.frames.iter().enumerate() {
        let found = joints_of_frame(&MarkerFrame { points, stature }).map_err(|lacking| match lacking {
            BodyFailure::Joints(names) => missing_points_error(file, &names, before, index, &placed, &unknown),
            BodyFailure::Collinear => malformed(file, collinear_message(before + index)),
        })?;
        let ends = [(HEAD, found.head_top), (ANKLES[0], found.toes[0]), (ANKLES[1], found.toes[1])];
        for (tip, (joint, end)) in tips.iter_mut().zip(ends) {
            let own = end.map_or(Vector3::zeros(), |end| found.joints[joint].inverse_transform_point(&end).coords);
            *tip += own / placed.frames.len() as f64;
        }
        worlds.push(found.joints);
    }
    let tip = |joint: usize| match joint {
        HEAD => Some(tips[0]),
        joint => ANKLES.iter().position(|ankle| *ankle == joint).map(|side| tips[1 + side]).filter(|t| t.norm() > 0.01),
    };
    let joint = |(index, (name, parent)): (usize, &(&str, Option<usize>))| SkeletonJoint {
        name: (*name).to_owned(),
        parent: *parent,
        tip: tip(index),
    };
    let local = |world: &Vec<Isometry3<f64>>| {
        let own = |joint: usize| JOINTS[joint].1.map_or(world[joint], |parent| world[parent].inverse() * world[joint]);
        (0..JOINTS.len()).map(own).collect()
    };
    if !unknown.is_empty() {
        placed.notes.push(format!("unused points: {}", short_list(&unknown)));
    }
    let mut clip = Clip {
        name: clip::clip_name(file),
        skeleton: Skeleton { joints: JOINTS.iter().enumerate().map(joint).collect() },
        frames_per_second: rate,
        frames: worlds.iter().map(local).collect(),
        notes: placed.notes,
        cyclic: false,
        up: placed.up,
    };
    make_signs_continuous(&mut clip.frames);
    Ok(clip)
}

/// The subject's stature by the length of the legs, metres, if parts of the upper body have no markers, with a note;
/// `None` if all parts have some, or the legs have not.
fn stature_for_missing_parts(placed: &mut MetricPoints, before: usize) -> Option<f64> {
    let first = MarkerFrame { points: placed.frames.first()?, stature: None };
    let Err(BodyFailure::Joints(lacking)) = joints_of_frame(&first) else { return None };
    let mut legs = Vec::new();
    for points in &placed.frames {
        let frame = MarkerFrame { points, stature: None };
        for side in SIDES {
            let (hip, knee, ankle) = (frame.hip(side)?, frame.knee(side)?, frame.ankle(side)?);
            legs.push((hip - knee).norm() + (knee - ankle).norm());
        }
    }
    legs.sort_by(f64::total_cmp);
    let stature = legs.get(legs.len() / 2)? / LEG;
    let whole = whole_frames(before, placed).filter(|_| !placed.seldom.is_empty());
    placed.notes.push(format!(
        "no markers of {}: placed by the proportions of a person of {stature:.2} m (by the length of the legs); without \
         others arms hang and the trunk is upright{}",
        lacking.join(", "),
        whole.map_or(String::new(), |whole| format!("; {whole}"))
    ));
    Some(stature)
}

/// Joints and end points of one frame.
struct FrameJoints {
    joints: Vec<Isometry3<f64>>,
    head_top: Option<Point3<f64>>,
    toes: [Option<Point3<f64>>; 2],
}

/// Why the points of a frame do not define a body.
enum BodyFailure {
    /// These joints cannot be located.
    Joints(Vec<String>),
    /// The points of pelvis, chest or head are collinear.
    Collinear,
}

/// `world_from_joint` of all joints, in the order of [`JOINTS`].
fn joints_of_frame(frame: &MarkerFrame<'_>) -> Result<FrameJoints, BodyFailure> {
    let mut lacking = Vec::new();
    let mut need = |name: &str, place: Option<Point3<f64>>| {
        if place.is_none() {
            lacking.push(name.to_owned());
        }
        place.unwrap_or_else(Point3::origin)
    };
    let neck = need("thorax", frame.neck());
    let head_top = need("head_top", frame.head_top());
    let mut limbs: BTreeMap<&str, [Point3<f64>; 2]> = BTreeMap::new();
    for (index, side) in SIDES.into_iter().enumerate() {
        for (name, place) in [
            ("hip", frame.hip(side)),
            ("knee", frame.knee(side)),
            ("ankle", frame.ankle(side)),
            ("shoulder", frame.shoulder(side)),
            ("elbow", frame.elbow(side)),
            ("wrist", frame.wrist(side)),
        ] {
            let place = need(&format!("{}_{name}", side.word), place);
            limbs.entry(name).or_insert([Point3::origin(); 2])[index] = place;
        }
    }
    if !lacking.is_empty() {
        return Err(BodyFailure::Joints(lacking));
    }
    let turns = (frame.pelvis(), frame.thorax(), frame.head());
    let (Some(pelvis), Some(chest), Some(head)) = turns else {
        return Err(BodyFailure::Collinear);
    };
    let at = |place: Point3<f64>, turn: UnitQuaternion<f64>| Isometry3::from_parts(place.coords.into(), turn);
    let bone = |upper: &str, lower: &str, side: usize, left: UnitQuaternion<f64>| {
        along(limbs[upper][side] - limbs[lower][side], left * Vector3::y()).unwrap_or(left)
    };
    let mut joints = vec![Isometry3::identity(); JOINTS.len()];
    joints[0] = at(nalgebra::center(&limbs["hip"][0], &limbs["hip"][1]), pelvis);
    for (index, side) in SIDES.into_iter().enumerate() {
        let (leg, arm) = (1 + 3 * index, 10 + 3 * index);
        let thigh = bone("hip", "knee", index, pelvis);
        let shank = bone("knee", "ankle", index, thigh);
        let upper_arm = bone("shoulder", "elbow", index, chest);
        let forearm = bone("elbow", "wrist", index, upper_arm);
        let chain = [(leg, "hip", thigh), (leg + 1, "knee", shank), (leg + 2, "ankle", frame.foot(side, shank))];
        let arms = [(arm, "shoulder", upper_arm), (arm + 1, "elbow", forearm), (arm + 2, "wrist", forearm)];
        for (joint, name, turn) in chain.into_iter().chain(arms) {
            joints[joint] = at(limbs[name][index], turn);
        }
    }
    joints[7] = at(neck, chest);
    joints[8] = at(neck, chest);
    joints[HEAD] = at(neck, head);
    Ok(FrameJoints { joints, head_top: Some(head_top), toes: SIDES.map(|side| frame.toes(side)) })
}

/// The error for joints that cannot be located in a frame, with `before` frames left out before the first.
fn missing_points_error(
    file: &str,
    lacking: &[String],
    before: usize,
    frame: usize,
    placed: &MetricPoints,
    unknown: &[String],
) -> MocapError {
    let detail = format!("cannot locate {} in frame {} (from 1)", lacking.join(", "), before + frame + 1);
    let whole = whole_frames(before, placed);
    let seldom = if placed.seldom.is_empty() {
        String::new()
    } else {
        let whole = whole.as_ref().map_or(String::new(), |whole| format!("; {whole}"));
        format!(": {} not seen often enough{whole}", short_list(&placed.seldom))
    };
    // points that are not recognised may be what is lacking
    let detail = if whole.is_some() && !seldom.is_empty() && unknown.is_empty() {
        format!("{detail}{seldom}")
    } else {
        format!(
            "{detail}{seldom}; expected the markers of Plug-in Gait or CMU, or joint centres; set `marker_map` of `[motion]`, for \
             example {} = \"LABEL\", or \"LABEL+LABEL\" for a midpoint; unrecognised points: {}",
            lacking.first().map_or("left_hip", String::as_str),
            if unknown.is_empty() { "none".to_owned() } else { short_list(unknown) },
        )
    };
    malformed(file, detail)
}

/// How the advice begins which frames to use.
pub const IN_VIEW: &str = "all points are seen in frames";

/// Which frames to take of a recording with long gaps; `None` if none has the points of a body, or of its legs.
fn whole_frames(before: usize, placed: &MetricPoints) -> Option<String> {
    let (run, points) = placed.in_view.as_ref().filter(|(run, _)| run.len() < placed.frames.len())?;
    // with any stature, what has no points above the legs is placed
    joints_of_frame(&MarkerFrame { points, stature: Some(1.7) }).ok()?;
    let (first, last) = (before + run.start + 1, before + run.end);
    Some(format!("{IN_VIEW} {first} to {last}: set `first_frame = {first}` and `last_frame = {last}` of `[motion]`"))
}

/// The message for collinear points, which do not define the body's orientation.
fn collinear_message(frame: usize) -> String {
    format!(
        "the points of the pelvis, chest or head are collinear in frame {} (from 1): expected distinct positions of left and \
         right hip, left and right shoulder, neck and crown; correct that frame",
        frame + 1
    )
}
