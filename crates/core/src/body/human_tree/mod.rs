//! Finds a human body in a tree of joints of which nothing is known but lengths and positions in some poses: two legs,
//! two arms, a trunk and a head.
//!
//! A limb is three joints one below the other. Every such triple has a cost: how far its two lengths are from the
//! proportions of adults (`[Drillis 1966]`), how much they change from pose to pose (the distance from hip to ankle
//! changes, those from hip to knee and from knee to ankle do not), and what the names of its joints say. Two triples
//! that are mirror images make a pair, and a pair of legs and a pair of arms a body, with costs of their own. The
//! cheapest body is taken, unless it has no human proportions.
//!
//! Costs are squared deviations in units of the spread among people and characters, each at most `WORST`.

mod head;
mod limbs;
mod names;
mod proportions;
#[cfg(test)]
mod tests;

use nalgebra::Point3;

pub use head::{HeadChain, NECK_TO_CROWN};
use limbs::LimbPair;
pub use names::{Role, key, role_of};

/// The greatest cost of one deviation.
const WORST: f64 = 9.0;
/// Pairs of legs and pairs of arms that are combined with each other.
const MOST_PAIRS: usize = 24;
/// Combinations whose heads are looked for.
const MOST_BODIES: usize = 8;
/// Bodies of a greater cost are not human. Skeletons of people whose joints have meaningless names cost up to 10.
const MOST_COST: f64 = 25.0;

/// Joints, and the ends of bones as joints of their own; parents come before children.
#[derive(Clone, Debug, Default)]
pub struct JointTree<'a> {
    /// Empty for the ends of bones.
    pub names: Vec<&'a str>,
    /// The parent of each joint.
    pub parents: Vec<Option<usize>>,
    /// Positions of all joints in some poses, any unit, Z up.
    pub poses: Vec<Vec<Point3<f64>>>,
    /// What the user says: the role of a joint, and whether it is a left one.
    pub pins: Vec<(usize, Role, Option<bool>)>,
}

/// The joints of a human body. Pairs are left and right.
#[derive(Clone, Debug, PartialEq)]
pub struct HumanTree {
    /// Hip, knee, ankle.
    pub legs: [[usize; 3]; 2],
    /// Shoulder, elbow, wrist.
    pub arms: [[usize; 3]; 2],
    /// Balls of the feet.
    pub toes: [Option<usize>; 2],
    /// The joint that moves both hips.
    pub pelvis: usize,
    /// The joint that moves both shoulders.
    pub chest: usize,
    /// Neck, head and crown, as far as they are there.
    pub head: HeadChain,
    /// Stature by the lengths of legs and trunk, unit of the poses.
    pub stature: f64,
    /// Length of the trunk, from the middle of the hips to that of the shoulders, over that of a leg without its foot.
    pub trunk_to_leg: f64,
    /// Length of a leg without its foot, unit of the poses.
    pub leg_length: f64,
    /// Whether names tell left from right, else the direction of feet and knees.
    pub are_sides_named: bool,
    /// Proportions that are no adult's, in words.
    pub unusual: Vec<String>,
    /// The sum of all deviations.
    pub cost: f64,
}

/// Finds the body.
pub fn find(tree: &JointTree<'_>) -> Result<HumanTree, String> {
    let limbs = limbs::Limbs::of(tree);
    let (legs, arms) = (limbs.pairs(true, MOST_PAIRS), limbs.pairs(false, MOST_PAIRS));
    if legs.is_empty() || arms.is_empty() {
        let which = if legs.is_empty() { "legs" } else { "arms" };
        return Err(format!("no two {which} of three joints each branch off the same joint"));
    }
    let mut bodies: Vec<(f64, &LimbPair, &LimbPair)> = Vec::new();
    for legs in &legs {
        for arms in &arms {
            if tree.are_apart(legs, arms) {
                bodies.push((legs.cost + arms.cost + tree.misfit_of_trunk(legs, arms), legs, arms));
            }
        }
    }
    bodies.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Option<(f64, &LimbPair, &LimbPair, HeadChain)> = None;
    for (cost, legs, arms) in bodies.into_iter().take(MOST_BODIES) {
        let (head_cost, head) = tree.head(legs, arms);
        if best.as_ref().is_none_or(|(least, ..)| cost + head_cost < *least) {
            best = Some((cost + head_cost, legs, arms, head));
        }
    }
    let Some((cost, legs, arms, head)) = best else {
        return Err("its arms and legs are the same joints".to_owned());
    };
    tree.check_proportions(legs, arms, tree.pins.is_empty())?;
    if cost > MOST_COST && tree.pins.is_empty() {
        return Err(format!(
            "its limbs are not in the proportions of a person (misfit {cost:.0}, at most {MOST_COST})"
        ));
    }
    Ok(tree.body(cost, legs, arms, head))
}

/// The cost of a ratio that is `expected` within a factor of e to the power of `spread`.
fn misfit(ratio: f64, expected: f64, spread: f64) -> f64 {
    if ratio <= 0.0 {
        return WORST;
    }
    let deviation = libm::log(ratio / expected) / spread;
    (deviation * deviation).min(WORST)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

impl JointTree<'_> {
    fn is_tip(&self, joint: usize) -> bool {
        self.names[joint].is_empty()
    }

    fn branches(&self, joint: usize) -> bool {
        let children = (joint + 1..self.names.len()).filter(|&child| self.parents[child] == Some(joint));
        children.filter(|&child| !self.is_tip(child)).count() > 1
    }

    /// The joint and its ancestors.
    fn upwards(&self, joint: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(joint), |&joint| self.parents[joint])
    }

    fn is_below(&self, joint: usize, above: usize) -> bool {
        self.upwards(joint).any(|other| other == above)
    }

    fn common_ancestor(&self, a: usize, b: usize) -> Option<usize> {
        self.upwards(a).find(|&joint| self.is_below(b, joint))
    }

    /// The median distance of two joints over the poses.
    fn distance(&self, a: usize, b: usize) -> f64 {
        median(self.poses.iter().map(|pose| (pose[a] - pose[b]).norm()).collect())
    }

    /// What the name of a joint, or the user, says for or against its role.
    fn cost_of_name(&self, joint: usize, role: Role) -> f64 {
        if let Some((_, pinned, _)) = self.pins.iter().find(|(pinned, ..)| *pinned == joint) {
            return if *pinned == role { -20.0 } else { 20.0 };
        }
        match names::role(self.names[joint]) {
            // a wrist is the wrist, even if the forearm is too short; a hand may begin below it
            Some(named) if named == role && names::is_hinge(self.names[joint]) => -6.0,
            Some(named) if named == role => -1.5,
            Some(_) => 1.5,
            None => 0.0,
        }
    }
}
