//! The difference of two sides' means over clips, with its 95 % interval.
//!
//! The unit is the run (clip x seed), never the frame. Where both sides share most seeds of every clip ([`do_pair`]),
//! runs are paired and seeds of one side alone left out, if the pairs tell more than all runs: the differences of the
//! pairs are summarised like any values ([`mean_interval`]). Else the sides are independent: their values, those of the
//! base with the opposite sign, are strata of one mean, whose interval is Welch's (`[Welch 1938]`) below ten runs a
//! clip and side and the stratified BCa bootstrap from ten on.

use std::fmt;

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::evaluation::interval::{FEWEST_RUNS, IntervalRule, ValueRange, are_equal, mean_interval};
use crate::evaluation::statistics::variance;
use crate::evaluation::student::{freedom_of_mean, mean_of_means};
use crate::evaluation::{Interval, change, mean};

/// Values of one clip, with their seeds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClipValues {
    /// Of the base.
    pub base: Vec<(u64, f64)>,
    /// Of the other side.
    pub other: Vec<(u64, f64)>,
}

/// How a difference and its interval were made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DifferenceRule {
    /// No run differs from its pair, or all pairs of a clip by the same, or no seed from another on either side:
    /// nothing varies.
    Exact,
    /// Student's t on the differences of pairs.
    PairedT,
    /// BCa bootstrap of the differences of pairs.
    PairedBootstrap,
    /// Welch's t.
    Welch,
    /// BCa bootstrap, stratified by clip and side.
    Bootstrap,
    /// Too few runs for an interval.
    TooFew,
}

impl fmt::Display for DifferenceRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Exact => "exact: no run varies",
            Self::PairedT => "Student's t on pairs of clip x seed",
            Self::PairedBootstrap => "BCa bootstrap of pairs of clip x seed",
            Self::Welch => "Welch's t, unpaired",
            Self::Bootstrap => "BCa bootstrap, unpaired, stratified by clip",
            Self::TooFew => "too few seeds for an interval",
        })
    }
}

/// Other minus base, of means over clips of each clip's mean over seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Mean of the base.
    pub base: f64,
    /// Mean of the other side.
    pub other: f64,
    /// Other minus base.
    pub difference: f64,
    /// 95 % interval of the difference; `None` for too few runs, and where nothing varies.
    pub ci95: Option<Interval>,
    /// Two-sided p value of Student's (paired) or Welch's t test; `None` where there is no interval.
    pub p: Option<f64>,
    /// Standard error of the difference; `None` where there is no interval.
    pub standard_error: Option<f64>,
    /// Its degrees of freedom.
    pub freedom: Option<f64>,
    /// How the interval was made.
    pub rule: DifferenceRule,
    /// Runs of the base and of the other side.
    pub runs: [usize; 2],
}

impl Difference {
    /// One-sided p value of the t test that the true difference is at most `limit`; `None` without a standard error.
    pub fn p_above(&self, limit: f64) -> Option<f64> {
        let t = StudentsT::new(0.0, 1.0, self.freedom?).ok()?;
        Some(t.sf((self.difference - limit) / self.standard_error?))
    }
}

/// Fewest seeds in common that are paired where either side has others, too.
const FEWEST_IN_COMMON: usize = 3;

/// Whether runs of two sides with these seeds are paired: those of the same seeds, and those that have at least three
/// in common and no more than as many others on either side.
pub fn do_pair(base: &[u64], other: &[u64]) -> bool {
    let common = base.iter().filter(|seed| other.contains(seed)).count();
    let most = base.len().max(other.len());
    common == most || (common >= FEWEST_IN_COMMON && 2 * common >= most)
}

/// The difference over these clips, runs paired where both sides share most seeds; `None` if a clip lacks a value on
/// either side, or there is no clip. Where a side has further seeds, whichever has the smaller standard error: the
/// pairs, or all runs without pairs.
pub fn difference(clips: &[ClipValues]) -> Option<Difference> {
    let common: Option<Vec<ClipValues>> = clips.iter().map(ClipValues::in_common).collect();
    let Some(common) = common else { return difference_of(clips, None) };
    let paired = difference_of(&common, Some(common.iter().map(pairs).collect()))?;
    let left_out = clips
        .iter()
        .zip(&common)
        .any(|(all, common)| all.base.len() > common.base.len() || all.other.len() > common.other.len());
    let whole = difference_of(clips, None).filter(|_| left_out);
    let tells_more = |whole: &Difference| match (whole.standard_error, paired.standard_error) {
        (Some(whole), Some(paired)) => whole < paired,
        _ => false,
    };
    Some(whole.filter(tells_more).unwrap_or(paired))
}

/// As [`difference`], of sides whose seeds have nothing in common even where they are the same numbers: of runs on
/// other sets.
pub fn independent_difference(clips: &[ClipValues]) -> Option<Difference> {
    difference_of(clips, None)
}

fn difference_of(clips: &[ClipValues], pairs: Option<Vec<Vec<f64>>>) -> Option<Difference> {
    if clips.is_empty() || clips.iter().any(|clip| clip.base.is_empty() || clip.other.is_empty()) {
        return None;
    }
    let of_side = |side: fn(&ClipValues) -> &Vec<(u64, f64)>| -> Vec<Vec<f64>> {
        clips.iter().map(|clip| side(clip).iter().map(|(_, value)| *value).collect()).collect()
    };
    let (base, other) = (of_side(|clip| &clip.base), of_side(|clip| &clip.other));
    let strata = match &pairs {
        Some(pairs) => Strata { values: pairs.clone(), scale: 1.0 },
        None => Strata::from_independent(&base, &other),
    };
    let whole = (mean_of_means(&base)?, mean_of_means(&other)?);
    let nothing = Difference {
        base: whole.0,
        other: whole.1,
        difference: change(whole.0, whole.1),
        ci95: None,
        p: None,
        standard_error: None,
        freedom: None,
        rule: DifferenceRule::TooFew,
        runs: [&base, &other].map(|side| side.iter().map(Vec::len).sum()),
    };
    let unchanged = pairs.as_ref().is_some_and(|pairs| pairs.iter().flatten().all(|d| *d == 0.0));
    let several = clips.iter().all(|clip| clip.base.len() > 1 && clip.other.len() > 1);
    let alike = pairs.as_ref().is_some_and(|pairs| are_equal(pairs)) || (are_equal(&base) && are_equal(&other));
    if unchanged || (several && alike) {
        return Some(Difference { rule: DifferenceRule::Exact, ..nothing });
    }
    // both sides together may have three runs where neither has
    if pairs.is_none() && nothing.runs.iter().any(|runs| *runs < FEWEST_RUNS) {
        return Some(nothing);
    }
    Some(strata.completed(nothing, pairs.is_some()))
}

impl ClipValues {
    /// The runs of seeds that both sides have, by seed; `None` where runs are not paired.
    fn in_common(&self) -> Option<Self> {
        let seeds = |side: &[(u64, f64)]| side.iter().map(|(seed, _)| *seed).collect::<Vec<u64>>();
        let [base, other] = [&self.base, &self.other].map(|side| seeds(side));
        let shared = |side: &[(u64, f64)], there: &[u64]| {
            let mut shared: Vec<_> = side.iter().copied().filter(|(seed, _)| there.contains(seed)).collect();
            shared.sort_by_key(|(seed, _)| *seed);
            shared
        };
        do_pair(&base, &other).then(|| Self { base: shared(&self.base, &other), other: shared(&self.other, &base) })
    }
}

/// Other minus base, seed by seed, of runs in the order of the same seeds.
fn pairs(clip: &ClipValues) -> Vec<f64> {
    clip.base.iter().zip(&clip.other).map(|((_, base), (_, other))| change(*base, *other)).collect()
}

/// Lists whose mean of means, times `scale`, is the difference.
struct Strata {
    values: Vec<Vec<f64>>,
    scale: f64,
}

impl Strata {
    /// The values of both sides, those of the base negated: twice their mean of means is the difference.
    fn from_independent(base: &[Vec<f64>], other: &[Vec<f64>]) -> Self {
        let negated = base.iter().map(|values| values.iter().map(|value| -value).collect());
        Self { values: negated.chain(other.iter().cloned()).collect(), scale: 2.0 }
    }

    fn completed(&self, nothing: Difference, paired: bool) -> Difference {
        let Some((ends, rule)) = mean_interval(&self.values, ValueRange::Any) else { return nothing };
        let Some((standard_error, freedom)) = self.standard_error() else { return nothing };
        let rule = match (rule, paired) {
            (IntervalRule::Bootstrap, true) => DifferenceRule::PairedBootstrap,
            (IntervalRule::Bootstrap, false) => DifferenceRule::Bootstrap,
            (_, true) => DifferenceRule::PairedT,
            (_, false) => DifferenceRule::Welch,
        };
        let two_sided = |freedom: f64| {
            let t = StudentsT::new(0.0, 1.0, freedom).ok()?;
            Some((2.0 * t.sf((nothing.difference / standard_error).abs())).min(1.0))
        };
        Difference {
            ci95: Some(Interval { low: self.scale * ends.low, high: self.scale * ends.high }),
            p: two_sided(freedom),
            standard_error: Some(standard_error),
            freedom: Some(freedom),
            rule,
            ..nothing
        }
    }

    fn standard_error(&self) -> Option<(f64, f64)> {
        let squares: Option<Vec<f64>> =
            self.values.iter().map(|values| Some(variance(values)? / values.len() as f64)).collect();
        let squares = squares?;
        let of_mean = squares.iter().sum::<f64>().sqrt() / squares.len() as f64;
        mean(&squares).filter(|spread| *spread > 0.0)?;
        Some((self.scale * of_mean, freedom_of_mean(&self.values)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(base: &[f64], other: &[f64], first_other_seed: u64) -> ClipValues {
        let seeds = |values: &[f64], first: u64| (first..).zip(values.iter().copied()).collect();
        ClipValues { base: seeds(base, 0), other: seeds(other, first_other_seed) }
    }

    /// `scipy.stats.ttest_rel([32, 35, 31, 36, 33], [30, 31, 29, 32, 30])`: t = 6.7082, p = 0.002571; the mean
    /// difference is 3, its standard deviation 1.
    #[test]
    fn pairs_give_the_paired_t_interval_of_the_textbook() {
        let found = difference(&[clip(&[30.0, 31.0, 29.0, 32.0, 30.0], &[32.0, 35.0, 31.0, 36.0, 33.0], 0)]).unwrap();
        assert_eq!((found.difference, found.rule, found.freedom), (3.0, DifferenceRule::PairedT, Some(4.0)));
        let half = 2.776_445 * (1.0_f64 / 5.0).sqrt();
        let Interval { low, high } = found.ci95.unwrap();
        assert!((low - (3.0 - half)).abs() < 1e-5 && (high - (3.0 + half)).abs() < 1e-5, "{low} {high}");
        assert!((found.p.unwrap() - 0.002_571).abs() < 1e-6, "{:?}", found.p);
    }

    #[test]
    fn two_runs_a_side_have_no_unpaired_interval() {
        let of = |base: &[f64], other: &[f64]| difference(&[clip(base, other, 100)]).unwrap();
        for few in [of(&[1.0, 2.0], &[5.0, 7.0]), of(&[1.0, 2.0, 4.0], &[5.0, 7.0])] {
            assert_eq!((few.rule, few.ci95, few.p), (DifferenceRule::TooFew, None, None));
        }
        assert_eq!(of(&[1.0, 2.0, 4.0], &[5.0, 7.0, 8.0]).rule, DifferenceRule::Welch);
        let two_clips = [clip(&[1.0, 2.0], &[5.0, 7.0], 100), clip(&[3.0, 2.0], &[5.0, 8.0], 100)];
        assert_eq!(difference(&two_clips).unwrap().rule, DifferenceRule::Welch, "four runs a side");
        let same_sets = independent_difference(&[clip(&[1.0, 2.0], &[5.0, 7.0], 0)]).unwrap();
        assert_eq!(same_sets.rule, DifferenceRule::TooFew);
    }

    /// Welch's own statistic by hand: means 2 and 6, variances 1 and 4, n = 3 and 5: se^2 = 1/3 + 4/5,
    /// df = se^4 / ((1/3)^2 / 2 + (4/5)^2 / 4).
    #[test]
    fn other_seeds_give_welchs_interval_worked_by_hand() {
        let other = [6.0 - 2.0_f64.sqrt() * 2.0, 6.0, 6.0, 6.0, 6.0 + 2.0_f64.sqrt() * 2.0];
        let found = difference(&[clip(&[1.0, 2.0, 3.0], &other, 100)]).unwrap();
        let squared = 1.0 / 3.0 + 4.0 / 5.0;
        let freedom = squared * squared / (1.0 / 18.0 + 0.16);
        assert_eq!(found.rule, DifferenceRule::Welch);
        assert!((found.standard_error.unwrap() - f64::sqrt(squared)).abs() < 1e-12);
        assert!((found.freedom.unwrap() - freedom).abs() < 1e-9 && (found.difference - 4.0).abs() < 1e-12);
        let t = StudentsT::new(0.0, 1.0, freedom).unwrap().inverse_cdf(0.975);
        let ends = found.ci95.unwrap();
        assert!((ends.high - ends.low - 2.0 * t * f64::sqrt(squared)).abs() < 1e-9, "{ends:?}");
        let above = found.p_above(0.0).unwrap();
        assert!((2.0 * above - found.p.unwrap()).abs() < 1e-12, "half of the two-sided one");
    }

    #[test]
    fn seeds_in_common_are_paired_where_they_are_most_and_tell_more() {
        let more = difference(&[clip(&[1.0, 2.0, 4.0], &[1.5, 2.4, 4.6, 90.0, 80.0], 0)]).unwrap();
        let opposite =
            difference(&[clip(&[1.0, 2.0, 3.0, 4.0, 5.0], &[5.0, 4.0, 3.0, 2.0, 1.0, 3.0, 3.0], 0)]).unwrap();
        assert_eq!((opposite.rule, opposite.runs), (DifferenceRule::Welch, [5, 7]), "pairs differ more than runs");
        assert_eq!((more.rule, more.runs), (DifferenceRule::PairedT, [3, 3]));
        assert!((more.difference - 0.5).abs() < 1e-12, "{more:?}");
        let few = difference(&[clip(&[1.0, 2.0, 4.0], &[1.5, 2.4, 4.6, 9.0, 8.0, 7.0, 6.0], 0)]).unwrap();
        assert_eq!((few.rule, few.runs), (DifferenceRule::Welch, [3, 7]));
        let shifted = difference(&[clip(&[1.0, 2.0, 4.0, 3.0], &[4.6, 9.0, 8.0, 7.0], 2)]).unwrap();
        assert_eq!(shifted.rule, DifferenceRule::Welch, "two in common");
    }

    #[test]
    fn what_differs_by_round_off_alone_does_not_differ() {
        let values = [116.4, 117.2, 115.9];
        let moved = values.map(|value| value + 8e-14);
        let same = difference(&[clip(&values, &moved, 0)]).unwrap();
        assert_eq!((same.difference, same.rule), (0.0, DifferenceRule::Exact));
    }

    #[test]
    fn clips_count_alike_however_many_seeds_they_have() {
        let clips = [clip(&[1.0, 3.0], &[2.0, 4.0], 9), clip(&[10.0; 4], &[14.0, 13.0, 15.0, 14.0], 9)];
        let found = difference(&clips).unwrap();
        assert!((found.base - 6.0).abs() < 1e-12 && (found.difference - 2.5).abs() < 1e-12, "{found:?}");
        assert_eq!(found.runs, [6, 6]);
    }

    #[test]
    fn from_ten_runs_on_it_is_a_bootstrap_near_the_t_interval() {
        let base: Vec<f64> = (0..12).map(|i| 30.0 + f64::from(i % 5)).collect();
        let other: Vec<f64> = (0..12).map(|i| 34.0 + f64::from((i * 7) % 5)).collect();
        let found = difference(&[clip(&base, &other, 50)]).unwrap();
        assert_eq!(found.rule, DifferenceRule::Bootstrap);
        let (ends, se) = (found.ci95.unwrap(), found.standard_error.unwrap());
        assert!((ends.high - ends.low - 2.0 * 2.08 * se).abs() < 0.15 * 2.0 * 2.08 * se, "{ends:?} {se}");
        assert!(ends.low < found.difference && found.difference < ends.high);
    }

    #[test]
    fn the_same_runs_and_runs_that_never_vary_are_compared_exactly() {
        let same = difference(&[clip(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0], 0)]).unwrap();
        assert_eq!((same.difference, same.rule, same.ci95), (0.0, DifferenceRule::Exact, None));
        let constant = difference(&[clip(&[1.0; 3], &[1.5; 3], 7)]).unwrap();
        assert_eq!((constant.difference, constant.rule), (0.5, DifferenceRule::Exact));
    }

    #[test]
    fn one_seed_has_a_difference_and_no_interval_and_a_missing_clip_nothing() {
        let one = difference(&[clip(&[1.0], &[3.0], 0)]).unwrap();
        assert_eq!((one.difference, one.ci95, one.rule), (2.0, None, DifferenceRule::TooFew));
        assert_eq!(difference(&[clip(&[1.0], &[], 0)]), None);
        assert_eq!(difference(&[]), None);
    }
}
