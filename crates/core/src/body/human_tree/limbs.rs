//! Candidates for limbs: three joints one below the other, and pairs of them that are mirror images.

use super::names::{self, Role, is_left_of};
use super::{JointTree, WORST, median, misfit};

/// Joints from a shoulder to a wrist, or from a hip to an ankle, with those of twist between.
const LONGEST_CHAIN: usize = 12;
/// Candidates that are paired.
const MOST_LIMBS: usize = 60;
/// The longest path along a skeleton's bones, from a hand to a foot, in units of stature.
const LONGEST_PATH: f64 = 1.55;
/// Change of a bone's length over the poses, as a share, that is one unit of deviation.
const RIGID: f64 = 0.02;

/// Two bones are one straight bone if their lengths are together at most this much longer than it.
const STRAIGHT: f64 = 1.01;

/// Hip, knee and ankle, or shoulder, elbow and wrist.
#[derive(Clone, Debug)]
struct LimbCandidate {
    joints: [usize; 3],
    /// Upper and lower bone.
    lengths: [f64; 2],
    cost: f64,
}

/// Two limbs that are mirror images; which one is left is not yet known.
#[derive(Clone, Debug)]
pub(super) struct LimbPair {
    pub(super) limbs: [[usize; 3]; 2],
    /// The joint that moves both.
    pub(super) above: usize,
    /// Mean lengths of upper and lower bone.
    pub(super) lengths: [f64; 2],
    /// Distance of the two upper joints.
    pub(super) width: f64,
    pub(super) cost: f64,
}

impl LimbPair {
    pub(super) fn length(&self) -> f64 {
        self.lengths[0] + self.lengths[1]
    }
}

/// Proportions of adults (`[Drillis 1966]`).
struct LimbProportions {
    roles: [Role; 3],
    /// Upper to lower bone.
    ratio: f64,
    /// Upper bone to stature.
    upper: f64,
    /// Distance of both upper joints to the length of the limb.
    width: f64,
    /// From the lower joint to the farthest end of foot or hand, in lengths of the lower bone.
    beyond: f64,
}

const LEG: LimbProportions =
    LimbProportions { roles: [Role::Hip, Role::Knee, Role::Ankle], ratio: 1.02, upper: 0.24, width: 0.21, beyond: 0.5 };
const ARM: LimbProportions = LimbProportions {
    roles: [Role::Shoulder, Role::Elbow, Role::Wrist],
    ratio: 1.12,
    upper: 0.165,
    width: 0.65,
    beyond: 0.75,
};

/// The lengths of a tree's bones.
pub(super) struct Limbs<'a> {
    tree: &'a JointTree<'a>,
    /// Per joint, the length of the longest path downwards.
    down: Vec<f64>,
    /// A first guess of the stature.
    stature: f64,
    /// What the names say.
    roles: Vec<Option<Role>>,
}

impl<'a> Limbs<'a> {
    pub(super) fn of(tree: &'a JointTree<'a>) -> Self {
        let mut down = vec![0.0; tree.names.len()];
        let mut longest = 0.0_f64;
        for joint in (0..tree.names.len()).rev() {
            let Some(parent) = tree.parents[joint] else { continue };
            let (bone, change) = length_and_change(tree, joint, parent);
            // what moves away from its parent is no bone: a body that walks away from a root at the origin
            if change > 0.3 * bone {
                continue;
            }
            longest = longest.max(down[parent] + bone + down[joint]);
            down[parent] = down[parent].max(bone + down[joint]);
        }
        // the end of a finger is a finger
        let name = |joint: usize| tree.names[tree.parents[joint].filter(|_| tree.is_tip(joint)).unwrap_or(joint)];
        let roles = (0..tree.names.len()).map(|joint| names::role(name(joint))).collect();
        Self { tree, down, stature: longest / LONGEST_PATH, roles }
    }

    /// The cheapest pairs of legs, or of arms.
    pub(super) fn pairs(&self, are_legs: bool, most: usize) -> Vec<LimbPair> {
        let proportions = if are_legs { LEG } else { ARM };
        let mut limbs = self.candidates(&proportions);
        limbs.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        limbs.truncate(MOST_LIMBS);
        let mut pairs = Vec::new();
        for (index, a) in limbs.iter().enumerate() {
            for b in &limbs[index + 1..] {
                pairs.extend(self.pair(a, b, &proportions));
            }
        }
        pairs.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        pairs.truncate(most);
        pairs
    }

    fn candidates(&self, proportions: &LimbProportions) -> Vec<LimbCandidate> {
        let tree = self.tree;
        let mut found = Vec::new();
        for lower in 0..tree.names.len() {
            let path: Vec<usize> = tree.upwards(lower).take(LONGEST_CHAIN).collect();
            for (at, &middle) in path.iter().enumerate().skip(1) {
                let (second, second_change) = length_and_change(tree, middle, lower);
                if !self.is_bone(second) {
                    continue;
                }
                for &upper in &path[at + 1..] {
                    // the joint of both limbs is above
                    if tree.parents[upper].is_none() {
                        continue;
                    }
                    let (first, first_change) = length_and_change(tree, upper, middle);
                    if !self.is_bone(first) {
                        continue;
                    }
                    let beyond = self.down[lower] / second;
                    let mut cost = misfit(first / second, proportions.ratio, 0.2)
                        + misfit(first / self.stature, proportions.upper, 0.4)
                        + changing(first_change / first)
                        + changing(second_change / second);
                    // without a hand or foot, the lower joint may itself be the end of one
                    cost += if beyond < 0.05 { 0.5 } else { 0.0 };
                    if beyond > 1.5 * proportions.beyond {
                        cost += misfit(beyond, proportions.beyond, 0.25);
                    }
                    // of joints in one place the first ends the limb; those below begin fingers or toes
                    let parent = tree.parents[lower].unwrap_or(lower);
                    cost += if tree.distance(parent, lower) < 1e-6 * self.stature { 0.01 } else { 0.0 };
                    // fingers and thumb branch off at the wrist, not above it
                    let between = &path[1..at];
                    cost += if between.iter().any(|&joint| tree.branches(joint)) { 2.0 } else { 0.0 };
                    // the first foot, or hand, is the ankle, or the wrist, however near the toes are to the ground
                    let has_role = |joint: usize, place: usize| self.roles[joint] == Some(proportions.roles[place]);
                    cost += if between.iter().any(|&joint| has_role(joint, 2)) { 6.0 } else { 0.0 };
                    // the last of several called shoulders, or arms, is the shoulder: Mixamo's Shoulder is a clavicle;
                    // a joint on the straight thigh below another only twists it
                    let is_named = |joint: &usize| has_role(*joint, 0);
                    let twists = |joint: usize, above: usize| {
                        let whole = tree.distance(above, middle);
                        proportions.roles[0] == Role::Hip
                            && tree.distance(above, joint) + tree.distance(joint, middle) < STRAIGHT * whole
                    };
                    let mut lower_ones = path[at + 1..].iter().take_while(|j| **j != upper);
                    let is_upper_one = is_named(&upper) && lower_ones.any(|j| is_named(j) && !twists(*j, upper));
                    let is_twist = |above: usize| is_named(&above) && !tree.branches(above) && twists(upper, above);
                    cost += if is_upper_one || tree.parents[upper].is_some_and(is_twist) { 3.0 } else { 0.0 };
                    // the end of a bone moves nothing
                    cost += if tree.is_tip(lower) { 2.0 } else { 0.0 };
                    let joints = [upper, middle, lower];
                    for (joint, role) in joints.into_iter().zip(proportions.roles) {
                        cost += tree.cost_of_name(joint, role);
                    }
                    found.push(LimbCandidate { joints, lengths: [first, second], cost });
                }
            }
        }
        found
    }

    fn is_bone(&self, length: f64) -> bool {
        length > 0.05 * self.stature && length < 0.6 * self.stature
    }

    fn pair(&self, a: &LimbCandidate, b: &LimbCandidate, proportions: &LimbProportions) -> Option<LimbPair> {
        let tree = self.tree;
        let above = tree.common_ancestor(a.joints[0], b.joints[0])?;
        if above == a.joints[0] || above == b.joints[0] {
            return None;
        }
        let width = tree.distance(a.joints[0], b.joints[0]);
        let lengths = [0, 1].map(|bone| 0.5 * (a.lengths[bone] + b.lengths[bone]));
        let mut cost = a.cost + b.cost + misfit(width / (lengths[0] + lengths[1]), proportions.width, 0.35);
        let mut votes = 0_i32;
        for (&a, &b) in a.joints.iter().zip(&b.joints) {
            match is_left_of(tree.names[a], tree.names[b]) {
                Some(true) => votes += 1,
                Some(false) => votes -= 1,
                // a hand on one side and a finger on the other are no pair, however alike their bones
                None => cost += if self.roles[a].zip(self.roles[b]).is_some_and(|(a, b)| a != b) { WORST } else { 0.0 },
            }
            // mirror images have as many joints on either side
            cost += 0.5 * f64::from(u8::from(tree.upwards(a).count() != tree.upwards(b).count()));
        }
        cost -= 0.5 * f64::from(votes.abs());
        // if all names say so, the bones of one side are too short
        let is_named = |limb: &LimbCandidate| (0..3).all(|i| self.roles[limb.joints[i]] == Some(proportions.roles[i]));
        let most = if votes.abs() == 3 && is_named(a) && is_named(b) { 2.0 } else { 2.0 * WORST };
        cost += (0..2).map(|bone| misfit(a.lengths[bone] / b.lengths[bone], 1.0, 0.08)).sum::<f64>().min(most);
        Some(LimbPair { limbs: [a.joints, b.joints], above, lengths, width, cost })
    }
}

fn changing(share: f64) -> f64 {
    (share / RIGID * share / RIGID).min(WORST)
}

/// The median distance of two joints over the poses, and the change of all but the extreme tenths.
fn length_and_change(tree: &JointTree<'_>, a: usize, b: usize) -> (f64, f64) {
    let mut values: Vec<f64> = tree.poses.iter().map(|pose| (pose[a] - pose[b]).norm()).collect();
    values.sort_by(f64::total_cmp);
    let Some(last) = values.len().checked_sub(1) else { return (0.0, 0.0) };
    let change = values[last - last / 10] - values[last / 10];
    (median(values), change)
}
