//! Distance between the contours of a drawn silhouette and an observed one.

use super::strips::{ROWS, Rows, STRIP, StripImage, StripLayout};
use super::{DistanceMap, Mask, contour};

/// Stored value for a distance of tau or more.
const FAR: u16 = u16::MAX;
/// Squared distances up to which values are computed once per image; bounds memory use.
const MOST_KEPT: f64 = 65536.0;

/// Truncated distances to the contour of an observed mask, in fixed point, so that sums do not depend on their order.
#[derive(Clone, Debug)]
pub(super) struct ContourDistance {
    layout: StripLayout,
    /// Per block of rows of a [`StripImage`] of this layout, `min(d, tau) / tau` of its pixels in units of `1 / FAR`,
    /// column by column: most contours are steep.
    blocks: Vec<[Rows<u16>; STRIP as usize]>,
    /// Whether the observed mask has no contour.
    nothing_observed: bool,
}

impl ContourDistance {
    /// Distances to the contour of `observed`, truncated at `tau` pixels.
    pub(super) fn new(observed: &Mask, tau: f64) -> Self {
        let layout = StripLayout::new(observed.width(), observed.height());
        let mut blocks = vec![[[FAR; ROWS]; STRIP as usize]; layout.words() / ROWS];
        let edge = contour(observed);
        let bounds = edge.bounds();
        let reach = tau.ceil() as u32;
        let map = DistanceMap::up_to(reach, &edge, bounds.grown(reach, observed.width(), observed.height()));
        let scaled = |squared: u32| {
            let distance = f64::from(squared).sqrt();
            if distance < tau { (distance / tau * f64::from(FAR)).round() as u16 } else { FAR }
        };
        // squared distances are integers shared by many pixels
        let near: Vec<u16> = (0..=(tau * tau).min(MOST_KEPT) as u32).map(scaled).collect();
        let window = map.window();
        for y in window.top..window.bottom {
            let near_pixels = (window.left..window.right).zip(map.row(y)).filter(|(_, s)| f64::from(**s) < tau * tau);
            for (x, &squared) in near_pixels {
                let word = (x / STRIP) as usize * layout.rows + y as usize;
                let value = near.get(squared as usize).copied().unwrap_or_else(|| scaled(squared));
                blocks[word / ROWS][(x % STRIP) as usize][word % ROWS] = value;
            }
        }
        Self { layout, blocks, nothing_observed: bounds.is_empty() }
    }

    /// Mean over the contour of `model`, an image of the same layout; see [`super::MaskComparison::contour`]. `edge`
    /// is scratch memory for a strip's rows.
    #[inline(always)]
    pub(super) fn mean(&self, model: &StripImage, edge: &mut [u32]) -> f64 {
        let (mut sum, mut count) = (0_u64, 0_u64);
        for (strip, first, last) in model.drawn() {
            let edge = &mut edge[first..last];
            model.contour_of_strip(strip, first, edge);
            let blocks = &self.blocks[(strip * self.layout.rows + first) / ROWS..];
            for (edge, distances) in edge.as_chunks::<ROWS>().0.iter().zip(blocks) {
                for (row, &word) in edge.iter().enumerate() {
                    let mut rest = word;
                    while rest != 0 {
                        sum += u64::from(distances[(rest.trailing_zeros() % STRIP) as usize][row]);
                        rest &= rest - 1;
                    }
                    count += u64::from(word.count_ones());
                }
            }
        }
        match (count, self.nothing_observed) {
            (0, true) => 0.0,
            (0, false) => 1.0,
            _ => sum as f64 / (count as f64 * f64::from(FAR)),
        }
    }
}
