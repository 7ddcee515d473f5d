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
