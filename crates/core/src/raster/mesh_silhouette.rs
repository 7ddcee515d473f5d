//! Silhouettes of triangle meshes from their contour edges: the cost of a fine mesh is proportional to its outline.
//!
//! Every triangle covers its pixels once, whichever side faces the camera. Where two triangles that share an edge show
//! the same side, their contributions at the edge cancel, so the number of triangles over a pixel is a sum over the
//! remaining edges to its left. This holds for open, folded and non-manifold meshes too: an edge is drawn as often as
//! its triangles do not cancel. Rows of pixel centres are crossed half-open, so neither gaps nor double pixels appear
//! at vertices.
//!
//! The loops run on plain arrays and are compiled for several instruction sets ([`crate::simd`]); operations are never
//! fused, so all give the same bits.

use nalgebra::{Isometry3, Point3};

use super::strips::{StripImage, StripLayout};
use super::{Mask, MeshTopology, paint_triangles};
use crate::camera::Pinhole;
use crate::simd::{Dispatched, dispatch};

/// Wider images are drawn triangle by triangle: a column and a change of coverage share 32 bits.
const WIDEST: u32 = 1 << 23;

/// The vertices of a mesh, one array per coordinate, so that several are projected at once. Metres, world.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshVertices {
    columns: [Vec<f64>; 3],
}

impl MeshVertices {
    /// Replaces the vertices.
    pub fn replace(&mut self, points: &[Point3<f64>]) {
        for (axis, column) in self.columns.iter_mut().enumerate() {
            column.clear();
            column.extend(points.iter().map(|point| point[axis]));
        }
    }

    /// Number of vertices.
    #[inline]
    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    /// Whether there are no vertices.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.columns[0].is_empty()
    }

    fn points(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        let [x, y, z] = &self.columns;
        x.iter().zip(y).zip(z).map(|((x, y), z)| Point3::new(*x, *y, *z))
    }
}

/// Buffers for drawing: one per thread, for meshes and cameras of any size.
#[derive(Clone, Debug, Default)]
pub struct MeshScratch {
    pixels: Vec<[f64; 2]>,
    /// Orientation of every triangle in the image: 1 counter-clockwise, -1 clockwise, 0 edge-on; alternating with its
    /// negative. One more entry, 0, for a missing triangle.
    facing: Vec<[i8; 2]>,
    /// Edges whose triangles do not cancel.
    turning: Vec<u32>,
    slopes: Vec<EdgeRows>,
    /// Per row the index in `crossings` after its last one.
    ends: Vec<u32>,
    /// By row: first column to the right of a crossing, and the change of coverage there ([`Crossing`]).
    crossings: Vec<u32>,
    /// Drawn image for comparisons.
    pub(super) image: StripImage,
    /// A strip's contour.
    pub(super) edge: Vec<u32>,
}

/// An edge in terms of the rows whose centres it crosses.
#[derive(Clone, Copy, Debug)]
struct EdgeRows {
    /// Position where it crosses the first row's centres, pixels, and the shift to the right from row to row.
    x: f64,
    slope: f64,
    first: u32,
    end: u32,
    cover: i32,
}

/// A target for filled spans.
trait Spans {
    /// Sets the non-empty range of pixels `from..to` of a row inside the image.
    fn fill(&mut self, row: u32, from: u32, to: u32);
}

impl Spans for Mask {
    #[inline(always)]
    fn fill(&mut self, row: u32, from: u32, to: u32) {
        self.fill_span(row, from, to);
    }
}

impl Spans for StripImage {
    #[inline(always)]
    fn fill(&mut self, row: u32, from: u32, to: u32) {
        self.fill_span(row as usize, from, to);
    }
}

impl MeshTopology {
    /// Adds the mesh's silhouette to `mask`, which has the pinhole's size. `vertices_in_camera` are the mesh's
    /// vertices, metres. Parts nearer than the near plane are cut off.
    pub fn paint(
        &self,
        pinhole: &Pinhole,
        vertices_in_camera: &[Point3<f64>],
        scratch: &mut MeshScratch,
        mask: &mut Mask,
    ) {
        if vertices_in_camera.len() < self.vertices() {
            return;
        }
        if !dispatch(Painting { topology: self, pinhole, vertices_in_camera, scratch, mask: &mut *mask }) {
            paint_triangles(pinhole, vertices_in_camera, self.triangles(), mask);
        }
    }
}

impl MeshScratch {
    /// The edges of a mesh whose triangles do not cancel, with its vertices at these places in the image: both ends,
    /// and the change of the number of triangles from left to right where the edge runs downwards.
    pub(crate) fn contour<'a>(
        &'a mut self,
        topology: &'a MeshTopology,
        places: &[[f64; 2]],
    ) -> impl Iterator<Item = ([u32; 2], i32)> {
        self.pixels.clear();
        self.pixels.extend_from_slice(places);
        self.face(topology.triangles());
        self.turn(topology.sides());
        let facing = self.facing.as_flattened();
        self.turning.iter().map(move |edge| {
            let [one, two] = topology.sides()[*edge as usize];
            let cover = i32::from(facing[one as usize]) + i32::from(facing[two as usize]);
            (topology.edges()[*edge as usize].ends, cover)
        })
    }

    /// Draws a mesh on the cleared image, with the instructions that the caller was compiled for.
    #[inline(always)]
    pub(super) fn draw_here(
        &mut self,
        topology: &MeshTopology,
        pinhole: &Pinhole,
        camera_from_world: &Isometry3<f64>,
        vertices: &MeshVertices,
    ) {
        let layout = StripLayout::new(pinhole.width, pinhole.height);
        self.edge.resize(layout.rows, 0);
        self.image.reshape(layout);
        if vertices.len() < topology.vertices() {
            return;
        }
        // moved out while it is drawn on beside the other buffers
        let mut image = std::mem::take(&mut self.image);
        if project(pinhole, camera_from_world, vertices, &mut self.pixels) && pinhole.width < WIDEST {
            self.fill(topology, pinhole, &mut image);
        } else {
            image = by_triangles(topology, pinhole, camera_from_world, vertices);
        }
        self.image = image;
    }

    /// Fills the mesh with its vertices at `pixels`.
    #[inline(always)]
    fn fill(&mut self, topology: &MeshTopology, pinhole: &Pinhole, spans: &mut impl Spans) {
        self.face(topology.triangles());
        self.turn(topology.sides());
        self.slope(topology, pinhole.height);
        self.cross(pinhole.width);
        self.fill_rows(spans);
    }

    #[inline(always)]
    fn face(&mut self, triangles: &[[u32; 3]]) {
        let pixels = self.pixels.as_slice();
        self.facing.resize(triangles.len() + 1, [0; 2]);
        for (facing, [a, b, c]) in self.facing.iter_mut().zip(triangles) {
            let (a, b, c) = (pixels[*a as usize], pixels[*b as usize], pixels[*c as usize]);
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let sign = i8::from(area > 0.0) - i8::from(area < 0.0);
            *facing = [sign, -sign];
        }
        self.facing[triangles.len()] = [0; 2];
    }

    /// Finds the edges whose triangles do not cancel. Branch-free, because the outcome is unpredictable.
    #[inline(always)]
    fn turn(&mut self, sides: &[[u32; 2]]) {
        self.turning.resize(sides.len(), 0);
        let facing = self.facing.as_flattened();
        let mut count = 0;
        for (edge, [one, two]) in (0_u32..).zip(sides) {
            self.turning[count] = edge;
            count += usize::from(facing[*one as usize] != -facing[*two as usize]);
        }
        self.turning.truncate(count);
    }

    #[inline(always)]
    fn slope(&mut self, topology: &MeshTopology, height: u32) {
        let facing = self.facing.as_flattened();
        self.slopes.clear();
        self.ends.clear();
        self.ends.resize(height as usize + 1, 0);
        for edge in &self.turning {
            let sides = topology.sides()[*edge as usize];
            let cover = i32::from(facing[sides[0] as usize]) + i32::from(facing[sides[1] as usize]);
            let ends = topology.edges()[*edge as usize].ends;
            let (a, b) = (self.pixels[ends[0] as usize], self.pixels[ends[1] as usize]);
            // from the upper end, so that an edge has the same line for both triangles
            let (top, bottom, cover) = if a[1] <= b[1] { (a, b, cover) } else { (b, a, -cover) };
            let (first, end) = (first_centre(top[1], height), first_centre(bottom[1], height));
            if first >= end {
                continue;
            }
            let slope = (bottom[0] - top[0]) / (bottom[1] - top[1]);
            let x = top[0] + (f64::from(first) + 0.5 - top[1]) * slope;
            self.slopes.push(EdgeRows { x, slope, first, end, cover });
            // changes of the number of crossings from row to row
            self.ends[first as usize] = self.ends[first as usize].wrapping_add(1);
            self.ends[end as usize] = self.ends[end as usize].wrapping_sub(1);
        }
    }

    /// Sorts the crossings into rows.
    #[inline(always)]
    fn cross(&mut self, width: u32) {
        let (mut in_row, mut before) = (0_u32, 0_u32);
        for end in &mut self.ends {
            in_row = in_row.wrapping_add(*end);
            *end = before;
            before += in_row;
        }
        self.crossings.resize(before as usize, 0);
        for edge in &self.slopes {
            let mut below = 0.0;
            for next in &mut self.ends[edge.first as usize..edge.end as usize] {
                let column = first_centre(edge.x + below * edge.slope, width);
                self.crossings[*next as usize] = Crossing { column, change: edge.cover }.packed();
                *next += 1;
                below += 1.0;
            }
        }
    }

    #[inline(always)]
    fn fill_rows(&mut self, spans: &mut impl Spans) {
        let mut start = 0;
        for (row, end) in (0_u32..).zip(&self.ends) {
            let crossings = &mut self.crossings[start..*end as usize];
            start = *end as usize;
            sort_few(crossings);
            let (mut cover, mut from) = (0, 0);
            for packed in crossings {
                let Crossing { column, change } = Crossing::unpacked(*packed);
                if cover != 0 && column > from {
                    spans.fill(row, from, column);
                }
                cover += change;
                from = column;
            }
        }
    }
}

/// A crossing of an edge with a row of pixel centres.
#[derive(Clone, Copy)]
struct Crossing {
    /// The first column with its centre to the right.
    column: u32,
    change: i32,
}

impl Crossing {
    /// A number ordered by column.
    #[inline(always)]
    fn packed(self) -> u32 {
        self.column << 8 | (self.change + 128) as u32
    }

    #[inline(always)]
    fn unpacked(packed: u32) -> Self {
        Self { column: packed >> 8, change: (packed & 255) as i32 - 128 }
    }
}

/// Sorts a row's crossings in place; there are typically about ten.
#[inline(always)]
fn sort_few(crossings: &mut [u32]) {
    if crossings.len() > 32 {
        return crossings.sort_unstable();
    }
    for sorted in 1..crossings.len() {
        let next = crossings[sorted];
        let mut place = sorted;
        while place > 0 && crossings[place - 1] > next {
            crossings[place] = crossings[place - 1];
            place -= 1;
        }
        crossings[place] = next;
    }
}

/// Projects the vertices; returns whether all of them are beyond the near plane.
#[inline(always)]
fn project(
    pinhole: &Pinhole,
    camera_from_world: &Isometry3<f64>,
    vertices: &MeshVertices,
    pixels: &mut Vec<[f64; 2]>,
) -> bool {
    let ([fx, fy], [cx, cy], near) = (pinhole.focal, pinhole.principal_point, pinhole.near);
    let turn = camera_from_world.rotation.to_rotation_matrix();
    let shift = camera_from_world.translation.vector;
    let row = |i: usize| [turn[(i, 0)], turn[(i, 1)], turn[(i, 2)], shift[i]];
    let [to_x, to_y, to_z] = [row(0), row(1), row(2)];
    let [xs, ys, zs] = &vertices.columns;
    pixels.resize(xs.len(), [0.0; 2]);
    let mut beyond = true;
    for (((pixel, x), y), z) in pixels.iter_mut().zip(xs).zip(ys).zip(zs) {
        let depth = to_z[0] * x + to_z[1] * y + to_z[2] * z + to_z[3];
        let inverse = 1.0 / depth;
        let right = to_x[0] * x + to_x[1] * y + to_x[2] * z + to_x[3];
        let down = to_y[0] * x + to_y[1] * y + to_y[2] * z + to_y[3];
        *pixel = [cx + fx * (right * inverse), cy + fy * (down * inverse)];
        beyond &= depth >= near;
    }
    beyond
}

fn by_triangles(
    topology: &MeshTopology,
    pinhole: &Pinhole,
    camera_from_world: &Isometry3<f64>,
    vertices: &MeshVertices,
) -> StripImage {
    let in_camera: Vec<Point3<f64>> = vertices.points().map(|point| camera_from_world * point).collect();
    let mut mask = Mask::new(pinhole.width, pinhole.height);
    paint_triangles(pinhole, &in_camera, topology.triangles(), &mut mask);
    StripImage::from_mask(&mask)
}

/// The first pixel whose centre is at or beyond a coordinate, clamped to `0..=most`. NaN gives 0.
#[inline(always)]
fn first_centre(coordinate: f64, most: u32) -> u32 {
    let within = (coordinate - 0.5).clamp(0.0, f64::from(most));
    // avoids `ceil`, which is a function call on older processors
    let whole = within as i32;
    (whole + i32::from(f64::from(whole) < within)) as u32
}

/// Work for [`dispatch`]: returns whether edges could be used.
struct Painting<'a> {
    topology: &'a MeshTopology,
    pinhole: &'a Pinhole,
    vertices_in_camera: &'a [Point3<f64>],
    scratch: &'a mut MeshScratch,
    mask: &'a mut Mask,
}

impl Dispatched for Painting<'_> {
    type Output = bool;

    #[inline(always)]
    fn work(self) -> bool {
        let Self { topology, pinhole, vertices_in_camera, scratch, mask } = self;
        let ([fx, fy], [cx, cy], near) = (pinhole.focal, pinhole.principal_point, pinhole.near);
        scratch.pixels.resize(vertices_in_camera.len(), [0.0; 2]);
        let mut beyond = pinhole.width < WIDEST;
        for (pixel, point) in scratch.pixels.iter_mut().zip(vertices_in_camera) {
            let inverse = 1.0 / point.z;
            *pixel = [cx + fx * (point.x * inverse), cy + fy * (point.y * inverse)];
            beyond &= point.z >= near;
        }
        if beyond {
            scratch.fill(topology, pinhole, mask);
        }
        beyond
    }
}

#[cfg(test)]
mod tests;
