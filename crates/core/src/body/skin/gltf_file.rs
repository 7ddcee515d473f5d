//! Reads glTF 2.0 (`.gltf`, `.glb`): all meshes moved by the joints of one figure become one skin, with its joints and
//! weights. If the file has a default scene, only its contents are read. The `gltf` crate parses and validates the
//! document.
//!
//! glTF has Y up and metres; bodies face +Z. The mesh is read in the pose of its nodes, as programs show the file
//! without an animation: `v = sum_i w_i T_i B_i v0` with the nodes' `T_i` and the inverse bind matrices `B_i`. Joints
//! become body segments by their names; fingers and other joints without a segment belong to the nearest joint above
//! them that has one. The landmarks that bind the skin to a body are the origins of the joints.

use std::collections::{BTreeMap, BTreeSet};

use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Semantic;
use nalgebra::{Matrix4, Point3, Vector4};

use super::gltf_numbers::{Buffers, rows};
use super::gltf_tree::NodeTree;
use super::joint_names::{ORIGINS, Vocabulary};
use super::mesh::{MOST_TRIANGLES, MOST_VERTICES, SkinError, SkinMesh};
use crate::input::{excerpt, foreign, unquoted};

/// Greatest number of joints of a skin.
const MOST_JOINTS: usize = 10_000;
/// Greatest number of skins of a figure: one per garment.
const MOST_SKINS: usize = 100;
/// Greatest number of meshes named in a message.
const MOST_NAMED: usize = 8;
/// Greatest number of nodes in a file.
const MOST_NODES: usize = 1_000_000;
/// Accepted heights from ankle to crown, metres: rejects files in centimetres.
const HEIGHTS: std::ops::RangeInclusive<f64> = 0.3..=3.0;

/// Parses a file; `read` returns the contents of referenced buffer files.
pub(super) fn parse(
    file: &str,
    bytes: &[u8],
    read: &dyn Fn(&str) -> Result<Vec<u8>, SkinError>,
) -> Result<SkinMesh, SkinError> {
    let malformed = |detail: String| SkinError::Malformed { file: file.to_owned(), detail };
    // the crate subtracts the header's length from the length that a .glb states
    let length = bytes.get(8..12).and_then(|own| own.first_chunk()).map_or(0, |own| u32::from_le_bytes(*own));
    if bytes.starts_with(b"glTF") && length < 12 {
        return Err(malformed("expected glTF 2.0, found a header without content".to_owned()));
    }
    let (document, blob) = document(bytes).map_err(|e| malformed(format!("expected glTF 2.0: {}", excerpt(&e))))?;
    if document.nodes().len() > MOST_NODES {
        return Err(malformed(format!("{} nodes; expected at most {MOST_NODES}", document.nodes().len())));
    }
    let buffers = buffers(file, &document, blob.as_deref(), read)?;
    let (shown, hidden): (Vec<gltf::Node<'_>>, Vec<_>) = with_meshes(&document);
    let (skinned, bare): (Vec<_>, Vec<_>) = shown.into_iter().partition(|node| node.skin().is_some());
    if skinned.is_empty() {
        let place = if document.default_scene().is_some() { " in its default scene" } else { "" };
        return Err(malformed(format!(
            "expected a node with a mesh and a skin{place}, found none; export the mesh with its armature"
        )));
    }
    let joints = FigureJoints::of(&document, &skinned, &buffers).map_err(malformed)?;
    let mut mesh = SkinMesh {
        name: std::path::Path::new(file).file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        vertices: Vec::new(),
        triangles: Vec::new(),
        weights: None,
        landmarks: BTreeMap::new(),
        notes: joints.notes.clone(),
    };
    mesh.notes.extend(left_out(&bare, "no joint moves them (they have no skin)"));
    mesh.notes.extend(left_out(&hidden, "they are not in the default scene"));
    let mut weights: BTreeMap<String, BTreeMap<u32, f64>> = BTreeMap::new();
    for node in &skinned {
        let own = node.skin().and_then(|skin| joints.of_skins.get(&skin.index())).map_or(&[][..], Vec::as_slice);
        for primitive in node.mesh().into_iter().flat_map(|own| own.primitives()) {
            add(&primitive, &buffers, own, &mut mesh, &mut weights)
                .map_err(|detail| malformed(format!("{}: {detail}", name_of(node))))?;
        }
    }
    mesh.weights = Some(weights.into_iter().map(|(name, own)| (name, own.into_iter().collect())).collect());
    let mut mesh = mesh.checked(file)?;
    mesh.landmarks = joints.landmarks(&mesh).map_err(malformed)?;
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
fn names_of<'a>(nodes: impl Iterator<Item = &'a gltf::Node<'a>>) -> String {
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

/// The validated document, and the binary chunk of a `.glb`.
fn document(bytes: &[u8]) -> Result<(gltf::Document, Option<Vec<u8>>), String> {
    let (text, blob) = if bytes.starts_with(b"glTF") {
        let glb = gltf::Glb::from_slice(bytes).map_err(foreign)?;
        (glb.json.into_owned(), glb.bin.map(std::borrow::Cow::into_owned))
    } else {
        (bytes.to_vec(), None)
    };
    let root: gltf::json::Root = gltf::json::deserialize::from_slice(&text).map_err(unquoted)?;
    // the validation looks up attributes without checking that they exist
    let attributes = root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|own| own.attributes.values());
    if let Some(astray) = attributes.map(|index| index.value()).find(|index| *index >= root.accessors.len()) {
        return Err(format!(
            "an attribute refers to accessor {astray}; expected 0 to {}",
            root.accessors.len().saturating_sub(1)
        ));
    }
    Ok((gltf::Document::from_json(root).map_err(foreign)?, blob))
}

/// The bytes of every buffer, from the file itself or from a separate file.
fn buffers(
    file: &str,
    document: &gltf::Document,
    blob: Option<&[u8]>,
    read: &dyn Fn(&str) -> Result<Vec<u8>, SkinError>,
) -> Result<Buffers, SkinError> {
    let malformed = |detail: String| SkinError::Malformed { file: file.to_owned(), detail };
    if document.buffers().len() > 16 {
        return Err(malformed(format!("{} buffers; expected at most 16", document.buffers().len())));
    }
    document.buffers().map(|buffer| buffer_bytes(file, &buffer, blob, read)).collect()
}

fn buffer_bytes(
    file: &str,
    buffer: &gltf::Buffer<'_>,
    blob: Option<&[u8]>,
    read: &dyn Fn(&str) -> Result<Vec<u8>, SkinError>,
) -> Result<Vec<u8>, SkinError> {
    let malformed = |detail: String| SkinError::Malformed { file: file.to_owned(), detail };
    let bytes = match buffer.source() {
        gltf::buffer::Source::Bin => {
            blob.map(<[u8]>::to_vec).ok_or_else(|| malformed("the binary chunk is missing".to_owned()))?
        }
        gltf::buffer::Source::Uri(uri) if uri.starts_with("data:") => {
            return Err(malformed("buffers embedded as text (data:) are not supported; save it as .glb".to_owned()));
        }
        gltf::buffer::Source::Uri(uri) if uri.contains(':') => {
            let uri = excerpt(uri);
            return Err(malformed(format!(
                "buffer `{uri}` is outside the file's folder; expected a file in its own folder or below"
            )));
        }
        gltf::buffer::Source::Uri(uri) => read(&decoded(uri))?,
    };
    if bytes.len() < buffer.length() {
        let (found, expected) = (bytes.len(), buffer.length());
        return Err(malformed(format!("buffer {}: expected {expected} bytes, found {found}", buffer.index())));
    }
    Ok(bytes)
}

/// Decodes percent-encoding (`%20`) in a URI; returned unchanged if the result is not valid text.
fn decoded(uri: &str) -> String {
    let (mut bytes, mut rest) = (Vec::with_capacity(uri.len()), uri.as_bytes());
    while let [first, tail @ ..] = rest {
        let digit = |at: usize| tail.get(at).and_then(|byte| char::from(*byte).to_digit(16));
        match (*first, digit(0), digit(1)) {
            (b'%', Some(high), Some(low)) => {
                bytes.push((16 * high + low) as u8);
                rest = &tail[2..];
            }
            _ => {
                bytes.push(*first);
                rest = tail;
            }
        }
    }
    String::from_utf8(bytes).unwrap_or_else(|_| uri.to_owned())
}

/// Adds the vertices, triangles and weights of a primitive.
fn add(
    primitive: &gltf::Primitive<'_>,
    buffers: &Buffers,
    joints: &[SkinJoint],
    mesh: &mut SkinMesh,
    weights: &mut BTreeMap<String, BTreeMap<u32, f64>>,
) -> Result<(), String> {
    if primitive.mode() != gltf::mesh::Mode::Triangles {
        return Err(format!("expected triangles, found {:?}", primitive.mode()));
    }
    if primitive.get(&Semantic::Joints(1)).is_some() {
        return Err("more than four joints per vertex (JOINTS_1); limit them to four when exporting".to_owned());
    }
    let of = |semantic: Semantic, name: &str| {
        primitive.get(&semantic).ok_or_else(|| format!("the mesh has no {name}; export it with skinning"))
    };
    let spare = MOST_VERTICES.saturating_sub(mesh.vertices.len());
    let positions: Vec<[f64; 3]> =
        rows(&of(Semantic::Positions, "POSITION")?, buffers, (&[DataType::F32], Dimensions::Vec3), spare)?;
    let small = [DataType::U8, DataType::U16];
    let carriers: Vec<[f64; 4]> =
        rows(&of(Semantic::Joints(0), "JOINTS_0")?, buffers, (&small, Dimensions::Vec4), spare)?;
    let shares = [DataType::F32, DataType::U8, DataType::U16];
    let shares: Vec<[f64; 4]> =
        rows(&of(Semantic::Weights(0), "WEIGHTS_0")?, buffers, (&shares, Dimensions::Vec4), spare)?;
    if carriers.len() != positions.len() || shares.len() != positions.len() {
        let (a, b, c) = (positions.len(), carriers.len(), shares.len());
        return Err(format!("{a} positions, {b} joints and {c} weights; expected equal numbers"));
    }
    let first = mesh.vertices.len() as u32;
    let places: Vec<Point3<f64>> = positions.iter().map(|place| Point3::from(*place)).collect();
    for (index, (place, (carriers, shares))) in places.iter().zip(carriers.iter().zip(&shares)).enumerate() {
        let vertex = first + index as u32;
        let mut posed = Vector4::zeros();
        for (carrier, share) in carriers.iter().zip(shares).filter(|(_, share)| **share != 0.0) {
            let joint = joints
                .get(*carrier as usize)
                .ok_or_else(|| format!("vertex {vertex} has joint {carrier}; the skin has {}, from 0", joints.len()))?;
            posed += joint.place_from_mesh * place.to_homogeneous() * *share;
            *weights.entry(joint.segment.clone()).or_default().entry(vertex).or_default() += share;
        }
        let sum: f64 = shares.iter().sum();
        mesh.vertices.push(if sum > 0.0 { forward(posed.xyz() / sum) } else { forward(place.coords) });
    }
    let indices: Vec<u32> = match primitive.indices() {
        Some(accessor) => {
            let types = [DataType::U8, DataType::U16, DataType::U32];
            let most = 3 * MOST_TRIANGLES.saturating_sub(mesh.triangles.len());
            let single: Vec<[f64; 1]> = rows(&accessor, buffers, (&types, Dimensions::Scalar), most)?;
            single.iter().map(|[index]| *index as u32).collect()
        }
        None => (0..positions.len() as u32).collect(),
    };
    let corner = |index: u32| index.checked_add(first).ok_or_else(|| "an index is too large".to_owned());
    for triple in indices.as_chunks::<3>().0 {
        mesh.triangles.push([corner(triple[0])?, corner(triple[1])?, corner(triple[2])?]);
    }
    Ok(())
}

/// Converts from Y up and facing +Z to X forward, Y left, Z up.
fn forward(place: nalgebra::Vector3<f64>) -> Point3<f64> {
    Point3::new(place.z, place.x, place.y)
}

/// A joint of a skin.
struct SkinJoint {
    /// Its body segment.
    segment: String,
    /// Transform from the mesh's own frame to the joint's posed position.
    place_from_mesh: Matrix4<f64>,
}

/// The joints of all skins of one figure.
struct FigureJoints {
    /// For every skin, by its index, its joints by their index in it.
    of_skins: BTreeMap<usize, Vec<SkinJoint>>,
    /// Origins of the joints that begin a segment.
    origins: BTreeMap<String, Point3<f64>>,
    names: Vec<String>,
    notes: Vec<String>,
}

impl FigureJoints {
    /// The joints of these nodes' skins, which must belong to one skeleton.
    fn of(document: &gltf::Document, skinned: &[gltf::Node<'_>], buffers: &Buffers) -> Result<Self, String> {
        let skins: BTreeMap<usize, gltf::Skin<'_>> =
            skinned.iter().filter_map(|node| node.skin()).map(|skin| (skin.index(), skin)).collect();
        if skins.len() > MOST_SKINS {
            return Err(format!("{} skins; expected at most {MOST_SKINS}", skins.len()));
        }
        let mut names: BTreeMap<usize, String> = BTreeMap::new();
        let mut nodes: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut order = Vec::new();
        for (index, skin) in &skins {
            for joint in skin.joints().take(MOST_JOINTS + 1) {
                nodes.entry(*index).or_default().push(joint.index());
                let name = || joint.name().unwrap_or_default().to_owned();
                if let std::collections::btree_map::Entry::Vacant(new) = names.entry(joint.index()) {
                    new.insert(name());
                    order.push(joint.index());
                }
            }
            if nodes.get(index).map_or(0, Vec::len) > MOST_JOINTS {
                return Err(format!("a skin has more than {MOST_JOINTS} joints"));
            }
        }
        let tree = NodeTree::of(document)?;
        let vocabulary = Vocabulary::of(names.values().map(String::as_str));
        check_one_figure(document, skinned, &nodes, &tree, vocabulary)?;
        let own: BTreeMap<usize, String> =
            names.iter().filter_map(|(node, name)| Some((*node, vocabulary.segment(name)?))).collect();
        let mut joints =
            Self { of_skins: BTreeMap::new(), origins: BTreeMap::new(), names: Vec::new(), notes: Vec::new() };
        let mut unknown = Vec::new();
        for node in &order {
            let name = names.get(node).map_or("", String::as_str);
            match own.get(node) {
                Some(segment) => {
                    let origin = forward(tree.world(*node).column(3).xyz());
                    joints.origins.entry(segment.clone()).or_insert(origin);
                }
                None => unknown.push(excerpt(name)),
            }
            joints.names.push(name.to_owned());
        }
        let segments = tree.nearest_segments(&own);
        for (index, skin) in &skins {
            let nodes = nodes.get(index).map_or(&[][..], Vec::as_slice);
            let inverse = inverse_bind_matrices(skin, buffers, nodes.len())?;
            let joint = |(node, inverse): (&usize, &[f64; 16])| SkinJoint {
                segment: segments.get(*node).copied().flatten().unwrap_or("pelvis").to_owned(),
                place_from_mesh: tree.world(*node) * Matrix4::from_column_slice(inverse),
            };
            joints.of_skins.insert(*index, nodes.iter().zip(&inverse).map(joint).collect());
        }
        if !unknown.is_empty() {
            let unknown = excerpt(&unknown.join(", "));
            joints.notes.push(format!("joints that move with the nearest known joint above them: {unknown}"));
        }
        Ok(joints)
    }

    /// Positions of the body's landmarks.
    fn landmarks(&self, mesh: &SkinMesh) -> Result<BTreeMap<String, Point3<f64>>, String> {
        let mut landmarks = BTreeMap::new();
        let mut missing = Vec::new();
        for side in ["left", "right"] {
            for (landmark, segment) in ORIGINS {
                match self.origins.get(&format!("{side}_{segment}")) {
                    Some(origin) => drop(landmarks.insert(format!("{side}_{landmark}"), *origin)),
                    None if landmark == "toes" => {}
                    None => missing.push(format!("{side} {landmark}")),
                }
            }
        }
        if let (Some(left), Some(right)) = (landmarks.get("left_hip"), landmarks.get("right_hip")) {
            landmarks.insert("pelvis".to_owned(), nalgebra::center(left, right));
        }
        match self.origins.get("neck").or(self.origins.get("head")) {
            Some(neck) => drop(landmarks.insert("thorax".to_owned(), *neck)),
            None => missing.push("neck".to_owned()),
        }
        let head = mesh.weights.as_ref().and_then(|weights| weights.get("head").or(weights.get("neck")));
        let of_head = head.into_iter().flatten().filter(|(_, share)| *share > 0.5);
        let tops = of_head.filter_map(|(vertex, _)| mesh.vertices.get(*vertex as usize));
        match tops.max_by(|a, b| a.z.total_cmp(&b.z)) {
            Some(top) => {
                let middle = self.origins.get("head").map_or(*top, |head| Point3::new(head.x, head.y, top.z));
                landmarks.insert("head_top".to_owned(), middle);
            }
            None if self.origins.contains_key("head") => {}
            None => missing.push("head".to_owned()),
        }
        if !missing.is_empty() {
            let names = excerpt(&self.names.join(", "));
            return Err(format!(
                "no joint is recognised as {}; its joints are: {names}; rename them as Mixamo, Unreal or CMU do, or \
                 export the mesh as OBJ and define its landmarks in a .toml",
                missing.join(", ")
            ));
        }
        let Some(crown) = landmarks.get("head_top") else {
            return Err("the head joint is recognised, but no vertex has more than half of its weight there, so the \
            position of the crown is unknown; give the head its weights, or export the mesh as OBJ and define \
            its landmarks in a .toml"
                .to_owned());
        };
        let height = crown.z - landmarks["left_ankle"].z.min(landmarks["right_ankle"].z);
        if !HEIGHTS.contains(&height) {
            return Err(format!(
                "the body measures {height:.3} m from ankle to crown along Y; expected {} to {}: glTF uses metres with Y up",
                HEIGHTS.start(),
                HEIGHTS.end()
            ));
        }
        Ok(landmarks)
    }
}

/// The inverse bind matrices of a skin with this many joints.
fn inverse_bind_matrices(skin: &gltf::Skin<'_>, buffers: &Buffers, joints: usize) -> Result<Vec<[f64; 16]>, String> {
    let inverse: Vec<[f64; 16]> = match skin.inverse_bind_matrices() {
        Some(accessor) => rows(&accessor, buffers, (&[DataType::F32], Dimensions::Mat4), MOST_JOINTS)?,
        None => vec![std::array::from_fn(|i| f64::from(u8::from(i % 5 == 0))); joints],
    };
    if inverse.len() == joints {
        Ok(inverse)
    } else {
        Err(format!("{joints} joints and {} inverse bind matrices; expected equal numbers", inverse.len()))
    }
}

/// Refuses skins of several skeletons: `nodes` are the joints of every skin.
fn check_one_figure(
    document: &gltf::Document,
    skinned: &[gltf::Node<'_>],
    nodes: &BTreeMap<usize, Vec<usize>>,
    tree: &NodeTree,
    vocabulary: Vocabulary,
) -> Result<(), String> {
    let mut is_joint = vec![false; tree.count()];
    nodes.values().flatten().for_each(|node| is_joint[*node] = true);
    for node in document.nodes().filter(|node| node.name().is_some_and(|name| vocabulary.segment(name).is_some())) {
        is_joint[node.index()] = true;
    }
    let skeletons = tree.tops(&is_joint);
    let of_skin = |skin: usize| -> BTreeSet<usize> {
        nodes.get(&skin).into_iter().flatten().filter_map(|node| skeletons[*node]).collect()
    };
    let mut waiting: Vec<(usize, BTreeSet<usize>)> = nodes.keys().map(|skin| (*skin, of_skin(*skin))).collect();
    let first = skinned.iter().find_map(|node| node.skin()).map_or(0, |skin| skin.index());
    let mut figure = of_skin(first);
    let mut found = 0;
    while waiting.len() != found {
        found = waiting.len();
        waiting.retain(|(skin, own)| {
            let belongs = *skin == first || own.is_empty() || own.iter().any(|top| figure.contains(top));
            if belongs {
                figure.extend(own);
            }
            !belongs
        });
    }
    if waiting.is_empty() {
        return Ok(());
    }
    let is_other = |node: &&gltf::Node<'_>| {
        node.skin().is_some_and(|skin| waiting.iter().any(|(other, _)| *other == skin.index()))
    };
    Err(format!(
        "meshes of several skeletons: {}, and separately {}; expected one figure: export one of them",
        names_of(skinned.iter().filter(|node| !is_other(node))),
        names_of(skinned.iter().filter(is_other))
    ))
}

#[cfg(test)]
mod tests;
