//! A surface that bends with the skeleton: skeletal subspace deformation, also called linear blend skinning
//! (`[Skinned APF]`, section 4; `[Lewis 2000]`).
//!
//! A vertex at `v0` in the bind pose, in which the mesh was modelled, is in another pose at `v = sum_i w_i T_i(pose)
//! T_i(bind)^-1 v0`: every link moves it rigidly, and the weighted mean of the resulting positions is used. Between
//! two links rotated by an angle `a` relative to each other, a ring of equally weighted vertices shrinks to `cos(a /
//! 2)` of its radius; blending dual quaternions instead ([`Blending::DualQuaternion`], `[Kavan 2007]`) keeps the
//! radius.
//!
//! [`SkinMesh`] is the mesh with its weights by name of a body segment, as in files; [`Skin`] is bound to a body.

mod automatic;
mod blend;
mod gltf_body;
mod gltf_document;
mod gltf_figure;
mod gltf_file;
mod gltf_motion;
mod gltf_numbers;
mod gltf_tree;
mod masses;
mod mesh;
mod recognised;
mod reshape;
mod segment_solids;
mod segments;
mod shipped;
mod skin_file;
mod volume;

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3};

use super::{Humanoid, LinkFrames};
use crate::raster::MeshTopology;

#[doc(hidden)]
pub use gltf_document::FBX_TO_GLB;
#[doc(hidden)]
pub use gltf_motion::{GltfMotion, MotionChoice, gltf_contents, gltf_motion};
pub use mesh::{SkinError, SkinMesh};
pub(super) use recognised::links_of_segments;
pub use shipped::{SHIPPED_SKINS, shipped_skin};
#[doc(hidden)]
pub use skin_file::{read_skin, skin_from_gltf};

/// Greatest number of influences kept per vertex; the smallest are dropped.
const MOST_INFLUENCES: usize = 4;

/// Method of blending the transforms of several links.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Blending {
    /// The mean of transformed points, as in most programs: joints collapse under large bends or twists.
    #[default]
    Linear,
    /// The normalised mean of the transforms as dual quaternions: no collapse, a slight bulge.
    DualQuaternion,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Influence {
    pub(crate) link: u32,
    /// Weight, in (0, 1]; those of a vertex sum to 1.
    pub(crate) weight: f64,
}

/// A skin bound to the links of a body.
#[derive(Clone, Debug)]
pub struct Skin {
    /// Its name.
    pub name: String,
    /// Method of blending.
    pub blending: Blending,
    /// Vertices in the bind pose, metres.
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// `influences[first[v] .. first[v + 1]]` are those of vertex `v`.
    first: Vec<u32>,
    influences: Vec<Influence>,
    /// `world_from_link` of every link of the body in the bind pose.
    bind: Vec<Isometry3<f64>>,
    /// For every influence the vertex in the link's frame times the weight, and the weight.
    terms: Vec<blend::SkinTerm>,
    /// Link with the greatest weight, for every vertex.
    parts: Vec<u32>,
    /// Link that carries every triangle.
    triangle_parts: Vec<u32>,
    topology: MeshTopology,
}

/// Skins are equal if they have the same surface, weights and bind pose; names are ignored.
impl PartialEq for Skin {
    fn eq(&self, other: &Self) -> bool {
        self.blending == other.blending
            && self.vertices == other.vertices
            && self.triangles == other.triangles
            && self.first == other.first
            && self.influences == other.influences
            && self.bind == other.bind
    }
}

impl Skin {
    /// Binds `mesh` to `body`, with the links at `bind` in the mesh's pose. A mesh without weights gets automatic
    /// ones, by distance to the solids of the body's links.
    pub fn bound(mesh: &SkinMesh, body: &Humanoid, bind: &LinkFrames) -> Result<Self, SkinError> {
        let influences = match &mesh.weights {
            Some(weights) => segments::of_links(weights, mesh, body)?,
            None => automatic::weights(body, bind, &mesh.vertices, &mesh.triangles)?,
        };
        Ok(Self::assemble(&mesh.name, mesh.vertices.clone(), mesh.triangles.clone(), &influences, bind.0.clone()))
    }

    /// Refuses a mesh with weights of segments that `body` does not have, before anything is fitted.
    #[doc(hidden)]
    pub fn check_segments(mesh: &SkinMesh, body: &Humanoid) -> Result<(), SkinError> {
        mesh.weights.as_ref().map_or(Ok(()), |weights| segments::check(weights, mesh, body))
    }

    /// Assembles a skin; `influences` has one list per vertex.
    fn assemble(
        name: &str,
        vertices: Vec<Point3<f64>>,
        triangles: Vec<[u32; 3]>,
        influences: &[Vec<Influence>],
        bind: Vec<Isometry3<f64>>,
    ) -> Self {
        let mut first = vec![0];
        first.extend(influences.iter().scan(0_u32, |sum, own| {
            *sum += own.len() as u32;
            Some(*sum)
        }));
        // of equal weights the first
        let greatest = |own: &Vec<Influence>| own.iter().rev().max_by(|a, b| a.weight.total_cmp(&b.weight)).copied();
        let parts: Vec<u32> =
            influences.iter().map(|own| greatest(own).map_or(0, |influence| influence.link)).collect();
        let triangle_parts = triangles.iter().map(|corners| carrier(*corners, &parts, influences)).collect();
        let topology = MeshTopology::new(vertices.len(), &triangles);
        let influences = influences.concat();
        let mut skin = Self {
            name: name.to_owned(),
            blending: Blending::default(),
            vertices,
            triangles,
            first,
            influences,
            bind,
            terms: Vec::new(),
            parts,
            triangle_parts,
            topology,
        };
        skin.terms = skin.bone_local();
        skin
    }

    /// Vertices in the bind pose, metres.
    #[inline]
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Triangles, as indices into the vertices.
    #[inline]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Links that influence a vertex, with their weights.
    #[inline]
    pub fn influences(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> {
        let own = self.first.get(vertex).zip(self.first.get(vertex + 1));
        let range = own.map_or(0..0, |(from, to)| *from as usize..*to as usize);
        self.influences[range].iter().map(|influence| (influence.link as usize, influence.weight))
    }

    /// `world_from_link` of every link in the bind pose.
    #[inline]
    pub fn bind(&self) -> &[Isometry3<f64>] {
        &self.bind
    }

    /// For every vertex the link with the greatest weight.
    #[inline]
    pub fn parts(&self) -> &[u32] {
        &self.parts
    }

    /// The link that carries a triangle: that of most of its corners, whatever their order.
    #[doc(hidden)]
    #[inline]
    pub fn part_of(&self, triangle: usize) -> u32 {
        self.triangle_parts[triangle]
    }

    /// Adjacency of its triangles.
    #[doc(hidden)]
    #[inline]
    pub fn topology(&self) -> &MeshTopology {
        &self.topology
    }

    /// The same skin with another blending.
    #[must_use]
    pub fn with_blending(mut self, blending: Blending) -> Self {
        self.blending = blending;
        self
    }
}

/// The link of most of a triangle's corners; if all three differ, the one with the greatest sum of weights over the
/// corners, and of equal sums the lowest. The first corner decided once: masses then changed when a mesh tool turned
/// the corners of a triangle.
fn carrier(corners: [u32; 3], parts: &[u32], influences: &[Vec<Influence>]) -> u32 {
    let [a, b, c] = corners.map(|corner| parts[corner as usize]);
    if a == b || a == c {
        return a;
    }
    if b == c {
        return b;
    }
    let mut sums: BTreeMap<u32, u64> = BTreeMap::new();
    for Influence { link, weight } in corners.iter().flat_map(|corner| &influences[*corner as usize]) {
        // whole numbers, so that sums neither depend on their order nor miss equality by rounding
        *sums.entry(*link).or_default() += (weight * 1e9).round() as u64;
    }
    let greatest = sums.values().copied().max();
    sums.into_iter().find(|(_, sum)| Some(*sum) == greatest).map_or(a, |(link, _)| link)
}

/// The parts of a skin, as stored in files of sets.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinParts {
    /// Its name.
    pub name: String,
    /// Method of blending.
    pub blending: Blending,
    /// Vertices in the bind pose, metres.
    pub vertices: Vec<Point3<f64>>,
    /// Triangles, as indices into the vertices.
    pub triangles: Vec<[u32; 3]>,
    /// For every vertex the links that influence it, with their weights.
    pub influences: Vec<Vec<(u32, f64)>>,
    /// `world_from_link` of every link in the bind pose.
    pub bind: Vec<Isometry3<f64>>,
}

impl Skin {
    /// The skin's parts.
    pub fn to_parts(&self) -> SkinParts {
        let of = |vertex: usize| self.influences(vertex).map(|(link, weight)| (link as u32, weight)).collect();
        SkinParts {
            name: self.name.clone(),
            blending: self.blending,
            vertices: self.vertices.clone(),
            triangles: self.triangles.clone(),
            influences: (0..self.vertices.len()).map(of).collect(),
            bind: self.bind.clone(),
        }
    }

    /// Assembles a skin on a body with `links` links.
    pub fn from_parts(parts: SkinParts, links: usize) -> Result<Self, String> {
        let SkinParts { name, blending, vertices, triangles, influences, bind } = parts;
        if vertices.len() > mesh::MOST_VERTICES || triangles.len() > mesh::MOST_TRIANGLES {
            return Err(format!("{} vertices and {} triangles are too many", vertices.len(), triangles.len()));
        }
        if influences.len() != vertices.len() || bind.len() != links {
            let (a, b, c) = (influences.len(), vertices.len(), bind.len());
            return Err(format!("{a} lists of weights for {b} vertices, {c} bind frames for {links} links"));
        }
        if !vertices.iter().flat_map(|v| v.iter()).all(|c| c.abs() <= 1e6) {
            return Err("a vertex is not within 1000 km of the origin".to_owned());
        }
        if triangles.as_flattened().iter().any(|corner| *corner as usize >= vertices.len()) {
            return Err("a triangle refers to a vertex that does not exist".to_owned());
        }
        for (vertex, own) in influences.iter().enumerate() {
            let sum: f64 = own.iter().map(|(_, weight)| weight).sum();
            let valid = own.iter().all(|(link, weight)| (*link as usize) < links && *weight > 0.0);
            if !(valid && (sum - 1.0).abs() < 1e-6 && own.len() <= MOST_INFLUENCES) {
                return Err(format!(
                    "the weights of vertex {vertex} are invalid; expected 1 to {MOST_INFLUENCES} links with weights that sum to 1"
                ));
            }
        }
        let influence =
            |own: Vec<(u32, f64)>| own.into_iter().map(|(link, weight)| Influence { link, weight }).collect();
        let influences: Vec<Vec<Influence>> = influences.into_iter().map(influence).collect();
        Ok(Self::assemble(&name, vertices, triangles, &influences, bind).with_blending(blending))
    }
}
