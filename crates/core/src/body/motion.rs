//! A motion over time: continuous coordinates, resampling, and changes from frame to frame.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::kinematics::rotation_from_vector;
use super::{Humanoid, JointKind, Motion, Pose};

/// Highest rate accepted by [`Motion::resampled`], frames a second: a higher rate is certainly a typing error.
const MAX_FRAMES_PER_SECOND: f64 = 10_000.0;

impl Motion {
    /// Time from the first pose to the last, seconds.
    pub fn duration_s(&self) -> f64 {
        self.poses.len().saturating_sub(1) as f64 / self.frames_per_second
    }

    /// The same motion without jumps of its coordinates: successive root quaternions are in one hemisphere, angles
    /// that can make a full turn change by at most half a turn per frame, and rotation vectors take the equivalent
    /// value nearest to the previous frame.
    pub fn made_continuous(mut self, humanoid: &Humanoid) -> Self {
        let turning = turning_degrees_of_freedom(humanoid);
        let vectors: Vec<usize> = humanoid.rotation_vectors().collect();
        for frame in 1..self.poses.len() {
            let (before, from_here) = self.poses.split_at_mut(frame);
            let (previous, pose) = (&before[frame - 1], &mut from_here[0]);
            let rotation = &mut pose.world_from_root.rotation;
            if rotation.coords.dot(&previous.world_from_root.rotation.coords) < 0.0 {
                *rotation = UnitQuaternion::new_unchecked(-rotation.into_inner());
            }
            for &i in &turning {
                let turns = libm::round((previous.joint_angles[i] - pose.joint_angles[i]) / TAU);
                pose.joint_angles[i] += turns * TAU;
            }
            for &first in &vectors {
                let nearest = nearest_equivalent(&vector_of(pose, first), &vector_of(previous, first));
                pose.joint_angles.fixed_rows_mut::<3>(first).copy_from(&nearest);
            }
        }
        self
    }

    /// The same motion at another rate, from its first instant to the last one inside it: translations and angles are
    /// interpolated linearly, rotations (the root's and those of spherical joints) along the shorter arc (slerp).
    /// `None` unless the rate is positive and at most 10 kHz. The motion must be continuous
    /// ([`Self::made_continuous`]).
    pub fn resampled(&self, humanoid: &Humanoid, frames_per_second: f64) -> Option<Self> {
        if !(frames_per_second > 0.0 && frames_per_second <= MAX_FRAMES_PER_SECOND) {
            return None;
        }
        let vectors: Vec<usize> = humanoid.rotation_vectors().collect();
        // The small tolerance keeps the last frame when both rates reach it up to rounding.
        let last = libm::floor(self.duration_s() * frames_per_second + 1e-6) as usize;
        let ratio = self.frames_per_second / frames_per_second;
        let poses = (0..=last).map(|frame| self.pose_at(frame as f64 * ratio, &vectors)).collect::<Option<_>>()?;
        Some(Self { frames_per_second, poses })
    }

    /// The pose at a fractional frame number, interpolated as in [`Self::resampled`], clamped to the first and last
    /// pose; `None` for an empty motion. The motion must be continuous.
    pub fn at_frame(&self, humanoid: &Humanoid, position: f64) -> Option<Pose> {
        let vectors: Vec<usize> = humanoid.rotation_vectors().collect();
        self.pose_at(position.max(0.0), &vectors)
    }

    /// The pose at a fractional frame number; `None` for an empty motion.
    fn pose_at(&self, position: f64, vectors: &[usize]) -> Option<Pose> {
        let index = (libm::floor(position + 1e-9) as usize).min(self.poses.len().checked_sub(1)?);
        let here = &self.poses[index];
        let share = (position - index as f64).clamp(0.0, 1.0);
        match self.poses.get(index + 1) {
            Some(next) if share > 1e-9 => Some(between(here, next, share, vectors)),
            _ => Some(here.clone()),
        }
    }
}

impl Pose {
    /// Interpolates from this pose (share 0) to another (share 1) of the same humanoid: translations and angles
    /// linearly, rotations (the root's and those of spherical joints) along the shorter arc. A rotation vector takes
    /// the equivalent value nearest to this pose's.
    pub fn blended(&self, to: &Self, share: f64, humanoid: &Humanoid) -> Self {
        between(self, to, share, &humanoid.rotation_vectors().collect::<Vec<_>>())
    }
}

fn between(from: &Pose, to: &Pose, share: f64, vectors: &[usize]) -> Pose {
    let translation = from.world_from_root.translation.vector.lerp(&to.world_from_root.translation.vector, share);
    let rotation = slerp(&from.world_from_root.rotation, &to.world_from_root.rotation, share);
    let mut joint_angles = from.joint_angles.lerp(&to.joint_angles, share);
    for &first in vectors {
        let turned = slerp(&rotation_at(from, first), &rotation_at(to, first), share);
        let vector = nearest_equivalent(&turned.scaled_axis(), &vector_of(from, first));
        joint_angles.fixed_rows_mut::<3>(first).copy_from(&vector);
    }
    Pose { world_from_root: Isometry3::from_parts(translation.into(), rotation), joint_angles }
}

fn slerp(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>, share: f64) -> UnitQuaternion<f64> {
    from * rotation_from_vector(&((from.inverse() * to).scaled_axis() * share))
}

/// Indices of degrees of freedom that are angles of a hinge without limits, or with a range of at least a full turn.
fn turning_degrees_of_freedom(humanoid: &Humanoid) -> Vec<usize> {
    let hinges = humanoid.joints.iter().filter_map(|joint| match &joint.kind {
        JointKind::Revolute { drive, .. } if drive.multiplier == 1.0 => Some(drive.degree_of_freedom),
        _ => None,
    });
    hinges
        .filter(|&i| {
            let limits = &humanoid.degrees_of_freedom[i];
            limits.upper - limits.lower >= TAU
        })
        .collect()
}

fn vector_of(pose: &Pose, first: usize) -> Vector3<f64> {
    pose.joint_angles.fixed_rows::<3>(first).into_owned()
}

fn rotation_at(pose: &Pose, first: usize) -> UnitQuaternion<f64> {
    rotation_from_vector(&vector_of(pose, first))
}

/// The rotation vector nearest to `reference` among those of the same axis and rotation.
fn nearest_equivalent(vector: &Vector3<f64>, reference: &Vector3<f64>) -> Vector3<f64> {
    let length = vector.norm();
    if length < 1e-9 {
        return *vector;
    }
    let axis = vector / length;
    vector + axis * (libm::round((reference.dot(&axis) - length) / TAU) * TAU)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::tangent::tests::hinge_and_ball;
    use nalgebra::{DVector, Translation3};

    fn pose(x: f64, yaw: f64, angles: [f64; 4]) -> Pose {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        Pose {
            world_from_root: Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), rotation),
            joint_angles: DVector::from_row_slice(&angles),
        }
    }

    #[test]
    fn a_turn_in_wrapped_angles_becomes_a_steady_turn() {
        let step = 0.5;
        let wrapped = (0..30).map(|i| {
            let angle = libm::remainder(f64::from(i) * step, TAU);
            pose(0.0, f64::from(i) * 0.9, [angle, 0.0, angle, 0.0])
        });
        let motion = Motion { frames_per_second: 60.0, poses: wrapped.collect() }.made_continuous(&hinge_and_ball());
        for (i, pose) in motion.poses.iter().enumerate() {
            assert!((pose.joint_angles[0] - i as f64 * step).abs() < 1e-12, "hinge at {i}: {}", pose.joint_angles[0]);
            assert!((pose.joint_angles[2] - i as f64 * step).abs() < 1e-9, "ball at {i}: {}", pose.joint_angles[2]);
        }
        let signs = motion
            .poses
            .windows(2)
            .map(|w| w[0].world_from_root.rotation.coords.dot(&w[1].world_from_root.rotation.coords));
        assert!(signs.into_iter().all(|dot| dot > 0.0));
    }

    #[test]
    fn resampling_a_steady_motion_gives_the_same_steady_motion() {
        let robot = hinge_and_ball();
        let steady = |t: f64| pose(2.0 * t, 1.3 * t, [7.0 * t, 0.0, 0.0, -4.0 * t]);
        let poses = (0..=24).map(|i| steady(f64::from(i) / 24.0)).collect();
        let motion = Motion { frames_per_second: 24.0, poses };
        for rate in [60.0, 24.0, 7.0] {
            let other = motion.resampled(&robot, rate).unwrap();
            assert_eq!(other.poses.len(), rate as usize + 1);
            for (i, pose) in other.poses.iter().enumerate() {
                let expected = steady(i as f64 / rate);
                assert!((&pose.joint_angles - &expected.joint_angles).norm() < 1e-9, "{rate} Hz, frame {i}");
                let apart = pose.world_from_root.inverse() * expected.world_from_root;
                assert!(apart.translation.vector.norm() < 1e-12 && apart.rotation.angle() < 1e-7);
            }
        }
    }

    #[test]
    fn invalid_rates_are_refused() {
        let motion = Motion { frames_per_second: 24.0, poses: vec![pose(0.0, 0.0, [0.0; 4])] };
        for rate in [0.0, -30.0, f64::NAN, f64::INFINITY, 1e300] {
            assert!(motion.resampled(&hinge_and_ball(), rate).is_none(), "{rate}");
        }
    }
}
