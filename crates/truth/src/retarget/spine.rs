//! Distribution of the bend of spine and neck over their joints.
//!
//! Landmarks and orientations of pelvis, thorax and head determine the total bend of spine and neck, but hardly its
//! distribution over the joints, so a fit can jump between distributions (55 degrees forward below and 25 back above,
//! or vice versa). Joints with the same axis are therefore drawn towards equal angles.

use nalgebra::Vector3;

use skiagraph_core::body::inverse_kinematics::DifferenceGoal;
use skiagraph_core::body::{Humanoid, JointKind, Landmark};

/// Weight of one radian of difference between two joints relative to landmark distances, metres.
const METRES_PER_RADIAN: f64 = 0.03;
/// Cosine of the largest angle between axes considered the same: 18 degrees.
const SAME_AXIS: f64 = 0.95;

/// Goals of equal angles for neighbouring degrees of freedom of the spine, and of the neck.
pub(super) fn equal_shares(humanoid: &Humanoid) -> Vec<DifferenceGoal> {
    let carrier = |landmark: Landmark| humanoid.markers[landmark as usize].map(|marker| marker.link);
    let chains = [(Landmark::Pelvis, Landmark::Thorax), (Landmark::Thorax, Landmark::HeadTop)];
    let chain = |(from, to)| Some(hinges(humanoid, carrier(from)?, carrier(to)?));
    chains.into_iter().filter_map(chain).flat_map(|hinges| neighbours(&hinges)).collect()
}

/// A degree of freedom, and its axis at the zero pose in the root's frame, signed for rotation of the upper part.
type Hinge = (usize, Vector3<f64>);

/// The hinges on the path between two links, in order.
fn hinges(humanoid: &Humanoid, from: usize, to: usize) -> Vec<Hinge> {
    let frames = humanoid.link_frames(&humanoid.zero_pose());
    let hinge = |link: usize, sense: f64| match &humanoid.joints[link - 1].kind {
        JointKind::Revolute { axis, drive } if drive.multiplier == 1.0 => {
            Some((drive.degree_of_freedom, frames[link].rotation * axis.into_inner() * sense))
        }
        _ => None,
    };
    let (mut down, mut up) = (Vec::new(), Vec::new());
    let (mut from, mut to) = (from, to);
    while from != to {
        if to > from {
            up.extend(hinge(to, 1.0));
            to = humanoid.joints[to - 1].parent;
        } else {
            down.extend(hinge(from, -1.0));
            from = humanoid.joints[from - 1].parent;
        }
    }
    up.reverse();
    down.extend(up);
    down
}

/// Pairs each hinge with the next one about the same axis.
fn neighbours(hinges: &[Hinge]) -> Vec<DifferenceGoal> {
    let next = |(i, (a, axis)): (usize, &Hinge)| {
        let (b, other) = hinges[i + 1..].iter().find(|(_, other)| axis.dot(other).abs() > SAME_AXIS)?;
        let sign = axis.dot(other).signum();
        Some(DifferenceGoal { of: [*a, *b], sign, metres_per_unit: METRES_PER_RADIAN })
    };
    hinges.iter().enumerate().filter_map(next).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::shipped;

    #[test]
    fn lumbar_and_thoracic_joints_and_neck_and_head_share_their_bend() {
        let body = shipped("actor").unwrap();
        let name = |goal: &DifferenceGoal| goal.of.map(|dof| body.degrees_of_freedom[dof].name.clone());
        let shares: Vec<[String; 2]> = equal_shares(&body).iter().map(name).collect();
        let pairs = [["lumbar", "thoracic"], ["neck", "head"]];
        let axes = ["flexion", "lateral", "rotation"];
        let expected: Vec<[String; 2]> =
            pairs.iter().flat_map(|pair| axes.map(|axis| pair.map(|joint| format!("{joint}_{axis}")))).collect();
        assert_eq!(shares, expected);
        assert!(equal_shares(&body).iter().all(|goal| goal.sign == 1.0));
        assert!(equal_shares(&shipped("tracker25").unwrap()).is_empty(), "its trunk is one piece");
    }
}
