//! Segmentation of images into silhouettes: mixture, shadow rule, cleaning.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BackgroundError, BackgroundMixture, Cleaning, Risk, ShadowRule};
use crate::observing::Image;
use skiagraph_core::raster::{Mask, connected_regions};

/// Maximum mean squared deviation of a region of the background, per channel and in standard deviations. That of many
/// pixels of the background is below 1 with three components (with one, learned from 20 images, about 1.2); that of
/// foreground taken for background is between 1 and the mixture's threshold, which is 7 for a background whose
/// deviation is 2 grey values. A larger maximum opens holes in clothing that resembles the background: 1.5 raised the
/// error of one clip of two with a contrast of 30 grey values.
const MAX_BACKGROUND_DEVIATION: f32 = 1.1;

/// Background subtraction: one Gaussian per pixel and period ([Sigal 2010]), learned once. `skiagraph segment` does the
/// same with your images.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BackgroundSettings {
    /// Cost of a false alarm relative to a miss. Default: 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub risk: Option<f64>,
    /// Whether shadows are removed: pixels 0.5 to 1 times as bright as the background, by the same factor in all
    /// channels. The background's texture around them, if any, must still be visible. In grey images only in the lower
    /// fifth of the mask.
    pub remove_shadows: bool,
    /// Cleaning of masks (`scenarios/README.md#cleaning-segmented-silhouettes`).
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
    pub fn learn<P: AsRef<[Image]>>(
        periods: impl ExactSizeIterator<Item = P>,
        settings: &BackgroundSettings,
    ) -> Result<Self, BackgroundError> {
        let background = BackgroundMixture::learn(periods, settings.risk.map_or_else(Risk::default, Risk))?;
        let shadow = settings.remove_shadows.then(ShadowRule::default);
        Ok(Self { background, shadow, cleaning: settings.cleaning })
    }

    /// The silhouette in an image.
    pub fn silhouette(&self, image: &Image) -> Result<Mask, BackgroundError> {
        let foreground = self.background.foreground(image)?;
        let with_shadow = self.clean(&foreground, &foreground, image);
        let Some(shadow) = &self.shadow else { return Ok(with_shadow) };
        let mut mask = with_shadow.clone();
        shadow.remove(&mut mask, image, &self.background);
        Ok(self.clean(&mask, &with_shadow, image))
    }

    /// The cleaned mask, without those regions outside of `known` that only cleaning has set and that look like the
    /// background. A gap between arm and trunk stays open, while a hole in clothing of almost the background's colour
    /// is closed. Pixels that were taken for shadow are in `known`: they are the darker ones of a region, so that they
    /// would look like the background in clothing, too.
    fn clean(&self, mask: &Mask, known: &Mask, image: &Image) -> Mask {
        let mut cleaned = self.cleaning.clean(mask);
        let mut added = cleaned.clone();
        added &= known;
        added ^= &cleaned;
        for region in connected_regions(&added) {
            let deviations = region.iter().map(|(x, y)| self.background.squared_deviation(image, *x, *y));
            let mean = deviations.sum::<f32>() / region.len() as f32;
            if mean < MAX_BACKGROUND_DEVIATION * image.planes().len() as f32 {
                region.into_iter().for_each(|(x, y)| cleaned.set(x, y, false));
            }
        }
        cleaned
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::rng::{Purpose, normal, stream};

    /// An image of noise with a deviation of 2 grey values about levels given by pixel.
    fn noisy(seed: u64, level: impl Fn(u32, u32) -> f64) -> Image {
        let mut random = stream(seed, Purpose::Corruption, 0, 0, 0);
        let mut plane = || -> Vec<u8> {
            let pixels = (0..48 * 64).map(|index| level(index % 64, index / 64));
            pixels.map(|level| (level + 2.0 * normal(&mut random)).round() as u8).collect()
        };
        Image::from_planes(64, 48, (0..3).map(|_| plane()).collect()).unwrap()
    }

    #[test]
    fn a_gap_between_arm_and_trunk_is_not_filled_and_a_hole_in_clothing_is() {
        let body = |x: u32, y: u32| (8..40).contains(&x) && (4..44).contains(&y);
        let gap = |x: u32, y: u32| (14..17).contains(&x) && (10..30).contains(&y);
        let slit = |x: u32, y: u32| x == 36 && (6..20).contains(&y);
        // of nearly the colour of the background, so that most pixels are below the threshold
        let pale = |x: u32, y: u32| (24..30).contains(&x) && (20..30).contains(&y);
        let level = |x: u32, y: u32| match (gap(x, y) || slit(x, y), pale(x, y), body(x, y)) {
            (true, ..) | (_, _, false) => 100.0,
            (_, true, _) => 104.5,
            _ => 180.0,
        };
        let period = |first| (first..first + 20).map(|seed| noisy(seed, |_, _| 100.0)).collect::<Vec<Image>>();
        let background = [0, 20, 40].map(period);
        // holes of up to 100 pixels in images of this size
        let cleaning = Cleaning { least_px: 10_000, ..Cleaning::default() };
        let settings = BackgroundSettings { remove_shadows: false, cleaning, ..BackgroundSettings::default() };
        let segmenter = Segmenter::learn(background.iter(), &settings).unwrap();
        let image = noisy(99, level);
        let raw = segmenter.background.foreground(&image).unwrap();
        let count = |mask: &Mask, of: &dyn Fn(u32, u32) -> bool| mask.pixels().filter(|(x, y)| of(*x, *y)).count();
        assert!(count(&raw, &pale) < 40, "{} of 60", count(&raw, &pale));
        let mask = segmenter.silhouette(&image).unwrap();
        assert!(count(&mask, &gap) < 4 && count(&mask, &slit) < 4, "{} {}", count(&mask, &gap), count(&mask, &slit));
        assert_eq!(count(&mask, &pale), 60);
        assert_eq!(count(&segmenter.cleaning.clean(&raw), &gap), 60, "cleaning alone fills the gap");
    }
}
