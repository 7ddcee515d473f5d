//! The simplest motion model: a pose keeps still, or its velocity, and wanders by a Gaussian per degree of freedom.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::{MotionModel, MotionModelError, ProposalScales};
use crate::body::{Humanoid, Pose, ROOT_STEP};

/// Where a pose is expected in the next frame, before it wanders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Prediction {
    /// Where it is now.
    #[default]
    None,
    /// As far on as the last two estimates lie apart.
    ConstantVelocity,
}

/// Settings of [`Diffusion`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DiffusionSettings {
    /// Where a pose is expected in the next frame.
    pub prediction: Prediction,
    /// Factor on every standard deviation of the proposal, > 0.
    pub scale: f64,
}

impl Default for DiffusionSettings {
    fn default() -> Self {
        Self { prediction: Prediction::None, scale: 1.0 }
    }
}

/// `x_t = x_{t-1} (+ velocity) + N(0, P_0)` with `P_0` diagonal: S2's temporal model. A particle carries a pose.
///
/// Joint angles that step over a limit are reflected back from it, and where that leads over the other limit, clamped: unlike
/// clamping alone, no heap of particles gathers at the limit.
#[derive(Clone, Debug)]
pub struct Diffusion {
    body: Humanoid,
    deviations: Vec<f64>,
    prediction: Prediction,
}

impl Diffusion {
    /// A diffusion of `body` with standard deviations `settings.scale * scales` per frame.
    ///
    /// # Errors
    /// [`MotionModelError::Setting`] where a scale is negative or no number, or there is not one per degree of freedom.
    pub fn new(
        body: Humanoid,
        scales: &ProposalScales,
        settings: &DiffusionSettings,
    ) -> Result<Self, MotionModelError> {
        let wrong =
            |key, expected: &str, found: String| MotionModelError::Setting { key, expected: expected.into(), found };
        if !(settings.scale > 0.0 && settings.scale.is_finite()) {
            return Err(wrong("diffusion.scale", "a number > 0", settings.scale.to_string()));
        }
        if scales.joints.len() != body.degrees_of_freedom.len() {
            let expected = format!("{} numbers, one per degree of freedom", body.degrees_of_freedom.len());
            return Err(wrong("proposal.joints", &expected, scales.joints.len().to_string()));
        }
        let deviations: Vec<f64> = scales.in_step_order().iter().map(|d| d * settings.scale).collect();
        if let Some(bad) = deviations.iter().find(|d| !(d.is_finite() && **d >= 0.0)) {
            return Err(wrong("proposal", "standard deviations >= 0", bad.to_string()));
        }
        Ok(Self { body, deviations, prediction: settings.prediction })
    }

    fn noise(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        self.deviations.iter().map(|d| d * normal(rng)).collect()
    }

    fn reflect_at_limits(&self, pose: &mut Pose) {
        for (angle, dof) in pose.joint_angles.iter_mut().zip(&self.body.degrees_of_freedom) {
            if *angle < dof.lower {
                *angle = (2.0 * dof.lower - *angle).min(dof.upper);
            } else if *angle > dof.upper {
                *angle = (2.0 * dof.upper - *angle).max(dof.lower);
            }
        }
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

impl MotionModel for Diffusion {
    type State = Pose;

    fn body(&self) -> &Humanoid {
        &self.body
    }

    fn sample_initial(&self, start: &Pose, _particle: usize, _particles: usize, rng: &mut ChaCha8Rng) -> Pose {
        self.step(start, &self.noise(rng))
    }

    fn propagate(&self, state: &Pose, past: &[Pose], rng: &mut ChaCha8Rng) -> Pose {
        let mut step = self.noise(rng);
        if let (Prediction::ConstantVelocity, [.., before, last]) = (self.prediction, past) {
            let mut velocity = vec![0.0; ROOT_STEP + state.joint_angles.len()];
            self.body.difference(before, last, &mut velocity);
            step.iter_mut().zip(&velocity).for_each(|(s, v)| *s += v);
        }
        self.step(state, &step)
    }

    fn pose<'a>(&self, state: &'a Pose) -> &'a Pose {
        state
    }

    fn deviations(&self) -> &[f64] {
        &self.deviations
    }

    fn step(&self, state: &Pose, step: &[f64]) -> Pose {
        let mut pose = self.body.step(state, step);
        self.reflect_at_limits(&mut pose);
        pose
    }

    fn difference(&self, from: &Pose, to: &Pose, step: &mut [f64]) {
        self.body.difference(from, to, step);
    }
}
