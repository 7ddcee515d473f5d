//! The degrees of freedom of arms and legs.

use super::limb_memory::{LEFT_AND_RIGHT_ENDS, landmark_point};
use skiagraph_core::body::{Humanoid, Landmark};

/// The degrees of freedom of each arm and leg, of both arms and of both legs.
pub(super) fn limbs(body: &Humanoid) -> Vec<Vec<usize>> {
    let alone = arms_and_legs(body);
    let pairs = [(0, 1), (2, 3)].map(|(left, right)| [alone[left].as_slice(), &alone[right]].concat());
    alone.into_iter().chain(pairs).filter(|limb| !limb.is_empty()).collect()
}

/// The degrees of freedom of the left and right arm and the left and right leg: those that move the limb's end but
/// neither another limb's end nor the head. Empty for a limb without an end.
pub(in crate::tracker) fn arms_and_legs(body: &Humanoid) -> Vec<Vec<usize>> {
    let ends = LEFT_AND_RIGHT_ENDS.concat().into_iter().chain([Landmark::HeadTop]);
    let moving: Vec<Vec<usize>> =
        ends.map(|end| landmark_point(body, end).map(|end| moved_by(body, end.link)).unwrap_or_default()).collect();
    let own = |limb: usize| -> Vec<usize> {
        let others = |number: &usize| moving.iter().enumerate().any(|(i, m)| i != limb && m.contains(number));
        moving[limb].iter().copied().filter(|number| !others(number)).collect()
    };
    (0..4).map(own).collect()
}

/// The degrees of freedom that move a link, ascending.
fn moved_by(body: &Humanoid, link: usize) -> Vec<usize> {
    let mut twists = Vec::new();
    let frames = body.link_frames(&body.zero_pose());
    body.step_twists(&frames, link, &nalgebra::Point3::origin(), &mut twists);
    let mut numbers: Vec<usize> =
        twists.iter().filter_map(|(index, _)| index.checked_sub(skiagraph_core::body::ROOT_STEP)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}
