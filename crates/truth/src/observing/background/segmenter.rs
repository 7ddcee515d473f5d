//! From images to silhouettes: mixture, shadow rule, cleaning.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BackgroundError, BackgroundMixture, Cleaning, Risk, ShadowRule};
use crate::observing::Image;
use crate::raster::Mask;

/// How silhouettes are segmented.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BackgroundSettings {
    /// What a false alarm costs compared with a miss. Default: 1 in colour, 100 in grey.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub risk: Option<f64>,
    /// Whether pixels that look like the background in shadow are taken out.
    pub remove_shadows: bool,
    /// How masks are cleaned.
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
    /// Learns the background from the images of each period; these may come one after another.
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
            // specks first: each of their pixels would be looked at
            mask = self.cleaning.clean(&mask);
            shadow.remove(&mut mask, image, &self.background);
        }
        Ok(self.cleaning.clean(&mask))
    }
}
