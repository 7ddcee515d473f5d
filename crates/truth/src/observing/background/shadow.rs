//! Removal of cast shadows from the foreground.

use super::BackgroundMixture;
use super::mixture::ChannelMean;
use super::texture::{Brightness, REACH_PX, Texture};
use crate::observing::Image;
use skiagraph_core::raster::{Mask, PixelBounds};

/// Rows that are searched at once, so that large images need little memory.
const BAND_PX: u32 = 128;

/// Rule for cast shadows: a foreground pixel is shadow if it is darker than the background by the same factor in all
/// channels, unless the background's texture is hidden around it, as by clothing.
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
    /// Clears the pixels of `mask` that look like shadow on any component of the background, and around which the
    /// background's texture is not hidden.
    pub fn remove(&self, mask: &mut Mask, image: &Image, background: &BackgroundMixture) {
        let searched = self.searched(mask, image);
        let bands = (searched.top..searched.bottom).step_by(BAND_PX as usize);
        let shadow: Vec<(u32, u32)> =
            bands.flat_map(|top| self.shadow_in_band(top, searched, mask, image, background)).collect();
        shadow.into_iter().for_each(|(x, y)| mask.set(x, y, false));
    }

    /// The pixels that look like shadow in a band of rows that begins at `band`.
    fn shadow_in_band(
        &self,
        band: u32,
        searched: PixelBounds,
        mask: &Mask,
        image: &Image,
        background: &BackgroundMixture,
    ) -> Vec<(u32, u32)> {
        let PixelBounds { left, right, top, bottom } = searched;
        let (from, to) = (band.saturating_sub(REACH_PX).max(top), (band + BAND_PX + REACH_PX).min(bottom));
        let pixels = (from..to).flat_map(|y| (left..right).map(move |x| (x, y)));
        let darkened = |(x, y): (u32, u32)| mask.get(x, y).then(|| self.darkened(x, y, image, background)).flatten();
        let darkened: Vec<Option<Brightness>> = pixels.map(darkened).collect();
        let width = (right - left) as usize;
        let texture = Texture::new(&darkened, width);
        let place = |index: usize| (left + (index % width) as u32, from + (index / width) as u32);
        let rows = band..(band + BAND_PX).min(bottom);
        (0..darkened.len())
            .filter(|index| darkened[*index].is_some() && rows.contains(&place(*index).1))
            .filter(|index| !texture.is_hidden(index % width, index / width))
            .map(place)
            .collect()
    }

    /// The bounds in which shadows are searched.
    fn searched(&self, mask: &Mask, image: &Image) -> PixelBounds {
        let bounds = mask.bounds();
        let height = (bounds.bottom - bounds.top) as f32;
        let lower = bounds.bottom - (self.grey_height * height).round() as u32;
        PixelBounds { top: if image.planes().len() == 1 { lower } else { bounds.top }, ..bounds }
    }

    /// The brightness at a pixel that is as much darker than a component of the background as in a shadow.
    fn darkened(&self, x: u32, y: u32, image: &Image, background: &BackgroundMixture) -> Option<Brightness> {
        let value = |channel: usize, x: u32, y: u32| {
            f32::from(image.planes()[channel][y as usize * image.width() as usize + x as usize])
        };
        let is_shadow = |(component, means): &(usize, Vec<ChannelMean>)| {
            let ratio = |channel: usize| value(channel, x, y) / means[channel].mean.max(1.0);
            let ratios: Vec<f32> = if means.len() > 1 {
                (0..means.len()).map(ratio).collect()
            } else {
                let beside = [(x.saturating_sub(1), y), (x, (y + 1).min(image.height() - 1))];
                let of = |(x, y): (u32, u32)| {
                    background.at(x, y).nth(*component).map(|means| value(0, x, y) / means[0].mean.max(1.0))
                };
                std::iter::once(ratio(0)).chain(beside.into_iter().filter_map(of)).collect()
            };
            let (low, high) = ratios.iter().fold((f32::MAX, f32::MIN), |(low, high), r| (low.min(*r), high.max(*r)));
            low >= self.ratio[0] && high <= self.ratio[1] && high - low <= self.spread
        };
        let (component, means) = background.at(x, y).enumerate().find(is_shadow)?;
        let image = (0..means.len()).map(|channel| value(channel, x, y)).collect();
        Some(Brightness { image, component, means })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observing::Risk;
    use skiagraph_core::rng::{Purpose, normal, stream};

    fn flat(colour: [u8; 3]) -> Image {
        Image::from_planes(40, 40, colour.iter().map(|c| vec![*c; 1600]).collect()).unwrap()
    }

    #[test]
    fn darkened_background_is_shadow_and_another_colour_is_not() {
        let background = vec![flat([120, 100, 80])];
        let model = BackgroundMixture::learn([&background].into_iter(), Risk(1.0)).unwrap();
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

    const SIZE: (u32, u32) = (64, 160);

    fn grain(seed: u64, deviation: f64) -> Vec<f64> {
        let mut random = stream(seed, Purpose::Corruption, 0, 0, 0);
        (0..SIZE.0 * SIZE.1).map(|_| deviation * normal(&mut random)).collect()
    }

    fn is_trousers(x: u32) -> bool {
        (10..22).contains(&x)
    }

    fn is_shadow(x: u32) -> bool {
        (40..52).contains(&x)
    }

    /// Ground with a texture of this deviation, and an image with trousers that are as dark as shaded ground, and a
    /// shadow.
    fn trousers_and_shadow(texture: f64) -> (BackgroundMixture, Image) {
        // by pixel, the same in all channels, plus noise that differs between them
        let noisy = |seed: u64, levels: &[f64]| {
            let plane = |channel| {
                let noise = grain(3 * seed + channel, 2.5);
                levels.iter().zip(noise).map(|(level, noise)| (level + noise).round() as u8).collect()
            };
            Image::from_planes(SIZE.0, SIZE.1, (0..3).map(plane).collect()).unwrap()
        };
        let ground: Vec<f64> = grain(1, texture).iter().map(|grain| 130.0 + grain).collect();
        let periods = [10, 20, 30].map(|first| (first..first + 10).map(|s| noisy(s, &ground)).collect::<Vec<_>>());
        let cloth = grain(2, 3.0);
        let level = |(index, ground): (usize, &f64)| match index as u32 % SIZE.0 {
            x if is_trousers(x) => 0.7 * 130.0 + cloth[index],
            x if is_shadow(x) => 0.6 * ground,
            _ => *ground,
        };
        let image = noisy(99, &ground.iter().enumerate().map(level).collect::<Vec<f64>>());
        (BackgroundMixture::learn(periods.iter(), Risk(1.0)).unwrap(), image)
    }

    #[test]
    fn trousers_of_the_colour_of_shaded_ground_are_kept_where_they_hide_its_texture() {
        let kept = |texture: f64| {
            let (model, image) = trousers_and_shadow(texture);
            let mut mask = model.foreground(&image).unwrap();
            let before = mask.clone();
            ShadowRule::default().remove(&mut mask, &image, &model);
            [is_trousers, is_shadow].map(|of| {
                let count = |mask: &Mask| mask.pixels().filter(|(x, _)| of(*x)).count() as f64;
                count(&mask) / count(&before)
            })
        };
        let [trousers, shadow] = kept(6.0);
        assert!(trousers > 0.95 && shadow < 0.1, "{trousers} {shadow}");
        let [trousers, shadow] = kept(0.0);
        assert!(trousers < 0.1 && shadow < 0.1, "without texture they look alike: {trousers} {shadow}");
    }

    #[test]
    fn shadows_do_not_depend_on_where_bands_of_rows_begin() {
        // little texture, so that the answers differ from pixel to pixel
        let (model, image) = trousers_and_shadow(0.75);
        let of_rows = |first: u32| {
            let mut mask = Mask::from_fn(SIZE.0, SIZE.1, |x, y| y >= first && (is_trousers(x) || is_shadow(x)));
            // the first row of the mask, far from the others
            mask.set(63, 0, first < 10);
            ShadowRule::default().remove(&mut mask, &image, &model);
            mask.pixels().filter(|(x, y)| *x < 60 && *y >= 60).collect::<Vec<_>>()
        };
        let kept = of_rows(5);
        assert!((200..1000).contains(&kept.len()), "{}", kept.len());
        assert_eq!(of_rows(20), kept);
    }
}
