//! Signed distance of image points from a silhouette.

use super::{DistanceMap, Mask, PixelBounds};

/// Signed distances to the outline of a mask, in pixels: positive outside, negative inside.
///
/// The outline runs between set and unset pixels: at a pixel centre the distance is that to the nearest centre of the
/// other kind, minus half a pixel. Between centres it is interpolated bilinearly. Where the mask is cut by the image
/// border, or by pixels without information, it has no outline, because its edge is not visible there.
#[derive(Clone, Debug)]
pub struct SignedDistance {
    window: PixelBounds,
    /// NaN at pixels without information.
    values: Vec<f32>,
}

/// A distance and its derivative at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceSample {
    /// Signed distance, pixels.
    pub distance: f64,
    /// Its gradient: approximately a unit vector pointing away from the silhouette.
    pub gradient: [f64; 2],
}

impl SignedDistance {
    /// Distances for the pixels within `margin` pixels of the mask's bounds; `None` for a mask without an outline
    /// (nothing is set, or everything). `shown` has the mask's size and marks the pixels with information; if absent,
    /// all have.
    pub fn new(mask: &Mask, shown: Option<&Mask>, margin: u32) -> Option<Self> {
        let window = mask.bounds().grown(margin.max(1), mask.width(), mask.height());
        let mut background = complement(mask);
        if let Some(shown) = shown {
            background &= shown;
        }
        let outside = DistanceMap::within(mask, window);
        // the nearest unset pixel to a set one is within the bounds of the mask grown by one
        let inside = DistanceMap::within(&background, mask.bounds().grown(1, mask.width(), mask.height()));
        let width = (window.right - window.left) as usize;
        let mut values: Vec<f32> = Vec::new();
        let mut has_outline = false;
        for y in window.top..window.bottom {
            let begin = values.len();
            values.extend(outside.row(y).iter().map(|squared| (f64::from(*squared).sqrt() - 0.5) as f32));
            let row = &mut values[begin..begin + width];
            let index = |x: u32| (x - window.left) as usize;
            for x in mask.runs(y).flatten() {
                row[index(x)] = (0.5 - inside.distance(x, y)) as f32;
            }
            for x in (window.left..window.right).filter(|x| shown.is_some_and(|shown| !shown.get(*x, y))) {
                row[index(x)] = f32::NAN;
            }
            has_outline |= row.iter().any(|value| *value > 0.0 && value.is_finite());
        }
        (has_outline && !mask.is_empty()).then_some(Self { window, values })
    }

    /// The distance at pixel position `(u, v)` (centres are at +0.5); `None` outside the window and next to pixels
    /// without information.
    #[inline]
    pub fn sample(&self, u: f64, v: f64) -> Option<DistanceSample> {
        let w = &self.window;
        let (x, y) = (u - 0.5 - f64::from(w.left), v - 0.5 - f64::from(w.top));
        let (columns, rows) = (w.right - w.left, w.bottom - w.top);
        let inside = x >= 0.0 && y >= 0.0 && x < f64::from(columns) - 1.0 && y < f64::from(rows) - 1.0;
        if !inside {
            return None;
        }
        let (i, j) = (x as u32, y as u32);
        let (s, t) = (x - f64::from(i), y - f64::from(j));
        let first = j as usize * columns as usize + i as usize;
        let at = |dx: usize, dy: usize| f64::from(self.values[first + dy * columns as usize + dx]);
        let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
        let (upper, lower) = (a + s * (b - a), c + s * (d - c));
        let distance = upper + t * (lower - upper);
        let gradient = [(1.0 - t) * (b - a) + t * (d - c), lower - upper];
        distance.is_finite().then_some(DistanceSample { distance, gradient })
    }
}

fn complement(mask: &Mask) -> Mask {
    let mut other = Mask::new(mask.width(), mask.height());
    (0..mask.height()).for_each(|y| other.fill_span(y, 0, mask.width()));
    other ^= mask;
    other
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::raster::mask::tests::noise;

    proptest! {
        #[test]
        fn distances_are_exact_at_pixel_centres_and_bilinear_between_them(
            width in 2..24_u32, height in 2..24_u32, seed in any::<u64>(), share in 1..9_u64,
            at in prop::array::uniform2(0.0..1.0_f64),
        ) {
            let mask = noise(width, height, seed, |number| number % 10 < share);
            let nearest = |x: u32, y: u32| {
                let other = (0..height).flat_map(|v| (0..width).map(move |u| (u, v)));
                let other = other.filter(|(u, v)| mask.get(*u, *v) != mask.get(x, y));
                let far = |(u, v): (u32, u32)| (f64::from(u) - f64::from(x)).hypot(f64::from(v) - f64::from(y));
                other.map(far).fold(f64::INFINITY, f64::min)
            };
            let value = |x: u32, y: u32| if mask.get(x, y) { 0.5 - nearest(x, y) } else { nearest(x, y) - 0.5 };
            let Some(field) = SignedDistance::new(&mask, None, 30) else {
                prop_assert!(mask.is_empty() || mask.count() == u64::from(width * height));
                return Ok(());
            };
            let (u, v) = (0.5 + at[0] * f64::from(width - 1), 0.5 + at[1] * f64::from(height - 1));
            let (x, y) = ((u - 0.5) as u32, (v - 0.5) as u32);
            let (s, t) = (u - 0.5 - f64::from(x), v - 0.5 - f64::from(y));
            let blend = |a: f64, b: f64, share: f64| (1.0 - share) * a + share * b;
            let rows = [0, 1].map(|j| blend(value(x, y + j), value(x + 1, y + j), s));
            let sample = field.sample(u, v).unwrap();
            prop_assert!((sample.distance - blend(rows[0], rows[1], t)).abs() < 1e-5);
            let h = 1e-3;
            for (axis, gradient) in sample.gradient.into_iter().enumerate() {
                let moved = |by: f64| field.sample(u + by * [1.0, 0.0][axis], v + by * [0.0, 1.0][axis]);
                let inside_the_cell = [(s, 0), (t, 1)].iter().all(|(share, a)| *a != axis || (h..1.0 - h).contains(share));
                if inside_the_cell {
                    let slope = (moved(h).unwrap().distance - moved(-h).unwrap().distance) / (2.0 * h);
                    prop_assert!((slope - gradient).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn next_to_pixels_without_information_there_is_no_outline() {
        let shown = Mask::from_fn(40, 40, |x, _| x < 25);
        let mask = Mask::from_fn(40, 40, |x, y| x < 25 && y < 20);
        let field = SignedDistance::new(&mask, Some(&shown), 10).unwrap();
        let sample = field.sample(24.0, 10.0).unwrap();
        assert!((sample.distance + 10.0).abs() < 1e-6, "{sample:?}: its only edge is below");
        assert_eq!(sample.gradient, [0.0, 1.0], "its only edge is below");
        assert_eq!(field.sample(25.2, 10.0), None);
        let all = Mask::from_fn(40, 40, |x, _| x < 25);
        assert!(SignedDistance::new(&all, Some(&shown), 10).is_none(), "all shown pixels are set");
    }

    #[test]
    fn outside_the_window_and_without_an_outline_there_are_no_distances() {
        let field = SignedDistance::new(&Mask::from_fn(40, 40, |x, _| x < 20), None, 10).unwrap();
        assert_eq!([field.sample(35.0, 13.0), field.sample(f64::NAN, 13.0)], [None; 2]);
        assert!(SignedDistance::new(&Mask::new(30, 20), None, 5).is_none());
        assert!(SignedDistance::new(&Mask::from_fn(30, 20, |_, _| true), None, 5).is_none());
        assert!(SignedDistance::new(&Mask::new(0, 0), None, 5).is_none());
    }
}
