//! Joint limits.

use super::{Humanoid, Pose};

/// A degree of freedom beyond its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitViolation {
    /// Index into [`Humanoid::degrees_of_freedom`].
    pub degree_of_freedom: usize,
    /// How far beyond, radians or metres: positive above the upper limit, negative below the lower.
    pub excess: f64,
}

impl Humanoid {
    /// Moves every number of the pose to the nearest value within its limits.
    pub fn clamp_to_limits(&self, pose: &mut Pose) {
        for (value, limits) in pose.joint_angles.iter_mut().zip(&self.degrees_of_freedom) {
            *value = value.clamp(limits.lower, limits.upper);
        }
    }

    /// The degrees of freedom that exceed their limits at `pose` by more than `tolerance` (radians or metres).
    pub fn limit_violations(&self, pose: &Pose, tolerance: f64) -> Vec<LimitViolation> {
        let excesses = pose.joint_angles.iter().zip(&self.degrees_of_freedom).map(|(value, limits)| {
            if *value > limits.upper { value - limits.upper } else { (value - limits.lower).min(0.0) }
        });
        excesses
            .enumerate()
            .filter(|(_, excess)| excess.abs() > tolerance)
            .map(|(degree_of_freedom, excess)| LimitViolation { degree_of_freedom, excess })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;

    #[test]
    fn a_pose_beyond_its_limits_is_told_and_clamped() {
        let body = shipped("tracker25").unwrap();
        let knee = body.find_degree_of_freedom("left_knee_flexion").unwrap();
        let elbow = body.find_degree_of_freedom("right_elbow_flexion").unwrap();
        let mut pose = body.zero_pose();
        pose.joint_angles[knee] = -0.25;
        pose.joint_angles[elbow] = body.degrees_of_freedom[elbow].upper + 0.125;
        let violations = body.limit_violations(&pose, 1e-9);
        assert_eq!(violations.len(), 2);
        assert!(violations.contains(&LimitViolation { degree_of_freedom: knee, excess: -0.25 }));
        assert!(violations.iter().any(|v| v.degree_of_freedom == elbow && (v.excess - 0.125).abs() < 1e-12));
        assert_eq!(body.limit_violations(&pose, 0.2).len(), 1);
        body.clamp_to_limits(&mut pose);
        assert!(body.limit_violations(&pose, 0.0).is_empty());
        assert_eq!(pose.joint_angles[knee], 0.0);
    }
}
