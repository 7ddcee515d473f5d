//! glTF 2.0 (`.gltf`, `.glb`): the meshes of the first skin, with its joints and weights, by the `gltf` crate.
//!
//! glTF has Y up and metres; bodies face +Z. Joints become body segments by their names (Mixamo, Biovision, CMU, Unreal
//! and others alike); fingers and other joints without a segment of their own belong to the nearest joint above that has
//! one. The landmarks that bind the skin to a body are the origins of the joints in the bind pose.

use std::collections::BTreeMap;

use gltf::mesh::util::{ReadJoints, ReadWeights};
use nalgebra::{Matrix4, Point3, Vector4};

use super::mesh::{MOST_TRIANGLES, MOST_VERTICES, SkinError, SkinMesh};
use crate::input::{excerpt, foreign};

/// Reads a file's bytes; `read` gives the bytes of buffers that it names.
pub(super) fn parse(
    file: &str,
    bytes: &[u8],
    read: &dyn Fn(&str) -> Result<Vec<u8>, SkinError>,
) -> Result<SkinMesh, SkinError> {
    let malformed = |detail: String| SkinError::Malformed { file: file.to_owned(), detail };
    let document =
        gltf::Gltf::from_slice(bytes).map_err(|e| malformed(format!("expected glTF 2.0: {}", foreign(e))))?;
    let buffers = buffers(file, &document, read)?;
    let skinned = document.nodes().find_map(|node| node.mesh().zip(node.skin()));
    let (_, skin) =
        skinned.ok_or_else(|| malformed("expected a node with a mesh and a skin, found none".to_owned()))?;
    let joints = Joints::of(&document, &skin, &buffers).map_err(malformed)?;
    let mut mesh = SkinMesh {
        name: std::path::Path::new(file).file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        vertices: Vec::new(),
        triangles: Vec::new(),
        weights: Some(BTreeMap::new()),
        landmarks: BTreeMap::new(),
        notes: Vec::new(),
    };
    let mut weights: BTreeMap<String, BTreeMap<u32, f64>> = BTreeMap::new();
    for node in document.nodes().filter(|node| node.skin().is_some_and(|own| own.index() == skin.index())) {
        for primitive in node.mesh().into_iter().flat_map(|own| own.primitives()) {
            add(&primitive, &buffers, &joints, &mut mesh, &mut weights).map_err(malformed)?;
        }
    }
    mesh.weights = Some(weights.into_iter().map(|(name, own)| (name, own.into_iter().collect())).collect());
    mesh.landmarks = joints.landmarks(&mesh);
    mesh.notes = joints.notes.clone();
    mesh.checked(file)
}

/// The bytes of every buffer: the file's own, or a file beside it.
fn buffers(
    file: &str,
    document: &gltf::Gltf,
    read: &dyn Fn(&str) -> Result<Vec<u8>, SkinError>,
) -> Result<Vec<Vec<u8>>, SkinError> {
    let malformed = |detail: String| SkinError::Malformed { file: file.to_owned(), detail };
    let of = |buffer: gltf::Buffer<'_>| {
        let bytes = match buffer.source() {
            gltf::buffer::Source::Bin => {
                document.blob.clone().ok_or_else(|| malformed("the binary chunk is missing".to_owned()))?
            }
            gltf::buffer::Source::Uri(uri) if uri.starts_with("data:") => {
                return Err(malformed("holds its buffers as text (data:); save it as .glb".to_owned()));
            }
            gltf::buffer::Source::Uri(uri) if uri.contains(':') => {
                let uri = excerpt(uri);
                return Err(malformed(format!("names the buffer `{uri}`; expected a file in its own folder or below")));
            }
            gltf::buffer::Source::Uri(uri) => read(uri)?,
        };
        if bytes.len() < buffer.length() {
            let (found, expected) = (bytes.len(), buffer.length());
            return Err(malformed(format!("buffer {}: expected {expected} bytes, found {found}", buffer.index())));
        }
        Ok(bytes)
    };
    document.buffers().map(of).collect()
}

/// Adds the vertices, triangles and weights of a primitive.
fn add(
    primitive: &gltf::Primitive<'_>,
    buffers: &[Vec<u8>],
    joints: &Joints,
    mesh: &mut SkinMesh,
    weights: &mut BTreeMap<String, BTreeMap<u32, f64>>,
) -> Result<(), String> {
    if primitive.mode() != gltf::mesh::Mode::Triangles {
        return Err(format!("expected triangles, found {:?}", primitive.mode()));
    }
    let counts = primitive.attributes().map(|(_, accessor)| accessor.count());
    let most = counts.chain(primitive.indices().map(|accessor| accessor.count() / 3)).max().unwrap_or(0);
    if most > MOST_VERTICES.max(MOST_TRIANGLES) {
        return Err(format!("a mesh of {most} vertices; expected at most {MOST_VERTICES}: decimate it"));
    }
    let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
    let first = u32::try_from(mesh.vertices.len()).map_err(|_| "too many vertices".to_owned())?;
    let positions: Vec<[f32; 3]> = reader.read_positions().ok_or("a mesh without positions")?.collect();
    let indices: Vec<u32> = match reader.read_indices() {
        Some(indices) => indices.into_u32().collect(),
        None => (0..positions.len() as u32).collect(),
    };
    let (Some(carriers), Some(shares)) = (reader.read_joints(0), reader.read_weights(0)) else {
        return Err("a mesh without joints and weights (JOINTS_0, WEIGHTS_0)".to_owned());
    };
    let carriers: Vec<[u16; 4]> = match carriers {
        ReadJoints::U8(own) => own.map(|four| four.map(u16::from)).collect(),
        ReadJoints::U16(own) => own.collect(),
    };
    let shares: Vec<[f32; 4]> = match shares {
        ReadWeights::F32(own) => own.collect(),
        other => other.into_f32().collect(),
    };
    if carriers.len() != positions.len() || shares.len() != positions.len() {
        let (a, b, c) = (positions.len(), carriers.len(), shares.len());
        return Err(format!("{a} positions, {b} joints and {c} weights; expected as many of each"));
    }
    for (vertex, (carriers, shares)) in (first..).zip(carriers.iter().zip(&shares)) {
        for (carrier, share) in carriers.iter().zip(shares).filter(|(_, share)| **share != 0.0) {
            let segment = joints.segments.get(usize::from(*carrier)).ok_or_else(|| {
                format!("vertex {vertex} has joint {carrier}; the skin has {}, from 0", joints.segments.len())
            })?;
            *weights.entry(segment.clone()).or_default().entry(vertex).or_default() += f64::from(*share);
        }
    }
    mesh.vertices.extend(positions.iter().map(|[x, y, z]| forward([f64::from(*x), f64::from(*y), f64::from(*z)])));
    let corner = |index: u32| index.checked_add(first).ok_or_else(|| "an index too large".to_owned());
    for triple in indices.as_chunks::<3>().0 {
        mesh.triangles.push([corner(triple[0])?, corner(triple[1])?, corner(triple[2])?]);
    }
    Ok(())
}

/// From Y up and facing +Z to X forward, Y left, Z up.
fn forward([x, y, z]: [f64; 3]) -> Point3<f64> {
    Point3::new(z, x, y)
}

/// The joints of a skin, by their number in it.
struct Joints {
    /// Body segment that each belongs to.
    segments: Vec<String>,
    /// Origin in the bind pose, of joints that begin a segment.
    origins: BTreeMap<String, Point3<f64>>,
    notes: Vec<String>,
}

impl Joints {
    fn of(document: &gltf::Gltf, skin: &gltf::Skin<'_>, buffers: &[Vec<u8>]) -> Result<Self, String> {
        let nodes: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
        let reader = skin.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
        let inverse: Vec<[[f32; 4]; 4]> =
            reader.read_inverse_bind_matrices().ok_or("a skin without inverse bind matrices")?.collect();
        if inverse.len() != nodes.len() {
            return Err(format!("{} joints and {} inverse bind matrices", nodes.len(), inverse.len()));
        }
        let parents: BTreeMap<usize, usize> =
            document.nodes().flat_map(|node| node.children().map(move |child| (child.index(), node.index()))).collect();
        let names: BTreeMap<usize, String> =
            skin.joints().map(|joint| (joint.index(), joint.name().unwrap_or_default().to_owned())).collect();
        let (mut segments, mut origins, mut unknown) = (Vec::new(), BTreeMap::new(), Vec::new());
        for (node, inverse) in nodes.iter().zip(&inverse) {
            let own = names.get(node).and_then(|name| segment_of(name));
            if let Some(segment) = &own {
                let matrix = Matrix4::from_fn(|row, column| f64::from(inverse[column][row]));
                let bind = matrix.try_inverse().ok_or("an inverse bind matrix that cannot be inverted")?;
                let origin = bind * Vector4::new(0.0, 0.0, 0.0, 1.0);
                origins.entry(segment.clone()).or_insert_with(|| forward([origin.x, origin.y, origin.z]));
            } else {
                unknown.push(names.get(node).map(|name| excerpt(name)).unwrap_or_default());
            }
            segments.push(own.or_else(|| above(*node, &parents, &names)).unwrap_or_else(|| "pelvis".to_owned()));
        }
        let notes = match unknown.as_slice() {
            [] => Vec::new(),
            unknown => vec![format!("joints that move with the one above them: {}", excerpt(&unknown.join(", ")))],
        };
        Ok(Self { segments, origins, notes })
    }

    /// Where the landmarks of a body are.
    fn landmarks(&self, mesh: &SkinMesh) -> BTreeMap<String, Point3<f64>> {
        let mut landmarks = BTreeMap::new();
        for side in ["left", "right"] {
            for (landmark, segment) in [
                ("shoulder", "upper_arm"),
                ("elbow", "forearm"),
                ("wrist", "hand"),
                ("hip", "thigh"),
                ("knee", "shank"),
                ("ankle", "foot"),
                ("toes", "toes"),
            ] {
                if let Some(origin) = self.origins.get(&format!("{side}_{segment}")) {
                    landmarks.insert(format!("{side}_{landmark}"), *origin);
                }
            }
        }
        if let (Some(left), Some(right)) = (landmarks.get("left_hip"), landmarks.get("right_hip")) {
            landmarks.insert("pelvis".to_owned(), nalgebra::center(left, right));
        }
        if let Some(neck) = self.origins.get("neck") {
            landmarks.insert("thorax".to_owned(), *neck);
        }
        let head = mesh.weights.as_ref().and_then(|weights| weights.get("head"));
        let of_head = head.into_iter().flatten().filter(|(_, share)| *share > 0.5);
        let tops = of_head.filter_map(|(vertex, _)| mesh.vertices.get(*vertex as usize));
        if let Some(top) = tops.max_by(|a, b| a.z.total_cmp(&b.z)) {
            let middle = self.origins.get("head").map_or(*top, |head| Point3::new(head.x, head.y, top.z));
            landmarks.insert("head_top".to_owned(), middle);
        }
        landmarks
    }
}

/// The segment of the nearest joint above that has one.
fn above(mut node: usize, parents: &BTreeMap<usize, usize>, names: &BTreeMap<usize, String>) -> Option<String> {
    // a broken file may have a circle
    for _ in 0..=parents.len() {
        node = *parents.get(&node)?;
        if let Some(segment) = names.get(&node).and_then(|name| segment_of(name)) {
            return Some(segment);
        }
    }
    None
}

/// The body segment that a joint's name says; `None` for fingers, tips and anything unknown.
fn segment_of(name: &str) -> Option<String> {
    let name = name.rsplit([':', '|']).next()?.to_ascii_lowercase();
    let name: String = name.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '_' || *c == '.').collect();
    let (side, part) = side_of(&name);
    let part: String = part.chars().filter(char::is_ascii_alphanumeric).collect();
    let segment = match (side, part.as_str()) {
        (None, "hips" | "pelvis" | "hip") => "pelvis",
        (None, "spine" | "spine01" | "abdomen" | "lowerback") => "abdomen",
        (
            None,
            "spine1" | "spine2" | "spine3" | "spine02" | "spine03" | "chest" | "upperchest" | "thorax" | "torso",
        ) => "thorax",
        (None, "neck" | "neck1" | "neck01") => "neck",
        (None, "head") => "head",
        (Some(_), "shoulder" | "clavicle" | "collar") => "clavicle",
        (Some(_), "arm" | "upperarm") => "upper_arm",
        (Some(_), "forearm" | "lowerarm") => "forearm",
        (Some(_), "hand" | "wrist") => "hand",
        (Some(_), "upleg" | "upperleg" | "thigh") => "thigh",
        (Some(_), "leg" | "lowerleg" | "shin" | "calf" | "shank") => "shank",
        (Some(_), "foot" | "ankle") => "foot",
        (Some(_), "toebase" | "toe" | "toes" | "ball") => "toes",
        _ => return None,
    };
    Some(side.map_or_else(|| segment.to_owned(), |side| format!("{side}_{segment}")))
}

/// Side and rest of a name in lower case: `leftarm`, `l_arm`, `arm.l`, `upperarm_l`.
fn side_of(name: &str) -> (Option<&'static str>, String) {
    for (word, letter) in [("left", "l"), ("right", "r")] {
        let ends = [format!("_{letter}"), format!(".{letter}")];
        let rest = name
            .strip_prefix(word)
            .or_else(|| name.strip_suffix(word))
            .or_else(|| name.strip_prefix(&format!("{letter}_")))
            .or_else(|| ends.iter().find_map(|end| name.strip_suffix(end.as_str())));
        if let Some(rest) = rest {
            return (Some(if word == "left" { "left" } else { "right" }), rest.to_owned());
        }
    }
    (None, name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_of_many_programs_become_segments_and_fingers_do_not() {
        for (name, segment) in [
            ("mixamorig:LeftUpLeg", "left_thigh"),
            ("mixamorig:Spine1", "thorax"),
            ("Hips", "pelvis"),
            ("RightForeArm", "right_forearm"),
            ("upperarm_l", "left_upper_arm"),
            ("calf_r", "right_shank"),
            ("LeftToeBase", "left_toes"),
            ("Thigh.R", "right_thigh"),
        ] {
            assert_eq!(segment_of(name).as_deref(), Some(segment), "{name}");
        }
        for name in ["mixamorig:LeftHandIndex1", "HeadTop_End", "Camera", ""] {
            assert_eq!(segment_of(name), None, "{name}");
        }
    }

    /// A triangle with one joint, as text, whose buffer is `uri`.
    fn text(uri: &str, length: usize) -> String {
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0, "skin": 0}}, {{"name": "Hips"}}],
            "skins": [{{"joints": [1], "inverseBindMatrices": 3}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}}}]}}],
            "buffers": [{{"uri": "{uri}", "byteLength": {length}}}],
            "bufferViews": [{{"buffer": 0, "byteOffset": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 12}},
              {{"buffer": 0, "byteOffset": 48, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 96, "byteLength": 64}}],
            "accessors": [
              {{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}},
              {{"bufferView": 1, "componentType": 5121, "count": 3, "type": "VEC4"}},
              {{"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC4"}},
              {{"bufferView": 3, "componentType": 5126, "count": 1, "type": "MAT4"}}]}}"#
        )
    }

    fn buffer() -> Vec<u8> {
        let positions = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.5];
        let weights = [1.0_f32, 0.0, 0.0, 0.0].repeat(3);
        // the joint is 0.9 m up
        let inverse = [1.0_f32, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -0.9, 0.0, 1.0];
        let floats = |all: &[f32]| all.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        [floats(&positions), vec![0; 12], floats(&weights), floats(&inverse)].concat()
    }

    #[test]
    fn a_skinned_triangle_is_read_with_its_weights_in_the_axes_of_bodies() {
        let mesh = parse("a.gltf", text("b.bin", 160).as_bytes(), &|_| Ok(buffer())).unwrap();
        assert_eq!(mesh.vertices[2], Point3::new(0.5, 0.0, 1.0));
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.weights.unwrap()["pelvis"], [(0, 1.0), (1, 1.0), (2, 1.0)]);
    }

    #[test]
    fn missing_short_and_outside_buffers_are_refused() {
        let message = |uri: &str, length, bytes: Vec<u8>| {
            let read = |_: &str| Ok(bytes.clone());
            parse("a.gltf", text(uri, length).as_bytes(), &read).unwrap_err().to_string()
        };
        assert!(message("b.bin", 160, vec![0; 10]).contains("expected 160 bytes, found 10"));
        assert!(message("https://example.org/b.bin", 160, buffer()).contains("expected a file in its own folder"));
        assert!(message("data:application/octet-stream;base64,AAAA", 160, buffer()).contains("save it as .glb"));
        assert!(parse("a.glb", b"glTF", &|_| Ok(Vec::new())).unwrap_err().to_string().contains("expected glTF 2.0"));
        let mut nan = buffer();
        nan[..4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(message("b.bin", 160, nan).contains("NaN"));
    }
}
