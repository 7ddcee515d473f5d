//! Left and right: with the toes forward and the head up, the left side is on the left.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::{Judgement, place, quantile};
use crate::retarget::anatomy::SubjectFrame;
use skiagraph_core::body::Landmark as L;

/// Toes point forward and knees are in front of the line from hip to ankle; over all frames of all recordings at hand
/// the mean cosines are at least 0.5 and 0.4. Twisted hips cannot turn both to the back.
const MOST_BACKWARD: f64 = -0.2;
/// The same of knees alone, where toes are not recorded.
const MOST_BACKWARD_KNEES: f64 = -0.5;
/// Bends of less than this share of the leg are not looked at.
const LEAST_BEND: f64 = 0.02;
/// Mean cosine between the lines through the shoulders and through the hips; a trunk twists by at most 70 degrees.
const MOST_OPPOSED: f64 = -0.3;
/// Thigh over shank; adults have 0.75 to 1.35 between joints, and less between markers on skin.
const THIGH_TO_SHANK: std::ops::RangeInclusive<f64> = 0.65..=1.6;
/// Change of a bone's length as named, and with left and right exchanged at one end, shares of its length.
const NOT_RIGID: f64 = 0.2;
const RIGID: f64 = 0.07;
/// Length of a bone as named over that with left and right exchanged at one end.
const TOO_LONG: f64 = 1.3;

const LEGS: [[L; 3]; 2] = [[L::LeftHip, L::LeftKnee, L::LeftAnkle], [L::RightHip, L::RightKnee, L::RightAnkle]];
const ARMS: [[L; 3]; 2] =
    [[L::LeftShoulder, L::LeftElbow, L::LeftWrist], [L::RightShoulder, L::RightElbow, L::RightWrist]];

/// Refuses a recording whose sides do not fit its body; `joint_map` has its landmarks.
pub(super) fn judge(subject: &[SubjectFrame], joint_map: &BTreeMap<String, String>, judgement: &mut Judgement) {
    if let Some(exchanged) = exchanged_joints(subject) {
        let names: Vec<&str> = exchanged.iter().map(|joint| joint.name()).collect();
        judgement.refuse(format!(
            "left and right are exchanged at {}: they lie on the other side of the body, or their bones are rigid only with \
             the other side; exchange their labels in `marker_map` (or joints in `joint_map`) of `[motion]`: {} = the label of \
             {}, and the reverse",
            names.join(", "),
            names[0],
            names[1]
        ));
        return;
    }
    let mut toes = MeanCosine::default();
    let mut knees = MeanCosine::default();
    let mut shoulders = MeanCosine::default();
    for frame in subject {
        let left = place(frame, L::LeftHip) - place(frame, L::RightHip);
        let forward = left.cross(&(place(frame, L::Thorax) - place(frame, L::Pelvis)));
        shoulders.add(&(place(frame, L::LeftShoulder) - place(frame, L::RightShoulder)), &left);
        for (side, leg) in LEGS.iter().enumerate() {
            let [hip, knee, ankle] = leg.map(|joint| place(frame, joint));
            let line = ankle - hip;
            let bend = (knee - hip) - line * ((knee - hip).dot(&line) / line.norm_squared().max(1e-9));
            if bend.norm() > LEAST_BEND * line.norm() {
                knees.add(&bend, &forward);
            }
            if let Some(ball) = frame.toes[side] {
                toes.add(&(ball.coords - ankle), &forward);
            }
        }
    }
    let are_legs_wrong = match toes.mean() {
        Some(toes) => toes < MOST_BACKWARD && knees.mean().is_none_or(|knees| knees < MOST_BACKWARD),
        None => knees.mean().is_some_and(|knees| knees < MOST_BACKWARD_KNEES),
    };
    let are_arms_opposed = shoulders.mean().is_some_and(|cosine| cosine < MOST_OPPOSED);
    let found = format!(
        "with the head up, toes point forward by {} and knees bend forward by {} (mean cosines, limit {MOST_BACKWARD})",
        said(toes.mean()),
        said(knees.mean())
    );
    // hips at mid-thigh bend knees to the back, and mirrored they are no hips either
    let of_legs = |upper: usize| LEGS.map(|leg| length(subject, leg[upper], leg[upper + 1])).iter().sum::<f64>();
    let thigh_to_shank = of_legs(0) / of_legs(1).max(1e-6);
    if are_legs_wrong && !THIGH_TO_SHANK.contains(&thigh_to_shank) {
        let [least, most] = [THIGH_TO_SHANK.start(), THIGH_TO_SHANK.end()];
        judgement.refuse(format!(
            "the thighs are {thigh_to_shank:.2} times as long as the shanks (limits {least} and {most}), so left_hip and right_hip are not \
             at the hips, or the knees or ankles not at theirs: give the right points in `marker_map`, or the right joints in \
             `joint_map`, of `[motion]`, before anything else; as they are, {found}"
        ));
        return;
    }
    match (are_legs_wrong, are_arms_opposed) {
        (false, false) => {}
        (true, false) => judgement.refuse(format!(
            "left and right do not fit the body: {found}. Either the file is a mirror image, as left-handed axes make it: \
             set `sides = \"mirrored\"` of `[motion]`; or its names of left and right are exchanged: set \
             `sides = \"exchanged\"`. The body alone cannot tell which"
        )),
        (false, true) => refuse_part(ARMS, joint_map, judgement),
        (true, true) => refuse_part(LEGS, joint_map, judgement),
    }
}

/// Refuses a recording with left and right exchanged at whole limbs, with the map that mends it.
fn refuse_part(limbs: [[L; 3]; 2], joint_map: &BTreeMap<String, String>, judgement: &mut Judgement) {
    let mut entries = Vec::new();
    for (own, other) in limbs.concat().iter().zip([limbs[1], limbs[0]].concat()) {
        if let Some(place) = joint_map.get(other.name()) {
            entries.push(format!("{} = {place:?}", own.name()));
        }
    }
    let names: Vec<&str> = limbs.as_flattened().iter().map(|joint| joint.name()).collect();
    judgement.refuse(format!(
        "left and right are exchanged in a part of the body, or the trunk is turned as none can: {} do not belong to the \
         same side as the rest. Look at it (`inspect --out`); if it is their names, set `joint_map = {{ {} }}` of `[motion]`",
        names.join(", "),
        entries.join(", ")
    ));
}

fn said(cosine: Option<f64>) -> String {
    cosine.map_or_else(|| "unknown".to_owned(), |cosine| format!("{cosine:.2}"))
}

/// The mean cosine of the angle between pairs of vectors.
#[derive(Default)]
struct MeanCosine {
    sum: f64,
    count: f64,
}

impl MeanCosine {
    fn add(&mut self, a: &Vector3<f64>, b: &Vector3<f64>) {
        self.sum += a.dot(b) / (a.norm() * b.norm()).max(1e-12);
        self.count += 1.0;
    }

    fn mean(&self) -> Option<f64> {
        (self.count > 0.0).then(|| self.sum / self.count)
    }
}

/// The joints of a limb at which left and right are exchanged: their bones are rigid, or as short as a bone, only with
/// the other side.
fn exchanged_joints(subject: &[SubjectFrame]) -> Option<Vec<L>> {
    for [left, right] in [LEGS, ARMS] {
        let (mut middle, mut girdles) = (MeanCosine::default(), MeanCosine::default());
        for frame in subject {
            let hips = place(frame, L::LeftHip) - place(frame, L::RightHip);
            girdles.add(&hips, &(place(frame, L::LeftShoulder) - place(frame, L::RightShoulder)));
            let across = |joint: usize| place(frame, left[joint]) - place(frame, right[joint]);
            middle.add(&across(1), &across(0));
        }
        let is_split = [0, 1].map(|bone| {
            let measure = |a: L, b: L| (change(subject, a, b), length(subject, a, b));
            let named = measure(left[bone], left[bone + 1]);
            let crossed = measure(left[bone], right[bone + 1]);
            let is_rigid = crossed.0.max(change(subject, right[bone], left[bone + 1])) < RIGID;
            is_rigid && (named.0 > NOT_RIGID || named.1 > TOO_LONG * crossed.1)
        });
        let are_uppers_opposed = girdles.mean().is_some_and(|cosine| cosine < MOST_OPPOSED);
        let cosine = middle.mean().unwrap_or(1.0);
        match is_split {
            [true, false] if are_uppers_opposed => return Some(vec![left[0], right[0]]),
            // from hip to knee both sides are as far
            [true, true] => return Some(vec![left[1], right[1]]),
            [false, true] if cosine < MOST_OPPOSED => return Some(vec![left[1], right[1]]),
            [false, true] => return Some(vec![left[2], right[2]]),
            [true, false] => return Some(vec![left[1], right[1], left[2], right[2]]),
            // crossed legs come near this
            [false, false] if cosine < -0.8 => return Some(vec![left[1], right[1], left[2], right[2]]),
            [false, false] => {}
        }
    }
    None
}

/// Median distance of two landmarks, metres.
pub(super) fn length(subject: &[SubjectFrame], a: L, b: L) -> f64 {
    quantile(subject.iter().map(|frame| (place(frame, a) - place(frame, b)).norm()), 0.5)
}

/// Change of the distance of two landmarks over all but the extreme twentieths of the frames, share of its median.
pub(super) fn change(subject: &[SubjectFrame], a: L, b: L) -> f64 {
    let mut lengths: Vec<f64> = subject.iter().map(|frame| (place(frame, a) - place(frame, b)).norm()).collect();
    lengths.sort_by(f64::total_cmp);
    let Some(last) = lengths.len().checked_sub(1) else { return 0.0 };
    (lengths[last - last / 20] - lengths[last / 20]) / lengths[last / 2].max(1e-6)
}
