//! Pixels whose rays meet a solid beyond the near plane.

use nalgebra::{Isometry3, Point3, Vector3};

use super::pixel_rays::PixelRays;
use super::regions::Reach;
use crate::body::{Ray, Solid};
use crate::raster::{Mask, TaperedCapsule};

/// Calls `visit` with every pixel that sees `solid` at or beyond z = `near`, and the least depth z there. Pixels that
/// see several triangles of a mesh are visited for each. The last argument is the triangle, 0 for other solids.
pub(super) fn each_depth(
    solid: &Solid,
    camera_from_link: &Isometry3<f64>,
    rays: &PixelRays,
    near: f64,
    visit: &mut impl FnMut(u32, u32, f64, u32),
) {
    match solid {
        Solid::Mesh { vertices, triangles } => {
            let vertices: Vec<Point3<f64>> = vertices.iter().map(|v| camera_from_link * v).collect();
            return each_depth_of_mesh(&vertices, triangles, rays, near, visit);
        }
        Solid::TaperedCapsule(capsule) => {
            let capsule = capsule.transformed(camera_from_link);
            let Some(view) = reach_of_capsule(&capsule).view(near) else { return };
            return rays.each_entry(&capsule, &view, near, |x, y, depth| visit(x, y, depth, 0));
        }
        _ => {}
    }
    let Some(view) = reach_of(solid, camera_from_link).view(near) else { return };
    let link_from_camera = camera_from_link.inverse();
    // one matrix product per pixel in place of two quaternion products
    let (turn, centre) = (link_from_camera.rotation.to_rotation_matrix(), link_from_camera.translation.vector);
    rays.each_pixel(&view, |x, y, direction| {
        // The direction's z is 1: lengths along the ray are depths.
        let direction = turn * direction;
        let ray = Ray { origin: Point3::from(centre + direction * near), direction };
        if let Some(beyond) = solid.ray_entry(&ray) {
            visit(x, y, near + beyond, 0);
        }
    });
}

/// Sets every pixel that sees `solid` at or beyond z = `near`.
pub(super) fn paint(solid: &Solid, camera_from_link: &Isometry3<f64>, rays: &PixelRays, near: f64, mask: &mut Mask) {
    match solid {
        Solid::TaperedCapsule(capsule) => {
            let capsule = capsule.transformed(camera_from_link);
            // The solid is convex: the ray meets the part beyond the near plane iff it exits there.
            if let Some(view) = reach_of_capsule(&capsule).view(near) {
                rays.paint_capsule(&capsule, &view, near, mask);
            }
        }
        _ => each_depth(solid, camera_from_link, rays, near, &mut |x, y, _, _| mask.set(x, y, true)),
    }
}

/// A box in the camera's frame around a solid.
pub(super) fn reach_of(solid: &Solid, camera_from_link: &Isometry3<f64>) -> Reach {
    match solid {
        Solid::TaperedCapsule(capsule) => reach_of_capsule(&capsule.transformed(camera_from_link)),
        Solid::Box { link_from_box, half_extents } => {
            let frame = camera_from_link * link_from_box;
            let half = Vector3::from(*half_extents);
            reach_about(&frame, &(frame.rotation.to_rotation_matrix().into_inner().abs() * half))
        }
        Solid::Cylinder { link_from_cylinder, radius, half_length } => {
            let frame = camera_from_link * link_from_cylinder;
            let axis = frame.rotation * Vector3::z();
            reach_about(&frame, &axis.map(|c| c.abs() * half_length + radius * (1.0 - c * c).max(0.0).sqrt()))
        }
        Solid::Mesh { vertices, .. } => Reach::around(vertices.iter().map(|v| camera_from_link * v)),
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

/// Visits the surface of a mesh (vertices in the camera's frame), with the index of the triangle; if the near plane
/// cuts a closed mesh, its far side is visible.
pub(super) fn each_depth_of_mesh(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    rays: &PixelRays,
    near: f64,
    visit: &mut impl FnMut(u32, u32, f64, u32),
) {
    if Reach::around(vertices.iter().copied()).view(near).is_none() {
        return;
    }
    let cells = rays.cells();
    for (facet, triangle) in (0..).zip(triangles) {
        let corners = triangle.map(|i| vertices[i as usize]);
        let Some(view) = Reach::around(corners).view(near) else { continue };
        let facing = Facing::new(&corners);
        let window = cells.window(&view);
        for (x, y) in window.rows().flat_map(|y| window.columns().map(move |x| (x, y))) {
            let [u, v] = rays.ray(x, y);
            if let Some(depth) = facing.depth_along(&Vector3::new(u, v, 1.0)).filter(|depth| *depth >= near)
                && view.contains([u, v])
            {
                visit(x, y, depth, facet);
            }
        }
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
        // A shared edge of two triangles gives the same plane up to sign, so no ray passes between them.
        let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| p.coords.cross(&q.coords));
        Self { edges, normal, offset: normal.dot(&a.coords) }
    }

    /// Depth at which the line along `ray` (z = 1) crosses the triangle, including its edges; `None` if it does not.
    fn depth_along(&self, ray: &Vector3<f64>) -> Option<f64> {
        let sides = self.edges.map(|edge| edge.dot(ray));
        let within = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
        let slope = self.normal.dot(ray);
        (within && slope != 0.0).then(|| self.offset / slope)
    }
}
