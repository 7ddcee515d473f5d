//! A 95 % interval of a mean over runs.
//!
//! The unit that is drawn again is the run (one clip, one seed), never the frame: frames of one run are correlated, and an
//! interval over them would be several times too narrow. Seeds are drawn again within their clip; the clips themselves
//! are taken as given, so the interval speaks of these clips.

use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::rng::{Purpose, stream};

use super::statistics::quantile;

/// Resamples behind every interval.
pub(super) const RESAMPLES: usize = 10_000;

/// A two-sided 95 % interval, written `[low, high]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl From<[f64; 2]> for Interval {
    fn from([low, high]: [f64; 2]) -> Self {
        Self { low, high }
    }
}

impl From<Interval> for [f64; 2] {
    fn from(interval: Interval) -> Self {
        [interval.low, interval.high]
    }
}

/// Interval of the mean over clips of each clip's mean over seeds; `clips[c]` holds the values of clip `c`'s runs.
/// `None` where a clip has a single run: one seed says nothing about the next.
///
/// Percentiles of the resampled means, taken further out than 2.5 % for few runs (Hesterberg 2015, "What teachers should
/// know about the bootstrap", section 5.3: expanded percentiles), because plain percentiles of five values cover 84 %.
pub(super) fn interval(clips: &[Vec<f64>], resamples: usize) -> Option<Interval> {
    if clips.is_empty() || clips.iter().any(|runs| runs.len() < 2) {
        return None;
    }
    let mut means: Vec<f64> = (0..resamples as u64).map(|replicate| resampled_mean(clips, replicate)).collect();
    means.sort_by(f64::total_cmp);
    let tail = tail_probability(clips);
    Some(Interval { low: quantile(&means, tail)?, high: quantile(&means, 1.0 - tail)? })
}

fn resampled_mean(clips: &[Vec<f64>], replicate: u64) -> f64 {
    let mut rng = stream(0, Purpose::Bootstrap, 0, 0, replicate);
    let clip_means = clips.iter().map(|runs| {
        let sum: f64 = (0..runs.len()).map(|_| runs[rng.random_range(0..runs.len())]).sum();
        sum / runs.len() as f64
    });
    clip_means.sum::<f64>() / clips.len() as f64
}

/// `Phi(-sqrt(n / (n - 1)) t)`: the percentile that gives a normal sample the width of Student's interval.
fn tail_probability(clips: &[Vec<f64>]) -> f64 {
    let runs: usize = clips.iter().map(Vec::len).sum();
    let freedom = runs - clips.len();
    let widening = (runs as f64 / freedom as f64).sqrt();
    0.5 * libm::erfc(widening * student_t(freedom) / std::f64::consts::SQRT_2)
}

/// The 97.5 % quantile of Student's t: tabulated below 5 degrees of freedom, above by Cornish and Fisher's expansion
/// (Abramowitz and Stegun 26.7.5), exact there to 0.01.
fn student_t(freedom: usize) -> f64 {
    const FEW: [f64; 4] = [12.706, 4.303, 3.182, 2.776];
    if let Some(t) = freedom.checked_sub(1).and_then(|i| FEW.get(i)) {
        return *t;
    }
    let (z, n) = (1.959_963_985, freedom as f64);
    let (z3, z5, z7) = (libm::pow(z, 3.0), libm::pow(z, 5.0), libm::pow(z, 7.0));
    let first = (z3 + z) / 4.0;
    let second = (5.0 * z5 + 16.0 * z3 + 3.0 * z) / 96.0;
    let third = (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / 384.0;
    z + first / n + second / (n * n) + third / (n * n * n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn quantiles_of_student_agree_with_tables() {
        for (freedom, t) in [(1, 12.706), (4, 2.776), (5, 2.571), (9, 2.262), (30, 2.042), (1000, 1.962)] {
            assert!((student_t(freedom) - t).abs() < 0.01, "{freedom}");
        }
    }

    #[test]
    fn one_run_in_any_clip_gives_no_interval() {
        assert_eq!(interval(&[vec![1.0]], 100), None);
        assert_eq!(interval(&[vec![1.0, 2.0], vec![3.0]], 100), None);
    }

    #[test]
    fn equal_runs_give_an_interval_of_no_width_and_unequal_ones_hold_the_mean() {
        assert_eq!(interval(&[vec![3.0; 4]], 100), Some(Interval { low: 3.0, high: 3.0 }));
        let Interval { low, high } = interval(&[vec![28.0, 30.0, 29.0, 33.0, 31.0]], 2000).unwrap();
        assert!((28.0..30.2).contains(&low) && (30.3..=33.0).contains(&high));
    }

    #[test]
    fn clips_weigh_alike_however_many_seeds_they_have() {
        let Interval { low, high } = interval(&[vec![10.0; 9], vec![20.0; 2]], 100).unwrap();
        assert_eq!((low, high), (15.0, 15.0));
    }

    #[test]
    fn intervals_of_five_normal_runs_cover_the_truth_about_as_often_as_they_say() {
        let covered = (0..400).filter(|trial| {
            let mut rng = stream(*trial, Purpose::Oracle, 0, 0, 0);
            let runs: Vec<f64> = (0..5).map(|_| StandardNormal.sample(&mut rng)).collect();
            let Interval { low, high } = interval(&[runs], 1000).unwrap();
            low <= 0.0 && 0.0 <= high
        });
        let share = covered.count() as f64 / 400.0;
        assert!((0.90..=0.98).contains(&share), "covered {share}");
    }
}
