//! A binary image laid out for drawing rows in parallel.

use std::ops::Range;

use super::{Mask, PixelBounds};

/// Width of a strip: one word per row.
pub(super) const STRIP: u32 = 32;

/// Rows of a strip are padded to a multiple of this, so that vectors of rows never straddle an end.
pub(super) const ROWS: usize = 8;

/// One number for every row of a block.
pub(super) type Rows<T> = [T; ROWS];

/// Division of an image into vertical strips 32 pixels wide. A strip's rows are contiguous, one `u32` each, so that
/// one instruction fills eight rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct StripLayout {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Rows of a strip in memory.
    pub(super) rows: usize,
    pub(super) strips: usize,
}

impl StripLayout {
    pub(super) fn new(width: u32, height: u32) -> Self {
        let rows = (height as usize).next_multiple_of(ROWS);
        Self { width, height, rows, strips: width.div_ceil(STRIP) as usize }
    }

    /// Words of the whole image.
    pub(super) fn words(&self) -> usize {
        self.rows * self.strips
    }
}

/// A binary image in strips that tracks the drawn areas; everything else is zero.
#[derive(Clone, Debug, Default)]
pub(super) struct StripImage {
    layout: StripLayout,
    words: Vec<u32>,
    /// Per strip the rows `first..last` that may contain set pixels, multiples of [`ROWS`].
    drawn: Vec<(usize, usize)>,
}

impl StripImage {
    pub(super) fn from_mask(mask: &Mask) -> Self {
        let mut image = Self::default();
        image.reshape(StripLayout::new(mask.width(), mask.height()));
        let layout = image.layout;
        for y in 0..mask.height() {
            for (index, &word) in mask.row(y).iter().enumerate() {
                for (half, bits) in [(2 * index, word as u32), (2 * index + 1, (word >> 32) as u32)] {
                    if bits != 0 {
                        image.words[half * layout.rows + y as usize] = bits;
                        image.mark(half, y as usize, y as usize + 1);
                    }
                }
            }
        }
        image
    }

    /// Resizes to this layout and clears the image.
    #[inline(always)]
    pub(super) fn reshape(&mut self, layout: StripLayout) {
        self.clear();
        if self.layout != layout {
            self.layout = layout;
            self.words.resize(layout.words(), 0);
            self.drawn.clear();
            self.drawn.resize(layout.strips, (layout.rows, 0));
        }
    }

    /// Clears the drawn areas.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        let rows = self.layout.rows;
        for (strip, drawn) in self.words.chunks_exact_mut(rows.max(1)).zip(&mut self.drawn) {
            if drawn.0 < drawn.1 {
                strip[drawn.0..drawn.1].fill(0);
                *drawn = (rows, 0);
            }
        }
    }

    pub(super) fn layout(&self) -> StripLayout {
        self.layout
    }

    #[cfg(test)]
    pub(super) fn words(&self) -> &[u32] {
        &self.words
    }

    /// Marks blocks `first..last` of these strips as drawn.
    #[inline(always)]
    pub(super) fn mark_blocks(&mut self, strips: Range<usize>, first: usize, last: usize) {
        for (top, bottom) in &mut self.drawn[strips] {
            (*top, *bottom) = ((*top).min(first * ROWS), (*bottom).max(last * ROWS));
        }
    }

    /// The words of one block of rows, for drawing, in strip `first` and those to its right.
    #[inline(always)]
    pub(super) fn block_in_strips(&mut self, block: usize, first: usize) -> impl Iterator<Item = &mut Rows<u32>> {
        let blocks = self.layout.rows / ROWS;
        let (words, _) = self.words.as_chunks_mut();
        words[first * blocks + block..].iter_mut().step_by(blocks.max(1))
    }

    /// Strip index and rows `first..last` of the drawn areas.
    #[inline(always)]
    pub(super) fn drawn(&self) -> impl Iterator<Item = (usize, usize, usize)> {
        self.drawn.iter().enumerate().filter(|(_, (first, last))| first < last).map(|(strip, &(a, b))| (strip, a, b))
    }

    #[inline(always)]
    fn mark(&mut self, strip: usize, first: usize, last: usize) {
        let (top, bottom) = self.drawn[strip];
        let first = first / ROWS * ROWS;
        self.drawn[strip] = (top.min(first), bottom.max(last.next_multiple_of(ROWS)));
    }

    /// Sets pixel `(x, y)`; ignored outside the image.
    pub(super) fn set(&mut self, x: u32, y: u32) {
        if x < self.layout.width && y < self.layout.height {
            let (strip, row) = ((x / STRIP) as usize, y as usize);
            self.mark(strip, row, row + 1);
            self.words[strip * self.layout.rows + row] |= 1 << (x % STRIP);
        }
    }

    /// The words of rows `first..last` of a strip, for drawing.
    #[inline(always)]
    pub(super) fn words_of_strip(&mut self, strip: usize, first: usize, last: usize) -> &mut [u32] {
        self.mark(strip, first, last);
        &mut self.words[strip * self.layout.rows..][first..last]
    }

    /// Counts the pixels `[set in both, set here]`, where `other` has the same layout, and clears this image.
    #[inline(always)]
    pub(super) fn count_and_clear(&mut self, other: &Self) -> [u64; 2] {
        let rows = self.layout.rows;
        let mut counts = [0; 2];
        let strips = self.words.chunks_exact_mut(rows.max(1)).zip(other.words.chunks_exact(rows.max(1)));
        for ((words, others), drawn) in strips.zip(&mut self.drawn).filter(|(_, (first, last))| first < last) {
            let (first, last) = *drawn;
            let (mut both, mut here) = (0, 0);
            let (blocks, _) = words[first..last].as_chunks_mut::<ROWS>();
            let (others, _) = others[first..last].as_chunks::<ROWS>();
            for (words, others) in blocks.iter_mut().zip(others) {
                for (word, other) in words.iter_mut().zip(others) {
                    both += (*word & other).count_ones();
                    here += word.count_ones();
                    *word = 0;
                }
            }
            *drawn = (rows, 0);
            counts = [counts[0] + u64::from(both), counts[1] + u64::from(here)];
        }
        counts
    }

    /// For each row from `first` on, the pixels of a strip that have an unset neighbour inside the image (as
    /// [`super::contour`]); one row per element of `edge`.
    #[inline(always)]
    pub(super) fn contour_of_strip(&self, strip: usize, first: usize, edge: &mut [u32]) {
        let StripLayout { width, height, rows, strips } = self.layout;
        let column = |strip: usize| &self.words[strip * rows..][..rows];
        let here = column(strip);
        // Beyond a side: the adjacent strip, or the image border, which counts as set.
        let (before, before_bit) = if strip > 0 { (column(strip - 1), 1) } else { (here, 0) };
        let left_border = 1 - before_bit;
        let is_last = strip + 1 == strips;
        let (after, after_bit) = if is_last { (here, 0) } else { (column(strip + 1), 1) };
        let right_border = if is_last { 1 << ((width - 1) % STRIP) } else { 0 };
        let sides = here[first..].iter().zip(&before[first..]).zip(&after[first..]);
        for (edge, ((here, before), after)) in edge.iter_mut().zip(sides) {
            let left = here << 1 | (before >> 31) & before_bit | left_border;
            let right = here >> 1 | (after & after_bit) << 31 | right_border;
            *edge = left & right;
        }
        let top = usize::from(first == 0);
        edge[top..].iter_mut().zip(&here[first + top - 1..]).for_each(|(edge, above)| *edge &= above);
        edge.iter_mut().zip(&here[first + 1..height as usize]).for_each(|(edge, below)| *edge &= below);
        edge.iter_mut().zip(&here[first..]).for_each(|(edge, here)| *edge = here & !*edge);
    }

    /// Adds the set pixels to `mask`, an image of the same size; returns their bounds.
    pub(super) fn merge_into(&self, mask: &mut Mask) -> PixelBounds {
        let mut bounds = PixelBounds::default();
        for (strip, first, last) in self.drawn() {
            let words = &self.words[strip * self.layout.rows..][..self.layout.rows];
            let last = last.min(self.layout.height as usize);
            let (mut columns, mut top, mut bottom) = (0, u32::MAX, 0);
            for (y, &word) in (first as u32..).zip(&words[first..last]).filter(|(_, word)| **word != 0) {
                mask.row_mut(y)[strip / 2] |= u64::from(word) << (STRIP * (strip as u32 % 2));
                (columns, top, bottom) = (columns | word, top.min(y), y + 1);
            }
            if columns != 0 {
                let left = STRIP * strip as u32;
                let (left, right) = (left + columns.trailing_zeros(), left + STRIP - columns.leading_zeros());
                bounds = bounds.union(&PixelBounds { left, top, right, bottom });
            }
        }
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_is_restored_from_its_strips() {
        for (width, height) in [(1, 1), (31, 9), (64, 8), (65, 17), (200, 33)] {
            let mask = Mask::from_fn(width, height, |x, y| (x * 7 + y * 3) % 5 == 0);
            let mut back = Mask::new(width, height);
            let bounds = StripImage::from_mask(&mask).merge_into(&mut back);
            assert_eq!(back, mask);
            assert_eq!(bounds, mask.bounds());
        }
    }

    #[test]
    fn a_cleared_image_is_zero_everywhere_even_with_another_layout() {
        let mut image = StripImage::from_mask(&Mask::from_fn(100, 40, |x, y| x > y));
        image.reshape(StripLayout::new(70, 90));
        assert!(image.words().iter().all(|&w| w == 0));
        assert_eq!(image.drawn().count(), 0);
        image.set(69, 89);
        image.set(70, 89);
        assert_eq!(image.drawn().collect::<Vec<_>>(), [(2, 88, 96)]);
    }
}
