//! Detects a rest pose inserted before the motion by a converter: cgspeed's BVH versions of CMU's recordings start with
//! a T-pose.

use nalgebra::{Isometry3, Point3};

use super::Clip;

/// Least shares of the moving joints that are exactly unrotated in a rest pose, each with the least ratio of the step
/// from it to the largest of the following steps. A pose of which nothing is rotated needs the smallest step; cgspeed's
/// has turned thighs and neck, that of Xsens a trunk, too.
const RESTING_SHARES: [(f64, f64); 3] = [(0.95, 2.0), (0.7, 5.0), (0.35, 30.0)];
/// The same ratio for a T-pose, whatever is rotated in it.
const STEP_FROM_T_POSE: f64 = 3.0;
/// The least step from a T-pose, radians: who stands still in one may leave it by any ratio.
const LEAST_STEP: f64 = 0.1;
/// Least distance from hand to hand in a T-pose, as a share of the body's height, and the least height of the hands
/// above the lowest joint. Second Life's figures have arms as short as 0.76.
const T_POSE_SPAN: f64 = 0.72;
const T_POSE_HEIGHT: f64 = 0.6;
/// Greatest difference of the heights of the hands.
const T_POSE_TILT: f64 = 0.07;

/// Most frames for which a T-pose before a jump is held.
const LONGEST_T_POSE: usize = 32;
/// Longest time over which a converter's filter spreads the jump from a T-pose, seconds: nobody is so quick.
const LONGEST_FADE_S: f64 = 0.1;
/// Least way of a joint in such a jump, as a share of the body's height.
const LEAST_FADE: f64 = 0.15;
/// Number of following steps to compare with.
const COMPARED_STEPS: usize = 60;

/// Note of a clip with an inserted rest pose.
pub(super) const REST_POSE_NOTE: &str = "the first frame is a rest pose inserted before the motion";

impl Clip {
    /// Whether the clip begins with a rest pose that is not part of the motion: most moving joints are exactly
    /// unrotated in frame 0, or a T-pose is held, and then the body jumps.
    pub fn has_inserted_rest_pose(&self) -> bool {
        self.inserted_rest_frames() > 0
    }

    fn inserted_rest_frames(&self) -> usize {
        if self.is_first_frame_at_rest() {
            return 1;
        }
        let is_jump = |frame: usize| {
            let step = |frame: usize| mean_turn(&self.frames[frame], &self.frames[frame + 1]);
            let later = frame + 1..self.frames.len().saturating_sub(1).min(frame + 1 + COMPARED_STEPS);
            step(frame) > LEAST_STEP.max(STEP_FROM_T_POSE * later.map(step).fold(0.0, f64::max))
        };
        let most = LONGEST_T_POSE.min(self.frames.len().saturating_sub(1));
        let held = (0..most).take_while(|&frame| self.is_t_pose(frame)).count();
        match held {
            0 => 0,
            _ if held < most && is_jump(held - 1) => held,
            _ => self.fade_after(held - 1).map_or(0, |fade| held - 1 + fade),
        }
    }

    /// The number of steps after a T-pose that are one jump, spread by a filter.
    fn fade_after(&self, t_pose: usize) -> Option<usize> {
        let longest = (LONGEST_FADE_S * self.frames_per_second) as usize;
        let steps = (t_pose..self.frames.len().saturating_sub(1)).take(longest + COMPARED_STEPS);
        let steps: Vec<f64> = steps.map(|frame| self.way(frame, frame + 1)).collect();
        let is_jump = |fade: &usize| {
            let (jump, later) = steps.split_at(*fade);
            let fastest = later.iter().take(COMPARED_STEPS).fold(0.0, |most: f64, step| most.max(*step));
            jump.iter().all(|step| *step > STEP_FROM_T_POSE * fastest)
        };
        let fade = (2..=longest.min(steps.len().saturating_sub(1))).find(is_jump)?;
        (self.way(t_pose, t_pose + fade) > LEAST_FADE * self.height(t_pose)).then_some(fade)
    }

    /// The longest way of a joint, relative to the root, from one frame to another.
    fn way(&self, from: usize, to: usize) -> f64 {
        let [from, to] = [from, to].map(|frame| self.joint_positions(frame));
        let ways = from.iter().zip(&to).map(|(a, b)| ((b - to[0]) - (a - from[0])).norm());
        ways.fold(0.0, f64::max)
    }

    fn height(&self, frame: usize) -> f64 {
        let [low, high] = heights(&self.joint_positions(frame));
        high - low
    }

    fn is_first_frame_at_rest(&self) -> bool {
        let [rest, next, after, ..] = self.frames.as_slice() else { return false };
        let is_resting = |transform: &Isometry3<f64>| transform.rotation.angle() < 1e-9;
        let moving: Vec<usize> =
            (1..rest.len()).filter(|&j| !(is_resting(&next[j]) && is_resting(&after[j]))).collect();
        let resting = moving.iter().filter(|&&j| is_resting(&rest[j])).count();
        let largest_later =
            self.frames[1..].windows(2).take(COMPARED_STEPS).map(|w| mean_turn(&w[0], &w[1])).fold(0.0, f64::max);
        let (resting, jump) = (resting as f64 / moving.len() as f64, mean_turn(rest, next));
        RESTING_SHARES.iter().any(|(share, ratio)| resting >= *share && jump > ratio * largest_later)
    }

    /// Whether the two joints that are farthest apart over the ground are as far apart, as high and as level as the
    /// hands of stretched arms.
    fn is_t_pose(&self, frame: usize) -> bool {
        let points = self.joint_positions(frame);
        let [lowest, highest] = heights(&points);
        let height = highest - lowest;
        let mut farthest = (0.0, lowest, lowest);
        for (index, a) in points.iter().enumerate() {
            for b in &points[..index] {
                let apart = (a.xy() - b.xy()).norm();
                if apart > farthest.0 {
                    farthest = (apart, a.z, b.z);
                }
            }
        }
        let (apart, a, b) = farthest;
        let are_high = a.min(b) - lowest > T_POSE_HEIGHT * height;
        apart > T_POSE_SPAN * height && are_high && (a - b).abs() < T_POSE_TILT * height
    }

    /// Removes an inserted rest pose, if there is one, with a note.
    pub fn without_inserted_rest_pose(mut self) -> Self {
        let count = self.inserted_rest_frames();
        if count > 0 {
            self.frames.drain(..count);
            self.notes.retain(|note| note != REST_POSE_NOTE);
            let held = if count > 1 { format!(", {count} frames") } else { String::new() };
            self.notes.push(format!("left out: a rest pose inserted before the motion{held}"));
        }
        self
    }
}

/// The lowest and the highest.
fn heights(points: &[Point3<f64>]) -> [f64; 2] {
    points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p.z), high.max(p.z)])
}

/// Mean rotation angle of the joints between two frames, radians.
fn mean_turn(a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.rotation.angle_to(&b.rotation)).sum::<f64>() / a.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::mocap::{Skeleton, SkeletonJoint};

    /// Three joints that turn 0.02 rad a frame from 0.5 rad on, with the first frame given.
    fn clip(first: [f64; 3]) -> Clip {
        let joint = |parent| SkeletonJoint { name: "j".to_owned(), parent, tip: None };
        let pose = |angles: [f64; 3]| angles.map(|a| Isometry3::new(Vector3::zeros(), Vector3::x() * a)).to_vec();
        let mut frames = vec![pose(first)];
        frames.extend((0..10).map(|index| pose([0.5 + 0.02 * f64::from(index); 3])));
        Clip {
            name: "made".to_owned(),
            skeleton: Skeleton { joints: vec![joint(None), joint(Some(0)), joint(Some(1))] },
            frames_per_second: 50.0,
            frames,
            ..Clip::default()
        }
    }

    #[test]
    fn an_unrotated_first_frame_followed_by_a_jump_is_removed_with_a_note() {
        let with = clip([0.3, 0.0, 0.0]);
        assert!(with.has_inserted_rest_pose(), "the root may be rotated upright");
        let without = with.clone().without_inserted_rest_pose();
        assert_eq!(without.frames, with.frames[1..]);
        assert_eq!(without.notes.len(), 1);
        assert!(!without.has_inserted_rest_pose());
    }

    #[test]
    fn a_motion_that_starts_in_another_pose_is_kept() {
        for first in [[0.48; 3], [0.1; 3]] {
            let clip = clip(first);
            assert_eq!(clip.clone().without_inserted_rest_pose(), clip);
        }
    }

    #[test]
    fn a_motion_that_starts_smoothly_from_rest_is_kept() {
        let mut clip = clip([0.0; 3]);
        for (index, frame) in clip.frames.iter_mut().enumerate() {
            frame.fill(Isometry3::new(Vector3::zeros(), Vector3::x() * (0.02 * index as f64)));
        }
        assert!(!clip.has_inserted_rest_pose());
    }

    /// A stick with arms that hang, 0.01 rad a frame; the first frame has them stretched.
    #[test]
    fn a_t_pose_before_a_jump_is_removed_and_a_motion_from_one_is_kept() {
        let joint = |name: &str, parent| SkeletonJoint { name: name.to_owned(), parent, tip: None };
        let joints = vec![joint("hips", None), joint("foot", Some(0)), joint("chest", Some(0)), joint("head", Some(2))];
        let mut skeleton = Skeleton { joints };
        let offsets = [[0.0, 0.0, 0.9], [0.0, 0.0, -0.9], [0.0, 0.0, 0.5], [0.0, 0.0, 0.3]];
        let mut at: Vec<Vector3<f64>> = offsets.map(Vector3::from).to_vec();
        for (name, side) in [("left", 1.0), ("right", -1.0)] {
            let arm = skeleton.joints.len();
            skeleton.joints.extend([joint(&format!("{name}_arm"), Some(2)), joint(&format!("{name}_hand"), Some(arm))]);
            at.extend([Vector3::new(0.0, 0.2 * side, 0.0), Vector3::new(0.0, 0.55 * side, 0.0)]);
        }
        // rotations that no joint has at rest, so that only the pose tells
        let pose = |angle: f64| -> Vec<Isometry3<f64>> {
            let turn = |j: usize| match j {
                4 => -angle,
                6 => angle,
                _ => 0.01,
            };
            at.iter().enumerate().map(|(j, at)| Isometry3::new(*at, Vector3::x() * turn(j))).collect()
        };
        let hanging = |frame: i32| pose(1.3 + 0.01 * f64::from(frame));
        let mut frames = vec![pose(0.02)];
        frames.extend((0..20).map(hanging));
        let clip = Clip { skeleton, frames, ..clip([0.0; 3]) };
        assert!(clip.has_inserted_rest_pose());
        let mut short_arms = clip.clone();
        short_arms.frames.iter_mut().for_each(|frame| [5, 7].iter().for_each(|&hand| frame[hand].translation.y *= 0.8));
        assert!(short_arms.has_inserted_rest_pose());
        let mut held = clip.clone();
        for frame in 0..12 {
            held.frames.insert(0, pose(0.02 + 1e-3 * f64::from(frame)));
        }
        let left = held.without_inserted_rest_pose();
        assert_eq!((left.frames.len(), left.notes.len()), (20, 1), "held for thirteen frames");
        // a filter had spread the jump over some frames, which were part of the truth
        let mut faded = clip.clone();
        for (index, angle) in [0.3, 0.7, 1.1].into_iter().enumerate() {
            faded.frames.insert(1 + index, pose(angle));
        }
        assert_eq!(faded.without_inserted_rest_pose().frames, clip.frames[1..]);
        let smooth = Clip { frames: (0..60).map(|frame| pose(0.02 * f64::from(frame))).collect(), ..clip };
        assert!(!smooth.has_inserted_rest_pose());
    }

    // Recordings of Xsens and mocopi: the first pose was truth, and the body turned by a right angle into the second.
    #[test]
    fn a_jump_tells_a_rest_pose_of_which_few_joints_are_unrotated() {
        let mut half = clip([0.0, 0.0, 0.3]);
        assert!(!half.has_inserted_rest_pose());
        half.frames[0][2].rotation = Default::default();
        assert!(half.has_inserted_rest_pose());
        half.frames[0][2] = Isometry3::new(Vector3::zeros(), Vector3::x() * -0.6);
        assert!(half.has_inserted_rest_pose(), "a step thirty times as long as the others");
    }
}
