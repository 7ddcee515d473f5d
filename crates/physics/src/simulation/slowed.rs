//! Slows down motions that no joint could follow: in recordings, lost limbs jump back within a frame.

use skiagraph_core::body::{Humanoid, Motion};

/// The motion with no joint faster than its greatest speed. A joint can be slowed down forward from the first frame or
/// backward from the last; the smaller change is used, so a limb lost in the first frames does not swing in from
/// there.
pub(super) fn slowed(body: &Humanoid, mut motion: Motion) -> Motion {
    for (dof, limits) in body.degrees_of_freedom.iter().enumerate() {
        let most = limits.max_velocity / motion.frames_per_second;
        let recorded: Vec<f64> = motion.poses.iter().map(|pose| pose.joint_angles[dof]).collect();
        let onwards = limited(recorded.iter(), most);
        let mut back = limited(recorded.iter().rev(), most);
        back.reverse();
        let changed = |angles: &[f64]| angles.iter().zip(&recorded).map(|(a, b)| (a - b).abs()).sum::<f64>();
        let slow = if changed(&back) < changed(&onwards) { back } else { onwards };
        motion.poses.iter_mut().zip(slow).for_each(|(pose, angle)| pose.joint_angles[dof] = angle);
    }
    motion
}

/// Angles that follow others by at most `most` per frame.
fn limited<'a>(mut angles: impl Iterator<Item = &'a f64>, most: f64) -> Vec<f64> {
    let Some(&first) = angles.next() else { return Vec::new() };
    let follow = |last: &mut f64, angle: &f64| {
        *last = angle.clamp(*last - most, *last + most);
        Some(*last)
    };
    std::iter::once(first).chain(angles.scan(first, follow)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::standing;

    #[test]
    fn a_limb_lost_at_the_start_or_end_is_slowed_and_the_rest_is_unchanged() {
        let (mut body, still) = standing(8);
        body.degrees_of_freedom[3].max_velocity = 6.0;
        let slow_from = |angles: [f64; 8]| {
            let mut motion = still.clone();
            motion.poses.iter_mut().zip(angles).for_each(|(pose, angle)| pose.joint_angles[3] = angle);
            let slow = slowed(&body, motion.clone());
            let found: Vec<f64> = slow.poses.iter().map(|pose| pose.joint_angles[3]).collect();
            motion.poses.iter_mut().zip(&found).for_each(|(pose, angle)| pose.joint_angles[3] = *angle);
            assert_eq!(slow, motion, "nothing else changes");
            found
        };
        // 6 rad/s are 0.1 rad a frame
        let near = |found: Vec<f64>, expected: [f64; 8]| found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(slow_from([1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), [0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
        assert!(near(slow_from([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.5]), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1]));
        let walks = [0.0, 0.05, 0.1, 0.15, 0.1, 0.05, 0.0, -0.05];
        assert_eq!(slow_from(walks), walks);
    }
}
