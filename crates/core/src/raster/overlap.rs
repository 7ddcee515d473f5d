//! Overlap of two silhouettes.

use super::Mask;

/// Pixel counts of the overlap of two masks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overlap {
    /// Set in both: `Y` of Sigal's bidirectional error.
    pub both: u64,
    /// Set in the model only: `B`.
    pub only_model: u64,
    /// Set in the observation only: `R`.
    pub only_observed: u64,
}

impl Overlap {
    /// From the pixel counts of the two masks and of their intersection.
    pub(super) fn from_counts(both: u64, model: u64, observed: u64) -> Self {
        Self { both, only_model: model - both, only_observed: observed - both }
    }

    /// Pixels set in either.
    #[inline]
    pub fn union(&self) -> u64 {
        self.both + self.only_model + self.only_observed
    }

    /// Intersection over union in `[0, 1]`; 1 for two empty masks.
    #[inline]
    pub fn iou(&self) -> f64 {
        match self.union() {
            0 => 1.0,
            union => self.both as f64 / union as f64,
        }
    }
}

/// Counts the pixels where a model's mask and an observed mask agree and differ.
pub fn overlap(model: &Mask, observed: &Mask) -> Overlap {
    Overlap::from_counts(model.count_common(observed), model.count(), observed.count())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_rectangles_overlap_by_the_product_of_their_sides() {
        let model = Mask::from_fn(100, 50, |x, y| (10..80).contains(&x) && (5..25).contains(&y));
        let observed = Mask::from_fn(100, 50, |x, y| (60..90).contains(&x) && (20..40).contains(&y));
        let overlap = overlap(&model, &observed);
        assert_eq!(overlap, Overlap { both: 20 * 5, only_model: 70 * 20 - 100, only_observed: 30 * 20 - 100 });
        assert_eq!(overlap.iou(), 100.0 / 1900.0);
    }

    #[test]
    fn empty_masks_agree_only_with_each_other() {
        let empty = Mask::new(10, 10);
        let full = Mask::from_fn(10, 10, |_, _| true);
        assert_eq!(overlap(&empty, &empty).iou(), 1.0);
        assert_eq!(overlap(&empty, &full).iou(), 0.0);
        assert_eq!(overlap(&full, &full).iou(), 1.0);
    }
}
