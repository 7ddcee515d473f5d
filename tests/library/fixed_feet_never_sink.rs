//! After `plant_feet` no link is below the ground, in any motion. (It once left links other than feet below it, and
//! bodies without ankles below it and jerking.) Depths are measured with parry, independently of the library.

use nalgebra::{DVector, Isometry3, UnitQuaternion, Vector3};
use parry3d::math::{Pose as Place, Rotation, Vector};
use parry3d::shape::{Ball, Cuboid, Cylinder, Shape};
use proptest::prelude::*;
use skiagraph_core::body::{Humanoid, Motion, Pose, Solid, shipped};
use skiagraph_core::contact::ContactRule;
use skiagraph_physics::plant_feet;
use skiagraph_truth::mocap::{ReadOptions, read};
use skiagraph_truth::retarget::{RetargetOptions, retarget};

/// The tolerance in the documentation of `plant_feet`, metres; parry's single precision is a hundred times finer.
const TOLERANCE: f64 = 1e-4;

/// Depth of the deepest point of a body in any frame, metres, from parry's bounding boxes.
fn greatest_depth(body: &Humanoid, motion: &Motion) -> f64 {
    let mut deepest = f64::NEG_INFINITY;
    for pose in &motion.poses {
        let frames = body.link_frames(pose);
        for (link, place) in body.links.iter().zip(&frames.0) {
            for solid in &link.solids {
                deepest = deepest.max(-lowest(solid, place));
            }
        }
    }
    deepest
}

fn lowest(solid: &Solid, world_from_link: &Isometry3<f64>) -> f64 {
    let bottom = |shape: &dyn Shape, place: &Isometry3<f64>| f64::from(shape.compute_aabb(&parry(place)).mins.z);
    match solid {
        Solid::TaperedCapsule(c) => [(c.a, c.radius_a), (c.b, c.radius_b)]
            .map(|(centre, radius)| {
                bottom(
                    &Ball::new(radius as f32),
                    &(world_from_link * Isometry3::translation(centre.x, centre.y, centre.z)),
                )
            })
            .into_iter()
            .fold(f64::INFINITY, f64::min),
        Solid::Box { link_from_box, half_extents: [x, y, z] } => {
            bottom(&Cuboid::new(Vector::new(*x as f32, *y as f32, *z as f32)), &(world_from_link * link_from_box))
        }
        Solid::Cylinder { link_from_cylinder, radius, half_length } => {
            // parry's cylinders stand along y
            let upright = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
            let cylinder = Cylinder::new(*half_length as f32, *radius as f32);
            bottom(&cylinder, &(world_from_link * link_from_cylinder * upright))
        }
        Solid::Mesh { vertices, .. } => {
            vertices.iter().map(|vertex| (world_from_link * vertex).z).fold(f64::INFINITY, f64::min)
        }
    }
}

fn parry(place: &Isometry3<f64>) -> Place {
    let (at, q) = (place.translation.vector.map(|x| x as f32), place.rotation.cast::<f32>());
    Place::from_parts(Vector::new(at.x, at.y, at.z), Rotation::from_xyzw(q.i, q.j, q.k, q.w))
}

/// The greatest acceleration of the origin of any link, m/s^2.
fn greatest_acceleration(body: &Humanoid, motion: &Motion) -> f64 {
    let frames: Vec<_> = motion.poses.iter().map(|pose| body.link_frames(pose)).collect();
    let at = |frame: usize, link: usize| frames[frame].0[link].translation.vector;
    let of = |frame: usize, link: usize| at(frame + 1, link) - 2.0 * at(frame, link) + at(frame - 1, link);
    let all = (1..frames.len() - 1).flat_map(|frame| (0..body.links.len()).map(move |link| (frame, link)));
    all.map(|(frame, link)| of(frame, link).norm()).fold(0.0, f64::max) * motion.frames_per_second.powi(2)
}

/// A walk that is half a dance, and a person who lies down and gets up again; on both shipped robots.
#[test]
fn nothing_sinks_in_recordings_of_dancing_and_of_getting_down_to_the_floor() {
    for file in ["cmu_3dsmax_131_01.bvh", "mocapbank_test.bvh"] {
        let Some(path) = crate::support::test_data(&format!("mocap/bvh/{file}")) else { return };
        let clip = read(&path, &ReadOptions::default()).unwrap().without_inserted_rest_pose();
        let clip = clip.resampled(30.0).unwrap();
        for robot in ["actor", "tracker25"] {
            let retargeted = retarget(&clip, &shipped(robot).unwrap(), &RetargetOptions::default()).unwrap();
            let (body, motion) = (retargeted.humanoid, retargeted.motion);
            assert!(
                greatest_depth(&body, &motion) > 0.05,
                "{file}, {robot}: nothing is below the ground before planting"
            );
            let fixed = plant_feet(&body, &motion, &ContactRule::default()).unwrap();
            let depth = greatest_depth(&body, &fixed.motion);
            assert!(depth < TOLERANCE, "{file}, {robot}: {} mm under the ground; {}", 1000.0 * depth, fixed.report);
            assert!((fixed.report.after.penetration_mm / 1000.0 - depth.max(0.0)).abs() < TOLERANCE);
        }
    }
}

/// A leg without an ankle cannot turn its foot freely: when both place and orientation were fixed, the whole body
/// jerked, by up to 540 m/s^2 and 181 mm.
#[test]
fn a_body_without_ankles_does_not_jerk_when_its_feet_are_planted() {
    let Some(folder) = crate::support::test_data("mocap/cmu_asf_amc") else { return };
    let clip = read(&folder.join("14_27_f0001-0900.amc"), &ReadOptions::default()).unwrap();
    let clip = clip.crop(0..400).unwrap().resampled(60.0).unwrap();
    let sitting = retarget(&clip, &shipped("tracker25").unwrap(), &RetargetOptions::default()).unwrap();
    let fixed = plant_feet(&sitting.humanoid, &sitting.motion, &ContactRule::default()).unwrap();
    let [before, after] =
        [&sitting.motion, &fixed.motion].map(|motion| greatest_acceleration(&sitting.humanoid, motion));
    assert!(after < 2.0 * before, "{before} -> {after} m/s^2");
    assert!(fixed.report.moved_mm < 30.0, "{}", fixed.report);
}

/// A smooth random motion in which a body turns, falls and swings its limbs, above and below the ground.
fn tumbling(body: &Humanoid, numbers: &[f64]) -> Motion {
    let number = |index: usize| numbers[index % numbers.len()];
    let pose = |frame: usize| {
        let t = frame as f64 / 30.0;
        let swing = |index: usize| (std::f64::consts::TAU * (number(index + 1) + 0.8 * t)).sin();
        let axis = Vector3::new(number(2) - 0.5, number(3) - 0.5, number(4) - 0.5);
        let turned = UnitQuaternion::from_scaled_axis(axis * (6.0 * (number(5) + t * number(6))));
        let height = 0.3 + number(0) * 0.5 + 0.5 * swing(7);
        let angle = |(index, dof): (usize, &skiagraph_core::body::DegreeOfFreedom)| {
            let (low, high) = (dof.lower.max(-2.0), dof.upper.min(2.0));
            0.5 * (low + high) + 0.5 * (high - low) * number(index) * swing(index)
        };
        Pose {
            world_from_root: Isometry3::from_parts(Vector3::new(0.5 * t, 0.0, height).into(), turned),
            joint_angles: DVector::from_iterator(
                body.degrees_of_freedom.len(),
                body.degrees_of_freedom.iter().enumerate().map(angle),
            ),
        }
    };
    Motion { frames_per_second: 30.0, poses: (0..24).map(pose).collect() }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]
    #[test]
    fn nothing_sinks_in_any_motion(numbers in prop::collection::vec(0.0..1.0_f64, 61), has_ankles in any::<bool>()) {
        let body = shipped(if has_ankles { "actor" } else { "tracker25" }).unwrap();
        let fixed = plant_feet(&body, &tumbling(&body, &numbers), &ContactRule::default()).unwrap();
        let depth = greatest_depth(&body, &fixed.motion);
        prop_assert!(depth < TOLERANCE, "{} mm; {}", 1000.0 * depth, fixed.report);
        prop_assert!(fixed.report.after.penetration_mm < 1000.0 * TOLERANCE);
    }
}
