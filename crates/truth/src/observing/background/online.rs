//! The online mixture of `[Stauffer 1999]`, updated with every frame.
//!
//! A pixel matches component `i` iff the mean over its channels of `(x - mu_i)^2` is below `(2.5 sigma_i)^2`; among
//! matching components, the first in descending order of `omega / sigma` is used. With the rate `a` and `m = 1` for the
//! matched component:
//! `omega <- (1 - a) omega + a m`, `rho = a / omega`, `mu <- (1 - rho) mu + rho x`,
//! `sigma^2 <- (1 - rho) sigma^2 + rho mean (x - mu)^2`. A pixel without a match replaces the last component
//! (`sigma^2 = 15^2`, `omega = 0.05`). The background consists of the first components whose total weight exceeds
//! `T = 0.7`. The rate is `1 / n` in frame `n` until it falls to `a`, so that the first frames are averaged.
//!
//! Weights are stored as multiples of a common factor that grows by `1 / (1 - a)` per frame, so that unmatched
//! components need no update.

use super::BackgroundError;
use super::lanes::{LANES, PixelLane, groups_per_row, lane_of, put};
use crate::observing::Image;
use crate::raster::Mask;
use crate::simd::{Dispatched, dispatch};

/// Variance of a new component, grey values squared.
const FIRST_VARIANCE: f32 = 225.0;
/// Weight of a new component.
const FIRST_WEIGHT: f32 = 0.05;
/// Squared number of standard deviations within which a pixel matches.
const MATCH: f32 = 6.25;
/// Least variance of a channel, grey values squared.
const MIN_VARIANCE: f32 = 1.0;
/// When the common factor exceeds this, weights are divided by it.
const MAX_FACTOR: f32 = 1e6;
/// Components per pixel.
const COMPONENTS: usize = 3;

/// Settings of the online mixture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnlineSettings {
    /// Learning rate `a`, between 0 and 1.
    pub rate: f64,
    /// Share of the total weight that is background, `T`.
    pub background_share: f64,
}

impl Default for OnlineSettings {
    fn default() -> Self {
        Self { rate: 0.005, background_share: 0.7 }
    }
}

/// A background model that is updated with every frame.
#[derive(Clone, Debug)]
pub struct OnlineBackground {
    shape: (u32, u32, usize),
    settings: OnlineSettings,
    /// `[component][group]`: weight, variance, and the mean of every channel; each for eight pixels, with the
    /// components of every pixel in descending order of weight divided by deviation.
    blocks: [Vec<PixelLane>; COMPONENTS],
    /// Common factor of the stored weights.
    factor: f32,
    frames: u64,
}

impl OnlineBackground {
    /// A background initialised with `first`.
    pub fn new(first: &Image, settings: OnlineSettings) -> Self {
        let shape = first.shape();
        let (channels, groups) = (shape.2, groups_per_row(shape.0));
        let lanes = groups * shape.1 as usize * (2 + channels);
        let mut blocks = std::array::from_fn(|_| vec![[0.0; LANES]; lanes]);
        for component in &mut blocks {
            component.iter_mut().skip(1).step_by(2 + channels).for_each(|variance| *variance = [FIRST_VARIANCE; LANES]);
        }
        let width = shape.0 as usize;
        for (index, block) in blocks[0].chunks_exact_mut(2 + channels).enumerate() {
            let (y, group) = (index / groups, index % groups);
            block[0] = [1.0; LANES];
            for channel in 0..channels {
                block[2 + channel] = lane_of(&first.planes()[channel][y * width..(y + 1) * width], group);
            }
        }
        Self { shape, settings, blocks, factor: 1.0, frames: 1 }
    }

    /// The foreground of a frame; updates the background.
    ///
    /// # Errors
    /// [`BackgroundError::Shape`] for an image of another size or number of channels.
    pub fn update(&mut self, image: &Image) -> Result<Mask, BackgroundError> {
        if image.shape() != self.shape {
            return Err(BackgroundError::Shape { found: image.shape(), expected: self.shape });
        }
        let mut mask = Mask::new(self.shape.0, self.shape.1);
        self.frames += 1;
        let rate = self.settings.rate.max(1.0 / self.frames as f64).min(0.999) as f32;
        self.factor /= 1.0 - rate;
        match self.shape.2 {
            1 => dispatch(Update::<1> { model: self, image, mask: &mut mask, rate }),
            _ => dispatch(Update::<3> { model: self, image, mask: &mut mask, rate }),
        }
        if self.factor > MAX_FACTOR {
            let channels = self.shape.2;
            for component in &mut self.blocks {
                let weights = component.iter_mut().step_by(2 + channels);
                weights.for_each(|weight| weight.iter_mut().for_each(|w| *w /= self.factor));
            }
            self.factor = 1.0;
        }
        Ok(mask)
    }
}

struct Update<'a, const CHANNELS: usize> {
    model: &'a mut OnlineBackground,
    image: &'a Image,
    mask: &'a mut Mask,
    rate: f32,
}

impl<const CHANNELS: usize> Dispatched for Update<'_, CHANNELS> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { model, image, mask, rate } = self;
        let (width, groups) = (image.width() as usize, groups_per_row(image.width()));
        let learning = Learning { factor: model.factor, rate, share: model.settings.background_share as f32 };
        for y in 0..image.height() as usize {
            let rows: [&[u8]; CHANNELS] = std::array::from_fn(|c| &image.planes()[c][y * width..(y + 1) * width]);
            for group in 0..groups {
                let pixels: [PixelLane; CHANNELS] = std::array::from_fn(|c| lane_of(rows[c], group));
                let first = (y * groups + group) * (2 + CHANNELS);
                let block = &mut model.blocks[0][first..first + 2 + CHANNELS];
                // usually all eight pixels match their first component, which is always background
                if !learning.learn_first(block, &pixels) {
                    let bits = (0..LANES).map(|lane| {
                        let pixel = std::array::from_fn(|c| pixels[c][lane]);
                        u8::from(learning.learn_pixel::<CHANNELS>(&mut model.blocks, first, lane, &pixel)) << lane
                    });
                    put(mask, y as u32, group, bits.sum());
                }
            }
        }
    }
}

/// Parameters of the update with one frame.
#[derive(Clone, Copy)]
struct Learning {
    factor: f32,
    rate: f32,
    share: f32,
}

/// One component of one pixel.
#[derive(Clone, Copy)]
struct Component<const CHANNELS: usize> {
    weight: f32,
    variance: f32,
    mean: [f32; CHANNELS],
}

impl Learning {
    /// Updates the first component of eight pixels if all match it; returns whether they do.
    #[inline(always)]
    fn learn_first<const CHANNELS: usize>(&self, block: &mut [PixelLane], pixels: &[PixelLane; CHANNELS]) -> bool {
        let mut squares = [0.0; LANES];
        for channel in 0..CHANNELS {
            for lane in 0..LANES {
                let off = pixels[channel][lane] - block[2 + channel][lane];
                squares[lane] += off * off;
            }
        }
        let mut misses = 0;
        for lane in 0..LANES {
            squares[lane] *= 1.0 / CHANNELS as f32;
            misses += u32::from(squares[lane] >= MATCH * block[1][lane]);
        }
        if misses > 0 {
            return false;
        }
        let mut step = [0.0; LANES];
        for lane in 0..LANES {
            let weight = block[0][lane] + self.rate * self.factor;
            block[0][lane] = weight;
            let rho = self.rate * self.factor / weight;
            step[lane] = if rho < 1.0 { rho } else { 1.0 };
            let variance = block[1][lane] + step[lane] * (squares[lane] - block[1][lane]);
            block[1][lane] = if variance > MIN_VARIANCE { variance } else { MIN_VARIANCE };
        }
        for channel in 0..CHANNELS {
            for lane in 0..LANES {
                let mean = block[2 + channel][lane];
                block[2 + channel][lane] = mean + step[lane] * (pixels[channel][lane] - mean);
            }
        }
        true
    }

    /// Updates the components of one pixel; returns whether it is foreground.
    fn learn_pixel<const CHANNELS: usize>(
        &self,
        blocks: &mut [Vec<PixelLane>; COMPONENTS],
        first: usize,
        lane: usize,
        pixel: &[f32; CHANNELS],
    ) -> bool {
        let mut all: [Component<CHANNELS>; COMPONENTS] = std::array::from_fn(|k| {
            let block = &blocks[k][first..first + 2 + CHANNELS];
            Component {
                weight: block[0][lane],
                variance: block[1][lane],
                mean: std::array::from_fn(|c| block[2 + c][lane]),
            }
        });
        let squares = |component: &Component<CHANNELS>| {
            let sum: f32 = pixel.iter().zip(component.mean).map(|(x, mean)| (x - mean) * (x - mean)).sum();
            sum / CHANNELS as f32
        };
        let matched = all.iter().position(|c| c.weight > 0.0 && squares(c) < MATCH * c.variance);
        let foreground = match matched {
            Some(index) => {
                let whole: f32 = all.iter().map(|c| c.weight).sum();
                let before: f32 = all[..index].iter().map(|c| c.weight).sum();
                let square = squares(&all[index]);
                self.learn(&mut all[index], pixel, square);
                before > self.share * whole
            }
            None => {
                let last = COMPONENTS - 1;
                all[last] = Component { weight: FIRST_WEIGHT * self.factor, variance: FIRST_VARIANCE, mean: *pixel };
                true
            }
        };
        let rank = |c: &Component<CHANNELS>| c.weight / c.variance.sqrt();
        all.sort_by(|a, b| rank(b).total_cmp(&rank(a)));
        for (blocks, component) in blocks.iter_mut().zip(all) {
            let block = &mut blocks[first..first + 2 + CHANNELS];
            block[0][lane] = component.weight;
            block[1][lane] = component.variance;
            (0..CHANNELS).for_each(|c| block[2 + c][lane] = component.mean[c]);
        }
        foreground
    }

    fn learn<const CHANNELS: usize>(&self, component: &mut Component<CHANNELS>, pixel: &[f32; CHANNELS], squares: f32) {
        component.weight += self.rate * self.factor;
        let step = (self.rate * self.factor / component.weight).min(1.0);
        component.variance = (component.variance + step * (squares - component.variance)).max(MIN_VARIANCE);
        for (mean, x) in component.mean.iter_mut().zip(pixel) {
            *mean += step * (x - *mean);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Purpose, normal, stream};

    fn noisy(width: u32, channels: usize, seed: u64, level: impl Fn(u32) -> f64, deviation: f64) -> Image {
        let mut random = stream(seed, Purpose::Corruption, 1, 0, 0);
        let mut plane = || -> Vec<u8> {
            let pixels = (0..20).flat_map(|_| 0..width);
            pixels.map(|x| (level(x) + deviation * normal(&mut random)).round().clamp(0.0, 255.0) as u8).collect()
        };
        let planes = (0..channels).map(|_| plane()).collect();
        Image::from_planes(width, 20, planes).unwrap()
    }

    /// Weight, variance, means.
    type ReferenceComponent = (f64, f64, Vec<f64>);

    /// ReferenceMixture implementation in f64, with weights normalised in every frame.
    struct ReferenceMixture {
        pixels: Vec<Vec<ReferenceComponent>>,
        frames: u64,
    }

    impl ReferenceMixture {
        fn new(first: &Image) -> Self {
            let of = |i: usize| first.planes().iter().map(|plane| f64::from(plane[i])).collect::<Vec<_>>();
            let pixels = (0..first.planes()[0].len()).map(|i| vec![(1.0, 225.0, of(i))]).collect();
            Self { pixels, frames: 1 }
        }

        fn update(&mut self, image: &Image) -> Vec<bool> {
            self.frames += 1;
            let a = 0.005_f64.max(1.0 / self.frames as f64);
            let of_pixel = |(index, components): (usize, &mut Vec<ReferenceComponent>)| {
                let x: Vec<f64> = image.planes().iter().map(|plane| f64::from(plane[index])).collect();
                let squares =
                    |mean: &[f64]| x.iter().zip(mean).map(|(x, m)| (x - m).powi(2)).sum::<f64>() / x.len() as f64;
                let whole: f64 = components.iter().map(|c| c.0).sum();
                let matched = components.iter().position(|(_, variance, mean)| squares(mean) < 6.25 * variance);
                let before: f64 = components[..matched.unwrap_or(0)].iter().map(|c| c.0).sum();
                components.iter_mut().for_each(|c| c.0 *= 1.0 - a);
                match matched {
                    Some(i) => {
                        let square = squares(&components[i].2);
                        let (weight, variance, mean) = &mut components[i];
                        *weight += a;
                        let rho = (a / *weight).min(1.0);
                        *variance = (*variance + rho * (square - *variance)).max(1.0);
                        mean.iter_mut().zip(&x).for_each(|(mean, x)| *mean += rho * (x - *mean));
                    }
                    None => {
                        if components.len() == 3 {
                            components.pop();
                        }
                        components.push((0.05, 225.0, x.clone()));
                    }
                }
                components.sort_by(|p, q| (q.0 / q.1.sqrt()).total_cmp(&(p.0 / p.1.sqrt())));
                matched.is_none() || before > 0.7 * whole
            };
            self.pixels.iter_mut().enumerate().map(of_pixel).collect()
        }
    }

    #[test]
    fn the_foreground_agrees_with_the_reference_through_changes_of_the_background() {
        for (width, channels) in [(21, 3), (16, 1)] {
            let frame = |n: u64| {
                let level = move |x: u32| match (n, x) {
                    (40..60, 5..9) => 190.0,
                    (100.., 12..) => 80.0,
                    _ => 120.0,
                };
                noisy(width, channels, n, level, 3.0)
            };
            let mut model = OnlineBackground::new(&frame(0), OnlineSettings::default());
            let mut reference = ReferenceMixture::new(&frame(0));
            let mut differing = 0;
            for n in 1..400 {
                let (found, expected) = (model.update(&frame(n)).unwrap(), reference.update(&frame(n)));
                let is_set = |i: usize| found.get(i as u32 % width, i as u32 / width);
                differing += (0..expected.len()).filter(|i| is_set(*i) != expected[*i]).count();
                if n == 50 {
                    assert!((0..20).all(|y| (5..9).all(|x| found.get(x, y))), "a new object is foreground");
                }
                if n == 110 {
                    assert!(found.get(15, 5), "a changed background is foreground");
                }
                if n == 399 {
                    assert!(!found.get(15, 5), "it becomes background");
                }
            }
            // components are sorted only if a pixel of the group does not match its first component
            let all = 400 * width as usize * 20;
            assert!(differing * 500 < all, "{differing} of {all}");
        }
    }

    #[test]
    fn a_frame_of_another_size_is_refused_and_changes_nothing() {
        let mut model = OnlineBackground::new(&noisy(16, 3, 0, |_| 100.0, 2.0), OnlineSettings::default());
        assert!(model.update(&noisy(17, 3, 0, |_| 100.0, 2.0)).is_err());
        assert_eq!(model.frames, 1);
    }
}
