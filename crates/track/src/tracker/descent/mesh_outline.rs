//! Outlines of triangle meshes: the edges between a triangle that faces the camera and one that does not.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3};

use super::samples::{SampleSink, unit};
use skiagraph_core::body::Solid;

/// Sides of the prism that approximates a cylinder; its faces lie within half a percent of the radius.
const CYLINDER_SIDES: u32 = 32;

#[derive(Debug)]
pub(super) struct MeshOutline {
    /// In the link's frame.
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    edges: Vec<OutlineEdge>,
}

/// An edge and its adjacent triangles; the second is missing at the boundary of an open surface.
#[derive(Debug)]
struct OutlineEdge {
    ends: [u32; 2],
    triangles: [Option<u32>; 2],
}

impl MeshOutline {
    /// The surface of a solid; `None` for a tapered capsule.
    pub(super) fn from_solid(solid: &Solid) -> Option<Self> {
        match solid {
            Solid::TaperedCapsule(_) => None,
            Solid::Box { link_from_box, half_extents } => {
                let (vertices, triangles) = box_surface(link_from_box, half_extents);
                Some(Self::new(vertices, triangles))
            }
            Solid::Cylinder { link_from_cylinder, radius, half_length } => {
                let (vertices, triangles) = prism(link_from_cylinder, *radius, *half_length);
                Some(Self::new(vertices, triangles))
            }
            Solid::Mesh { vertices, triangles } => Some(Self::new(vertices.clone(), triangles.clone())),
        }
    }

    fn new(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Self {
        // Files often repeat the corners of each triangle: edges are identified by the positions of their ends.
        let mut places = BTreeMap::new();
        let place: Vec<u32> = (0..)
            .zip(&vertices)
            .map(|(index, p)| *places.entry([p.x.to_bits(), p.y.to_bits(), p.z.to_bits()]).or_insert(index))
            .collect();
        let mut edges: BTreeMap<[u32; 2], [Option<u32>; 2]> = BTreeMap::new();
        for (number, triangle) in (0_u32..).zip(&triangles) {
            let corners = triangle.map(|corner| place[corner as usize]);
            for side in 0..3 {
                let (a, b) = (corners[side], corners[(side + 1) % 3]);
                if a != b {
                    let meeting = edges.entry([a.min(b), a.max(b)]).or_default();
                    if let Some(free) = meeting.iter_mut().find(|place| place.is_none()) {
                        *free = Some(number);
                    }
                }
            }
        }
        let edges = edges.into_iter().map(|(ends, triangles)| OutlineEdge { ends, triangles }).collect();
        Self { vertices, triangles, edges }
    }

    /// A vertex, in the link's frame.
    pub(super) fn vertex(&self, vertex: u32) -> Option<Point3<f64>> {
        self.vertices.get(vertex as usize).copied()
    }

    /// Samples about `spacing` pixels apart on all edges of the outline.
    pub(super) fn sample(&self, camera_from_link: &Isometry3<f64>, spacing: f64, sink: &mut SampleSink<'_>) {
        let vertices: Vec<Point3<f64>> = self.vertices.iter().map(|v| camera_from_link * v).collect();
        let none = self.triangles.len() as u32;
        let edges = self.edges.iter().map(|edge| (edge.ends, edge.triangles.map(|t| t.unwrap_or(none))));
        sample_edges(&vertices, &self.triangles, edges, spacing, sink, |_, _| ());
    }
}

/// Samples about `spacing` pixels apart on all edges of the outline; `vertices` are in the camera's frame. An edge has
/// its ends and its adjacent triangles; a missing triangle has an index past the last. `at_edge` is called for every
/// edge that is sampled.
pub(super) fn sample_edges(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    edges: impl Iterator<Item = ([u32; 2], [u32; 2])>,
    spacing: f64,
    sink: &mut SampleSink<'_>,
    mut at_edge: impl FnMut(&mut SampleSink<'_>, [u32; 2]),
) {
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| vertices[corner as usize]);
    let faces = |triangle: &[u32; 3]| {
        let [a, b, c] = corners(triangle);
        (b - a).cross(&(c - a)).dot(&a.coords) < 0.0
    };
    let facing: Vec<bool> = triangles.iter().map(faces).collect();
    // Edges of fine meshes are shorter than the spacing: the remainder of one carries over to the next.
    let mut rest = 0.5 * spacing;
    for (ends, meeting) in edges {
        let [Some(one), two] = meeting.map(|triangle| facing.get(triangle as usize)) else { continue };
        if two == Some(one) {
            continue;
        }
        let [from, to] = ends.map(|end| vertices[end as usize]);
        let (Some(a), Some(b)) = (sink.project(&from), sink.project(&to)) else { continue };
        let third =
            corners(&triangles[meeting[0] as usize]).into_iter().find(|corner| *corner != from && *corner != to);
        let Some(inner) = third.and_then(|third| sink.project(&third)) else { continue };
        at_edge(sink, ends);
        let along = [b[0] - a[0], b[1] - a[1]];
        let across = [along[1], -along[0]];
        let side = across[0] * (inner[0] - a[0]) + across[1] * (inner[1] - a[1]);
        let normal = if side > 0.0 { across.map(|n| -n) } else { across };
        let length = along[0].hypot(along[1]);
        let mut at = rest;
        // An edge that is partly behind the camera may project to an unbounded length.
        while at < length.min(512.0 * spacing) {
            let share = perspective_share(&from, &to, at / length);
            if let Some(normal) = unit(normal) {
                sink.push(from + share * (to - from), normal, ends, share);
            }
            at += spacing;
        }
        rest = if length < 512.0 * spacing { at - length } else { 0.5 * spacing };
    }
}

/// The share along a segment that projects to `share` of the way between the images of its ends.
fn perspective_share(from: &Point3<f64>, to: &Point3<f64>, share: f64) -> f64 {
    share * from.z / (to.z + share * (from.z - to.z))
}

fn box_surface(link_from_box: &Isometry3<f64>, half: &[f64; 3]) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let sign = |bit: u32| if bit == 1 { 1.0 } else { -1.0 };
    let corner = |i: u32| Point3::new(sign(i & 1) * half[0], sign(i >> 1 & 1) * half[1], sign(i >> 2 & 1) * half[2]);
    // Counter-clockwise as seen from outside.
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    ((0..8).map(|i| link_from_box * corner(i)).collect(), triangles)
}

fn prism(link_from_cylinder: &Isometry3<f64>, radius: f64, half: f64) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let n = CYLINDER_SIDES;
    let ring = |z: f64| {
        (0..n).map(move |k| {
            let (sin, cos) = libm::sincos(2.0 * std::f64::consts::PI * f64::from(k) / f64::from(n));
            link_from_cylinder * Point3::new(radius * cos, radius * sin, z)
        })
    };
    let ends = [-half, half].map(|z| link_from_cylinder * Point3::new(0.0, 0.0, z));
    let vertices: Vec<Point3<f64>> = ring(-half).chain(ring(half)).chain(ends).collect();
    let triangles = (0..n).flat_map(|k| {
        let next = (k + 1) % n;
        [[k, next, n + next], [k, n + next, n + k], [2 * n, next, k], [2 * n + 1, n + k, n + next]]
    });
    let triangles = triangles.collect();
    (vertices, triangles)
}
