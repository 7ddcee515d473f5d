//! Distance of two tapered capsules, in closed form.

use nalgebra::{Point3, Vector3};
use wide::f64x2;

use crate::raster::TaperedCapsule;

/// Steps of the golden section search: its bracket shrinks to 1e-9 of a segment.
const SEARCH_STEPS: usize = 44;

/// Signed distance of two tapered capsules, metres. Where they overlap it is negative: minus the smallest total by
/// which their radii must shrink to separate them (the penetration depth, unless the segments cross).
///
/// A tapered capsule is a family of spheres along a segment. Spheres `s` and `t` of two families have the distance
/// `|a(s) - b(t)| - r_a(s) - r_b(t)`, a convex function of `(s, t)`: a norm of a linear function plus a linear
/// function. Its minimum is where its derivatives vanish, which has a closed form (`between_sides`), or else at one of
/// the four end spheres, whose nearest sphere of the other family has a closed form (`least_end_distance`).
pub(super) fn tapered_capsule_distance(first: &TaperedCapsule, second: &TaperedCapsule) -> f64 {
    CapsuleAxis::from_capsule(first).distance(&CapsuleAxis::from_capsule(second))
}

/// Pose-independent quantities of a tapered capsule's axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AxisLength {
    /// Squared length, square metres.
    squared: f64,
    /// Reciprocal; 0 for a degenerate axis.
    inverse: f64,
}

impl AxisLength {
    pub(super) fn from_capsule(solid: &TaperedCapsule) -> Self {
        let squared = (solid.b - solid.a).norm_squared();
        Self { squared, inverse: if squared > 0.0 { 1.0 / squared } else { 0.0 } }
    }
}

/// Squared distance of the axes of two tapered capsules (`[Ericson 2005]`, 5.1.9), square metres.
#[inline(always)]
pub(super) fn squared_distance_of_axes([first, second]: [&TaperedCapsule; 2], [uu, vv]: [&AxisLength; 2]) -> f64 {
    let (u, v, w) = (first.b - first.a, second.b - second.a, first.a - second.a);
    let (uv, uw, vw) = (u.dot(&v), u.dot(&w), v.dot(&w));
    let (part, whole) = (uv * vw - uw * vv.squared, uu.squared * vv.squared - uv * uv);
    // branches, so that a closest point beyond an end does not wait for the division
    let s = if part <= 0.0 || whole <= 0.0 {
        0.0
    } else if part >= whole {
        1.0
    } else {
        part / whole
    };
    let t = ((vw + uv * s) * vv.inverse).clamp(0.0, 1.0);
    let s = ((uv * t - uw) * uu.inverse).clamp(0.0, 1.0);
    (w + u * s - v * t).norm_squared()
}

/// A tapered capsule prepared for distances: the first sphere, the direction and distance to the last, and the taper.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CapsuleAxis {
    /// Centre of the first sphere, metres.
    pub(super) start: Vector3<f64>,
    /// Unit vector to the centre of the last sphere; arbitrary if the centres coincide.
    pub(super) along: Vector3<f64>,
    /// Distance of the centres, metres.
    pub(super) length: f64,
    /// Reciprocal; 0 for a degenerate axis.
    per_length: f64,
    /// Radius of the first sphere, metres.
    pub(super) radius: f64,
    /// Change of the radius per metre, the sine of the angle between the axis and its side; 0 where the length is zero.
    pub(super) taper: f64,
    /// Tangent of that angle.
    lean: f64,
}

impl CapsuleAxis {
    /// Prepares a solid. If one end contains the other, the solid is a single sphere.
    pub(super) fn from_capsule(solid: &TaperedCapsule) -> Self {
        let (axis, growth) = (solid.b - solid.a, solid.radius_b - solid.radius_a);
        let length = axis.norm();
        if length <= growth.abs() {
            let (centre, radius) = if growth > 0.0 { (solid.b, solid.radius_b) } else { (solid.a, solid.radius_a) };
            return Self {
                start: centre.coords,
                along: Vector3::x(),
                length: 0.0,
                per_length: 0.0,
                radius,
                taper: 0.0,
                lean: 0.0,
            };
        }
        let taper = growth / length;
        let lean = taper / libm::sqrt(1.0 - taper * taper);
        Self {
            start: solid.a.coords,
            along: axis / length,
            length,
            per_length: 1.0 / length,
            radius: solid.radius_a,
            taper,
            lean,
        }
    }

    /// The same solid at another position; pose-independent quantities are reused.
    #[inline(always)]
    pub(super) fn moved_to(&self, solid: &TaperedCapsule) -> Self {
        if self.length == 0.0 {
            return Self::from_capsule(solid);
        }
        Self { start: solid.a.coords, along: (solid.b - solid.a) * self.per_length, ..*self }
    }

    #[inline(always)]
    fn end(&self) -> Vector3<f64> {
        self.start + self.along * self.length
    }

    /// Signed distance to another capsule.
    #[inline(always)]
    pub(super) fn distance(&self, other: &Self) -> f64 {
        self.between_sides(other).unwrap_or_else(|| self.least_end_distance(other).min(other.least_end_distance(self)))
    }

    /// The distance if both nearest spheres are between the ends, else `None`.
    ///
    /// Then the unit vector `n` from the other's sphere to this one's satisfies `n . u = k` and `n . v = -l`, with
    /// `u`, `v` the axes and `k`, `l` the tapers. This determines `n` up to the sign of its component across the axes,
    /// which is that of the line between the axes. The vector between the spheres is `d n`; its components across and
    /// along the axes give `d` and the positions of the spheres.
    #[inline(always)]
    fn between_sides(&self, other: &Self) -> Option<f64> {
        let (u, v, w) = (&self.along, &other.along, self.start - other.start);
        let (k, l, c) = (self.taper, other.taper, u.dot(v));
        let sine_squared = 1.0 - c * c;
        if sine_squared < 1e-12 {
            return None; // parallel: an end is as near as any other sphere
        }
        let flat = (k * k + l * l + 2.0 * k * l * c) / sine_squared;
        if flat >= 1.0 {
            return None;
        }
        let across = w.dot(&u.cross(v)).abs();
        let d = across / ((1.0 - flat) * sine_squared).sqrt();
        let (p, q) = (d * k - w.dot(u), -d * l - w.dot(v));
        let s = (p - c * q) / sine_squared;
        let t = c * s - q;
        let inside = s >= 0.0 && s <= self.length && t >= 0.0 && t <= other.length;
        inside.then_some(d - self.radius - s * k - other.radius - t * l)
    }

    /// Signed distance of the nearer end sphere of the other: along this axis the nearest sphere is at the foot of the
    /// perpendicular, shifted by `k y / sqrt(1 - k^2)`, with `y` the distance from the axis. Both ends are computed at
    /// once.
    fn least_end_distance(&self, other: &Self) -> f64 {
        let (first, last) = (other.start - self.start, other.end() - self.start);
        let [x, y, z] = [0, 1, 2].map(|axis| f64x2::new([first[axis], last[axis]]));
        let [u, v, w] = [0, 1, 2].map(|axis| f64x2::splat(self.along[axis]));
        let along = x * u + y * v + z * w;
        let across_squared = (x * x + y * y + z * z - along * along).fast_max(f64x2::ZERO);
        let s = along + f64x2::splat(self.lean) * across_squared.sqrt();
        let s = s.fast_max(f64x2::ZERO).fast_min(f64x2::splat(self.length));
        let off = along - s;
        let radii = f64x2::new([other.radius, other.radius + other.taper * other.length]);
        let apart = (across_squared + off * off).sqrt() - self.radius - s * f64x2::splat(self.taper) - radii;
        let [first, last] = apart.to_array();
        first.min(last)
    }
}

/// The minimum of `distance(centre) - radius` over the spheres of a tapered capsule, for a convex `distance`.
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

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::ops::Range;

    /// Capsules with coordinates up to `reach`.
    pub(in crate::contact) fn capsules(reach: f64, radii: Range<f64>) -> impl Strategy<Value = TaperedCapsule> {
        let ends = prop::array::uniform2(prop::array::uniform3(-reach..reach));
        (ends, prop::array::uniform2(radii)).prop_map(|(ends, [radius_a, radius_b])| {
            let [a, b] = ends.map(Point3::from);
            TaperedCapsule { a, b, radius_a, radius_b }
        })
    }

    fn solid() -> impl Strategy<Value = TaperedCapsule> {
        capsules(0.5, 0.02..0.2)
    }

    fn plain(solid: TaperedCapsule) -> TaperedCapsule {
        TaperedCapsule { radius_b: solid.radius_a, ..solid }
    }

    /// Parry's distance of the axes minus the radii: its GJK on round solids is only accurate to a few tenths of a
    /// millimetre. The distance of axes is computed in single precision; for nearly parallel axes it is too large by
    /// up to half a millimetre, because another pair of points is chosen.
    fn parry(a: &TaperedCapsule, b: &TaperedCapsule) -> f64 {
        use parry3d::math::{Pose, Vector};
        let axis = |c: &TaperedCapsule| {
            let point = |p: &Point3<f64>| Vector::new(p.x as f32, p.y as f32, p.z as f32);
            parry3d::shape::Segment::new(point(&c.a), point(&c.b))
        };
        let apart = parry3d::query::distance(&Pose::IDENTITY, &axis(a), &Pose::IDENTITY, &axis(b)).unwrap();
        f64::from(apart.distance) - a.radius_a - b.radius_a
    }

    /// A golden section search over the minimum of a nested golden section search.
    fn by_search(a: &TaperedCapsule, b: &TaperedCapsule) -> f64 {
        nearest_ball(a, |centre| nearest_ball(b, |other| (centre - other).norm()))
    }

    /// The nearest pair of 400 x 400 sampled spheres.
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
        fn capsule_distances_agree_with_parry(a in solid(), b in solid()) {
            let (a, b) = (plain(a), plain(b));
            let ours = tapered_capsule_distance(&a, &b);
            let all_but_parallel = (a.b - a.a).normalize().cross(&(b.b - b.a).normalize()).norm() < 0.05;
            let above = if all_but_parallel { 1e-3 } else { 1e-4 };
            prop_assert!((-above..1e-4).contains(&(ours - parry(&a, &b))), "{ours} {}", parry(&a, &b));
            prop_assert!((ours - tapered_capsule_distance(&b, &a)).abs() < 1e-12);
        }

        #[test]
        fn tapered_capsule_distances_agree_with_a_search(a in solid(), b in solid()) {
            let (ours, found) = (tapered_capsule_distance(&a, &b), by_search(&a, &b));
            prop_assert!((ours - found).abs() < 1e-8, "{ours} {found}");
            prop_assert!((ours - tapered_capsule_distance(&b, &a)).abs() < 1e-12);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn no_sampled_pair_of_spheres_is_nearer(a in solid(), b in solid()) {
            let (ours, sampled) = (tapered_capsule_distance(&a, &b), by_sampling(&a, &b));
            prop_assert!(ours <= sampled + 1e-9 && sampled < ours + 5e-3, "{ours} {sampled}");
        }
    }

    #[test]
    fn degenerate_capsules_are_spheres() {
        let ball = |x: f64, r: f64| {
            let centre = Point3::new(x, 0.0, 0.0);
            TaperedCapsule { a: centre, b: centre, radius_a: r, radius_b: r }
        };
        assert!((tapered_capsule_distance(&ball(0.0, 0.1), &ball(1.0, 0.2)) - 0.7).abs() < 1e-12);
        let swallowed = TaperedCapsule { b: Point3::new(1.05, 0.0, 0.0), radius_b: 0.1, ..ball(1.0, 0.2) };
        assert!((tapered_capsule_distance(&ball(0.0, 0.1), &swallowed) - 0.7).abs() < 1e-9);
    }
}
