//! Fast bounding boxes of tapered capsules.

use wide::f32x4;

use crate::raster::TaperedCapsule;

/// An axis-aligned box in the frame of the solids; all sides are compared at once in SIMD lanes.
///
/// In single precision: a box must be too large by [`rounding`], never too small. The fourth lanes hold arbitrary data
/// from memory and are ignored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    low: f32x4,
    high: f32x4,
}

/// The lanes in use.
const COORDINATES: u32 = 0b0111;

/// Margin that keeps a box conservative in single precision for coordinates up to `reach`; metres.
#[inline(always)]
pub(super) fn rounding(reach: f64) -> f64 {
    // about four roundings of half a unit each
    reach * f64::from(f32::EPSILON) * 5.0
}

impl Bounds {
    pub(super) const NOTHING: Self =
        Self { low: f32x4::new([f32::INFINITY; 4]), high: f32x4::new([f32::NEG_INFINITY; 4]) };

    /// Around a tapered capsule as if both radii were larger by `more`.
    #[inline(always)]
    pub(super) fn around(capsule: &TaperedCapsule, more: f32) -> Self {
        let TaperedCapsule { a, b, radius_a, radius_b } = capsule;
        let (from, to) = (single([a.x, a.y, a.z, b.x]), single([b.x, b.y, b.z, *radius_a]));
        let (radius_a, radius_b) = (f32x4::splat(*radius_a as f32 + more), f32x4::splat(*radius_b as f32 + more));
        Self { low: (from - radius_a).fast_min(to - radius_b), high: (from + radius_a).fast_max(to + radius_b) }
    }

    /// Extends this box to contain the other.
    #[inline(always)]
    pub(super) fn add(&mut self, other: &Self) {
        self.low = self.low.fast_min(other.low);
        self.high = self.high.fast_max(other.high);
    }

    #[inline(always)]
    pub(super) fn meets(&self, other: &Self) -> bool {
        let meeting = self.low.simd_lt(other.high) & other.low.simd_lt(self.high);
        meeting.to_bitmask() & COORDINATES == COORDINATES
    }
}

#[inline(always)]
fn single(lanes: [f64; 4]) -> f32x4 {
    f32x4::new(lanes.map(|lane| lane as f32))
}

#[cfg(test)]
mod tests {
    use super::super::capsule_distance::tests::capsules;
    use super::*;
    use proptest::prelude::*;

    /// Lowest and highest coordinates.
    fn sides(capsule: &TaperedCapsule) -> [[f64; 3]; 2] {
        let at = |axis: usize, sign: f64| {
            (capsule.a[axis] + sign * capsule.radius_a, capsule.b[axis] + sign * capsule.radius_b)
        };
        [[0, 1, 2].map(|k| at(k, -1.0).0.min(at(k, -1.0).1)), [0, 1, 2].map(|k| at(k, 1.0).0.max(at(k, 1.0).1))]
    }

    proptest! {
        #[test]
        fn boxes_tightly_contain_their_capsules(c in capsules(9.0, 0.0..3.0)) {
            let bounds = Bounds::around(&c, rounding(12.0) as f32);
            let ([low, high], [lows, highs]) = (sides(&c), [bounds.low, bounds.high].map(f32x4::to_array));
            for axis in 0..3 {
                let (below, above) = (low[axis] - f64::from(lows[axis]), f64::from(highs[axis]) - high[axis]);
                prop_assert!((0.0..1e-4).contains(&below) && (0.0..1e-4).contains(&above), "{below} {above}");
            }
        }

        #[test]
        fn boxes_overlap_if_their_sides_do(
            a in capsules(9.0, 0.0..3.0), b in capsules(9.0, 0.0..3.0), more in 0.0..1.0_f64,
        ) {
            let more = more as f32;
            let ([a_low, a_high], [b_low, b_high]) = (sides(&a), sides(&b));
            let gap = (0..3).map(|k| (a_low[k] - b_high[k]).max(b_low[k] - a_high[k])).fold(f64::NEG_INFINITY, f64::max);
            let gap = gap - 2.0 * f64::from(more);
            prop_assume!(gap.abs() > 1e-4);
            let (a, b) = (Bounds::around(&a, more), Bounds::around(&b, more));
            prop_assert_eq!(a.meets(&b), gap < 0.0);
            prop_assert_eq!(b.meets(&a), gap < 0.0);
            let mut both = Bounds::NOTHING;
            both.add(&a);
            both.add(&b);
            prop_assert!(both.meets(&a) && both.meets(&b));
        }
    }
}
