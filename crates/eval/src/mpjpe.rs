//! Mean per-joint position error: absolute, relative to the root, and after the best scale of every frame.

use skiagraph_core::body::Landmark;

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;

pub(super) const ABSOLUTE: Metric = Metric {
    name: "mpjpe_mm",
    title: "MPJPE, absolute",
    meaning: "Mean distance of all markers from their true places, every marker of every frame counting alike",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "a marker that is in both truth and estimate",
    protocol: "mean distance of the 15 virtual markers in the world, no alignment; pooled over all markers of all frames, \
               markers missing in truth or estimate skipped",
    measure: |sequence| pooled(sequence, |frame| sequence.distances_mm(frame).collect()),
};

/// [`ABSOLUTE`] after both skeletons are translated to their own pelvis. The pelvis counts with its error of zero, like
/// the root in 3DPW: 14/15 of the value without it.
pub(super) const ROOT_RELATIVE: Metric = Metric {
    name: "mpjpe_root_mm",
    title: "MPJPE, root-relative",
    meaning: "Mean distance of the markers once both bodies have the same pelvis: where the body stands does not count",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "the pelvis in truth and estimate",
    protocol: "mean distance of the 15 virtual markers (pelvis included, error 0), relative to each skeleton's own \
        pelvis; pooled over all markers of all frames, markers missing in truth or estimate skipped",
    measure: |sequence| {
        pooled(sequence, |frame| pelvis_relative_mm(sequence, frame).into_iter().flatten().map(|(_, d)| d).collect())
    },
};

/// N-MPJPE: both skeletons are translated to their own pelvis, and the estimate is scaled by
/// `s = sum <e, t> / sum <e, e>` (`[Rhodin 2018]`) without rotation. Size, which one camera cannot determine, does not
/// count.
pub(super) const NORMALISED: Metric = Metric {
    name: "n_mpjpe_mm",
    title: "N-MPJPE, scaled",
    meaning: "As the root-relative error, once the estimate has its best size: place and size do not count",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "the pelvis and another marker in truth and estimate",
    protocol: "mean distance of the 15 virtual markers (pelvis included, error 0), relative to each skeleton's own pelvis, \
               after the best scale of each frame's estimate; pooled over all markers of all frames, markers missing in \
               truth or estimate skipped",
    measure: |sequence| pooled(sequence, |frame| scaled_mm(sequence, frame).unwrap_or_default()),
};

fn scaled_mm(sequence: &Sequence<'_>, frame: usize) -> Option<Vec<f64>> {
    let pelvis = Landmark::Pelvis as usize;
    let (from, to) = (sequence.estimate_markers.get(frame, pelvis)?, sequence.truth_markers.get(frame, pelvis)?);
    let pairs: Vec<_> = sequence.pairs(frame).map(|(_, truth, estimate)| (estimate - from, truth - to)).collect();
    let square: f64 = pairs.iter().map(|(estimate, _)| estimate.norm_squared()).sum();
    let scale = pairs.iter().map(|(estimate, truth)| estimate.dot(truth)).sum::<f64>() / square;
    (square > f64::EPSILON)
        .then(|| pairs.iter().map(|(estimate, truth)| 1000.0 * (scale * estimate - truth).norm()).collect())
}

/// Distances after both skeletons are translated to their own pelvis: landmark index, millimetres; `None` without a
/// pelvis.
pub(super) fn pelvis_relative_mm(sequence: &Sequence<'_>, frame: usize) -> Option<impl Iterator<Item = (usize, f64)>> {
    let pelvis = Landmark::Pelvis as usize;
    let offset = sequence.estimate_markers.get(frame, pelvis)? - sequence.truth_markers.get(frame, pelvis)?;
    Some(
        sequence
            .pairs(frame)
            .map(move |(landmark, truth, estimate)| (landmark, 1000.0 * (estimate - truth - offset).norm())),
    )
}

/// Means per frame, and the mean over all `distances` of all scored frames.
pub(super) fn pooled(sequence: &Sequence<'_>, distances: impl Fn(usize) -> Vec<f64>) -> Option<Measurement> {
    let (mut sum, mut count) = (0.0, 0_usize);
    let per_frame = (0..sequence.frames()).map(|frame| {
        let of_frame = if frame < sequence.first_scored { vec![] } else { distances(frame) };
        of_frame.iter().for_each(|distance| sum += distance);
        count += of_frame.len();
        mean_of(of_frame.into_iter())
    });
    let per_frame = per_frame.collect();
    (count > 0).then(|| Measurement::Pooled { per_frame, mean: sum / count as f64 })
}

#[cfg(test)]
mod tests {
    use crate::test_figure::{evaluate_markers, standing};
    use nalgebra::Vector3;
    use skiagraph_core::body::Landmark;

    #[test]
    fn noise_on_the_root_alone_is_a_small_absolute_error_and_a_root_relative_error_of_all_joints() {
        let truth = vec![standing(); 4];
        let mut estimate = truth.clone();
        for frame in &mut estimate {
            let pelvis = &mut frame[Landmark::Pelvis as usize];
            *pelvis = pelvis.map(|p| p + Vector3::new(0.060, 0.0, 0.0));
        }
        let metrics = evaluate_markers(&truth, &estimate).metrics;
        assert!((metrics["mpjpe_mm"].mean - 60.0 / 15.0).abs() < 1e-9);
        assert!((metrics["mpjpe_root_mm"].mean - 60.0 * 14.0 / 15.0).abs() < 1e-9);
        assert!((metrics["humaneva_relative_mm"].mean - 60.0).abs() < 1e-9, "the zero root is not counted");
    }

    #[test]
    fn mpjpe_weights_joints_equally_and_humaneva_frames() {
        let truth = vec![standing(); 3];
        let mut estimate = truth.clone();
        estimate[1] = estimate[1].map(|m| m.map(|p| p + Vector3::new(0.010, 0.0, 0.0)));
        estimate[2] = [None; 15];
        for marker in [0, 1, 2, 3, 4] {
            estimate[2][marker] = truth[2][marker].map(|p| p + Vector3::new(0.050, 0.0, 0.0));
        }
        let metrics = evaluate_markers(&truth, &estimate).metrics;
        assert!((metrics["mpjpe_mm"].mean - (15.0 * 10.0 + 5.0 * 50.0) / 20.0).abs() < 1e-9);
        assert!((metrics["humaneva_mm"].mean - (10.0 + 50.0) / 2.0).abs() < 1e-9);
    }
}
