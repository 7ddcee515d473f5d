//! Bones have one length, and the same on both sides.

use super::Judgement;
use super::sides::{change, length};
use crate::retarget::SegmentLengths;
use crate::retarget::anatomy::SubjectFrame;
use skiagraph_core::body::Landmark as L;

/// Change of a bone's length over all but the extreme twentieths of the frames, share of the length. Markers on skin
/// move by up to 40 mm over a bone of 0.4 m (`[Leardini 2005]`), keypoints by more.
const NOTED_CHANGE: f64 = 0.25;
const MOST_CHANGE: f64 = 0.6;
/// Difference of the lengths of left and right, share of their mean; that of people is some per cent.
const NOTED_DIFFERENCE: f64 = 0.25;
const MOST_DIFFERENCE: f64 = 0.6;

const BONES: [(&str, [L; 2], [L; 2]); 4] = [
    ("thigh", [L::LeftHip, L::LeftKnee], [L::RightHip, L::RightKnee]),
    ("shank", [L::LeftKnee, L::LeftAnkle], [L::RightKnee, L::RightAnkle]),
    ("upper arm", [L::LeftShoulder, L::LeftElbow], [L::RightShoulder, L::RightElbow]),
    ("forearm", [L::LeftElbow, L::LeftWrist], [L::RightElbow, L::RightWrist]),
];

/// Statures outside this range are noted, metres.
const COMMON_STATURES: std::ops::RangeInclusive<f64> = 1.4..=2.1;
/// From ankle to crown, share of the stature (`[Drillis 1966]`).
const ANKLE_TO_CROWN: f64 = 0.961;

/// Refuses bones that change, or that are of two people.
pub(super) fn judge(subject: &[SubjectFrame], judgement: &mut Judgement) {
    for (name, left, right) in BONES {
        let (of_left, of_right) = (length(subject, left[0], left[1]), length(subject, right[0], right[1]));
        let difference = 2.0 * (of_left - of_right).abs() / (of_left + of_right).max(1e-6);
        let changing = change(subject, left[0], left[1]).max(change(subject, right[0], right[1]));
        let (found, limit) = if changing > NOTED_CHANGE {
            let limit = if changing > MOST_CHANGE { MOST_CHANGE } else { NOTED_CHANGE };
            (format!("the length of a {name} changes by {:.0} %", 100.0 * changing), limit)
        } else if difference > NOTED_DIFFERENCE {
            let limit = if difference > MOST_DIFFERENCE { MOST_DIFFERENCE } else { NOTED_DIFFERENCE };
            (format!("the left {name} is {of_left:.2} m long, the right one {of_right:.2} m"), limit)
        } else {
            continue;
        };
        let text = format!(
            "{found} (limit {:.0} %): a wrong point, or the points of two people; name the right joints in `joint_map` or \
             the right markers in `marker_map`, or the person in `subject`, of `[motion]`",
            100.0 * limit
        );
        judgement.find(limit == MOST_CHANGE || limit == MOST_DIFFERENCE, text);
    }
    let stature = SegmentLengths::from_subject(subject).ankle_to_crown().map(|length| length / ANKLE_TO_CROWN);
    if let Some(stature) = stature.filter(|stature| !COMMON_STATURES.contains(stature)) {
        judgement.note(format!("a stature of {stature:.2} m is unusual: set `metres_per_unit` if the unit is wrong"));
    }
}
