//! A limb: the chain of joints from trunk to hand or foot, and which of them are its upper, middle and lower joint.

use nalgebra::{Matrix3, Point3, Vector3};

use super::names::{Part, Side};
use super::rigid_part::RigidParts;

/// Which limb.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Limb {
    Leg,
    Arm,
}

impl Limb {
    fn middle(self) -> Part {
        if self == Self::Leg { Part::Knee } else { Part::Elbow }
    }

    fn lower(self) -> Part {
        if self == Self::Leg { Part::Ankle } else { Part::Wrist }
    }

    /// Names of what hangs on the lower joint and is no part of the chain.
    fn beyond(self) -> Part {
        if self == Self::Leg { Part::Toe } else { Part::Finger }
    }

    /// Names that a chain may end with, best first.
    fn ends(self) -> &'static [Part] {
        match self {
            Self::Leg => &[Part::Ankle, Part::Toe, Part::Leg, Part::Knee],
            Self::Arm => &[Part::Wrist, Part::Arm, Part::Elbow],
        }
    }

    /// Length of the lower segment over that of the upper one: of shank and thigh, forearm and upper arm (Drillis and
    /// Contini 1966).
    fn proportion(self) -> f64 {
        if self == Self::Leg { 1.0 } else { 0.785 }
    }
}

/// A place on a link; metres, root's frame at the zero pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) link: usize,
    pub(super) point: Point3<f64>,
    /// Whether a name told it, and not shape alone.
    pub(super) named: bool,
}

/// The end of a limb by the names of its parts.
pub(super) fn named_end(parts: &RigidParts<'_>, limb: Limb, side: Side) -> Option<usize> {
    let all = || 0..parts.parts.len();
    let is = |part: usize, name: Part| parts.parts[part].side == Some(side) && parts.parts[part].part == Some(name);
    let is_beyond = |part: usize| parts.path(part).into_iter().any(|p| is(p, limb.beyond()));
    for &name in limb.ends() {
        let named = all().filter(|&p| is(p, name) && (name == limb.beyond() || !is_beyond(p)));
        if let Some(end) = named.max_by_key(|&p| (parts.parts[p].depth, std::cmp::Reverse(p))) {
            return Some(end);
        }
    }
    None
}

/// The joints of a limb. `path` leads from the trunk's end to the limb's.
pub(super) fn joints(parts: &RigidParts<'_>, limb: Limb, path: &[usize]) -> Option<[Place; 3]> {
    let path: Vec<usize> = path.iter().copied().filter(|&p| parts.parts[p].part != Some(Part::Clavicle)).collect();
    let origin = |i: usize| parts.parts[path[i]].origin;
    let is = |i: usize, name: Part| parts.parts[path[i]].part == Some(name);
    let (first, last) = (0, path.len().checked_sub(1)?);
    let named_middle = (first..=last).find(|&i| is(i, limb.middle()));
    let named_lower = (first..=last).find(|&i| is(i, limb.lower()));
    let end = named_lower.unwrap_or(last);
    // the middle joint is the one that is farthest from both ends
    let apart = |i: &usize| (origin(*i) - origin(first)).norm().min((origin(*i) - origin(end)).norm());
    let farthest = || (first + 1..=end).max_by(|a, b| apart(a).total_cmp(&apart(b)));
    let middle = named_middle.filter(|&i| i > first).or_else(farthest)?;
    let lower = named_lower.filter(|&i| i > middle).or_else(|| {
        let nearer = |&i: &usize| (origin(i) - origin(last)).norm() < (origin(i) - origin(middle)).norm();
        (middle + 1..=last).find(nearer)
    });
    let upper = path[middle.saturating_sub(3)..middle].to_vec();
    let middles: Vec<usize> = match named_middle {
        Some(_) => (middle..lower.unwrap_or(last + 1)).filter(|&i| i == middle || is(i, limb.middle())).collect(),
        None => vec![middle],
    };
    let centre = |of: &[usize]| joint_centre(parts, of);
    let link = |part: usize| parts.parts[part].links[0];
    let chosen: Vec<usize> = middles.iter().map(|&i| path[i]).collect();
    let upper_joint = Place { link: link(*upper.last()?), point: centre(&upper)?, named: named_middle.is_some() };
    let carrier = lower.map_or(last, |lower| lower - 1);
    let middle_joint = Place { link: link(path[carrier]), point: centre(&chosen)?, named: named_middle.is_some() };
    let lower_joint = match lower {
        Some(lower) => {
            let lowers: Vec<usize> = path[lower..].to_vec();
            Place { link: link(*lowers.last()?), point: centre(&lowers)?, named: named_lower.is_some() }
        }
        None => tip(parts, limb, path[last], &upper_joint, &middle_joint),
    };
    Some([upper_joint, middle_joint, lower_joint])
}

/// The lower joint of a limb that has none: where a fixed link of that name is, else as far as people's limbs reach.
fn tip(parts: &RigidParts<'_>, limb: Limb, last: usize, upper: &Place, middle: &Place) -> Place {
    let part = &parts.parts[last];
    if let Some((link, _, _)) = part.fixed.iter().find(|(_, _, name)| *name == limb.lower()) {
        let point: Point3<f64> = parts.frames[*link].translation.vector.into();
        if (point - middle.point).norm() > 1e-3 {
            return Place { link: part.links[0], point, named: true };
        }
    }
    let above = middle.point - upper.point;
    let direction = parts.middle(&part.links).and_then(|flesh| (flesh - middle.point).try_normalize(1e-6));
    let direction = direction.or_else(|| above.try_normalize(1e-6)).unwrap_or(-Vector3::z());
    let wanted = limb.proportion() * above.norm();
    let reach = parts.reach(&part.links, &direction).map(|reach| reach - middle.point.coords.dot(&direction));
    let length = reach.filter(|reach| *reach > 0.5 * wanted).map_or(wanted, |reach| reach.min(wanted));
    Place { link: part.links[0], point: middle.point + direction * length, named: false }
}

/// How much a joint's own origin counts beside its axis.
const ORIGIN_WEIGHT: f64 = 0.01;

/// The point that is nearest to the axes of some joints, least squares: where hips and shoulders made of several hinges turn.
/// A joint that turns every way is its own centre.
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
