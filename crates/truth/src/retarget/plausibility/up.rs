//! Which way is up: heads are above feet.

use nalgebra::Vector3;

use super::{Judgement, feet, lowest, place, quantile};
use crate::mocap::{Clip, UpAxis};
use crate::retarget::anatomy::SubjectFrame;
use skiagraph_core::body::Landmark;

/// A body is upright, or upside down, if this is the least cosine between it and the vertical: 60 degrees.
const STANDS: f64 = 0.5;
/// A body lies along an axis if the angle between them is at most 45 degrees.
const LIES: f64 = 0.7;
/// A body upside down is held by its hands if one of them is lower than this share of its length: a handstand.
const ON_HANDS: f64 = 0.25;
/// Most of the frames in which a body may be upside down without hands on the ground: somersaults and head spins.
const MOST_INVERTED: f64 = 0.5;
/// Most seconds on the hands: who raises the arms, upside down, seems to stand on them.
const MOST_ON_HANDS_S: f64 = 20.0;
/// Least share of the frames in which the body lies along one axis that is noted.
const NOTED_LYING: f64 = 0.8;

/// The axis that points up, and how the body tells.
pub(super) struct FoundUp {
    pub(super) axis: UpAxis,
    pub(super) why: String,
}

/// The up axis, if it is another one than that of the clip.
pub(super) fn wrong_up(clip: &Clip, subject: &[SubjectFrame]) -> Option<FoundUp> {
    let (mut upright, mut inverted, mut on_hands) = (0, 0, 0);
    for frame in subject {
        let body = place(frame, Landmark::HeadTop) - feet(frame);
        let hands = place(frame, Landmark::LeftWrist).z.min(place(frame, Landmark::RightWrist).z);
        let is_on_hands = hands - lowest(frame) < ON_HANDS * body.norm();
        upright += usize::from(body.z > STANDS * body.norm());
        let is_inverted = body.z < -STANDS * body.norm();
        inverted += usize::from(is_inverted && !is_on_hands);
        on_hands += usize::from(is_inverted && is_on_hands);
    }
    let is_no_handstand = on_hands as f64 > MOST_ON_HANDS_S * clip.frames_per_second;
    let hands = if is_no_handstand { "longer than anybody stands on the hands" } else { "and no hand near the ground" };
    inverted += if is_no_handstand { on_hands } else { 0 };
    if inverted as f64 > MOST_INVERTED * subject.len() as f64 && upright < inverted {
        let share = 100.0 * inverted as f64 / subject.len() as f64;
        let why = format!(
            "the head is below the feet, {hands}, in {share:.0} % of the frames (limit {:.0} %): upside down",
            100.0 * MOST_INVERTED
        );
        return Some(FoundUp { axis: file_axis(clip, -Vector3::z())?, why });
    }
    let (along, share) = lies_along(subject);
    if share < NOTED_LYING || !walks_along(subject, &along) {
        return None;
    }
    let axis = file_axis(clip, along)?;
    let why = format!(
        "in {:.0} % of the frames the head is away from the feet along {}, where the feet keep their level, and the body \
         walks across it",
        100.0 * share,
        axis.name()
    );
    Some(FoundUp { axis, why })
}

/// Refuses a file whose own up axis is wrong; notes a body that lies.
pub(super) fn judge(clip: &Clip, subject: &[SubjectFrame], judgement: &mut Judgement) {
    if let Some(found) = wrong_up(clip, subject) {
        let (why, own, axis) = (&found.why, clip.up.0.name(), found.axis.name());
        judgement.refuse(format!("{why}; the file says that {own} points up: set `up = \"{axis}\"` of `[motion]`"));
        return;
    }
    let (along, share) = lies_along(subject);
    if let Some(axis) = file_axis(clip, along).filter(|_| share >= NOTED_LYING) {
        judgement.note(format!(
            "the body lies along the file's {} axis in {:.0} % of the frames: it is lying down, or set `up = \"{}\"` of \
             `[motion]`",
            axis.name(),
            100.0 * share,
            axis.name()
        ));
    }
}

fn file_axis(clip: &Clip, direction: Vector3<f64>) -> Option<UpAxis> {
    let turn = clip.up.0.turn();
    UpAxis::ALL.into_iter().find(|axis| (turn * (axis.turn().inverse() * Vector3::z())).dot(&direction) > 0.9)
}

/// The horizontal axis along which the body, from feet to head, lies most often, and the share of these frames.
fn lies_along(subject: &[SubjectFrame]) -> (Vector3<f64>, f64) {
    let mut best = (Vector3::x(), 0.0);
    for axis in [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y()] {
        let lies = |frame: &&SubjectFrame| {
            let body = place(frame, Landmark::HeadTop) - feet(frame);
            body.dot(&axis) > LIES * body.norm()
        };
        let share = subject.iter().filter(lies).count() as f64 / subject.len().max(1) as f64;
        if share > best.1 {
            best = (axis, share);
        }
    }
    best
}

/// Whether the body walks across an axis: it covers half its length, legs apart by turns, and the lower foot keeps its
/// level along the axis. Who lies on the ground does not.
fn walks_along(subject: &[SubjectFrame], axis: &Vector3<f64>) -> bool {
    let length = quantile(subject.iter().map(|f| (place(f, Landmark::HeadTop) - feet(f)).norm()), 0.5);
    let level = |frame: &SubjectFrame| {
        place(frame, Landmark::LeftAnkle).dot(axis).min(place(frame, Landmark::RightAnkle).dot(axis))
    };
    let change = quantile(subject.iter().map(level), 0.9) - quantile(subject.iter().map(level), 0.1);
    let across = |v: Vector3<f64>| v - axis * v.dot(axis);
    let (Some(first), Some(last)) = (subject.first(), subject.last()) else { return false };
    let covered = across(place(last, Landmark::Pelvis) - place(first, Landmark::Pelvis)).norm();
    let stride = |frame: &SubjectFrame| across(place(frame, Landmark::LeftAnkle) - place(frame, Landmark::RightAnkle));
    let strides: Vec<Vector3<f64>> = subject.iter().map(stride).collect();
    let widest = strides.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default();
    let is_alternating = strides.iter().any(|stride| stride.dot(&widest) < -0.1 * length * widest.norm());
    change < 0.1 * length && covered > 0.5 * length && is_alternating
}
