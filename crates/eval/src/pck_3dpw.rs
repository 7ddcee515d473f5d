//! PCK and its area as computed by the 3DPW challenge: twelve limb joints, relative to the midpoint of the hips.

use skiagraph_core::body::{LANDMARKS, Landmark};

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;

const THRESHOLD_MM: f64 = 50.0;
/// Tolerance for rounding of positions, far below any measurement error.
const ROUNDING_MM: f64 = 1e-9;
/// Thresholds of the area: 0, 1, ... 199 mm.
const LAST_MM: u32 = 199;

pub(super) const PCK: Metric = Metric {
    name: "pck50_3dpw",
    title: "Limb joints within 50 mm (3DPW's PCK)",
    meaning: "Share of the joints of arms and legs that are at most 50 mm off relative to the hips, as 3DPW counts",
    unit: Unit::Fraction,
    direction: Direction::HigherIsBetter,
    needs: "both hips and a joint of a limb in truth and estimate",
    protocol: "share of the 12 joints of the limbs at most 50 mm from the truth, relative to the middle of each skeleton's own \
               hips, as 3DPW's code computes it; a joint missing in the estimate counts as wrong; mean of frame means",
    measure: |sequence| per_frame(sequence, |distance| f64::from(u8::from(distance <= THRESHOLD_MM))),
};

pub(super) const AUC: Metric = Metric {
    name: "auc200_3dpw",
    title: "Area under 3DPW's PCK curve",
    meaning: "Share of the joints within a distance, averaged over distances up to 199 mm, as 3DPW counts",
    unit: Unit::Fraction,
    direction: Direction::HigherIsBetter,
    needs: "both hips and a joint of a limb in truth and estimate",
    protocol: "area under PCK over thresholds of 0 to 199 mm in steps of 1 mm (trapezoids, divided by 199), 12 joints of the \
               limbs relative to the middle of each skeleton's own hips; a joint missing in the estimate counts as wrong; \
               mean of frame means",
    measure: area,
};

/// Mean area of the joints' step functions: 1 from the first integer threshold that is not below the distance.
fn area(sequence: &Sequence<'_>) -> Option<Measurement> {
    per_frame(sequence, |distance| {
        // a distance that is an integer except for rounding counts at that threshold
        let first = libm::ceil(distance - ROUNDING_MM).max(0.0);
        let last = f64::from(LAST_MM);
        match first {
            0.0 => 1.0,
            first if first > last => 0.0,
            first => (last - first + 0.5) / last,
        }
    })
}

/// Mean over frames of the mean over joints of `score(distance)`; 0 for a joint that the estimate lacks.
fn per_frame(sequence: &Sequence<'_>, score: impl Fn(f64) -> f64) -> Option<Measurement> {
    let measured = sequence.per_scored_frame(|frame| {
        let (truth, estimate) = (sequence.truth_markers.frame(frame), sequence.estimate_markers.frame(frame));
        let middle = |markers: &skiagraph_core::body::Markers| {
            let [left, right] = [Landmark::LeftHip, Landmark::RightHip].map(|hip| markers[hip as usize]);
            Some(nalgebra::center(&left?, &right?))
        };
        let of_truth = middle(&truth)?;
        let of_estimate = middle(&estimate);
        mean_of(LANDMARKS.iter().filter(|landmark| landmark.is_on_limb()).filter_map(|joint| {
            let place = truth[*joint as usize]?;
            let found = of_estimate.zip(estimate[*joint as usize]);
            Some(found.map_or(0.0, |(root, found)| score(1000.0 * ((found - root) - (place - of_truth)).norm())))
        }))
    });
    Some(Measurement::PerFrame(measured))
}
