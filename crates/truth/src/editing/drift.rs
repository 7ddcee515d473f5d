//! Slow random drifts.

use core::f64::consts::TAU;

use rand::RngExt;

use crate::rng::{Purpose, stream};

/// Sine waves that a drift is the sum of.
const WAVES: usize = 4;

/// Shortest and longest period, seconds.
const PERIODS_S: [f64; 2] = [3.0, 12.0];

/// A smooth function of time with mean 0 and mean square 1: sines of random period and phase.
pub(super) struct Drift([(f64, f64); WAVES]);

impl Drift {
    /// The drift number `index` of a seed.
    pub(super) fn new(seed: u64, index: u64) -> Self {
        let mut rng = stream(seed, Purpose::MotionVariation, 0, 0, index);
        let [shortest, longest] = PERIODS_S;
        let mut wave = 0.0;
        Self([(); WAVES].map(|()| {
            // each in a part of the range of its own: waves of nearly the same period would beat
            let share = (wave + 0.15 + 0.7 * rng.random::<f64>()) / WAVES as f64;
            wave += 1.0;
            let period = shortest * libm::pow(longest / shortest, share);
            (TAU / period, TAU * rng.random::<f64>())
        }))
    }

    /// Its value at a time, seconds; at most `sqrt(8)`.
    pub(super) fn at(&self, seconds: f64) -> f64 {
        let sum: f64 = self.0.iter().map(|(speed, phase)| libm::sin(speed * seconds + phase)).sum();
        sum * libm::sqrt(2.0 / WAVES as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drift_has_mean_0_and_mean_square_1_changes_slowly_and_is_its_seeds_own() {
        let drift = Drift::new(3, 1);
        let values: Vec<f64> = (0..400_000).map(|k| drift.at(0.01 * f64::from(k))).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        assert!(mean.abs() < 0.01 && (square - 1.0).abs() < 0.05, "{mean} {square}");
        assert!(values.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.01 * 2.83 * TAU / 3.0));
        assert_ne!(drift.at(1.0), Drift::new(3, 2).at(1.0));
        assert_eq!(drift.at(1.0), Drift::new(3, 1).at(1.0));
    }
}
