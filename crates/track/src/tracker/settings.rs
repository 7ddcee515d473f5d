//! Settings of the annealed particle filter and of the silhouette likelihood.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::mask_trust::MaskTrust;
use crate::motion_model::SettingError;
use skiagraph_core::raster::Overlap;

/// How particles are spread after the selection in a layer. Deviations are per component of a pose step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Kernel {
    /// Algorithm 1 of `[Skinned APF]`: Gaussian noise of covariance `P_m = alpha_m P_{m-1}`, independent of the
    /// particles.
    #[default]
    Geometric,
    /// As `geometric`, but no deviation exceeds `factor` times that of the weighted particles.
    Min {
        /// Factor on the deviation of the particles, > 0; 0.5 to 1 is useful.
        factor: f64,
    },
    /// The shrinkage kernel of `[Liu 2001]`: particles are moved towards their mean by `sqrt(1 - h^2)` and spread by
    /// `h` times their deviation, which preserves the deviation after selection.
    Shrink {
        /// Share of the spread that is resampled, in (0, 1].
        h: f64,
    },
}

/// How the pose estimate is computed from weighted particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Estimator {
    /// The weighted mean of `[Skinned APF]` section 6.1; rotations are averaged on their manifold.
    #[default]
    WeightedMean,
    /// The particle of lowest energy.
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
    /// `[Skinned APF]`'s alpha_m, the same in every layer, in (0, 1]: the share of particles that survives a selection,
    /// and the factor by which the covariance shrinks from layer to layer.
    pub survival_rate: f64,
    /// How particles are spread after selection.
    pub kernel: Kernel,
    /// How the estimate is computed.
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
    /// A plain particle filter (sampling importance resampling): one layer, with lambda such that the effective sample
    /// size is a tenth of the particles.
    pub fn particle_filter(particles: usize) -> Self {
        Self { particles, layers: 1, survival_rate: 0.1, ..Self::default() }
    }

    /// Checks that every setting is in its range.
    ///
    /// # Errors
    /// [`SettingError`] for the first setting out of range.
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

/// How the areas of two silhouettes are compared: `[Skinned APF]`'s `D_s`, in [0, 1]. With B pixels in the model only,
/// R in the observation only and Y in both:
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SilhouetteTerm {
    /// `(B / (B + Y) + R / (R + Y)) / 2` (`[Sigal 2010]`, symmetric); a fraction with denominator 0 counts as 1.
    Bidirectional,
    /// `(R + B) / (R + B + Y)`, one minus intersection over union: `[Skinned APF]`'s "non-overlapping area".
    #[default]
    Overlap,
    /// The share of sample points inside the model's limbs, eight pixels apart, that are outside the observed
    /// silhouette: the one-sided, sampled term of `[Deutscher 2005]`. For its sampled edges too, set `contour_weight =
    /// 0` and `limb_side_weight = 1`. A limb hidden by the trunk costs nothing. Only tapered capsules are sampled.
    Sampled,
}

impl SilhouetteTerm {
    /// The term's value from areas, of which those that differ count as far as the mask is believed; `None` if neither
    /// mask has a pixel, and for the sampled term, which uses no areas.
    pub(super) fn value(self, overlap: &Overlap, trust: MaskTrust) -> Option<f64> {
        if overlap.union() == 0 {
            return None;
        }
        let (lacking, extra) = (trust.lacking * overlap.only_model as f64, trust.extra * overlap.only_observed as f64);
        let both = overlap.both as f64;
        let share = |part: f64| if part + both == 0.0 { 1.0 } else { part / (part + both) };
        Some(match self {
            Self::Bidirectional => 0.5 * (share(lacking) + share(extra)),
            Self::Overlap if trust == MaskTrust::FULL => 1.0 - overlap.iou(),
            Self::Overlap => share(lacking + extra),
            Self::Sampled => return None,
        })
    }
}

/// How the contours of two silhouettes are compared: `[Skinned APF]`'s `D_c`, in [0, 1]. `[Skinned APF]` does not
/// define it; here it is the mean over contour pixels of `min(d, tau) / tau`, with d the distance to the other contour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContourTerm {
    /// Over the model's contour: its distance to the observed one. One distance transform per view and frame.
    #[default]
    OneSided,
    /// The mean of both directions. One distance transform per view and *particle*: much slower.
    TwoSided,
}

/// Settings of [`super::SilhouetteLikelihood`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SilhouetteSettings {
    /// `[Skinned APF]`'s `D_s`.
    pub silhouette: SilhouetteTerm,
    /// `[Skinned APF]`'s `D_c`.
    pub contour: ContourTerm,
    /// `[Skinned APF]`'s alpha of Eq. 3, 0 to 1e6: weight of the contour term relative to the area term; 0 disables it.
    pub contour_weight: f64,
    /// The distance tau at which the contour term and the limb side term saturate, as a share of the image height, > 0.
    pub contour_reach: f64,
    /// Weight of the limb sides, 0 to 1e6: `[GPDM graph]`'s model edges against observed edges. The term is the mean of
    /// `min(d, tau) / tau` over samples along both sides of every capsule, with d the distance to the observed contour.
    /// Sides inside the observed silhouette have no contour near them and count as missed; 0 disables the term.
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
    /// Checks that every setting is in its range.
    ///
    /// # Errors
    /// [`SettingError`] for the first setting out of range.
    pub fn validate(&self) -> Result<(), SettingError> {
        check_range("contour_weight", self.contour_weight, 0.0..=1e6)?;
        check_range("limb_side_weight", self.limb_side_weight, 0.0..=1e6)?;
        within("contour_reach", self.contour_reach, 1.0)
    }
}

pub(super) fn check_range(key: &'static str, value: f64, range: RangeInclusive<f64>) -> Result<(), SettingError> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(SettingError::new(key, format!("a number from {} to {}", range.start(), range.end()), value))
}

fn at_least_one(key: &'static str, value: usize) -> Result<(), SettingError> {
    if value >= 1 {
        return Ok(());
    }
    Err(SettingError::new(key, "at least 1", value))
}

/// Requires `0 < value <= highest`; rejects NaN.
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
    fn a_kernel_out_of_range_is_named() {
        let key = |kernel| FilterSettings { kernel, ..FilterSettings::default() }.validate().unwrap_err().key;
        assert_eq!(key(Kernel::Shrink { h: f64::NAN }), "kernel.shrink.h");
        assert_eq!(key(Kernel::Min { factor: 0.0 }), "kernel.min.factor");
    }
}
