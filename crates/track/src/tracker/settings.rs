//! What can be set of the annealed particle filter.

use serde::{Deserialize, Serialize};

/// How particles are spread again after the selection of a layer. Deviations are per number of a pose's step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Kernel {
    /// Algorithm 1 of `[Skinned APF]`: Gaussian noise of covariance `P_m = alpha_m P_{m-1}`, whatever the particles do.
    #[default]
    Geometric,
    /// As geometric, but no deviation exceeds `factor` times that of the weighted particles.
    Min {
        /// Factor on the particles' own deviation, > 0; 0.5 to 1 is useful.
        factor: f64,
    },
    /// The shrinkage of `[Liu 2001]`: particles are drawn towards their mean by `sqrt(1 - h^2)` and spread by `h`
    /// times their own deviation, which keeps the deviation that selection left.
    Shrink {
        /// Share of the spread that is drawn anew, in (0, 1].
        h: f64,
    },
}

/// How a pose is made of weighted particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Estimator {
    /// The weighted mean of `[Skinned APF]` section 6.1; rotations are averaged on their manifold.
    #[default]
    WeightedMean,
    /// The particle of least energy.
    Best,
}

/// Settings of [`super::AnnealedParticleFilter`]. `[Skinned APF]` gives no numbers; the defaults are those of `[Balan
/// 2005]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FilterSettings {
    /// `[Skinned APF]`'s N, particles per layer, >= 1.
    pub particles: usize,
    /// `[Skinned APF]`'s M, annealing layers per frame, >= 1; one layer is a plain particle filter.
    pub layers: usize,
    /// `[Skinned APF]`'s alpha_m, the same in every layer, in (0, 1]: which share of the particles a selection keeps,
    /// and by which factor the covariance shrinks from layer to layer.
    pub survival_rate: f64,
    /// How particles are spread after a selection.
    pub kernel: Kernel,
    /// How the estimate is made.
    pub estimator: Estimator,
}

impl Default for FilterSettings {
    fn default() -> Self {
        Self {
            particles: 200,
            layers: 5,
            survival_rate: 0.5,
            kernel: Kernel::Geometric,
            estimator: Estimator::WeightedMean,
        }
    }
}

impl FilterSettings {
    /// A plain particle filter (sampling, importance resampling): one layer, whose lambda leaves a tenth of the
    /// particles effective.
    pub fn particle_filter(particles: usize) -> Self {
        Self { particles, layers: 1, survival_rate: 0.1, ..Self::default() }
    }

    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// [`SettingError`] that names the first key which is not.
    pub fn validate(&self) -> Result<(), SettingError> {
        at_least_one("particles", self.particles)?;
        at_least_one("layers", self.layers)?;
        within("survival_rate", self.survival_rate, 1.0)?;
        match self.kernel {
            Kernel::Geometric => Ok(()),
            Kernel::Min { factor } => within("kernel.min.factor", factor, f64::MAX),
            Kernel::Shrink { h } => within("kernel.shrink.h", h, 1.0),
        }
    }
}

/// A setting of a tracker is out of its range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}: expected {expected}, found {found}")]
pub struct SettingError {
    /// The setting, as a scenario spells it.
    pub key: &'static str,
    /// What is allowed.
    pub expected: String,
    /// What was given.
    pub found: String,
}

fn at_least_one(key: &'static str, value: usize) -> Result<(), SettingError> {
    if value >= 1 {
        return Ok(());
    }
    Err(SettingError { key, expected: "at least 1".into(), found: value.to_string() })
}

/// `0 < value <= highest`; a NaN is neither.
pub(super) fn within(key: &'static str, value: f64, highest: f64) -> Result<(), SettingError> {
    if value > 0.0 && value <= highest {
        return Ok(());
    }
    let expected =
        if highest == f64::MAX { "a number > 0".into() } else { format!("a number above 0 and at most {highest}") };
    Err(SettingError { key, expected, found: value.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid() {
        assert_eq!(FilterSettings::default().validate(), Ok(()));
        assert_eq!(FilterSettings::particle_filter(1000).validate(), Ok(()));
    }

    #[test]
    fn a_value_out_of_range_is_named() {
        let good = FilterSettings::default();
        let key = |settings: FilterSettings| settings.validate().unwrap_err().key;
        assert_eq!(key(FilterSettings { particles: 0, ..good }), "particles");
        assert_eq!(key(FilterSettings { layers: 0, ..good }), "layers");
        for survival_rate in [0.0, -0.5, 1.01, f64::NAN, f64::INFINITY] {
            assert_eq!(key(FilterSettings { survival_rate, ..good }), "survival_rate");
        }
        assert_eq!(key(FilterSettings { kernel: Kernel::Shrink { h: f64::NAN }, ..good }), "kernel.shrink.h");
        assert_eq!(key(FilterSettings { kernel: Kernel::Min { factor: 0.0 }, ..good }), "kernel.min.factor");
    }

    #[test]
    fn an_error_says_what_was_expected_and_found() {
        let settings = FilterSettings { survival_rate: 1.5, ..FilterSettings::default() };
        let message = settings.validate().unwrap_err().to_string();
        assert_eq!(message, "survival_rate: expected a number above 0 and at most 1, found 1.5");
    }
}
