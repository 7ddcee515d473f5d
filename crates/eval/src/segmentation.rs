//! Quality of observed silhouettes, compared with the exact ones.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::part_recall::PartRecall;
use super::statistics::mean_of;
use skiagraph_core::body::BodyRegion;
use skiagraph_core::raster::{Mask, contour, grown_by_disc, overlap};

/// Greatest distance between an observed outline and the exact one that counts as agreement, pixels.
pub const BOUNDARY_TOLERANCE_PX: f64 = 2.0;

/// Agreement of one observed silhouette with the exact one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaskQuality {
    /// Intersection over union; `None` if both are empty.
    pub iou: Option<f64>,
    /// Share of the body's pixels that are observed; `None` without a body.
    pub recall: Option<f64>,
    /// Share of the observed pixels that belong to the body; `None` without an observed pixel.
    pub precision: Option<f64>,
    /// Harmonic mean of the share of the observed outline within [`BOUNDARY_TOLERANCE_PX`] of the exact one and vice
    /// versa; `None` if both are empty.
    pub boundary_f: Option<f64>,
    /// Share of the background's pixels that are observed as body; `None` without a background.
    pub false_positives: Option<f64>,
}

/// Agreement of a set's observed silhouettes with the exact ones: the means over cameras and frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SegmentationQuality {
    /// Mean intersection over union.
    pub iou: Option<f64>,
    /// Mean share of the body's pixels that are observed.
    pub recall: Option<f64>,
    /// Mean share of the observed pixels that belong to the body.
    pub precision: Option<f64>,
    /// Mean boundary F-measure.
    pub boundary_f: Option<f64>,
    /// Mean share of the background's pixels that are observed as body.
    pub false_positives: Option<f64>,
    /// Mean share of the visible pixels of each part that are observed, over the images of sampled frames
    /// ([`is_part_sampled`](super::is_part_sampled)) in which at least 20 pixels of the part are visible. Empty in
    /// files of earlier versions.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub recall_by_part: BTreeMap<BodyRegion, f64>,
    /// Mean share of the body's pixels that are observed, over the same frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recall_of_parts: Option<f64>,
}

impl MaskQuality {
    /// Compares an observed mask with the exact one of the same size.
    pub fn new(observed: &Mask, exact: &Mask) -> Self {
        let counts = overlap(observed, exact);
        let share = |part: u64, whole: u64| (whole > 0).then(|| part as f64 / whole as f64);
        let pixels = u64::from(exact.width()) * u64::from(exact.height());
        Self {
            iou: share(counts.both, counts.union()),
            recall: share(counts.both, counts.both + counts.only_observed),
            precision: share(counts.both, counts.both + counts.only_model),
            boundary_f: SilhouetteOutline::new(exact).agreement(&SilhouetteOutline::new(observed)),
            false_positives: share(counts.only_model, pixels - exact.count()),
        }
    }
}

/// A silhouette's outline and the pixels near it.
#[derive(Clone, Debug)]
pub struct SilhouetteOutline {
    line: Mask,
    near: Mask,
    pixels: u64,
}

impl SilhouetteOutline {
    /// The outline of a silhouette.
    pub fn new(silhouette: &Mask) -> Self {
        let line = contour(silhouette);
        Self { near: grown_by_disc(&line, BOUNDARY_TOLERANCE_PX as u32), pixels: line.count(), line }
    }

    /// Harmonic mean of the shares of either outline within [`BOUNDARY_TOLERANCE_PX`] of the other; 0 if one is empty,
    /// `None` if both are.
    pub fn agreement(&self, other: &Self) -> Option<f64> {
        match (self.pixels, other.pixels) {
            (0, 0) => return None,
            (0, _) | (_, 0) => return Some(0.0),
            _ => {}
        }
        let share = |one: &Self, other: &Self| one.line.count_common(&other.near) as f64 / one.pixels as f64;
        let (precision, recall) = (share(other, self), share(self, other));
        Some(if precision + recall > 0.0 { 2.0 * precision * recall / (precision + recall) } else { 0.0 })
    }
}

impl SegmentationQuality {
    /// Means over the masks, and over the images with `parts`, that have the value; `beside` are the masks of those
    /// images.
    pub fn mean(masks: &[MaskQuality], parts: &[PartRecall], beside: &[MaskQuality]) -> Self {
        let mean = |of: fn(&MaskQuality) -> Option<f64>| mean_of(masks.iter().filter_map(of));
        Self {
            iou: mean(|m| m.iou),
            recall: mean(|m| m.recall),
            precision: mean(|m| m.precision),
            boundary_f: mean(|m| m.boundary_f),
            false_positives: mean(|m| m.false_positives),
            recall_by_part: PartRecall::mean(parts),
            recall_of_parts: mean_of(beside.iter().filter_map(|mask| mask.recall)),
        }
    }

    /// Name and value of each mean, for reports.
    pub fn describe(&self) -> Vec<(&'static str, String)> {
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
        let share = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{:.3} %", 100.0 * value));
        let mut all = vec![
            ("overlap with the exact silhouettes (IoU)", number(self.iou)),
            ("share of the body that is observed", number(self.recall)),
            ("share of the observed pixels that is body", number(self.precision)),
            ("outlines within 2 px of each other (boundary F)", number(self.boundary_f)),
            ("background observed as body (false positives)", share(self.false_positives)),
        ];
        if !self.recall_by_part.is_empty() {
            let parts = self.recall_by_part.iter().map(|(part, recall)| format!("{} {recall:.2}", part.name()));
            all.push(("recall by part, in frames at equal intervals", parts.collect::<Vec<_>>().join(", ")));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(left: u32, right: u32) -> Mask {
        Mask::from_fn(100, 40, |x, y| (left..right).contains(&x) && (10..30).contains(&y))
    }

    #[test]
    fn a_block_moved_by_three_of_thirty_columns_has_the_scores_found_by_counting() {
        let quality = MaskQuality::new(&block(23, 53), &block(20, 50));
        assert_eq!(quality.iou, Some(27.0 / 33.0));
        assert_eq!((quality.recall, quality.precision), (Some(0.9), Some(0.9)));
        assert_eq!(quality.false_positives, Some(60.0 / (4000.0 - 600.0)));
        // of the 96 pixels of an outline, those beyond 2 px: the 20 of the side that moved out, less the two at each
        // end that are near the other's upper or lower side; checked by brute force
        let (a, b) = (contour(&block(23, 53)), contour(&block(20, 50)));
        let near = |x: u32, y: u32| b.pixels().any(|(i, j)| i.abs_diff(x).pow(2) + j.abs_diff(y).pow(2) <= 4);
        let share = a.pixels().filter(|(x, y)| near(*x, *y)).count() as f64 / a.count() as f64;
        assert!((quality.boundary_f.unwrap() - share).abs() < 1e-12, "equal in both directions, by symmetry");
        assert!(share < 0.9 && share > 0.5, "{share}");
    }

    #[test]
    fn equal_masks_have_perfect_scores_and_empty_ones_are_left_out_of_the_mean() {
        let same = MaskQuality::new(&block(20, 50), &block(20, 50));
        assert_eq!((same.iou, same.boundary_f, same.false_positives), (Some(1.0), Some(1.0), Some(0.0)));
        let empty = MaskQuality::new(&block(0, 0), &block(0, 0));
        assert_eq!((empty.iou, empty.boundary_f, empty.precision), (None, None, None));
        let missed = MaskQuality::new(&block(0, 0), &block(20, 50));
        assert_eq!((missed.iou, missed.boundary_f, missed.precision), (Some(0.0), Some(0.0), None));
        let mean = SegmentationQuality::mean(&[same, empty, missed], &[], &[]);
        assert_eq!((mean.iou, mean.precision), (Some(0.5), Some(1.0)));
    }

    #[test]
    fn the_recall_of_parts_is_listed_and_stored_by_name_and_may_be_absent() {
        let recall_by_part = [(BodyRegion::ForearmsAndHands, 0.714), (BodyRegion::Head, 1.0)].into();
        let quality = SegmentationQuality { recall_by_part, ..Default::default() };
        assert_eq!(quality.describe().last().unwrap().1, "head 1.00, forearms and hands 0.71");
        let text = serde_json::to_string(&quality).unwrap();
        assert!(text.contains(r#""recall_by_part":{"head":1.0,"forearms_and_hands":0.714}"#), "{text}");
        assert_eq!(serde_json::from_str::<SegmentationQuality>(&text).unwrap(), quality);
        let old = r#"{"iou":0.9,"recall":0.95,"precision":0.94,"boundary_f":null,"false_positives":0.01}"#;
        let read: SegmentationQuality = serde_json::from_str(old).unwrap();
        assert!(read.recall_by_part.is_empty() && read.describe().len() == 5);
        assert!(!serde_json::to_string(&read).unwrap().contains("recall_by_part"));
    }
}
