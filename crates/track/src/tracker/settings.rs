//! What can be set of the annealed particle filter and of the silhouette likelihood.

use serde::{Deserialize, Serialize};

use crate::motion_model::SettingError;

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
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// How the areas of two silhouettes are compared: `[Skinned APF]`'s `D_s`, in [0, 1]. With B pixels of the model alone,
/// R of the observation alone and Y of both:
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SilhouetteTerm {
    /// `(B / (B + Y) + R / (R + Y)) / 2` (`[Sigal 2010]`, both directions alike); a share of nothing counts as 1.
    Bidirectional,
    /// `(R + B) / (R + B + Y)`, one minus intersection over union: `[Skinned APF]`'s "non-overlapping area".
    #[default]
    Overlap,
    /// The share of points inside the model's limbs, eight pixels apart, where nothing was observed: the term of
    /// `[Deutscher 2005]`, one-sided and sampled. A limb that hides in the trunk costs nothing. Only tapered capsules
    /// are looked at.
    Sampled,
}

/// How the contours of two silhouettes are compared: `[Skinned APF]`'s `D_c`, in [0, 1]. `[Skinned APF]` leaves it
/// open; here it is the mean over contour pixels of `min(d, tau) / tau`, with d the distance to the other contour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContourTerm {
    /// Over the model's contour: its distance to the observed one. One distance transform a view and frame.
    #[default]
    OneSided,
    /// The mean of both directions. One distance transform a view and *particle*: much slower.
    TwoSided,
}

/// Settings of [`super::SilhouetteLikelihood`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SilhouetteSettings {
    /// `[Skinned APF]`'s `D_s`.
    pub silhouette: SilhouetteTerm,
    /// `[Skinned APF]`'s `D_c`.
    pub contour: ContourTerm,
    /// `[Skinned APF]`'s alpha of Eq. 3, >= 0: weight of the contour beside the silhouette; 0 leaves the contour out.
    pub contour_weight: f64,
    /// The distance tau at which the contour term and that of the limbs' sides saturate, as a share of the image's
    /// height, > 0.
    pub contour_reach: f64,
    /// Weight, >= 0, of the sides of limbs: `[GPDM graph]`'s edges of the model against those observed. Mean over
    /// samples along the two sides of every capsule of `min(d, tau) / tau`, d being the distance to the observed
    /// contour. Sides that lie inside the observed silhouette have no contour to lie on and count as missed; 0 leaves
    /// the term out.
    pub limb_side_weight: f64,
}

impl Default for SilhouetteSettings {
    fn default() -> Self {
        Self {
            silhouette: SilhouetteTerm::default(),
            contour: ContourTerm::default(),
            contour_weight: 0.5,
            contour_reach: 20.0 / 480.0,
            limb_side_weight: 0.0,
        }
    }
}

impl SilhouetteSettings {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// [`SettingError`] that names the first key which is not.
    pub fn validate(&self) -> Result<(), SettingError> {
        for (key, weight) in [("contour_weight", self.contour_weight), ("limb_side_weight", self.limb_side_weight)] {
            if !(weight >= 0.0 && weight.is_finite()) {
                return Err(SettingError::new(key, "a number, 0 or more", weight));
            }
        }
        within("contour_reach", self.contour_reach, 1.0)
    }
}

fn at_least_one(key: &'static str, value: usize) -> Result<(), SettingError> {
    if value >= 1 {
        return Ok(());
    }
    Err(SettingError::new(key, "at least 1", value))
}

/// `0 < value <= highest`; a NaN is neither.
fn within(key: &'static str, value: f64, highest: f64) -> Result<(), SettingError> {
    if value > 0.0 && value <= highest {
        return Ok(());
    }
    let expected =
        if highest == f64::MAX { "a number > 0".into() } else { format!("a number above 0 and at most {highest}") };
    Err(SettingError::new(key, expected, value))
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
