//! The list of all metrics.

use super::metric::Metric;
use super::{
    boundary, contact_f1, coverage, derivatives, energy_gap, foot_skate, global_mpjpe, ground_gap, humaneva,
    humaneva_official, keypoint_residual, lag, limb_swaps, limbs_exchanged, lost_limb, mpjae, mpjpe, orientation, pck,
    pck_3dpw, penetration, procrustes, reprojection, silhouette, track_loss,
};

/// Metrics of short tables.
pub const MAIN_METRICS: [&str; 13] = [
    "humaneva_mm",
    "lost_limb",
    "mpjpe_mm",
    "mpjpe_root_mm",
    "pa_mpjpe_mm",
    "body_orientation_deg",
    "silhouette_iou",
    "pck150",
    "track_loss",
    "coverage",
    "lost_frames",
    "limbs_exchanged",
    "energy_gap",
];
/// Every metric, in the order of tables. CONTRIBUTING.md lists the places of a new one.
pub const METRICS: &[Metric] = &[
    humaneva::ABSOLUTE,
    lost_limb::SHARE,
    humaneva::RELATIVE,
    humaneva_official::ABSOLUTE,
    humaneva_official::RELATIVE,
    mpjpe::ABSOLUTE,
    mpjpe::ROOT_RELATIVE,
    mpjpe::NORMALISED,
    procrustes::ALIGNED,
    global_mpjpe::FIRST_FRAMES,
    global_mpjpe::WHOLE,
    orientation::BODY,
    orientation::HEADING,
    mpjae::ABSOLUTE,
    mpjae::ALIGNED,
    reprojection::ERROR,
    silhouette::ALL_VIEWS,
    silhouette::WORST_VIEW,
    silhouette::EXACT,
    boundary::F,
    keypoint_residual::RESIDUAL,
    pck::PCK,
    pck::AUC,
    pck_3dpw::PCK,
    pck_3dpw::AUC,
    track_loss::FRACTION,
    track_loss::TIME_TO_LOSS,
    track_loss::RECOVERY,
    coverage::COVERAGE,
    coverage::LOST_FRAMES,
    energy_gap::GAP,
    derivatives::VELOCITY,
    derivatives::ACCELERATION,
    derivatives::JITTER,
    lag::LAG,
    lag::LAG_CORRECTED,
    limbs_exchanged::SHARE,
    limb_swaps::SHARE,
    contact_f1::F1,
    foot_skate::SKATE,
    foot_skate::TRUE_SKATE,
    foot_skate::SLIP,
    foot_skate::TRUE_SLIP,
    foot_skate::PER_FRAME,
    foot_skate::RATIO,
    ground_gap::PENETRATION,
    ground_gap::TRUE_PENETRATION,
    ground_gap::FLOAT,
    ground_gap::TRUE_FLOAT,
    penetration::PROP_DEPTH,
    penetration::TRUE_PROP_DEPTH,
    penetration::SELF_DEPTH,
    penetration::TRUE_SELF_DEPTH,
];

/// Metrics that need no truth: those of recordings.
pub(super) const WITHOUT_TRUTH: [&str; 6] = [
    "silhouette_iou",
    "silhouette_iou_worst_view",
    "boundary_f",
    "keypoint_residual_px",
    "lost_frames",
    "jitter_m_per_s3",
];

/// Metrics of the estimate's motion and contact that do not depend on the true motion. A tracker that never moves is no
/// baseline for these, because a motionless body neither skates nor jitters.
const OF_ESTIMATE_ALONE: [&str; 9] = [
    "jitter_m_per_s3",
    "foot_skate_mm_per_s",
    "slip_per_stance_mm",
    "foot_skate_per_frame_mm",
    "skating_ratio",
    "ground_penetration_mm",
    "foot_float_mm",
    "prop_penetration_mm",
    "self_penetration_mm",
];

impl Metric {
    /// Whether every tracker should be better than one that never moves. This does not hold for metrics of the
    /// estimate's own motion, because a motionless body neither skates nor jitters.
    pub fn has_frozen_floor(&self) -> bool {
        !OF_ESTIMATE_ALONE.contains(&self.name)
    }
}

/// Metrics of earlier versions, with what to use instead. Runs and baselines that have them are still read.
const GONE: [(&str, &str); 6] = [
    ("zmp_outside", BALANCE),
    ("truth_zmp_outside", BALANCE),
    ("residual_wrench_body_weights", BALANCE),
    ("truth_residual_wrench_body_weights", BALANCE),
    ("joint_violations", BALANCE),
    ("truth_joint_violations", BALANCE),
];
const BALANCE: &str = "metrics of balance are gone; foot_skate_mm_per_s and ground_penetration_mm measure the feet";

/// What to use instead of a metric that earlier versions had; `None` for other names.
pub fn gone_metric(name: &str) -> Option<&'static str> {
    GONE.iter().find(|(gone, _)| *gone == name).map(|(_, instead)| *instead)
}

/// Finds a metric by name.
pub fn find_metric(name: &str) -> Option<&'static Metric> {
    METRICS.iter().find(|metric| metric.name == name)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_page_of_metrics_says_what_the_reports_say() {
        let page = include_str!("../../../docs/metrics.md");
        // `truth_...` metrics share the row of the estimate's metric
        for metric in METRICS.iter().filter(|metric| !metric.name.starts_with("truth_")) {
            let row = format!("| `{}` | {} |", metric.name, metric.meaning);
            assert!(page.contains(&row), "docs/metrics.md lacks this row:\n{row}");
        }
    }

    #[test]
    fn every_meaning_is_a_short_sentence_of_its_own_and_inputs_are_stated() {
        for Metric { name, meaning, needs, .. } in METRICS {
            assert!(!needs.is_empty() && !needs.ends_with('.') && !needs.starts_with("needs"), "{name}: {needs}");
            let is_sentence = meaning.starts_with(char::is_uppercase) && !meaning.ends_with('.');
            assert!(is_sentence && (20..=104).contains(&meaning.len()), "{name}: {meaning}");
            let estimate = name.strip_prefix("truth_").unwrap_or(name);
            let same = METRICS.iter().filter(|other| other.meaning == *meaning).map(|other| other.name);
            assert!(same.clone().all(|other| other.ends_with(estimate)), "{:?}", same.collect::<Vec<_>>());
        }
    }

    use super::super::Unit;
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_tracker_that_never_moves_is_no_baseline_for_metrics_of_the_estimate_alone() {
        assert!(OF_ESTIMATE_ALONE.iter().all(|name| find_metric(name).is_some_and(|m| !m.has_frozen_floor())));
        // a metric that also exists for the actor does not depend on the other body's motion
        for metric in METRICS.iter().filter(|metric| find_metric(&format!("truth_{}", metric.name)).is_some()) {
            assert!(!metric.has_frozen_floor(), "{}", metric.name);
        }
        let compared = ["humaneva_mm", "velocity_error_mm_per_s", "acceleration_error_m_per_s2", "contact_f1"];
        assert!(compared.iter().all(|name| find_metric(name).is_some_and(Metric::has_frozen_floor)));
    }

    #[test]
    fn gone_metrics_are_answered() {
        for (name, instead) in GONE {
            assert!(find_metric(name).is_none() && gone_metric(name) == Some(instead), "{name}");
        }
        assert_eq!(gone_metric("humaneva_mm"), None);
    }

    #[test]
    fn worse_is_higher_for_an_error_lower_for_a_score_and_never_for_a_diagnosis() {
        let is_worse = |name: &str, value: f64, other: f64| find_metric(name).unwrap().is_worse(value, other);
        assert!(is_worse("humaneva_mm", 2.0, 1.0) && !is_worse("humaneva_mm", 1.0, 1.0));
        assert!(is_worse("pck150", 0.5, 0.6) && !is_worse("pck150", 0.6, 0.5));
        assert!(!is_worse("lag_ms", 9.0, 0.0) && !is_worse("lag_ms", -9.0, 0.0));
    }

    #[test]
    fn names_are_unique_and_carry_their_unit() {
        let names: BTreeSet<&str> = METRICS.iter().map(|m| m.name).collect();
        assert_eq!(names.len(), METRICS.len());
        for metric in METRICS {
            let suffix = match metric.unit {
                Unit::Millimetre => "_mm",
                Unit::Pixel => "_px",
                Unit::Degree => "_deg",
                Unit::MillimetrePerSecond => "_mm_per_s",
                Unit::MetrePerSecondSquared => "_m_per_s2",
                Unit::MetrePerSecondCubed => "_m_per_s3",
                Unit::Second => "_s",
                Unit::Millisecond => "_ms",
                Unit::Fraction | Unit::Energy => "",
                Unit::BodyWeight => "_body_weights",
            };
            assert!(metric.name.ends_with(suffix), "{} should end in {suffix}", metric.name);
        }
    }
}
