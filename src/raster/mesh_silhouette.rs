//! Silhouettes of triangle meshes by the edges at which they turn away: what a fine mesh costs grows with its outline.
//!
//! Every triangle, whichever side it shows, covers its pixels once. So where two triangles that share an edge show the
//! same side, their parts of the edge cancel, and the number of triangles over a pixel is a sum over the remaining
//! edges to its left. That holds for open, folded and non-manifold meshes too: an edge is drawn as often as its
//! triangles do not cancel. Rows of pixel centres are crossed half-open, so neither gaps nor double pixels appear at
//! vertices.

use nalgebra::Point3;

use super::{Mask, paint_triangles};
use crate::camera::Pinhole;
use std::collections::BTreeMap;

/// How the triangles of a mesh hang together: its edges, each with the triangles that meet there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshTopology {
    triangles: Vec<[u32; 3]>,
    edges: Vec<MeshEdge>,
    vertices: usize,
}

/// An edge and up to two triangles; more at one edge make several entries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeshEdge {
    /// Vertices, the smaller first.
    pub(crate) ends: [u32; 2],
    /// Triangles; the number of triangles where there is none.
    pub(crate) triangles: [u32; 2],
    /// Whether the triangle runs along the edge from the first end to the second (1) or back (-1).
    runs: [i8; 2],
}

/// Buffers for drawing.
#[derive(Clone, Debug, Default)]
pub struct MeshScratch {
    pixels: Vec<[f64; 2]>,
    /// 1 for counter-clockwise in the image, -1 for clockwise, 0 seen edge-on; one more entry, 0, for no triangle.
    facing: Vec<i8>,
    /// First column right of a crossing, and by how much the cover changes there; by row.
    crossings: Vec<Vec<(i32, i32)>>,
}

impl MeshTopology {
    /// Of a mesh; triangles with a vertex beyond `vertices` are left out.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let sound = |triangle: &&[u32; 3]| triangle.iter().all(|corner| (*corner as usize) < vertices);
        let triangles: Vec<[u32; 3]> = triangles.iter().filter(sound).copied().collect();
        let none = triangles.len() as u32;
        let mut edges: Vec<MeshEdge> = Vec::with_capacity(triangles.len() * 3 / 2 + 1);
        let mut open: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        for (number, triangle) in (0_u32..).zip(&triangles) {
            for side in 0..3 {
                let (from, to) = (triangle[side], triangle[(side + 1) % 3]);
                let (ends, run) = if from < to { ([from, to], 1) } else { ([to, from], -1) };
                match open.remove(&ends) {
                    Some(place) => {
                        edges[place].triangles[1] = number;
                        edges[place].runs[1] = run;
                    }
                    None => {
                        open.insert(ends, edges.len());
                        edges.push(MeshEdge { ends, triangles: [number, none], runs: [run, 0] });
                    }
                }
            }
        }
        Self { triangles, edges, vertices }
    }

    /// Its edges.
    pub(crate) fn edges(&self) -> &[MeshEdge] {
        &self.edges
    }

    /// Its triangles.
    pub(crate) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Adds the mesh's silhouette to `mask`, which has the pinhole's size. `vertices_in_camera` are as many as the mesh
    /// has, metres. What lies before the near plane is cut off.
    pub fn paint(
        &self,
        pinhole: &Pinhole,
        vertices_in_camera: &[Point3<f64>],
        scratch: &mut MeshScratch,
        mask: &mut Mask,
    ) {
        if vertices_in_camera.len() < self.vertices {
            return;
        }
        if vertices_in_camera.iter().any(|vertex| vertex.z.is_nan() || vertex.z < pinhole.near) {
            return paint_triangles(pinhole, vertices_in_camera, &self.triangles, mask);
        }
        scratch.project(pinhole, vertices_in_camera);
        scratch.face(&self.triangles);
        scratch.cross(&self.edges, pinhole);
        scratch.fill(pinhole.width, mask);
    }
}

impl MeshScratch {
    fn project(&mut self, pinhole: &Pinhole, vertices: &[Point3<f64>]) {
        let ([fx, fy], [cx, cy]) = (pinhole.focal, pinhole.principal_point);
        self.pixels.clear();
        self.pixels.extend(vertices.iter().map(|p| {
            let inverse = 1.0 / p.z;
            [cx + fx * (p.x * inverse), cy + fy * (p.y * inverse)]
        }));
    }

    fn face(&mut self, triangles: &[[u32; 3]]) {
        let pixels = &self.pixels;
        self.facing.clear();
        self.facing.extend(triangles.iter().map(|[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|corner| pixels[*corner as usize]);
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            i8::from(area > 0.0) - i8::from(area < 0.0)
        }));
        self.facing.push(0);
    }

    fn cross(&mut self, edges: &[MeshEdge], pinhole: &Pinhole) {
        let (width, height) = (pinhole.width as i32, pinhole.height as i32);
        self.crossings.resize_with(height as usize, Vec::new);
        self.crossings.iter_mut().for_each(Vec::clear);
        for edge in edges {
            let [one, two] = edge.triangles.map(|triangle| self.facing[triangle as usize]);
            let cover = i32::from(one * edge.runs[0] + two * edge.runs[1]);
            if cover == 0 {
                continue;
            }
            let [a, b] = edge.ends.map(|end| self.pixels[end as usize]);
            // from the upper end, so that an edge has one line whatever triangle asks
            let (top, bottom, cover) = if a[1] <= b[1] { (a, b, cover) } else { (b, a, -cover) };
            let first = first_centre(top[1], height);
            let end = first_centre(bottom[1], height);
            if first >= end {
                continue;
            }
            let slope = (bottom[0] - top[0]) / (bottom[1] - top[1]);
            let mut x = top[0] + (f64::from(first) + 0.5 - top[1]) * slope;
            for row in first..end {
                self.crossings[row as usize].push((first_centre(x, width), cover));
                x += slope;
            }
        }
    }

    fn fill(&mut self, width: u32, mask: &mut Mask) {
        for (row, crossings) in (0_u32..).zip(&mut self.crossings) {
            if crossings.is_empty() {
                continue;
            }
            crossings.sort_unstable();
            let (mut cover, mut start) = (0, 0);
            for &(x, change) in crossings.iter() {
                if cover != 0 && x > start {
                    mask.fill_span(row, start as u32, (x as u32).min(width));
                }
                cover += change;
                start = x;
            }
        }
    }
}

/// The first pixel whose centre lies at or beyond a coordinate, within 0 and `most`.
fn first_centre(coordinate: f64, most: i32) -> i32 {
    // the cast saturates, and takes NaN to 0
    ((coordinate - 0.5).ceil() as i32).clamp(0, most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};

    const PINHOLE: Pinhole =
        Pinhole { focal: [300.0, 310.0], principal_point: [160.0, 118.0], width: 320, height: 240, near: 0.05 };

    /// What [`paint_triangles`] draws, triangle by triangle.
    fn painted(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Mask {
        let mut mask = Mask::new(320, 240);
        paint_triangles(&PINHOLE, vertices, triangles, &mut mask);
        mask
    }

    fn drawn(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Mask {
        let mut mask = Mask::new(320, 240);
        let topology = MeshTopology::new(vertices.len(), triangles);
        topology.paint(&PINHOLE, vertices, &mut MeshScratch::default(), &mut mask);
        mask
    }

    fn soup(seed: u64, vertices: usize, triangles: usize, near: f64) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut within = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let places =
            (0..vertices).map(|_| Point3::new(within(-1.5, 1.5), within(-1.2, 1.2), within(near, 4.0))).collect();
        let corner = |rng: &mut dyn FnMut(f64, f64) -> f64| rng(0.0, vertices as f64 - 0.01) as u32;
        let triangles = (0..triangles).map(|_| [(); 3].map(|()| corner(&mut within))).collect();
        (places, triangles)
    }

    #[test]
    fn any_soup_of_triangles_has_the_silhouette_of_its_triangles_one_by_one() {
        for seed in 0..40 {
            let (vertices, triangles) = soup(seed, 12, 9, 1.0);
            let (drawn, painted) = (drawn(&vertices, &triangles), painted(&vertices, &triangles));
            let differing = (0..240).flat_map(|y| (0..320).map(move |x| (x, y)));
            let differing = differing.filter(|&(x, y)| drawn.get(x, y) != painted.get(x, y)).count();
            // a centre that lies on an edge up to rounding
            assert!(differing <= 1, "{differing} of {} in {seed}", painted.count());
        }
    }

    #[test]
    fn what_lies_before_the_near_plane_is_cut_off() {
        let (vertices, triangles) = soup(7, 12, 9, -1.0);
        assert!(vertices.iter().any(|v| v.z < 0.05));
        assert_eq!(drawn(&vertices, &triangles), painted(&vertices, &triangles));
    }

    #[test]
    fn shared_edges_of_a_closed_mesh_leave_neither_gaps_nor_double_pixels() {
        // a fan about a middle vertex on a pixel's centre, seen from both sides
        let ring = |k: u32| {
            let (sin, cos) = libm::sincos(f64::from(k) * 0.4);
            Point3::new(cos, sin, 3.0)
        };
        let mut vertices = vec![Point3::new(0.5 / 300.0 * 3.0, 0.5 / 310.0 * 3.0, 3.0)];
        vertices.extend((0..15).map(ring));
        let fan: Vec<[u32; 3]> = (0..15).map(|k| [0, 1 + k, 1 + (k + 1) % 15]).collect();
        let back: Vec<[u32; 3]> = fan.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        let mask = drawn(&vertices, &fan);
        assert_eq!(mask, drawn(&vertices, &back), "whichever side it shows");
        assert_eq!(mask, drawn(&vertices, &[fan.clone(), back].concat()), "twice");
        for y in 0..240 {
            assert!(mask.runs(y).count() <= 1, "row {y} has a hole");
        }
    }

    #[test]
    fn a_mesh_half_outside_the_image_is_cut_at_its_border_and_indices_astray_are_left_out() {
        let square = [[-9.0, -0.5], [0.0, -0.5], [0.0, 0.5], [-9.0, 0.5]].map(|[x, y]| Point3::new(x, y, 1.0));
        let mask = drawn(&square, &[[0, 1, 2], [0, 2, 3], [0, 1, 77]]);
        assert_eq!(
            mask,
            Mask::from_fn(320, 240, |x, y| x < 160
                && f64::from(y) + 0.5 >= 118.0 - 155.0
                && f64::from(y) + 0.5 < 118.0 + 155.0)
        );
        let beside = square.map(|p| p + Vector3::new(40.0, 0.0, 0.0));
        assert!(drawn(&beside, &[[0, 1, 2], [0, 2, 3]]).is_empty());
    }
}
