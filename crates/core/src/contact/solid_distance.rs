//! Distance of two solids: in closed form if there is one, else by parry.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use parry3d::math::{Pose, Rotation, Vector};
use parry3d::query::details::contact_support_map_support_map;
use parry3d::shape::SupportMap;

use super::capsule_distance::{nearest_ball, tapered_capsule_distance};
use crate::body::Solid;

/// Solids further apart than this are not measured, metres.
const FAR: f32 = 10.0;
/// Search range of nearest points, metres.
const FARTHEST: f32 = 1000.0;

/// Signed distance of two solids, metres, negative where they overlap; `first_from_second` maps the frame of the
/// second's link to that of the first's. In closed form if both are tapered capsules; by the sphere of the tapered
/// capsule nearest to the other solid (parry) if one is; by parry (GJK and EPA, single precision) if neither is.
/// Meshes are treated as their convex hulls. Infinite if parry finds no answer: solids more than 10 m apart, or a mesh
/// without vertices.
pub fn solid_distance(first: &Solid, second: &Solid, first_from_second: &Isometry3<f64>) -> f64 {
    let is_empty = |solid: &Solid| matches!(solid, Solid::Mesh { vertices, .. } if vertices.is_empty());
    if is_empty(first) || is_empty(second) {
        return f64::INFINITY;
    }
    match (first, second) {
        (Solid::TaperedCapsule(a), Solid::TaperedCapsule(b)) => {
            tapered_capsule_distance(a, &b.transformed(first_from_second))
        }
        (Solid::TaperedCapsule(capsule), solid) => {
            nearest_ball(&capsule.transformed(&first_from_second.inverse()), |centre| from_point(solid, &centre))
        }
        (solid, Solid::TaperedCapsule(capsule)) => {
            nearest_ball(&capsule.transformed(first_from_second), |centre| from_point(solid, &centre))
        }
        _ => by_parry(&Hull(first), &Hull(second), &to_pose(first_from_second)),
    }
}

/// The point of `second` nearest to `first` or deepest in it, and the outward normal of `first` there, both in the
/// frame of `first`'s link; by parry, in single precision. `None` where [`solid_distance`] may be infinite.
pub(super) fn nearest_point(
    first: &Solid,
    second: &Solid,
    first_from_second: &Isometry3<f64>,
) -> Option<(Point3<f64>, Vector3<f64>)> {
    let pose = to_pose(first_from_second);
    let contact = contact_support_map_support_map(&pose, &Hull(first), &Hull(second), FARTHEST)?;
    let [x, y, z] = contact.point2.to_array().map(f64::from);
    let normal = Vector3::from(contact.normal1.to_array().map(f64::from));
    Some((first_from_second * Point3::new(x, y, z), normal))
}

fn from_point(solid: &Solid, point: &Point3<f64>) -> f64 {
    by_parry(&Hull(solid), &OriginPoint, &Pose::from_translation(to_vector(point)))
}

fn by_parry(first: &impl SupportMap, second: &impl SupportMap, first_from_second: &Pose) -> f64 {
    let contact = contact_support_map_support_map(first_from_second, first, second, FAR);
    contact.map_or(f64::INFINITY, |contact| f64::from(contact.dist))
}

/// The origin as a shape for parry.
struct OriginPoint;

impl SupportMap for OriginPoint {
    fn local_support_point(&self, _: Vector) -> Vector {
        Vector::ZERO
    }
}

/// A solid as a support map for parry.
struct Hull<'a>(&'a Solid);

impl SupportMap for Hull<'_> {
    fn local_support_point(&self, direction: Vector) -> Vector {
        let unit = nalgebra::Vector3::new(f64::from(direction.x), f64::from(direction.y), f64::from(direction.z));
        let unit = unit.try_normalize(1e-12).unwrap_or(nalgebra::Vector3::x());
        // the farthest point is the lowest point of a world whose down direction is this one
        let upside_down = || UnitQuaternion::from_axis_angle(&nalgebra::Vector3::x_axis(), std::f64::consts::PI);
        let down = UnitQuaternion::rotation_between(&unit, &-nalgebra::Vector3::z()).unwrap_or_else(upside_down);
        let turned = Isometry3::from_parts(nalgebra::Translation3::identity(), down);
        to_vector(
            &self.0.lowest_point(&turned).map_or(Point3::origin(), |point| turned.inverse_transform_point(&point)),
        )
    }
}

fn to_vector(point: &Point3<f64>) -> Vector {
    Vector::new(point.x as f32, point.y as f32, point.z as f32)
}

fn to_pose(isometry: &Isometry3<f64>) -> Pose {
    let q = isometry.rotation;
    Pose::from_parts(
        to_vector(&Point3::from(isometry.translation.vector)),
        Rotation::from_xyzw(q.i as f32, q.j as f32, q.k as f32, q.w as f32),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::TaperedCapsule;

    fn ball(radius: f64) -> Solid {
        let centre = Point3::origin();
        Solid::TaperedCapsule(TaperedCapsule { a: centre, b: centre, radius_a: radius, radius_b: radius })
    }

    fn cube() -> Solid {
        Solid::Box { link_from_box: Isometry3::identity(), half_extents: [0.1; 3] }
    }

    #[test]
    fn distances_of_boxes_cylinders_and_balls_match_values_computed_by_hand() {
        let along_x = |x: f64| Isometry3::translation(x, 0.0, 0.0);
        let turned = Isometry3::new(Vector3::new(0.3, 0.0, 0.0), Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_4));
        let cylinder = Solid::Cylinder { link_from_cylinder: Isometry3::identity(), radius: 0.1, half_length: 0.2 };
        for (a, b, pose, expected) in [
            (cube(), cube(), along_x(0.25), 0.05),
            (cube(), cube(), along_x(0.19), -0.01),
            (cube(), cube(), turned, 0.3 - 0.1 - 0.1 * 2.0_f64.sqrt()),
            (cube(), ball(0.05), along_x(0.2), 0.05),
            (cube(), cylinder.clone(), along_x(0.25), 0.05),
            (cylinder.clone(), ball(0.05), Isometry3::translation(0.0, 0.0, 0.3), 0.05),
        ] {
            let found = solid_distance(&a, &b, &pose);
            assert!((found - expected).abs() < 1e-4, "{a:?} {b:?}: {found}, expected {expected}");
        }
    }

    #[test]
    fn a_mesh_without_vertices_touches_nothing() {
        let empty = Solid::Mesh { vertices: Vec::new(), triangles: Vec::new() };
        assert_eq!(solid_distance(&empty, &cube(), &Isometry3::identity()), f64::INFINITY);
    }
}
