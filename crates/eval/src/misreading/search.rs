//! The search over all explanations.

use super::evidence::{PairedFrames, samples};
use super::lateness::best_shift;
use super::naming::names;
use super::rule::{SMALL_M, judge};
use super::{AxisOrder, Correction, Misreading, MisreadingCase, MisreadingKind};

/// Least number of samples.
const FEWEST_SAMPLES: usize = 3;
/// A unit is assumed if it explains the body's size to within this factor.
const NEARLY: f64 = 1.3;
/// Number of best explanations by each ranking of axes that are examined further.
const FOLLOWED: usize = 4;
/// An additional part of an explanation must reduce the error by this factor.
const SIMPLER: f64 = 1.1;

/// The explanation of most of the error, if one meets every condition (see the module documentation). A simpler one is
/// preferred to one that is hardly better.
pub fn find_misreading(case: &MisreadingCase<'_>) -> Option<Misreading> {
    let samples = samples(case);
    let evidence = PairedFrames { case, samples: &samples };
    if samples.len() < FEWEST_SAMPLES || evidence.mean_error(&Correction::none()) < SMALL_M {
        return None;
    }
    let mut candidates = Vec::new();
    for base in bases(&evidence) {
        let named = Correction { names: names(&evidence, &base), ..base.clone() };
        let of_names = (named != base).then_some(named);
        for one in std::iter::once(base).chain(of_names) {
            let shifted = Correction { shift: best_shift(&evidence, &one), ..one.clone() };
            let moved = Correction { offset: evidence.offset(&shifted), ..shifted.clone() };
            for found in [one, shifted, moved] {
                with_parts_left_out(&found, &mut candidates);
            }
        }
    }
    let accepted = candidates.iter().filter_map(|candidate| judge(&evidence, candidate));
    accepted.min_by(|one, other| cost(one).total_cmp(&cost(other)))
}

fn cost(misreading: &Misreading) -> f64 {
    let parts = misreading.correction.kinds().len();
    // errors below a millimetre count as equal
    misreading.error_corrected_m.max(0.001) * SIMPLER.powi(i32::try_from(parts).unwrap_or(i32::MAX))
}

/// Adds an explanation, and all subsets of its parts.
fn with_parts_left_out(whole: &Correction, candidates: &mut Vec<Correction>) {
    let kinds = whole.kinds();
    for left_out in 0..1_u32 << kinds.len() {
        let dropped = kinds.iter().enumerate().filter(|(index, _)| left_out >> index & 1 == 1);
        let less = dropped.fold(whole.clone(), |less, (_, kind)| less.without(*kind));
        if !less.kinds().is_empty() && !is_doubtful(&less) && !candidates.contains(&less) {
            candidates.push(less);
        }
    }
}

/// Whether an explanation resembles errors of trackers: a mirror with another origin is a body mirrored in depth, a
/// mirror with exchanged sides is nearly a turned body, and a shift with another origin is a gait that is half a period
/// or a whole one late.
fn is_doubtful(correction: &Correction) -> bool {
    let mirrored = correction.axes.is_mirrored();
    let (elsewhere, shifted) = (correction.has(MisreadingKind::Offset), correction.has(MisreadingKind::Shift));
    mirrored && (elsewhere || correction.swapped) || shifted && elsewhere
}

/// Combinations of units, axes, sides and origin with the least error, after those that only change the unit.
fn bases(evidence: &PairedFrames<'_>) -> Vec<Correction> {
    let mut as_named: Vec<(f64, Correction)> = Vec::new();
    let mut moved = Vec::new();
    let mut by_path = Vec::new();
    let scales = scales(evidence);
    for scale in &scales {
        for axes in AxisOrder::all() {
            let one = Correction { axes, scale: *scale, ..Correction::none() };
            let path = evidence.centroids(&one);
            let off = path.iter().map(|(truth, found)| (truth - found).norm()).sum::<f64>();
            by_path.push((off, one.clone()));
            for swapped in [false, true] {
                let one = Correction { swapped, ..one.clone() };
                as_named.push((evidence.mean_error(&one), one.clone()));
                if !axes.is_mirrored() {
                    let found = Correction { offset: evidence.offset(&one), ..one };
                    moved.push((evidence.mean_error(&found), found));
                }
            }
        }
    }
    let plain = scales.iter().map(|scale| Correction { scale: *scale, ..Correction::none() });
    let mut found: Vec<Correction> = plain.collect();
    for mut ranked in [as_named, moved, by_path] {
        ranked.sort_by(|one, other| one.0.total_cmp(&other.0));
        for (_, one) in ranked.into_iter().take(FOLLOWED) {
            if !found.contains(&one) {
                found.push(one);
            }
        }
    }
    found
}

/// The factors of the unit: the one that fits the size of the body, or all known ones for poses.
fn scales(evidence: &PairedFrames<'_>) -> Vec<f64> {
    let of_case = &evidence.case.scales;
    if evidence.case.given.iter().any(|given| given.roots.is_some()) {
        return std::iter::once(1.0).chain(of_case.iter().copied().filter(|scale| *scale != 1.0)).collect();
    }
    let Some(ratio) = evidence.size_ratio() else { return vec![1.0] };
    let apart = |scale: f64| (ratio / scale).ln().abs();
    let nearest = of_case.iter().copied().chain([1.0]).min_by(|a, b| apart(*a).total_cmp(&apart(*b)));
    vec![nearest.filter(|scale| apart(*scale) < NEARLY.ln()).unwrap_or(1.0)]
}
