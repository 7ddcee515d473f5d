//! Small steps between poses: the vector space in which poses are perturbed, compared and averaged.
//!
//! A step is `[root translation in the world (m), root rotation vector in the root's frame (rad), one number per
//! degree of freedom]`. Hinges and sliders add; rotations (the root, spherical and floating joints) compose, so no
//! step or mean depends on where an angle wraps.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::kinematics::{rotation_from_vector, vector_at};
use super::{Humanoid, JointKind, Pose};

/// Number of a step's entries that belong to the root.
pub const ROOT_STEP: usize = 6;

impl Humanoid {
    /// Length of a step: [`ROOT_STEP`] plus one per degree of freedom.
    #[inline]
    pub fn step_len(&self) -> usize {
        ROOT_STEP + self.degrees_of_freedom.len()
    }

    /// `pose` moved by a step of [`Self::step_len`] numbers; joint limits are ignored.
    pub fn step(&self, pose: &Pose, step: &[f64]) -> Pose {
        let translation = pose.world_from_root.translation.vector + vector_at(step, 0);
        let rotation = pose.world_from_root.rotation * rotation_from_vector(&vector_at(step, 3));
        let mut joint_angles = pose.joint_angles.clone();
        for (angle, change) in joint_angles.iter_mut().zip(&step[ROOT_STEP..]) {
            *angle += change;
        }
        for first in self.rotation_vectors() {
            let before = vector_at(pose.joint_angles.as_slice(), first);
            let turned = rotation_from_vector(&before) * rotation_from_vector(&vector_at(&step[ROOT_STEP..], first));
            joint_angles.rows_mut(first, 3).copy_from(&rotation_vector(&turned));
        }
        // thousands of composed steps must not drift off the unit sphere
        let rotation = UnitQuaternion::new_normalize(rotation.into_inner());
        Pose { world_from_root: Isometry3::from_parts(translation.into(), rotation), joint_angles }
    }

    /// The step from `from` to `to`, written into `step` ([`Self::step_len`] numbers); the inverse of [`Self::step`].
    pub fn difference(&self, from: &Pose, to: &Pose, step: &mut [f64]) {
        let translation = to.world_from_root.translation.vector - from.world_from_root.translation.vector;
        let rotation = from.world_from_root.rotation.inverse() * to.world_from_root.rotation;
        step[..3].copy_from_slice(translation.as_slice());
        step[3..ROOT_STEP].copy_from_slice(rotation_vector(&rotation).as_slice());
        let joints = &mut step[ROOT_STEP..];
        for (change, (a, b)) in joints.iter_mut().zip(from.joint_angles.iter().zip(&to.joint_angles)) {
            *change = b - a;
        }
        for first in self.rotation_vectors() {
            let a = rotation_from_vector(&vector_at(from.joint_angles.as_slice(), first));
            let b = rotation_from_vector(&vector_at(to.joint_angles.as_slice(), first));
            joints[first..first + 3].copy_from_slice(rotation_vector(&(a.inverse() * b)).as_slice());
        }
    }

    /// The weighted mean of at least one pose, with `weights` summing to one: the pose from which the weighted steps
    /// to all others cancel. Translations and hinge angles are averaged linearly, rotations in the tangent space of
    /// their mean (the Riemannian mean of Moakher 2002, by fixed-point iteration from the pose with the largest
    /// weight). `None` without poses.
    pub fn mean_pose<'a>(&self, poses: impl Iterator<Item = &'a Pose> + Clone, weights: &[f64]) -> Option<Pose> {
        let heaviest = poses.clone().zip(weights).reduce(|a, b| if b.1 > a.1 { b } else { a })?;
        let mut mean = heaviest.0.clone();
        let mut step = vec![0.0; self.step_len()];
        // Rotations within a hemisphere converge quadratically: a few iterations reach rounding error.
        for _ in 0..10 {
            let mut sum = vec![0.0; self.step_len()];
            for (pose, weight) in poses.clone().zip(weights) {
                self.difference(&mean, pose, &mut step);
                sum.iter_mut().zip(&step).for_each(|(s, d)| *s += weight * d);
            }
            mean = self.step(&mean, &sum);
            if sum.iter().all(|s| s.abs() < 1e-12) {
                break;
            }
        }
        Some(mean)
    }

    /// Indices of joint angles that begin a rotation vector of three consecutive numbers.
    pub(super) fn rotation_vectors(&self) -> impl Iterator<Item = usize> + '_ {
        self.joints.iter().filter_map(|joint| match joint.kind {
            JointKind::Spherical { first } => Some(first),
            JointKind::Floating { first } => Some(first + 3),
            JointKind::Fixed | JointKind::Revolute { .. } | JointKind::Prismatic { .. } => None,
        })
    }
}

/// Rotation vector (axis times angle), with the angle in `[0, pi]`; uses libm's arctangent: the same bits on every
/// machine.
#[inline]
pub fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let (w, v) = if rotation.w < 0.0 { (-rotation.w, -rotation.imag()) } else { (rotation.w, rotation.imag()) };
    let norm = v.norm();
    if norm < 1e-9 { v * 2.0 } else { v * (2.0 * libm::atan2(norm, w) / norm) }
}

#[cfg(test)]
pub(super) mod tests {
    use approx::assert_relative_eq;
    use nalgebra::DVector;
    use proptest::prelude::*;

    use super::*;
    use crate::body::{DegreeOfFreedom, Drive, Joint, Link};

    /// A hinge without limits (degree of freedom 0) and a ball joint (1..4) in a row.
    pub(in crate::body) fn hinge_and_ball() -> Humanoid {
        let link = |name: &str| Link { name: name.into(), solids: Vec::new(), inertia: None };
        let joint = |name: &str, parent, kind| Joint {
            name: name.into(),
            parent,
            parent_from_joint: Isometry3::translation(0.0, 0.0, 1.0),
            kind,
        };
        Humanoid {
            name: "hinge_and_ball".into(),
            links: ["root", "hinge", "ball"].map(link).to_vec(),
            joints: vec![
                joint("hinge", 0, JointKind::Revolute { axis: Vector3::x_axis(), drive: Drive::direct(0) }),
                joint("ball", 1, JointKind::Spherical { first: 1 }),
            ],
            degrees_of_freedom: ["hinge", "ball.x", "ball.y", "ball.z"].map(DegreeOfFreedom::unlimited).to_vec(),
            markers: [None; 15],
            skin: None,
            notes: Vec::new(),
        }
    }

    fn yawed(degrees: f64) -> Pose {
        let mut pose = hinge_and_ball().zero_pose();
        pose.world_from_root.rotation = rotation_from_vector(&(Vector3::z() * degrees.to_radians()));
        pose.joint_angles = DVector::from_vec(vec![0.1 * degrees, 0.0, 0.0, degrees.to_radians()]);
        pose
    }

    #[test]
    fn mean_of_rotations_on_both_sides_of_180_degrees_is_180_degrees() {
        let body = hinge_and_ball();
        let poses = [yawed(179.0), yawed(-179.0)];
        let mean = body.mean_pose(poses.iter(), &[0.5, 0.5]).unwrap();
        assert_relative_eq!(mean.world_from_root.rotation.angle(), std::f64::consts::PI, epsilon = 1e-9);
        assert_relative_eq!(mean.joint_angles.rows(1, 3).norm(), std::f64::consts::PI, epsilon = 1e-9);
        assert_relative_eq!(mean.joint_angles[0], 0.0, epsilon = 1e-12);
    }

    #[test]
    fn mean_of_rotations_about_one_axis_is_the_weighted_angle() {
        let body = hinge_and_ball();
        let poses = [yawed(10.0), yawed(50.0), yawed(-20.0)];
        let mean = body.mean_pose(poses.iter(), &[0.5, 0.3, 0.2]).unwrap();
        assert_relative_eq!(mean.world_from_root.rotation.angle().to_degrees(), 16.0, epsilon = 1e-9);
        assert_relative_eq!(mean.joint_angles[3].to_degrees(), 16.0, epsilon = 1e-9);
        assert_relative_eq!(mean.joint_angles[0], 1.6, epsilon = 1e-12);
    }

    #[test]
    fn no_poses_have_no_mean() {
        assert!(hinge_and_ball().mean_pose(std::iter::empty(), &[]).is_none());
    }

    proptest! {
        #[test]
        fn difference_undoes_step(numbers in proptest::collection::vec(-1.5_f64..1.5, 20)) {
            let body = hinge_and_ball();
            let from = body.step(&body.zero_pose(), &numbers[..10]);
            let to = body.step(&from, &numbers[10..]);
            let mut step = [0.0; 10];
            body.difference(&from, &to, &mut step);
            for (found, planted) in step.iter().zip(&numbers[10..]) {
                prop_assert!((found - planted).abs() < 1e-9, "{found} is not {planted}");
            }
        }
    }
}
