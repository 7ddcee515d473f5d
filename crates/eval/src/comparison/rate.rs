//! Shares of runs, with intervals that are valid near 0 and 1.

use serde::{Deserialize, Serialize};

use crate::Interval;

/// The 97.5 % quantile of the normal distribution.
const NORMAL_QUANTILE: f64 = 1.959_963_984_540_054;

/// The rate of runs with a property.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Number of runs with the property.
    pub count: usize,
    /// Number of all runs, at least one.
    pub of: usize,
    /// Their share.
    pub share: f64,
    /// 95 % interval of the share (`[Wilson 1927]`).
    pub ci95: Interval,
}

/// The difference of two rates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateDifference {
    /// Share of the other minus share of the base.
    pub difference: f64,
    /// 95 % interval of it (`[Newcombe 1998]`, method 10), for independent runs.
    pub ci95: Interval,
}

impl Rate {
    /// The rate of `count` in `of` runs; `None` without a run.
    pub fn new(count: usize, of: usize) -> Option<Self> {
        if of == 0 || count > of {
            return None;
        }
        let (n, share) = (of as f64, count as f64 / of as f64);
        let z2 = NORMAL_QUANTILE * NORMAL_QUANTILE;
        let centre = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = NORMAL_QUANTILE / (1.0 + z2 / n) * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
        let ci95 = Interval { low: (centre - half).max(0.0), high: (centre + half).min(1.0) };
        Some(Self { count, of, share, ci95 })
    }

    /// The difference of `other` minus this rate, with the square-and-add interval of both Wilson intervals.
    pub fn difference(&self, other: &Self) -> RateDifference {
        let difference = other.share - self.share;
        let add = |a: f64, b: f64| (a * a + b * b).sqrt();
        let below = add(other.share - other.ci95.low, self.ci95.high - self.share);
        let above = add(other.ci95.high - other.share, self.share - self.ci95.low);
        let ci95 = Interval { low: (difference - below).max(-1.0), high: (difference + above).min(1.0) };
        RateDifference { difference, ci95 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilsons_interval_is_that_of_the_paper() {
        // Newcombe 1998a, table I: 81 of 263 has 0.2553 to 0.3662, 0 of 20 has 0 to 0.1611
        let Rate { ci95, .. } = Rate::new(81, 263).unwrap();
        assert!((ci95.low - 0.2553).abs() < 5e-5 && (ci95.high - 0.3662).abs() < 5e-5, "{ci95:?}");
        let none = Rate::new(0, 20).unwrap().ci95;
        assert!(none.low == 0.0 && (none.high - 0.1611).abs() < 5e-5, "{none:?}");
        assert_eq!(Rate::new(0, 0), None);
    }

    #[test]
    fn the_difference_is_that_of_the_paper() {
        // Newcombe 1998b, table II (a): 56/70 - 48/80 has 0.0524 to 0.3339 by method 10
        let (other, base) = (Rate::new(56, 70).unwrap(), Rate::new(48, 80).unwrap());
        let found = base.difference(&other);
        assert!((found.difference - 0.2).abs() < 1e-12);
        assert!((found.ci95.low - 0.0524).abs() < 5e-5 && (found.ci95.high - 0.3339).abs() < 5e-5, "{found:?}");
    }
}
