//! A body that travels moves its arms and legs.

use super::{Judgement, place};
use crate::retarget::anatomy::SubjectFrame;
use skiagraph_core::body::Landmark as L;

/// Greatest distance from where a body without moving limbs began, metres: who stands on a skateboard is soon out of
/// sight.
const FARTHEST: f64 = 2.0;
/// Least change of a distance between hands and feet that is a movement, metres.
const LEAST_CHANGE: f64 = 0.05;
const DISTANCES: [[L; 2]; 4] = [
    [L::LeftAnkle, L::RightAnkle],
    [L::LeftWrist, L::RightWrist],
    [L::LeftWrist, L::LeftAnkle],
    [L::RightWrist, L::RightAnkle],
];

/// Refuses a statue that glides, as rotations in radians make it.
pub(super) fn judge(subject: &[SubjectFrame], judgement: &mut Judgement) {
    let Some(first) = subject.first() else { return };
    let from_start = |frame: &SubjectFrame| (place(frame, L::Pelvis) - place(first, L::Pelvis)).norm();
    let farthest = subject.iter().map(from_start).fold(0.0, f64::max);
    if farthest > FARTHEST && DISTANCES.iter().all(|[a, b]| change(subject, *a, *b) < LEAST_CHANGE) {
        judgement.refuse(format!(
            "the body glides {farthest:.1} m without moving arms and legs: its rotations are probably in radians, where \
             the format has degrees; convert them"
        ));
    }
}

fn change(subject: &[SubjectFrame], a: L, b: L) -> f64 {
    let distances = subject.iter().map(|frame| (place(frame, a) - place(frame, b)).norm());
    let (least, most) = distances.fold((f64::INFINITY, 0.0_f64), |(low, high), d| (low.min(d), high.max(d)));
    most - least
}
