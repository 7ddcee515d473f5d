//! Balls around solids: what a line does not come near, it cannot enter.

use nalgebra::{Point3, Vector3};

use super::solid::vertex_bounds;
use super::{Ray, Solid};
use crate::raster::TaperedCapsule;

/// A ball around geometry: its centre, and its radius, metres.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingBall {
    /// Centre.
    pub centre: Point3<f64>,
    /// Radius, slightly too large, so that rounding leaves nothing outside; negative around nothing.
    pub radius: f64,
}

impl BoundingBall {
    /// Around solids of one link, in the link's frame.
    pub fn around(solids: &[Solid]) -> Self {
        let balls: Vec<Self> = solids.iter().map(Solid::ball).collect();
        let sum: Vector3<f64> = balls.iter().map(|ball| ball.centre.coords).sum();
        let centre = Point3::from(sum / balls.len().max(1) as f64);
        let far = balls.iter().map(|ball| (ball.centre - centre).norm() + ball.radius);
        let radius = far.reduce(f64::max).map_or(-1.0, |radius| radius * (1.0 + 1e-9) + 1e-9);
        Self { centre, radius }
    }

    /// Whether the line from a ray's origin to the end of its direction meets the ball.
    pub fn is_met(&self, line: &Ray) -> bool {
        let to_centre = self.centre - line.origin;
        let nearest = to_centre.dot(&line.direction) / line.direction.norm_squared();
        let away = to_centre - line.direction * nearest.clamp(0.0, 1.0);
        self.radius >= 0.0 && away.norm_squared() <= self.radius * self.radius
    }
}

impl Solid {
    /// A ball around the solid; at the origin around a mesh without vertices.
    pub(crate) fn ball(&self) -> BoundingBall {
        let (centre, radius) = match self {
            Self::TaperedCapsule(TaperedCapsule { a, b, radius_a, radius_b }) => {
                (nalgebra::center(a, b), 0.5 * (b - a).norm() + radius_a.max(*radius_b))
            }
            Self::Box { link_from_box, half_extents } => {
                (link_from_box.translation.vector.into(), Vector3::from(*half_extents).norm())
            }
            Self::Cylinder { link_from_cylinder, radius, half_length } => {
                (link_from_cylinder.translation.vector.into(), libm::hypot(*radius, *half_length))
            }
            Self::Mesh { vertices, .. } => {
                let (low, high) = vertex_bounds(vertices);
                (nalgebra::center(&low, &high), 0.5 * (high - low).norm())
            }
        };
        BoundingBall { centre, radius }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = Point3<f64>> {
        prop::array::uniform3(-1.5..1.5).prop_map(Point3::from)
    }

    proptest! {
        #[test]
        fn a_line_that_enters_a_solid_meets_the_ball_around_it(
            places in prop::array::uniform4(point()),
            sizes in prop::array::uniform3(0.01..1.0),
            [from, to] in prop::array::uniform2(point()),
        ) {
            let [a, b, c, d] = places;
            let [radius_a, radius_b, half_length] = sizes;
            let frame = Isometry3::face_towards(&a, &b, &(c - d));
            let solids = [
                Solid::TaperedCapsule(TaperedCapsule { a, b, radius_a, radius_b }),
                Solid::Box { link_from_box: frame, half_extents: sizes },
                Solid::Cylinder { link_from_cylinder: frame, radius: radius_a, half_length },
                Solid::Mesh { vertices: places.to_vec(), triangles: vec![[0, 1, 2], [1, 2, 3]] },
            ];
            let line = Ray { origin: from, direction: to - from };
            let enters = |solid: &Solid| solid.ray_entry(&line).is_some_and(|s| s <= 1.0);
            for solid in &solids {
                let ball = BoundingBall::around(std::slice::from_ref(solid));
                prop_assert!(!enters(solid) || ball.is_met(&line), "{solid:?}");
            }
            prop_assert!(!solids.iter().any(enters) || BoundingBall::around(&solids).is_met(&line));
            prop_assert!(!BoundingBall::around(&[]).is_met(&line));
        }
    }
}
