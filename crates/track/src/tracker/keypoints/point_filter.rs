//! A Kalman filter of one point that moves with nearly constant velocity (white acceleration), the same in each axis.

use nalgebra::{Matrix2, Point3, RowVector2, Vector2, Vector3};

/// Variance of the velocity before it is known, m^2 / s^2.
const UNKNOWN_VELOCITY: f64 = 25.0;

/// Position and velocity of a point, with the covariance of one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointFilter {
    place: Point3<f64>,
    velocity: Vector3<f64>,
    covariance: Matrix2<f64>,
    time_s: f64,
}

impl PointFilter {
    /// A point that was measured for the first time, with this variance per axis, m^2.
    pub(super) fn new(place: Point3<f64>, variance: f64, time_s: f64) -> Self {
        let covariance = Matrix2::from_diagonal(&Vector2::new(variance, UNKNOWN_VELOCITY));
        Self { place, velocity: Vector3::zeros(), covariance, time_s }
    }

    /// The position after another measurement, with this variance per axis, m^2; `acceleration` is the standard
    /// deviation of the point's acceleration per axis, m / s^2.
    pub(super) fn measured(
        &mut self,
        place: &Point3<f64>,
        variance: f64,
        time_s: f64,
        acceleration: f64,
    ) -> Point3<f64> {
        let step = time_s - self.time_s;
        let moves = Matrix2::new(1.0, step, 0.0, 1.0);
        let push = Vector2::new(0.5 * step * step, step) * acceleration;
        self.place += step * self.velocity;
        self.covariance = moves * self.covariance * moves.transpose() + push * push.transpose();
        let sees = RowVector2::new(1.0, 0.0);
        let gain = self.covariance * sees.transpose() / (self.covariance[(0, 0)] + variance);
        let surprise = place - self.place;
        self.place += gain[0] * surprise;
        self.velocity += gain[1] * surprise;
        self.covariance = (Matrix2::identity() - gain * sees) * self.covariance;
        self.time_s = time_s;
        self.place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Purpose, normal, stream};

    const STEP_S: f64 = 0.02;

    /// Root mean square errors of measurements and of the filter, metres, for a point on a circle.
    fn errors(noise_m: f64) -> [f64; 2] {
        let mut random = stream(2, Purpose::Keypoints, 0, 0, 0);
        let at = |time_s: f64| Point3::new(0.3 * (2.0 * time_s).cos(), 0.3 * (2.0 * time_s).sin(), 1.0 + 0.5 * time_s);
        let mut filter: Option<PointFilter> = None;
        let mut sums = [0.0; 2];
        for frame in 0..2000 {
            let time_s = f64::from(frame) * STEP_S;
            let seen = at(time_s) + noise_m * Vector3::from_fn(|_, _| normal(&mut random));
            let variance = noise_m * noise_m;
            let filter = filter.get_or_insert_with(|| PointFilter::new(seen, variance, time_s));
            let found = filter.measured(&seen, variance, time_s, 2.0);
            sums[0] += (seen - at(time_s)).norm_squared() / 2000.0;
            sums[1] += (found - at(time_s)).norm_squared() / 2000.0;
        }
        sums.map(f64::sqrt)
    }

    #[test]
    fn white_errors_are_more_than_halved_and_exact_points_are_kept() {
        let [seen, filtered] = errors(0.02);
        assert!(filtered < 0.5 * seen, "{seen} {filtered}");
        let [_, exact] = errors(1e-7);
        assert!(exact < 1e-6, "{exact}");
    }
}
