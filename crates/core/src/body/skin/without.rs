//! A skin without the surface of some links.

use super::{MeshTopology, Skin};

impl Skin {
    /// The same skin without the triangles that links carry for the most part which are `gone`: one entry a link. It is
    /// open where they were.
    #[doc(hidden)]
    pub fn without_links(&self, gone: &[bool]) -> Self {
        let is_left = |triangle: usize| !gone.get(self.part_of(triangle) as usize).is_some_and(|gone| *gone);
        let triangles: Vec<[u32; 3]> =
            (0..self.triangles.len()).filter(|t| is_left(*t)).map(|t| self.triangles[t]).collect();
        let topology = MeshTopology::new(self.vertices.len(), &triangles);
        Self { triangles, topology, ..self.clone() }
    }
}
