//! Analysis of a sweep: Pareto fronts, choices, effects.

use std::collections::{BTreeMap, HashMap};

use crate::evaluation::{FEWEST_RUNS, Interval, Metric, ValueRange, mean, mean_interval};
use crate::sweep::summary::{SettingSummary, badness};

/// A measure of the cost of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CostMeasure {
    /// Likelihood evaluations per frame.
    Evaluations,
    /// Processor time per frame, ms.
    Processor,
}

impl CostMeasure {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Evaluations, Self::Processor];

    /// The cost of a setting; `None` if unknown.
    pub fn of_setting(self, point: &SettingSummary) -> Option<f64> {
        match self {
            Self::Evaluations => point.evaluations_per_frame,
            Self::Processor => point.processor_ms_per_frame,
        }
    }
}

/// Indices of the settings on the Pareto front: no other setting is as cheap and as good, and better in one of the two.
/// Cheapest first.
pub fn pareto_front(points: &[SettingSummary], cost: CostMeasure, metric: &Metric) -> Vec<usize> {
    let mut known: Vec<(f64, f64, usize)> = points
        .iter()
        .enumerate()
        .filter_map(|(at, point)| Some((cost.of_setting(point)?, badness(point.mean?, metric), at)))
        .collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut best = f64::INFINITY;
    known.retain(|(_, bad, _)| {
        let beats = *bad < best;
        best = best.min(*bad);
        beats
    });
    known.into_iter().map(|(.., at)| at).collect()
}

/// 95 % interval of how much worse the mean of one setting is than that of another: Welch's interval of the difference
/// of the means, from [`mean_interval`]. Seeds are not paired, since different settings draw different random numbers.
/// `None` below two seeds each.
pub fn difference(of: &[f64], than: &[f64], metric: &Metric) -> Option<Interval> {
    let of: Vec<f64> = of.iter().map(|value| badness(*value, metric)).collect();
    let than: Vec<f64> = than.iter().map(|value| -badness(*value, metric)).collect();
    let (a, b) = (mean(&of)?, mean(&than)?);
    let are_equal = |values: &[f64]| values.len() > 1 && values.windows(2).all(|pair| pair[0] == pair[1]);
    if are_equal(&of) && are_equal(&than) {
        return Some(Interval { low: a + b, high: a + b });
    }
    // the mean over two "clips" is half of the sum
    let (half, _) = mean_interval(&[of, than], ValueRange::Any)?;
    Some(Interval { low: 2.0 * half.low, high: 2.0 * half.high })
}

/// The setting to choose.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The setting with the best mean.
    pub best: usize,
    /// The cheapest whose mean is within the limit of the best.
    pub by_mean: usize,
    /// The cheapest that is certainly within the limit: the upper end of the 95 % interval of its difference from the
    /// best is. The best itself counts. `None` if the best has too few seeds for an interval.
    pub certain: Option<usize>,
}

/// The cheapest setting within `within` of the best; `None` without results.
pub fn cheapest_within(points: &[SettingSummary], cost: CostMeasure, metric: &Metric, within: f64) -> Option<Choice> {
    let known: Vec<(usize, f64, f64)> = points
        .iter()
        .enumerate()
        .filter_map(|(at, point)| Some((at, cost.of_setting(point)?, badness(point.mean?, metric))))
        .collect();
    let (best, _, least) = known.iter().copied().min_by(|a, b| a.2.total_cmp(&b.2))?;
    // the upper end of an interval is not below the mean, so other settings cannot qualify
    let mut close: Vec<(usize, f64, f64)> = known.into_iter().filter(|(.., bad)| *bad <= least + within).collect();
    close.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
    let by_mean = close.first()?.0;
    let has_intervals = |at: usize| points[at].present().len() >= FEWEST_RUNS;
    let is_certain = |at: usize| {
        let ends = difference(&points[at].present(), &points[best].present(), metric);
        at == best || has_intervals(at) && ends.is_some_and(|ends| ends.high <= within)
    };
    let first_certain = || close.iter().map(|(at, ..)| *at).find(|at| is_certain(*at));
    Some(Choice { best, by_mean, certain: if has_intervals(best) { first_certain() } else { None } })
}

/// The effect of one axis, or the interaction of two.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// The axis, or both axes.
    pub axes: Vec<usize>,
    /// Difference between the best and the worst mean by value; for two axes, the largest deviation from the sum of
    /// their effects.
    pub range: f64,
    /// Explained share of the variance of the settings' means.
    pub share: f64,
    /// For one axis: its values and their means over all settings, in the order of the plan.
    pub means: Vec<(String, f64)>,
}

/// Effects of all axes and of all pairs, each sorted by strength: the decomposition of the variance of the settings'
/// means. `None` unless the settings are a full grid with at least two values on some axis: otherwise the effects of
/// the axes cannot be separated.
pub fn effects(points: &[SettingSummary], axes: usize) -> Option<(Vec<Effect>, Vec<Effect>)> {
    let means: Vec<f64> = points.iter().map(|point| point.mean).collect::<Option<_>>()?;
    let sizes: Vec<usize> = (0..axes).map(|axis| by_value(points, &[axis], &means).len()).collect();
    if points.is_empty() || sizes.iter().product::<usize>() != points.len() || points.len() < 2 {
        return None;
    }
    let centre = mean(&means)?;
    let total: f64 = means.iter().map(|value| (value - centre) * (value - centre)).sum();
    let share = |sum: f64| if total > 0.0 { sum / total } else { 0.0 };
    let varied: Vec<usize> = (0..axes).filter(|axis| sizes[*axis] > 1).collect();
    let main = |axis: usize| by_value(points, &[axis], &means);
    let mut single: Vec<Effect> = Vec::new();
    for axis in &varied {
        let groups = main(*axis);
        let sum: f64 = groups.iter().map(|(_, value, count)| *count as f64 * (value - centre) * (value - centre)).sum();
        let ends = groups.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], (_, v, _)| [l.min(*v), h.max(*v)]);
        let means = groups.into_iter().map(|(labels, value, _)| (labels.join(" "), value)).collect();
        single.push(Effect { axes: vec![*axis], range: ends[1] - ends[0], share: share(sum), means });
    }
    let mut pairs: Vec<Effect> = Vec::new();
    for (at, a) in varied.iter().enumerate() {
        for b in &varied[at + 1..] {
            let of = |axis: usize| -> BTreeMap<String, f64> {
                main(axis).into_iter().map(|(labels, value, _)| (labels.join(" "), value)).collect()
            };
            let (of_a, of_b) = (of(*a), of(*b));
            let both = by_value(points, &[*a, *b], &means);
            let departures = both.iter().map(|(labels, value, count)| {
                let sum =
                    of_a.get(&labels[0]).copied().unwrap_or(centre) + of_b.get(&labels[1]).copied().unwrap_or(centre);
                (value - sum + centre, *count as f64)
            });
            let (mut sum, mut range) = (0.0, 0.0_f64);
            for (departure, count) in departures {
                sum += count * departure * departure;
                range = range.max(departure.abs());
            }
            pairs.push(Effect { axes: vec![*a, *b], range, share: share(sum), means: Vec::new() });
        }
    }
    single.sort_by(|a, b| b.share.total_cmp(&a.share));
    pairs.sort_by(|a, b| b.share.total_cmp(&a.share));
    Some((single, pairs))
}

/// Values of some axes in the order of their first occurrence, with the mean and the number of their settings.
pub(super) fn by_value(points: &[SettingSummary], axes: &[usize], means: &[f64]) -> Vec<(Vec<String>, f64, usize)> {
    let mut groups: Vec<(Vec<String>, f64, usize)> = Vec::new();
    let mut places: HashMap<Vec<String>, usize> = HashMap::new();
    for (point, value) in points.iter().zip(means) {
        let labels: Vec<String> =
            axes.iter().map(|axis| point.labels.get(*axis).cloned().unwrap_or_default()).collect();
        let place = *places.entry(labels.clone()).or_insert(groups.len());
        match groups.get_mut(place) {
            Some((_, sum, count)) => {
                *sum += value;
                *count += 1;
            }
            None => groups.push((labels, *value, 1)),
        }
    }
    groups.iter_mut().for_each(|(_, sum, count)| *sum /= *count as f64);
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::find_metric;

    fn error() -> &'static Metric {
        find_metric("humaneva_mm").unwrap()
    }

    fn point(cost: f64, values: &[f64]) -> SettingSummary {
        SettingSummary {
            evaluations_per_frame: Some(cost),
            values: values.iter().copied().map(Some).collect(),
            mean: mean(values),
            ..SettingSummary::default()
        }
    }

    #[test]
    fn the_front_holds_the_unbeaten_settings() {
        let points: Vec<SettingSummary> =
            [(10.0, 90.0), (20.0, 60.0), (20.0, 70.0), (30.0, 65.0), (40.0, 60.0), (80.0, 30.0)]
                .map(|(c, v)| point(c, &[v]))
                .into();
        assert_eq!(pareto_front(&points, CostMeasure::Evaluations, error()), [0, 1, 5]);
        // by every other pair: nothing on the front is beaten, everything else is
        let beats = |a: &SettingSummary, b: &SettingSummary| {
            let of = |p: &SettingSummary| (p.evaluations_per_frame.unwrap(), p.mean.unwrap());
            of(a).0 <= of(b).0 && of(a).1 <= of(b).1 && of(a) != of(b)
        };
        for (at, candidate) in points.iter().enumerate() {
            let beaten = points.iter().any(|other| beats(other, candidate));
            assert_eq!(!beaten, [0, 1, 5].contains(&at), "{at}");
        }
        let score = find_metric("pck150").unwrap();
        assert_eq!(
            pareto_front(
                &[point(1.0, &[0.5]), point(2.0, &[0.9]), point(3.0, &[0.4])],
                CostMeasure::Evaluations,
                score
            ),
            [0, 1]
        );
        assert!(pareto_front(&points, CostMeasure::Processor, error()).is_empty(), "its cost is unknown");
    }

    #[test]
    fn a_difference_has_welchs_interval() {
        // Welch: standard error sqrt(1/3 + 7/9), 3.448276 degrees of freedom, t = 2.960730 (by integrating its density)
        let ends = difference(&[10.0, 12.0, 11.0], &[7.0, 9.0, 6.0], error()).unwrap();
        assert!((ends.low - 0.545_783).abs() < 1e-5 && (ends.high - 6.787_551).abs() < 1e-5, "{ends:?}");
        assert!((0.5 * (ends.low + ends.high) - 11.0 / 3.0).abs() < 1e-12);
        let score = find_metric("pck150").unwrap();
        let worse = difference(&[0.5, 0.52, 0.51], &[0.8, 0.82, 0.81], score).unwrap();
        assert!(worse.low > 0.2 && worse.high < 0.4, "{worse:?}: a lower score is worse");
        assert_eq!(difference(&[4.0, 4.0], &[3.0, 3.0], error()).unwrap(), Interval { low: 1.0, high: 1.0 });
        assert!(difference(&[4.0], &[3.0], error()).is_none());
    }

    #[test]
    fn the_cheapest_that_is_good_enough_is_chosen_by_mean_and_by_interval() {
        let points = [
            point(100.0, &[30.0, 30.5, 29.5, 30.0, 30.1]),
            point(50.0, &[31.0, 31.5, 30.5, 31.0, 31.1]),
            // good enough on average only
            point(20.0, &[20.0, 45.0, 30.0, 38.0, 32.0]),
            point(10.0, &[60.0, 61.0, 59.0, 60.0, 60.0]),
        ];
        let choice = cheapest_within(&points, CostMeasure::Evaluations, error(), 5.0).unwrap();
        assert_eq!(choice, Choice { best: 0, by_mean: 2, certain: Some(1) });
        let strict = cheapest_within(&points, CostMeasure::Evaluations, error(), 0.5).unwrap();
        assert_eq!((strict.by_mean, strict.certain), (0, Some(0)));
        for seeds in [1, 2] {
            let few: Vec<SettingSummary> =
                points.iter().map(|p| point(p.evaluations_per_frame.unwrap(), &p.present()[..seeds])).collect();
            let choice = cheapest_within(&few, CostMeasure::Evaluations, error(), 5.0).unwrap();
            assert_eq!(choice.certain, None, "{seeds} seeds");
        }
    }

    #[test]
    fn planted_effects_and_interactions_are_found_and_their_shares_add_up() {
        // 50 + 10 a + 3 b + 2 a b, with a = +-1 in the first axis, b = +-1 in the second, and a third that does nothing
        let mut points = Vec::new();
        for a in [-1.0, 1.0] {
            for b in [-1.0, 1.0] {
                for c in ["x", "y"] {
                    let value = 50.0 + 10.0 * a + 3.0 * b + 2.0 * a * b;
                    let labels = vec![a.to_string(), b.to_string(), c.to_owned()];
                    points.push(SettingSummary { labels, ..point(1.0, &[value]) });
                }
            }
        }
        let (single, pairs) = effects(&points, 3).unwrap();
        assert_eq!(single.iter().map(|effect| effect.axes[0]).collect::<Vec<_>>(), [0, 1, 2]);
        for (effect, (range, share)) in single.iter().zip([(20.0, 100.0 / 113.0), (6.0, 9.0 / 113.0), (0.0, 0.0)]) {
            assert!((effect.range - range).abs() < 1e-9 && (effect.share - share).abs() < 1e-9, "{effect:?}");
        }
        assert_eq!(pairs[0].axes, [0, 1]);
        assert!((pairs[0].share - 4.0 / 113.0).abs() < 1e-9 && (pairs[0].range - 2.0).abs() < 1e-9);
        let sum: f64 = single.iter().chain(&pairs).map(|effect| effect.share).sum();
        assert!((sum - 1.0).abs() < 1e-9);
        assert!(effects(&points[1..], 3).is_none(), "no full grid");
    }
}
