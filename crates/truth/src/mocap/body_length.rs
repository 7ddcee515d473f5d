//! The stature of a recorded body, estimated from its reach and its bone lengths; independent of rest pose and axes.

use nalgebra::{Isometry3, Point3, Vector3};

use super::Clip;
use skiagraph_core::body::human_tree::{self, JointTree};

/// Length of the longest path along a human skeleton's bones, from a hand to a foot, in units of stature: 1.48 to 1.62
/// in six recordings of four conventions.
const LONGEST_PATH: f64 = 1.55;

/// Tolerated relative difference between a body's reach and the estimate from its bones: reach is smaller if the body
/// never stands upright, larger with raised arms.
const REACH_TOLERANCE: f64 = 0.1;

/// Number of measured frames, spread over the clip.
const SAMPLES: usize = 101;

/// Poses in which limbs are looked for, spread over the clip.
const POSES: usize = 25;

/// All joints and ends together may be longer than the stature by legs and trunk by this factor: raised arms, hats and
/// swords. Beyond it some are not the body's, but helpers of a rig, or a camera.
const MOST_BY_LIMBS: f64 = 1.25;

impl Clip {
    /// Approximate stature of the recorded body in any posture, from its reach and its bones, metres. 0 for a skeleton
    /// without extent.
    pub fn stature(&self) -> f64 {
        let of_all = Body::from_clip(self).length(self);
        match human_tree::find(&self.joint_tree().tree) {
            Ok(body) if of_all > MOST_BY_LIMBS * body.stature => body.stature,
            _ => of_all,
        }
    }

    /// The joints and the ends of their bones in some poses, as the tree in which a body is looked for.
    pub(crate) fn joint_tree(&self) -> PosedTree<'_> {
        let skeleton = &self.skeleton.joints;
        let mut tree = JointTree {
            names: skeleton.iter().map(|joint| joint.name.as_str()).collect(),
            parents: skeleton.iter().map(|joint| joint.parent).collect(),
            ..JointTree::default()
        };
        let mut tips = Vec::new();
        for (index, joint) in skeleton.iter().enumerate() {
            if joint.tip.is_some_and(|tip| tip.norm() > 1e-6) {
                tree.names.push("");
                tree.parents.push(Some(index));
                tips.push(index);
            }
        }
        let mut frames = Vec::new();
        for frame in spread(self, POSES) {
            let placed = self.skeleton.joint_frames(frame);
            let mut pose: Vec<Point3<f64>> = placed.iter().map(|at| at.translation.vector.into()).collect();
            for &joint in &tips {
                pose.push(placed[joint] * Point3::from(skeleton[joint].tip.unwrap_or_default()));
            }
            tree.poses.push(pose);
            frames.push(placed);
        }
        PosedTree { tree, tips, frames }
    }
}

/// A clip as a tree of joints.
pub(crate) struct PosedTree<'a> {
    pub(crate) tree: JointTree<'a>,
    /// The joint whose tip each node after the joints is.
    pub(crate) tips: Vec<usize>,
    /// Frames of all joints in each of the tree's poses.
    pub(crate) frames: Vec<Vec<Isometry3<f64>>>,
}

fn spread(clip: &Clip, most: usize) -> impl Iterator<Item = &Vec<Isometry3<f64>>> {
    clip.frames.iter().step_by(clip.frames.len().div_ceil(most).max(1))
}

pub(super) fn sampled(clip: &Clip) -> impl Iterator<Item = &Vec<Isometry3<f64>>> {
    spread(clip, SAMPLES)
}

/// The quantile of the values; 0 without values.
pub(super) fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let index = (share * values.len() as f64) as usize;
    values.get(index.min(values.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

/// The joints of the body, from the first joint with several children. Its ancestors only position the body.
pub(super) struct Body {
    is_part: Vec<bool>,
    top: usize,
}

impl Body {
    pub(super) fn from_clip(clip: &Clip) -> Self {
        let joints = &clip.skeleton.joints;
        let mut children = vec![0_usize; joints.len()];
        joints.iter().filter_map(|joint| joint.parent).for_each(|parent| children[parent] += 1);
        let is_top = |joint: &usize| children[*joint] != 1 || joints[*joint].tip.is_some();
        let top = (0..joints.len()).find(is_top).unwrap_or(0);
        let mut is_part = vec![false; joints.len()];
        for (index, joint) in joints.iter().enumerate() {
            is_part[index] = index == top || joint.parent.is_some_and(|parent| is_part[parent]);
        }
        Self { is_part, top }
    }

    /// Positions of all joints and tips.
    pub(super) fn points(&self, clip: &Clip, frame: &[Isometry3<f64>]) -> Vec<Point3<f64>> {
        let world = clip.skeleton.joint_frames(frame);
        let joints = clip.skeleton.joints.iter().zip(&world).zip(&self.is_part).filter(|(_, is_part)| **is_part);
        let of = joints.flat_map(|((joint, at), _)| {
            [Some(Point3::origin()), joint.tip.map(Point3::from)].into_iter().flatten().map(move |point| at * point)
        });
        of.collect()
    }

    /// The body's stature: its reach in the sampled frames, bounded by its bones.
    pub(super) fn length(&self, clip: &Clip) -> f64 {
        let reaches: Vec<f64> = sampled(clip).map(|frame| reach(&self.points(clip, frame))).collect();
        let by_bones = self.longest_path(clip) / LONGEST_PATH;
        quantile(reaches, 0.75).clamp((1.0 - REACH_TOLERANCE) * by_bones, (1.0 + REACH_TOLERANCE) * by_bones)
    }

    /// The longest path along bones between two ends of the body, with the median length of each bone over the frames.
    fn longest_path(&self, clip: &Clip) -> f64 {
        let joints = &clip.skeleton.joints;
        // the longest path down from each joint
        let mut down: Vec<f64> = joints.iter().map(|joint| joint.tip.map_or(0.0, |tip| tip.norm())).collect();
        let mut longest = down[self.top.min(down.len().saturating_sub(1))..].first().copied().unwrap_or(0.0);
        for index in (self.top + 1..joints.len()).rev().filter(|index| self.is_part[*index]) {
            let Some(parent) = joints[index].parent else { continue };
            let bone = quantile(sampled(clip).map(|frame| frame[index].translation.vector.norm()).collect(), 0.5);
            longest = longest.max(down[parent] + bone + down[index]);
            down[parent] = down[parent].max(bone + down[index]);
        }
        longest
    }
}

pub(super) fn bounds(points: &[Point3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    let none = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    points.iter().fold(none, |(low, high), p| (low.inf(&p.coords), high.sup(&p.coords)))
}

/// The largest distance between two points.
fn reach(points: &[Point3<f64>]) -> f64 {
    let pairs =
        points.iter().enumerate().flat_map(|(i, a)| points[i + 1..].iter().map(move |b| (a - b).norm_squared()));
    pairs.fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mocap::{ReadOptions, Skeleton, SkeletonJoint, parse_deepmimic};

    #[test]
    fn stature_matches_the_model_for_a_whole_walk_and_a_part_of_it() {
        let text = include_str!("../../../../scenarios/motions/humanoid3d_walk.txt");
        let clip = parse_deepmimic(text, "walk.txt", &ReadOptions::default()).unwrap();
        // from the soles to the top of the head: 0.0225 + 0.40987 + 0.421546 + 0.236151 + 0.223894 + 0.2775 m
        let standing = 1.591;
        assert!((clip.stature() / standing - 1.0).abs() < 0.1, "{}", clip.stature());
        let part = clip.clone().crop(5..12).unwrap();
        assert!((part.stature() / clip.stature() - 1.0).abs() < 0.05, "{}", part.stature());
    }

    // Bones that carry a rig's muscles far beside the hands made a person 2.3 m tall, and a camera one 3.9 m.
    #[test]
    fn helpers_far_away_are_no_stature() {
        let text = include_str!("../../../../scenarios/motions/humanoid3d_walk.txt");
        let walk = parse_deepmimic(text, "walk.txt", &ReadOptions::default()).unwrap();
        for (carrier, away) in [("right_wrist", Vector3::y() * 1.6), ("neck", Vector3::z() * 3.0)] {
            let mut clip = walk.clone();
            let parent = clip.skeleton.find(carrier);
            clip.skeleton.joints.push(SkeletonJoint { name: "helper".to_owned(), parent, tip: Some(0.1 * away) });
            for frame in &mut clip.frames {
                frame.push(Isometry3::from(away));
            }
            assert!(Body::from_clip(&clip).length(&clip) > 1.25 * walk.stature(), "{carrier}");
            assert!((clip.stature() / walk.stature() - 1.0).abs() < 0.15, "{carrier}: {}", clip.stature());
        }
    }

    #[test]
    fn stature_does_not_depend_on_position() {
        let joint = |parent, tip| SkeletonJoint { name: "j".to_owned(), parent, tip };
        let up = Vector3::z() * 0.8;
        // a root on the ground, far from its child, the hips; a head and a foot below the hips
        let skeleton = Skeleton {
            joints: vec![joint(None, None), joint(Some(0), None), joint(Some(1), Some(up)), joint(Some(1), Some(-up))],
        };
        let frame = |index: usize| {
            let hips = Isometry3::translation(5.0 + index as f64, 0.0, 0.9);
            vec![Isometry3::identity(), hips, Isometry3::identity(), Isometry3::identity()]
        };
        let frames = (0..9).map(frame).collect();
        let clip = Clip { name: "far".to_owned(), skeleton, frames_per_second: 60.0, frames, ..Clip::default() };
        assert!((clip.stature() - 1.6 / LONGEST_PATH * (1.0 + REACH_TOLERANCE)).abs() < 1e-12, "{}", clip.stature());
    }
}
