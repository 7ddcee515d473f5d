//! A bit-packed binary image.

use std::ops::{BitAndAssign, BitOrAssign, BitXorAssign, Range};

use super::PixelBounds;
use crate::simd::{Dispatched, dispatch};

/// A binary image, one bit per pixel, rows padded to whole 64-bit words; padding bits are always zero.
///
/// Pixel `(x, y)` has its centre at `(x + 0.5, y + 0.5)` and is bit `x % 64` (least significant first) of word `x /
/// 64` of row `y`. Pixels outside the image are unset; this defines operations on masks of different sizes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    width: u32,
    height: u32,
    words_per_row: usize,
    words: Vec<u64>,
}

impl Mask {
    /// An empty mask of `width` x `height` pixels.
    pub fn new(width: u32, height: u32) -> Self {
        let words_per_row = (width as usize).div_ceil(64);
        Self { width, height, words_per_row, words: vec![0; words_per_row * height as usize] }
    }

    /// The mask of the pixels `(x, y)` for which `is_set` is true.
    pub fn from_fn(width: u32, height: u32, mut is_set: impl FnMut(u32, u32) -> bool) -> Self {
        let mut mask = Self::new(width, height);
        for y in 0..height {
            for x in 0..width {
                mask.set(x, y, is_set(x, y));
            }
        }
        mask
    }

    /// Width in pixels.
    #[inline]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    #[inline]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Whether pixel `(x, y)` is set; false outside the image.
    #[inline]
    pub fn get(&self, x: u32, y: u32) -> bool {
        x < self.width
            && y < self.height
            && self.words[y as usize * self.words_per_row + (x / 64) as usize] >> (x % 64) & 1 == 1
    }

    /// Sets or clears pixel `(x, y)`; ignored outside the image.
    #[inline]
    pub fn set(&mut self, x: u32, y: u32, value: bool) {
        if x >= self.width || y >= self.height {
            return;
        }
        let word = &mut self.words[y as usize * self.words_per_row + (x / 64) as usize];
        let bit = 1_u64 << (x % 64);
        if value { *word |= bit } else { *word &= !bit }
    }

    /// Sets the pixels `x0..x1` of row `y` that are in the image.
    #[inline]
    pub fn fill_span(&mut self, y: u32, x0: u32, x1: u32) {
        let x1 = x1.min(self.width);
        if y >= self.height || x0 >= x1 {
            return;
        }
        let (first, last) = ((x0 / 64) as usize, ((x1 - 1) / 64) as usize);
        let head = u64::MAX << (x0 % 64);
        let tail = u64::MAX >> (63 - (x1 - 1) % 64);
        let row = self.row_mut(y);
        if first == last {
            row[first] |= head & tail;
        } else {
            row[first] |= head;
            row[first + 1..last].fill(u64::MAX);
            row[last] |= tail;
        }
    }

    /// Number of set pixels.
    pub fn count(&self) -> u64 {
        dispatch(CommonBits(&self.words, &self.words))
    }

    /// Number of pixels set in both masks.
    pub fn count_common(&self, other: &Self) -> u64 {
        if self.words_per_row == other.words_per_row {
            return dispatch(CommonBits(&self.words, &other.words));
        }
        self.rows().zip(other.rows()).map(|(row, other)| dispatch(CommonBits(row, other))).sum()
    }

    /// Whether no pixel is set.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|&w| w == 0)
    }

    /// The smallest rectangle that contains every set pixel.
    pub fn bounds(&self) -> PixelBounds {
        let mut bounds = PixelBounds::default();
        let mut columns = vec![0_u64; self.words_per_row];
        for (y, row) in (0..).zip(self.rows()) {
            let mut any = 0;
            for (column, word) in columns.iter_mut().zip(row) {
                *column |= word;
                any |= word;
            }
            if any != 0 {
                bounds.top = if bounds.bottom == 0 { y } else { bounds.top };
                bounds.bottom = y + 1;
            }
        }
        for (base, word) in (0..).step_by(64).zip(columns).filter(|(_, word)| *word != 0) {
            bounds.left = if bounds.right == 0 { base + word.trailing_zeros() } else { bounds.left };
            bounds.right = base + 64 - word.leading_zeros();
        }
        bounds
    }

    /// The set pixels `(x, y)`, row by row from the left.
    #[inline]
    pub fn pixels(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        (0..).zip(self.rows()).flat_map(|(y, row)| {
            (0..).step_by(64).zip(row).flat_map(move |(base, &word)| set_bits(word).map(move |bit| (base + bit, y)))
        })
    }

    /// The maximal runs of set pixels in row `y`, from the left.
    #[inline]
    pub fn runs(&self, y: u32) -> impl Iterator<Item = Range<u32>> + '_ {
        let mut x = 0;
        std::iter::from_fn(move || {
            let start = self.next_in_row(y, x, 0);
            if start >= self.width {
                return None;
            }
            x = self.next_in_row(y, start, u64::MAX).min(self.width);
            Some(start..x)
        })
    }

    /// The first pixel at or after `x` in row `y` whose bit differs from `flip`'s; the padded width if there is none.
    #[inline]
    fn next_in_row(&self, y: u32, x: u32, flip: u64) -> u32 {
        let row = self.row(y);
        let end = 64 * row.len() as u32;
        if x >= end {
            return end;
        }
        let first = (x / 64) as usize;
        let head = (row[first] ^ flip) & (u64::MAX << (x % 64));
        let rest = row[first + 1..].iter().map(|word| word ^ flip);
        let mut words = (first as u32..).zip(std::iter::once(head).chain(rest));
        words.find(|(_, word)| *word != 0).map_or(end, |(index, word)| 64 * index + word.trailing_zeros())
    }

    /// The words of every row, from the top.
    #[inline]
    pub fn rows(&self) -> impl Iterator<Item = &[u64]> {
        self.words.chunks_exact(self.words_per_row.max(1))
    }

    /// The words of row `y`.
    #[inline]
    pub fn row(&self, y: u32) -> &[u64] {
        let start = y as usize * self.words_per_row;
        &self.words[start..start + self.words_per_row]
    }

    /// The words of row `y`, for drawing; bits at or beyond the width must stay zero.
    #[inline]
    pub fn row_mut(&mut self, y: u32) -> &mut [u64] {
        let start = y as usize * self.words_per_row;
        &mut self.words[start..start + self.words_per_row]
    }

    /// Clears every pixel.
    pub fn clear(&mut self) {
        self.words.fill(0);
    }

    /// Replaces every pixel of this image by `combine(pixel, other's pixel)`, word by word.
    fn combine(&mut self, other: &Self, combine: impl Fn(u64, u64) -> u64) {
        let inside = u64::MAX >> (64 * self.words_per_row as u32 - self.width).min(63);
        for y in 0..self.height {
            let theirs = if y < other.height { other.row(y) } else { &[] };
            for (index, word) in self.row_mut(y).iter_mut().enumerate() {
                *word = combine(*word, theirs.get(index).copied().unwrap_or(0));
            }
            if let Some(last) = self.row_mut(y).last_mut() {
                *last &= inside;
            }
        }
    }
}

impl BitOrAssign<&Mask> for Mask {
    fn bitor_assign(&mut self, other: &Mask) {
        self.combine(other, |a, b| a | b);
    }
}

impl BitAndAssign<&Mask> for Mask {
    fn bitand_assign(&mut self, other: &Mask) {
        self.combine(other, |a, b| a & b);
    }
}

impl BitXorAssign<&Mask> for Mask {
    fn bitxor_assign(&mut self, other: &Mask) {
        self.combine(other, |a, b| a ^ b);
    }
}

/// Indices of the set bits of a word, lowest first.
fn set_bits(mut word: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = (word != 0).then(|| word.trailing_zeros());
        word &= word.wrapping_sub(1);
        bit
    })
}

/// The number of bits that are set in both lists of words; older instruction sets have none that counts bits.
struct CommonBits<'a>(&'a [u64], &'a [u64]);

impl Dispatched for CommonBits<'_> {
    type Output = u64;

    #[inline(always)]
    fn work(self) -> u64 {
        self.0.iter().zip(self.1).map(|(one, other)| u64::from((one & other).count_ones())).sum()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Random pixels, each set if its random number says so.
    pub(in crate::raster) fn noise(width: u32, height: u32, seed: u64, is_set: impl Fn(u64) -> bool) -> Mask {
        let mut state = seed | 1;
        Mask::from_fn(width, height, |_, _| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            is_set(state >> 33)
        })
    }

    fn any_mask() -> impl Strategy<Value = Mask> {
        (1..200_u32, 1..6_u32, any::<u64>(), 1..5_u64)
            .prop_map(|(width, height, seed, gap)| noise(width, height, seed, |number| number.is_multiple_of(gap)))
    }

    proptest! {
        #[test]
        fn pixels_runs_count_and_bounds_agree(mask in any_mask()) {
            let pixels: Vec<_> = mask.pixels().collect();
            let runs: Vec<_> = (0..mask.height()).flat_map(|y| mask.runs(y).flatten().map(move |x| (x, y))).collect();
            prop_assert_eq!(&pixels, &runs);
            prop_assert_eq!(pixels.len() as u64, mask.count());
            prop_assert!(pixels.iter().all(|&(x, y)| mask.get(x, y)));
            let bounds = mask.bounds();
            prop_assert_eq!(bounds.is_empty(), mask.is_empty());
            if !mask.is_empty() {
                prop_assert_eq!(bounds.left, pixels.iter().map(|p| p.0).min().unwrap());
                prop_assert_eq!(bounds.right, pixels.iter().map(|p| p.0).max().unwrap() + 1);
                prop_assert_eq!(bounds.top, pixels[0].1);
                prop_assert_eq!(bounds.bottom, pixels[pixels.len() - 1].1 + 1);
            }
        }

        #[test]
        fn a_span_sets_exactly_its_pixels(width in 1..300_u32, x0 in 0..320_u32, x1 in 0..320_u32) {
            let mut mask = Mask::new(width, 2);
            mask.fill_span(1, x0, x1);
            prop_assert_eq!(mask, Mask::from_fn(width, 2, |x, y| y == 1 && (x0..x1).contains(&x)));
        }

        #[test]
        fn set_operations_agree_with_pixels_on_masks_of_any_sizes(a in any_mask(), b in any_mask()) {
            let by_pixel = |rule: fn(bool, bool) -> bool| Mask::from_fn(a.width(), a.height(), |x, y| rule(a.get(x, y), b.get(x, y)));
            let (mut or, mut and, mut xor) = (a.clone(), a.clone(), a.clone());
            or |= &b;
            and &= &b;
            xor ^= &b;
            prop_assert_eq!(or, by_pixel(|a, b| a | b));
            prop_assert_eq!(a.count_common(&b), and.count());
            prop_assert_eq!(and, by_pixel(|a, b| a & b));
            prop_assert_eq!(xor, by_pixel(|a, b| a ^ b));
        }
    }

    #[test]
    fn outside_the_image_nothing_is_set_or_read() {
        let mut mask = Mask::new(70, 3);
        mask.set(70, 0, true);
        mask.set(0, 3, true);
        mask.fill_span(3, 0, 10);
        assert!(mask.is_empty() && !mask.get(70, 0) && !mask.get(0, 3));
        assert!(mask.bounds().is_empty());
    }
}
