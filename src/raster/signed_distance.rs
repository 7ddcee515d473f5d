//! How far a point of the image lies outside or inside a silhouette.

use super::{DistanceMap, Mask, PixelBounds};

/// Signed distances to the outline of a mask, in pixels: positive outside, negative inside.
///
/// The outline runs between set and unset pixels: at a pixel's centre the distance is that to the nearest centre of the
/// other kind, less half a pixel. Between centres it is interpolated bilinearly. Where the mask is cut by the image's
/// border it has no outline, for there nothing is seen to end.
#[derive(Clone, Debug)]
pub struct SignedDistance {
    window: PixelBounds,
    values: Vec<f32>,
}

/// A distance and its derivative at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceSample {
    /// Signed distance, pixels.
    pub distance: f64,
    /// Its gradient: about a unit vector that points away from the silhouette.
    pub gradient: [f64; 2],
}

impl SignedDistance {
    /// Distances for the pixels within `margin` pixels of the mask's bounds; `None` for a mask without an outline (nothing is
    /// set, or everything).
    pub fn new(mask: &Mask, margin: u32) -> Option<Self> {
        let (width, height) = (mask.width(), mask.height());
        let window = mask.bounds().grown(margin.max(1), width, height);
        let area = u64::from(window.right - window.left) * u64::from(window.bottom - window.top);
        if window.is_empty() || mask.count() == area {
            return None;
        }
        let outside = DistanceMap::within(mask, window);
        let inside = DistanceMap::within(&complement(mask), window);
        let mut values = Vec::with_capacity(area as usize);
        for y in window.top..window.bottom {
            for x in window.left..window.right {
                let value = match mask.get(x, y) {
                    true => 0.5 - inside.distance(x, y),
                    false => outside.distance(x, y) - 0.5,
                };
                values.push(value as f32);
            }
        }
        Some(Self { window, values })
    }

    /// The distance at pixel position `(u, v)` (centres lie at +0.5); `None` outside the window.
    #[inline]
    pub fn sample(&self, u: f64, v: f64) -> Option<DistanceSample> {
        let w = &self.window;
        let (x, y) = (u - 0.5 - f64::from(w.left), v - 0.5 - f64::from(w.top));
        let (columns, rows) = ((w.right - w.left) as usize, (w.bottom - w.top) as usize);
        let inside = x >= 0.0 && y >= 0.0 && x < columns as f64 - 1.0 && y < rows as f64 - 1.0;
        if !inside {
            return None;
        }
        let (i, j) = (x as usize, y as usize);
        let (s, t) = (x - i as f64, y - j as f64);
        let at = |dx: usize, dy: usize| f64::from(self.values[(j + dy) * columns + i + dx]);
        let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
        let (upper, lower) = (a + s * (b - a), c + s * (d - c));
        Some(DistanceSample {
            distance: upper + t * (lower - upper),
            gradient: [(1.0 - t) * (b - a) + t * (d - c), lower - upper],
        })
    }
}

fn complement(mask: &Mask) -> Mask {
    let mut other = Mask::new(mask.width(), mask.height());
    for y in 0..mask.height() {
        let mut from = 0;
        for run in mask.runs(y) {
            other.fill_span(y, from, run.start);
            from = run.end;
        }
        other.fill_span(y, from, mask.width());
    }
    other
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_to_a_disc_is_that_of_geometry_within_a_pixel_and_its_gradient_points_outward() {
        let (cx, cy, radius) = (60.3, 45.8, 20.0);
        let mask = Mask::from_fn(120, 90, |x, y| {
            (f64::from(x) + 0.5 - cx).hypot(f64::from(y) + 0.5 - cy) <= radius
        });
        let field = SignedDistance::new(&mask, 25).unwrap();
        for (angle, length) in (0..40).flat_map(|k| [6.0, 14.0, 19.5, 20.5, 31.0].map(|l| (0.157 * f64::from(k), l))) {
            let (nx, ny) = (f64::cos(angle), f64::sin(angle));
            let sample = field.sample(cx + length * nx, cy + length * ny).unwrap();
            assert!((sample.distance - (length - radius)).abs() < 0.6, "{angle} {length} {}", sample.distance);
            let cosine = sample.gradient[0] * nx + sample.gradient[1] * ny;
            assert!(cosine > 0.8, "{angle} {length} {cosine}");
        }
    }

    #[test]
    fn the_outline_runs_half_way_between_pixels() {
        let mask = Mask::from_fn(40, 40, |x, _| x < 20);
        let field = SignedDistance::new(&mask, 10).unwrap();
        for (u, distance) in [(20.0, 0.0), (21.25, 1.25), (17.0, -3.0)] {
            let sample = field.sample(u, 13.7).unwrap();
            assert!((sample.distance - distance).abs() < 1e-6 && sample.gradient == [1.0, 0.0], "{u} {sample:?}");
        }
        assert_eq!(field.sample(35.0, 13.0), None, "outside the window");
        assert_eq!(field.sample(f64::NAN, 13.0), None);
    }

    #[test]
    fn the_images_border_is_no_outline() {
        let mask = Mask::from_fn(40, 40, |x, y| x < 20 && y < 30);
        let field = SignedDistance::new(&mask, 10).unwrap();
        let corner = field.sample(1.0, 1.0).unwrap();
        assert!((corner.distance + 19.0).abs() < 1e-6, "{corner:?}: nothing ends at the left and upper border");
    }

    #[test]
    fn masks_without_an_outline_have_no_distances() {
        assert!(SignedDistance::new(&Mask::new(30, 20), 5).is_none());
        assert!(SignedDistance::new(&Mask::from_fn(30, 20, |_, _| true), 5).is_none());
        assert!(SignedDistance::new(&Mask::new(0, 0), 5).is_none());
    }
}
