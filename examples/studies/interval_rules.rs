//! Rules for the 95 % interval of a sample mean, compared with the one in use.

use rand::{Rng, RngExt};
use skiagraph_core::rng::{Purpose, stream};
use skiagraph_eval::{Interval, mean, quantile};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Resamples of a bootstrap.
const RESAMPLES: usize = 1000;

/// A rule; `None` if it gives no interval.
pub(crate) type IntervalOfMean = fn(&[f64]) -> Option<Interval>;

/// Size, mean, standard error, and the 97.5 % quantile of Student's t.
struct SampleSize {
    n: f64,
    centre: f64,
    error: f64,
    t: f64,
}

impl SampleSize {
    fn new(values: &[f64]) -> Option<Self> {
        let (n, centre) = (values.len() as f64, mean(values)?);
        let t = StudentsT::new(0.0, 1.0, n - 1.0).ok()?.inverse_cdf(0.975);
        Some(Self { n, centre, error: standard_error(values, centre), t })
    }
}

fn standard_error(values: &[f64], centre: f64) -> f64 {
    let n = values.len() as f64;
    let squares: f64 = values.iter().map(|x| (x - centre) * (x - centre)).sum();
    (squares / (n - 1.0) / n).sqrt()
}

/// Student's t.
pub(crate) fn student(values: &[f64]) -> Option<Interval> {
    let SampleSize { centre, error, t, .. } = SampleSize::new(values)?;
    Some(Interval { low: centre - t * error, high: centre + t * error })
}

/// The modified Cox interval of errors above 0 (`[Olsson 2005]`).
pub(crate) fn cox(values: &[f64]) -> Option<Interval> {
    let SampleSize { n, centre, t, .. } = SampleSize::new(values)?;
    let logs: Vec<f64> = values.iter().map(|x| libm::log(*x)).collect();
    let v = (standard_error(&logs, mean(&logs)?).powi(2) * n).min(1.0);
    let factor = libm::exp(t * (v / n + v * v / (2.0 * (n - 1.0))).sqrt());
    Some(Interval { low: centre / factor, high: centre * factor })
}

/// The BCa bootstrap (`[Efron 1987]`) with expanded percentiles (`[Hesterberg 2015]`).
pub(crate) fn bca(values: &[f64]) -> Option<Interval> {
    let SampleSize { n, centre, t, .. } = SampleSize::new(values)?;
    let mut rng = stream(0, Purpose::Bootstrap, 0, 0, 0);
    let mut means: Vec<f64> = (0..RESAMPLES).filter_map(|_| mean(&resampled(values, &mut rng))).collect();
    means.sort_by(f64::total_cmp);
    let normal = Normal::standard();
    let (below, not_above) = (means.partition_point(|x| *x < centre), means.partition_point(|x| *x <= centre));
    let half = 0.5 / RESAMPLES as f64;
    let bias = normal.inverse_cdf((half * (below + not_above) as f64).clamp(half, 1.0 - half));
    let moment = |power: i32| values.iter().map(|x| (x - centre).powi(power)).sum::<f64>();
    let acceleration = moment(3) / (6.0 * moment(2).powf(1.5));
    let end = |reach: f64| {
        let shifted = bias + reach;
        let share = normal.cdf(bias + shifted / (1.0 - acceleration * shifted).max(f64::MIN_POSITIVE));
        quantile(&means, share)
    };
    let reach = t * (n / (n - 1.0)).sqrt();
    Some(Interval { low: end(-reach)?, high: end(reach)? })
}

/// The studentised bootstrap: quantiles of t over resamples instead of Student's.
pub(crate) fn studentised(values: &[f64]) -> Option<Interval> {
    let SampleSize { centre, error, .. } = SampleSize::new(values)?;
    let mut rng = stream(0, Purpose::Bootstrap, 0, 0, 1);
    let mut of_resample = || {
        let drawn = resampled(values, &mut rng);
        let moved = mean(&drawn).unwrap_or(centre);
        let t = (moved - centre) / standard_error(&drawn, moved);
        if t.is_nan() { 0.0 } else { t }
    };
    let mut ts: Vec<f64> = (0..RESAMPLES).map(|_| of_resample()).collect();
    ts.sort_by(f64::total_cmp);
    let end = |share: usize| Some(centre - ts.get(share)? * error);
    Some(Interval { low: end(RESAMPLES * 975 / 1000)?, high: end(RESAMPLES * 25 / 1000)? })
}

fn resampled(values: &[f64], rng: &mut impl Rng) -> Vec<f64> {
    (0..values.len()).map(|_| values[rng.random_range(0..values.len())]).collect()
}
