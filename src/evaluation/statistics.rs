//! Means, spreads and quantiles of plain lists.

use serde::{Deserialize, Serialize};

/// How a list of values is spread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard deviation with divisor n - 1; 0 for a single value.
    pub std: f64,
    /// Median.
    pub median: f64,
    /// 90th percentile.
    pub p90: f64,
    /// Greatest value.
    pub max: f64,
}

impl Spread {
    /// Of at least one finite value; `None` for an empty list.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        Some(Self {
            mean: mean(values)?,
            std: standard_deviation(values),
            median: quantile(&sorted, 0.5)?,
            p90: quantile(&sorted, 0.9)?,
            max: *sorted.last()?,
        })
    }

    /// Of one value that stands for the whole.
    pub fn of_one(value: f64) -> Self {
        Self { mean: value, std: 0.0, median: value, p90: value, max: value }
    }
}

/// Arithmetic mean; `None` for an empty list.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Standard deviation with divisor n - 1; 0 for fewer than two values.
pub(super) fn standard_deviation(values: &[f64]) -> f64 {
    let Some(centre) = mean(values).filter(|_| values.len() > 1) else { return 0.0 };
    let squares: f64 = values.iter().map(|v| (v - centre) * (v - centre)).sum();
    (squares / (values.len() - 1) as f64).sqrt()
}

/// The `q`-quantile (0 to 1) of an ascending list, linear between neighbours (type 7, numpy's default); `None` if empty.
pub fn quantile(sorted: &[f64], q: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let position = q.clamp(0.0, 1.0) * last as f64;
    let below = (position.floor() as usize).min(last);
    let above = (below + 1).min(last);
    Some(sorted[below] + (position - below as f64) * (sorted[above] - sorted[below]))
}

/// Mean of an iterator without collecting it; `None` if it is empty.
pub(super) fn mean_of(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), v| (sum + v, count + 1));
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_of_one_to_five_is_known() {
        let spread = Spread::of(&[5.0, 1.0, 3.0, 2.0, 4.0]).unwrap();
        assert_eq!((spread.mean, spread.median, spread.max), (3.0, 3.0, 5.0));
        assert!((spread.p90 - 4.6).abs() < 1e-12, "numpy.percentile([1..5], 90) is 4.6");
        assert!((spread.std - 2.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn one_value_has_no_spread_and_none_has_no_mean() {
        assert_eq!(Spread::of(&[7.0]), Some(Spread::of_one(7.0)));
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(mean_of([].into_iter()), None);
        assert_eq!(mean_of([1.0, 2.0].into_iter()), Some(1.5));
    }
}
