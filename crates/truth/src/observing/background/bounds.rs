//! Pixels that a frozen mixture surely calls background or foreground, found with small whole numbers.
//!
//! A pixel is background where one component alone explains it: where `sum_c ((x_c - mu_c) / sigma_c)^2 <= T`, with `T`
//! twice what its logarithmic density at the mean has above the threshold. Each mean is rounded to a grey value and
//! each `1 / (sigma_c sqrt(T))` up to a small whole number, and what that loses is added to the distance: so sums below
//! the limit say *surely background*. With distances and weights rounded the other way, sums above a higher limit for
//! all components say *surely foreground*. Pixels in between, one in a thousand, are left to the densities themselves.
//! Twice a channel a byte, in place of two floats and one more, is what makes it fast: memory is what it waits for.

/// Pixels of a block.
pub(super) const BLOCK: usize = 32;

/// A value for every pixel of a block.
pub(super) type ByteLane = [u8; BLOCK];

/// What is known of each pixel of a block: a byte each, 1 for yes.
pub(super) type Flags = [u64; BLOCK / 8];

/// All pixels of a block.
pub(super) const ALL: Flags = [0x0101_0101_0101_0101; BLOCK / 8];

/// The limit of the distance, `sqrt(T)`, in scaled units.
const UNIT: u16 = 80;

/// Sixteenths of a scaled unit are what weights count, for distances in half grey values.
const SHIFT: u32 = 4;

/// A scaled distance counts as at most this much: three squares of it are a sum of 16 bits.
const MOST: u16 = 147;

/// Greatest difference in grey values that is told from greater ones.
const FARTHEST: u8 = 127;

/// Least weight, with which [`FARTHEST`] is beyond the limit.
const LEAST_WEIGHT: f64 = 6.0;

/// Least `T` of a component; a lower one, of variances in hundreds, is left to densities.
const LEAST_SLACK: f64 = 4.0;

/// What the rounding of densities in single precision may amount to, generously.
const ROUNDING: f64 = 1e-3;

/// Bounds of every pixel and component.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CertainBounds {
    /// `[component][block]`, blocks row by row: rounded means of every channel, then weights; a weight of 0 leaves the
    /// pixel to its density.
    blocks: Vec<Vec<ByteLane>>,
    channels: usize,
    per_row: usize,
    /// Sums above it say that no component explains a pixel.
    outside: u16,
}

/// One component at one pixel, as its density is computed.
pub(super) struct PixelGaussian<'a> {
    pub(super) means: &'a [f32],
    /// `1 / (2 variance)`.
    pub(super) precisions: &'a [f32],
    /// Logarithm of the weighted density at the mean.
    pub(super) at_mean: f32,
}

impl PixelGaussian<'_> {
    /// `T`, and the weight of every channel; `None` where it is left to its density.
    fn weights(&self, threshold: f32) -> Option<(f64, impl Iterator<Item = u8>)> {
        let slack = 2.0 * (f64::from(self.at_mean) - f64::from(threshold));
        let scale = 0.5 * f64::from(UNIT << SHIFT);
        let weight = move |precision: &f32| (scale * (2.0 * f64::from(*precision) / (slack - ROUNDING)).sqrt()).ceil();
        let fits = slack >= LEAST_SLACK
            && self.precisions.iter().all(|p| (LEAST_WEIGHT..=f64::from(u8::MAX)).contains(&weight(p)));
        fits.then(|| (slack, self.precisions.iter().map(move |precision| weight(precision) as u8)))
    }
}

impl CertainBounds {
    /// Of images of that width, height and number of channels. `visit(component, x, y, look)` calls `look` with the
    /// component at a pixel.
    pub(super) fn new(
        (width, height, channels): (u32, u32, usize),
        components: usize,
        threshold: f32,
        visit: impl Fn(usize, u32, u32, &mut dyn FnMut(PixelGaussian<'_>)),
    ) -> Self {
        let per_row = (width as usize).div_ceil(BLOCK);
        // beyond the right edge everything is background
        let beyond = [[0; BLOCK], [LEAST_WEIGHT as u8; BLOCK]].map(|lane| vec![lane; channels]).concat();
        let empty = beyond.repeat(per_row * height as usize);
        let (mut blocks, mut ratio) = (vec![empty; components], 1.0_f64);
        // all densities together are at most K times the greatest
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

    /// Number of blocks in a row.
    pub(super) fn per_row(&self) -> usize {
        self.per_row
    }

    #[inline(always)]
    fn block<const CHANNELS: usize>(&self, component: usize, block: usize) -> [&[ByteLane; CHANNELS]; 2] {
        let lanes = &self.blocks[component][2 * self.channels * block..];
        let part = |from: usize| lanes[from..].first_chunk().unwrap_or(&[[0; BLOCK]; CHANNELS]);
        [part(0), part(CHANNELS)]
    }

    /// The pixels of a block that a component surely explains.
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
                let off = u16::from(centres[c][i].abs_diff(pixels[c][i]).min(FARTHEST));
                let scaled = ((2 * off + 1) * u16::from(weights[c][i]) + (1 << SHIFT) - 1) >> SHIFT;
                sum += scaled.min(MOST) * scaled.min(MOST);
            }
            // without weights the sum is 0, else never
            *flag = u8::from(sum.wrapping_sub(1) < UNIT * UNIT);
        }
        packed(&flags)
    }

    /// The pixels of a block that a component surely does not explain, nor all together if that holds for each.
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
                let off = u16::from(centres[c][i].abs_diff(pixels[c][i]).min(FARTHEST));
                let weight = u16::from(weights[c][i].saturating_sub(1));
                let scaled = ((2 * off).saturating_sub(1) * weight) >> SHIFT;
                sum += scaled.min(MOST) * scaled.min(MOST);
            }
            *flag = u8::from(sum > self.outside);
        }
        packed(&flags)
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
fn packed(flags: &[u8; BLOCK]) -> Flags {
    let mut words = [0; BLOCK / 8];
    for (word, eight) in words.iter_mut().zip(flags.as_chunks().0) {
        *word = u64::from_le_bytes(*eight);
    }
    words
}

/// A bit for every pixel, the first in the lowest.
#[inline(always)]
pub(super) fn to_bits(flags: &Flags) -> u32 {
    // the product brings the lowest bits of eight bytes together in the highest byte
    let bits = |word: &u64| (word.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u32;
    flags.iter().rev().fold(0, |all, word| all << 8 | bits(word))
}

/// How many pixels.
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
            let flags = packed(&std::array::from_fn(|i| (pattern >> i & 1) as u8));
            assert_eq!((to_bits(&flags), count(&flags)), (pattern, pattern.count_ones()));
        }
        assert_eq!(to_bits(&ALL), u32::MAX);
        assert_eq!(bytes_of(&[7; 40], 1), std::array::from_fn(|i| if i < 8 { 7 } else { 0 }));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        /// What is sure is true of densities in f32, by their definition.
        #[test]
        fn what_is_sure_is_what_the_density_says(
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
