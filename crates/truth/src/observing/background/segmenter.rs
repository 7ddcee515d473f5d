//! Segmentation of images into silhouettes: mixture, shadow rule, cleaning.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BackgroundError, BackgroundMixture, Cleaning, Risk, ShadowRule};
use crate::observing::Image;
use crate::raster::Mask;

/// Settings of segmentation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BackgroundSettings {
    /// Cost of a false alarm relative to a miss. Default: 1 for colour, 100 for grey.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub risk: Option<f64>,
    /// Whether pixels that look like shaded background are removed.
    pub remove_shadows: bool,
    /// Cleaning of masks.
    pub cleaning: Cleaning,
}

impl Default for BackgroundSettings {
    fn default() -> Self {
        Self { risk: None, remove_shadows: true, cleaning: Cleaning::default() }
    }
}

/// Segments the images of one camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Segmenter {
    background: BackgroundMixture,
    shadow: Option<ShadowRule>,
    cleaning: Cleaning,
}

impl Segmenter {
    /// Learns the background from the images of each period, consumed one period at a time.
    ///
    /// # Errors
    /// As [`BackgroundMixture::learn`].
    pub fn learn<P: AsRef<[Image]>>(
        periods: impl ExactSizeIterator<Item = P>,
        settings: &BackgroundSettings,
    ) -> Result<Self, BackgroundError> {
        let risk = |channels| settings.risk.map_or(Risk::usual(channels), Risk);
        let background = BackgroundMixture::learn(periods, risk)?;
        let shadow = settings.remove_shadows.then(ShadowRule::default);
        Ok(Self { background, shadow, cleaning: settings.cleaning })
    }

    /// The silhouette in an image.
    ///
    /// # Errors
    /// [`BackgroundError::Shape`] for an image of another size or number of channels.
    pub fn silhouette(&self, image: &Image) -> Result<Mask, BackgroundError> {
        let mut mask = self.background.foreground(image)?;
        if let Some(shadow) = &self.shadow {
            // specks are removed first, to save testing their pixels
            mask = self.cleaning.clean(&mask);
            shadow.remove(&mut mask, image, &self.background);
        }
        Ok(self.cleaning.clean(&mask))
    }
}
