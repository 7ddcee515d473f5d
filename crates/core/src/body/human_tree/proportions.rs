//! A body of two legs and two arms: whether its proportions are human, which side is left, and where the toes are.

use nalgebra::Vector3;

use super::head::{HeadChain, NECK_TO_CROWN_RANGE, middle};
use super::limbs::LimbPair;
use super::names::{Role, is_left_of};
use super::{HumanTree, JointTree, median, misfit};

/// Length of legs and trunk without feet, neck and head, share of the stature (`[Drillis 1966]`).
const LEGS_AND_TRUNK: f64 = 0.771;
/// Distance from ankle to the ball of the foot, share of the stature.
const ANKLE_TO_TOES: f64 = 0.087;
/// Length of the trunk, from the middle of the hips to that of the shoulders, over the length of a leg: adults 0.61,
/// small children and squat characters up to 1, a dog or a horse 1.4 and more, a crab 0. Recordings that lack the bone
/// below the shoulders, which is restored later, have half of it.
const TRUNK_TO_LEG: std::ops::RangeInclusive<f64> = 0.25..=1.15;

/// The median distance from the middle of the hips to that of the shoulders.
fn trunk(tree: &JointTree<'_>, legs: &LimbPair, arms: &LimbPair) -> f64 {
    median(tree.poses.iter().map(|pose| (middle(pose, arms) - middle(pose, legs)).norm()).collect())
}

pub(super) fn stature(tree: &JointTree<'_>, legs: &LimbPair, arms: &LimbPair) -> f64 {
    (legs.length() + trunk(tree, legs, arms)) / LEGS_AND_TRUNK
}

/// The cost of a further branch as long as an arm.
const SPARE_LIMB: f64 = 5.0;

impl JointTree<'_> {
    /// Whether no limb of either pair is on, or hangs from, one of the other.
    pub(super) fn are_apart(&self, legs: &LimbPair, arms: &LimbPair) -> bool {
        legs.limbs
            .iter()
            .all(|leg| arms.limbs.iter().all(|arm| !self.is_below(arm[0], leg[0]) && !self.is_below(leg[0], arm[0])))
    }

    pub(super) fn misfit_of_trunk(&self, legs: &LimbPair, arms: &LimbPair) -> f64 {
        let rises: Vec<f64> = self.poses.iter().map(|pose| middle(pose, arms).z - middle(pose, legs).z).collect();
        let is_upright = rises.iter().sum::<f64>() > 0.0;
        misfit(arms.length() / legs.length(), 0.65, 0.2)
            + misfit(trunk(self, legs, arms) / legs.length(), 0.61, 0.3)
            + misfit(arms.width / legs.width, 2.0, 0.5)
            + if is_upright { 0.0 } else { 2.0 }
            + SPARE_LIMB * self.spare_limbs(legs, arms).min(4) as f64
    }

    /// Branches as long as an arm beside those of trunk, legs and arms: a crab's other legs, but also a skirt.
    fn spare_limbs(&self, legs: &LimbPair, arms: &LimbPair) -> usize {
        let limbs = legs.limbs.iter().chain(&arms.limbs);
        let own: Vec<usize> = limbs.map(|limb| limb[0]).chain([legs.above, arms.above]).collect();
        let mut spare = 0;
        for branch in 0..self.names.len() {
            let Some(parent) = self.parents[branch].filter(|parent| [legs.above, arms.above].contains(parent)) else {
                continue;
            };
            let far = |&joint: &usize| self.is_below(joint, branch) && self.distance(joint, parent) > arms.length();
            if !own.iter().any(|&joint| self.is_below(joint, branch)) && (branch..self.names.len()).any(|j| far(&j)) {
                spare += 1;
            }
        }
        spare
    }

    pub(super) fn check_proportions(&self, legs: &LimbPair, arms: &LimbPair, limited: bool) -> Result<(), String> {
        let ratio = trunk(self, legs, arms) / legs.length();
        if limited && !TRUNK_TO_LEG.contains(&ratio) {
            let human = format!("{} to {}", TRUNK_TO_LEG.start(), TRUNK_TO_LEG.end());
            let trunk = format!("the trunk is {ratio:.2} times as long as the legs");
            return Err(format!("{trunk}, which is no human's ({human}): an animal?"));
        }
        Ok(())
    }

    /// The body with left and right told apart, toes, and the list of unusual proportions.
    pub(super) fn body(&self, cost: f64, legs: &LimbPair, arms: &LimbPair, head: HeadChain) -> HumanTree {
        let stature = stature(self, legs, arms);
        let toes = legs.limbs.map(|leg| self.toes(leg[2], stature));
        let mut body = HumanTree {
            legs: legs.limbs,
            arms: arms.limbs,
            toes,
            pelvis: legs.above,
            chest: arms.above,
            head,
            stature,
            trunk_to_leg: trunk(self, legs, arms) / legs.length(),
            leg_length: legs.length(),
            are_sides_named: true,
            unusual: Vec::new(),
            cost,
        };
        let by_geometry = self.left_by_feet(&body);
        let named = [self.named_left(legs), self.named_left(arms)];
        body.are_sides_named = named.iter().all(Option::is_some);
        if !named[0].or(by_geometry[0]).unwrap_or(true) {
            body.legs.swap(0, 1);
            body.toes.swap(0, 1);
        }
        if !named[1].or(by_geometry[1]).unwrap_or(true) {
            body.arms.swap(0, 1);
        }
        body.unusual = self.unusual(&body, legs, arms);
        body
    }

    /// Whether the first limb of a pair is the left one by what the user or most names of its joints say.
    fn named_left(&self, pair: &LimbPair) -> Option<bool> {
        let mut votes = 0_i32;
        for (&a, &b) in pair.limbs[0].iter().zip(&pair.limbs[1]) {
            match is_left_of(self.names[a], self.names[b]) {
                Some(true) => votes += 1,
                Some(false) => votes -= 1,
                None => {}
            }
            for (joint, _, is_left) in &self.pins {
                let Some(is_left) = *is_left else { continue };
                let is_first = *joint == a;
                if is_first || *joint == b {
                    votes += if is_first == is_left { 20 } else { -20 };
                }
            }
        }
        (votes != 0).then_some(votes > 0)
    }

    /// Whether the first leg and the first arm are left ones, by where toes point and knees bend.
    fn left_by_feet(&self, body: &HumanTree) -> [Option<bool>; 2] {
        let mut sums = [0.0_f64; 2];
        for pose in &self.poses {
            let mut ahead = Vector3::zeros();
            for (leg, toes) in body.legs.iter().zip(&body.toes) {
                let [hip, knee, ankle] = leg.map(|joint| pose[joint]);
                // a knee is in front of the line from hip to ankle
                ahead += (knee - hip) + (knee - ankle);
                if let Some(toes) = toes {
                    ahead += pose[*toes] - ankle;
                }
            }
            let [leg, arm] = [body.legs, body.arms].map(|limbs| limbs.map(|limb| pose[limb[0]]));
            let up = nalgebra::center(&arm[0], &arm[1]) - nalgebra::center(&leg[0], &leg[1]);
            let left = up.cross(&ahead);
            sums[0] += (leg[0] - leg[1]).dot(&left);
            sums[1] += (arm[0] - arm[1]).dot(&left);
        }
        sums.map(|sum| (sum != 0.0).then_some(sum > 0.0))
    }

    /// The ball of the foot below an ankle.
    fn toes(&self, ankle: usize, stature: f64) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        for joint in (ankle + 1..self.names.len()).filter(|&joint| self.is_below(joint, ankle)) {
            let cost = misfit(self.distance(ankle, joint) / stature, ANKLE_TO_TOES, 0.35)
                + self.cost_of_name(joint, Role::Toes)
                + if self.is_tip(joint) { 1.0 } else { 0.0 };
            if cost < 8.0 && best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, joint));
            }
        }
        best.map(|(_, joint)| joint)
    }

    /// Proportions that are no adult's.
    fn unusual(&self, body: &HumanTree, legs: &LimbPair, arms: &LimbPair) -> Vec<String> {
        let mut unusual = Vec::new();
        let mut check = |what: &str, value: f64, range: std::ops::RangeInclusive<f64>| {
            if !range.contains(&value) {
                unusual.push(format!("{what} {value:.2} (adults {} to {})", range.start(), range.end()));
            }
        };
        check("thigh to shank", legs.lengths[0] / legs.lengths[1], 0.75..=1.35);
        check("upper arm to forearm", arms.lengths[0] / arms.lengths[1], 0.7..=1.9);
        check("arms to legs", arms.length() / legs.length(), 0.5..=0.85);
        check("trunk to legs", trunk(self, legs, arms) / legs.length(), 0.42..=0.85);
        check("shoulders' width to stature", arms.width / body.stature, 0.13..=0.3);
        check("hips' width to stature", legs.width / body.stature, 0.05..=0.2);
        if let (Some(neck), Some(crown)) = (body.head.neck, body.head.crown) {
            check("neck to crown to stature", self.distance(neck, crown) / body.stature, NECK_TO_CROWN_RANGE);
        }
        for (side, (leg, toes)) in ["left", "right"].iter().zip(body.legs.iter().zip(body.toes)) {
            let Some(toes) = toes else { continue };
            let above = median(self.poses.iter().map(|pose| pose[leg[2]].z - pose[toes].z).collect());
            if above < -0.03 * body.stature {
                unusual.push(format!("the {side} ankle is below the toes"));
            }
        }
        unusual
    }
}
