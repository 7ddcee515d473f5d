//! The lag of the estimate behind the truth.

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;
use skiagraph_core::body::LANDMARKS;

const LONGEST_LAG_S: f64 = 0.25;

const LONG_ENOUGH: &str = "a sequence of at least 1 s, and at least 0.5 s of frames with estimates in all frames \
    within 250 ms before and after";

pub(super) const LAG: Metric = Metric {
    name: "lag_ms",
    title: "Lag",
    meaning: "How much later than the actor the estimate moves; below 0, it is ahead",
    unit: Unit::Millisecond,
    direction: Direction::Neither,
    needs: LONG_ENOUGH,
    protocol: "shift by whole frames, at most 250 ms in either direction, that minimises the absolute error of the 15 \
        virtual markers; positive if the estimate trails; all shifts use the same true frames: those with an estimate \
        at every shift",
    measure: lag,
};

pub(super) const LAG_CORRECTED: Metric = Metric {
    name: "lag_corrected_mm",
    title: "Error after lag correction",
    meaning: "The mean marker error that remains once the estimate's delay is removed",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: LONG_ENOUGH,
    protocol: "mean distance of the 15 virtual markers in the world after the estimate is shifted by its lag; frames \
        within 250 ms of either end or of a frame without an estimate are left out",
    measure: |sequence| best_shift(sequence).map(|(_, error)| Measurement::Whole(error)),
};

fn lag(sequence: &Sequence<'_>) -> Option<Measurement> {
    let (shift, _) = best_shift(sequence)?;
    Some(Measurement::Whole(1000.0 * shift as f64 / sequence.frames_per_second))
}

/// The shift of least error, frames, and that error, millimetres; of equal ones the smaller shift. Only true frames
/// that have an estimate at every shift are compared. `None` for sequences shorter than four times the greatest lag,
/// and for fewer such frames than sequences of that length have.
fn best_shift(sequence: &Sequence<'_>) -> Option<(i64, f64)> {
    let reach = (LONGEST_LAG_S * sequence.frames_per_second) as usize;
    if sequence.scored().len() < 4 * reach.max(1) {
        return None;
    }
    let inner = sequence.first_scored + reach..sequence.frames() - reach;
    let whole = |frame: &usize| (frame - reach..=frame + reach).all(|other| !sequence.is_lost(other));
    let inner: Vec<usize> = inner.filter(whole).collect();
    if inner.len() < 2 * reach {
        return None;
    }
    let error_at = |shift: i64| mean_of(inner.iter().filter_map(|frame| shifted_error_mm(sequence, *frame, shift)));
    let mut best = (0, error_at(0)?);
    for shift in (1..=reach as i64).flat_map(|s| [s, -s]) {
        if let Some(error) = error_at(shift).filter(|error| *error < best.1) {
            best = (shift, error);
        }
    }
    Some(best)
}

/// Mean distance between the truth at `frame` and the estimate `shift` frames later, millimetres.
fn shifted_error_mm(sequence: &Sequence<'_>, frame: usize, shift: i64) -> Option<f64> {
    let (truth, estimate) = (sequence.truth_markers, sequence.estimate_markers);
    let shifted = frame.checked_add_signed(shift as isize)?;
    let distance = |landmark| Some(1000.0 * (estimate.get(shifted, landmark)? - truth.get(frame, landmark)?).norm());
    mean_of((0..LANDMARKS.len()).filter_map(distance))
}

#[cfg(test)]
mod tests {
    use crate::test_figure::{evaluate_markers, standing, translated};
    use nalgebra::Vector3;

    fn walker(lag_frames: f64) -> Vec<skiagraph_core::body::Markers> {
        (0..121).map(|f| translated(&standing(), Vector3::new((f as f64 - lag_frames) / 50.0, 0.0, 0.0))).collect()
    }

    #[test]
    fn a_lag_is_found_and_corrected_and_is_negative_if_the_estimate_runs_ahead() {
        // 20 mm per frame
        for (frames, milliseconds) in [(0.0, 0.0), (1.0, 1000.0 / 60.0), (-3.0, -50.0)] {
            let metrics = evaluate_markers(&walker(0.0), &walker(frames)).metrics;
            assert!((metrics["mpjpe_mm"].mean - 20.0 * frames.abs()).abs() < 1e-9);
            assert!((metrics["lag_ms"].mean - milliseconds).abs() < 1e-9);
            assert!(metrics["lag_corrected_mm"].mean < 1e-9);
        }
    }

    #[test]
    fn a_body_that_stands_still_has_no_lag() {
        let still = vec![standing(); 121];
        assert_eq!(evaluate_markers(&still, &still).metrics["lag_ms"].mean, 0.0);
    }

    #[test]
    fn lost_frames_do_not_move_the_lag() {
        // the walker accelerates, so that frames left out of one shift only would favour another
        let x = |frame: f64| 0.0004 * frame.powi(2);
        let walk = |lag: f64| -> Vec<_> {
            (0..200).map(|f| translated(&standing(), Vector3::new(x(f as f64 - lag), 0.0, 0.0))).collect()
        };
        let (truth, mut estimate) = (walk(0.0), walk(4.0));
        estimate[120..124].fill([None; 15]);
        let metrics = evaluate_markers(&truth, &estimate).metrics;
        assert!((metrics["lag_ms"].mean - 4000.0 / 60.0).abs() < 1e-9);
        assert!(metrics["lag_corrected_mm"].mean < 1e-9);
        estimate.iter_mut().step_by(20).for_each(|markers| *markers = [None; 15]);
        let metrics = evaluate_markers(&truth, &estimate).metrics;
        assert!(!metrics.contains_key("lag_ms"), "no frame has an estimate at every shift");
    }

    #[test]
    fn the_lag_of_a_short_sequence_is_not_measured() {
        let truth = &walker(0.0)[..40];
        assert!(!evaluate_markers(truth, truth).metrics.contains_key("lag_ms"));
    }
}
