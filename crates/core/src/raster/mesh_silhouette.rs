//! Silhouettes of triangle meshes from their contour edges: the cost of a fine mesh is proportional to its outline.
//!
//! Every triangle covers its pixels once, whichever side faces the camera. Where two triangles that share an edge show
//! the same side, their contributions at the edge cancel, so the number of triangles over a pixel is a sum over the
//! remaining edges above it. This holds for open, folded and non-manifold meshes too: an edge is drawn as often as its
//! triangles do not cancel. Columns of pixel centres are crossed half-open, so neither gaps nor double pixels appear at
//! vertices. Columns rather than rows, because the edges of an upright body cross fewer of them, and because the sums
//! of neighbouring columns are then formed together, without sorting.
//!
//! The loops run on plain arrays and are compiled for several instruction sets ([`crate::simd`]); operations are never
//! fused, so all give the same bits.

use nalgebra::{Isometry3, Point3};

use super::strips::{ROWS, STRIP, StripImage, StripLayout};
use super::{Mask, MeshTopology, paint_triangles};
use crate::camera::Pinhole;
use crate::simd::{Dispatched, dispatch};

/// Changes of the number of triangles, or these numbers, in one row of a strip.
type Covers = [u16; STRIP as usize];

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
    /// Per strip and row, the change of the number of triangles from the row above; zero between uses. One block of
    /// rows more per strip than the image has, for edges that leave it below.
    changes: Vec<Covers>,
    /// Per strip the first and the last row with a change.
    changed: Vec<(usize, usize)>,
    /// Per row of a strip, whether a pixel is covered: 1 or 0.
    covered: Vec<[u8; STRIP as usize]>,
    /// Drawn image for comparisons.
    pub(super) image: StripImage,
    /// A strip's contour.
    pub(super) edge: Vec<u32>,
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
        if dispatch(Painting { topology: self, pinhole, vertices_in_camera, scratch: &mut *scratch }) {
            scratch.image.merge_into(mask);
        } else {
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
        let beyond = project(pinhole, camera_from_world, vertices, &mut self.pixels);
        if !(beyond && self.fill(topology)) {
            self.image = by_triangles(topology, pinhole, camera_from_world, vertices);
        }
    }

    /// Fills the mesh, with its vertices at `pixels`, on the cleared image. Returns false, and draws nothing, if so
    /// many triangles may be over a pixel that they cannot be counted.
    #[inline(always)]
    fn fill(&mut self, topology: &MeshTopology) -> bool {
        self.face(topology.triangles());
        self.turn(topology.sides());
        // every edge changes the number by at most two
        if topology.triangles().len().min(2 * self.turning.len()) > usize::from(u16::MAX) {
            return false;
        }
        self.cross(topology);
        self.fill_strips();
        true
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

    /// Notes where the edges cross the centres of the pixel columns.
    #[inline(always)]
    fn cross(&mut self, topology: &MeshTopology) {
        let StripLayout { width, height, rows, strips } = self.image.layout();
        let rows = rows + ROWS;
        self.changes.resize(strips * rows, [0; STRIP as usize]);
        self.changed.clear();
        self.changed.resize(strips, (rows, 0));
        let changes = self.changes.as_mut_slice();
        let facing = self.facing.as_flattened();
        for edge in &self.turning {
            let sides = topology.sides()[*edge as usize];
            let cover = i16::from(facing[sides[0] as usize]) + i16::from(facing[sides[1] as usize]);
            let ends = topology.edges()[*edge as usize].ends;
            let (a, b) = (self.pixels[ends[0] as usize], self.pixels[ends[1] as usize]);
            // from the left end, so that an edge has the same line for both triangles
            let (left, right, change) = if a[0] <= b[0] { (a, b, -cover) } else { (b, a, cover) };
            let (first, end) = (first_centre(left[0], width), first_centre(right[0], width));
            if first >= end {
                continue;
            }
            let slope = (right[1] - left[1]) / (right[0] - left[0]);
            let y = left[1] + (f64::from(first) + 0.5 - left[0]) * slope;
            let mut beside = 0.0;
            for strip in first / STRIP..=(end - 1) / STRIP {
                let columns = (first.max(strip * STRIP) % STRIP) as usize
                    ..(end.min((strip + 1) * STRIP) - strip * STRIP) as usize;
                let strip = strip as usize;
                let of_strip = &mut changes[strip * rows..][..rows];
                let (top, bottom) = &mut self.changed[strip];
                for column in columns {
                    let row = first_centre(y + beside * slope, height) as usize;
                    let here = &mut of_strip[row][column];
                    *here = here.wrapping_add_signed(change);
                    (*top, *bottom) = ((*top).min(row), (*bottom).max(row));
                    beside += 1.0;
                }
            }
        }
    }

    /// Adds the changes up, strip by strip, and clears them.
    #[inline(always)]
    fn fill_strips(&mut self) {
        let rows = self.image.layout().rows + ROWS;
        for (strip, &(top, bottom)) in self.changed.iter().enumerate() {
            if top >= bottom {
                continue;
            }
            let changes = &mut self.changes[strip * rows..][top..=bottom];
            self.covered.resize(changes.len(), [0; STRIP as usize]);
            let mut cover = [0; STRIP as usize];
            for (changes, covered) in changes.iter_mut().zip(&mut self.covered) {
                for ((cover, change), covered) in cover.iter_mut().zip(changes).zip(covered) {
                    *cover = u16::wrapping_add(*cover, *change);
                    *covered = u8::from(*cover != 0);
                    *change = 0;
                }
            }
            // nothing is covered any more from the last change on
            for (word, covered) in self.image.words_of_strip(strip, top, bottom).iter_mut().zip(&self.covered) {
                *word = packed(covered);
            }
        }
    }
}

/// The lowest bits of these bytes, each 0 or 1.
#[inline(always)]
fn packed(bytes: &[u8; STRIP as usize]) -> u32 {
    let (eights, _) = bytes.as_chunks();
    let mut word = 0;
    for (place, eight) in eights.iter().enumerate() {
        // the factor moves the lowest bit of byte k to bit 56 + k; none of the sums carries into these
        let byte = u64::from_le_bytes(*eight).wrapping_mul(0x0102_0408_1020_4080) >> 56;
        word |= (byte as u32) << (8 * place);
    }
    word
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
    // beyond this number there are no fractions: adding it rounds, and leaves the whole number in the lowest bits
    // (conversion of floats to integers and `ceil` are slower, the latter a function call on older processors)
    const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;
    let within = (coordinate - 0.5).max(0.0).min(f64::from(most));
    let rounded = within + WHOLE;
    rounded.to_bits() as u32 + u32::from(rounded - WHOLE < within)
}

/// Work for [`dispatch`]: returns whether edges could be used.
struct Painting<'a> {
    topology: &'a MeshTopology,
    pinhole: &'a Pinhole,
    vertices_in_camera: &'a [Point3<f64>],
    scratch: &'a mut MeshScratch,
}

impl Dispatched for Painting<'_> {
    type Output = bool;

    #[inline(always)]
    fn work(self) -> bool {
        let Self { topology, pinhole, vertices_in_camera, scratch } = self;
        let ([fx, fy], [cx, cy], near) = (pinhole.focal, pinhole.principal_point, pinhole.near);
        scratch.image.reshape(StripLayout::new(pinhole.width, pinhole.height));
        scratch.pixels.resize(vertices_in_camera.len(), [0.0; 2]);
        let mut beyond = true;
        for (pixel, point) in scratch.pixels.iter_mut().zip(vertices_in_camera) {
            let inverse = 1.0 / point.z;
            *pixel = [cx + fx * (point.x * inverse), cy + fy * (point.y * inverse)];
            beyond &= point.z >= near;
        }
        beyond && scratch.fill(topology)
    }
}

#[cfg(test)]
mod tests;
