//! Forward kinematics: from a pose to the frame of every link (`[Skinned APF]`, section 4, the product of joint
//! transforms).

use std::ops::Index;

use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

use super::{Humanoid, JointKind, Pose};

/// `world_from_link` of every link of a humanoid, in the order of its links.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinkFrames(pub Vec<Isometry3<f64>>);

impl Index<usize> for LinkFrames {
    type Output = Isometry3<f64>;
    #[inline]
    fn index(&self, link: usize) -> &Self::Output {
        &self.0[link]
    }
}

impl Humanoid {
    /// The frame of every link at `pose`, which must have one angle per degree of freedom.
    pub fn link_frames(&self, pose: &Pose) -> LinkFrames {
        let mut frames = LinkFrames::default();
        self.link_frames_into(pose, &mut frames);
        frames
    }

    /// As [`Self::link_frames`], into a reused buffer (no allocation once it has grown).
    pub fn link_frames_into(&self, pose: &Pose, frames: &mut LinkFrames) {
        frames.0.clear();
        frames.0.push(pose.world_from_root);
        for joint in &self.joints {
            let world_from_joint = frames.0[joint.parent] * joint.parent_from_joint;
            frames.0.push(world_from_joint * joint.kind.joint_from_child(pose.joint_angles.as_slice()));
        }
    }

    /// The pose with every angle zero and the root at the world's origin.
    pub fn zero_pose(&self) -> Pose {
        Pose {
            world_from_root: Isometry3::identity(),
            joint_angles: nalgebra::DVector::zeros(self.degrees_of_freedom.len()),
        }
    }
}

impl JointKind {
    /// The child's frame in the joint's frame for these angles.
    pub(super) fn joint_from_child(&self, angles: &[f64]) -> Isometry3<f64> {
        match self {
            Self::Fixed => Isometry3::identity(),
            Self::Revolute { axis, drive } => {
                let angle = drive.multiplier * angles[drive.degree_of_freedom] + drive.offset;
                Isometry3::from_parts(Translation3::identity(), rotation_about(axis, angle))
            }
            Self::Prismatic { axis, drive } => {
                let distance = drive.multiplier * angles[drive.degree_of_freedom] + drive.offset;
                Isometry3::from_parts((axis.into_inner() * distance).into(), UnitQuaternion::identity())
            }
            Self::Spherical { first } => {
                Isometry3::from_parts(Translation3::identity(), rotation_from_vector(&vector_at(angles, *first)))
            }
            Self::Floating { first } => Isometry3::from_parts(
                vector_at(angles, *first).into(),
                rotation_from_vector(&vector_at(angles, first + 3)),
            ),
        }
    }
}

pub(super) fn vector_at(values: &[f64], first: usize) -> Vector3<f64> {
    Vector3::new(values[first], values[first + 1], values[first + 2])
}

/// The rotation by `angle` radians about a unit axis, with libm's functions: the same bits on every machine.
#[inline]
pub fn rotation_about(axis: &Unit<Vector3<f64>>, angle: f64) -> UnitQuaternion<f64> {
    let (sin, cos) = libm::sincos(0.5 * angle);
    Unit::new_unchecked(Quaternion::from_parts(cos, axis.into_inner() * sin))
}

/// The rotation with rotation vector `vector`, radians.
#[inline]
pub fn rotation_from_vector(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    match Unit::try_new_and_get(*vector, 1e-12) {
        Some((axis, angle)) => rotation_about(&axis, angle),
        None => UnitQuaternion::identity(),
    }
}
