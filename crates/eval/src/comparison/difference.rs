//! The difference of two sides' means over clips, with its 95 % interval.
//!
//! The unit is a seed, a draw of the observation's noise or a clip ([`IntervalUnit`]), never the frame. Pairing depends
//! only on the common units of both sides ([`should_pair`]), not on values: choosing the narrower interval would make
//! false alarms more frequent than stated. For pairs, units of only one side are omitted, and the differences have
//! Student's t interval ([`mean_interval`]). Otherwise the sides are independent: their values, negated for the base,
//! are strata of one mean with Welch's interval (`[Welch 1938]`).

use std::fmt;

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::IntervalUnit;
use crate::interval::{FEWEST_RUNS, ValueRange, are_equal, mean_interval};
use crate::statistics::variance;
use crate::student::{freedom_of_mean, mean_of_means};
use crate::{Interval, change, mean};

/// Values of one stratum (a set for seeds, a clip for draws, all clips together), with the keys of their pairs: seeds,
/// or numbers of draws or clips.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClipValues {
    /// Values of the base.
    pub base: Vec<(u64, f64)>,
    /// Values of the other side.
    pub other: Vec<(u64, f64)>,
}

/// How a difference and its interval were made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DifferenceRule {
    /// Nothing varies: all pairs of a clip have the same difference, or all seeds of each side have the same value.
    Exact,
    /// Student's t on the differences of pairs.
    PairedT,
    /// Welch's t.
    Welch,
    /// Too few runs for an interval.
    TooFew,
}

/// Difference, other minus base, of the means over clips of each clip's mean over seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Difference {
    /// Mean of the base.
    pub base: f64,
    /// Mean of the other side.
    pub other: f64,
    /// Other minus base.
    pub difference: f64,
    /// 95 % interval of the difference; `None` for too few runs, and if nothing varies.
    pub ci95: Option<Interval>,
    /// Two-sided p value of the t test of the interval, below 5 % if the interval excludes 0. If nothing varies and
    /// both sides differ, it is that of the sign test of pairs or of the rank test of both sides. `None` for too few
    /// runs.
    pub p: Option<f64>,
    /// Standard error of the difference; `None` without an interval.
    pub standard_error: Option<f64>,
    /// Its degrees of freedom.
    pub freedom: Option<f64>,
    /// How the interval was made.
    pub rule: DifferenceRule,
    /// Unit of the interval.
    #[serde(default)]
    pub over: IntervalUnit,
    /// Number of values of the base and of the other side: seeds, draws or clips.
    pub runs: [usize; 2],
}

impl fmt::Display for Difference {
    /// How the interval was made: `Student's t on 10 pairs of seeds`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([base, other], unit) = (self.runs, self.over);
        match self.rule {
            DifferenceRule::Exact => write!(f, "exact: no run varies"),
            DifferenceRule::PairedT => write!(f, "Student's t on {base} pairs of {unit}"),
            DifferenceRule::Welch => write!(f, "Welch's t on {base} and {other} {unit}, unpaired"),
            DifferenceRule::TooFew => write!(f, "too few {unit} for an interval"),
        }
    }
}

impl Difference {
    /// One-sided p value of the t test against a true difference of at most `limit`; `None` without a standard error.
    pub fn p_above(&self, limit: f64) -> Option<f64> {
        let t = StudentsT::new(0.0, 1.0, self.freedom?).ok()?;
        Some(t.sf((self.difference - limit) / self.standard_error?))
    }
}

/// Fewest common seeds for pairing if a side has other seeds too.
const FEWEST_IN_COMMON: usize = 3;

/// Whether runs of two sides with these seeds are paired: if the seeds are the same, or if at least three and at least
/// half of the seeds of the side with more are common.
pub fn should_pair(base: &[u64], other: &[u64]) -> bool {
    let common = base.iter().filter(|seed| other.contains(seed)).count();
    let most = base.len().max(other.len());
    common == most || (common >= FEWEST_IN_COMMON && 2 * common >= most)
}

/// The difference over these strata. If `paired` ([`should_pair`]), values with the same key are pairs, and values of
/// only one side are omitted. `None` if there is no stratum, or one lacks all values of a side.
pub fn difference(clips: &[ClipValues], paired: bool, unit: IntervalUnit) -> Option<Difference> {
    let found = if paired {
        let common: Vec<ClipValues> = clips.iter().map(ClipValues::in_common).collect();
        difference_of(&common, Some(common.iter().map(pairs).collect()))
    } else {
        difference_of(clips, None)
    };
    let mut found = Difference { over: unit, ..found? };
    let greatest = |side: fn(&ClipValues) -> usize| clips.iter().map(side).sum::<usize>();
    let most = greatest(|clip| clip.base.len()).max(greatest(|clip| clip.other.len()));
    // one or two equal pairs of many runs, whose others lack a value, do not show that nothing changed
    if found.rule == DifferenceRule::Exact && found.runs[0].min(found.runs[1]) < FEWEST_RUNS.min(most) {
        found.rule = DifferenceRule::TooFew;
    }
    Some(found)
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
        over: IntervalUnit::default(),
        runs: [&base, &other].map(|side| side.iter().map(Vec::len).sum()),
    };
    let unchanged = pairs.as_ref().is_some_and(|pairs| pairs.iter().flatten().all(|d| *d == 0.0));
    let several = clips.iter().all(|clip| clip.base.len() > 1 && clip.other.len() > 1);
    let alike = pairs.as_ref().is_some_and(|pairs| are_equal(pairs)) || (are_equal(&base) && are_equal(&other));
    if unchanged || (several && alike) {
        let p = match &pairs {
            _ if unchanged => None,
            Some(pairs) => p_of_signs(pairs),
            None => p_of_ranks(&base, &other),
        };
        return Some(Difference { rule: DifferenceRule::Exact, p, ..nothing });
    }
    // each side needs enough runs, not both together
    if pairs.is_none() && nothing.runs.iter().any(|runs| *runs < FEWEST_RUNS) {
        return Some(nothing);
    }
    Some(strata.complete(nothing, pairs.is_some()))
}

impl ClipValues {
    /// The values with common keys, sorted by key.
    fn in_common(&self) -> Self {
        let shared = |side: &[(u64, f64)], there: &[(u64, f64)]| {
            let mut shared: Vec<_> = side.to_vec();
            shared.retain(|(number, _)| there.iter().any(|(other, _)| other == number));
            shared.sort_by_key(|(number, _)| *number);
            shared
        };
        Self { base: shared(&self.base, &self.other), other: shared(&self.other, &self.base) }
    }
}

/// Differences, other minus base, of values in the order of common keys.
fn pairs(clip: &ClipValues) -> Vec<f64> {
    clip.base.iter().zip(&clip.other).map(|((_, base), (_, other))| change(*base, *other)).collect()
}

/// Two-sided p value of the sign test if all pairs differ in the same direction; `None` otherwise.
fn p_of_signs(pairs: &[Vec<f64>]) -> Option<f64> {
    let all = || pairs.iter().flatten();
    let count = i32::try_from(all().count()).ok()?;
    let one_way = all().all(|d| *d > 0.0) || all().all(|d| *d < 0.0);
    one_way.then(|| (2.0 * 0.5_f64.powi(count)).min(1.0))
}

/// Two-sided p value of the rank test within strata, if in all strata all values of the same side are above those of
/// the other; `None` otherwise. Each stratum has (n + m choose n) assignments of the values to the sides.
fn p_of_ranks(base: &[Vec<f64>], other: &[Vec<f64>]) -> Option<f64> {
    let differences: Vec<f64> = base.iter().zip(other).map(|(base, other)| other[0] - base[0]).collect();
    let one_way = differences.iter().all(|d| *d > 0.0) || differences.iter().all(|d| *d < 0.0);
    let ways = base.iter().zip(other).map(|(base, other)| {
        let (n, m) = (base.len(), other.len());
        (1..=n).map(|i| (m + i) as f64 / i as f64).product::<f64>()
    });
    one_way.then(|| (2.0 / ways.product::<f64>()).min(1.0))
}

/// Lists of values whose mean of means, times `scale`, is the difference.
struct Strata {
    values: Vec<Vec<f64>>,
    scale: f64,
}

impl Strata {
    /// The values of both sides, negated for the base: twice their mean of means is the difference.
    fn from_independent(base: &[Vec<f64>], other: &[Vec<f64>]) -> Self {
        let negated = base.iter().map(|values| values.iter().map(|value| -value).collect());
        Self { values: negated.chain(other.iter().cloned()).collect(), scale: 2.0 }
    }

    fn complete(&self, nothing: Difference, paired: bool) -> Difference {
        let Some((ends, _)) = mean_interval(&self.values, ValueRange::Any) else { return nothing };
        let Some((standard_error, freedom)) = self.standard_error() else { return nothing };
        let rule = if paired { DifferenceRule::PairedT } else { DifferenceRule::Welch };
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
    use skiagraph_core::rng::{Purpose, normal, stream};

    fn clip(base: &[f64], other: &[f64], first_other_seed: u64) -> ClipValues {
        let seeds = |values: &[f64], first: u64| (first..).zip(values.iter().copied()).collect();
        ClipValues { base: seeds(base, 0), other: seeds(other, first_other_seed) }
    }

    fn paired(clips: &[ClipValues]) -> Difference {
        difference(clips, true, IntervalUnit::Seeds).unwrap()
    }

    fn unpaired(clips: &[ClipValues]) -> Difference {
        difference(clips, false, IntervalUnit::Seeds).unwrap()
    }

    /// `scipy.stats.ttest_rel([32, 35, 31, 36, 33], [30, 31, 29, 32, 30])`: t = 6.7082, p = 0.002571; the mean
    /// difference is 3, its standard deviation 1.
    #[test]
    fn pairs_give_the_paired_t_interval_of_the_textbook() {
        let found = paired(&[clip(&[30.0, 31.0, 29.0, 32.0, 30.0], &[32.0, 35.0, 31.0, 36.0, 33.0], 0)]);
        assert_eq!((found.difference, found.rule, found.freedom), (3.0, DifferenceRule::PairedT, Some(4.0)));
        let half = 2.776_445 * (1.0_f64 / 5.0).sqrt();
        let Interval { low, high } = found.ci95.unwrap();
        assert!((low - (3.0 - half)).abs() < 1e-5 && (high - (3.0 + half)).abs() < 1e-5, "{low} {high}");
        assert!((found.p.unwrap() - 0.002_571).abs() < 1e-6, "{:?}", found.p);
        assert_eq!(found.to_string(), "Student's t on 5 pairs of seeds");
    }

    #[test]
    fn two_runs_a_side_have_no_unpaired_interval() {
        let of = |base: &[f64], other: &[f64]| unpaired(&[clip(base, other, 100)]);
        for few in [of(&[1.0, 2.0], &[5.0, 7.0]), of(&[1.0, 2.0, 4.0], &[5.0, 7.0])] {
            assert_eq!((few.rule, few.ci95, few.p), (DifferenceRule::TooFew, None, None));
        }
        assert_eq!(of(&[1.0, 2.0, 4.0], &[5.0, 7.0, 8.0]).rule, DifferenceRule::Welch);
        let two_clips = [clip(&[1.0, 2.0], &[5.0, 7.0], 100), clip(&[3.0, 2.0], &[5.0, 8.0], 100)];
        assert_eq!(unpaired(&two_clips).rule, DifferenceRule::Welch, "four runs a side");
    }

    /// Welch's own statistic by hand: means 2 and 6, variances 1 and 4, n = 3 and 5: se^2 = 1/3 + 4/5,
    /// df = se^4 / ((1/3)^2 / 2 + (4/5)^2 / 4).
    #[test]
    fn other_seeds_give_welchs_interval_worked_by_hand() {
        let other = [6.0 - 2.0_f64.sqrt() * 2.0, 6.0, 6.0, 6.0, 6.0 + 2.0_f64.sqrt() * 2.0];
        let found = unpaired(&[clip(&[1.0, 2.0, 3.0], &other, 100)]);
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

    /// Regression: a bootstrap interval from ten runs on contradicted the p value of the t test.
    #[test]
    fn p_is_below_five_percent_exactly_where_the_interval_leaves_out_zero_at_any_number_of_seeds() {
        let mut alarms = 0;
        for trial in 0..300 {
            let mut rng = stream(trial, Purpose::Oracle, 0, 0, 27);
            let seeds = [5, 9, 10, 20][trial as usize % 4];
            // with one in ten lost, and a shift that is shown about half of the time
            let mut run = |shift: f64| {
                let is_lost = normal(&mut rng) > 1.28;
                shift + if is_lost { 300.0 } else { 40.0 + 4.0 * normal(&mut rng) }
            };
            let base: Vec<f64> = (0..seeds).map(|_| run(0.0)).collect();
            let other: Vec<f64> = (0..seeds).map(|_| run(5.0)).collect();
            for found in [paired(&[clip(&base, &other, 0)]), unpaired(&[clip(&base, &other, 0)])] {
                let Interval { low, high } = found.ci95.unwrap();
                assert_eq!(found.p.unwrap() < 0.05, low > 0.0 || high < 0.0, "{found:?}");
                alarms += usize::from(low > 0.0);
            }
        }
        assert!((10..590).contains(&alarms), "both kinds of cases: {alarms}");
    }

    #[test]
    fn pairing_depends_on_common_seeds_and_not_on_values() {
        let (five, seven): (Vec<u64>, Vec<u64>) = ((0..5).collect(), (0..7).collect());
        assert!(should_pair(&five, &seven) && should_pair(&five, &five) && should_pair(&[4], &[4]));
        assert!(!should_pair(&five, &[5, 6, 7]) && !should_pair(&[0, 1, 2], &seven), "fewer than half");
        assert!(!should_pair(&[0, 1, 2, 3], &[2, 3, 4, 5]), "two in common");
        // pairs that vary more than runs must still be paired
        let opposite = [clip(&[1.0, 2.0, 3.0, 4.0, 5.0], &[5.0, 4.0, 3.0, 2.0, 1.0, 3.0, 3.0], 0)];
        assert_eq!((paired(&opposite).rule, paired(&opposite).runs), (DifferenceRule::PairedT, [5, 5]));
        let more = paired(&[clip(&[1.0, 2.0, 4.0], &[1.5, 2.4, 4.6, 90.0, 80.0], 0)]);
        assert!((more.difference - 0.5).abs() < 1e-12 && more.runs == [3, 3], "{more:?}");
    }

    #[test]
    fn differences_by_round_off_count_as_none() {
        let values = [116.4, 117.2, 115.9];
        let moved = values.map(|value| value + 8e-14);
        let same = paired(&[clip(&values, &moved, 0)]);
        assert_eq!((same.difference, same.rule), (0.0, DifferenceRule::Exact));
    }

    #[test]
    fn clips_have_equal_weights_with_any_number_of_seeds() {
        let clips = [clip(&[1.0, 3.0], &[2.0, 4.0], 9), clip(&[10.0; 4], &[14.0, 13.0, 15.0, 14.0], 9)];
        let found = unpaired(&clips);
        assert!((found.base - 6.0).abs() < 1e-12 && (found.difference - 2.5).abs() < 1e-12, "{found:?}");
        assert_eq!(found.runs, [6, 6]);
    }

    #[test]
    fn the_same_runs_are_equal_and_runs_that_never_vary_have_the_p_value_of_signs_or_ranks() {
        let same = paired(&[clip(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0], 0)]);
        assert_eq!((same.difference, same.rule, same.ci95, same.p), (0.0, DifferenceRule::Exact, None, None));
        let constant = unpaired(&[clip(&[1.0; 3], &[1.5; 3], 7)]);
        assert_eq!((constant.difference, constant.rule), (0.5, DifferenceRule::Exact));
        // (6 choose 3) = 20 assignments of six values
        assert!((constant.p.unwrap() - 0.1).abs() < 1e-12, "{:?}", constant.p);
        // 2 / 2^5
        assert_eq!(paired(&[clip(&[1.0; 5], &[1.5; 5], 0)]).p, Some(0.0625));
        let one_of_six = ClipValues { base: vec![(0, 1.0)], other: (0..6).map(|seed| (seed, 1.0)).collect() };
        assert_eq!(paired(&[one_of_six]).rule, DifferenceRule::TooFew, "five pairs lack a value");
        let both_ways = paired(&[clip(&[1.0; 5], &[1.5; 5], 0), clip(&[1.0; 5], &[0.8; 5], 0)]);
        assert_eq!((both_ways.rule, both_ways.p), (DifferenceRule::Exact, None));
    }

    #[test]
    fn one_seed_has_a_difference_without_an_interval_and_a_missing_clip_has_none() {
        let one = paired(&[clip(&[1.0], &[3.0], 0)]);
        assert_eq!((one.difference, one.ci95, one.rule), (2.0, None, DifferenceRule::TooFew));
        assert_eq!(difference(&[clip(&[1.0], &[], 0)], true, IntervalUnit::Seeds), None);
        assert_eq!(difference(&[], false, IntervalUnit::Seeds), None);
    }
}
