//! Compares rotation speeds of the body with the recording.

use crate::mocap::Clip;
use skiagraph_core::body::{Humanoid, LinkFrames, Motion};

/// Allowed excess over the fastest recorded joint, rad/s, for interpolation and noise.
pub(super) const MARGIN: f64 = 3.0;
/// Recorded speeds are maxima over this many frames on either side, since a fit may lag by as much.
const REACH: usize = 2;

/// The largest world rotation of any of `joints` per step, radians: entry `i` is for the step into frame `i`, maximised
/// over neighbouring steps.
pub(super) fn recorded_rotations(clip: &Clip, joints: &[usize]) -> Vec<f64> {
    let mut turns = vec![0.0; clip.frames.len()];
    let mut before = None;
    for (frame, turn) in turns.iter_mut().enumerate() {
        let now = clip.joint_frames(frame);
        if let Some(before) = before.replace(now.clone()) {
            let between = |&joint: &usize| {
                let (a, b): (&nalgebra::Isometry3<f64>, &nalgebra::Isometry3<f64>) = (&before[joint], &now[joint]);
                a.rotation.angle_to(&b.rotation)
            };
            *turn = joints.iter().map(between).fold(0.0, f64::max);
        }
    }
    let window = |i: usize| &turns[i.saturating_sub(REACH)..(i + REACH + 1).min(turns.len())];
    (0..turns.len()).map(|i| window(i).iter().copied().fold(0.0, f64::max)).collect()
}

/// The link with geometry or mass that rotates most in the world between two poses, and its rotation, radians.
pub(super) fn largest_rotation(humanoid: &Humanoid, before: &LinkFrames, after: &LinkFrames) -> (usize, f64) {
    let is_body = |link: &usize| !humanoid.links[*link].solids.is_empty() || humanoid.links[*link].inertia.is_some();
    let turn = |link: usize| (link, before[link].rotation.angle_to(&after[link].rotation));
    let turns = (0..humanoid.links.len()).filter(is_body).map(turn);
    turns.fold((0, 0.0), |most, next| if next.1 > most.1 { next } else { most })
}

/// Maximum number of frames listed in a note.
const LISTED: usize = 10;

/// A note on the frames, from 0, into which the body rotates faster than the recording by more than [`MARGIN`], if any.
pub(super) fn note(humanoid: &Humanoid, motion: &Motion, recorded: &[f64]) -> Option<String> {
    let frames: Vec<LinkFrames> = motion.poses.iter().map(|pose| humanoid.link_frames(pose)).collect();
    let excess = |i: usize| {
        let (link, turn) = largest_rotation(humanoid, &frames[i - 1], &frames[i]);
        (i, link, (turn - recorded[i]) * motion.frames_per_second)
    };
    let faster: Vec<_> = (1..frames.len()).map(excess).filter(|(.., excess)| *excess > MARGIN).collect();
    let (worst, link, most) = faster.iter().copied().max_by(|a, b| a.2.total_cmp(&b.2))?;
    let listed: Vec<String> = faster.iter().take(LISTED).map(|(frame, ..)| frame.to_string()).collect();
    let more = if faster.len() > LISTED { format!(" and {} more", faster.len() - LISTED) } else { String::new() };
    Some(format!(
        "the actor's joints turn more than {MARGIN} rad/s faster than recorded into frame {}{more}; by {most:.1} rad/s \
        at most (`{}`, frame {worst})",
        listed.join(", "),
        humanoid.links[link].name
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::shipped;

    #[test]
    fn a_jump_of_the_spine_that_is_not_recorded_is_noted_by_frame_and_link() {
        let body = shipped("actor").unwrap();
        let lumbar = body.find_degree_of_freedom("lumbar_flexion").unwrap();
        let mut poses = vec![body.zero_pose(); 6];
        for pose in &mut poses[3..] {
            pose.joint_angles[lumbar] = 0.5;
        }
        let motion = Motion { frames_per_second: 120.0, poses };
        let still = note(&body, &motion, &[0.0; 6]).unwrap();
        assert!(still.contains("into frame 3; by 60.0 rad/s at most") && still.contains("frame 3)"), "{still}");
        assert_eq!(note(&body, &motion, &[0.0, 0.0, 0.0, 0.48, 0.0, 0.0]), None, "2.4 rad/s are within the margin");
    }
}
