//! The conditions under which an explanation is reported.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::evidence::{PairedFrames, Sample};
use super::lateness::{is_shifted, reach};
use super::{Correction, Misreading, MisreadingKind};
use crate::{mean, quantile};

/// Greatest error that may remain, metres: about half an arm. A larger one is not explained.
const LEFT_M: f64 = 0.25;
/// Smaller errors need no explanation, metres.
pub(super) const SMALL_M: f64 = 0.01;
/// Least share of the frames in which the explanation must reduce the error.
const NEARLY_ALL: f64 = 0.9;
/// Greatest share of the error in the first frames that may remain.
const AT_FIRST: f64 = 0.7;
/// The first frames: this share of the clip, at least [`FIRST_FRAMES`].
const FIRST_SHARE: f64 = 0.02;
const FIRST_FRAMES: usize = 3;
/// Least offset of another origin, metres; a calibration error moves the whole body by centimetres only.
const OFFSET_M: f64 = 0.2;
/// If the vertical is right, the least error of the body's centroid as read, metres, and the greatest share of it that
/// may remain.
const PATH_M: f64 = 0.25;
const PATH_LEFT: f64 = 0.4;
/// Shifts of fewer frames than this must halve the error.
const FEW_FRAMES: i64 = 3;

impl MisreadingKind {
    /// Greatest error with this part of an explanation, as a share of the error without it.
    fn most_left(self) -> f64 {
        match self {
            Self::Axes | Self::Units => 0.4,
            Self::Offset | Self::Sides => 0.5,
            Self::Shift => 0.65,
            Self::Names => 0.7,
        }
    }
}

/// The explanation with its errors, if it meets every condition.
pub(super) fn judge(evidence: &PairedFrames<'_>, correction: &Correction) -> Option<Misreading> {
    let as_read = Correction::none();
    let pairs = evidence.both(&as_read, correction);
    let [before, after] = means(&pairs)?;
    // parts that undo each other are each needed, but achieve little together
    let whole = correction.kinds().iter().map(|kind| kind.most_left()).fold(0.0, f64::max);
    let every_part = || correction.kinds().iter().all(|kind| is_needed(evidence, correction, *kind));
    let is_met = after <= LEFT_M
        && after <= whole * before
        && every_part()
        && is_throughout(evidence, correction)
        && corrects_path(evidence, correction)
        && (!correction.has(MisreadingKind::Offset) || is_another_origin(evidence, correction))
        && (correction.shift == 0 || is_shifted(evidence, correction));
    is_met.then(|| Misreading {
        correction: correction.clone(),
        error_as_read_m: before,
        error_corrected_m: after,
        longest_shift: reach(evidence) as i64,
    })
}

/// Whether an offset is too large for a calibration error and is not an error of depth. A shift along the rays of all
/// cameras hardly changes the images: a tracker with a single camera makes such errors, and constant ones if its body
/// is too large or too small. If axes or unit are wrong too, the offset is attributed to the file.
fn is_another_origin(evidence: &PairedFrames<'_>, correction: &Correction) -> bool {
    let of_file = correction.has(MisreadingKind::Axes) || correction.has(MisreadingKind::Units);
    let seen = if of_file { correction.offset.norm() } else { evidence.across_rays(&correction.offset) };
    seen >= OFFSET_M
}

/// A sample with its errors before and after the correction.
type SampleErrors = (Sample, f64, f64);

/// The median of `of_one` over repetitions, so that a few lost repetitions do not decide.
fn over_repetitions(pairs: &[SampleErrors], of_one: &dyn Fn(&[SampleErrors]) -> Option<f64>) -> Option<f64> {
    let mut repetitions: BTreeMap<usize, Vec<SampleErrors>> = BTreeMap::new();
    for pair in pairs {
        repetitions.entry(pair.0.seed).or_default().push(*pair);
    }
    let mut all: Vec<f64> = repetitions.values().filter_map(|one| of_one(one)).collect();
    all.sort_by(f64::total_cmp);
    quantile(&all, 0.5)
}

/// Mean errors before and after the correction: medians over repetitions.
fn means(pairs: &[SampleErrors]) -> Option<[f64; 2]> {
    let before = over_repetitions(pairs, &|one| mean(&one.iter().map(|(_, before, _)| *before).collect::<Vec<_>>()))?;
    let after = over_repetitions(pairs, &|one| mean(&one.iter().map(|(.., after)| *after).collect::<Vec<_>>()))?;
    Some([before, after])
}

/// Whether much of the error returns without one part of the explanation.
fn is_needed(evidence: &PairedFrames<'_>, correction: &Correction, kind: MisreadingKind) -> bool {
    let mut less = correction.without(kind);
    // the origin is estimated again for the other axes
    if less.has(MisreadingKind::Offset) {
        less.offset = evidence.offset(&less.without(MisreadingKind::Offset));
    }
    let pairs = evidence.both(&less, correction);
    let few = kind == MisreadingKind::Shift && correction.shift.abs() < FEW_FRAMES;
    let most = if few { 0.5 } else { kind.most_left() };
    means(&pairs).is_some_and(|[without, with]| with <= most * without)
}

/// Whether the error is smaller in nearly all frames, including the first ones. True of a shift alone, which does not
/// change frames without motion and is tested part by part instead.
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

/// Whether axes that keep the vertical correct the path of the body: its position, or its motion if the origin differs.
fn corrects_path(evidence: &PairedFrames<'_>, correction: &Correction) -> bool {
    if !correction.has(MisreadingKind::Axes) || !correction.axes.keeps_vertical() {
        return true;
    }
    let before = path_error(evidence, &correction.without(MisreadingKind::Axes));
    before >= PATH_M && path_error(evidence, correction) <= PATH_LEFT * before
}

/// Mean error of the body's centroid, metres; after removal of the mean difference if the origin differs.
fn path_error(evidence: &PairedFrames<'_>, correction: &Correction) -> f64 {
    let pairs = evidence.centroids(correction);
    let offset = if correction.has(MisreadingKind::Offset) {
        pairs.iter().map(|(truth, found)| truth - found).sum::<Vector3<f64>>() / pairs.len().max(1) as f64
    } else {
        Vector3::zeros()
    };
    let errors: Vec<f64> = pairs.iter().map(|(truth, found)| (truth - found - offset).norm()).collect();
    mean(&errors).unwrap_or(0.0)
}
