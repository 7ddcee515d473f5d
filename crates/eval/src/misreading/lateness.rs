//! Frames that are numbered otherwise.

use nalgebra::Vector3;

use super::evidence::{PairedFrames, Sample, common, thinned};
use super::{Correction, MisreadingKind};
use crate::body::Markers;
use crate::mean;

/// The longest shift that is looked for, seconds.
const LONGEST_S: f64 = 1.0;
/// Frames that are compared at every shift, at most.
const MOST_COMPARED: usize = 60;
/// A tracker that answers while it sees cannot know what comes, but may be late: filters delay by a frame or two. So
/// late an estimate must be in frames, and in seconds, to be told.
const LATE_FRAMES: i64 = 3;
const LATE_S: f64 = 0.05;
/// A filter that delays also smooths: its estimate is the truth and this share of the truth's second difference over
/// the delay. A moving average has about 0.2, an exponential one about 0.5, a shift 0.
const SMOOTHING: f64 = 0.1;
/// In a part that moves, the shift must leave at most this share of the error.
const PART: f64 = 0.85;
/// A part whose markers are nearer than this to where they are after the shift says nothing, metres.
const STILL_M: f64 = 0.02;
/// Parts of the clip, by time.
const STRETCHES: usize = 3;

/// By how many frames the estimate's numbers must be raised to be nearest to the truth, at most a second and a third of
/// the clip; 0 where no shift is better. Where limbs move, their pose about the middle of the body decides: along its
/// path a body that is a few centimetres off seems early or late.
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

/// Whether poses about the middle of the body change within so many frames.
fn limbs_move(evidence: &PairedFrames<'_>, samples: &[Sample], frames: i64) -> bool {
    let truth = evidence.case.truth;
    let moved = |sample: &Sample| {
        let other = truth.get(sample.frame.checked_add_signed(frames as isize)?)?;
        centred_distance(&truth[sample.frame], other)
    };
    mean(&samples.iter().filter_map(moved).collect::<Vec<f64>>()).is_some_and(|moved| moved >= STILL_M)
}

/// Mean distance of the markers in these samples once the middles of the markers coincide, metres.
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

fn reach(evidence: &PairedFrames<'_>) -> usize {
    let longest = LONGEST_S * evidence.case.frames_per_second;
    (longest.min(1e6) as usize).min(evidence.case.truth.len() / 3)
}

/// Samples that have frames of the set so far before and behind them.
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

/// The shift of least error, at most `reach` either way; the smaller wins a tie.
fn nearest(reach: i64, at: &dyn Fn(i64) -> Option<f64>) -> Option<i64> {
    let mut best = (0, at(0)?);
    for shift in (1..=reach).flat_map(|shift| [shift, -shift]) {
        if let Some(error) = at(shift).filter(|error| *error < best.1) {
            best = (shift, error);
        }
    }
    Some(best.0)
}

/// Whether the whole body in the whole clip is early or late by the shift of `correction`, and by more than a filter.
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
    // the trunk with the head, arms, legs, as LANDMARKS has them
    for part in [[0, 1, 14].as_slice(), &[2, 3, 4, 5, 6, 7], &[8, 9, 10, 11, 12, 13]] {
        agrees &= part_agrees(evidence, correction, &inner, &|marker| part.contains(&marker));
    }
    // the shift may have been found together with parts that were left out since
    agrees = agrees && best_shift(evidence, &correction.without(MisreadingKind::Shift)) == shift;
    agrees && (late < 0 || smoothing(evidence, correction, &inner).is_some_and(|share| share < SMOOTHING))
}

/// Whether a part has the same shift, where it moves.
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

/// The share of the truth's second difference over the shift that is best added to the truth to give the estimate.
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
