//! Where the feet are: the lowest flesh of a pose, and the shift that makes a motion stand on the ground.

use nalgebra::{Isometry3, Vector3};

use crate::body::{Flesh, Humanoid, Landmark, LinkFrames, Motion};

/// Share of the frames whose lowest point may lie below the ground after [`stand_on_ground`].
const BELOW_GROUND_SHARE: f64 = 0.05;

/// Links of the feet: those that carry the ankles' markers and all that hang on them.
pub(super) fn foot_links(humanoid: &Humanoid) -> Vec<usize> {
    let ankles = [Landmark::LeftAnkle, Landmark::RightAnkle]
        .map(|landmark| humanoid.markers[landmark as usize].map(|marker| marker.link));
    let mut is_foot = vec![false; humanoid.links.len()];
    for link in 0..humanoid.links.len() {
        is_foot[link] = ankles.contains(&Some(link)) || humanoid.parent(link).is_some_and(|parent| is_foot[parent]);
    }
    (0..humanoid.links.len()).filter(|&link| is_foot[link]).collect()
}

/// Height of the lowest point of the feet's flesh in every pose, metres; infinite where the feet have none.
pub(super) fn foot_heights(humanoid: &Humanoid, motion: &Motion) -> Vec<f64> {
    let feet = foot_links(humanoid);
    let mut frames = LinkFrames::default();
    let lowest_of = |frames: &LinkFrames, link: usize| {
        humanoid.links[link].flesh.iter().map(|flesh| lowest(flesh, &frames[link])).fold(f64::INFINITY, f64::min)
    };
    let heights = motion.poses.iter().map(|pose| {
        humanoid.link_frames_into(pose, &mut frames);
        feet.iter().map(|&link| lowest_of(&frames, link)).fold(f64::INFINITY, f64::min)
    });
    heights.collect()
}

/// Shifts a motion so that its feet stand on z = 0: 5 % of the frames may reach below. Returns by how much, metres.
pub(super) fn stand_on_ground(humanoid: &Humanoid, motion: &mut Motion) -> f64 {
    let heights = foot_heights(humanoid, motion).into_iter().filter(|h| h.is_finite()).collect();
    let shift = -super::quantile(heights, BELOW_GROUND_SHARE).unwrap_or(0.0);
    shift_all(motion, &Vector3::new(0.0, 0.0, shift));
    shift
}

/// Shifts a motion over the ground so that the middle of the root's path (of the box around it) is at the origin. Returns by
/// how much, metres.
pub(super) fn centre_path(motion: &mut Motion) -> Vector3<f64> {
    let places = || motion.poses.iter().map(|pose| pose.world_from_root.translation.vector);
    let Some(first) = places().next() else { return Vector3::zeros() };
    let (low, high) = places().fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    let mut shift = -(low + high) * 0.5;
    shift.z = 0.0;
    shift_all(motion, &shift);
    shift
}

fn shift_all(motion: &mut Motion, by: &Vector3<f64>) {
    for pose in &mut motion.poses {
        pose.world_from_root.translation.vector += by;
    }
}

/// Height of the lowest point of a solid.
fn lowest(flesh: &Flesh, world_from_link: &Isometry3<f64>) -> f64 {
    /// How much of the world's up lies along each axis of a frame.
    fn rise(frame: &Isometry3<f64>) -> Vector3<f64> {
        frame.rotation.inverse() * Vector3::z()
    }
    match flesh {
        Flesh::TaperedCapsule(capsule) => {
            let (a, b) = (world_from_link * capsule.a, world_from_link * capsule.b);
            (a.z - capsule.radius_a).min(b.z - capsule.radius_b)
        }
        Flesh::Box { link_from_box, half_extents } => {
            let frame = world_from_link * link_from_box;
            let reach = rise(&frame).abs().dot(&Vector3::from(*half_extents));
            frame.translation.z - reach
        }
        Flesh::Cylinder { link_from_cylinder, radius, half_length } => {
            let frame = world_from_link * link_from_cylinder;
            let rise = rise(&frame);
            frame.translation.z - rise.z.abs() * half_length - radius * rise.xy().norm()
        }
        Flesh::Mesh { vertices, .. } => {
            vertices.iter().map(|vertex| (world_from_link * vertex).z).fold(f64::INFINITY, f64::min)
        }
    }
}
