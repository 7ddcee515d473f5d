//! Track loss, its duration, and recovery.

use std::ops::Range;

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;

/// A frame is bad when its HumanEva error exceeds this, millimetres.
pub const LOSS_THRESHOLD_MM: f64 = 150.0;

/// Least number of consecutive bad frames that are a loss; in a shorter sequence, all scored frames.
pub(crate) const LOSS_FRAMES: usize = 15;

pub(super) const FRACTION: Metric = Metric {
    name: "track_loss",
    title: "Frames in stretches over 150 mm",
    meaning: "Share of the frames in which the body is lost: 15 or more in a row with a mean error above 150 mm",
    unit: Unit::Fraction,
    direction: Direction::LowerIsBetter,
    needs: "markers of the truth",
    protocol: "share of frames that belong to a run of at least 15 consecutive frames (all frames of a shorter \
        sequence) with a HumanEva error above 150 mm; a frame without an estimate counts as exceeding",
    measure: |sequence| {
        let runs = losses(sequence);
        let lost = |frame: usize| f64::from(u8::from(runs.iter().any(|run| run.contains(&frame))));
        Some(Measurement::PerFrame(sequence.per_scored_frame(|frame| Some(lost(frame)))))
    },
};

pub(super) const TIME_TO_LOSS: Metric = Metric {
    name: "time_to_loss_s",
    title: "Time until track loss",
    meaning: "How long the tracker follows the body before it first loses it",
    unit: Unit::Second,
    direction: Direction::HigherIsBetter,
    needs: "a track that is lost",
    protocol: "seconds from the first scored frame to the first run of at least 15 consecutive frames (all frames of a \
        shorter sequence) with an error above 150 mm or without an estimate; absent if the track is never lost",
    measure: |sequence| {
        let first = losses(sequence).first()?.start;
        Some(Measurement::Whole((first - sequence.first_scored) as f64 / sequence.frames_per_second))
    },
};

pub(super) const RECOVERY: Metric = Metric {
    name: "recovery_s",
    title: "Time to recover",
    meaning: "How long the tracker needs to find the body again after it first loses it",
    unit: Unit::Second,
    direction: Direction::LowerIsBetter,
    needs: "a track that is lost and recovered",
    protocol: "seconds from the start of the first loss to the first later frame with an error of at most 150 mm; \
        absent if the track was never lost or never recovered",
    measure: |sequence| {
        let runs = losses(sequence);
        let first = runs.first().filter(|run| run.end < sequence.frames())?;
        Some(Measurement::Whole(first.len() as f64 / sequence.frames_per_second))
    },
};

/// Ranges of at least [`LOSS_FRAMES`] consecutive bad frames, or of all scored frames if there are fewer.
fn losses(sequence: &Sequence<'_>) -> Vec<Range<usize>> {
    let bad = |frame: usize| {
        frame < sequence.frames() && mean_of(sequence.distances_mm(frame)).is_none_or(|error| error > LOSS_THRESHOLD_MM)
    };
    let enough = LOSS_FRAMES.min(sequence.frames().saturating_sub(sequence.first_scored));
    let mut runs = Vec::new();
    let mut start = sequence.first_scored;
    while start < sequence.frames() {
        let end = (start..).find(|frame| !bad(*frame)).unwrap_or(start);
        if end > start && end - start >= enough {
            runs.push(start..end);
        }
        start = end + 1;
    }
    runs
}

#[cfg(test)]
mod tests {
    use crate::test_figure::{evaluate_markers, standing, translated};
    use crate::{Evaluation, MetricValue};
    use nalgebra::Vector3;
    use std::collections::BTreeMap;
    use std::ops::Range;

    /// 61 frames (60 scored, at 60 fps) whose frames in `bad` are 0.2 m off.
    fn with_bad_frames(bad: &[Range<usize>]) -> BTreeMap<String, MetricValue> {
        let truth = vec![standing(); 61];
        let mut estimate = truth.clone();
        for frame in bad.iter().cloned().flatten() {
            estimate[frame] = translated(&truth[frame], Vector3::new(0.2, 0.0, 0.0));
        }
        let Evaluation { metrics, .. } = evaluate_markers(&truth, &estimate);
        metrics
    }

    #[test]
    fn fourteen_bad_frames_are_no_loss_and_fifteen_are() {
        assert_eq!(with_bad_frames(std::slice::from_ref(&(20..34)))["track_loss"].mean, 0.0);
        assert!((with_bad_frames(std::slice::from_ref(&(20..35)))["track_loss"].mean - 0.25).abs() < 1e-12);
    }

    #[test]
    fn a_short_sequence_is_lost_if_every_frame_is_bad() {
        let truth = vec![standing(); 11];
        let mut estimate: Vec<_> = truth.iter().map(|m| translated(m, Vector3::new(0.2, 0.0, 0.0))).collect();
        assert_eq!(evaluate_markers(&truth, &estimate).metrics["track_loss"].mean, 1.0);
        estimate[5] = truth[5];
        assert_eq!(evaluate_markers(&truth, &estimate).metrics["track_loss"].mean, 0.0);
    }

    #[test]
    fn the_times_are_those_of_the_first_loss() {
        let metrics = with_bad_frames(&[31..49, 50..60]);
        assert!((metrics["time_to_loss_s"].mean - 0.5).abs() < 1e-12);
        assert!((metrics["recovery_s"].mean - 0.3).abs() < 1e-12);
        assert!((metrics["track_loss"].mean - 18.0 / 60.0).abs() < 1e-12, "ten bad frames later are not a loss");
    }

    #[test]
    fn a_track_that_is_never_lost_has_no_times_of_loss_and_recovery() {
        let metrics = with_bad_frames(&[]);
        assert!(!metrics.contains_key("time_to_loss_s") && !metrics.contains_key("recovery_s"));
        assert!(!with_bad_frames(std::slice::from_ref(&(40..61))).contains_key("recovery_s"), "never recovered");
    }
}
