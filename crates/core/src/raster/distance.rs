//! The exact Euclidean distance transform.

use super::{Mask, PixelBounds};
use crate::simd::{Dispatched, dispatch};

/// The distance from every pixel centre of an image, or of a window in it, to the centre of the nearest set pixel of a
/// mask.
///
/// Exact, in integers: squared distances by the lower envelope of parabolas (`[Felzenszwalb 2012]`, algorithm
/// 1), rows after columns, O(width * height).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DistanceMap {
    window: PixelBounds,
    squared: Vec<u32>,
}

/// Greater than any distance or squared distance: no pixel is set.
const NOWHERE: u32 = 1 << 30;
/// The longest distance whose square has 16 bits and is below `u16::MAX`.
const SHORT: u32 = 255;

impl DistanceMap {
    /// Distances to the set pixels of `mask`, over its whole image. O(width * height).
    pub fn new(mask: &Mask) -> Self {
        Self::within(mask, PixelBounds { left: 0, top: 0, right: mask.width(), bottom: mask.height() })
    }

    /// Distances to the set pixels of `mask` *inside `window`*, for the pixels of the window only; the window is
    /// clipped to the image.
    pub fn within(mask: &Mask, window: PixelBounds) -> Self {
        Self::up_to(NOWHERE - 1, mask, window)
    }

    /// As [`Self::within`], but where the distance exceeds `most` pixels it may be any that does.
    pub(super) fn up_to(most: u32, mask: &Mask, window: PixelBounds) -> Self {
        let window = window.grown(0, mask.width(), mask.height());
        let width = (window.right - window.left) as usize;
        let mut squared = columns(mask, &window);
        let rows = squared.chunks_exact_mut(width.max(1));
        if most <= SHORT {
            dispatch(ShortDistances { most, width, rows });
        } else {
            let mut envelope = Envelope { most, parabolas: Vec::new() };
            rows.for_each(|row| envelope.replace(row));
        }
        Self { window, squared }
    }

    /// The pixels with known distances.
    #[inline]
    pub fn window(&self) -> PixelBounds {
        self.window
    }

    /// Squared distances of the window's pixels in row `y` of the window; at least 2^30 if the mask has no pixel in
    /// the window.
    pub(super) fn row(&self, y: u32) -> &[u32] {
        let width = (self.window.right - self.window.left) as usize;
        &self.squared[(y - self.window.top) as usize * width..][..width]
    }

    /// Squared distance in pixels at `(x, y)`; `None` outside the window or if the mask has no pixel in it.
    #[inline]
    pub fn squared(&self, x: u32, y: u32) -> Option<u32> {
        let w = &self.window;
        let inside = (w.left..w.right).contains(&x) && (w.top..w.bottom).contains(&y);
        let index = || (y - w.top) as usize * (w.right - w.left) as usize + (x - w.left) as usize;
        inside.then(|| self.squared[index()]).filter(|&squared| squared < NOWHERE)
    }

    /// Distance in pixels at `(x, y)`; infinite outside the window or if the mask has no pixel in it.
    #[inline]
    pub fn distance(&self, x: u32, y: u32) -> f64 {
        self.squared(x, y).map_or(f64::INFINITY, |squared| f64::from(squared).sqrt())
    }
}

/// For every pixel of the window the distance to the nearest set pixel in its column, not squared; at least
/// [`NOWHERE`] in empty columns.
fn columns(mask: &Mask, window: &PixelBounds) -> Vec<u32> {
    let width = (window.right - window.left) as usize;
    let height = (window.bottom - window.top) as usize;
    let mut distances = vec![NOWHERE; width * height];
    for (y, row) in (window.top..).zip(distances.chunks_exact_mut(width.max(1))) {
        for run in mask.runs(y) {
            let clip = |x: u32| (x.clamp(window.left, window.right) - window.left) as usize;
            row[clip(run.start)..clip(run.end)].fill(0);
        }
    }
    for y in 1..height {
        let (above, row) = distances[(y - 1) * width..(y + 1) * width].split_at_mut(width);
        pull(row, above);
    }
    for y in (1..height).rev() {
        let (row, below) = distances[(y - 1) * width..(y + 1) * width].split_at_mut(width);
        pull(row, below);
    }
    distances
}

/// Lowers the distances of a row to those of an adjacent row plus one. [`NOWHERE`] and values added to it are far
/// above every distance and far below overflow, so no checks are needed.
fn pull(row: &mut [u32], beside: &[u32]) {
    for (here, there) in row.iter_mut().zip(beside) {
        // as signed numbers, for which every processor has a vector comparison
        *here = (*here as i32).min(*there as i32 + 1) as u32;
    }
}

/// Squared distances up to `most`, at most [`SHORT`]: every pixel is compared with all columns that are as near. With
/// vectors of 16-bit numbers that takes less time than the envelope.
struct ShortDistances<'a> {
    most: u32,
    width: usize,
    rows: std::slice::ChunksExactMut<'a, u32>,
}

impl Dispatched for ShortDistances<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let (most, width) = (self.most as usize, self.width);
        let mut columns = vec![u16::MAX; width + 2 * most];
        let mut nearest = vec![u16::MAX; width];
        for row in self.rows {
            for (column, &distance) in columns[most..].iter_mut().zip(row.iter()) {
                *column = if distance <= self.most { (distance * distance) as u16 } else { u16::MAX };
            }
            nearest.copy_from_slice(&columns[most..most + width]);
            for away in 1..=most {
                let (left, right) = (&columns[most - away..][..width], &columns[most + away..][..width]);
                for ((near, left), right) in nearest.iter_mut().zip(left).zip(right) {
                    *near = (*near).min((*left).min(*right).saturating_add((away * away) as u16));
                }
            }
            for (squared, &near) in row.iter_mut().zip(&nearest) {
                *squared = if near == u16::MAX { NOWHERE } else { u32::from(near) };
            }
        }
    }
}

/// Lower envelope of the parabolas `(x - at)^2 + height` of one row.
struct Envelope {
    /// Parabolas of greater column distances are left out.
    most: u32,
    /// `(at, height, first x where this parabola is the lowest)`, from left to right.
    parabolas: Vec<(i64, i64, i64)>,
}

impl Envelope {
    /// Replaces column distances with squared Euclidean distances.
    fn replace(&mut self, row: &mut [u32]) {
        self.parabolas.clear();
        for (at, &distance) in (0..).zip(row.iter()).filter(|(_, distance)| **distance <= self.most) {
            let height = i64::from(distance) * i64::from(distance);
            let mut from = 0;
            while let Some(&(last_at, last_height, last_from)) = self.parabolas.last() {
                // The new parabola is lower than the last one beyond x = numerator / denominator.
                let numerator = height + at * at - last_height - last_at * last_at;
                let denominator = 2 * (at - last_at);
                if numerator >= last_from * denominator {
                    // Both are integers below 2^37, and their quotient in f64 is never rounded past an integer;
                    // floating-point division is several times as fast as integer division.
                    from = (numerator as f64 / denominator as f64) as i64 + 1;
                    break;
                }
                self.parabolas.pop();
            }
            if from < row.len() as i64 {
                self.parabolas.push((at, height, from));
            }
        }
        if self.parabolas.is_empty() {
            row.fill(NOWHERE);
        }
        for (index, &(at, height, from)) in self.parabolas.iter().enumerate() {
            let to = self.parabolas.get(index + 1).map_or(row.len() as i64, |next| next.2);
            for (x, squared) in (from..to).zip(&mut row[from as usize..to as usize]) {
                *squared = ((x - at) * (x - at) + height) as u32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn distances_agree_with_brute_force_and_others_than_those_up_to_a_limit_exceed_it(
            width in 1..90_u32, height in 1..40_u32, pixels in prop::collection::vec((0..90_u32, 0..40_u32), 0..30),
            most in prop_oneof![0..20_u32, SHORT - 2..SHORT + 3],
        ) {
            let mut mask = Mask::new(width, height);
            pixels.iter().for_each(|&(x, y)| mask.set(x, y, true));
            let map = DistanceMap::new(&mask);
            let near = DistanceMap::up_to(most, &mask, PixelBounds { left: 0, top: 0, right: width, bottom: height });
            let is_near = |squared: &u32| *squared <= most * most;
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let exact = mask.pixels().map(|(i, j)| i.abs_diff(x).pow(2) + j.abs_diff(y).pow(2)).min();
                prop_assert_eq!(map.squared(x, y), exact);
                prop_assert_eq!(near.squared(x, y).filter(is_near), exact.filter(is_near));
            }
        }
    }

    #[test]
    fn a_window_with_all_set_pixels_gives_the_same_distances() {
        let mask = Mask::from_fn(120, 90, |x, y| (40..70).contains(&x) && (30..60).contains(&y) && (x + y) % 7 == 0);
        let window = mask.bounds().grown(5, 120, 90);
        let (whole, part) = (DistanceMap::new(&mask), DistanceMap::within(&mask, window));
        assert_eq!(part.window(), window);
        for (x, y) in (0..90).flat_map(|y| (0..120).map(move |x| (x, y))) {
            let inside = (window.left..window.right).contains(&x) && (window.top..window.bottom).contains(&y);
            assert_eq!(part.squared(x, y), whole.squared(x, y).filter(|_| inside));
        }
    }

    #[test]
    fn an_empty_mask_is_infinitely_far_away() {
        let map = DistanceMap::new(&Mask::new(20, 10));
        assert_eq!(map.squared(3, 4), None);
        assert_eq!(map.distance(3, 4), f64::INFINITY);
        assert_eq!(DistanceMap::new(&Mask::new(0, 0)).squared(0, 0), None);
    }

    #[test]
    fn the_distance_across_the_widest_image_is_exact() {
        let mut mask = Mask::new(16384, 2);
        mask.set(0, 0, true);
        assert_eq!(DistanceMap::new(&mask).squared(16383, 1), Some(16383 * 16383 + 1));
    }
}
