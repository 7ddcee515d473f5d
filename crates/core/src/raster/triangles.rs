//! Silhouettes of triangle meshes.

use nalgebra::{Point2, Point3};

use crate::camera::Pinhole;

use super::{Mask, paint_polygon};

/// Adds the silhouette of a triangle mesh (vertices in the camera frame, metres; seen from either side) to `mask`.
///
/// Parts nearer than the near plane are cut off. Triangles that share an edge leave no gap, see [`paint_polygon`].
/// Triangles with an index beyond `vertices_in_camera` are not drawn.
pub fn paint_triangles(pinhole: &Pinhole, vertices_in_camera: &[Point3<f64>], triangles: &[[u32; 3]], mask: &mut Mask) {
    let mut corners = Vec::with_capacity(4);
    for triangle in triangles {
        let [Some(a), Some(b), Some(c)] = triangle.map(|index| vertices_in_camera.get(index as usize)) else {
            continue;
        };
        corners.clear();
        for (from, to) in [(a, b), (b, c), (c, a)] {
            corners.extend(beyond_near(from, to, pinhole.near).into_iter().flatten().map(|p| pixel(pinhole, &p)));
        }
        paint_polygon(&corners, mask);
    }
}

fn pixel(pinhole: &Pinhole, point: &Point3<f64>) -> Point2<f64> {
    pinhole.pixel(point.x / point.z, point.y / point.z)
}

/// Sutherland and Hodgman's step: the start of an edge if it is beyond the near plane, then the point where the edge
/// crosses the plane.
fn beyond_near(from: &Point3<f64>, to: &Point3<f64>, near: f64) -> [Option<Point3<f64>>; 2] {
    let start = (from.z >= near).then_some(*from);
    let crosses = (from.z >= near) != (to.z >= near);
    // From the nearer end, so that both triangles at an edge find the same point.
    let (low, high) = if from.z < to.z { (from, to) } else { (to, from) };
    let crossing = crosses.then(|| low + (high - low) * ((near - low.z) / (high.z - low.z)));
    [start, crossing.map(|p| Point3::new(p.x, p.y, near))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::{CapsulePainter, TaperedCapsule, overlap};
    use nalgebra::Vector3;

    const PINHOLE: Pinhole =
        Pinhole { focal: [300.0, 310.0], principal_point: [160.0, 118.0], width: 320, height: 240, near: 0.05 };

    /// A ball meshed by latitude and longitude.
    fn ball(centre: Point3<f64>, radius: f64) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        const N: u32 = 96;
        let place = |i: u32, j: u32| {
            let (tilt, turn) = (
                std::f64::consts::PI * f64::from(i) / f64::from(N),
                std::f64::consts::TAU * f64::from(j) / f64::from(N),
            );
            centre + radius * Vector3::new(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos())
        };
        let vertices = (0..=N).flat_map(|i| (0..N).map(move |j| place(i, j))).collect();
        let quads = (0..N).flat_map(|i| {
            (0..N).map(move |j| [i * N + j, i * N + (j + 1) % N, (i + 1) * N + j, (i + 1) * N + (j + 1) % N])
        });
        (vertices, quads.flat_map(|[a, b, c, d]| [[a, b, c], [b, d, c]]).collect())
    }

    #[test]
    fn a_finely_meshed_ball_has_the_silhouette_of_a_ball_at_any_position() {
        // In front of the camera, beside it, and around it, where the near plane cuts the mesh open.
        for (x, y, z, radius) in [(0.1, -0.2, 3.0, 0.7), (1.2, 0.9, 2.0, 0.9), (0.3, 0.1, 0.4, 0.38)] {
            let centre = Point3::new(x, y, z);
            let (vertices, triangles) = ball(centre, radius);
            let (mut meshed, mut exact) = (Mask::new(320, 240), Mask::new(320, 240));
            paint_triangles(&PINHOLE, &vertices, &triangles, &mut meshed);
            let solid = TaperedCapsule { a: centre, b: centre, radius_a: radius, radius_b: radius };
            CapsulePainter::new(&PINHOLE).paint(&[solid], &mut exact);
            assert!(!exact.is_empty());
            let overlap = overlap(&meshed, &exact);
            assert!(overlap.iou() > 0.996, "{overlap:?}");
        }
    }

    #[test]
    fn a_wall_through_the_camera_is_visible_beyond_the_near_plane() {
        // The floor y = 1 from behind the camera to 10 m in front of it: from row 118 + 310 / 10 = 149 downwards.
        let floor = [[-90.0, 1.0, -5.0], [90.0, 1.0, -5.0], [90.0, 1.0, 10.0], [-90.0, 1.0, 10.0]].map(Point3::from);
        let mut mask = Mask::new(320, 240);
        paint_triangles(&PINHOLE, &floor, &[[0, 1, 2], [0, 2, 3]], &mut mask);
        assert_eq!(mask, Mask::from_fn(320, 240, |_, y| y >= 149));
    }

    #[test]
    fn meshes_behind_the_camera_and_triangles_without_vertices_draw_nothing() {
        let (vertices, mut triangles) = ball(Point3::new(0.0, 0.0, -2.0), 1.0);
        triangles.push([0, 1, u32::MAX]);
        let mut mask = Mask::new(320, 240);
        paint_triangles(&PINHOLE, &vertices, &triangles, &mut mask);
        assert!(mask.is_empty());
    }
}
