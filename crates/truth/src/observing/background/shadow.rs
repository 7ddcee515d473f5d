//! Removal of cast shadows from the foreground.

use super::BackgroundMixture;
use crate::observing::Image;
use crate::raster::Mask;

/// Rule for cast shadows: a foreground pixel is shadow if it is darker than the background by the same factor in all
/// channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowRule {
    /// Minimum and maximum brightness relative to the background.
    pub ratio: [f32; 2],
    /// Maximum difference of that ratio: between the channels of a colour image, or between a pixel and its left and
    /// lower neighbours in a grey image.
    pub spread: f32,
    /// Lower share of the mask's bounds searched for shadows in grey images: everywhere else, clothing darker than the
    /// background would be taken for shadow.
    pub grey_height: f32,
}

impl Default for ShadowRule {
    fn default() -> Self {
        Self { ratio: [0.5, 1.0], spread: 0.1, grey_height: 0.2 }
    }
}

impl ShadowRule {
    /// Clears the pixels of `mask` that look like shadow on any component of the background.
    pub fn remove(&self, mask: &mut Mask, image: &Image, background: &BackgroundMixture) {
        let bounds = mask.bounds();
        let grey = image.planes().len() == 1;
        let height = (bounds.bottom - bounds.top) as f32;
        let top = if grey { bounds.bottom - (self.grey_height * height).round() as u32 } else { bounds.top };
        let shadow: Vec<(u32, u32)> = (top..bounds.bottom)
            .flat_map(|y| mask.runs(y).flatten().map(move |x| (x, y)).collect::<Vec<_>>())
            .filter(|(x, y)| self.is_shadow(*x, *y, image, background))
            .collect();
        shadow.into_iter().for_each(|(x, y)| mask.set(x, y, false));
    }

    fn is_shadow(&self, x: u32, y: u32, image: &Image, background: &BackgroundMixture) -> bool {
        let value = |channel: usize, x: u32, y: u32| {
            f32::from(image.planes()[channel][y as usize * image.width() as usize + x as usize])
        };
        background.means(x, y).enumerate().any(|(component, means)| {
            let ratio = |channel: usize| value(channel, x, y) / means[channel].max(1.0);
            let ratios: Vec<f32> = if means.len() > 1 {
                (0..means.len()).map(ratio).collect()
            } else {
                let beside = [(x.saturating_sub(1), y), (x, (y + 1).min(image.height() - 1))];
                let of = |(x, y): (u32, u32)| {
                    background.means(x, y).nth(component).map(|means| value(0, x, y) / means[0].max(1.0))
                };
                std::iter::once(ratio(0)).chain(beside.into_iter().filter_map(of)).collect()
            };
            let (low, high) = ratios.iter().fold((f32::MAX, f32::MIN), |(low, high), r| (low.min(*r), high.max(*r)));
            low >= self.ratio[0] && high <= self.ratio[1] && high - low <= self.spread
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observing::Risk;

    fn flat(colour: [u8; 3]) -> Image {
        Image::from_planes(40, 40, colour.iter().map(|c| vec![*c; 1600]).collect()).unwrap()
    }

    #[test]
    fn darkened_background_is_shadow_and_another_colour_is_not() {
        let background = vec![flat([120, 100, 80])];
        let model = BackgroundMixture::learn([&background].into_iter(), |_| Risk(1.0)).unwrap();
        let mut planes = background[0].planes().to_vec();
        for (index, dark) in [(20 * 40 + 5, [72, 60, 48]), (20 * 40 + 25, [72, 60, 75]), (20 * 40 + 35, [40, 34, 27])] {
            (0..3).for_each(|c| planes[c][index] = dark[c]);
        }
        let image = Image::from_planes(40, 40, planes).unwrap();
        let mut mask = model.foreground(&image).unwrap();
        assert_eq!(mask.count(), 3);
        ShadowRule::default().remove(&mut mask, &image, &model);
        assert!(!mask.get(5, 20), "three fifths as bright in all channels");
        assert!(mask.get(25, 20) && mask.get(35, 20), "another colour, and a third as bright");
    }
}
