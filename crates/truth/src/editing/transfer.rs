//! Transfers a motion to the same robot at another size.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use skiagraph_core::body::{Humanoid, Motion, Pose};

/// Transfers the motion of `from` to `to`, the same robot scaled to another subject: joint angles are kept, and the
/// root's trajectory and height are scaled by the ratio of the root heights at the zero pose, so that feet keep their
/// ground contact.
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

/// Height of the root above the body's lowest point at the zero pose, metres.
fn root_height(body: &Humanoid) -> Option<f64> {
    let frames = body.link_frames(&body.zero_pose());
    let links: Vec<usize> = (0..body.links.len()).collect();
    Some(frames[0].translation.vector.z - body.lowest_point(&frames, &links)?.z)
}

/// The component of a rigid motion on the ground: rotation about the vertical and horizontal translation.
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
    use skiagraph_core::body::{BodyShape, LinkShape, shipped};

    #[test]
    fn feet_keep_ground_contact_at_another_size_and_steps_scale() {
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
