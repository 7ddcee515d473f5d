//! Groups metrics under headings.

use skiagraph_eval::{Summary, shown_once};

#[derive(serde::Serialize)]
pub(super) struct MetricGroup {
    pub(super) title: &'static str,
    /// The question that the metrics answer.
    pub(super) about: &'static str,
    pub(super) metrics: &'static [&'static str],
    /// The actor's own values of the same quantities.
    pub(super) of_truth: &'static [&'static str],
}

/// All groups, in the order of the page.
pub(super) const GROUPS: [MetricGroup; 4] = [
    MetricGroup {
        title: "Position and orientation",
        about: "How far the estimate is from the truth, in the world, in the images and after alignment.",
        metrics: &[
            "humaneva_mm",
            "lost_limb",
            "humaneva_relative_mm",
            "humaneva_official_mm",
            "humaneva_relative_official_mm",
            "mpjpe_mm",
            "mpjpe_root_mm",
            "n_mpjpe_mm",
            "pa_mpjpe_mm",
            "w_mpjpe100_mm",
            "wa_mpjpe100_mm",
            "body_orientation_deg",
            "heading_deg",
            "mpjae_deg",
            "pa_mpjae_deg",
            "error_2d_px",
            "silhouette_iou",
            "silhouette_iou_worst_view",
            "silhouette_iou_exact",
            "boundary_f",
            "keypoint_residual_px",
            "pck150",
            "auc150",
            "pck50_3dpw",
            "auc200_3dpw",
            "track_loss",
            "time_to_loss_s",
            "recovery_s",
            "coverage",
            "lost_frames",
            "limbs_exchanged",
            "limb_swaps",
        ],
        of_truth: &[],
    },
    MetricGroup {
        title: "Motion",
        about: "Whether the estimate moves like the actor: speed, smoothness, delay.",
        metrics: &[
            "velocity_error_mm_per_s",
            "acceleration_error_m_per_s2",
            "jitter_m_per_s3",
            "lag_ms",
            "lag_corrected_mm",
        ],
        of_truth: &[],
    },
    MetricGroup {
        title: "Contact",
        about: "Whether feet stand where and when they should, and whether anything penetrates anything else.",
        metrics: &[
            "contact_f1",
            "foot_skate_mm_per_s",
            "slip_per_stance_mm",
            "foot_skate_per_frame_mm",
            "skating_ratio",
            "ground_penetration_mm",
            "foot_float_mm",
            "prop_penetration_mm",
            "self_penetration_mm",
        ],
        of_truth: &[
            "truth_foot_skate_mm_per_s",
            "truth_slip_per_stance_mm",
            "truth_ground_penetration_mm",
            "truth_foot_float_mm",
            "truth_prop_penetration_mm",
            "truth_self_penetration_mm",
        ],
    },
    MetricGroup {
        title: "Search",
        about: "Whether the search or the likelihood causes the error.",
        metrics: &["energy_gap"],
        of_truth: &[],
    },
];

/// Pairs of metrics with equal values in every run: the metric that is shown, and its alias.
pub fn aliases(summary: &Summary) -> Vec<(&'static str, &'static str)> {
    shown_once(|one, other| {
        let values = |name: &str| summary.metrics.get(name).map(|metric| &metric.per_run);
        let (Some(one), Some(other)) = (values(one), values(other)) else { return false };
        let same = |a: &Option<f64>, b: &Option<f64>| match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() <= 1e-9 * a.abs(),
            (a, b) => a.is_none() && b.is_none(),
        };
        one.len() == other.len() && one.iter().zip(other).all(|(a, b)| same(a, b))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_eval::METRICS;

    #[test]
    fn every_metric_has_exactly_one_heading() {
        for metric in METRICS {
            let count =
                GROUPS.iter().flat_map(|g| g.metrics.iter().chain(g.of_truth)).filter(|m| **m == metric.name).count();
            assert_eq!(count, 1, "{}", metric.name);
        }
        for name in GROUPS.iter().flat_map(|group| group.metrics.iter().chain(group.of_truth)) {
            assert!(skiagraph_eval::find_metric(name).is_some(), "{name} is not a metric");
        }
        assert!(GROUPS.iter().flat_map(|group| group.of_truth).all(|name| name.starts_with("truth_")));
    }
}
