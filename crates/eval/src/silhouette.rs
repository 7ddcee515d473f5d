//! Overlap of estimated and observed silhouettes.

use skiagraph_core::raster::{Mask, overlap};

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;

const POSES: &str = "poses of the tracker's body to draw (estimate_root and estimate_angles)";

pub(super) const ALL_VIEWS: Metric = Metric {
    name: "silhouette_iou",
    title: "Silhouette overlap (IoU)",
    meaning: "How much of the estimate's and the observed silhouette is common to both: 100 % if they are equal",
    unit: Unit::Fraction,
    direction: Direction::HigherIsBetter,
    needs: POSES,
    protocol: "intersection over union of the estimate's silhouette, drawn with the tracker's body, and the observed one; \
               mean over views, then over frames; views in which both are empty are skipped",
    measure: |sequence| Some(mean_over_views(sequence, sequence.view_overlaps?)),
};

pub(super) const WORST_VIEW: Metric = Metric {
    name: "silhouette_iou_worst_view",
    title: "Silhouette overlap, worst camera",
    meaning: "The overlap of the silhouettes in the camera where they fit worst",
    unit: Unit::Fraction,
    direction: Direction::HigherIsBetter,
    needs: POSES,
    protocol: "intersection over union of the estimate's silhouette, drawn with the tracker's body, and the observed one, \
               in the camera with the lowest mean over frames; frames in which both are empty are skipped",
    measure: worst_view,
};

pub(super) const EXACT: Metric = Metric {
    name: "silhouette_iou_exact",
    title: "Overlap with the exact silhouettes",
    meaning: "How well the estimate's silhouette covers the true one, before anything was corrupted",
    unit: Unit::Fraction,
    direction: Direction::HigherIsBetter,
    needs: "observed silhouettes that are not exact, and poses of the tracker's body to draw",
    protocol: "intersection over union of the estimate's silhouette, drawn with the tracker's body in the true cameras, \
               and the actor's silhouette as the true cameras see it, before anything was corrupted; mean over views, then \
               over frames; views in which both are empty are skipped",
    measure: |sequence| Some(mean_over_views(sequence, sequence.exact_overlaps?)),
};

/// Intersection over union; `None` if both are empty.
pub fn intersection_over_union(estimated: &Mask, observed: &Mask) -> Option<f64> {
    let counts = overlap(estimated, observed);
    (counts.union() > 0).then(|| counts.iou())
}

fn mean_over_views(sequence: &Sequence<'_>, overlaps: &[Vec<Option<f64>>]) -> Measurement {
    Measurement::PerFrame(sequence.per_scored_frame(|frame| mean_of(overlaps[frame].iter().flatten().copied())))
}

fn worst_view(sequence: &Sequence<'_>) -> Option<Measurement> {
    let overlaps = sequence.view_overlaps?;
    let of_view = |view: usize| move |frame: usize| overlaps[frame].get(view).copied().flatten();
    let views = overlaps.iter().map(Vec::len).max()?;
    let (_, worst) = (0..views)
        .filter_map(|view| Some((mean_of(sequence.scored().filter_map(of_view(view)))?, view)))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Measurement::PerFrame(sequence.per_scored_frame(of_view(worst))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate;
    use crate::test_figure::standing;

    fn block(left: u32, right: u32) -> Mask {
        Mask::from_fn(100, 4, |x, _| (left..right).contains(&x))
    }

    #[test]
    fn blocks_of_sixty_that_share_thirty_columns_overlap_by_a_third_and_empty_ones_not_at_all() {
        assert_eq!(intersection_over_union(&block(0, 60), &block(30, 90)), Some(30.0 / 90.0));
        assert_eq!(intersection_over_union(&block(10, 80), &block(10, 80)), Some(1.0));
        assert_eq!(intersection_over_union(&block(0, 10), &block(90, 100)), Some(0.0));
        assert_eq!(intersection_over_union(&block(0, 0), &block(0, 0)), None);
    }

    #[test]
    fn the_exact_overlap_is_absent_unless_silhouettes_are_corrupted() {
        let markers = vec![standing(); 2];
        let (observed, exact) = (vec![vec![Some(0.5)]; 2], vec![vec![Some(0.9), Some(0.7)]; 2]);
        let mut sequence = Sequence::from_markers(60.0, &markers, &markers);
        sequence.view_overlaps = Some(&observed);
        assert!(!evaluate(&sequence).unwrap().metrics.contains_key("silhouette_iou_exact"));
        sequence.exact_overlaps = Some(&exact);
        let metrics = evaluate(&sequence).unwrap().metrics;
        assert!((metrics["silhouette_iou_exact"].mean - 0.8).abs() < 1e-12);
        assert!((metrics["silhouette_iou"].mean - 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_worst_view_is_the_camera_with_the_lowest_mean() {
        let markers = vec![standing(); 3];
        let overlaps = vec![vec![Some(0.0), Some(0.0)], vec![Some(0.9), Some(0.6)], vec![Some(0.5), None]];
        let mut sequence = Sequence::from_markers(60.0, &markers, &markers);
        sequence.view_overlaps = Some(&overlaps);
        let metrics = evaluate(&sequence).unwrap().metrics;
        assert!((metrics["silhouette_iou"].mean - (0.75 + 0.5) / 2.0).abs() < 1e-12, "frame 0 is left out");
        assert!((metrics["silhouette_iou_worst_view"].mean - 0.6).abs() < 1e-12);
        assert_eq!(metrics["silhouette_iou_worst_view"].per_frame, [None, Some(0.6), None]);
    }
}
