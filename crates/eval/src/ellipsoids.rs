//! Calibration of an estimate's covariances: how often the truth lies within their ellipsoids.

use nalgebra::Matrix3;

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;

/// Squared radii, in standard deviations, of the balls that contain 50 and 90 % of a normal distribution in three
/// dimensions: quantiles of chi-squared with three degrees of freedom.
const HALF_SQUARE: f64 = 2.365_973_884;
const NINE_TENTHS_SQUARE: f64 = 6.251_388_631;

/// Ellipsoids that should contain half of the markers.
pub(super) const HALF: Metric = Metric {
    name: "ellipsoid50",
    title: "Markers within their 50 % ellipsoid",
    meaning: "How often the truth lies where the tracker is 50 % sure that it is; 50 % is right, less is too sure",
    unit: Unit::Fraction,
    direction: Direction::Neither,
    needs: "covariances of the markers (estimate_covariance), which refined trackers give",
    protocol: "share of the 15 virtual markers whose true position lies in the ellipsoid that holds 50 % of a normal \
               distribution about the estimate with the covariance that the estimate gives; 0.5 is right, less is too \
               sure; all markers of all frames count alike",
    measure: half,
};

/// Ellipsoids that should contain nine tenths of the markers.
pub(super) const NINE_TENTHS: Metric = Metric {
    name: "ellipsoid90",
    title: "Markers within their 90 % ellipsoid",
    meaning: "How often the truth lies where the tracker is 90 % sure that it is; 90 % is right, less is too sure",
    unit: Unit::Fraction,
    direction: Direction::Neither,
    needs: "covariances of the markers (estimate_covariance), which refined trackers give",
    protocol: "share of the 15 virtual markers whose true position lies in the ellipsoid that holds 90 % of a normal \
               distribution about the estimate with the covariance that the estimate gives; 0.9 is right, less is too \
               sure; all markers of all frames count alike",
    measure: nine_tenths,
};

fn half(sequence: &Sequence<'_>) -> Option<Measurement> {
    within(sequence, HALF_SQUARE)
}

fn nine_tenths(sequence: &Sequence<'_>) -> Option<Measurement> {
    within(sequence, NINE_TENTHS_SQUARE)
}

fn within(sequence: &Sequence<'_>, square: f64) -> Option<Measurement> {
    let covariances = sequence.covariances?;
    let of_frame = |frame: usize| -> Vec<f64> {
        let pairs = sequence.pairs(frame);
        let inside = pairs.filter_map(|(landmark, truth, estimate)| {
            let distance = mahalanobis_square(&covariances[frame][landmark]?, &(truth - estimate))?;
            Some(f64::from(u8::from(distance <= square)))
        });
        inside.collect()
    };
    let all: Vec<f64> = sequence.scored().flat_map(of_frame).collect();
    let mean = mean_of(all.iter().copied())?;
    Some(Measurement::Pooled {
        per_frame: sequence.per_scored_frame(|frame| mean_of(of_frame(frame).into_iter())),
        mean,
    })
}

/// `d.(C^-1 d)`; infinite for a singular covariance and an error other than 0.
fn mahalanobis_square(covariance: &Matrix3<f64>, error: &nalgebra::Vector3<f64>) -> Option<f64> {
    match covariance.cholesky() {
        Some(factors) => Some(error.dot(&factors.solve(error))),
        None => Some(if error.norm() == 0.0 { 0.0 } else { f64::INFINITY }),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::evaluate;
    use crate::rng::{Purpose, normal, stream};
    use crate::test_figure::{standing, translated};

    fn share(error: Vector3<f64>, covariance: Matrix3<f64>) -> [f64; 2] {
        let truth = vec![standing(); 4];
        let estimate: Vec<_> = truth.iter().map(|markers| translated(markers, error)).collect();
        let covariances = vec![[Some(covariance); 15]; 4];
        let mut sequence = Sequence::from_markers(60.0, &truth, &estimate);
        sequence.covariances = Some(&covariances);
        let metrics = evaluate(&sequence).unwrap().metrics;
        ["ellipsoid50", "ellipsoid90"].map(|name| metrics[name].mean)
    }

    #[test]
    fn an_error_is_measured_relative_to_the_ellipsoid_in_its_direction() {
        let long = Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-6, 1e-6));
        assert_eq!(share(Vector3::new(0.015, 0.0, 0.0), long), [1.0, 1.0], "1.5 deviations");
        assert_eq!(share(Vector3::new(0.02, 0.0, 0.0), long), [0.0, 1.0], "2 deviations");
        assert_eq!(share(Vector3::new(0.0, 0.02, 0.0), long), [0.0, 0.0], "20 deviations");
        assert_eq!(share(Vector3::zeros(), Matrix3::zeros()), [1.0, 1.0], "no error and none expected");
        assert_eq!(share(Vector3::new(1e-9, 0.0, 0.0), Matrix3::zeros()), [0.0, 0.0]);
    }

    #[test]
    fn errors_drawn_from_the_covariance_lie_within_as_often_as_they_should() {
        let factor = Matrix3::new(3.0, 0.0, 0.0, 1.0, 2.0, 0.0, -1.0, 0.5, 1.5) * 1e-3;
        let covariance = factor * factor.transpose();
        let mut rng = stream(1, Purpose::Oracle, 0, 0, 0);
        let truth = vec![standing(); 400];
        let moved = |marker: Option<nalgebra::Point3<f64>>, rng: &mut _| {
            let deviates = Vector3::from_fn(|_, _| normal(rng));
            marker.map(|place| place + factor * deviates)
        };
        let estimate: Vec<_> = truth.iter().map(|markers| markers.map(|marker| moved(marker, &mut rng))).collect();
        let covariances = vec![[Some(covariance); 15]; 400];
        let mut sequence = Sequence::from_markers(60.0, &truth, &estimate);
        sequence.covariances = Some(&covariances);
        let metrics = evaluate(&sequence).unwrap().metrics;
        // 5985 draws: the standard deviation of the share is 0.0065 and 0.0039.
        assert!((metrics["ellipsoid50"].mean - 0.5).abs() < 0.026, "{}", metrics["ellipsoid50"].mean);
        assert!((metrics["ellipsoid90"].mean - 0.9).abs() < 0.016, "{}", metrics["ellipsoid90"].mean);
    }

    #[test]
    fn an_estimate_without_covariances_is_not_measured() {
        let markers = vec![standing(); 3];
        let evaluation = evaluate(&Sequence::from_markers(60.0, &markers, &markers)).unwrap();
        assert!(evaluation.absent["ellipsoid50"].contains("estimate_covariance"));
    }
}
