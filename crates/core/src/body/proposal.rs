//! Typical changes of each number of a pose from frame to frame.

use nalgebra::DVector;

use serde::{Deserialize, Serialize};

use super::{Humanoid, Motion, ROOT_STEP};

/// The expected pose in the next frame, before diffusion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Prediction {
    /// The current pose.
    #[default]
    None,
    /// The current pose plus the difference of the last two estimates.
    ConstantVelocity,
}

/// A motion too short to measure differences between frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("training motion: expected at least {expected} frames, found {found}")]
pub struct TooFewFrames {
    /// Least number of frames.
    pub expected: usize,
    /// Number of frames of the motion.
    pub found: usize,
}

/// Standard deviations of the change of a pose from one frame to the next: `[Skinned APF]`'s `P_0 = diag(std^2)`,
/// before any factor.
#[derive(Clone, Debug, PartialEq)]
pub struct ProposalScales {
    /// Root translation along the world's x, y and z, metres.
    pub root_translation_m: [f64; 3],
    /// Root rotation about the root's own x, y and z, radians.
    pub root_rotation_rad: [f64; 3],
    /// One per degree of freedom of the body, radians (metres if prismatic).
    pub joints: DVector<f64>,
}

impl ProposalScales {
    /// Least scale of root translation from training motions, metres.
    pub const ROOT_TRANSLATION_FLOOR_M: f64 = 0.002;
    /// Least scale of root rotation, radians.
    pub const ROOT_ROTATION_FLOOR_RAD: f64 = 0.005;
    /// Least scale of a joint angle, radians: a joint at rest in training may move in the test.
    pub const JOINT_FLOOR_RAD: f64 = 0.01;

    /// Measures training motions of `body` at the frame rate of the video to be tracked (`[Balan 2005]`).
    ///
    /// The root mean square about zero is used, not about the mean: the spread must cover whatever a motion model does
    /// not predict, including steady travel. With [`Prediction::ConstantVelocity`] it is that of second differences.
    /// The two horizontal directions share one value, because the test subject may walk in another direction than in
    /// training.
    ///
    /// # Errors
    /// [`TooFewFrames`] if no motion has two frames (three with a predicted velocity).
    pub fn from_motions(body: &Humanoid, motions: &[Motion], prediction: Prediction) -> Result<Self, TooFewFrames> {
        Ok(Self::from_root_mean_squares(&Self::root_mean_squares(body, motions, prediction)?))
    }

    /// The root mean squares measured by [`Self::from_motions`], in the order of a step, before the floors are
    /// applied.
    ///
    /// # Errors
    /// As [`Self::from_motions`].
    pub fn root_mean_squares(
        body: &Humanoid,
        motions: &[Motion],
        prediction: Prediction,
    ) -> Result<Vec<f64>, TooFewFrames> {
        let expected = if prediction == Prediction::None { 2 } else { 3 };
        let steps: Vec<DVector<f64>> = motions.iter().flat_map(|motion| changes(body, motion, prediction)).collect();
        if steps.is_empty() {
            let found = motions.iter().map(|motion| motion.poses.len()).max().unwrap_or(0);
            return Err(TooFewFrames { expected, found });
        }
        let mut mean_square = DVector::zeros(body.step_len());
        for step in &steps {
            mean_square += step.component_mul(step) / steps.len() as f64;
        }
        let horizontal = 0.5 * (mean_square[0] + mean_square[1]);
        (mean_square[0], mean_square[1]) = (horizontal, horizontal);
        Ok(mean_square.iter().map(|square: &f64| square.sqrt()).collect())
    }

    /// Scales from root mean squares in the order of a step (at least the root's six), limited from below by the
    /// floors.
    pub fn from_root_mean_squares(measured: &[f64]) -> Self {
        let scale = |i: usize, floor: f64| measured.get(i).copied().unwrap_or(0.0).max(floor);
        let joints = measured.iter().skip(ROOT_STEP).map(|value| value.max(Self::JOINT_FLOOR_RAD)).collect();
        Self {
            root_translation_m: [0, 1, 2].map(|i| scale(i, Self::ROOT_TRANSLATION_FLOOR_M)),
            root_rotation_rad: [3, 4, 5].map(|i| scale(i, Self::ROOT_ROTATION_FLOOR_RAD)),
            joints: DVector::from_vec(joints),
        }
    }

    /// Values for a person who walks or gestures, for use without a training motion; `frames_per_second` of the video
    /// > 0: root 0.8 m/s and 1.2 rad/s, joints 1.8 rad/s (the speeds assumed by PARSEC's bodytrack, rounded).
    pub fn for_human(body: &Humanoid, frames_per_second: f64) -> Self {
        let joints = body.degrees_of_freedom.len();
        Self {
            root_translation_m: [0.8 / frames_per_second; 3],
            root_rotation_rad: [1.2 / frames_per_second; 3],
            joints: DVector::from_element(joints, 1.8 / frames_per_second),
        }
    }

    /// All standard deviations in the order of a step.
    pub fn in_step_order(&self) -> Vec<f64> {
        self.root_translation_m.iter().chain(&self.root_rotation_rad).chain(&self.joints).copied().collect()
    }
}

/// Prediction errors, frame by frame.
fn changes(body: &Humanoid, motion: &Motion, prediction: Prediction) -> Vec<DVector<f64>> {
    let steps = motion.poses.windows(2).map(|pair| {
        let mut step = DVector::zeros(body.step_len());
        body.difference(&pair[0], &pair[1], step.as_mut_slice());
        step
    });
    let steps: Vec<DVector<f64>> = steps.collect();
    match prediction {
        Prediction::None => steps,
        Prediction::ConstantVelocity => steps.windows(2).map(|pair| &pair[1] - &pair[0]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Pose;

    /// Walks along a slanted line at a steady 0.05 m a frame while the third angle swings back and forth by 0.2 rad.
    fn walk(body: &Humanoid, frames: usize) -> Motion {
        let pose = |frame: usize| -> Pose {
            let mut pose = body.zero_pose();
            let travelled = 0.05 * frame as f64;
            pose.world_from_root.translation.vector.x = 0.6 * travelled;
            pose.world_from_root.translation.vector.y = 0.8 * travelled;
            pose.joint_angles[3] = if frame.is_multiple_of(2) { 0.1 } else { -0.1 };
            pose
        };
        Motion { frames_per_second: 60.0, poses: (0..frames).map(pose).collect() }
    }

    #[test]
    fn without_prediction_the_spread_includes_steady_travel_and_what_rests_keeps_the_floor() {
        let body = Humanoid::tracker25().unwrap();
        let scales = ProposalScales::from_motions(&body, &[walk(&body, 21)], Prediction::None).unwrap();
        let horizontal = 0.05 / 2.0_f64.sqrt();
        assert!((scales.root_translation_m[0] - horizontal).abs() < 1e-12);
        assert!((scales.root_translation_m[1] - horizontal).abs() < 1e-12);
        assert!((scales.joints[3] - 0.2).abs() < 1e-12);
        assert_eq!(scales.root_translation_m[2], ProposalScales::ROOT_TRANSLATION_FLOOR_M);
        assert_eq!(scales.root_rotation_rad, [ProposalScales::ROOT_ROTATION_FLOOR_RAD; 3]);
        assert_eq!(scales.joints[4], ProposalScales::JOINT_FLOOR_RAD);
    }

    #[test]
    fn with_prediction_the_spread_includes_only_changes_of_velocity() {
        let body = Humanoid::tracker25().unwrap();
        let scales = ProposalScales::from_motions(&body, &[walk(&body, 21)], Prediction::ConstantVelocity).unwrap();
        assert_eq!(scales.root_translation_m, [ProposalScales::ROOT_TRANSLATION_FLOOR_M; 3]);
        assert!((scales.joints[3] - 0.4).abs() < 1e-12);
    }

    #[test]
    fn one_frame_has_no_differences() {
        let body = Humanoid::tracker25().unwrap();
        let refusal = ProposalScales::from_motions(&body, &[walk(&body, 1)], Prediction::None).unwrap_err();
        assert_eq!(refusal.to_string(), "training motion: expected at least 2 frames, found 1");
        assert!(ProposalScales::from_motions(&body, &[walk(&body, 2)], Prediction::ConstantVelocity).is_err());
    }
}
