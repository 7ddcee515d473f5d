//! Settings of the silhouette likelihood.

use serde::{Deserialize, Serialize};

use super::SettingError;
use super::settings::within;

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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
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
                return Err(SettingError { key, expected: "a number, 0 or more".into(), found: weight.to_string() });
            }
        }
        within("contour_reach", self.contour_reach, 1.0)
    }
}
