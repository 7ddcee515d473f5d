//! MPJPE in the world after one similarity transform per segment: it measures drift, but not the choice of the world's
//! origin.

use nalgebra::Point3;

use super::metric::{Direction, Measurement, Metric, Unit};
use super::{Sequence, Similarity, mpjpe};

/// Frames of a segment (`[Ye 2023]`).
const SEGMENT: usize = 100;
/// Frames that W-MPJPE aligns.
const FIRST: usize = 2;

pub(super) const WHOLE: Metric = Metric {
    name: "wa_mpjpe100_mm",
    title: "WA-MPJPE, segments aligned",
    meaning: "Mean distance once every 100 frames are moved as one to fit best: what is wrong within these 100 frames",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "three markers that are in both truth and estimate",
    protocol: "mean distance of the 15 virtual markers after one similarity transform (rotation, translation, scale) for \
               each segment of 100 frames, fitted to all its frames; pooled over all markers of all frames, markers \
               missing in truth or estimate skipped",
    measure: |sequence| aligned(sequence, usize::MAX),
};

pub(super) const FIRST_FRAMES: Metric = Metric {
    name: "w_mpjpe100_mm",
    title: "W-MPJPE, first frames aligned",
    meaning: "Mean distance once every 100 frames are moved to fit at their start: how far the estimate then drifts",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "three markers that are in both truth and estimate",
    protocol: "mean distance of the 15 virtual markers after one similarity transform (rotation, translation, scale) for \
               each segment of 100 frames, fitted to its first two frames with an estimate; pooled over all markers of all \
               frames, markers missing in truth or estimate skipped",
    measure: |sequence| aligned(sequence, FIRST),
};

type Pairs = Vec<(Point3<f64>, Point3<f64>)>;

/// Distances after the transform of each segment, fitted to its first `fitted` frames that have an estimate.
fn aligned(sequence: &Sequence<'_>, fitted: usize) -> Option<Measurement> {
    let pairs =
        |frame: usize| -> Pairs { sequence.pairs(frame).map(|(_, truth, estimate)| (estimate, truth)).collect() };
    let scored: Vec<usize> = sequence.scored().collect();
    let transforms: Vec<Option<Similarity>> = scored
        .chunks(SEGMENT)
        .map(|segment| {
            let given = segment.iter().map(|frame| pairs(*frame)).filter(|pairs| !pairs.is_empty());
            Similarity::fit(&given.take(fitted).flatten().collect::<Pairs>())
        })
        .collect();
    let transform = |frame: usize| transforms[(frame - sequence.first_scored) / SEGMENT];
    mpjpe::pooled(sequence, |frame| {
        let Some(similarity) = transform(frame) else { return Vec::new() };
        pairs(frame).iter().map(|(estimate, truth)| 1000.0 * (similarity.apply(estimate) - truth).norm()).collect()
    })
}
