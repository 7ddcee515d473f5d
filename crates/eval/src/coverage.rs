//! Coverage: the share of the sequence with an estimate.

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;

pub(super) const COVERAGE: Metric = Metric {
    name: "coverage",
    title: "Markers with an estimate (coverage)",
    meaning: "Share of the true markers that have an estimate; every error covers only these",
    unit: Unit::Fraction,
    direction: Direction::HigherIsBetter,
    needs: "markers of the truth",
    protocol: "share of the true markers, over all scored frames, that the estimate contains",
    measure: coverage,
};

pub(super) const LOST_FRAMES: Metric = Metric {
    name: "lost_frames",
    title: "Frames without an estimate",
    meaning: "Share of the frames for which there is no estimate at all",
    unit: Unit::Fraction,
    direction: Direction::LowerIsBetter,
    needs: "frames to score",
    protocol: "share of the scored frames in which the estimate has no marker; error means leave these frames out",
    measure: lost_frames,
};

/// Share of the truth's markers over all scored frames that the estimate has, 0 to 1; without a truth, the share of the
/// frames with an estimate.
pub(super) fn share(sequence: &Sequence<'_>) -> f64 {
    if !sequence.has_truth {
        let given = sequence.scored().filter(|frame| !sequence.is_lost(*frame)).count();
        return given as f64 / sequence.scored().len().max(1) as f64;
    }
    let expected: usize = sequence.scored().map(|frame| sequence.truth_markers.count(frame)).sum();
    let given: usize = sequence.scored().map(|frame| sequence.pairs(frame).count()).sum();
    given as f64 / expected.max(1) as f64
}

fn coverage(sequence: &Sequence<'_>) -> Option<Measurement> {
    let of_frame = |frame| match sequence.truth_markers.count(frame) {
        0 => None,
        expected => Some(sequence.pairs(frame).count() as f64 / expected as f64),
    };
    let per_frame = sequence.per_scored_frame(of_frame);
    mean_of(per_frame.iter().flatten().copied())?;
    Some(Measurement::Pooled { per_frame, mean: share(sequence) })
}

fn lost_frames(sequence: &Sequence<'_>) -> Option<Measurement> {
    let lost = |frame| Some(f64::from(u8::from(sequence.is_lost(frame))));
    Some(Measurement::PerFrame(sequence.per_scored_frame(lost)))
}

#[cfg(test)]
mod tests {
    use crate::test_figure::{evaluate_markers, standing, translated};
    use nalgebra::Vector3;

    #[test]
    fn lost_frames_are_counted_and_left_out_of_errors() {
        let truth = vec![standing(); 11];
        let mut estimate: Vec<_> = truth.iter().map(|m| translated(m, Vector3::new(0.02, 0.0, 0.0))).collect();
        estimate[0] = [None; 15];
        estimate[4] = [None; 15];
        estimate[5] = [None; 15];
        estimate[6][..9].fill(None);
        let evaluation = evaluate_markers(&truth, &estimate);
        let mean = |name: &str| evaluation.metrics[name].mean;
        assert!((mean("lost_frames") - 0.2).abs() < 1e-12, "two of ten, the start not counted");
        assert!((mean("coverage") - (7.0 * 15.0 + 6.0) / 150.0).abs() < 1e-12);
        assert_eq!(evaluation.coverage, mean("coverage"));
        assert!((mean("humaneva_mm") - 20.0).abs() < 1e-9 && evaluation.metrics["humaneva_mm"].frames == 8);
        assert!((mean("pck150") - mean("coverage")).abs() < 1e-12, "a marker without an estimate is wrong");
    }

    #[test]
    fn a_completely_lost_sequence_has_rates_and_no_errors() {
        let truth = vec![standing(); 40];
        let evaluation = evaluate_markers(&truth, &vec![[None; 15]; 40]);
        for (name, value) in [("lost_frames", 1.0), ("coverage", 0.0), ("track_loss", 1.0), ("pck150", 0.0)] {
            assert_eq!(evaluation.metrics[name].mean, value, "{name}");
        }
        assert_eq!(evaluation.absent["humaneva_mm"], "needs a marker that is in both truth and estimate");
        assert!(!evaluation.metrics.contains_key("humaneva_mm") && evaluation.per_joint.is_empty());
    }
}
