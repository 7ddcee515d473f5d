//! Intersections of rays with solids: exact depth images, and occlusion of markers.

use nalgebra::{Isometry3, Point3, Vector3};

use super::Solid;
use crate::raster::TaperedCapsule;

/// A half line `origin + s * direction`, `s >= 0`. The direction need not have unit length: `s` is in its units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start point, metres.
    pub origin: Point3<f64>,
    /// Direction, not zero.
    pub direction: Vector3<f64>,
}

impl Ray {
    /// The same ray in another frame.
    pub fn transformed(&self, to_from_here: &Isometry3<f64>) -> Self {
        Self { origin: to_from_here * self.origin, direction: to_from_here * self.direction }
    }
}

impl Solid {
    /// The smallest `s >= 0` at which the ray is inside the solid (0 if it starts inside); `None` if it misses. Both
    /// are in the link's frame. A mesh is the two-sided surface of its triangles and has no inside.
    pub fn ray_entry(&self, ray: &Ray) -> Option<f64> {
        match self {
            Self::TaperedCapsule(capsule) => CapsuleForRays::new(capsule).entry(ray),
            Self::Box { link_from_box, half_extents } => {
                let ray = ray.transformed(&link_from_box.inverse());
                let slabs = (0..3).map(|i| slab(ray.origin[i], ray.direction[i], half_extents[i]));
                entry_of_all(slabs)
            }
            Self::Cylinder { link_from_cylinder, radius, half_length } => {
                let ray = ray.transformed(&link_from_cylinder.inverse());
                let (o, d) = (ray.origin.coords.xy(), ray.direction.xy());
                let wall = inside_quadric(d.norm_squared(), o.dot(&d), o.norm_squared() - radius * radius);
                entry_of_all([wall, slab(ray.origin.z, ray.direction.z, *half_length)])
            }
            Self::Mesh { vertices, triangles } => triangles
                .iter()
                .filter_map(|t| triangle_hit(&t.map(|i| vertices[i as usize]), ray))
                .fold(None, |nearest: Option<f64>, s| Some(nearest.map_or(s, |n| n.min(s)))),
        }
    }
}

/// The interval of `s` in which a ray is inside a convex part; `None` if it never is.
type Inside = Option<(f64, f64)>;

/// The first `s >= 0` in all intervals.
fn entry_of_all(parts: impl IntoIterator<Item = Inside>) -> Option<f64> {
    let mut inside = (0.0, f64::INFINITY);
    for part in parts {
        let (from, to) = part?;
        inside = (f64::max(inside.0, from), f64::min(inside.1, to));
    }
    (inside.0 <= inside.1).then_some(inside.0)
}

/// Where `|origin + s * direction| <= half`.
fn slab(origin: f64, direction: f64, half: f64) -> Inside {
    if direction == 0.0 {
        return (origin.abs() <= half).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let (a, b) = ((-half - origin) / direction, (half - origin) / direction);
    Some((a.min(b), a.max(b)))
}

/// Where `a s^2 + 2 b s + c <= 0`, for `a >= 0`.
fn inside_quadric(a: f64, b: f64, c: f64) -> Inside {
    if a == 0.0 {
        return (c <= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let [from, to] = roots(a, b, c)?;
    Some((from.min(to), from.max(to)))
}

/// The roots of `a s^2 + 2 b s + c`, `a != 0`, without cancellation.
fn roots(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    let discriminant = b * b - a * c;
    if discriminant.is_nan() || discriminant < 0.0 {
        return None;
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    if q == 0.0 { Some([0.0, 0.0]) } else { Some([q / a, c / q]) }
}

fn ball_entry(centre: &Point3<f64>, radius: f64, ray: &Ray) -> Option<f64> {
    let o = ray.origin - centre;
    entry_of_all([inside_quadric(
        ray.direction.norm_squared(),
        o.dot(&ray.direction),
        o.norm_squared() - radius * radius,
    )])
}

/// A tapered capsule prepared for many rays.
///
/// The solid is the union of its two spheres and of the part of the tangent cone between its circles of contact.
///
/// With `u` the unit axis from `a` to `b`, `L` its length, `k = (radius_b - radius_a) / L` and `c^2 = 1 - k^2`, a
/// point at height `y` along `u` and distance `rho` from it is on the tangent cone when `c rho = radius_a + k y`; the
/// sphere that touches the cone there has its centre at height `(y + k radius_a) / c^2`, which must be in `0..=L`.
#[derive(Clone, Copy, Debug)]
struct CapsuleForRays {
    capsule: TaperedCapsule,
    length: f64,
    axis: Vector3<f64>,
    k: f64,
    c2: f64,
    c: f64,
}

impl CapsuleForRays {
    fn new(capsule: &TaperedCapsule) -> Self {
        let TaperedCapsule { a, b, radius_a, radius_b } = *capsule;
        let length = (b - a).norm();
        let k = (radius_b - radius_a) / length;
        let c2 = 1.0 - k * k;
        Self { capsule: *capsule, length, axis: (b - a) / length, k, c2, c: c2.sqrt() }
    }

    /// As [`Solid::ray_entry`].
    #[inline]
    fn entry(&self, ray: &Ray) -> Option<f64> {
        let Self { capsule: TaperedCapsule { a, b, radius_a, radius_b }, length, axis, k, c2, .. } = *self;
        if length <= (radius_b - radius_a).abs() {
            let (centre, radius) = if radius_a >= radius_b { (a, radius_a) } else { (b, radius_b) };
            return ball_entry(&centre, radius, ray);
        }
        if self.contains(&ray.origin) {
            return Some(0.0);
        }
        let o = ray.origin - a;
        let (height, climb) = (o.dot(&axis), ray.direction.dot(&axis));
        let (across_o, across_d) = (o - axis * height, ray.direction - axis * climb);
        let radius = radius_a + k * height;
        let quadratic = c2 * across_d.norm_squared() - k * k * climb * climb;
        let half_linear = c2 * across_o.dot(&across_d) - k * climb * radius;
        let constant = c2 * across_o.norm_squared() - radius * radius;
        let on_cone = |s: &f64| *s >= 0.0 && (0.0..=length * c2).contains(&(height + s * climb + k * radius_a));
        let cone = if quadratic == 0.0 {
            Some([-constant / (2.0 * half_linear); 2])
        } else {
            roots(quadratic, half_linear, constant)
        };
        let cone = cone.into_iter().flatten().filter(on_cone);
        cone.chain(ball_entry(&a, radius_a, ray)).chain(ball_entry(&b, radius_b, ray)).reduce(f64::min)
    }

    /// Whether the point is in the convex hull of two spheres neither of which contains the other.
    #[inline]
    fn contains(&self, point: &Point3<f64>) -> bool {
        let TaperedCapsule { a, radius_a, .. } = self.capsule;
        let height = (point - a).dot(&self.axis);
        let rho = (point - a - self.axis * height).norm();
        let centre = (height + rho * self.k / self.c).clamp(0.0, self.length);
        (point - (a + self.axis * centre)).norm() <= radius_a + self.k * centre
    }
}

/// Intersection with both faces of a triangle (`[Möller 1997]`).
fn triangle_hit(triangle: &[Point3<f64>; 3], ray: &Ray) -> Option<f64> {
    let (e1, e2) = (triangle[1] - triangle[0], triangle[2] - triangle[0]);
    let p = ray.direction.cross(&e2);
    let determinant = e1.dot(&p);
    if determinant == 0.0 {
        return None;
    }
    let t = ray.origin - triangle[0];
    let u = t.dot(&p) / determinant;
    let q = t.cross(&e1);
    let v = ray.direction.dot(&q) / determinant;
    let s = e2.dot(&q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && s >= 0.0).then_some(s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::distance_by_search;
    use approx::assert_relative_eq;
    use nalgebra::{Translation3, UnitQuaternion};
    use rand::RngExt;

    fn cone() -> TaperedCapsule {
        TaperedCapsule { a: Point3::new(0.1, 0.0, -0.2), b: Point3::new(0.3, 0.2, 0.4), radius_a: 0.2, radius_b: 0.05 }
    }

    /// Marching by the signed distance: an independent method for the entry point.
    fn entry_by_marching(capsule: &TaperedCapsule, ray: &Ray) -> Option<f64> {
        let speed = ray.direction.norm();
        let mut s = 0.0;
        while s * speed < 10.0 {
            let distance = distance_by_search(capsule, &(ray.origin + ray.direction * s));
            if distance < 1e-9 {
                return Some(s);
            }
            s += distance / speed;
        }
        None
    }

    #[test]
    fn entries_into_tapered_capsules_agree_with_marching() {
        let mut rng = crate::rng::stream(1, crate::rng::Purpose::Corruption, 0, 0, 0);
        let mut uniform = || rng.random::<f64>() * 2.0 - 1.0;
        let shapes = [
            cone(),
            TaperedCapsule { radius_b: 0.2, ..cone() },
            TaperedCapsule { b: Point3::new(0.12, 0.0, -0.2), radius_b: 0.1, ..cone() },
        ];
        let mut hits = 0;
        for _ in 0..600 {
            let origin = Point3::new(uniform(), uniform(), uniform()) * 1.5;
            let target = Point3::new(uniform(), uniform(), uniform()) * 0.5;
            let ray = Ray { origin, direction: (target - origin) * (1.2 + uniform()) };
            for capsule in &shapes {
                let exact = Solid::TaperedCapsule(*capsule).ray_entry(&ray);
                match (exact, entry_by_marching(capsule, &ray)) {
                    (Some(a), Some(b)) => {
                        // grazing rays amplify the marching's tolerance
                        assert!((a - b).abs() * ray.direction.norm() < 1e-3, "{a} {b}");
                        hits += usize::from(a > 0.0);
                    }
                    (None, None) => {}
                    (a, b) => panic!("exact {a:?}, marching {b:?}"),
                }
            }
        }
        assert!(hits > 300, "{hits}");
        let inside = Ray { origin: Point3::new(0.15, 0.05, -0.1), direction: Vector3::x() };
        assert_eq!(Solid::TaperedCapsule(cone()).ray_entry(&inside), Some(0.0));
    }

    #[test]
    fn entries_into_boxes_cylinders_and_meshes_match_values_computed_by_hand() {
        let frame = Isometry3::from_parts(Translation3::new(1.0, 0.0, 0.0), UnitQuaternion::identity());
        let along_x = Ray { origin: Point3::new(-1.0, 0.05, 0.0), direction: Vector3::new(2.0, 0.0, 0.0) };
        let cuboid = Solid::Box { link_from_box: frame, half_extents: [0.5, 0.1, 0.1] };
        assert_relative_eq!(cuboid.ray_entry(&along_x).unwrap(), 0.75);
        let cylinder = Solid::Cylinder { link_from_cylinder: frame, radius: 0.13, half_length: 0.5 };
        assert_relative_eq!(cylinder.ray_entry(&along_x).unwrap(), (2.0 - 0.12) / 2.0, epsilon = 1e-12);
        let vertices = [[0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0]].map(Point3::from).to_vec();
        let mesh = Solid::Mesh { vertices, triangles: vec![[0, 1, 2], [2, 1, 0]] };
        assert_relative_eq!(mesh.ray_entry(&along_x).unwrap(), 0.5);
        let away = Ray { direction: -along_x.direction, ..along_x };
        for solid in [cuboid, cylinder, mesh] {
            assert_eq!(solid.ray_entry(&away), None);
        }
    }
}
