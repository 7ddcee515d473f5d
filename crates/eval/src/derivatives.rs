//! Errors of motion: velocity, acceleration, and jitter.
//!
//! Differences are taken over frames and multiplied by the frame rate, so that sequences of different rates can be
//! compared. Noise is still amplified, more so at higher rates, so these numbers must be quoted with their fps.

use nalgebra::Vector3;

use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;
use super::{MarkerList, Sequence};

pub(super) const VELOCITY: Metric = Metric {
    name: "velocity_error_mm_per_s",
    title: "Velocity error",
    meaning: "How far the markers' velocity is from the true one",
    unit: Unit::MillimetrePerSecond,
    direction: Direction::LowerIsBetter,
    needs: "a marker with an estimate in two consecutive frames",
    protocol: "mean length of the difference between estimated and true velocity of the 15 virtual markers, backward \
               difference times fps; a difference that touches a missing or left-out frame is skipped; mean of frame means",
    measure: velocity,
};

pub(super) const ACCELERATION: Metric = Metric {
    name: "acceleration_error_m_per_s2",
    title: "Acceleration error",
    meaning: "How far the markers' acceleration is from the true one: noise from frame to frame makes it large",
    unit: Unit::MetrePerSecondSquared,
    direction: Direction::LowerIsBetter,
    needs: "a marker with an estimate in three consecutive frames",
    protocol: "mean length of the difference between estimated and true acceleration of the 15 virtual markers, second \
               difference times fps squared; a difference that touches a missing or left-out frame is skipped; mean of \
               frame means",
    measure: acceleration,
};

pub(super) const JITTER: Metric = Metric {
    name: "jitter_m_per_s3",
    title: "Jitter of the estimate",
    meaning: "How much the estimate trembles from frame to frame, whether it is right or wrong",
    unit: Unit::MetrePerSecondCubed,
    direction: Direction::LowerIsBetter,
    needs: "a marker with an estimate in four consecutive frames",
    protocol: "mean length of the third difference of the 15 estimated virtual markers times fps cubed, of \
        the estimate alone; a difference that touches a missing or left-out frame is skipped; mean of frame means",
    measure: jitter,
};

fn velocity(sequence: &Sequence<'_>) -> Option<Measurement> {
    Some(error_of_difference(sequence, &[1.0, -1.0], 1000.0 * sequence.frames_per_second))
}

fn acceleration(sequence: &Sequence<'_>) -> Option<Measurement> {
    Some(error_of_difference(sequence, &[1.0, -2.0, 1.0], libm::pow(sequence.frames_per_second, 2.0)))
}

fn jitter(sequence: &Sequence<'_>) -> Option<Measurement> {
    let scale = libm::pow(sequence.frames_per_second, 3.0);
    Some(Measurement::PerFrame(sequence.per_scored_frame(|frame| {
        let of_marker = |m| difference(sequence, sequence.estimate_markers, &[1.0, -3.0, 3.0, -1.0], frame, m);
        mean_of((0..15).filter_map(of_marker).map(|d| scale * d.norm()))
    })))
}

fn error_of_difference(sequence: &Sequence<'_>, stencil: &[f64], scale: f64) -> Measurement {
    Measurement::PerFrame(sequence.per_scored_frame(|frame| {
        let of_marker = |marker| {
            let estimate = difference(sequence, sequence.estimate_markers, stencil, frame, marker)?;
            let truth = difference(sequence, sequence.truth_markers, stencil, frame, marker)?;
            Some(scale * (estimate - truth).norm())
        };
        mean_of((0..15).filter_map(of_marker))
    }))
}

/// `sum_k stencil[k] x[frame - k]` of one marker, metres; `None` if this involves a missing or left-out frame.
fn difference(
    sequence: &Sequence<'_>,
    markers: MarkerList<'_>,
    stencil: &[f64],
    frame: usize,
    marker: usize,
) -> Option<Vector3<f64>> {
    let mut sum = Vector3::zeros();
    for (back, weight) in stencil.iter().enumerate() {
        let at = frame.checked_sub(back).filter(|at| *at >= sequence.first_scored)?;
        sum += *weight * markers.get(at, marker)?.coords;
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_figure::{evaluate_markers, standing, translated};
    use skiagraph_core::body::Markers;

    fn along_x(frames: usize, x: impl Fn(f64) -> f64) -> Vec<Markers> {
        (0..frames).map(|f| translated(&standing(), Vector3::new(x(f as f64), 0.0, 0.0))).collect()
    }

    #[test]
    fn the_derivatives_of_a_cubic_are_known() {
        // f^3 mm and a constant beside the truth at 60 fps: at frame f the differences are 3f^2-3f+1, 6f-6 and 6 mm.
        let truth = |f: f64| 0.02 * f * f + 0.5;
        let evaluation = evaluate_markers(&along_x(6, truth), &along_x(6, |f| truth(f) - 0.5 + 0.001 * f * f * f));
        let per_frame = |name: &str| evaluation.metrics[name].per_frame.clone();
        let close = |value: Option<f64>, by_hand: f64| (value.unwrap() - by_hand).abs() < 1e-6 * by_hand;
        let velocity = per_frame("velocity_error_mm_per_s");
        assert_eq!(velocity[1], None, "the stencil would include frame 0, which is left out");
        assert!(close(velocity[3], 19.0 * 60.0));
        let acceleration = per_frame("acceleration_error_m_per_s2");
        assert_eq!(acceleration[2], None);
        assert!(close(acceleration[4], 0.018 * 3600.0));
        let jitter = per_frame("jitter_m_per_s3");
        assert_eq!(jitter[3], None);
        assert!(close(jitter[5], 0.006 * 216_000.0));
    }

    #[test]
    fn a_missing_frame_invalidates_the_three_stencils_that_include_it() {
        let truth = along_x(10, |f| 0.01 * f);
        let mut estimate = truth.clone();
        estimate[5] = [None; 15];
        let per_frame = &evaluate_markers(&truth, &estimate).metrics["acceleration_error_m_per_s2"].per_frame;
        let voided: Vec<usize> = (3..10).filter(|f| per_frame[*f].is_none()).collect();
        assert_eq!(voided, [5, 6, 7]);
    }
}
