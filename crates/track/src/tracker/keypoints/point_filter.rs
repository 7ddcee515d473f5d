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
        *self = self.predicted(time_s, acceleration);
        let sees = RowVector2::new(1.0, 0.0);
        let gain = self.covariance * sees.transpose() / (self.covariance[(0, 0)] + variance);
        let surprise = place - self.place;
        self.place += gain[0] * surprise;
        self.velocity += gain[1] * surprise;
        self.covariance = (Matrix2::identity() - gain * sees) * self.covariance;
        self.place
    }

    /// What is known of a later time, without a measurement.
    fn predicted(&self, time_s: f64, acceleration: f64) -> Self {
        let moves = self.moves(time_s);
        let step = moves[(0, 1)];
        let push = Vector2::new(0.5 * step * step, step) * acceleration;
        Self {
            place: self.place + step * self.velocity,
            velocity: self.velocity,
            covariance: moves * self.covariance * moves.transpose() + push * push.transpose(),
            time_s,
        }
    }

    /// The matrix that moves position and velocity to a later time.
    fn moves(&self, time_s: f64) -> Matrix2<f64> {
        Matrix2::new(1.0, time_s - self.time_s, 0.0, 1.0)
    }

    /// What is known with all measurements, from what is known with those until now, what was predicted from it for the
    /// next time, and what is known of that time with all measurements (`[Rauch 1965]`).
    fn smoothed(&self, predicted: &Self, next: &Self) -> Self {
        let moves = self.moves(predicted.time_s);
        let Some(inverse) = predicted.covariance.try_inverse() else { return *self };
        let gain = self.covariance * moves.transpose() * inverse;
        let (place, velocity) = (next.place - predicted.place, next.velocity - predicted.velocity);
        Self {
            place: self.place + gain[(0, 0)] * place + gain[(0, 1)] * velocity,
            velocity: self.velocity + gain[(1, 0)] * place + gain[(1, 1)] * velocity,
            covariance: self.covariance + gain * (next.covariance - predicted.covariance) * gain.transpose(),
            time_s: self.time_s,
        }
    }
}

/// A measurement of a point: its place and the variance per axis, m^2.
pub(super) type PointMeasurement = (Point3<f64>, f64);

/// Position and standard deviation per axis, metres, of a point at every time, from all measurements: those before it
/// and those after it (`[Rauch 1965]`). `None` before the first measurement and after the last one.
pub(super) fn smoothed(
    measured: &[(f64, Option<PointMeasurement>)],
    acceleration: f64,
) -> Vec<Option<PointMeasurement>> {
    let last = measured.iter().rposition(|(_, found)| found.is_some()).map_or(0, |last| last + 1);
    let mut forward: Vec<(PointFilter, PointFilter)> = Vec::new();
    for (time_s, found) in &measured[..last] {
        let next = match (forward.last(), found) {
            (None, None) => continue,
            (None, Some((place, variance))) => {
                let first = PointFilter::new(*place, *variance, *time_s);
                (first, first)
            }
            (Some((known, _)), found) => {
                let (predicted, mut now) = (known.predicted(*time_s, acceleration), *known);
                match found {
                    Some((place, variance)) => drop(now.measured(place, *variance, *time_s, acceleration)),
                    None => now = predicted,
                }
                (now, predicted)
            }
        };
        forward.push(next);
    }
    let mut known: Option<(PointFilter, PointFilter)> = None;
    let mut backward: Vec<Option<PointMeasurement>> = vec![None; measured.len() - last];
    for (now, predicted) in forward.iter().rev() {
        let own = known.map_or(*now, |(next, of_next)| now.smoothed(&of_next, &next));
        backward.push(Some((own.place, own.covariance[(0, 0)].max(0.0).sqrt())));
        known = Some((own, *predicted));
    }
    backward.resize(measured.len(), None);
    backward.reverse();
    backward
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::rng::{Purpose, normal, stream};

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
    fn a_smoother_halves_the_filters_error_fills_gaps_and_knows_its_deviation() {
        let mut random = stream(3, Purpose::Keypoints, 0, 0, 0);
        let at = |time_s: f64| Point3::new(0.3 * (2.0 * time_s).cos(), 0.3 * (2.0 * time_s).sin(), 1.0 + 0.5 * time_s);
        let mut measured: Vec<(f64, Option<PointMeasurement>)> = (0..600)
            .map(|frame| {
                let time_s = f64::from(frame) * STEP_S;
                let seen = at(time_s) + 0.02 * Vector3::from_fn(|_, _| normal(&mut random));
                let is_seen = (5..595).contains(&frame) && !(300..310).contains(&frame);
                (time_s, is_seen.then_some((seen, 4e-4)))
            })
            .collect();
        let found = smoothed(&measured, 2.0);
        assert!(found[..5].iter().chain(&found[595..]).all(Option::is_none));
        let known = || measured.iter().zip(&found).filter_map(|((time_s, _), found)| Some((at(*time_s), (*found)?)));
        assert_eq!(known().count(), 590);
        let square: f64 = known().map(|(place, (found, _))| (found - place).norm_squared()).sum::<f64>() / 590.0;
        let stated: f64 = known().map(|(_, (_, deviation))| 3.0 * deviation * deviation).sum::<f64>() / 590.0;
        let [_, filtered] = errors(0.02);
        assert!(square.sqrt() < 0.65 * filtered, "{} {filtered}", square.sqrt());
        assert!((0.5..1.5).contains(&(square / stated)), "{square} {stated}");
        assert!(found[305].unwrap().1 > 1.2 * found[200].unwrap().1);
        // Backwards in time, the same points are found.
        let end = measured.last().unwrap().0;
        measured.iter_mut().for_each(|(time_s, _)| *time_s = end - *time_s);
        measured.reverse();
        let mut again = smoothed(&measured, 2.0);
        again.reverse();
        let far = |frame: usize| (again[frame].unwrap().0 - found[frame].unwrap().0).norm();
        assert!(far(100) < 1e-4 && far(305) < 1e-4, "{} {}", far(100), far(305));
        assert!(smoothed(&[], 1.0).is_empty() && smoothed(&[(0.0, None)], 1.0) == [None]);
    }

    #[test]
    fn white_errors_shrink_by_two_fifths_and_exact_points_are_kept() {
        let [seen, filtered] = errors(0.02);
        assert!(filtered < 0.6 * seen, "{seen} {filtered}");
        let [_, exact] = errors(1e-7);
        assert!(exact < 1e-6, "{exact}");
    }
}
