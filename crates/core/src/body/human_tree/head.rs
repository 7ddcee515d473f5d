//! Neck, head and crown: what rises from the joint that moves both shoulders.

use nalgebra::Point3;

use super::limbs::LimbPair;
use super::names::{self, Role, key};
use super::proportions::stature;
use super::{JointTree, WORST, median, misfit};

/// Joints of neck and head, as far as they are there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeadChain {
    /// The joint at the base of the neck.
    pub neck: Option<usize>,
    /// The joint that moves the head.
    pub head: Option<usize>,
    /// The top of the head.
    pub crown: Option<usize>,
}

/// Distance from neck to crown, share of the stature: 0.28 m at 1.75 m.
pub const NECK_TO_CROWN: f64 = 0.16;
/// Distances from neck to crown that are a person's: 0.16 to 0.35 m at 1.75 m. CMU's heads end at 0.18 m.
pub(super) const NECK_TO_CROWN_RANGE: std::ops::RangeInclusive<f64> = 0.09..=0.2;
/// Distance from the middle of the shoulders to the crown, share of the stature.
const SHOULDERS_TO_CROWN: std::ops::RangeInclusive<f64> = 0.145..=0.25;
/// The same for the only end of a head. Of several ends, some are eyes, whose height is 0.13.
const SHOULDERS_TO_ONLY_END: std::ops::RangeInclusive<f64> = 0.09..=0.25;
/// The same for a joint that is named as the top of the head: characters have large heads.
const SHOULDERS_TO_NAMED_TOP: std::ops::RangeInclusive<f64> = 0.09..=0.35;
/// Distance from the middle of the shoulders to the joint below the head.
const SHOULDERS_TO_HEAD: f64 = 0.085;
/// Greatest distance from the middle of the shoulders to the base of the neck.
const HIGHEST_NECK: f64 = 0.06;
/// Least distance from the middle of the shoulders to the crown, share of the way by the head's joint: noses are less.
const LEAST_STRAIGHT: f64 = 0.8;
/// Distance from the joint below the head to the crown.
const HEAD_TO_CROWN: f64 = 0.1;
/// The cost of a body without a head, and the greatest cost of a joint as one.
const NO_HEAD: f64 = 8.0;
/// The greatest cost of the place of a joint that is named as a neck or head.
const MOST_OF_NAMED: f64 = 4.0;
/// Cosine of the greatest mean angle between trunk and the direction to the crown: 37 degrees.
const UPRIGHT: f64 = 0.8;
/// Greatest distance of a crown from the plane between left and right.
const ASIDE: f64 = 0.03;
/// Least height of the base of the neck above the middle of the shoulders, if there is a higher neck. CMU's first of
/// two is 0.017 to 0.07 below; that of others is 0.02 to 0.06 above, and in a pose with raised arms 0.01 below.
const LOWEST_NECK: f64 = -0.013;

impl JointTree<'_> {
    /// The best head of a body with these limbs, and its cost.
    pub(super) fn head(&self, legs: &LimbPair, arms: &LimbPair) -> (f64, HeadChain) {
        let trunk = Trunk { tree: self, legs, arms, stature: stature(self, legs, arms) };
        let mut below = arms.above;
        let mut best = (NO_HEAD, HeadChain::default());
        // if nothing rises from the joint of the shoulders, something may rise from one below
        for level in 0..8_u8 {
            for joint in 0..self.names.len() {
                if self.is_tip(joint) || joint == below || !self.is_below(joint, below) || trunk.is_limb(joint, below) {
                    continue;
                }
                // a jaw is no head; a word that the joint of the shoulders has too is of a prefix
                let is_of_face = |joint: usize| names::is_of_face(self.names[joint]);
                if is_of_face(joint) && !is_of_face(arms.above) {
                    continue;
                }
                let cost = trunk.cost_of_head(joint) + f64::from(level);
                if cost < best.0 {
                    best = (cost, HeadChain { head: Some(joint), ..HeadChain::default() });
                }
            }
            match self.parents[below].filter(|_| best.1.head.is_none() && below != legs.above) {
                Some(parent) => below = parent,
                None => break,
            }
        }
        if let Some(head) = best.1.head {
            best.1.crown = trunk.crown(head, true);
            best.1.neck = trunk.neck(head, best.1.crown);
            // an end so near to the neck is no crown
            let neck = best.1.neck.or_else(|| trunk.neck(head, None));
            if let (Some(neck), Some(crown)) = (neck, best.1.crown)
                && self.distance(neck, crown) < NECK_TO_CROWN_RANGE.start() * trunk.stature
            {
                best.1 = HeadChain { neck: Some(neck), crown: None, ..best.1 };
            }
        }
        best
    }
}

/// What a head is looked for on.
struct Trunk<'a> {
    tree: &'a JointTree<'a>,
    legs: &'a LimbPair,
    arms: &'a LimbPair,
    stature: f64,
}

impl Trunk<'_> {
    /// Whether a joint below `root` is on the way to a limb, or part of one.
    fn is_limb(&self, joint: usize, root: usize) -> bool {
        let tree = self.tree;
        let uppers = self.legs.limbs.iter().chain(&self.arms.limbs).map(|limb| limb[0]);
        // the branches of `root` that hold limbs, and the way up from `root` to what was searched before
        for upper in uppers.chain([self.legs.above, self.arms.above]) {
            let branch = tree.upwards(upper).find(|&j| tree.parents[j] == Some(root));
            if branch.is_some_and(|branch| tree.is_below(joint, branch)) {
                return true;
            }
        }
        false
    }

    /// From the middle of the shoulders: the median distance of a joint, its mean cosine to the trunk, and how far it
    /// is from the plane between left and right.
    fn place(&self, joint: usize) -> PlaceAboveShoulders {
        let (mut distances, mut sides, mut cosine) = (Vec::new(), Vec::new(), 0.0);
        for pose in &self.tree.poses {
            let [left, right] = self.arms.limbs.map(|limb| pose[limb[0]]);
            let shoulders = nalgebra::center(&left, &right);
            let up = shoulders - middle(pose, self.legs);
            let to_joint = pose[joint] - shoulders;
            distances.push(to_joint.norm());
            sides.push(((pose[joint] - left).norm() - (pose[joint] - right).norm()).abs());
            cosine += to_joint.dot(&up) / (to_joint.norm() * up.norm()).max(1e-12) / self.tree.poses.len() as f64;
        }
        PlaceAboveShoulders { distance: median(distances) / self.stature, cosine, aside: median(sides) / self.stature }
    }

    fn cost_of_head(&self, joint: usize) -> f64 {
        let place = self.place(joint);
        let role = names::role(self.tree.names[joint]);
        let by_name = self.tree.cost_of_name(joint, Role::Head);
        // bodies without a joint of this name turn their heads at the neck, unless the user says otherwise
        let named = if role == Some(Role::Neck) && by_name < 2.0 { 0.0 } else { 2.0 * by_name };
        let is_named = matches!(role, Some(Role::Neck | Role::Head));
        if self.crown(joint, is_named).is_some() {
            return (0.5 * misfit(place.distance, SHOULDERS_TO_HEAD, 0.5)).min(2.0) + named;
        }
        let cost = 0.5 * misfit(place.distance, SHOULDERS_TO_HEAD, 0.5)
            + (20.0 * (1.0 - place.cosine)).min(WORST)
            + (place.aside / 0.02 * place.aside / 0.02).min(WORST);
        // who bows or looks aside has a head all the same
        cost.min(if is_named { MOST_OF_NAMED } else { f64::INFINITY }) + named
    }

    /// The end of a bone that is the top of the head: straight up from the shoulders, as far as a crown.
    fn crown(&self, head: usize, is_known_head: bool) -> Option<usize> {
        let tree = self.tree;
        let is_end = |&joint: &usize| !tree.parents.contains(&Some(joint));
        let below = (head + 1..tree.names.len()).filter(|&joint| tree.is_below(joint, head));
        let is_top = |&joint: &usize| names::is_crown(tree.names[joint]);
        let is_near = |&joint: &usize| SHOULDERS_TO_NAMED_TOP.contains(&self.place(joint).distance);
        if let Some(top) = below.clone().filter(is_top).find(is_near) {
            return Some(top);
        }
        // jaws and eyes end below the crown, whatever else a head has; a word that the head has too is of a prefix
        let has_prefix = names::is_of_face(tree.names[head]);
        let of_face = |joint: usize| {
            let mut below_head = tree.upwards(joint).take_while(|&above| above != head);
            !has_prefix && below_head.any(|j| names::is_of_face(tree.names[j]))
        };
        let mut ends: Vec<usize> = below.filter(is_end).filter(|&joint| !of_face(joint)).collect();
        let is_only = ends.len() == 1;
        // eyes and brows are pairs; an end without a name is that of the joint below
        let name = |end: usize| tree.names[tree.parents[end].filter(|_| tree.is_tip(end)).unwrap_or(end)];
        let all = ends.clone();
        ends.retain(|&end| all.iter().all(|&other| names::is_left_of(name(end), name(other)).is_none()));
        let mut best: Option<(f64, usize)> = None;
        for joint in ends {
            let place = self.place(joint);
            // a joint without an end so near to the shoulders moves the head
            let range = if is_only && tree.is_tip(joint) { SHOULDERS_TO_ONLY_END } else { SHOULDERS_TO_CROWN };
            let way = self.place(head).distance + tree.distance(head, joint) / self.stature;
            let is_straight = place.cosine > UPRIGHT && place.aside < ASIDE;
            // who crouches may lift or tilt a head, and its only end is the crown all the same
            let is_ahead = place.distance > LEAST_STRAIGHT * way;
            let is_crown = is_ahead && range.contains(&place.distance) && (is_straight || is_only && is_known_head);
            if is_crown && best.is_none_or(|(most, _)| place.distance * place.cosine > most) {
                best = Some((place.distance * place.cosine, joint));
            }
        }
        best.map(|(_, joint)| joint)
    }

    /// The joint between shoulders and head that is as far below the crown as a neck: of those called necks the
    /// one at the height of its base, else by distance.
    fn neck(&self, head: usize, crown: Option<usize>) -> Option<usize> {
        let tree = self.tree;
        let mut best: Option<(f64, usize)> = None;
        for joint in tree.upwards(head).take_while(|&joint| !tree.is_below(self.arms.above, joint)) {
            let to_crown = match crown {
                Some(crown) => tree.distance(joint, crown) / self.stature,
                None => tree.distance(joint, head) / self.stature + HEAD_TO_CROWN,
            };
            let is_named = key(tree.names[joint]).trim_end_matches(char::is_numeric).ends_with("neck");
            // characters have large heads
            let range = if is_named { SHOULDERS_TO_NAMED_TOP } else { NECK_TO_CROWN_RANGE };
            if crown.is_some() && !range.contains(&to_crown) {
                continue;
            }
            // the head's own joint is a neck only if nothing else is and it is low enough
            let is_high = || to_crown < NECK_TO_CROWN - 0.035 || self.place(joint).distance > HIGHEST_NECK;
            if joint == head && !is_named && is_high() {
                continue;
            }
            let place = self.place(joint);
            let cost = if is_named {
                let height = place.distance * place.cosine;
                if height > LOWEST_NECK { 0.0 } else { 1.0 - height }
            } else {
                10.0 + misfit(to_crown, NECK_TO_CROWN, 0.1)
            };
            // of equal ones the lowest
            if best.is_none_or(|(least, _)| cost <= least) {
                best = Some((cost, joint));
            }
        }
        best.map(|(_, joint)| joint)
    }
}

/// Where a joint is above the middle of the shoulders; lengths as shares of the stature.
struct PlaceAboveShoulders {
    distance: f64,
    cosine: f64,
    aside: f64,
}

/// The middle of the upper joints of two limbs.
pub(super) fn middle(pose: &[Point3<f64>], pair: &LimbPair) -> Point3<f64> {
    nalgebra::center(&pose[pair.limbs[0][0]], &pose[pair.limbs[1][0]])
}
