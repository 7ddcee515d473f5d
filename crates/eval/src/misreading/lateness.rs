//! Shifted frame numbers.

use nalgebra::Vector3;

use super::evidence::{PairedFrames, Sample, common, thinned};
use super::{Correction, MisreadingKind};
use crate::body::Markers;
use crate::mean;

/// Greatest shift that is searched, seconds.
const LONGEST_S: f64 = 1.0;
/// Greatest number of frames that are compared at each shift.
const MOST_COMPARED: usize = 60;
/// Least delay that is reported, frames and seconds: an online tracker cannot be early, but filters delay it by a frame
/// or two.
const LATE_FRAMES: i64 = 3;
const LATE_S: f64 = 0.05;
/// A filter that delays also smooths: its estimate is the delayed truth plus a share of the truth's second difference
/// over the delay. The share is about 0.2 for a moving average, 0.5 for an exponential one and 0 for a shift; a shift
/// must have less than this.
const SMOOTHING: f64 = 0.1;
/// Greatest share of the error of a moving part that may remain after the shift.
const PART: f64 = 0.85;
/// A part whose markers move less than this during the shift is not evidence, metres.
const STILL_M: f64 = 0.02;
/// Number of parts of the clip, by time.
const STRETCHES: usize = 3;

/// The shift of the estimate's frame numbers that brings it nearest to the truth, at most a second and a third of the
/// clip; 0 if no shift is better. If limbs move, their positions relative to the body's centroid decide, because a body
/// that is a few centimetres off along its path seems early or late.
pub(super) fn best_shift(evidence: &PairedFrames<'_>, correction: &Correction) -> i64 {
    let reach = reach(evidence);
    let inner = inner(evidence, reach);
    let at = |shift: i64, centred: bool| {
        let counts: &dyn Fn(usize) -> bool = &|_| true;
        let shifted = Correction { shift, ..correction.clone() };
        if centred { centred_error(evidence, &shifted, &inner) } else { error(evidence, &shifted, &inner, counts) }
    };
    let whole = nearest(reach as i64, &|shift| at(shift, false)).unwrap_or(0);
    if whole != 0 && limbs_move(evidence, &inner, whole) {
        return nearest(reach as i64, &|shift| at(shift, true)).unwrap_or(0);
    }
    whole
}

/// Whether the positions of markers relative to their centroid change within `frames`.
fn limbs_move(evidence: &PairedFrames<'_>, samples: &[Sample], frames: i64) -> bool {
    let truth = evidence.case.truth;
    let moved = |sample: &Sample| {
        let other = truth.get(sample.frame.checked_add_signed(frames as isize)?)?;
        centred_distance(&truth[sample.frame], other)
    };
    mean(&samples.iter().filter_map(moved).collect::<Vec<f64>>()).is_some_and(|moved| moved >= STILL_M)
}

/// Mean distance of the markers in these samples after their centroids are aligned, metres.
fn centred_error(evidence: &PairedFrames<'_>, correction: &Correction, samples: &[Sample]) -> Option<f64> {
    let of_sample = |sample: &Sample| {
        let (truth, estimate) = evidence.read(*sample, correction)?;
        centred_distance(truth, &estimate)
    };
    mean(&samples.iter().filter_map(of_sample).collect::<Vec<f64>>())
}

fn centred_distance(one: &Markers, other: &Markers) -> Option<f64> {
    let apart: Vec<Vector3<f64>> = common(one, other).map(|(_, a, b)| a - b).collect();
    let middle = apart.iter().sum::<Vector3<f64>>() / apart.len().max(1) as f64;
    mean(&apart.iter().map(|apart| (apart - middle).norm()).collect::<Vec<f64>>())
}

pub(super) fn reach(evidence: &PairedFrames<'_>) -> usize {
    let longest = LONGEST_S * evidence.case.frames_per_second;
    (longest.min(1e6) as usize).min(evidence.case.truth.len() / 3)
}

/// Samples that are at least `reach` frames from either end of the set.
fn inner(evidence: &PairedFrames<'_>, reach: usize) -> Vec<Sample> {
    let frames = evidence.case.truth.len();
    let is_inner = |sample: &&Sample| sample.frame > reach && sample.frame + reach < frames;
    let all: Vec<Sample> = evidence.samples.iter().filter(is_inner).copied().collect();
    thinned(&all, MOST_COMPARED)
}

/// Mean distance of some of the markers in these samples, metres.
fn error(
    evidence: &PairedFrames<'_>,
    correction: &Correction,
    samples: &[Sample],
    counts: &dyn Fn(usize) -> bool,
) -> Option<f64> {
    let of_sample = |sample: &Sample| {
        let (truth, estimate) = evidence.read(*sample, correction)?;
        let apart = common(truth, &estimate).filter(|(marker, ..)| counts(*marker)).map(|(_, a, b)| (a - b).norm());
        mean(&apart.collect::<Vec<f64>>())
    };
    mean(&samples.iter().filter_map(of_sample).collect::<Vec<f64>>())
}

/// The shift of least error, at most `reach` in either direction; of equal ones the smaller.
fn nearest(reach: i64, at: &dyn Fn(i64) -> Option<f64>) -> Option<i64> {
    let mut best = (0, at(0)?);
    for shift in (1..=reach).flat_map(|shift| [shift, -shift]) {
        if let Some(error) = at(shift).filter(|error| *error < best.1) {
            best = (shift, error);
        }
    }
    Some(best.0)
}

/// Whether all parts of the body in all parts of the clip are early or late by the shift of `correction`, and by more
/// than a filter's delay.
pub(super) fn is_shifted(evidence: &PairedFrames<'_>, correction: &Correction) -> bool {
    let shift = correction.shift;
    let late = -shift;
    if late > 0 && (late < LATE_FRAMES || (late as f64) < LATE_S * evidence.case.frames_per_second) {
        return false;
    }
    let inner = inner(evidence, reach(evidence));
    let stretch = inner.len().div_ceil(STRETCHES).max(1);
    let everything: &dyn Fn(usize) -> bool = &|_| true;
    let mut agrees = inner.chunks(stretch).all(|part| part_agrees(evidence, correction, part, everything));
    // trunk and head, arms, legs: indices in LANDMARKS
    for part in [[0, 1, 14].as_slice(), &[2, 3, 4, 5, 6, 7], &[8, 9, 10, 11, 12, 13]] {
        agrees &= part_agrees(evidence, correction, &inner, &|marker| part.contains(&marker));
    }
    // the shift may have been found with parts that `correction` omits
    agrees = agrees && best_shift(evidence, &correction.without(MisreadingKind::Shift)) == shift;
    agrees && (late < 0 || smoothing(evidence, correction, &inner).is_some_and(|share| share < SMOOTHING))
}

/// Whether a part has the same shift or does not move.
fn part_agrees(
    evidence: &PairedFrames<'_>,
    correction: &Correction,
    samples: &[Sample],
    counts: &dyn Fn(usize) -> bool,
) -> bool {
    let shift = correction.shift;
    let truth = evidence.case.truth;
    let moved = |sample: &Sample| {
        let other = truth.get(sample.frame.checked_add_signed(shift as isize)?)?;
        let apart = common(&truth[sample.frame], other).filter(|(m, ..)| counts(*m)).map(|(_, a, b)| (a - b).norm());
        mean(&apart.collect::<Vec<f64>>())
    };
    let moved = mean(&samples.iter().filter_map(moved).collect::<Vec<f64>>());
    if moved.is_none_or(|moved| moved < STILL_M) {
        return true;
    }
    let as_numbered = Correction { shift: 0, ..correction.clone() };
    let errors = [correction, &as_numbered].map(|read| error(evidence, read, samples, counts));
    let [Some(shifted), Some(as_numbered)] = errors else { return true };
    let tolerance = (shift.abs() / 4).max(1);
    let at = |shift: i64| error(evidence, &Correction { shift, ..correction.clone() }, samples, counts);
    let nearest = nearest(shift.abs() + tolerance + 1, &at);
    shifted <= PART * as_numbered && nearest.is_some_and(|nearest| (nearest - shift).abs() <= tolerance)
}

/// The share of the truth's second difference over the shift that, added to the shifted truth, fits the estimate best.
fn smoothing(evidence: &PairedFrames<'_>, correction: &Correction, samples: &[Sample]) -> Option<f64> {
    let (truth, reach) = (evidence.case.truth, correction.shift.unsigned_abs() as usize);
    let (mut both, mut square) = (0.0, 0.0);
    for sample in samples {
        let Some((middle, estimate)) = evidence.read(*sample, correction) else { continue };
        let ends = [sample.frame.checked_sub(reach), sample.frame.checked_add(reach)];
        let [Some(before), Some(after)] = ends.map(|frame| truth.get(frame?)) else { continue };
        for (marker, there, found) in common(middle, &estimate) {
            let [Some(before), Some(after)] = [before[marker], after[marker]] else { continue };
            let bend = (before - there) + (after - there);
            both += bend.dot(&(found - there));
            square += bend.norm_squared();
        }
    }
    (square > 0.0).then(|| both / square)
}
