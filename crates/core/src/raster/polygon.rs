//! Polygon filling by an exact rule.

use nalgebra::Point2;

use super::Mask;

/// Fractional bits of a coordinate: corners are rounded to 1/4096 pixel.
const FRACTION: u32 = 12;
const ONE: i64 = 1 << FRACTION;

/// Corners further out are clamped to this, pixels, so that products of two coordinates fit into 64 bits.
const LIMIT: f64 = 131_072.0;

/// Adds a polygon with these corners (pixels, either orientation) to a mask.
///
/// A pixel is inside iff its centre is, by the even-odd rule; a centre on an edge belongs to the polygon to the right
/// of the edge (below it, for horizontal edges). So polygons that share an edge share no pixel and leave no gap.
/// Corners are rounded to 1/4096 pixel; the fill is then exact, in integers. A polygon with a non-finite corner is not
/// drawn.
pub fn paint_polygon(corners: &[Point2<f64>], mask: &mut Mask) {
    if corners.iter().any(|p| !(p.x.is_finite() && p.y.is_finite())) {
        return;
    }
    let corners: Vec<[i64; 2]> = corners.iter().map(|p| [fixed(p.x), fixed(p.y)]).collect();
    let ends = corners.iter().skip(1).chain(corners.first());
    let edges: Vec<PolygonEdge> = corners.iter().zip(ends).filter_map(|(p, q)| PolygonEdge::new(*p, *q)).collect();
    let top = edges.iter().map(|edge| edge.top[1]).min().unwrap_or(0);
    let bottom = edges.iter().map(|edge| edge.bottom[1]).max().unwrap_or(0);
    // the first row whose centre is at or beyond a coordinate
    let to_row = |y: i64| (y + ONE / 2 - 1).div_euclid(ONE).clamp(0, i64::from(mask.height())) as u32;
    let mut crossings = Vec::new();
    for y in to_row(top)..to_row(bottom) {
        let centre = i64::from(y) * ONE + ONE / 2;
        crossings.clear();
        crossings.extend(edges.iter().filter_map(|edge| edge.first_pixel_right(centre)));
        crossings.sort_unstable();
        for pair in crossings.chunks_exact(2) {
            let [from, to] = [pair[0], pair[1]].map(|x| x.clamp(0, i64::from(mask.width())) as u32);
            mask.fill_span(y, from, to);
        }
    }
}

fn fixed(pixels: f64) -> i64 {
    (pixels.clamp(-LIMIT, LIMIT) * ONE as f64).round() as i64
}

/// An edge that crosses rows, upper end first.
struct PolygonEdge {
    top: [i64; 2],
    bottom: [i64; 2],
}

impl PolygonEdge {
    fn new(p: [i64; 2], q: [i64; 2]) -> Option<Self> {
        match p[1].cmp(&q[1]) {
            std::cmp::Ordering::Less => Some(Self { top: p, bottom: q }),
            std::cmp::Ordering::Greater => Some(Self { top: q, bottom: p }),
            std::cmp::Ordering::Equal => None,
        }
    }

    /// Index of the first pixel of the row with this centre that is on or to the right of the edge.
    fn first_pixel_right(&self, centre: i64) -> Option<i64> {
        if !(self.top[1]..self.bottom[1]).contains(&centre) {
            return None;
        }
        let height = self.bottom[1] - self.top[1];
        // The crossing minus half a pixel, times the height: the quotient rounded up is the pixel.
        let crossing = (self.top[0] - ONE / 2) * height + (centre - self.top[1]) * (self.bottom[0] - self.top[0]);
        let divisor = height * ONE;
        Some((crossing + divisor - 1).div_euclid(divisor))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn painted(corners: &[[f64; 2]], width: u32, height: u32) -> Mask {
        let mut mask = Mask::new(width, height);
        paint_polygon(&corners.iter().map(|&c| Point2::from(c)).collect::<Vec<_>>(), &mut mask);
        mask
    }

    /// Crossings of a ray to the right, in floating point: the textbook test.
    fn contains(corners: &[[f64; 2]], x: f64, y: f64) -> bool {
        let ends = corners.iter().skip(1).chain(corners.first());
        let crossed = corners
            .iter()
            .zip(ends)
            .filter(|(p, q)| (p[1] > y) != (q[1] > y) && x < p[0] + (y - p[1]) * (q[0] - p[0]) / (q[1] - p[1]));
        crossed.count() % 2 == 1
    }

    fn corners(count: usize) -> impl Strategy<Value = Vec<[f64; 2]>> {
        let coordinate = || (-200_000..400_000_i32).prop_map(|c| f64::from(c) / 4096.0);
        prop::collection::vec((coordinate(), coordinate()).prop_map(|(x, y)| [x, y]), count)
    }

    proptest! {
        #[test]
        fn polygons_contain_the_pixels_whose_centres_they_enclose(corners in corners(7)) {
            let inside = |x, y| contains(&corners, f64::from(x) + 0.5, f64::from(y) + 0.5);
            prop_assert_eq!(painted(&corners, 70, 60), Mask::from_fn(70, 60, inside));
        }

        #[test]
        fn triangles_around_a_point_share_no_pixel_and_leave_no_gap(
            x in 8..56_i32, y in 8..56_i32, places in prop::collection::vec(0..240_i32, 3..12),
        ) {
            // Points along a square's border; corners and centre on whole and half pixels, where ties occur.
            let border = |place: i32| {
                let along = f64::from(place % 60) + 2.0;
                [[along, 2.0], [62.0, along], [64.0 - along, 62.0], [2.0, 64.0 - along]][(place / 60) as usize]
            };
            let mut places = places;
            places.extend([0, 60, 120, 180]);
            places.sort_unstable();
            places.dedup();
            let centre = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let mut whole = Mask::new(64, 64);
            let mut count = 0;
            for (index, &place) in places.iter().enumerate() {
                let triangle = painted(&[centre, border(place), border(places[(index + 1) % places.len()])], 64, 64);
                count += triangle.count();
                whole |= &triangle;
            }
            prop_assert_eq!(count, 60 * 60);
            prop_assert_eq!(whole, Mask::from_fn(64, 64, |x, y| (2..62).contains(&x) && (2..62).contains(&y)));
        }
    }

    #[test]
    fn huge_flat_and_invalid_polygons_do_no_harm() {
        let all = painted(&[[-1e12, -1e12], [1e12, -1e12], [1e12, 1e12], [-1e12, 1e12]], 64, 48);
        assert_eq!(all.count(), 64 * 48);
        assert!(painted(&[[1.0, 5.0], [60.0, 5.0], [30.0, 5.0]], 64, 48).is_empty());
        assert!(painted(&[[f64::NAN, 0.0], [60.0, 0.0], [30.0, 40.0]], 64, 48).is_empty());
        assert!(painted(&[], 64, 48).is_empty());
    }
}
