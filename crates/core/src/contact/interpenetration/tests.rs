use super::*;
use crate::body::{Pose, shipped};
use crate::contact::GroundContacts;
use nalgebra::UnitQuaternion;

fn crumpled(body: &Humanoid, index: u64) -> Pose {
    // arbitrary but reproducible angles
    let mut step = 0.0;
    let mut between = |low: f64, high: f64| {
        step += 78.233;
        low + (high - low) * (libm::sin(index as f64 * 12.9898 + step) * 43_758.545).rem_euclid(1.0)
    };
    let mut pose = body.zero_pose();
    for (angle, limits) in pose.joint_angles.iter_mut().zip(&body.degrees_of_freedom) {
        *angle = between(limits.lower.max(-2.0), limits.upper.min(2.0));
    }
    let turn = UnitQuaternion::from_euler_angles(0.4, between(-0.5, 0.5), 1.0);
    let place = Vector3::new(3.0, -2.0, between(0.3, 1.2));
    pose.world_from_root = Isometry3::from_parts(place.into(), turn);
    pose
}

fn with_boxes(mut body: Humanoid) -> Humanoid {
    for name in ["left_forearm", "right_shank"] {
        let link = body.find_link(name).unwrap();
        let half_extents = [0.04, 0.05, 0.12];
        body.links[link].solids =
            vec![Solid::Box { link_from_box: Isometry3::translation(0.0, 0.0, -0.12), half_extents }];
    }
    body
}

/// A solid of tracker25, all of which are tapered capsules, in another frame.
fn placed(solid: &Solid, frame: &Isometry3<f64>) -> TaperedCapsule {
    let Solid::TaperedCapsule(capsule) = solid else { panic!("a capsule") };
    capsule.transformed(frame)
}

/// Compares the ground depth with the lowest point of the surface, and self-collision with all pairs of links one by
/// one.
#[test]
fn depths_agree_with_the_direct_computation() {
    let actor = shipped("actor").unwrap();
    let mut collided = 0;
    for body in [shipped("tracker25").unwrap(), with_boxes(actor.clone()), actor] {
        let [fast, tolerant] = [0.0, 0.02].map(|tolerance_m| Interpenetration::new(&body, tolerance_m));
        let slow = SelfCollision::new(&body);
        let all: Vec<usize> = (0..body.links.len()).collect();
        let mut scratch = InterpenetrationScratch::default();
        for index in 0..200 {
            let frames = body.link_frames(&crumpled(&body, index));
            let found = fast.depths(&frames, &mut scratch);
            let ground = (-body.lowest_point(&frames, &all).unwrap().z).max(0.0);
            let own = slow.deepest_m(&frames);
            assert!((found.ground_m - ground).abs() < 1e-9, "{} {index}: {found:?} {ground}", body.name);
            assert!((found.own_m - own).abs() < 1e-6, "{} {index}: {found:?} {own}", body.name);
            assert!(found.own_sum_m >= found.own_m);
            let tolerant = tolerant.depths(&frames, &mut scratch);
            assert!((tolerant.own_m - (found.own_m - 0.02).max(0.0)).abs() < 1e-12);
            assert!((tolerant.ground_m - (found.ground_m - 0.02).max(0.0)).abs() < 1e-12);
            collided += u32::from(own > 0.01);
        }
    }
    assert!(collided > 100, "too few collisions for a test: {collided}");
}

#[test]
fn depths_are_the_same_in_a_cameras_frame() {
    let body = shipped("tracker25").unwrap();
    let solids = Interpenetration::new(&body, 0.01);
    let (mut scratch, mut deep) = (InterpenetrationScratch::default(), 0);
    for index in 0..300 {
        let frames = body.link_frames(&crumpled(&body, index));
        let turn = UnitQuaternion::from_euler_angles(1.0 + 0.1 * index as f64, 0.7, -1.2);
        let camera_from_world = Isometry3::from_parts(Vector3::new(0.3, -0.8, 4.5).into(), turn);
        let placed = body.links.iter().zip(&frames.0).flat_map(|(link, world_from_link)| {
            let camera_from_link = camera_from_world * world_from_link;
            link.solids.iter().map(move |solid| placed(solid, &camera_from_link))
        });
        let capsules: Vec<TaperedCapsule> = placed.collect();
        let seen = solids.depths_in_camera(&frames, &capsules, &camera_from_world, &mut scratch);
        let there = solids.depths(&frames, &mut scratch);
        for (seen, there) in
            [(seen.ground_m, there.ground_m), (seen.own_m, there.own_m), (seen.own_sum_m, there.own_sum_m)]
        {
            assert!((seen - there).abs() < 1e-12, "{index}: {seen} {there}");
            deep += u32::from(there > 0.01);
        }
    }
    assert!(deep > 100, "too few depths for a test: {deep}");
}

#[test]
fn a_body_without_solids_touches_nothing() {
    let mut body = shipped("tracker25").unwrap();
    let frames = body.link_frames(&body.zero_pose());
    body.links.iter_mut().for_each(|link| link.solids.clear());
    let found = Interpenetration::new(&body, 0.0).depths(&frames, &mut InterpenetrationScratch::default());
    assert_eq!(found, Depths::default());
    assert!(GroundContacts::from_frames(&body, &[frames], 60.0, &Default::default()).is_err());
}
