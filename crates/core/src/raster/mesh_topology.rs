//! Adjacency of a mesh's triangles.

use std::collections::BTreeMap;

/// Adjacency of a mesh's triangles: its edges, each with its triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshTopology {
    triangles: Vec<[u32; 3]>,
    edges: Vec<MeshEdge>,
    /// For every edge, two entries, one per triangle: twice the triangle's number, plus one if the triangle runs along
    /// the edge backwards.
    sides: Vec<[u32; 2]>,
    vertices: usize,
}

/// An edge and up to two triangles; an edge with more triangles has several entries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshEdge {
    /// Vertex indices, the smaller first.
    pub ends: [u32; 2],
    /// Triangle indices; the number of triangles for a missing one.
    pub triangles: [u32; 2],
}

impl MeshTopology {
    /// The topology of a mesh; triangles with an index of `vertices` or more are left out.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let valid = |triangle: &&[u32; 3]| triangle.iter().all(|corner| (*corner as usize) < vertices);
        let triangles: Vec<[u32; 3]> = triangles.iter().filter(valid).copied().collect();
        let none = triangles.len() as u32;
        let mut edges: Vec<MeshEdge> = Vec::with_capacity(triangles.len() * 3 / 2 + 1);
        let mut sides: Vec<[u32; 2]> = Vec::with_capacity(edges.capacity());
        let mut open: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        for (number, triangle) in (0_u32..).zip(&triangles) {
            for corner in 0..3 {
                let (from, to) = (triangle[corner], triangle[(corner + 1) % 3]);
                let (ends, side) = if from < to { ([from, to], 2 * number) } else { ([to, from], 2 * number + 1) };
                match open.remove(&ends) {
                    Some(place) => {
                        edges[place].triangles[1] = number;
                        sides[place][1] = side;
                    }
                    None => {
                        open.insert(ends, edges.len());
                        edges.push(MeshEdge { ends, triangles: [number, none] });
                        sides.push([side, 2 * none]);
                    }
                }
            }
        }
        Self { triangles, edges, sides, vertices }
    }

    #[doc(hidden)]
    #[inline]
    pub fn edges(&self) -> &[MeshEdge] {
        &self.edges
    }

    #[doc(hidden)]
    #[inline]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The sides of triangles at every edge: twice a triangle's number, plus one if it runs along the edge backwards;
    /// twice the number of triangles for a missing one.
    pub(super) fn sides(&self) -> &[[u32; 2]] {
        &self.sides
    }

    pub(super) fn vertices(&self) -> usize {
        self.vertices
    }
}
