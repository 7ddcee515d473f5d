//! The continuous ranked probability score: how well the estimate's distribution predicts the truth.

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::mpjpe::pooled;

/// Mean over the coordinates of all markers.
pub(super) const CRPS: Metric = Metric {
    name: "crps_mm",
    title: "CRPS of the markers' distributions",
    meaning: "How well the tracker's stated uncertainty predicts the truth: small if errors are small and foreseen",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "covariances of the markers (estimate_covariance), which refined trackers give",
    protocol: "continuous ranked probability score of the normal distribution about the estimate with the covariance that \
               the estimate gives, for each world coordinate of the 15 virtual markers; an error of the size that was \
               told scores best, and a distribution without spread scores the error itself; pooled over all \
               coordinates of all markers of all frames",
    measure: crps,
};

fn crps(sequence: &Sequence<'_>) -> Option<Measurement> {
    let covariances = sequence.covariances?;
    pooled(sequence, |frame| {
        let of_marker = |(landmark, truth, estimate): (usize, nalgebra::Point3<f64>, nalgebra::Point3<f64>)| {
            let covariance = covariances[frame][landmark]?;
            Some(
                [0, 1, 2].map(|axis| of_normal(truth[axis] - estimate[axis], covariance[(axis, axis)].max(0.0).sqrt())),
            )
        };
        sequence.pairs(frame).filter_map(of_marker).flatten().map(|metres| 1000.0 * metres).collect()
    })
}

/// CRPS of a normal distribution with mean 0 and standard deviation `deviation` for the outcome `error`
/// (`[Gneiting 2007]`, section 4.2).
fn of_normal(error: f64, deviation: f64) -> f64 {
    if deviation <= 0.0 {
        return error.abs();
    }
    let z = error / deviation;
    let density = libm::exp(-0.5 * z * z) / std::f64::consts::TAU.sqrt();
    let twice_below_less_one = libm::erf(z * std::f64::consts::FRAC_1_SQRT_2);
    deviation * (z * twice_below_less_one + 2.0 * density - std::f64::consts::FRAC_2_SQRT_PI / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate;
    use crate::test_figure::{standing, translated};
    use nalgebra::{Matrix3, Vector3};

    /// The definition: the integral of the squared difference between the distribution and a step at the outcome.
    fn by_integration(error: f64, deviation: f64) -> f64 {
        let step = 1e-3 * deviation;
        let squares = (-20_000..20_000).map(|index| {
            let x = step * (f64::from(index) + 0.5);
            let below = 0.5 * (1.0 + libm::erf(x / deviation * std::f64::consts::FRAC_1_SQRT_2));
            let happened = if x >= error { 1.0 } else { 0.0 };
            (below - happened) * (below - happened)
        });
        step * squares.sum::<f64>()
    }

    #[test]
    fn the_closed_form_is_the_integral_that_defines_it() {
        for (error, deviation) in [(0.0, 1.0), (0.7, 1.0), (-2.5, 1.3), (3.0, 0.4)] {
            let (closed, integral) = (of_normal(error, deviation), by_integration(error, deviation));
            assert!((closed - integral).abs() < 2e-3 * deviation, "{error} {deviation}: {closed} {integral}");
        }
        assert!((of_normal(0.02, 1e-9) - 0.02).abs() < 1e-8 && of_normal(-0.02, 0.0) == 0.02);
    }

    #[test]
    fn a_distribution_as_wide_as_the_error_scores_better_than_a_narrow_or_a_wide_one() {
        let truth = vec![standing(); 3];
        let estimate: Vec<_> = truth.iter().map(|m| translated(m, Vector3::new(0.02, 0.02, 0.02))).collect();
        let score = |deviation: f64| {
            let covariances = vec![[Some(Matrix3::identity() * deviation * deviation); 15]; 3];
            let mut sequence = Sequence::from_markers(60.0, &truth, &estimate);
            sequence.covariances = Some(&covariances);
            evaluate(&sequence).unwrap().metrics["crps_mm"].mean
        };
        assert!(
            score(0.02) < score(0.002) && score(0.02) < score(0.2),
            "{} {} {}",
            score(0.002),
            score(0.02),
            score(0.2)
        );
        // z = 1: 20 mm x (0.68269 + 0.48394 - 0.56419)
        assert!((score(0.02) - 12.0488).abs() < 1e-3, "{}", score(0.02));
    }
}
