//! Converts a humanoid's joints to rapier's.

use nalgebra::{Translation3, Vector3};
use rapier3d::prelude::*;

use super::solids::{pose, vector};
use crate::PhysicsError;
use skiagraph_core::body::{Humanoid, Joint, JointKind};
use skiagraph_core::input::excerpt;

/// Rows of rapier's spatial coordinates: a hinge rotates about x, a slider moves along x.
const SLIDE: usize = 0;
const HINGE: usize = 3;

/// Whether a link only marks a position on its parent, so that rapier does not need it.
pub(super) fn is_tag(body: &Humanoid, link: usize) -> bool {
    let Some(joint) = link.checked_sub(1).map(|joint| &body.joints[joint]) else { return false };
    let empty = body.links[link].solids.is_empty() && body.links[link].inertia.is_none();
    empty && joint.kind == JointKind::Fixed && body.joints.iter().all(|other| other.parent != link)
}

/// The link and coordinate of every degree of freedom.
pub(super) fn axes(body: &Humanoid) -> Result<Vec<(usize, usize)>, PhysicsError> {
    let mut axes = vec![None; body.degrees_of_freedom.len()];
    for (index, joint) in body.joints.iter().enumerate() {
        let refuse = |kind| no_joint(&joint.name, kind);
        let (drive, row) = match &joint.kind {
            JointKind::Fixed => continue,
            JointKind::Revolute { drive, .. } => (drive, HINGE),
            JointKind::Prismatic { drive, .. } => (drive, SLIDE),
            JointKind::Spherical { .. } => return Err(refuse("a ball joint")),
            JointKind::Floating { .. } => return Err(refuse("a floating joint")),
        };
        let slot = &mut axes[drive.degree_of_freedom];
        if drive.multiplier != 1.0 || drive.offset != 0.0 || slot.is_some() {
            return Err(refuse("a mimic joint"));
        }
        *slot = Some((index + 1, row));
    }
    let undriven = |dof: usize| no_joint(&body.degrees_of_freedom[dof].name, "a degree of freedom that moves nothing");
    axes.into_iter().enumerate().map(|(dof, axis)| axis.ok_or_else(|| undriven(dof))).collect()
}

pub(super) fn no_joint(joint: &str, kind: &str) -> PhysicsError {
    PhysicsError::Refused(format!(
        "joint {:?} is {kind}, which cannot be simulated; write hinges and sliders, three hinges for a ball joint",
        excerpt(joint)
    ))
}

/// `centre` is the origin of the parent's rapier body in the frame of its link.
pub(super) fn rapier_joint(body: &Humanoid, joint: &Joint, centre: &Vector3<f64>) -> GenericJoint {
    let origin = pose(&(Translation3::from(-centre) * joint.parent_from_joint));
    let (axis, drive, moving, locked) = match &joint.kind {
        JointKind::Revolute { axis, drive } => (axis, drive, JointAxis::AngX, JointAxesMask::LOCKED_REVOLUTE_AXES),
        JointKind::Prismatic { axis, drive } => (axis, drive, JointAxis::LinX, JointAxesMask::LOCKED_PRISMATIC_AXES),
        JointKind::Fixed | JointKind::Spherical { .. } | JointKind::Floating { .. } => {
            return GenericJointBuilder::new(JointAxesMask::LOCKED_FIXED_AXES).local_frame1(origin).build();
        }
    };
    let basis = Pose::from_rotation(Rotation::from_rotation_arc(Vector::X, vector(axis)));
    let joint = GenericJointBuilder::new(locked).local_frame1(origin * basis).local_frame2(basis);
    let limits = &body.degrees_of_freedom[drive.degree_of_freedom];
    let limited = limits.lower.is_finite() && limits.upper.is_finite();
    let limits = [limits.lower as Real, limits.upper as Real];
    if limited { joint.limits(moving, limits).build() } else { joint.build() }
}
