//! `[tracker.*]`: who tracks, and with which settings.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Who tracks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TrackerSettings {
    /// Particles that are annealed onto the silhouettes.
    AnnealedParticleFilter(AnnealedParticleFilterSettings),
    /// Never moves: the floor that every tracker must beat.
    Frozen(FrozenSettings),
    /// Knows the truth and adds a planted error: a check of the evaluation, not a tracker.
    Oracle(OracleSettings),
}

/// The annealed particle filter. One frame costs `particles x layers` likelihood evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AnnealedParticleFilterSettings {
    /// Particles. Default: 200.
    pub particles: usize,
    /// Annealing layers. Default: 5.
    pub layers: usize,
    /// Share of the particles that survives each layer (effective sample size over particles), in (0, 1]. The
    /// covariance shrinks by the same factor. Default: 0.5.
    pub survival_rate: f64,
    /// How silhouettes are compared: `"bidirectional"` or `"overlap"`. Default: `"overlap"`.
    pub energy: EnergyName,
    /// Weight of the contour's distance beside the silhouette. Default: 0.5.
    pub contour_weight: f64,
    /// Distance at which the contour term saturates, as a share of the image's height. Default: 0.04.
    pub contour_reach: f64,
    /// Factor on the standard deviations of the initial covariance, which are those of the inter-frame differences of the
    /// training motion. Default: 1.
    pub proposal_scale: f64,
    /// Where the particles of a new frame start: `"none"` (where they were) or `"constant_velocity"`. Default: `"none"`.
    pub prediction: PredictionName,
}

/// How silhouettes are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EnergyName {
    /// Half the share of the model outside the observation plus half the share of the observation outside the model.
    Bidirectional,
    /// One minus intersection over union.
    Overlap,
}

/// Where the particles of a new frame start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PredictionName {
    /// Where they were.
    None,
    /// Moved on by the last change of the estimate.
    ConstantVelocity,
}

/// Nothing to set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrozenSettings {}

/// The planted error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OracleSettings {
    /// Constant displacement of the root, world axes, metres. Default: `[0, 0, 0]`.
    pub root_offset_m: [f64; 3],
    /// Standard deviation of independent noise on every coordinate of the root, metres. Default: 0.
    pub root_noise_m: f64,
    /// Standard deviation of independent noise on every joint angle, degrees. Default: 0.
    pub angle_noise_deg: f64,
}

impl Default for TrackerSettings {
    fn default() -> Self {
        Self::AnnealedParticleFilter(AnnealedParticleFilterSettings::default())
    }
}

impl Default for AnnealedParticleFilterSettings {
    fn default() -> Self {
        Self {
            particles: 200,
            layers: 5,
            survival_rate: 0.5,
            energy: EnergyName::Overlap,
            contour_weight: 0.5,
            contour_reach: 0.04,
            proposal_scale: 1.0,
            prediction: PredictionName::None,
        }
    }
}
