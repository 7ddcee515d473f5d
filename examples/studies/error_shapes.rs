//! Distributions of the errors of runs, of the study of intervals.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, Exp1, StandardNormal};

/// Mean, or median of log-normal distributions, of the errors of tracked bodies, mm.
const CENTRE: f64 = 40.0;

/// A distribution of errors with a known mean, mm.
#[derive(Clone, Copy)]
pub(crate) enum ErrorShape {
    /// Mean 40, standard deviation 4.
    Normal,
    /// Median 40, standard deviation of the logarithms.
    LogNormal(f64),
    /// Mean 40.
    Exponential,
    /// Log-normal about 40 with 0.1; this share about 300 with 0.3, for lost bodies.
    Lost(f64),
}

impl ErrorShape {
    pub(crate) fn draw(self, rng: &mut impl Rng) -> f64 {
        let mut log_normal = |median: f64, deviation: f64| {
            let z: f64 = StandardNormal.sample(rng);
            median * libm::exp(deviation * z)
        };
        match self {
            Self::Normal => {
                let z: f64 = StandardNormal.sample(rng);
                CENTRE + 4.0 * z
            }
            Self::LogNormal(deviation) => log_normal(CENTRE, deviation),
            Self::Exponential => {
                let x: f64 = Exp1.sample(rng);
                CENTRE * x
            }
            Self::Lost(share) => {
                let followed = log_normal(CENTRE, 0.1);
                let lost = log_normal(300.0, 0.3);
                if rng.random_bool(share) { lost } else { followed }
            }
        }
    }

    pub(crate) fn mean(self) -> f64 {
        let log_normal = |median: f64, deviation: f64| median * libm::exp(0.5 * deviation * deviation);
        match self {
            Self::Normal | Self::Exponential => CENTRE,
            Self::LogNormal(deviation) => log_normal(CENTRE, deviation),
            Self::Lost(share) => (1.0 - share) * log_normal(CENTRE, 0.1) + share * log_normal(300.0, 0.3),
        }
    }
}
