//! Compares rapier's multibody with our independent inverse dynamics, and with a parabola.

use nalgebra::{DVector, Isometry3, Vector3};

use super::simulated_body::SimulatedBody;
use skiagraph_core::body::{Humanoid, Pose, shipped};
use skiagraph_core::dynamics::GRAVITY;
use skiagraph_core::dynamics::inverse_dynamics;

/// Short enough steps for accelerations, long enough for speeds in single precision.
const RATE: f64 = 10_000.0;
/// Stiffness of a spring that acts as a pure force.
const SOFT: f64 = 1e-3;

/// The actor without geometry and limits: only joints and inertia.
fn bones() -> Humanoid {
    let mut body = shipped("actor").unwrap();
    body.links.iter_mut().for_each(|link| link.solids.clear());
    for dof in &mut body.degrees_of_freedom {
        (dof.lower, dof.upper) = (f64::NEG_INFINITY, f64::INFINITY);
    }
    body
}

/// Irregular numbers.
fn numbers(count: usize, scale: f64, start: f64) -> Vec<f64> {
    (0..count).map(|i| scale * (start + 1.7 * i as f64).sin()).collect()
}

fn bent(body: &Humanoid) -> Pose {
    let place = Isometry3::new(Vector3::new(0.3, -0.2, 3.0), Vector3::new(0.4, -0.3, 0.8));
    let angles = numbers(body.degrees_of_freedom.len(), 0.4, 0.3);
    Pose { world_from_root: place, joint_angles: DVector::from_vec(angles) }
}

#[test]
fn inverse_dynamics_forces_produce_the_accelerations_they_were_computed_for() {
    let body = bones();
    let centre = body.links[0].inertia.as_ref().unwrap().centre_of_mass.coords;
    assert!(centre.norm() > 0.05, "otherwise the root is not tested");
    let pose = bent(&body);
    let rates = numbers(body.step_len(), 1.5, 1.1);
    let accelerations = numbers(body.step_len(), 15.0, 2.9);
    let efforts = inverse_dynamics(&body, &body.link_frames(&pose), &rates, &accelerations, &[]);

    let mut simulated = SimulatedBody::new(&body, 0.8, RATE, false).unwrap();
    simulated.place(&pose, &rates);
    let rotation = pose.world_from_root.rotation;
    let lever = rotation * centre;
    let moment = efforts.root_moment - lever.cross(&efforts.root_force);
    simulated.add_wrench(0, &efforts.root_force, &moment);
    for (dof, effort) in efforts.joints.iter().enumerate() {
        simulated.set_spring(dof, SOFT, 0.0, pose.joint_angles[dof] + effort / SOFT);
    }
    let before = (simulated.root_velocity(), simulated.joint_speeds());
    simulated.step();
    let after = (simulated.root_velocity(), simulated.joint_speeds());

    // back from the centre of mass to the origin; compared as forces, because the acceleration of light parts such as
    // toes is limited by single precision
    let three = |numbers: &[f64], first: usize| Vector3::new(numbers[first], numbers[first + 1], numbers[first + 2]);
    let [of_centre, faster] = [0, 1].map(|i| (after.0[i] - before.0[i]) * RATE);
    let turning = rotation * three(&rates, 3);
    let of_origin = of_centre - faster.cross(&lever) - turning.cross(&turning.cross(&lever));
    let own = rotation.inverse() * faster;
    let joints = after.1.iter().zip(&before.1).map(|(after, before)| (after - before) * RATE);
    let found: Vec<f64> = of_origin.iter().chain(own.iter()).copied().chain(joints).collect();
    let taken = inverse_dynamics(&body, &body.link_frames(&pose), &rates, &found, &[]);
    let pairs = [(taken.root_force, efforts.root_force), (taken.root_moment, efforts.root_moment)];
    assert!(pairs.iter().all(|(a, b)| (a - b).norm() < 1e-3 * b.norm()), "{taken:?} {efforts:?}");
    for (dof, (taken, effort)) in taken.joints.iter().zip(&efforts.joints).enumerate() {
        assert!((taken - effort).abs() < 0.05, "{}: {taken} instead of {effort}", body.degrees_of_freedom[dof].name);
    }
}

#[test]
fn a_tumbling_body_in_flight_follows_a_parabola() {
    let body = bones();
    let pose = bent(&body);
    let rates = numbers(body.step_len(), 1.5, 1.1);
    let (rate, seconds) = (480.0, 0.5);
    let mut simulated = SimulatedBody::new(&body, 0.8, rate, false).unwrap();
    simulated.place(&pose, &rates);
    // a step over a nanosecond gives the velocity of the centre of mass
    let centre = |pose: &Pose| body.centre_of_mass(&body.link_frames(pose)).unwrap();
    let instant = 1e-7;
    let moved = body.step(&pose, &rates.iter().map(|rate| rate * instant).collect::<Vec<_>>());
    let start = centre(&pose);
    let velocity = (centre(&moved) - start) / instant;
    (0..(rate * seconds) as usize).for_each(|_| simulated.step());
    let expected = start + velocity * seconds - Vector3::z() * (0.5 * GRAVITY * seconds * seconds);
    let found = centre(&simulated.pose());
    assert!((found - expected).norm() < 0.01, "{found} instead of {expected}");
}
