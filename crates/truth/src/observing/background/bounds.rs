//! Classifies the pixels that are certainly background or foreground under a frozen mixture, with small integers.
//!
//! A pixel is background if a single component explains it: if `sum_c ((x_c - mu_c) / sigma_c)^2 <= T`, where `T` is
//! twice the difference between the component's log density at the mean and the threshold. Means are rounded to grey
//! values and each `1 / (sigma_c sqrt(T))` is rounded up to a small integer; the rounding errors are added to the
//! distance, so that sums below the limit are *certainly background*. With distances and weights rounded the other way,
//! sums above a higher limit for all components are *certainly foreground*. The remaining pixels, one in a thousand,
//! are decided by their densities. Using two bytes per channel instead of two floats (and one more) makes this fast,
//! since it is limited by memory bandwidth.

/// Pixels per block.
pub(super) const BLOCK: usize = 32;

/// A value for every pixel of a block.
pub(super) type ByteLane = [u8; BLOCK];

/// A flag for each pixel of a block: one byte each, 0 or 1.
pub(super) type Flags = [u64; BLOCK / 8];

/// The flags of all pixels set.
pub(super) const ALL: Flags = [0x0101_0101_0101_0101; BLOCK / 8];

/// The limit of the distance, `sqrt(T)`, in scaled units.
const UNIT: u16 = 80;

/// Weights are in sixteenths of a scaled unit, for distances in half grey values.
const SHIFT: u32 = 4;

/// Upper bound of a scaled distance: the sum of three of its squares fits into 16 bits.
const MAX_SCALED: u16 = 147;

/// Larger differences in grey values are clamped to this.
const MAX_DIFFERENCE: u8 = 127;

/// Least weight, for which [`MAX_DIFFERENCE`] is beyond the limit.
const MIN_WEIGHT: f64 = 6.0;

/// Least `T` of a component; lower ones, for variances in the hundreds, are decided by densities.
const MIN_SLACK: f64 = 4.0;

/// Generous bound on the rounding error of densities in single precision.
const ROUNDING: f64 = 1e-3;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct CertainBounds {
    /// `[component][block]`, blocks row by row: rounded means of every channel, then weights; pixels with weight 0 are
    /// decided by their density.
    blocks: Vec<Vec<ByteLane>>,
    channels: usize,
    pub(super) per_row: usize,
    /// Limit above which a sum means that a component does not explain a pixel.
    outside: u16,
}

/// One component at one pixel, with the parameters of its density.
pub(super) struct PixelGaussian<'a> {
    pub(super) means: &'a [f32],
    /// `1 / (2 variance)`.
    pub(super) precisions: &'a [f32],
    /// Logarithm of the weighted density at the mean.
    pub(super) at_mean: f32,
}

impl PixelGaussian<'_> {
    /// `T`, and the weight of every channel; `None` if the pixel is decided by its density.
    fn weights(&self, threshold: f32) -> Option<(f64, impl Iterator<Item = u8>)> {
        let slack = 2.0 * (f64::from(self.at_mean) - f64::from(threshold));
        let scale = 0.5 * f64::from(UNIT << SHIFT);
        let weight = move |precision: &f32| (scale * (2.0 * f64::from(*precision) / (slack - ROUNDING)).sqrt()).ceil();
        let fits = slack >= MIN_SLACK
            && self.precisions.iter().all(|p| (MIN_WEIGHT..=f64::from(u8::MAX)).contains(&weight(p)));
        fits.then(|| (slack, self.precisions.iter().map(move |precision| weight(precision) as u8)))
    }
}

impl CertainBounds {
    /// Bounds for images of the given width, height and number of channels. `visit(component, x, y, look)` calls `look`
    /// with the component at a pixel.
    pub(super) fn new(
        (width, height, channels): (u32, u32, usize),
        components: usize,
        threshold: f32,
        visit: impl Fn(usize, u32, u32, &mut dyn FnMut(PixelGaussian<'_>)),
    ) -> Self {
        let per_row = (width as usize).div_ceil(BLOCK);
        // pixels beyond the right edge are background
        let beyond = [[0; BLOCK], [MIN_WEIGHT as u8; BLOCK]].map(|lane| vec![lane; channels]).concat();
        let empty = beyond.repeat(per_row * height as usize);
        let (mut blocks, mut ratio) = (vec![empty; components], 1.0_f64);
        // the sum of the densities is at most K times the largest
        let more = 2.0 * (components as f64).ln() + ROUNDING;
        for (component, lanes) in blocks.iter_mut().enumerate() {
            for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                let first = (y as usize * per_row + x as usize / BLOCK) * 2 * channels;
                let (centres, weights) = lanes[first..first + 2 * channels].split_at_mut(channels);
                let lane = x as usize % BLOCK;
                visit(component, x, y, &mut |gaussian| {
                    weights.iter_mut().for_each(|weight| weight[lane] = 0);
                    let Some((slack, found)) = gaussian.weights(threshold) else { return };
                    ratio = ratio.max((slack + more) / (slack - ROUNDING));
                    weights.iter_mut().zip(found).for_each(|(weight, found)| weight[lane] = found);
                    centres.iter_mut().zip(gaussian.means).for_each(|(centre, mean)| centre[lane] = mean.round() as u8);
                });
            }
        }
        let outside = (f64::from(UNIT * UNIT) * ratio).ceil() as u16;
        Self { blocks, channels, per_row, outside }
    }

    #[inline(always)]
    fn block<const CHANNELS: usize>(&self, component: usize, block: usize) -> [&[ByteLane; CHANNELS]; 2] {
        let lanes = &self.blocks[component][2 * self.channels * block..];
        let part = |from: usize| lanes[from..].first_chunk().unwrap_or(&[[0; BLOCK]; CHANNELS]);
        [part(0), part(CHANNELS)]
    }

    /// The pixels of a block that a component certainly explains.
    #[inline(always)]
    pub(super) fn explained<const CHANNELS: usize>(
        &self,
        component: usize,
        block: usize,
        pixels: &[ByteLane; CHANNELS],
    ) -> Flags {
        let [centres, weights] = self.block::<CHANNELS>(component, block);
        let mut flags = [0; BLOCK];
        for (i, flag) in flags.iter_mut().enumerate() {
            let mut sum = 0;
            for c in 0..CHANNELS {
                let difference = u16::from(centres[c][i].abs_diff(pixels[c][i]).min(MAX_DIFFERENCE));
                let scaled = ((2 * difference + 1) * u16::from(weights[c][i]) + (1 << SHIFT) - 1) >> SHIFT;
                sum += scaled.min(MAX_SCALED) * scaled.min(MAX_SCALED);
            }
            // the sum is 0 only without weights
            *flag = u8::from(sum.wrapping_sub(1) < UNIT * UNIT);
        }
        pack(&flags)
    }

    /// The pixels of a block that a component certainly does not explain. If this holds for every component, the
    /// mixture does not explain them either.
    #[inline(always)]
    pub(super) fn excluded<const CHANNELS: usize>(
        &self,
        component: usize,
        block: usize,
        pixels: &[ByteLane; CHANNELS],
    ) -> Flags {
        let [centres, weights] = self.block::<CHANNELS>(component, block);
        let mut flags = [0; BLOCK];
        for (i, flag) in flags.iter_mut().enumerate() {
            let mut sum = 0;
            for c in 0..CHANNELS {
                let difference = u16::from(centres[c][i].abs_diff(pixels[c][i]).min(MAX_DIFFERENCE));
                let weight = u16::from(weights[c][i].saturating_sub(1));
                let scaled = ((2 * difference).saturating_sub(1) * weight) >> SHIFT;
                sum += scaled.min(MAX_SCALED) * scaled.min(MAX_SCALED);
            }
            *flag = u8::from(sum > self.outside);
        }
        pack(&flags)
    }
}

/// The values of block `block` of a row; 0 beyond its end.
#[inline(always)]
pub(super) fn bytes_of(row: &[u8], block: usize) -> ByteLane {
    let rest = &row[block * BLOCK..];
    match rest.first_chunk() {
        Some(values) => *values,
        None => std::array::from_fn(|i| rest.get(i).copied().unwrap_or(0)),
    }
}

#[inline(always)]
fn pack(flags: &[u8; BLOCK]) -> Flags {
    let mut words = [0; BLOCK / 8];
    for (word, eight) in words.iter_mut().zip(flags.as_chunks().0) {
        *word = u64::from_le_bytes(*eight);
    }
    words
}

/// One bit per pixel, the first pixel in the lowest bit.
#[inline(always)]
pub(super) fn to_bits(flags: &Flags) -> u32 {
    // the product collects the lowest bits of eight bytes in the highest byte
    let bits = |word: &u64| (word.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u32;
    flags.iter().rev().fold(0, |all, word| all << 8 | bits(word))
}

#[inline(always)]
pub(super) fn count(flags: &Flags) -> u32 {
    flags.iter().map(|word| word.count_ones()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn flags_become_bits_in_order() {
        for pattern in [0_u32, 1, 0x8000_0000, 0xdead_beef, u32::MAX] {
            let flags = pack(&std::array::from_fn(|i| (pattern >> i & 1) as u8));
            assert_eq!((to_bits(&flags), count(&flags)), (pattern, pattern.count_ones()));
        }
        assert_eq!(to_bits(&ALL), u32::MAX);
        assert_eq!(bytes_of(&[7; 40], 1), std::array::from_fn(|i| if i < 8 { 7 } else { 0 }));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        /// Certain decisions agree with densities in f32 by definition.
        #[test]
        fn certain_decisions_agree_with_the_density(
            means in prop::array::uniform3(0.0..255.0_f32),
            deviations in prop::array::uniform3(prop_oneof![1.0..6.0_f64, 1.0..120.0_f64]),
            threshold in -25.0..-8.0_f32,
            near in prop::collection::vec(prop::array::uniform3(-7.0..7.0_f64), 32),
            components in 1_usize..5,
        ) {
            let precisions = deviations.map(|d| (0.5 / (d * d)) as f32);
            let normal: f64 = deviations.iter().map(|d| -0.5 * (std::f64::consts::TAU * d * d).ln()).sum();
            let at_mean = (normal - (components as f64).ln()) as f32;
            let bounds = CertainBounds::new((32, 1, 3), components, threshold, |_, _, _, look| {
                look(PixelGaussian { means: &means, precisions: &precisions, at_mean });
            });
            let at = |i: usize, c: usize| (f64::from(means[c]) + near[i][c] * deviations[c]).round() as u8;
            let pixels: [ByteLane; 3] = std::array::from_fn(|c| std::array::from_fn(|i| at(i, c)));
            let explained = to_bits(&bounds.explained(0, 0, &pixels));
            let excluded = to_bits(&bounds.excluded(0, 0, &pixels));
            let score_of = |i: usize| (0..3).fold(at_mean, |score, c| {
                let off = f32::from(pixels[c][i]) - means[c];
                score - off * off * precisions[c]
            });
            for i in 0..BLOCK {
                let score = score_of(i);
                let is = |bits: u32| bits >> i & 1 == 1;
                prop_assert!(!is(explained) || score >= threshold, "{score} is below {threshold}");
                prop_assert!(!is(excluded) || score < threshold - (components as f32).ln(), "{score}, {threshold}");
            }
        }
    }
}
