//! HumanEva's errors as its published code computes them, including its quirks, for comparison with published numbers.
//!
//! Its skeleton has twenty limb ends. If two share a joint, their mean error is one term, *unless both are exactly
//! zero: then the joint is left out of the mean*. Its relative error uses the head's upper end instead of the lower one
//! in the thorax, and the lower instead of the upper one in the head. [`super::humaneva`] corrects both.

use skiagraph_core::body::Landmark;

use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;
use super::{Sequence, mpjpe};

/// The 3-D error of `[Sigal 2010]` as its code computes it.
pub(super) const ABSOLUTE: Metric = Metric {
    name: "humaneva_official_mm",
    title: "HumanEva 3-D error, as its code has it",
    meaning: "The marker error as HumanEva's own code computes it, for comparison with published numbers",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "a marker that is in both truth and estimate",
    protocol: "mean distance of HumanEva's 15 virtual markers in the world, no alignment; thorax, elbows and knees are left out \
               of a frame's mean where their error is exactly zero, as in HumanEva's own code; mean of frame means",
    measure: absolute,
};

pub(super) const RELATIVE: Metric = Metric {
    name: "humaneva_relative_official_mm",
    title: "HumanEva relative error, as its code has it",
    meaning: "The error without place as HumanEva's own code computes it, for comparison with published numbers",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "the pelvis and another marker in truth and estimate",
    protocol: "distances relative to each skeleton's own pelvis, which is left out; as in HumanEva's own code the thorax is \
               the mean of the errors of thorax and head top, the head is the thorax once more, and thorax, elbows and \
               knees are left out of a frame's mean where their error is exactly zero; mean of frame means",
    measure: relative,
};

/// Whether two limbs share the joint: its error is a mean of two, left out if both are zero.
fn is_shared(landmark: usize) -> bool {
    use Landmark::{LeftElbow, LeftKnee, RightElbow, RightKnee, Thorax};
    [Thorax, LeftElbow, RightElbow, LeftKnee, RightKnee].iter().any(|shared| *shared as usize == landmark)
}

fn counts(&(landmark, error): &(usize, f64)) -> bool {
    error != 0.0 || !is_shared(landmark)
}

fn absolute(sequence: &Sequence<'_>) -> Option<Measurement> {
    Some(Measurement::PerFrame(sequence.per_scored_frame(|frame| {
        let errors =
            sequence.pairs(frame).map(|(landmark, truth, estimate)| (landmark, 1000.0 * (estimate - truth).norm()));
        mean_of(errors.filter(counts).map(|(_, error)| error))
    })))
}

fn relative(sequence: &Sequence<'_>) -> Option<Measurement> {
    let [pelvis, thorax, head] = [Landmark::Pelvis, Landmark::Thorax, Landmark::HeadTop].map(|l| l as usize);
    Some(Measurement::PerFrame(sequence.per_scored_frame(|frame| {
        let errors: Vec<(usize, f64)> = mpjpe::pelvis_relative_mm(sequence, frame)?.collect();
        let of = |landmark: usize| errors.iter().find(|(l, _)| *l == landmark).map(|(_, error)| *error);
        let limbs = errors.iter().copied().filter(|(landmark, _)| ![pelvis, thorax, head].contains(landmark));
        let upper = mean_of([of(thorax), of(head)].into_iter().flatten()).map(|error| (thorax, error));
        let lower = of(thorax).map(|error| (head, error));
        mean_of(limbs.chain(upper).chain(lower).filter(counts).map(|(_, error)| error))
    })))
}

#[cfg(test)]
mod tests {
    use crate::test_figure::{evaluate_markers, standing};
    use nalgebra::Vector3;
    use skiagraph_core::body::Landmark;

    #[test]
    fn the_head_error_counts_half_in_the_thorax_and_not_in_the_head() {
        let truth = vec![standing(); 3];
        let mut estimate = truth.clone();
        for frame in &mut estimate {
            for (index, marker) in frame.iter_mut().enumerate().filter(|(index, _)| *index != Landmark::Pelvis as usize)
            {
                let far = if index == Landmark::HeadTop as usize { 0.04 } else { 0.01 };
                *marker = marker.map(|p| p + Vector3::new(0.0, far, 0.0));
            }
        }
        let metrics = evaluate_markers(&truth, &estimate).metrics;
        // twelve limbs and the head have 10 mm, the thorax (10 + 40) / 2
        assert!((metrics["humaneva_relative_official_mm"].mean - (13.0 * 10.0 + 25.0) / 14.0).abs() < 1e-9);
        assert!((metrics["humaneva_relative_mm"].mean - (13.0 * 10.0 + 40.0) / 14.0).abs() < 1e-9);
        assert!((metrics["humaneva_official_mm"].mean - metrics["humaneva_mm"].mean).abs() < 1e-9, "no zero, no quirk");
    }
}
