//! Means, spreads and quantiles of lists.

use serde::{Deserialize, Serialize};

/// Spread of the values of the frames of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameSpread {
    /// Standard deviation with divisor n - 1; `None` for a single value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    /// Median.
    pub median: f64,
    /// 90th percentile.
    pub p90: f64,
    /// Greatest value.
    pub max: f64,
}

impl FrameSpread {
    /// The spread of finite values; `None` for an empty list.
    pub fn from_values(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        Some(Self {
            std: standard_deviation(values),
            median: quantile(&sorted, 0.5)?,
            p90: quantile(&sorted, 0.9)?,
            max: *sorted.last()?,
        })
    }
}

/// Arithmetic mean; `None` for an empty list.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Variance with divisor n - 1; `None` for fewer than two values.
pub(super) fn variance(values: &[f64]) -> Option<f64> {
    let centre = mean(values).filter(|_| values.len() > 1)?;
    let squares: f64 = values.iter().map(|v| (v - centre) * (v - centre)).sum();
    Some(squares / (values.len() - 1) as f64)
}

/// Standard deviation with divisor n - 1; `None` for fewer than two values.
pub(super) fn standard_deviation(values: &[f64]) -> Option<f64> {
    variance(values).map(f64::sqrt)
}

/// The `q`-quantile (0 to 1) of an ascending list, linear between neighbours (type 7, numpy's default); `None` if
/// empty.
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
        let values = [5.0, 1.0, 3.0, 2.0, 4.0];
        let spread = FrameSpread::from_values(&values).unwrap();
        assert_eq!((mean(&values), spread.median, spread.max), (Some(3.0), 3.0, 5.0));
        assert!((spread.p90 - 4.6).abs() < 1e-12, "numpy.percentile([1..5], 90) is 4.6");
        assert!((spread.std.unwrap() - 2.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn one_value_does_not_deviate_and_none_has_no_mean() {
        assert_eq!(FrameSpread::from_values(&[7.0]), Some(FrameSpread { std: None, median: 7.0, p90: 7.0, max: 7.0 }));
        assert_eq!(FrameSpread::from_values(&[]), None);
        assert_eq!(mean_of([].into_iter()), None);
        assert_eq!(mean_of([1.0, 2.0].into_iter()), Some(1.5));
    }
}
