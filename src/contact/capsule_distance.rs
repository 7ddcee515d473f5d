//! How far two tapered capsules are apart, without iterating over their surfaces.

use nalgebra::{Point3, Vector3};

use crate::raster::TaperedCapsule;

/// Steps of the golden section search: its bracket shrinks to 1e-9 of a segment.
const SEARCH_STEPS: usize = 44;

/// Signed distance of two tapered capsules, metres: negative where they overlap, and then the least radius by which their
/// balls would have to shrink together to part them (the penetration depth wherever the segments do not cross).
///
/// A tapered capsule is a row of balls along a segment. Balls `s` and `t` of two rows are
/// `|a(s) - b(t)| - r_a(s) - r_b(t)` apart, a convex function of `(s, t)`: a norm of something linear and a linear part. Equal
/// radii leave the distance of two segments (Ericson 2005, Real-Time Collision Detection, 5.1.9), which is closed; else the best
/// `t` for a given `s` is closed and the remaining convex function of `s` is searched by golden section.
pub fn tapered_capsule_distance(first: &TaperedCapsule, second: &TaperedCapsule) -> f64 {
    if first.radius_a == first.radius_b && second.radius_a == second.radius_b {
        return segment_distance(first, second) - first.radius_a - second.radius_a;
    }
    nearest_ball(first, |centre| distance_from_point(second, &centre))
}

/// The least of `distance(centre) - radius` over the balls of a tapered capsule, `distance` being convex.
pub(super) fn nearest_ball(solid: &TaperedCapsule, distance: impl Fn(Point3<f64>) -> f64) -> f64 {
    let at = |s: f64| {
        let radius = solid.radius_a + s * (solid.radius_b - solid.radius_a);
        distance(solid.a + (solid.b - solid.a) * s) - radius
    };
    let ratio = 0.5 * (libm::sqrt(5.0) - 1.0);
    let (mut low, mut high) = (0.0, 1.0);
    let (mut s, mut t) = (1.0 - ratio, ratio);
    let (mut at_s, mut at_t) = (at(s), at(t));
    for _ in 0..SEARCH_STEPS {
        if at_s < at_t {
            (high, t, at_t) = (t, s, at_s);
            s = high - ratio * (high - low);
            at_s = at(s);
        } else {
            (low, s, at_s) = (s, t, at_t);
            t = low + ratio * (high - low);
            at_t = at(t);
        }
    }
    at_s.min(at_t).min(at(0.0)).min(at(1.0))
}

/// Signed distance of a point: along the axis the nearest ball is the foot of the perpendicular moved by
/// `k y / sqrt(1 - k^2)`, with `y` the distance from the axis and `k` the change of radius per length.
fn distance_from_point(solid: &TaperedCapsule, point: &Point3<f64>) -> f64 {
    let axis = solid.b - solid.a;
    let taper = solid.radius_b - solid.radius_a;
    let from_a = point - solid.a;
    let ball = |t: f64| (from_a - axis * t).norm() - (solid.radius_a + t * taper);
    let length = axis.norm();
    if length <= taper.abs() {
        // one ball holds the other
        return ball(0.0).min(ball(1.0));
    }
    let along = from_a.dot(&axis) / length;
    let across = libm::sqrt((from_a.norm_squared() - along * along).max(0.0));
    let k = taper / length;
    ball(((along + k * across / libm::sqrt(1.0 - k * k)) / length).clamp(0.0, 1.0))
}

/// Distance of the two axes.
fn segment_distance(first: &TaperedCapsule, second: &TaperedCapsule) -> f64 {
    let (u, v, w) = (first.b - first.a, second.b - second.a, first.a - second.a);
    let (uu, uv, vv, uw, vw) = (u.norm_squared(), u.dot(&v), v.norm_squared(), u.dot(&w), v.dot(&w));
    let share = |numerator: f64, denominator: f64| {
        if denominator > 0.0 { (numerator / denominator).clamp(0.0, 1.0) } else { 0.0 }
    };
    let nearest_on_second = |s: f64| share(vw + uv * s, vv);
    let s = share(uv * vw - uw * vv, uu * vv - uv * uv);
    let t = nearest_on_second(s);
    let s = share(uv * t - uw, uu);
    let apart: Vector3<f64> = w + u * s - v * t;
    apart.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn solid() -> impl Strategy<Value = TaperedCapsule> {
        let place = || (-0.5..0.5_f64, -0.5..0.5_f64, -0.5..0.5_f64).prop_map(|(x, y, z)| Point3::new(x, y, z));
        (place(), place(), 0.02..0.2_f64, 0.02..0.2_f64).prop_map(|(a, b, radius_a, radius_b)| TaperedCapsule {
            a,
            b,
            radius_a,
            radius_b,
        })
    }

    fn plain(solid: TaperedCapsule) -> TaperedCapsule {
        TaperedCapsule { radius_b: solid.radius_a, ..solid }
    }

    /// Parry's distance of the axes, less the radii: its GJK on round solids is itself only good to some tenths of a millimetre.
    fn parry(a: &TaperedCapsule, b: &TaperedCapsule) -> f64 {
        use parry3d::math::{Pose, Vector};
        let axis = |c: &TaperedCapsule| {
            let point = |p: &Point3<f64>| Vector::new(p.x as f32, p.y as f32, p.z as f32);
            parry3d::shape::Segment::new(point(&c.a), point(&c.b))
        };
        let apart = parry3d::query::distance(&Pose::IDENTITY, &axis(a), &Pose::IDENTITY, &axis(b)).unwrap();
        f64::from(apart.distance) - a.radius_a - b.radius_a
    }

    /// The nearest pair of balls of 400 x 400.
    fn by_sampling(a: &TaperedCapsule, b: &TaperedCapsule) -> f64 {
        let ball = |c: &TaperedCapsule, i: usize| {
            let s = i as f64 / 399.0;
            (c.a + (c.b - c.a) * s, c.radius_a + s * (c.radius_b - c.radius_a))
        };
        let pair = |i: usize| {
            let ((p, r), (q, s)) = (ball(a, i / 400), ball(b, i % 400));
            (p - q).norm() - r - s
        };
        (0..160_000).map(pair).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn capsules_are_as_far_apart_as_parry_says(a in solid(), b in solid()) {
            let (a, b) = (plain(a), plain(b));
            let ours = tapered_capsule_distance(&a, &b);
            prop_assert!((ours - parry(&a, &b)).abs() < 1e-4, "{ours} {}", parry(&a, &b));
            prop_assert!((ours - tapered_capsule_distance(&b, &a)).abs() < 1e-12);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn no_sampled_pair_of_balls_is_nearer(a in solid(), b in solid()) {
            let (ours, sampled) = (tapered_capsule_distance(&a, &b), by_sampling(&a, &b));
            prop_assert!(ours <= sampled + 1e-9 && sampled < ours + 5e-3, "{ours} {sampled}");
        }
    }

    #[test]
    fn degenerate_capsules_are_balls() {
        let ball = |x: f64, r: f64| TaperedCapsule {
            a: Point3::new(x, 0.0, 0.0),
            b: Point3::new(x, 0.0, 0.0),
            radius_a: r,
            radius_b: r,
        };
        assert!((tapered_capsule_distance(&ball(0.0, 0.1), &ball(1.0, 0.2)) - 0.7).abs() < 1e-12);
        let swallowed = TaperedCapsule { b: Point3::new(1.05, 0.0, 0.0), radius_b: 0.1, ..ball(1.0, 0.2) };
        assert!((tapered_capsule_distance(&ball(0.0, 0.1), &swallowed) - 0.7).abs() < 1e-9);
    }
}
