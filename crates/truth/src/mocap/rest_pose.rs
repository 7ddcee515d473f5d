//! Detects a rest pose inserted before the motion by a converter: cgspeed's BVH versions of CMU's recordings start with
//! a T-pose.

use nalgebra::Isometry3;

use super::Clip;

/// Least shares of the moving joints that are exactly unrotated in a rest pose, each with the least ratio of the step
/// from it to the largest of the following steps. A pose of which nothing is rotated needs the smallest step; cgspeed's
/// has turned thighs and neck, that of Xsens a trunk, too.
const RESTING_SHARES: [(f64, f64); 3] = [(0.95, 2.0), (0.7, 5.0), (0.35, 30.0)];

/// Number of following steps to compare with.
const COMPARED_STEPS: usize = 60;

/// Note of a clip with an inserted rest pose.
pub(super) const REST_POSE_NOTE: &str = "the first frame is a rest pose inserted before the motion";

impl Clip {
    /// Whether frame 0 is a rest pose that is not part of the motion: most moving joints are exactly unrotated, and the
    /// body jumps between frames 0 and 1.
    pub fn has_inserted_rest_pose(&self) -> bool {
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

    /// Removes an inserted rest pose, if there is one, with a note.
    pub fn without_inserted_rest_pose(mut self) -> Self {
        if self.has_inserted_rest_pose() {
            self.frames.remove(0);
            self.notes.retain(|note| note != REST_POSE_NOTE);
            self.notes.push("left out: a rest pose inserted before the motion".to_owned());
        }
        self
    }
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
            notes: Vec::new(),
            cyclic: false,
            up: Default::default(),
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
        for (index, transform) in
            clip.frames.iter_mut().enumerate().flat_map(|(i, f)| f.iter_mut().map(move |t| (i, t)))
        {
            *transform = Isometry3::new(Vector3::zeros(), Vector3::x() * (0.02 * index as f64));
        }
        assert!(!clip.has_inserted_rest_pose());
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
