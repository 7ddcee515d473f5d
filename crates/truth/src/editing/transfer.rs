//! A motion given to the same robot of another size.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::body::{Humanoid, Motion, Pose};

/// The motion of `from` as one of `to`, the same robot scaled to another subject: joint angles stay, and the root's
/// path and height grow with the height at which the root is when the body stands at its zero pose. Feet that stood
/// stand.
pub fn carried_over(from: &Humanoid, to: &Humanoid, motion: &Motion) -> Motion {
    let growth = match (root_height(from), root_height(to)) {
        (Some(was), Some(is)) if was > 0.0 && is > 0.0 => is / was,
        _ => 1.0,
    };
    let carried = |pose: &Pose| {
        let mut pose = pose.clone();
        pose.world_from_root.translation.vector *= growth;
        pose
    };
    Motion { frames_per_second: motion.frames_per_second, poses: motion.poses.iter().map(carried).collect() }
}

/// How high the root is above the lowest point of the body at its zero pose, metres.
fn root_height(body: &Humanoid) -> Option<f64> {
    let frames = body.link_frames(&body.zero_pose());
    let links: Vec<usize> = (0..body.links.len()).collect();
    Some(frames[0].translation.vector.z - body.lowest_point(&frames, &links)?.z)
}

/// The part of a rigid motion that stays on the ground: the turn about the vertical, and the horizontal shift.
pub(super) fn on_ground(transform: &Isometry3<f64>) -> Isometry3<f64> {
    let rotation = transform.rotation;
    let heading = 2.0 * libm::atan2(rotation.k, rotation.w);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    let shift = transform.translation.vector;
    Isometry3::from_parts(Vector3::new(shift.x, shift.y, 0.0).into(), turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{BodyShape, LinkShape, shipped};

    #[test]
    fn feet_that_stood_stand_on_a_body_of_another_size_and_steps_grow_with_it() {
        let small = shipped("actor").unwrap();
        let uniform = LinkShape { length: Vector3::repeat(1.2), girth: 1.2 };
        let tall = small.reshaped(&BodyShape { links: vec![uniform; small.links.len()] });
        let height = root_height(&small).unwrap();
        let mut poses = vec![small.zero_pose(); 2];
        for (pose, x) in poses.iter_mut().zip([0.0, 0.5]) {
            pose.world_from_root = Isometry3::translation(x, 0.0, height);
        }
        let carried = carried_over(&small, &tall, &Motion { frames_per_second: 60.0, poses });
        let links: Vec<usize> = (0..tall.links.len()).collect();
        let lowest = tall.lowest_point(&tall.link_frames(&carried.poses[1]), &links).unwrap();
        assert!(lowest.z.abs() < 1e-9, "{lowest}");
        assert!((carried.poses[1].world_from_root.translation.x - 0.6).abs() < 1e-6);
    }
}
