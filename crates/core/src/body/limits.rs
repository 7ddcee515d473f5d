//! Joint limits.

use super::{Humanoid, Pose};

impl Humanoid {
    /// Moves every number of the pose to the nearest value within its limits.
    pub fn clamp_to_limits(&self, pose: &mut Pose) {
        for (value, limits) in pose.joint_angles.iter_mut().zip(&self.degrees_of_freedom) {
            *value = value.clamp(limits.lower, limits.upper);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::body::shipped;

    #[test]
    fn values_beyond_limits_are_clamped() {
        let body = shipped("tracker25").unwrap();
        let knee = body.find_degree_of_freedom("left_knee_flexion").unwrap();
        let elbow = body.find_degree_of_freedom("right_elbow_flexion").unwrap();
        let mut pose = body.zero_pose();
        pose.joint_angles[knee] = -0.25;
        pose.joint_angles[elbow] = body.degrees_of_freedom[elbow].upper + 0.125;
        body.clamp_to_limits(&mut pose);
        assert_eq!(pose.joint_angles[knee], 0.0);
        assert_eq!(pose.joint_angles[elbow], body.degrees_of_freedom[elbow].upper);
    }
}
