//! How the triangles of a mesh hang together.

use std::collections::BTreeMap;

/// How the triangles of a mesh hang together: its edges, each with the triangles that meet there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshTopology {
    triangles: Vec<[u32; 3]>,
    edges: Vec<MeshEdge>,
    /// For every edge and each of its triangles twice the triangle's number, one more where the triangle runs along
    /// the edge backwards.
    sides: Vec<[u32; 2]>,
    vertices: usize,
}

/// An edge and up to two triangles; more at one edge make several entries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshEdge {
    /// Vertices, the smaller first.
    pub ends: [u32; 2],
    /// Triangles; the number of triangles where there is none.
    pub triangles: [u32; 2],
}

impl MeshTopology {
    /// Of a mesh; triangles with a vertex beyond `vertices` are left out.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let sound = |triangle: &&[u32; 3]| triangle.iter().all(|corner| (*corner as usize) < vertices);
        let triangles: Vec<[u32; 3]> = triangles.iter().filter(sound).copied().collect();
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

    /// Its edges.
    #[doc(hidden)]
    #[inline]
    pub fn edges(&self) -> &[MeshEdge] {
        &self.edges
    }

    /// Its triangles.
    #[doc(hidden)]
    #[inline]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Which sides of triangles lie at every edge: twice a triangle's number, one more where it runs along the edge
    /// backwards; twice the number of triangles where there is none.
    pub(super) fn sides(&self) -> &[[u32; 2]] {
        &self.sides
    }

    /// How many vertices the mesh has.
    pub(super) fn vertices(&self) -> usize {
        self.vertices
    }
}
