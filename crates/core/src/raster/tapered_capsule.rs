//! The main solid of bodies.

use nalgebra::{Isometry3, Point3, Vector3};

/// Convex hull of two balls: a capsule if the radii are equal, a ball if the centres are (or one contains the other).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaperedCapsule {
    /// Centre of the first ball, metres.
    pub a: Point3<f64>,
    /// Centre of the second ball, metres.
    pub b: Point3<f64>,
    /// Radius of the first ball, metres, >= 0.
    pub radius_a: f64,
    /// Radius of the second ball, metres, >= 0.
    pub radius_b: f64,
}

impl TaperedCapsule {
    /// The same solid in another frame.
    #[inline]
    pub fn transformed(&self, to_from_here: &Isometry3<f64>) -> Self {
        Self { a: to_from_here * self.a, b: to_from_here * self.b, ..*self }
    }

    /// Where the line `t * direction` through the origin leaves the solid: the greatest such `t`, negative if the
    /// solid is behind; `None` if the line misses it.
    ///
    /// The solid is the union over `s` in `[0, 1]` of the balls around `a + s (b - a)` with radius `radius_a + s
    /// (radius_b - radius_a)`. A point belongs to one of them iff a quadratic in `s` is not positive somewhere on `[0,
    /// 1]`: at an end (an end ball) or at its minimum (the cone that touches both balls). Every root found belongs to
    /// the solid, and the exit is among them.
    pub fn exit_along(&self, direction: &Vector3<f64>) -> Option<f64> {
        let ends = [(self.a, self.radius_a), (self.b, self.radius_b)].into_iter().filter_map(|(centre, radius)| {
            let roots = roots(
                direction.norm_squared(),
                direction.dot(&centre.coords),
                centre.coords.norm_squared() - radius * radius,
            )?;
            Some(roots[1])
        });
        ends.chain(self.cone_roots(direction).into_iter().flatten()).reduce(f64::max)
    }

    /// Where the line crosses the cone's side between the two balls' circles of contact.
    fn cone_roots(&self, direction: &Vector3<f64>) -> [Option<f64>; 2] {
        let axis = self.b - self.a;
        let taper = self.radius_b - self.radius_a;
        let gap = axis.norm_squared() - taper * taper;
        if gap <= 0.0 {
            return [None; 2];
        }
        // Minimum of the quadratic in s: s(t) = slope * t + start.
        let slope = direction.dot(&axis) / gap;
        let start = (self.radius_a * taper - self.a.coords.dot(&axis)) / gap;
        let roots = roots(
            direction.norm_squared() - gap * slope * slope,
            direction.dot(&self.a.coords) + gap * slope * start,
            self.a.coords.norm_squared() - self.radius_a * self.radius_a - gap * start * start,
        );
        let Some(roots) = roots else { return [None; 2] };
        roots.map(|t| (0.0..=1.0).contains(&(slope * t + start)).then_some(t))
    }
}

/// Roots of `a t^2 - 2 b t + c`, the lower first if `a > 0`; `None` if they are not real.
fn roots(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    Some([(b - root) / a, (b + root) / a])
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Signed distance by a search over the balls of which the solid is the union, an independent method: convex in
    /// the ball's position.
    pub(crate) fn distance_by_search(solid: &TaperedCapsule, point: &Point3<f64>) -> f64 {
        let ball = |s: f64| {
            let centre = solid.a + s * (solid.b - solid.a);
            (point - centre).norm() - (solid.radius_a + s * (solid.radius_b - solid.radius_a))
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..100 {
            let third = (high - low) / 3.0;
            if ball(low + third) < ball(high - third) { high -= third } else { low += third }
        }
        ball(0.5 * (low + high))
    }

    proptest! {
        #[test]
        fn the_exit_is_on_the_surface_and_nothing_is_beyond_it(
            [ax, ay, bx, by] in prop::array::uniform4(-1.0..1.0_f64), [az, bz] in prop::array::uniform2(1.0..3.0_f64),
            [radius_a, radius_b] in prop::array::uniform2(0.05..0.6_f64),
            [dx, dy] in prop::array::uniform2(-0.7..0.7_f64),
        ) {
            let solid = TaperedCapsule { a: Point3::new(ax, ay, az), b: Point3::new(bx, by, bz), radius_a, radius_b };
            let direction = Vector3::new(dx, dy, 1.0);
            let at = |t: f64| distance_by_search(&solid, &Point3::from(direction * t));
            match solid.exit_along(&direction) {
                Some(t) => {
                    prop_assert!(at(t).abs() < 1e-5, "surface missed by {}", at(t));
                    prop_assert!((1..40).all(|i| at(t + 0.1 * f64::from(i)) > 0.0));
                }
                None => prop_assert!((-40..80).all(|i| at(0.1 * f64::from(i)) > -1e-9)),
            }
        }
    }

    #[test]
    fn a_ball_inside_a_ball_is_the_larger_ball() {
        let solid = TaperedCapsule {
            a: Point3::new(0.0, 0.0, 5.0),
            b: Point3::new(0.0, 0.1, 5.0),
            radius_a: 1.0,
            radius_b: 0.2,
        };
        assert_eq!(solid.exit_along(&Vector3::z()), Some(6.0));
        assert_eq!(solid.exit_along(&-Vector3::z()), Some(-4.0));
        assert_eq!(solid.exit_along(&Vector3::x()), None);
    }
}
