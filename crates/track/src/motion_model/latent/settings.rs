//! Settings of latent motion models. Distances are per anatomical joint, so that they are comparable between bodies.

use serde::{Deserialize, Serialize};

use super::super::SettingError;

/// Greatest distance of a jump, rad^2 per anatomical joint: that of `[GPDM graph]`.
pub(super) const JUMP_THRESHOLD: f64 = 1.0 / 13.0;
/// Weight of velocities relative to poses, s^2.
pub(super) const VELOCITY_WEIGHT: f64 = 0.02;

/// Motion of particles in and between latent spaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatentSettings {
    /// Transitions of particles between models.
    pub transition: InterTransition,
    /// Distribution of particles over the training poses similar to the start pose.
    pub initialisation: Initialisation,
    /// Least standard deviation of the process noise, as a share of the latents' spread. A model learned from much
    /// motion is so confident that particles would otherwise not spread at all.
    pub noise_floor: f64,
    /// Standard deviation of the first latents about their seeds, as a share of the latents' spread.
    pub start_jitter: f64,
    /// Deviation of particles from the latent manifold, as a multiple of the distance of training frames from the most
    /// similar ones of other moments; 0 keeps them on it, as in `[GPDM graph]`.
    pub residual_scale: f64,
    /// Time in which such an offset decays to 1/e, seconds.
    pub residual_s: f64,
    /// Factor on the noise of the root's steps, which is the variation unexplained by training, at least 2 mm and 0.3
    /// degrees per frame. At 1 too few particles explore the root.
    pub root_noise_scale: f64,
    /// Method of predicting the root.
    pub root_motion: RootMotion,
    /// Whether particles at the end of a model continue with the following model of the recording.
    pub natural_edges: bool,
}

/// Method of predicting a particle's root.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RootMotion {
    /// The models' own velocities.
    Model,
    /// Feet stay in place, weighted by how still feet at that height were in training; in flight the model's velocities
    /// apply.
    #[default]
    Planted,
}

/// Transitions of particles between models.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InterTransition {
    /// None: the original GPDM, which has one model.
    None,
    /// With a constant probability per frame to any other model, to that model's most similar pose: the switching GPDM
    /// of `[GPDM graph]`.
    Switching {
        /// Probability of leaving a model in one frame.
        probability: f64,
    },
    /// To candidates with similar poses: the GPDM graph.
    Graph {
        /// Rule for the probability of a jump.
        rule: JumpRule,
        /// Greatest distance of a jump, rad^2 per anatomical joint.
        threshold: f64,
        /// Distance at which a jump is 1/e as likely, rad^2 per anatomical joint (`stay_weighted`).
        width: f64,
        /// Weight of the squared difference of joint velocities (rad/s)^2 relative to that of poses, s^2. Poses alone
        /// do not distinguish a step from its reversal in time.
        velocity_weight: f64,
    },
}

/// Rule for the jumps of particles near candidates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JumpRule {
    /// Every particle within the threshold jumps, distributed over candidates by `[GPDM graph]` Eqs. 12 and 13 as
    /// printed.
    Literal,
    /// Jumps have weight `exp(-distance / width)` per candidate, staying has weight 1.
    #[default]
    StayWeighted,
    /// As `stay_weighted`, but every weight is divided by the number of candidates of its model, so that the frequency
    /// of jumps does not grow with the number of candidates.
    StayShared,
}

/// Distribution of particles over the training poses similar to the start pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Initialisation {
    /// `[GPDM graph]` Eqs. 12 to 14 as printed: nearly equal shares for any distances.
    Literal,
    /// `exp(-distance / width)` with a width of 0.25/13 rad^2 per anatomical joint.
    #[default]
    Softmax,
}

impl Default for InterTransition {
    /// The jump threshold of `[GPDM graph]`, and the stay-weighted rule with widths chosen on walks other than the
    /// benchmark's.
    fn default() -> Self {
        Self::Graph {
            rule: JumpRule::StayWeighted,
            threshold: JUMP_THRESHOLD,
            width: 0.25 / 13.0,
            velocity_weight: VELOCITY_WEIGHT,
        }
    }
}

impl Default for LatentSettings {
    fn default() -> Self {
        Self {
            transition: InterTransition::default(),
            initialisation: Initialisation::Softmax,
            noise_floor: 0.03,
            start_jitter: 0.1,
            residual_scale: 1.0,
            residual_s: 0.25,
            root_noise_scale: 5.0,
            root_motion: RootMotion::Planted,
            natural_edges: true,
        }
    }
}

impl LatentSettings {
    /// Checks every range.
    ///
    /// # Errors
    /// [`SettingError`] with the first setting that is out of range.
    pub fn validate(&self) -> Result<(), SettingError> {
        let (one, any) = ([0.0, 1.0], [0.0, f64::MAX]);
        let mut checks = vec![("noise_floor", self.noise_floor, one), ("start_jitter", self.start_jitter, any)];
        checks.push(("residual_scale", self.residual_scale, any));
        checks.push(("root_noise_scale", self.root_noise_scale, any));
        checks.push(("residual_s", self.residual_s, [f64::MIN_POSITIVE, f64::MAX]));
        match self.transition {
            InterTransition::None => {}
            InterTransition::Switching { probability } => {
                checks.push(("model.probability", probability, one));
            }
            InterTransition::Graph { threshold, width, velocity_weight, .. } => checks.extend([
                ("model.jump_threshold_per_joint", threshold, any),
                ("model.jump_width_per_joint", width, [f64::MIN_POSITIVE, f64::MAX]),
                ("model.velocity_weight", velocity_weight, any),
            ]),
        }
        match checks.into_iter().find(|(_, value, [low, high])| !(low..=high).contains(&value)) {
            None => Ok(()),
            Some((key, value, [low, high])) => {
                let expected = match (low == 0.0, high == f64::MAX) {
                    (true, true) => "0 or more".to_owned(),
                    (false, true) => "a number above 0".to_owned(),
                    _ => format!("{low} to {high}"),
                };
                Err(SettingError::new(key, expected, value))
            }
        }
    }
}
