//! Which pixels' rays meet a solid beyond the near plane.

use nalgebra::{Isometry3, Point3, Vector3};

use super::pixel_rays::{PixelRays, Reach, View};
use crate::body::{Flesh, Ray};
use crate::raster::{Mask, TaperedCapsule};

/// Sets every pixel that sees `flesh` at or beyond z = `near`.
pub(super) fn paint(flesh: &Flesh, camera_from_link: &Isometry3<f64>, rays: &PixelRays, near: f64, mask: &mut Mask) {
    match flesh {
        Flesh::TaperedCapsule(capsule) => {
            let capsule = capsule.transformed(camera_from_link);
            // The solid is convex: the ray meets its part beyond the near plane iff it leaves it there.
            let seen = |ray: &Vector3<f64>| capsule.exit_along(ray).is_some_and(|depth| depth >= near);
            paint_where(&reach_of_capsule(&capsule), rays, near, mask, seen);
        }
        Flesh::Box { link_from_box, half_extents } => {
            let frame = camera_from_link * link_from_box;
            let half = Vector3::from(*half_extents);
            let around = frame.rotation.to_rotation_matrix().into_inner().abs() * half;
            paint_convex(flesh, camera_from_link, &reach_about(&frame, &around), rays, near, mask);
        }
        Flesh::Cylinder { link_from_cylinder, radius, half_length } => {
            let frame = camera_from_link * link_from_cylinder;
            let axis = frame.rotation * Vector3::z();
            let around = axis.map(|c| c.abs() * half_length + radius * (1.0 - c * c).max(0.0).sqrt());
            paint_convex(flesh, camera_from_link, &reach_about(&frame, &around), rays, near, mask);
        }
        Flesh::Mesh { vertices, triangles } => {
            let vertices: Vec<Point3<f64>> = vertices.iter().map(|v| camera_from_link * v).collect();
            paint_mesh(&vertices, triangles, rays, near, mask);
        }
    }
}

fn reach_about(frame: &Isometry3<f64>, around: &Vector3<f64>) -> Reach {
    let centre = Point3::from(frame.translation.vector);
    Reach { low: centre - around, high: centre + around }
}

fn reach_of_capsule(capsule: &TaperedCapsule) -> Reach {
    let ends = [(capsule.a, capsule.radius_a), (capsule.b, capsule.radius_b)];
    Reach::around(
        ends.iter().flat_map(|(centre, radius)| [centre - Vector3::repeat(*radius), centre + Vector3::repeat(*radius)]),
    )
}

fn paint_where(reach: &Reach, rays: &PixelRays, near: f64, mask: &mut Mask, seen: impl Fn(&Vector3<f64>) -> bool) {
    let Some(view) = reach.view(near) else { return };
    rays.tiles(&view).each_pixel(&view, |x, y, ray| {
        if seen(ray) {
            mask.set(x, y, true);
        }
    });
}

/// A ray that starts on the near plane enters a convex solid iff the solid reaches beyond the plane along it.
fn paint_convex(
    flesh: &Flesh,
    camera_from_link: &Isometry3<f64>,
    reach: &Reach,
    rays: &PixelRays,
    near: f64,
    mask: &mut Mask,
) {
    let link_from_camera = camera_from_link.inverse();
    paint_where(reach, rays, near, mask, |direction| {
        let ray = Ray { origin: Point3::from(direction * near), direction: *direction };
        flesh.ray_entry(&ray.transformed(&link_from_camera)).is_some()
    });
}

/// Paints the surface of a mesh; of a closed mesh that the near plane cuts, the far side is seen.
fn paint_mesh(vertices: &[Point3<f64>], triangles: &[[u32; 3]], rays: &PixelRays, near: f64, mask: &mut Mask) {
    let Some(whole) = Reach::around(vertices.iter().copied()).view(near) else { return };
    let tiles = rays.tiles(&whole);
    for triangle in triangles {
        let corners = triangle.map(|i| vertices[i as usize]);
        let view: Option<View> = Reach::around(corners).view(near);
        let Some(view) = view else { continue };
        let facing = Facing::new(&corners);
        tiles.each_pixel(&view, |x, y, ray| {
            if facing.depth_along(ray).is_some_and(|depth| depth >= near) {
                mask.set(x, y, true);
            }
        });
    }
}

/// A triangle as seen from the camera's centre: the planes through the centre and its edges, and its own plane.
struct Facing {
    edges: [Vector3<f64>; 3],
    normal: Vector3<f64>,
    offset: f64,
}

impl Facing {
    fn new([a, b, c]: &[Point3<f64>; 3]) -> Self {
        let normal = (b - a).cross(&(c - a));
        // The same edge of two triangles gives the same plane but for its sign, so that no ray slips between them.
        let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| p.coords.cross(&q.coords));
        Self { edges, normal, offset: normal.dot(&a.coords) }
    }

    /// Depth at which the line along `ray` (z = 1) crosses the triangle, its edges included; `None` where it does not.
    fn depth_along(&self, ray: &Vector3<f64>) -> Option<f64> {
        let sides = self.edges.map(|edge| edge.dot(ray));
        let within = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
        let slope = self.normal.dot(ray);
        (within && slope != 0.0).then(|| self.offset / slope)
    }
}
