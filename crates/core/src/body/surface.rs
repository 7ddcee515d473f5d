//! Normals of solids.

use nalgebra::{Point3, Unit, Vector3};

use super::Solid;
use crate::raster::TaperedCapsule;

impl Solid {
    /// The outward normal at a point on the surface, both in the link's frame. `facet` is the triangle of a mesh that
    /// contains the point; its normal is that of its corners in anticlockwise order as seen from outside. Other solids
    /// ignore it. A point off the surface gets approximately the normal of the nearest part of it.
    pub fn normal_at(&self, point: &Point3<f64>, facet: usize) -> Unit<Vector3<f64>> {
        let normal = match self {
            Self::TaperedCapsule(capsule) => point - ball_of(capsule, point),
            Self::Box { link_from_box, half_extents } => {
                let p = link_from_box.inverse_transform_point(point);
                let off = |i: usize| p[i].abs() - half_extents[i];
                let side = (0..3).fold(0, |best, i| if off(i) > off(best) { i } else { best });
                let mut normal = Vector3::zeros();
                normal[side] = p[side].signum();
                link_from_box * normal
            }
            Self::Cylinder { link_from_cylinder, radius, half_length } => {
                let p = link_from_cylinder.inverse_transform_point(point);
                let round = p.coords.xy().norm();
                let normal = if round - radius > p.z.abs() - half_length {
                    Vector3::new(p.x, p.y, 0.0)
                } else {
                    Vector3::new(0.0, 0.0, p.z.signum())
                };
                link_from_cylinder * normal
            }
            Self::Mesh { vertices, triangles } => match triangles.get(facet) {
                Some(corners) => {
                    let [a, b, c] = corners.map(|i| vertices[i as usize]);
                    (b - a).cross(&(c - a))
                }
                None => Vector3::z(),
            },
        };
        Unit::try_new(normal, 1e-300).unwrap_or_else(Vector3::z_axis)
    }
}

/// The centre of the ball, of those whose hull the solid is, that touches the surface at a point: see
/// [`Solid::ray_entry`] for the geometry of the cone.
fn ball_of(capsule: &TaperedCapsule, point: &Point3<f64>) -> Point3<f64> {
    let TaperedCapsule { a, b, radius_a, radius_b } = *capsule;
    let length = (b - a).norm();
    if length <= (radius_b - radius_a).abs() {
        return if radius_a >= radius_b { a } else { b };
    }
    let axis = (b - a) / length;
    let k = (radius_b - radius_a) / length;
    let height = (point - a).dot(&axis);
    let centre = (height + k * radius_a) / (1.0 - k * k);
    a + axis * centre.clamp(0.0, length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Ray;
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};

    /// The normal from neighbouring rays.
    fn by_rays(solid: &Solid, ray: &Ray) -> Option<Vector3<f64>> {
        let side = Unit::new_normalize(ray.direction.cross(&Vector3::new(0.31, 0.17, 0.9)));
        let other = Unit::new_normalize(ray.direction.cross(&side));
        let hit = |shift: Vector3<f64>| {
            let ray = Ray { origin: ray.origin + shift, direction: ray.direction };
            solid.ray_entry(&ray).map(|s| ray.origin + ray.direction * s)
        };
        let (h, [p, q]) = (1e-6, [side.into_inner(), other.into_inner()]);
        let across = |d: Vector3<f64>| Some(hit(d * h)? - hit(d * -h)?);
        let normal = across(p)?.cross(&across(q)?).normalize();
        Some(if normal.dot(&ray.direction) > 0.0 { -normal } else { normal })
    }

    #[test]
    fn normals_agree_with_neighbouring_rays_on_every_solid() {
        let frame = Isometry3::from_parts(
            Translation3::new(0.1, -0.2, 0.05),
            UnitQuaternion::from_euler_angles(0.4, -0.7, 1.1),
        );
        let mesh = Solid::Mesh {
            vertices: [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]
                .map(Point3::from)
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
        };
        let solids = [
            Solid::TaperedCapsule(TaperedCapsule {
                a: Point3::new(-0.5, 0.1, 0.0),
                b: Point3::new(0.6, 0.0, 0.3),
                radius_a: 0.4,
                radius_b: 0.15,
            }),
            Solid::Box { link_from_box: frame, half_extents: [0.4, 0.6, 0.3] },
            Solid::Cylinder { link_from_cylinder: frame, radius: 0.4, half_length: 0.5 },
            mesh,
        ];
        for solid in &solids {
            let (mut checked, mut differing) = (0, 0);
            for i in 0..400 {
                let turn = f64::from(i) * 2.399_963;
                let height = 1.0 - 2.0 * (f64::from(i) + 0.5) / 400.0;
                let round = (1.0 - height * height).sqrt();
                let from = Point3::new(round * turn.cos(), round * turn.sin(), height) * 4.0;
                let aim = Point3::new(0.1 * (f64::from(i) * 0.7).sin(), 0.05 + 0.05 * (f64::from(i) * 1.3).cos(), 0.1);
                let ray = Ray { origin: from, direction: aim - from };
                let (Some(s), Some(expected)) = (solid.ray_entry(&ray), by_rays(solid, &ray)) else { continue };
                let point = ray.origin + ray.direction * s;
                let facets = if matches!(solid, Solid::Mesh { .. }) { 4 } else { 1 };
                let found = (0..facets).map(|facet| solid.normal_at(&point, facet));
                checked += 1;
                differing += usize::from(found.map(|n| n.dot(&expected)).fold(-1.0, f64::max) < 1.0 - 1e-6);
            }
            assert!(checked > 300, "{checked}");
            assert!(differing <= 2, "{differing} of {checked} on {solid:?}; an edge may explain few");
        }
    }
}
