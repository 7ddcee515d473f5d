//! Inverse dynamics: the forces that a motion requires.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::body::{Humanoid, JointKind, LinkFrames, ROOT_STEP};
use crate::dynamics::GRAVITY;

/// A force at a point of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointForce {
    /// Index of the link.
    pub link: usize,
    /// Point of application, world, metres.
    pub point: Point3<f64>,
    /// World, newtons.
    pub force: Vector3<f64>,
}

/// The forces that a motion requires in addition to gravity and external forces.
#[derive(Clone, Debug, PartialEq)]
pub struct Efforts {
    /// Force on the root link, world, newtons.
    pub root_force: Vector3<f64>,
    /// Moment about the root link's origin, world, N m.
    pub root_moment: Vector3<f64>,
    /// Effort of every degree of freedom, N m or N.
    pub joints: Vec<f64>,
}

/// Motion of a link: angular velocity and acceleration, and velocity and acceleration of its origin; world.
#[derive(Clone, Copy, Debug)]
struct LinkMotion {
    turning: Vector3<f64>,
    turning_faster: Vector3<f64>,
    accelerating: Vector3<f64>,
}

/// The recursive Newton-Euler algorithm with a floating root (`[Featherstone 2008]`, sections 5.3 and 9.5). `frames`
/// are the link frames of the pose; `rates` and `accelerations` are its first and second derivatives in the order of
/// [`Humanoid::difference`] (root in the world, its rotation about its own axes; rotations of ball joints about the
/// child's), per second; both have [`Humanoid::step_len`] numbers.
pub fn inverse_dynamics(
    body: &Humanoid,
    frames: &LinkFrames,
    rates: &[f64],
    accelerations: &[f64],
    external: &[PointForce],
) -> Efforts {
    let motions = motions(body, frames, rates, accelerations);
    let mut forces = vec![Vector3::zeros(); body.links.len()];
    let mut moments = vec![Vector3::zeros(); body.links.len()];
    let origin = |link: usize| frames[link].translation.vector;
    for (link, motion) in motions.iter().enumerate() {
        let Some(inertia) = &body.links[link].inertia else { continue };
        let lever = frames[link].rotation * inertia.centre_of_mass.coords;
        let LinkMotion { turning, turning_faster, accelerating } = motion;
        let centre = accelerating + turning_faster.cross(&lever) + turning.cross(&turning.cross(&lever));
        let rotation = frames[link].rotation.to_rotation_matrix();
        let tensor = rotation * inertia.tensor * rotation.inverse();
        let force = (centre + Vector3::z() * GRAVITY) * inertia.mass;
        forces[link] += force;
        moments[link] += tensor * turning_faster + turning.cross(&(tensor * turning)) + lever.cross(&force);
    }
    for PointForce { link, point, force } in external {
        forces[*link] -= force;
        moments[*link] -= (point.coords - origin(*link)).cross(force);
    }
    let mut joints = vec![0.0; body.degrees_of_freedom.len()];
    for (index, joint) in body.joints.iter().enumerate().rev() {
        let (link, parent) = (index + 1, joint.parent);
        let (force, moment) = (forces[link], moments[link]);
        let world_from_joint = frames[parent] * joint.parent_from_joint;
        let mut add = |dof: usize, effort: f64| joints[dof] += effort;
        let mut add_three = |first: usize, efforts: Vector3<f64>| (0..3).for_each(|i| add(first + i, efforts[i]));
        match &joint.kind {
            JointKind::Fixed => {}
            JointKind::Revolute { axis, drive } => {
                let along = (world_from_joint.rotation * axis.into_inner()).dot(&moment);
                add(drive.degree_of_freedom, drive.multiplier * along);
            }
            JointKind::Prismatic { axis, drive } => {
                let along = (world_from_joint.rotation * axis.into_inner()).dot(&force);
                add(drive.degree_of_freedom, drive.multiplier * along);
            }
            JointKind::Spherical { first } => add_three(*first, frames[link].rotation.inverse() * moment),
            JointKind::Floating { first } => {
                add_three(*first, world_from_joint.rotation.inverse() * force);
                add_three(first + 3, frames[link].rotation.inverse() * moment);
            }
        }
        forces[parent] += force;
        moments[parent] += moment + (origin(link) - origin(parent)).cross(&force);
    }
    Efforts { root_force: forces[0], root_moment: moments[0], joints }
}

/// The outward recursion.
fn motions(body: &Humanoid, frames: &LinkFrames, rates: &[f64], accelerations: &[f64]) -> Vec<LinkMotion> {
    let three = |numbers: &[f64], first: usize| Vector3::new(numbers[first], numbers[first + 1], numbers[first + 2]);
    let root = frames[0].rotation;
    let mut found = vec![LinkMotion {
        turning: root * three(rates, 3),
        turning_faster: root * three(accelerations, 3),
        accelerating: three(accelerations, 0),
    }];
    let (rates, accelerations) = (&rates[ROOT_STEP..], &accelerations[ROOT_STEP..]);
    for (index, joint) in body.joints.iter().enumerate() {
        let (above, link) = (found[joint.parent], &frames[index + 1]);
        let world_from_joint: Isometry3<f64> = frames[joint.parent] * joint.parent_from_joint;
        let along = |axis: &Vector3<f64>, numbers: &[f64], dof: usize, factor: f64| {
            world_from_joint.rotation * axis * (factor * numbers[dof])
        };
        // velocity and acceleration across the joint: rotation, translation
        let still = [Vector3::zeros(); 2];
        let (turn, slide) = match &joint.kind {
            JointKind::Fixed => (still, still),
            JointKind::Revolute { axis, drive } => {
                let (dof, factor) = (drive.degree_of_freedom, drive.multiplier);
                ([rates, accelerations].map(|numbers| along(axis, numbers, dof, factor)), still)
            }
            JointKind::Prismatic { axis, drive } => {
                let (dof, factor) = (drive.degree_of_freedom, drive.multiplier);
                (still, [rates, accelerations].map(|numbers| along(axis, numbers, dof, factor)))
            }
            JointKind::Spherical { first } => {
                ([rates, accelerations].map(|numbers| link.rotation * three(numbers, *first)), still)
            }
            JointKind::Floating { first } => (
                [rates, accelerations].map(|numbers| link.rotation * three(numbers, first + 3)),
                [rates, accelerations].map(|numbers| world_from_joint.rotation * three(numbers, *first)),
            ),
        };
        let lever = link.translation.vector - frames[joint.parent].translation.vector;
        let LinkMotion { turning, turning_faster, accelerating } = above;
        found.push(LinkMotion {
            turning: turning + turn[0],
            turning_faster: turning_faster + turning.cross(&turn[0]) + turn[1],
            accelerating: accelerating
                + turning_faster.cross(&lever)
                + turning.cross(&turning.cross(&lever))
                + turning.cross(&slide[0]) * 2.0
                + slide[1],
        });
    }
    found
}
