//! Random displacement of the outline.

use rand_chacha::ChaCha8Rng;

use skiagraph_core::raster::{Mask, PixelBounds, SignedDistance};
use skiagraph_core::rng::normal;

/// Spacing of the grid, pixels: the correlation length of the displacement.
const GRID: u32 = 8;
/// Integral of the displacement's correlation along a row or column: the grid's spacing times the squared mean of `1 /
/// sqrt(t^2 + (1 - t)^2)`, by which deviates are scaled between two points of the grid.
pub const BOUNDARY_CORRELATION_PX: f64 = 12.43;

/// A mask whose outline is displaced by a smooth random field with a standard deviation of `deviation` pixels, which is
/// made for the window around the silhouette; see the axis `boundary_px`.
pub(super) fn jittered(mask: &Mask, deviation: f64, field: impl FnOnce(&PixelBounds) -> Field) -> Mask {
    // only one pixel in 16,000 is displaced by more than four deviations
    let margin = (4.0 * deviation).ceil().min(16_384.0) as u32 + 2;
    let Some(distance) = SignedDistance::new(mask, None, margin) else { return mask.clone() };
    let window = mask.bounds().grown(margin, mask.width(), mask.height());
    let field = field(&window);
    let mut jittered = mask.clone();
    for y in window.top..window.bottom {
        for x in window.left..window.right {
            let Some(sample) = distance.sample(f64::from(x) + 0.5, f64::from(y) + 0.5) else { continue };
            jittered.set(x, y, sample.distance < deviation * field.at(x, y));
        }
    }
    jittered
}

/// Normal deviates on a grid over a window.
pub(super) struct Field {
    left: u32,
    top: u32,
    columns: usize,
    values: Vec<f64>,
}

impl Field {
    pub(super) fn new(window: &PixelBounds, random: &mut ChaCha8Rng) -> Self {
        let columns = ((window.right - window.left) / GRID + 2) as usize;
        let rows = ((window.bottom - window.top) / GRID + 2) as usize;
        let values = (0..columns * rows).map(|_| normal(random)).collect();
        Self { left: window.left, top: window.top, columns, values }
    }

    /// A field over the image of a mask at a time between two moments, each drawn from its own stream: `share` of the
    /// way from the first to the second.
    pub(super) fn between(mask: &Mask, [first, second]: [&mut ChaCha8Rng; 2], share: f64) -> Self {
        let image = PixelBounds { left: 0, top: 0, right: mask.width(), bottom: mask.height() };
        let (mut field, second) = (Self::new(&image, first), Self::new(&image, second));
        let length = ((1.0 - share).powi(2) + share.powi(2)).sqrt();
        for (value, other) in field.values.iter_mut().zip(second.values) {
            *value = ((1.0 - share) * *value + share * other) / length;
        }
        field
    }

    /// The field at a pixel of the window: normal with variance 1.
    fn at(&self, x: u32, y: u32) -> f64 {
        let (x, y) = (x - self.left, y - self.top);
        let (column, row) = ((x / GRID) as usize, (y / GRID) as usize);
        let share = |at: u32| f64::from(at % GRID) / f64::from(GRID);
        let (s, t) = (share(x), share(y));
        let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
        let first = row * self.columns + column;
        let corners = [first, first + 1, first + self.columns, first + self.columns + 1];
        let sum: f64 = weights.iter().zip(corners).map(|(weight, corner)| weight * self.values[corner]).sum();
        sum / weights.iter().map(|weight| weight * weight).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::rng::{Purpose, stream};

    #[test]
    fn means_over_long_rows_vary_as_the_correlation_says() {
        const LENGTH: u32 = 4000;
        let window = PixelBounds { left: 0, top: 0, right: LENGTH, bottom: 2 };
        let mean = |trial: u64| {
            let field = Field::new(&window, &mut stream(trial, Purpose::Corruption, 0, 0, 0));
            (0..LENGTH).map(|x| field.at(x, 0)).sum::<f64>() / f64::from(LENGTH)
        };
        let variance = (0..2000).map(|trial| mean(trial).powi(2)).sum::<f64>() / 2000.0;
        // the variance of 2000 squares is known to 3 %
        let found = variance * f64::from(LENGTH);
        assert!((found / BOUNDARY_CORRELATION_PX - 1.0).abs() < 0.1, "{found}");
    }

    #[test]
    fn straight_edges_are_displaced_with_the_given_deviation() {
        let mask = Mask::from_fn(400, 3000, |x, _| (100..300).contains(&x));
        for deviation in [1.5, 4.0] {
            let jittered =
                jittered(&mask, deviation, |window| Field::new(window, &mut stream(3, Purpose::Corruption, 0, 0, 0)));
            // every row's left end, except in the last row, which has no distance
            let ends: Vec<f64> =
                (0..2999).filter_map(|y| jittered.runs(y).next()).map(|run| f64::from(run.start)).collect();
            let mean = ends.iter().sum::<f64>() / ends.len() as f64;
            let variance = ends.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / ends.len() as f64;
            // 375 independent values: standard errors of 4 % for the deviation and 5 % for the mean; the slope of the
            // field along a row moves the first set pixel slightly outwards
            assert!((variance.sqrt() / deviation - 1.0).abs() < 0.15, "{deviation}: {}", variance.sqrt());
            assert!((mean - 100.0).abs() < 0.3 * deviation, "{mean}");
        }
    }

    #[test]
    fn full_and_empty_masks_have_no_outline() {
        for mask in [Mask::new(50, 40), Mask::from_fn(50, 40, |_, _| true)] {
            let field = |window: &PixelBounds| Field::new(window, &mut stream(1, Purpose::Corruption, 0, 0, 0));
            assert_eq!(jittered(&mask, 5.0, field), mask);
        }
    }

    #[test]
    fn a_field_between_two_moments_has_variance_1_and_is_each_of_them_at_its_ends() {
        let mask = Mask::new(1600, 1600);
        let moment = |index: u64| stream(index, Purpose::Corruption, 0, 0, 0);
        let at = |share: f64| Field::between(&mask, [&mut moment(1), &mut moment(2)], share).values;
        let (first, second) = (at(0.0), at(1.0));
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64;
        assert!(product(&first, &second).abs() < 0.03);
        for share in [0.25, 0.5] {
            let middle = at(share);
            assert!((product(&middle, &middle) - 1.0).abs() < 0.04);
            let expected = (1.0 - share) / f64::hypot(1.0 - share, share);
            assert!((product(&middle, &first) - expected).abs() < 0.04);
        }
    }
}
