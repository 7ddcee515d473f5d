//! Distance of the estimate from the keypoints that were found in the images.

use super::metric::{Direction, Measurement, Metric, Unit};

pub(super) const RESIDUAL: Metric = Metric {
    name: "keypoint_residual_px",
    title: "Distance from the keypoints",
    meaning: "How far the estimate's points are from the keypoints that a detector found in the images",
    unit: Unit::Pixel,
    direction: Direction::LowerIsBetter,
    needs: "a recording with keypoints, and poses of the tracker's body",
    protocol: "distance in the image between a keypoint with a confidence of at least 0.3 and the same point of the \
               tracker's body, lens included; median over the keypoints of all cameras, then mean over frames; a detector's \
               definition of a point differs from the body's by 10 to 20 mm; depends on the images' size",
    measure: |sequence| {
        let residuals = sequence.keypoint_residuals_px?;
        Some(Measurement::PerFrame(sequence.per_scored_frame(|frame| residuals[frame])))
    },
};

#[cfg(test)]
mod tests {
    use super::super::{Sequence, evaluate};
    use crate::test_figure::standing;

    #[test]
    fn a_recording_without_a_truth_has_measures_of_its_images() {
        let (none, estimate) = (vec![[None; 15]; 6], vec![standing(); 6]);
        let overlaps = vec![vec![Some(0.8), Some(0.6)]; 6];
        let residuals = [None, Some(3.0), Some(5.0), Some(4.0), None, Some(4.0)];
        let measured = evaluate(&Sequence {
            has_truth: false,
            first_scored: 0,
            view_overlaps: Some(&overlaps),
            keypoint_residuals_px: Some(&residuals),
            ..Sequence::from_markers(60.0, &none, &estimate)
        })
        .unwrap();
        let names: Vec<&str> = measured.metrics.keys().map(String::as_str).collect();
        let expected =
            ["jitter_m_per_s3", "keypoint_residual_px", "lost_frames", "silhouette_iou", "silhouette_iou_worst_view"];
        let absent: Vec<&str> = measured.absent.keys().map(String::as_str).collect();
        assert_eq!((names, absent, measured.coverage), (expected.to_vec(), vec!["boundary_f"], 1.0));
        let mean = |name: &str| measured.metrics[name].mean;
        assert!((mean("silhouette_iou") - 0.7).abs() < 1e-12 && mean("keypoint_residual_px") == 4.0);
        let words: String = measured.metrics.values().map(|value| value.protocol.clone()).collect();
        assert!(!words.contains("truth") && !words.contains("true"), "{words}");
    }
}
