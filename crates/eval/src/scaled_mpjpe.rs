//! MPJPE after the best scale of every frame.

use crate::body::Landmark;

use super::metric::{Direction, Measurement, Metric, Unit};
use super::{Sequence, mpjpe};

/// N-MPJPE: both skeletons are moved to their own pelvis, the estimate is scaled by `s = sum <e, t> / sum <e, e>`
/// (`[Rhodin 2018]`), nothing is rotated. What a camera cannot tell, the size, does not count.
pub(super) const NORMALISED: Metric = Metric {
    name: "n_mpjpe_mm",
    title: "N-MPJPE, scaled",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "the pelvis and another marker in truth and estimate",
    protocol: "mean distance of the 15 virtual markers (pelvis included, error 0), relative to each skeleton's own pelvis, \
               after the best scale of each frame's estimate; pooled over all markers of all frames, markers missing in \
               truth or estimate skipped",
    measure: normalised,
};

fn normalised(sequence: &Sequence<'_>) -> Option<Measurement> {
    mpjpe::pooled(sequence, |frame| of_frame(sequence, frame).unwrap_or_default())
}

fn of_frame(sequence: &Sequence<'_>, frame: usize) -> Option<Vec<f64>> {
    let pelvis = Landmark::Pelvis as usize;
    let (from, to) = (sequence.estimate_markers.get(frame, pelvis)?, sequence.truth_markers.get(frame, pelvis)?);
    let pairs: Vec<_> = sequence.pairs(frame).map(|(_, truth, estimate)| (estimate - from, truth - to)).collect();
    let square: f64 = pairs.iter().map(|(estimate, _)| estimate.norm_squared()).sum();
    let scale = pairs.iter().map(|(estimate, truth)| estimate.dot(truth)).sum::<f64>() / square;
    (square > f64::EPSILON)
        .then(|| pairs.iter().map(|(estimate, truth)| 1000.0 * (scale * estimate - truth).norm()).collect())
}
