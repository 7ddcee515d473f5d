//! A smooth curve through waypoints on the ground, parametrised by arc length.

use nalgebra::Vector2;

use super::EditError;

/// Number of tabulated points per segment between two waypoints.
const SAMPLES: usize = 64;

/// Least distance between consecutive waypoints, metres.
const MIN_WAYPOINT_DISTANCE: f64 = 0.1;

/// A curve through waypoints, extended by straight lines at both ends.
pub(super) struct Curve {
    points: Vec<Vector2<f64>>,
    /// Arc length up to each point.
    lengths: Vec<f64>,
    /// Direction of the curve at each point, radians from +X, unwrapped.
    headings: Vec<f64>,
}

impl Curve {
    /// The centripetal Catmull-Rom spline through the waypoints (`[Yuksel 2011]`), which has no cusps and no loops
    /// within a segment.
    pub(super) fn through(waypoints: &[[f64; 2]]) -> Result<Self, EditError> {
        let invalid = |found: String| {
            Err(EditError::Path(format!(
                "expected at least two waypoints, each at least {MIN_WAYPOINT_DISTANCE} m from the previous one, found \
                 {found}"
            )))
        };
        let given: Vec<Vector2<f64>> = waypoints.iter().map(|point| Vector2::from(*point)).collect();
        if given.len() < 2 {
            return invalid(given.len().to_string());
        }
        for (index, pair) in given.windows(2).enumerate() {
            let distance = (pair[1] - pair[0]).norm();
            if distance.is_nan() || distance < MIN_WAYPOINT_DISTANCE {
                return invalid(format!("{distance:.3} m from waypoint {} to the next", index + 1));
            }
        }
        let last = given.len() - 1;
        // reflected ends: the curve is tangent to the chord at the first and last waypoints
        let at = |index: isize| match usize::try_from(index) {
            Err(_) => 2.0 * given[0] - given[1],
            Ok(index) if index > last => 2.0 * given[last] - given[last - 1],
            Ok(index) => given[index],
        };
        let mut points = vec![given[0]];
        for segment in 0..last.cast_signed() {
            let four = [segment - 1, segment, segment + 1, segment + 2].map(at);
            points.extend((1..=SAMPLES).map(|k| catmull_rom(&four, k as f64 / SAMPLES as f64)));
        }
        let mut lengths = vec![0.0; points.len()];
        for index in 1..points.len() {
            lengths[index] = lengths[index - 1] + (points[index] - points[index - 1]).norm();
        }
        let chord = |from: usize, to: usize| points[to] - points[from];
        let direction = |index: usize| chord(index.saturating_sub(1), (index + 1).min(points.len() - 1));
        let mut headings: Vec<f64> = (0..points.len()).map(|i| libm::atan2(direction(i).y, direction(i).x)).collect();
        unwrap(&mut headings);
        Ok(Self { points, lengths, headings })
    }

    /// Point and heading at an arc length from the first waypoint; on the straight extensions before and after the
    /// curve.
    pub(super) fn at(&self, length: f64) -> (Vector2<f64>, f64) {
        let last = self.points.len() - 1;
        let next = self.lengths.partition_point(|l| *l < length).clamp(1, last);
        let (from, to) = (next - 1, next);
        let share = (length - self.lengths[from]) / (self.lengths[to] - self.lengths[from]).max(1e-12);
        if (0.0..=1.0).contains(&share) {
            let point = self.points[from].lerp(&self.points[to], share);
            return (point, self.headings[from] + share * (self.headings[to] - self.headings[from]));
        }
        let end = if share < 0.0 { from } else { to };
        let heading = self.headings[end];
        let ahead = Vector2::new(libm::cos(heading), libm::sin(heading));
        (self.points[end] + ahead * (length - self.lengths[end]), heading)
    }
}

/// Barry and Goldman's algorithm with knots spaced by the square roots of the chord lengths.
fn catmull_rom(four: &[Vector2<f64>; 4], share: f64) -> Vector2<f64> {
    let mut knots = [0.0; 4];
    for index in 1..4 {
        knots[index] = knots[index - 1] + libm::sqrt((four[index] - four[index - 1]).norm());
    }
    let t = knots[1] + share * (knots[2] - knots[1]);
    let between = |a: Vector2<f64>, b: Vector2<f64>, from: f64, to: f64| {
        a * ((to - t) / (to - from)) + b * ((t - from) / (to - from))
    };
    let [a, b, c] = [0, 1, 2].map(|i| between(four[i], four[i + 1], knots[i], knots[i + 1]));
    let (d, e) = (between(a, b, knots[0], knots[2]), between(b, c, knots[1], knots[3]));
    between(d, e, knots[1], knots[2])
}

/// Removes jumps by full turns between neighbours.
pub(super) fn unwrap(angles: &mut [f64]) {
    for index in 1..angles.len() {
        let turns = libm::round((angles[index] - angles[index - 1]) / core::f64::consts::TAU);
        angles[index] -= turns * core::f64::consts::TAU;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_passes_its_waypoints_and_continues_straight() {
        let waypoints = [[0.0, 0.0], [2.0, 0.0], [3.0, 2.0], [3.0, 5.0]];
        let curve = Curve::through(&waypoints).unwrap();
        for (index, waypoint) in waypoints.iter().enumerate() {
            let (point, _) = curve.at(curve.lengths[index * SAMPLES]);
            assert!((point - Vector2::from(*waypoint)).norm() < 1e-12);
        }
        let total = *curve.lengths.last().unwrap();
        let (beyond, heading) = curve.at(total + 2.0);
        assert!((heading - core::f64::consts::FRAC_PI_2).abs() < 0.1, "{heading}");
        assert!(((beyond - Vector2::new(3.0, 5.0)).norm() - 2.0).abs() < 1e-9);
        let (before, heading) = curve.at(-1.0);
        assert!((before.norm() - 1.0).abs() < 1e-9 && heading.abs() < 0.1);
    }

    #[test]
    fn points_at_equal_lengths_are_equally_far_apart() {
        let curve = Curve::through(&[[0.0, 0.0], [2.0, 1.0], [2.5, 4.0], [-1.0, 5.0]]).unwrap();
        for step in 0..60 {
            let (a, b) = (curve.at(0.1 * f64::from(step)).0, curve.at(0.1 * f64::from(step + 1)).0);
            assert!(((a - b).norm() - 0.1).abs() < 2e-3, "step {step}: {}", (a - b).norm());
        }
    }

    #[test]
    fn invalid_waypoints_are_refused() {
        let message = |points: &[[f64; 2]]| Curve::through(points).err().unwrap().to_string();
        assert!(message(&[[0.0, 0.0]]).contains("at least two waypoints"));
        assert!(message(&[[0.0, 0.0], [0.0, 0.01]]).contains("0.010 m from waypoint 1 to the next"));
        assert!(message(&[[0.0, 0.0], [f64::NAN, 0.0]]).contains("waypoint 1"));
    }
}
