//! When an explanation is told.

use std::collections::BTreeMap;

use super::evidence::{PairedFrames, Sample};
use super::lateness::is_shifted;
use super::{Correction, Misreading, MisreadingKind};
use crate::{mean, quantile};

/// No more may be left of the error, metres: about half an arm. What is farther from the truth is not explained.
const LEFT_M: f64 = 0.25;
/// Below this error nothing needs to be explained, metres.
pub(super) const SMALL_M: f64 = 0.01;
/// In so large a share of the frames the explanation must bring the estimate nearer.
const NEARLY_ALL: f64 = 0.9;
/// In the first frames the explanation must leave at most this share of the error.
const AT_FIRST: f64 = 0.7;
/// The frames that count as the first: this share of the clip, and some.
const FIRST_SHARE: f64 = 0.02;
const FIRST_FRAMES: usize = 3;
/// A calibration moves a whole body by centimetres; another origin is farther, metres.
const OFFSET_M: f64 = 0.2;
/// Where the vertical is right, the middle of the body must be so far off as read, metres, and then at most this share
/// of it.
const PATH_M: f64 = 0.25;
const PATH_LEFT: f64 = 0.4;
/// Shifts of fewer frames than this must remove half of the error.
const FEW_FRAMES: i64 = 3;

impl MisreadingKind {
    /// The share of the error without this part of an explanation that may be left with it.
    fn most_left(self) -> f64 {
        match self {
            Self::Axes | Self::Units => 0.4,
            Self::Offset | Self::Sides => 0.5,
            Self::Shift => 0.65,
            Self::Names => 0.7,
        }
    }
}

/// The explanation with its errors, if it keeps every limit.
pub(super) fn judge(evidence: &PairedFrames<'_>, correction: &Correction) -> Option<Misreading> {
    let as_read = Correction::none();
    let pairs = evidence.both(&as_read, correction);
    let [before, after] = means(&pairs)?;
    // parts that undo each other are each needed, and together do little
    let whole = correction.kinds().iter().map(|kind| kind.most_left()).fold(0.0, f64::max);
    let every_part = || correction.kinds().iter().all(|kind| is_needed(evidence, correction, *kind));
    let kept = after <= LEFT_M
        && after <= whole * before
        && every_part()
        && is_throughout(evidence, correction)
        && mends_path(evidence, correction)
        && (!correction.has(MisreadingKind::Offset) || is_another_origin(evidence, correction))
        && (correction.shift == 0 || is_shifted(evidence, correction));
    kept.then(|| Misreading { correction: correction.clone(), error_as_read_m: before, error_corrected_m: after })
}

/// Whether an offset is too large for a calibration, and no error of depth. What moves along the rays of all cameras
/// leaves the images nearly as they are: a tracker with a single camera is off by that, and by the same distance
/// throughout where its body is too large or too small. Axes or a unit that are wrong as well speak for the file.
fn is_another_origin(evidence: &PairedFrames<'_>, correction: &Correction) -> bool {
    let of_file = correction.has(MisreadingKind::Axes) || correction.has(MisreadingKind::Units);
    let seen = if of_file { correction.offset.norm() } else { evidence.across_rays(&correction.offset) };
    seen >= OFFSET_M
}

/// A sample with its errors before and after.
type SampleErrors = (Sample, f64, f64);

/// The median over repetitions of some number of each: a few that are lost do not decide.
fn over_repetitions(pairs: &[SampleErrors], of_one: &dyn Fn(&[SampleErrors]) -> Option<f64>) -> Option<f64> {
    let mut repetitions: BTreeMap<usize, Vec<SampleErrors>> = BTreeMap::new();
    for pair in pairs {
        repetitions.entry(pair.0.seed).or_default().push(*pair);
    }
    let mut all: Vec<f64> = repetitions.values().filter_map(|one| of_one(one)).collect();
    all.sort_by(f64::total_cmp);
    quantile(&all, 0.5)
}

/// Mean errors before and after, of the repetitions' median.
fn means(pairs: &[SampleErrors]) -> Option<[f64; 2]> {
    let before = over_repetitions(pairs, &|one| mean(&one.iter().map(|(_, before, _)| *before).collect::<Vec<_>>()))?;
    let after = over_repetitions(pairs, &|one| mean(&one.iter().map(|(.., after)| *after).collect::<Vec<_>>()))?;
    Some([before, after])
}

/// Whether much of the error comes back without a part of the explanation.
fn is_needed(evidence: &PairedFrames<'_>, correction: &Correction, kind: MisreadingKind) -> bool {
    let mut less = correction.without(kind);
    // the origin is found again for the other axes
    if less.has(MisreadingKind::Offset) {
        less.offset = evidence.offset(&less.without(MisreadingKind::Offset));
    }
    let pairs = evidence.both(&less, correction);
    let few = kind == MisreadingKind::Shift && correction.shift.abs() < FEW_FRAMES;
    let most = if few { 0.5 } else { kind.most_left() };
    means(&pairs).is_some_and(|[without, with]| with <= most * without)
}

/// Whether the estimate is nearer in nearly all frames, and from the first ones on. A shift of its own leaves frames in
/// which nothing moves as they are, and is judged by its parts instead.
fn is_throughout(evidence: &PairedFrames<'_>, correction: &Correction) -> bool {
    let as_numbered = correction.without(MisreadingKind::Shift);
    if as_numbered.kinds().is_empty() {
        return true;
    }
    let as_read = Correction { shift: correction.shift, ..Correction::none() };
    let pairs = evidence.both(&as_read, correction);
    let share_nearer = over_repetitions(&pairs, &|one| {
        let nearer = one.iter().filter(|(_, before, after)| after < before).count();
        Some(nearer as f64 / one.len() as f64)
    });
    let last = FIRST_FRAMES.max((FIRST_SHARE * evidence.case.truth.len() as f64) as usize);
    let begin = pairs.iter().map(|(sample, ..)| sample.frame).min().unwrap_or(0);
    let mut ratios: Vec<f64> = pairs
        .iter()
        .filter(|(sample, ..)| sample.frame <= begin + last)
        .map(|(_, before, after)| after / before.max(f64::MIN_POSITIVE))
        .collect();
    ratios.sort_by(f64::total_cmp);
    share_nearer.is_some_and(|share| share >= NEARLY_ALL)
        && quantile(&ratios, 0.5).is_some_and(|ratio| ratio <= AT_FIRST)
}

/// Whether axes that keep the vertical mend the path of the body: where it is, or with another origin how it moves.
fn mends_path(evidence: &PairedFrames<'_>, correction: &Correction) -> bool {
    if !correction.has(MisreadingKind::Axes) || !correction.axes.keeps_vertical() {
        return true;
    }
    let off = |correction: &Correction| {
        let pairs = evidence.centroids(correction);
        let middle = if correction.has(MisreadingKind::Offset) {
            pairs.iter().map(|(truth, found)| truth - found).sum::<nalgebra::Vector3<f64>>() / pairs.len().max(1) as f64
        } else {
            nalgebra::Vector3::zeros()
        };
        let apart: Vec<f64> = pairs.iter().map(|(truth, found)| (truth - found - middle).norm()).collect();
        mean(&apart).unwrap_or(0.0)
    };
    let other = correction.without(MisreadingKind::Axes);
    let (before, after) = (off(&other), off(correction));
    before >= PATH_M && after <= PATH_LEFT * before
}
