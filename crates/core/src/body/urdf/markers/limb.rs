//! A limb: the chain of joints from trunk to hand or foot, with its upper, middle and lower joint.

use nalgebra::{Matrix3, Point3, Vector3};

use super::names::{BodyPart, BodySide};
use super::rigid_part::RigidParts;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Limb {
    Leg,
    Arm,
}

impl Limb {
    fn middle(self) -> BodyPart {
        if self == Self::Leg { BodyPart::Knee } else { BodyPart::Elbow }
    }

    fn lower(self) -> BodyPart {
        if self == Self::Leg { BodyPart::Ankle } else { BodyPart::Wrist }
    }

    /// Body part below the lower joint that does not belong to the chain.
    fn beyond(self) -> BodyPart {
        if self == Self::Leg { BodyPart::Toe } else { BodyPart::Finger }
    }

    /// Body parts that may end a chain, best first; of several in one list, the one farthest down.
    fn ends(self) -> &'static [&'static [BodyPart]] {
        match self {
            Self::Leg => &[&[BodyPart::Ankle], &[BodyPart::Toe], &[BodyPart::Leg, BodyPart::Knee]],
            Self::Arm => &[&[BodyPart::Wrist], &[BodyPart::Arm, BodyPart::Elbow]],
        }
    }

    /// Whether a part belongs to this kind of limb and not to the other.
    pub(super) fn has(self, part: BodyPart) -> bool {
        use BodyPart as P;
        match self {
            Self::Leg => matches!(part, P::Hip | P::Knee | P::Ankle | P::Toe | P::Leg),
            Self::Arm => matches!(part, P::Clavicle | P::Shoulder | P::Elbow | P::Wrist | P::Finger | P::Arm),
        }
    }

    pub(super) fn other(self) -> Self {
        if self == Self::Leg { Self::Arm } else { Self::Leg }
    }

    /// Ratio of the lower to the upper segment's length: shank to thigh, forearm to upper arm (Drillis and Contini
    /// 1966).
    fn proportion(self) -> f64 {
        if self == Self::Leg { 1.0 } else { 0.785 }
    }
}

/// A position on a link; metres, root's frame at the zero pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct LimbPoint {
    pub(super) link: usize,
    pub(super) point: Point3<f64>,
    /// Whether it is based on a name and not only on shape.
    pub(super) named: bool,
}

/// The end of a limb by the names of its parts.
pub(super) fn named_end(parts: &RigidParts<'_>, limb: Limb, side: BodySide) -> Option<usize> {
    let all = || 0..parts.parts.len();
    let is = |part: usize, names: &[BodyPart]| {
        parts.parts[part].side == Some(side) && parts.parts[part].part.is_some_and(|part| names.contains(&part))
    };
    let beyond = [limb.beyond()];
    let is_beyond = |part: usize| parts.path(part).into_iter().any(|p| is(p, &beyond));
    for &names in limb.ends() {
        let named = all().filter(|&p| is(p, names) && (names == beyond || !is_beyond(p)));
        if let Some(end) = named.max_by_key(|&p| (parts.parts[p].depth, std::cmp::Reverse(p))) {
            return Some(end);
        }
    }
    None
}

/// Greatest number of joints that make up a hip, shoulder, ankle or wrist.
const MOST_HINGES: usize = 3;
/// Joints of a wrist or ankle are nearer to its first than this share of the segment above.
const NEAR: f64 = 0.3;
/// Lengths of the upper segment over the lower: a joint called knee that makes it another is no knee.
const UPPER_TO_LOWER: std::ops::RangeInclusive<f64> = 0.4..=2.5;

/// The joints of a limb. `path` leads from the trunk's end to the limb's.
pub(super) fn joints(parts: &RigidParts<'_>, limb: Limb, path: &[usize]) -> Option<[LimbPoint; 3]> {
    let apart = |a: usize, b: usize| (parts.parts[path[a]].origin - parts.parts[path[b]].origin).norm();
    let is = |i: usize, name: BodyPart| parts.parts[path[i]].part == Some(name);
    let last = path.len().checked_sub(1)?;
    let first = (0..last).find(|&i| !is(i, BodyPart::Clavicle)).unwrap_or(0);
    let named_lower = (first + 1..=last).find(|&i| is(i, limb.lower()));
    let end = named_lower.unwrap_or(last);
    let from_upper = |i: usize| (first..i).map(|upper| apart(upper, i)).fold(f64::INFINITY, f64::min);
    let is_middle = |i: usize| apart(i, end) < 1e-6 || UPPER_TO_LOWER.contains(&(from_upper(i) / apart(i, end)));
    let named_middle = (first + 1..=last).find(|&i| is(i, limb.middle()));
    // what turns the upper bone may be called elbow, far above the joint that bends
    let bends = |at: usize| {
        let bending = (at + 1..=last).find(|&i| !turns_bone(parts, path, first, i));
        // a near one is another hinge of the elbow
        bending.filter(|&i| apart(at, i) > NEAR * apart(first, at)).unwrap_or(at)
    };
    let named_middle = named_middle.map(|at| if turns_bone(parts, path, first, at) { bends(at) } else { at });
    let named_middle = named_middle.filter(|&i| limb == Limb::Arm || is_middle(i));
    // the middle joint is the one farthest from both ends
    let from_ends = |i: usize| apart(i, first).min(apart(i, end));
    let farthest = || (first + 1..=end).max_by(|&a, &b| from_ends(a).total_cmp(&from_ends(b)));
    let middle = named_middle.or_else(|| Some(bending_middle(parts, &path[..=end], first, farthest()?)))?;
    let share = if named_lower.is_some() { NEAR } else { 1.0 };
    let is_near_end = |&i: &usize| named_lower.is_some_and(|l| i >= l) || apart(i, end) < share * apart(i, middle);
    let above: Vec<usize> = (0..middle).filter(|&i| !is(i, limb.middle())).map(|i| path[i]).collect();
    let uppers = upper_hinges(parts, if above.is_empty() { &path[..middle] } else { &above });
    let upper_length = (joint_centre(parts, &uppers)? - parts.parts[path[middle]].origin).norm();
    let lower = (middle + 1..=last).find(is_near_end).map(|at| bending_lower(parts, path, [middle, at], upper_length));
    let middles = (middle..lower.unwrap_or(last + 1)).filter(|&i| i == middle || is(i, limb.middle()));
    let middles: Vec<usize> = middles.map(|i| path[i]).collect();
    let lowers: Vec<usize> = lower.map_or(Vec::new(), |lower| {
        let near = |i: &usize| apart(*i, lower) <= NEAR * apart(lower, middle);
        (lower..=last).take_while(near).take(MOST_HINGES).map(|i| path[i]).collect()
    });
    // everything between two markers must be between their links: the bone may be on any link of a joint
    let place = |of: &[usize], carrier: Option<&usize>, named: bool| {
        Some(LimbPoint { link: parts.parts[*carrier?].links[0], point: joint_centre(parts, of)?, named })
    };
    let upper_joint = place(&uppers, uppers.first(), named_middle.is_some())?;
    let middle_joint = place(&middles, middles.first(), named_middle.is_some())?;
    let lower_joint = place(&lowers, lowers.last(), named_lower.is_some());
    let lower_joint = lower_joint.unwrap_or_else(|| tip(parts, limb, path[last], &upper_joint, &middle_joint));
    Some([upper_joint, middle_joint, lower_joint])
}

/// A joint whose axis is nearer than this to the line of its bone turns the bone and does not bend the limb, cosine of
/// 30 degrees.
const ALONG: f64 = 0.866;
/// A lower segment that is longer than this share of the upper one ends beyond the wrist.
const LONGEST_LOWER: f64 = 1.1;

/// Whether joint `at` turns the bone from joint `from` to the next place of a joint.
fn turns_bone(parts: &RigidParts<'_>, path: &[usize], from: usize, at: usize) -> bool {
    let origin = |i: usize| parts.parts[path[i]].origin;
    let next = (at + 1..path.len()).find(|&i| (origin(i) - origin(at)).norm() > 1e-3);
    let (Some(axis), Some(next)) = (parts.parts[path[at]].axis, next) else { return false };
    let bone = origin(next) - origin(from);
    axis.dot(&bone).abs() > ALONG * bone.norm()
}

/// The joint that bends a limb in its middle, given the one farthest from its ends, which may turn a bone.
fn bending_middle(parts: &RigidParts<'_>, path: &[usize], first: usize, farthest: usize) -> usize {
    if !turns_bone(parts, path, first, farthest) {
        return farthest;
    }
    let apart = |i: usize, end: usize| (parts.parts[path[i]].origin - parts.parts[path[end]].origin).norm();
    let from_ends = |i: &usize| apart(*i, first).min(apart(*i, path.len() - 1));
    // hinges of a shoulder or hip are at least two
    let least = first + 1 + usize::from(parts.parts[path[first]].axis.is_some());
    let bending = (least..path.len()).filter(|&i| !turns_bone(parts, path, first, i));
    bending.max_by(|a, b| from_ends(a).total_cmp(&from_ends(b))).unwrap_or(farthest)
}

/// The first joint from `lower` that bends a limb with the joint `middle`; `lower` if there is none in reach.
fn bending_lower(parts: &RigidParts<'_>, path: &[usize], [middle, lower]: [usize; 2], upper_length: f64) -> usize {
    let apart = |a: usize, b: usize| (parts.parts[path[a]].origin - parts.parts[path[b]].origin).norm();
    let Some(bending) = (lower..path.len()).find(|&i| !turns_bone(parts, path, middle, i)) else { return lower };
    // near ones are hinges of one wrist
    let is_near = apart(lower, bending) <= NEAR * apart(lower, middle);
    if is_near || apart(middle, bending) > LONGEST_LOWER * upper_length { lower } else { bending }
}

/// The hinges of a hip or shoulder: the last ones before the middle joint. Hinges of a collar bone are included only
/// if the shoulder has no others.
fn upper_hinges(parts: &RigidParts<'_>, above: &[usize]) -> Vec<usize> {
    let hinges = &above[above.len().saturating_sub(MOST_HINGES)..];
    let is_shoulder = |part: &&usize| parts.parts[**part].part != Some(BodyPart::Clavicle);
    let own: Vec<usize> = hinges.iter().filter(is_shoulder).copied().collect();
    let is_enough = own.len() > 1 || own.iter().any(|&part| parts.parts[part].axis.is_none());
    if is_enough { own } else { hinges.to_vec() }
}

/// The lower joint of a limb without one: a fixed link with its name, else a position by human proportions.
fn tip(parts: &RigidParts<'_>, limb: Limb, last: usize, upper: &LimbPoint, middle: &LimbPoint) -> LimbPoint {
    let part = &parts.parts[last];
    if let Some((link, _, _)) = part.fixed.iter().find(|(_, _, name)| *name == limb.lower()) {
        let point: Point3<f64> = parts.frames[*link].translation.vector.into();
        if (point - middle.point).norm() > 1e-3 {
            return LimbPoint { link: part.links[0], point, named: true };
        }
    }
    let above = middle.point - upper.point;
    let direction = parts.middle(&part.links).and_then(|solid| (solid - middle.point).try_normalize(1e-6));
    let direction = direction.or_else(|| above.try_normalize(1e-6)).unwrap_or(-Vector3::z());
    let wanted = limb.proportion() * above.norm();
    let reach = parts.reach(&part.links, &direction).map(|reach| reach - middle.point.coords.dot(&direction));
    let length = reach.filter(|reach| *reach > 0.5 * wanted).map_or(wanted, |reach| reach.min(wanted));
    LimbPoint { link: part.links[0], point: middle.point + direction * length, named: false }
}

/// Weight of a joint's own origin relative to its axis.
const ORIGIN_WEIGHT: f64 = 0.01;

/// The least-squares nearest point to the axes of joints: the centre of hips and shoulders with several hinges. A ball
/// joint is its own centre.
fn joint_centre(parts: &RigidParts<'_>, joints: &[usize]) -> Option<Point3<f64>> {
    let joint = |part: &usize| &parts.parts[*part];
    if let Some(ball) = joints.iter().map(joint).rev().find(|j| j.axis.is_none()) {
        return Some(ball.origin);
    }
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for joint in joints.iter().map(joint) {
        let axis = joint.axis?;
        let across = Matrix3::identity() * (1.0 + ORIGIN_WEIGHT) - axis * axis.transpose();
        normal += across;
        right += across * joint.origin.coords;
    }
    Some((normal.try_inverse()? * right).into())
}
