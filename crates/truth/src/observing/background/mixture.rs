//! The frozen mixture: one Gaussian per pixel for each background period.
//!
//! A pixel `x` is foreground iff `ln sum_i eta N(x; mu_i, Sigma_i) < -C ln 256 - ln risk`, with `eta = 1 / K`, `C`
//! channels, diagonal `Sigma_i`, and means and variances over the frames of period `i` (HumanEva's
//! `BackgroundSubtraction.m`, `[Sigal 2010]`). `256^-C` is the density of a foreground with uniformly distributed
//! colours; `risk` is the cost of a false alarm relative to a miss. Densities are compared as logarithms, because they
//! underflow. Variances are at least 1 grey value squared, the rounding of the image; less makes saturated pixels
//! flicker.
//!
//! Nearly all pixels are decided by [`CertainBounds`]; the masks are identical to those from densities alone.

use super::BackgroundError;
use super::bounds::{ALL, BLOCK, ByteLane, CertainBounds, Flags, PixelGaussian, bytes_of, count, to_bits};
use super::lanes::{LANES, PixelLane, groups_per_row, lane_of, put};
use crate::observing::Image;
use skiagraph_core::raster::Mask;
use skiagraph_core::simd::{Dispatched, dispatch};

/// Least variance of a channel, grey values squared.
const MIN_VARIANCE: f64 = 1.0;

/// Number of images of a component below which the noise of its pixels is hardly known.
pub const LEAST_BACKGROUND: usize = 5;

/// Variance where one image does not tell any: that of the full range, grey values squared.
const UNKNOWN_VARIANCE: f32 = 255.0 * 255.0;

/// Cost of a false alarm relative to a miss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Risk(pub f64);

impl Default for Risk {
    /// HumanEva's 1. Of grey images of a background with a deviation of 3 grey values, 3 in 100 pixels are false alarms
    /// then, which cleaning removes: with fewer (2 in 10,000 with 100) more of the body is missed than is gained.
    fn default() -> Self {
        Self(1.0)
    }
}

/// A background model that is learned once and not updated.
#[derive(Clone, Debug, PartialEq)]
pub struct BackgroundMixture {
    shape: (u32, u32, usize),
    components: usize,
    /// Number of images from which each component was learned.
    images: Vec<usize>,
    /// `[component][group]`: means of every channel, `1 / (2 variance)` of every channel, and the logarithm of the
    /// weighted density at the mean; each for eight pixels.
    blocks: Vec<Vec<PixelLane>>,
    /// Logarithm of the density below which a pixel is foreground.
    threshold: f32,
    bounds: CertainBounds,
}

impl BackgroundMixture {
    /// Learns one component from each period's images, all of one camera. Periods are consumed one at a time, so that
    /// only one needs to be in memory.
    pub fn learn<P: AsRef<[Image]>>(
        periods: impl ExactSizeIterator<Item = P>,
        risk: Risk,
    ) -> Result<Self, BackgroundError> {
        let components = periods.len();
        let (mut frames, mut known, mut images, mut blocks) = (0, None, Vec::new(), Vec::with_capacity(components));
        for period in periods {
            let period = period.as_ref();
            frames += period.len();
            let first = period.first().ok_or(BackgroundError::TooFew { frames, components })?;
            let shape = *known.get_or_insert(first.shape());
            if let Some(other) = period.iter().find(|image| image.shape() != shape) {
                return Err(BackgroundError::Shape { found: other.shape(), expected: shape });
            }
            images.push(period.len());
            blocks.push(component(period, shape, components));
        }
        let shape = known.ok_or(BackgroundError::TooFew { frames, components: 1 })?;
        Ok(Self::of_blocks(shape, images, blocks, risk))
    }

    // not generic: compiled once, in this crate
    fn of_blocks(shape: (u32, u32, usize), images: Vec<usize>, blocks: Vec<Vec<PixelLane>>, risk: Risk) -> Self {
        let components = blocks.len();
        let threshold = (-(shape.2 as f64) * 256_f64.ln() - risk.0.ln()) as f32;
        let (groups, channels) = (groups_per_row(shape.0), shape.2);
        let bounds = CertainBounds::new(shape, components, threshold, |component, x, y, look| {
            let first = (y as usize * groups + x as usize / LANES) * (2 * channels + 1);
            let at = |index: usize| blocks[component][first + index][x as usize % LANES];
            let [means, precisions] =
                [0, channels].map(|from| [0, 1, 2].map(|c: usize| at(from + c.min(channels - 1))));
            let (means, precisions) = (&means[..channels], &precisions[..channels]);
            look(PixelGaussian { means, precisions, at_mean: at(2 * channels) });
        });
        Self { shape, components, images, blocks, threshold, bounds }
    }

    /// The foreground of an image.
    pub fn foreground(&self, image: &Image) -> Result<Mask, BackgroundError> {
        if image.shape() != self.shape {
            return Err(BackgroundError::Shape { found: image.shape(), expected: self.shape });
        }
        let mut mask = Mask::new(self.shape.0, self.shape.1);
        match self.shape.2 {
            1 => dispatch(Classify::<1> { model: self, image, mask: &mut mask }),
            _ => dispatch(Classify::<3> { model: self, image, mask: &mut mask }),
        }
        Ok(mask)
    }

    /// Squared deviation of a pixel from the nearest component of the background, in standard deviations, summed over
    /// the channels. Its mean over pixels of the background is about the number of channels, less with several
    /// components.
    pub(super) fn squared_deviation(&self, image: &Image, x: u32, y: u32) -> f32 {
        let channels = self.shape.2;
        let group = y as usize * groups_per_row(self.shape.0) + x as usize / LANES;
        let at = y as usize * self.shape.0 as usize + x as usize;
        let of_component = |blocks: &Vec<PixelLane>| -> f32 {
            let block = &blocks[group * (2 * channels + 1)..];
            let of_channel = |channel: usize| {
                let off = f32::from(image.planes()[channel][at]) - block[channel][x as usize % LANES];
                2.0 * off * off * block[channels + channel][x as usize % LANES]
            };
            (0..channels).map(of_channel).sum()
        };
        self.blocks.iter().map(of_component).fold(f32::INFINITY, f32::min)
    }

    /// Each component at a pixel, by channel.
    pub(super) fn at(&self, x: u32, y: u32) -> impl Iterator<Item = Vec<ChannelMean>> + '_ {
        let channels = self.shape.2;
        let group = y as usize * groups_per_row(self.shape.0) + x as usize / LANES;
        self.blocks.iter().zip(&self.images).map(move |(blocks, images)| {
            let block = &blocks[group * (2 * channels + 1)..];
            let at = |index: usize| block[index][x as usize % LANES];
            let error_variance = |channel| match images {
                1 => UNKNOWN_VARIANCE,
                _ => 0.5 / at(channels + channel) / *images as f32,
            };
            (0..channels)
                .map(|channel| ChannelMean { mean: at(channel), error_variance: error_variance(channel) })
                .collect()
        })
    }
}

/// The mean of a component in one channel.
#[derive(Clone, Copy)]
pub(super) struct ChannelMean {
    /// Grey values.
    pub(super) mean: f32,
    /// Variance of its error, grey values squared.
    pub(super) error_variance: f32,
}

/// Means, precisions and weights of one period, by group.
fn component(period: &[Image], (width, height, channels): (u32, u32, usize), components: usize) -> Vec<PixelLane> {
    let (columns, groups) = (width as usize, groups_per_row(width));
    let mut blocks = vec![[0.0; LANES]; groups * height as usize * (2 * channels + 1)];
    let weight = -(components as f64).ln();
    for (y, x) in (0..height as usize).flat_map(|y| (0..columns).map(move |x| (y, x))) {
        let first = (y * groups + x / LANES) * (2 * channels + 1);
        let mut at_mean = weight;
        for channel in 0..channels {
            let (mean, variance) =
                moments(period.iter().map(|image| f64::from(image.planes()[channel][y * columns + x])));
            let variance = variance.max(MIN_VARIANCE);
            blocks[first + channel][x % LANES] = mean as f32;
            blocks[first + channels + channel][x % LANES] = (0.5 / variance) as f32;
            at_mean -= 0.5 * (std::f64::consts::TAU * variance).ln();
        }
        blocks[first + 2 * channels][x % LANES] = at_mean as f32;
    }
    blocks
}

/// Mean and unbiased variance by Welford's recurrence; a single value has variance 0.
fn moments(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut count, mut mean, mut squares) = (0.0, 0.0, 0.0);
    for value in values {
        count += 1.0;
        let off = value - mean;
        mean += off / count;
        squares += off * (value - mean);
    }
    (mean, if count > 1.0 { squares / (count - 1.0) } else { 0.0 })
}

struct Classify<'a, const CHANNELS: usize> {
    model: &'a BackgroundMixture,
    image: &'a Image,
    mask: &'a mut Mask,
}

impl<const CHANNELS: usize> Dispatched for Classify<'_, CHANNELS> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { model, image, mask } = self;
        let (width, groups) = (image.width() as usize, groups_per_row(image.width()));
        // the component that explained the last block is tried first: if it explains all pixels, the others are not
        // needed
        let mut likely = 0;
        for y in 0..image.height() as usize {
            let rows: [&[u8]; CHANNELS] = std::array::from_fn(|c| &image.planes()[c][y * width..(y + 1) * width]);
            for column in 0..model.bounds.per_row {
                let block = y * model.bounds.per_row + column;
                let pixels: [ByteLane; CHANNELS] = std::array::from_fn(|c| bytes_of(rows[c], column));
                let background = model.bounds.explained(likely, block, &pixels);
                if background == ALL {
                    continue;
                }
                let (background, best) = explained_by_any(model, block, &pixels, background, likely);
                likely = best;
                if background == ALL {
                    continue;
                }
                let (background, certain) = (to_bits(&background), to_bits(&excluded_by_all(model, block, &pixels)));
                for eight in 0..BLOCK / LANES {
                    let byte = |bits: u32| (bits >> (eight * LANES)) as u8;
                    let (mut bits, open) = (byte(certain), !byte(background | certain));
                    let group = column * (BLOCK / LANES) + eight;
                    if open != 0 {
                        let pixels = std::array::from_fn(|c| lane_of(rows[c], group));
                        let first = (y * groups + group) * (2 * CHANNELS + 1);
                        bits |= open & decide::<CHANNELS>(model, first, &pixels);
                    }
                    if bits != 0 {
                        put(mask, y as u32, group, bits);
                    }
                }
            }
        }
    }
}

/// The pixels of a block certainly explained by any component, where `known` are those explained by component `likely`;
/// and the component that explains most of them.
#[inline(always)]
fn explained_by_any<const CHANNELS: usize>(
    model: &BackgroundMixture,
    block: usize,
    pixels: &[ByteLane; CHANNELS],
    known: Flags,
    likely: usize,
) -> (Flags, usize) {
    let (mut any, mut best, mut most) = (known, likely, count(&known));
    for component in (0..model.components).filter(|component| *component != likely) {
        let explained = model.bounds.explained(component, block, pixels);
        for (any, explained) in any.iter_mut().zip(&explained) {
            *any |= explained;
        }
        if count(&explained) > most {
            (best, most) = (component, count(&explained));
        }
    }
    (any, best)
}

/// The pixels of a block that are certainly foreground.
#[inline(always)]
fn excluded_by_all<const CHANNELS: usize>(
    model: &BackgroundMixture,
    block: usize,
    pixels: &[ByteLane; CHANNELS],
) -> Flags {
    let mut all = ALL;
    for component in 0..model.components {
        for (all, excluded) in all.iter_mut().zip(model.bounds.excluded(component, block, pixels)) {
            *all &= excluded;
        }
    }
    all
}

/// Logarithm of the weighted density of one component at eight pixels.
#[inline(always)]
fn log_density<const CHANNELS: usize>(block: &[PixelLane], pixels: &[PixelLane; CHANNELS]) -> PixelLane {
    let mut score = block[2 * CHANNELS];
    for channel in 0..CHANNELS {
        let (mean, precision, pixel) = (&block[channel], &block[CHANNELS + channel], &pixels[channel]);
        for lane in 0..LANES {
            let off = pixel[lane] - mean[lane];
            score[lane] -= off * off * precision[lane];
        }
    }
    score
}

/// The foreground among eight pixels.
#[inline(always)]
fn decide<const CHANNELS: usize>(model: &BackgroundMixture, first: usize, pixels: &[PixelLane; CHANNELS]) -> u8 {
    let mut largest = [f32::NEG_INFINITY; LANES];
    for blocks in &model.blocks {
        let score = log_density(&blocks[first..first + 2 * CHANNELS + 1], pixels);
        for (largest, score) in largest.iter_mut().zip(score) {
            *largest = if score > *largest { score } else { *largest };
        }
    }
    // the sum is between the largest density and K times that
    let certainly_below = model.threshold - (model.components as f32).ln();
    let mut bits = 0;
    for (lane, &largest) in largest.iter().enumerate() {
        let is_foreground =
            largest < certainly_below || (largest < model.threshold && sum_is_below(model, first, pixels, lane));
        bits |= u8::from(is_foreground) << lane;
    }
    bits
}

/// Whether the sum of all components' densities is below the threshold.
fn sum_is_below<const CHANNELS: usize>(
    model: &BackgroundMixture,
    first: usize,
    pixels: &[PixelLane; CHANNELS],
    lane: usize,
) -> bool {
    let scores = model
        .blocks
        .iter()
        .map(|blocks| f64::from(log_density(&blocks[first..first + 2 * CHANNELS + 1], pixels)[lane]));
    let threshold = f64::from(model.threshold);
    scores.map(|score| (score - threshold).exp()).sum::<f64>() < 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use skiagraph_core::rng::{Purpose, normal, stream};

    /// Noise about a level that may vary between pixels.
    fn noisy(shape: (u32, u32, usize), seed: u64, level: impl Fn(usize) -> f64, deviation: f64) -> Image {
        let mut random = stream(seed, Purpose::Corruption, 0, 0, 0);
        let mut plane = || -> Vec<u8> {
            let pixels = (shape.0 * shape.1) as usize;
            (0..pixels).map(|i| (level(i) + deviation * normal(&mut random)).round().clamp(0.0, 255.0) as u8).collect()
        };
        let planes = (0..shape.2).map(|_| plane()).collect();
        Image::from_planes(shape.0, shape.1, planes).unwrap()
    }

    fn periods(shape: (u32, u32, usize), levels: [f64; 3], deviation: f64) -> Vec<Vec<Image>> {
        let of = |(period, level): (usize, f64)| {
            (0..30).map(|i| noisy(shape, 100 * period as u64 + i, |_| level, deviation)).collect()
        };
        levels.into_iter().enumerate().map(of).collect()
    }

    fn learned(shape: (u32, u32, usize), levels: [f64; 3], deviation: f64, risk: Risk) -> BackgroundMixture {
        let periods = periods(shape, levels, deviation);
        BackgroundMixture::learn(periods.iter(), risk).unwrap()
    }

    /// The definition, in f64.
    fn by_definition(periods: &[Vec<Image>], image: &Image, risk: f64) -> Mask {
        let (width, height, channels) = image.shape();
        Mask::from_fn(width, height, |x, y| {
            let index = (y * width + x) as usize;
            let density = |period: &Vec<Image>| -> f64 {
                let of_channel = |c: usize| {
                    let (mean, variance) = moments(period.iter().map(|i| f64::from(i.planes()[c][index])));
                    let (variance, off) = (variance.max(1.0), f64::from(image.planes()[c][index]) - mean);
                    (-0.5 * off * off / variance).exp() / (std::f64::consts::TAU * variance).sqrt()
                };
                (0..channels).map(of_channel).product()
            };
            let sum: f64 = periods.iter().map(density).sum::<f64>() / periods.len() as f64;
            sum < 256_f64.powi(-(channels as i32)) / risk
        })
    }

    #[test]
    fn the_foreground_follows_the_definition_for_any_width_and_number_of_channels() {
        for (width, channels) in [(67, 3), (64, 1), (5, 3)] {
            let shape = (width, 40, channels);
            let periods = periods(shape, [100.0, 112.0, 90.0], 3.0);
            let model = BackgroundMixture::learn(periods.iter(), Risk(2.0)).unwrap();
            // a gradient through the background and beyond it on both sides
            let image = noisy(shape, 77, |i| 60.0 + 90.0 * (i % width as usize) as f64 / f64::from(width), 4.0);
            let (found, expected) = (model.foreground(&image).unwrap(), by_definition(&periods, &image, 2.0));
            let differing = expected.count() + found.count() - 2 * expected.count_common(&found);
            assert!(expected.count() > 40 && expected.count() < u64::from(width) * 40 - 20, "{}", expected.count());
            assert!(differing <= 1, "{differing} pixels at the threshold, more than f32 rounding explains");
        }
    }

    #[test]
    fn masks_equal_those_from_densities_alone_for_unusual_backgrounds() {
        // deviations from zero to a fifth of all grey values, saturated pixels, components near each other and far
        // apart
        for (seed, (width, channels, risk)) in (0..).zip([(70, 3, 1.0), (64, 1, 100.0), (33, 3, 1e-4), (5, 1, 1e6)]) {
            let deviation = |i: usize| [0.0, 0.5, 2.0, 3.0, 5.0, 9.0, 20.0, 45.0][i % 8];
            let image = |period: u64, number: u64| {
                let shift = [0.0, 4.0, -30.0][period as usize];
                let mut random = stream(seed, Purpose::Corruption, period, number, 0);
                let mut value = |i: usize| {
                    let level = (i * 37 % 300) as f64 - 20.0 + shift;
                    (level + deviation(i) * normal(&mut random)).round().clamp(0.0, 255.0) as u8
                };
                let planes = (0..channels).map(|_| (0..width as usize * 48).map(&mut value).collect());
                Image::from_planes(width, 48, planes.collect()).unwrap()
            };
            let periods = [0, 1, 2].map(|period| (0..12).map(|number| image(period, number)).collect::<Vec<_>>());
            let model = BackgroundMixture::learn(periods.iter(), Risk(risk)).unwrap();
            let mut foreground = 0;
            for (number, spread) in (0..12).zip([0.0, 2.0, 4.0, 8.0, 16.0, 60.0].into_iter().cycle()) {
                let mut random = stream(seed, Purpose::Corruption, 9, number, 0);
                let mut other = |value: &u8| (f64::from(*value) + spread * normal(&mut random)).round() as u8;
                let planes = periods[number as usize % 3][0].planes();
                let planes = planes.iter().map(|plane| plane.iter().map(&mut other).collect());
                let image = Image::from_planes(width, 48, planes.collect()).unwrap();
                let found = model.foreground(&image).unwrap();
                foreground += found.count();
                assert_eq!(found, by_densities(&model, &image));
            }
            assert!(foreground > 20 && foreground < 11 * 48 * u64::from(width), "{foreground}");
        }
    }

    /// The foreground from densities alone, without bounds.
    fn by_densities(model: &BackgroundMixture, image: &Image) -> Mask {
        let (width, height, channels) = image.shape();
        let mut mask = Mask::new(width, height);
        for (y, group) in (0..height).flat_map(|y| (0..groups_per_row(width)).map(move |group| (y, group))) {
            let row = |c: usize| &image.planes()[c][(y * width) as usize..((y + 1) * width) as usize];
            let first = (y as usize * groups_per_row(width) + group) * (2 * channels + 1);
            let bits = match channels {
                1 => decide::<1>(model, first, &[lane_of(row(0), group)]),
                _ => decide::<3>(model, first, &[0, 1, 2].map(|c| lane_of(row(c), group))),
            };
            put(&mut mask, y, group, bits);
        }
        mask
    }

    #[test]
    fn every_period_is_background_with_the_computed_rate_of_false_alarms() {
        for (channels, risk, expected) in [(3, Risk(1.0), 4e-4), (1, Risk(1.0), 0.03), (1, Risk(100.0), 4e-4)] {
            let shape = (320, 240, channels);
            let model = learned(shape, [100.0, 130.0, 70.0], 3.0, risk);
            for level in [100.0, 130.0, 70.0] {
                let share = model.foreground(&noisy(shape, 999, |_| level, 3.0)).unwrap().count() as f64 / 76_800.0;
                // 30 frames estimate the variance to within a quarter, which makes tails heavier
                assert!(share < 6.0 * expected && share > 0.2 * expected, "{channels} channels: {share}, {expected}");
            }
        }
    }

    #[test]
    fn too_few_frames_and_frames_of_another_size_are_refused() {
        let image = noisy((8, 8, 3), 1, |_| 50.0, 1.0);
        let other = noisy((9, 8, 3), 1, |_| 50.0, 1.0);
        let some = vec![image.clone()];
        let learn = |periods: &[&[Image]]| BackgroundMixture::learn(periods.iter(), Risk(1.0));
        let refused = learn(&[&some, &[]]).unwrap_err();
        assert!(refused.to_string().starts_with("1 background frame(s) for 2 component(s)"), "{refused}");
        assert!(learn(&[]).is_err());
        let mixed = vec![image, other.clone()];
        let refused = learn(&[&mixed]).unwrap_err();
        assert!(refused.to_string().starts_with("9 x 8 pixels with 3 channel(s), expected 8 x 8 with 3"), "{refused}");
        assert!(learn(&[&some]).unwrap().foreground(&other).is_err());
    }

    #[test]
    fn moments_follow_the_definition() {
        let mut random = stream(1, Purpose::Corruption, 0, 0, 0);
        let values: Vec<f64> = (0..50).map(|_| 200.0 + random.random::<f64>()).collect();
        let mean = values.iter().sum::<f64>() / 50.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 49.0;
        let found = moments(values.iter().copied());
        assert!((found.0 - mean).abs() < 1e-12 && (found.1 - variance).abs() < 1e-12);
        assert_eq!(moments([3.0].into_iter()), (3.0, 0.0));
    }
}
