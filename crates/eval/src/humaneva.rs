//! HumanEva's 3-D error, and the same relative to the pelvis.

use skiagraph_core::body::Landmark;

use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;
use super::{Sequence, mpjpe};

/// Mean distance of the fifteen virtual markers (`[Sigal 2006]`, `[Sigal 2010]`; equals the position error of
/// `[Skinned APF]`, Fig. 5, in mm).
pub(super) const ABSOLUTE: Metric = Metric {
    name: "humaneva_mm",
    title: "HumanEva 3-D error",
    meaning: "Mean distance of the 15 body markers from their true places in the room",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "a marker that is in both truth and estimate",
    protocol: "mean distance of HumanEva's 15 virtual markers in the world, no alignment; markers missing in truth or \
               estimate are skipped; mean of frame means; equal to the position error of [Skinned APF]",
    measure: |sequence| {
        Some(Measurement::PerFrame(sequence.per_scored_frame(|frame| mean_of(sequence.distances_mm(frame)))))
    },
};

/// Skiagraph's variant of the relative error: both skeletons are translated to their pelvis, and the other fourteen
/// markers are compared. HumanEva's original, which mixes the head into the thorax, is in
/// [`super::humaneva_official`].
pub(super) const RELATIVE: Metric = Metric {
    name: "humaneva_relative_mm",
    title: "HumanEva error relative to the pelvis",
    meaning: "Mean distance of the markers once the pelvis is put in its true place: the pose without where it stands",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "the pelvis and another marker in truth and estimate",
    protocol: "mean distance of the 14 virtual markers other than the pelvis, relative to each skeleton's own pelvis; \
        markers missing in truth or estimate are skipped; mean of frame means",
    measure: relative,
};

fn relative(sequence: &Sequence<'_>) -> Option<Measurement> {
    let pelvis = Landmark::Pelvis as usize;
    Some(Measurement::PerFrame(sequence.per_scored_frame(|frame| {
        let relative = mpjpe::pelvis_relative_mm(sequence, frame)?;
        mean_of(relative.filter(|(landmark, _)| *landmark != pelvis).map(|(_, distance)| distance))
    })))
}

#[cfg(test)]
mod tests {
    use crate::test_figure::{evaluate_markers, standing};
    use nalgebra::{Point3, Vector3};

    #[test]
    fn a_missing_marker_is_skipped_and_lowers_the_coverage() {
        let truth = vec![standing(); 3];
        let mut estimate = truth.clone();
        for frame in &mut estimate {
            frame[0] = None;
            frame[14] = frame[14].map(|p| p + Vector3::new(0.0, 0.0, 0.140));
        }
        let metrics = evaluate_markers(&truth, &estimate).metrics;
        assert!((metrics["humaneva_mm"].mean - 10.0).abs() < 1e-9, "140 mm on one of 14 markers");
        assert!((metrics["humaneva_relative_mm"].mean - 140.0 / 13.0).abs() < 1e-9);
    }

    #[test]
    fn without_a_pelvis_there_is_no_relative_error() {
        let mut truth = vec![standing(); 3];
        for frame in &mut truth {
            frame[1] = None::<Point3<f64>>;
        }
        let metrics = evaluate_markers(&truth, &truth).metrics;
        assert!(metrics.contains_key("humaneva_mm") && !metrics.contains_key("humaneva_relative_mm"));
    }
}
