//! Which setting to choose: Pareto fronts, and the cheapest that is good enough.

use super::summary::{SettingSummary, badness};
use skiagraph_eval::{FEWEST_RUNS, Interval, Metric, ValueRange, mean, mean_interval};

/// Likelihood evaluations per frame of a setting that is judged; `None` for any other, and for programs.
fn cost_of(setting: &SettingSummary) -> Option<f64> {
    setting.evaluations_per_frame.filter(|_| setting.is_judged())
}

/// Indices of the settings on the Pareto front: no other setting is as cheap and as good, and better in one of the two.
/// Cheapest first.
pub fn pareto_front(points: &[SettingSummary], metric: &Metric) -> Vec<usize> {
    let mut known: Vec<(f64, f64, usize)> = points
        .iter()
        .enumerate()
        .filter_map(|(at, point)| Some((cost_of(point)?, badness(point.mean?, metric), at)))
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

#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    pub best: usize,
    /// The cheapest whose mean is within the limit of the best.
    pub by_mean: usize,
    /// The cheapest that is certainly within the limit: the upper end of the 95 % interval of its difference from the
    /// best is. The best itself counts. `None` if the best has too few seeds for an interval.
    pub certain: Option<usize>,
}

/// The cheapest setting within `within` of the best; `None` without results.
pub fn cheapest_within(points: &[SettingSummary], metric: &Metric, within: f64) -> Option<Choice> {
    let known: Vec<(usize, f64, f64)> = points
        .iter()
        .enumerate()
        .filter_map(|(at, point)| Some((at, cost_of(point)?, badness(point.mean?, metric))))
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

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_eval::find_metric;

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
        assert_eq!(pareto_front(&points, error()), [0, 1, 5]);
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
        assert_eq!(pareto_front(&[point(1.0, &[0.5]), point(2.0, &[0.9]), point(3.0, &[0.4])], score), [0, 1]);
    }

    #[test]
    fn a_setting_that_leaves_frames_out_is_never_chosen() {
        let dies = SettingSummary { lost_frames: Some(0.88), ..point(1.0, &[3.0, 3.1, 3.2]) };
        let lives = SettingSummary { lost_frames: Some(0.0), ..point(9.0, &[30.0, 31.0, 32.0]) };
        let points = [dies.clone(), lives];
        assert_eq!(pareto_front(&points, error()), [1]);
        let choice = cheapest_within(&points, error(), 100.0).unwrap();
        assert_eq!((choice.best, choice.by_mean), (1, 1));
        assert!(cheapest_within(&[dies], error(), 5.0).is_none(), "without a whole run nothing is judged");
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
        let choice = cheapest_within(&points, error(), 5.0).unwrap();
        assert_eq!(choice, Choice { best: 0, by_mean: 2, certain: Some(1) });
        let strict = cheapest_within(&points, error(), 0.5).unwrap();
        assert_eq!((strict.by_mean, strict.certain), (0, Some(0)));
        for seeds in [1, 2] {
            let few: Vec<SettingSummary> =
                points.iter().map(|p| point(p.evaluations_per_frame.unwrap(), &p.present()[..seeds])).collect();
            let choice = cheapest_within(&few, error(), 5.0).unwrap();
            assert_eq!(choice.certain, None, "{seeds} seeds");
        }
    }
}
