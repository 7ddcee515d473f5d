//! Blending from one motion into another.

use nalgebra::Isometry3;

use skiagraph_core::body::{Humanoid, Motion, Pose};

/// Weight of the second motion in frame `index` (from 0) of a blend over `frames`: a cubic with slope 0 at both ends,
/// so velocities are continuous (`[Kovar 2002]`, section 3.2).
pub(super) fn share(index: usize, frames: usize) -> f64 {
    let t = (index + 1) as f64 / (frames + 1) as f64;
    t * t * (3.0 - 2.0 * t)
}

/// `pose` moved by a rigid transform of the world.
pub(super) fn moved(pose: &Pose, world_from_old: &Isometry3<f64>) -> Pose {
    Pose { world_from_root: world_from_old * pose.world_from_root, joint_angles: pose.joint_angles.clone() }
}

/// Cuts `motion` at frame `leaves` and continues with `next` from frame `enters`, moved by `world_from_next`. The first
/// `blend` frames from there are blended; both motions must have that many left.
pub(super) fn continue_with(
    body: &Humanoid,
    motion: &mut Motion,
    leaves: usize,
    next: &Motion,
    enters: usize,
    world_from_next: &Isometry3<f64>,
    blend: usize,
) {
    for index in 0..blend {
        let to = moved(&next.poses[enters + index], world_from_next);
        let from = &mut motion.poses[leaves + index];
        *from = from.blended(&to, share(index, blend), body);
    }
    motion.poses.truncate(leaves + blend);
    motion.poses.extend(next.poses[enters + blend..].iter().map(|pose| moved(pose, world_from_next)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_rise_from_0_to_1_symmetrically_and_slowly_at_the_ends() {
        let shares: Vec<f64> = (0..19).map(|index| share(index, 19)).collect();
        assert!(shares.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(shares.iter().zip(shares.iter().rev()).all(|(a, b)| (a + b - 1.0).abs() < 1e-12));
        assert!(shares[0] < 0.01 && (shares[9] - 0.5).abs() < 1e-12);
    }
}
