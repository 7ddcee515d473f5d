//! Volume of a skin and its centre.

use nalgebra::{Point3, Vector3};

use super::Skin;
use crate::body::LinkFrames;

impl Skin {
    /// Volume inside the skin with the links at `frames`, cubic metres, and its centre, metres: the centre of mass of
    /// a body of uniform density. From the tetrahedra of all triangles with one point (`[Ericson 2005]`); gaps in the
    /// surface are closed as if by triangles to that point. `None` if the skin encloses no volume.
    pub fn volume(&self, frames: &LinkFrames) -> Option<(f64, Point3<f64>)> {
        let mut vertices = Vec::new();
        self.deform_into(frames, &mut vertices);
        let about = vertices.iter().map(|v| v.coords).sum::<Vector3<f64>>() / vertices.len().max(1) as f64;
        let (mut volume, mut moment) = (0.0, Vector3::zeros());
        for triangle in self.triangles() {
            let [a, b, c] = triangle.map(|corner| vertices[corner as usize].coords - about);
            let own = a.cross(&b).dot(&c) / 6.0;
            volume += own;
            moment += (a + b + c) * (0.25 * own);
        }
        // if the surface is inside out, the signs of all tetrahedra change alike
        (volume.abs() > 1e-9).then(|| (volume.abs(), Point3::from(about + moment / volume)))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::body::{Skin, SkinMesh, shipped};

    #[test]
    fn a_box_has_its_volume_and_its_centre_moves_with_the_link() {
        let corners = (0..8).map(|i| {
            let at = |bit: u32, size: f64| if i & bit > 0 { size } else { 0.0 };
            Point3::new(at(1, 0.2), at(2, 0.4), at(4, 0.6))
        });
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let weights = BTreeMap::from([("pelvis".to_owned(), (0..8).map(|vertex| (vertex, 1.0)).collect())]);
        let mesh = SkinMesh {
            name: "box".into(),
            vertices: corners.collect(),
            triangles,
            weights: Some(weights),
            ..SkinMesh::default()
        };
        let body = shipped("actor").unwrap();
        let frames = body.link_frames(&body.zero_pose());
        let skin = Skin::bound(&mesh, &body, &frames).unwrap();
        let mut pose = body.zero_pose();
        pose.world_from_root.translation.vector.x += 5.0;
        let (volume, centre) = skin.volume(&body.link_frames(&pose)).unwrap();
        assert!((volume - 0.048).abs() < 1e-12, "{volume}");
        assert!((centre - Point3::new(5.1, 0.2, 0.3)).norm() < 1e-12, "{centre}");
    }
}
