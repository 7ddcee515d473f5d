//! Silhouettes of meshes through a lens, from their contour edges.
//!
//! As in `raster::mesh_silhouette`, the number of triangles over a pixel is a sum over the edges that are crossed on
//! the way to it from the left border of the image. The rays of a row of pixels are not on a line, so the crossings of
//! each edge are found between neighbouring rays: by the side of the edge on which either ray is, computed as for
//! triangles, and the side of the line between both rays on which either end of the edge is.

use nalgebra::{Point3, Vector3};

use super::pixel_rays::PixelRays;
use super::regions::Reach;
use crate::raster::{Mask, MeshScratch, MeshTopology};

#[derive(Default)]
pub(super) struct LensScratch {
    mesh: MeshScratch,
    /// Vertices in ideal coordinates.
    ideal: Vec<[f64; 2]>,
    crossings: Vec<LensCrossing>,
}

/// An edge between two pixels of a row. Ordered by row, then by column.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct LensCrossing {
    row: u32,
    /// Column of the pixel to its right.
    column: u32,
    /// Change of the number of triangles, from left to right.
    change: i32,
}

/// Adds the silhouette of a mesh with its vertices in the camera's frame to `mask`. Returns false, with the mask as it
/// was, if it cannot be drawn by its edges: if it is not wholly beyond the near plane or reaches the left or right
/// border of the image, or if a pixel has no ray.
pub(super) fn paint(
    topology: &MeshTopology,
    vertices: &[Point3<f64>],
    rays: &PixelRays,
    near: f64,
    scratch: &mut LensScratch,
    mask: &mut Mask,
) -> bool {
    let Some(whole) = Reach::around(vertices.iter().copied()).view(near) else { return true };
    if vertices.iter().any(|vertex| vertex.z < near) || rays.borders_meet(&whole) || !rays.cells().is_complete() {
        return false;
    }
    let LensScratch { mesh, ideal, crossings } = scratch;
    ideal.clear();
    ideal.extend(vertices.iter().map(|vertex| [vertex.x / vertex.z, vertex.y / vertex.z]));
    crossings.clear();
    for (ends, cover) in mesh.contour(topology, ideal) {
        cross(ends.map(|end| vertices[end as usize]), cover, rays, crossings);
    }
    crossings.sort_unstable();
    fill(crossings, mask)
}

/// Adds the crossings of an edge with the lines between neighbouring rays of a row.
fn cross([a, b]: [Point3<f64>; 2], cover: i32, rays: &PixelRays, crossings: &mut Vec<LensCrossing>) {
    let Some(view) = Reach::around([a, b]).view(0.0) else { return };
    let edge = a.coords.cross(&b.coords);
    let window = rays.cells().window(&view);
    for row in window.rows() {
        let mut left = Vector3::zeros();
        let mut left_side = None;
        // its columns and the next one to the right
        for column in window.left..(window.left + window.width + 1).min(rays.size().0) {
            let [u, v] = rays.ray(column, row);
            let ray = Vector3::new(u, v, 1.0);
            let side = edge.dot(&ray) >= 0.0;
            if left_side.is_some_and(|before| before != side) {
                let line = left.cross(&ray);
                let [from, to] = [a, b].map(|end| line.dot(&end.coords) >= 0.0);
                if from != to {
                    // an edge that runs downwards has its own sign
                    let change = if to { cover } else { -cover };
                    crossings.push(LensCrossing { row, column, change });
                }
            }
            (left, left_side) = (ray, Some(side));
        }
    }
}

/// Fills what is covered. Returns false, with the mask as it was, if the sum of a row is not 0: rounding at a vertex.
fn fill(crossings: &[LensCrossing], mask: &mut Mask) -> bool {
    let rows = || crossings.chunk_by(|a, b| a.row == b.row);
    if rows().any(|row| row.iter().map(|crossing| crossing.change).sum::<i32>() != 0) {
        return false;
    }
    for row in rows() {
        let (mut cover, mut from) = (0, 0);
        for crossing in row {
            if cover != 0 && crossing.column > from {
                mask.fill_span(crossing.row, from, crossing.column);
            }
            cover += crossing.change;
            from = crossing.column;
        }
    }
    true
}
