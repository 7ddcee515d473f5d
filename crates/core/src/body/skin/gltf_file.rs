//! Reads glTF 2.0 (`.gltf`, `.glb`, `.vrm`): all meshes moved by the joints of one figure become one skin, with its
//! joints and weights. If the file has a default scene, only its contents are read.
//!
//! glTF has Y up and metres; bodies face +Z. The mesh is read in its bind pose: `v = sum_i w_i T_i B_i v0` with the
//! joints' transforms `T_i` in that pose and the inverse bind matrices `B_i`. Joints become body segments by their
//! place in the body; fingers and other joints without a segment belong to the nearest joint above them that has one.
//! The landmarks that bind the skin to a body are the origins of the joints.

use std::collections::BTreeMap;

use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Semantic;
use nalgebra::{Point3, Vector3, Vector4};

use super::gltf_document::GltfFile;
use super::gltf_figure::{Figure, SkinJoint, forward};
use super::gltf_numbers::{Buffers, rows};
use super::mesh::{MOST_TRIANGLES, MOST_VERTICES, SUM_TOLERANCE, SkinError, SkinMesh};
use crate::input::excerpt;

/// Greatest number of meshes named in a message.
const MOST_NAMED: usize = 8;
/// Greatest number of sets of four joints of a vertex, and of morph targets of a mesh.
const MOST_SETS: u32 = 8;
const MOST_TARGETS: usize = 1_000;

/// Parses a file; `read` returns the contents of referenced buffer files. `joint_map` says which joints are landmarks;
/// the others are found.
pub(super) fn parse(
    file: &str,
    bytes: &[u8],
    joint_map: &BTreeMap<String, String>,
    read: &dyn Fn(&str) -> Result<Vec<u8>, SkinError>,
) -> Result<SkinMesh, SkinError> {
    let malformed = |detail: String| SkinError::Malformed { file: file.to_owned(), detail };
    let gltf = GltfFile::open(file, bytes, read)?;
    let (shown, hidden): (Vec<gltf::Node<'_>>, Vec<_>) = with_meshes(&gltf.document);
    let (skinned, bare): (Vec<_>, Vec<_>) = shown.into_iter().partition(|node| node.skin().is_some());
    if skinned.is_empty() {
        let place = if gltf.document.default_scene().is_some() { " in its default scene" } else { "" };
        return Err(malformed(format!(
            "expected a node with a mesh and a skin{place}, found none; export the mesh with its armature"
        )));
    }
    let figure = Figure::of(&gltf, &skinned, joint_map).map_err(malformed)?;
    let mut read = ReadMesh::default();
    for node in &skinned {
        let own = node.skin().and_then(|skin| figure.of_skins.get(&skin.index())).map_or(&[][..], Vec::as_slice);
        let Some(mesh) = node.mesh() else { continue };
        let morphs = node.weights().or(mesh.weights()).unwrap_or_default();
        for primitive in mesh.primitives() {
            read.add(&primitive, &gltf.buffers, own, morphs)
                .map_err(|detail| malformed(format!("{}: {detail}", name_of(node))))?;
        }
    }
    let mut notes = figure.notes.clone();
    notes.extend(left_out(&bare, "no joint moves them (they have no skin)"));
    notes.extend(left_out(&hidden, "they are not in the default scene"));
    if read.normalised > 0 {
        let (number, sum) = (read.normalised, read.farthest_sum);
        notes.push(format!("the weights of {number} vertices were normalised; they summed up to {sum:.3}, not to 1"));
    }
    if read.is_morphed {
        notes.push("the default weights of its morph targets are applied".to_owned());
    }
    let mesh = SkinMesh {
        name: std::path::Path::new(file).file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        vertices: read.vertices,
        triangles: read.triangles,
        weights: Some(read.weights.into_iter().map(|(name, own)| (name, own.into_iter().collect())).collect()),
        landmarks: BTreeMap::new(),
        joint_map: figure.joint_map.clone(),
        notes,
    };
    let mut mesh = mesh.checked(file)?;
    mesh.landmarks = figure.landmarks(&mesh).map_err(malformed)?;
    mesh.checked(file)
}

/// Name of a mesh in messages: its node's name, else its own, else its index.
fn name_of(node: &gltf::Node<'_>) -> String {
    let mesh = node.mesh();
    let name = node.name().or_else(|| mesh.as_ref().and_then(gltf::Mesh::name));
    let number = mesh.as_ref().map_or(0, gltf::Mesh::index);
    name.map_or_else(|| format!("mesh {number}"), |name| format!("mesh `{}`", excerpt(name)))
}

/// The names of meshes, abbreviated if there are many.
pub(super) fn names_of<'a>(nodes: impl Iterator<Item = &'a gltf::Node<'a>>) -> String {
    let mut names: Vec<String> = nodes.map(name_of).collect();
    let more = names.len().saturating_sub(MOST_NAMED);
    names.truncate(MOST_NAMED);
    if more > 0 {
        names.push(format!("{more} more"));
    }
    names.join(", ")
}

/// The nodes with meshes: those shown by the default scene, and the others. Without a default scene all are shown.
fn with_meshes(document: &gltf::Document) -> (Vec<gltf::Node<'_>>, Vec<gltf::Node<'_>>) {
    let mut is_shown = vec![document.default_scene().is_none(); document.nodes().len()];
    let mut waiting: Vec<gltf::Node<'_>> = document.default_scene().into_iter().flat_map(|own| own.nodes()).collect();
    while let Some(node) = waiting.pop() {
        if !std::mem::replace(&mut is_shown[node.index()], true) {
            waiting.extend(node.children());
        }
    }
    document.nodes().filter(|node| node.mesh().is_some()).partition(|node| is_shown[node.index()])
}

/// A note on omitted meshes with the reason.
fn left_out(nodes: &[gltf::Node<'_>], why: &str) -> Option<String> {
    (!nodes.is_empty()).then(|| format!("meshes left out because {why}: {}", names_of(nodes.iter())))
}

#[derive(Default)]
struct ReadMesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// Weights of vertices, by segment.
    weights: BTreeMap<String, BTreeMap<u32, f64>>,
    /// Vertices whose weights did not sum to 1, and the sum that was farthest from it.
    normalised: usize,
    farthest_sum: f64,
    is_morphed: bool,
}

impl ReadMesh {
    fn add(
        &mut self,
        primitive: &gltf::Primitive<'_>,
        buffers: &Buffers,
        joints: &[SkinJoint],
        morphs: &[f32],
    ) -> Result<(), String> {
        if primitive.mode() != gltf::mesh::Mode::Triangles {
            return Err(format!("expected triangles, found {:?}", primitive.mode()));
        }
        let positions = self.positions(primitive, buffers, morphs)?;
        let influences = influences(primitive, buffers, positions.len())?;
        let first = self.vertices.len() as u32;
        let mut is_mirrored = Vec::with_capacity(positions.len());
        for (index, (place, mut influences)) in positions.iter().zip(influences).enumerate() {
            let vertex = first + index as u32;
            let sum: f64 = influences.iter().map(|(_, share)| share).sum();
            // nearly all files are rounded; what is off by more is noted
            if sum > 0.0 && (sum - 1.0).abs() > SUM_TOLERANCE && influences.iter().all(|(_, share)| *share >= 0.0) {
                influences.iter_mut().for_each(|(_, share)| *share /= sum);
                self.normalised += 1;
                if (sum - 1.0).abs() > (self.farthest_sum - 1.0).abs() || self.normalised == 1 {
                    self.farthest_sum = sum;
                }
            }
            let (mut posed, mut enlarged, mut sum) = (Vector4::zeros(), 0.0, 0.0);
            for (carrier, share) in influences {
                let joint = joints.get(carrier).ok_or_else(|| {
                    format!("vertex {vertex} has joint {carrier}; the skin has {}, from 0", joints.len())
                })?;
                posed += joint.place_from_mesh * place.to_homogeneous() * share;
                enlarged += joint.place_from_mesh.fixed_view::<3, 3>(0, 0).determinant() * share;
                *self.weights.entry(joint.segment.clone()).or_default().entry(vertex).or_default() += share;
                sum += share;
            }
            is_mirrored.push(enlarged < 0.0);
            self.vertices.push(if sum > 0.0 { forward(posed.xyz() / sum) } else { forward(place.coords) });
        }
        let indices: Vec<u32> = match primitive.indices() {
            Some(accessor) => {
                let types = [DataType::U8, DataType::U16, DataType::U32];
                let most = 3 * MOST_TRIANGLES.saturating_sub(self.triangles.len());
                let single: Vec<[f64; 1]> = rows(&accessor, buffers, (&types, Dimensions::Scalar), most)?;
                single.iter().map(|[index]| *index as u32).collect()
            }
            None => (0..positions.len() as u32).collect(),
        };
        if !indices.len().is_multiple_of(3) {
            return Err(format!("{} corners; expected three for each triangle", indices.len()));
        }
        let corner = |index: u32| index.checked_add(first).ok_or_else(|| "an index is too large".to_owned());
        for triple in indices.as_chunks::<3>().0 {
            let mut triangle = [corner(triple[0])?, corner(triple[1])?, corner(triple[2])?];
            // a part that its joints mirror would be inside out
            if is_mirrored.get(triple[0] as usize) == Some(&true) {
                triangle.swap(1, 2);
            }
            self.triangles.push(triangle);
        }
        Ok(())
    }

    /// The vertices of a primitive, moved by its morph targets.
    fn positions(
        &mut self,
        primitive: &gltf::Primitive<'_>,
        buffers: &Buffers,
        morphs: &[f32],
    ) -> Result<Vec<Point3<f64>>, String> {
        // integers: KHR_mesh_quantization
        let types = [DataType::F32, DataType::I8, DataType::U8, DataType::I16, DataType::U16];
        let spare = MOST_VERTICES.saturating_sub(self.vertices.len());
        let accessor = primitive.get(&Semantic::Positions).ok_or("the mesh has no POSITION")?;
        let places: Vec<[f64; 3]> = rows(&accessor, buffers, (&types, Dimensions::Vec3), spare)?;
        let mut places: Vec<Point3<f64>> = places.into_iter().map(Point3::from).collect();
        for (target, weight) in primitive.morph_targets().zip(morphs).take(MOST_TARGETS) {
            let Some(accessor) = target.positions().filter(|_| *weight != 0.0) else { continue };
            let offsets: Vec<[f64; 3]> = rows(&accessor, buffers, (&types, Dimensions::Vec3), spare)?;
            if offsets.len() != places.len() {
                return Err(format!("{} vertices and {} in a morph target", places.len(), offsets.len()));
            }
            for (place, offset) in places.iter_mut().zip(offsets) {
                *place += Vector3::from(offset) * f64::from(*weight);
            }
            self.is_morphed = true;
        }
        Ok(places)
    }
}

/// For every vertex the joints that move it, as indices into the skin's, and their weights other than zero.
fn influences(
    primitive: &gltf::Primitive<'_>,
    buffers: &Buffers,
    vertices: usize,
) -> Result<Vec<Vec<(usize, f64)>>, String> {
    let mut all: Vec<Vec<(usize, f64)>> = vec![Vec::new(); vertices];
    let small = [DataType::U8, DataType::U16];
    let shares = [DataType::F32, DataType::U8, DataType::U16];
    for set in 0..MOST_SETS {
        let (joints, weights) = (primitive.get(&Semantic::Joints(set)), primitive.get(&Semantic::Weights(set)));
        let (joints, weights) = match (joints, weights) {
            (Some(joints), Some(weights)) => (joints, weights),
            (None, None) if set > 0 => break,
            (None, _) => return Err(format!("the mesh has no JOINTS_{set}; export it with skinning")),
            (_, None) => return Err(format!("the mesh has no WEIGHTS_{set}; export it with skinning")),
        };
        let joints: Vec<[f64; 4]> = rows(&joints, buffers, (&small, Dimensions::Vec4), MOST_VERTICES)?;
        let weights: Vec<[f64; 4]> = rows(&weights, buffers, (&shares, Dimensions::Vec4), MOST_VERTICES)?;
        if joints.len() != vertices || weights.len() != vertices {
            let (joints, weights) = (joints.len(), weights.len());
            return Err(format!("{vertices} positions, {joints} joints and {weights} weights; expected equal numbers"));
        }
        for (own, (joints, weights)) in all.iter_mut().zip(joints.iter().zip(&weights)) {
            let pairs = joints.iter().zip(weights).filter(|(_, share)| **share != 0.0);
            own.extend(pairs.map(|(joint, share)| (*joint as usize, *share)));
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests;
