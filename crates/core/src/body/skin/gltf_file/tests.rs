//! Tests of `gltf_file.rs` and of what it uses.

use serde_json::{Value, json};

use super::*;

/// Names, parents and offsets of a person of 1.75 m with its arms spread, Y up, facing +Z. Node 0 is the mesh.
#[rustfmt::skip]
const JOINTS: [(&str, usize, [f64; 3]); 18] = [
    ("Hips", 0, [0.0, 0.95, 0.0]), ("Spine", 1, [0.0, 0.2, 0.0]), ("Neck", 2, [0.0, 0.33, 0.0]), ("Head", 3, [0.0, 0.1, 0.0]),
    ("LeftArm", 2, [0.18, 0.27, 0.0]), ("LeftForeArm", 5, [0.29, 0.0, 0.0]), ("LeftHand", 6, [0.26, 0.0, 0.0]),
    ("LeftUpLeg", 1, [0.09, -0.03, 0.0]), ("LeftLeg", 8, [0.0, -0.42, 0.0]), ("LeftFoot", 9, [0.0, -0.42, 0.0]),
    ("LeftToeBase", 10, [0.0, -0.06, 0.13]),
    ("RightArm", 2, [-0.18, 0.27, 0.0]), ("RightForeArm", 12, [-0.29, 0.0, 0.0]), ("RightHand", 13, [-0.26, 0.0, 0.0]),
    ("RightUpLeg", 1, [-0.09, -0.03, 0.0]), ("RightLeg", 15, [0.0, -0.42, 0.0]), ("RightFoot", 16, [0.0, -0.42, 0.0]),
    ("RightToeBase", 17, [0.0, -0.06, 0.13]),
];
/// A triangle on the head.
const VERTICES: [[f32; 3]; 3] = [[-0.05, 1.6, 0.0], [0.05, 1.6, 0.0], [0.0, 1.75, 0.1]];

/// A file under construction.
struct Figure {
    root: Value,
    bytes: Vec<u8>,
}

impl Figure {
    fn new() -> Self {
        let mut figure = Self { root: json!({"asset": {"version": "2.0"}}), bytes: Vec::new() };
        let mut nodes = vec![json!({"mesh": 0, "skin": 0})];
        let mut places: Vec<[f64; 3]> = vec![[0.0; 3]];
        let mut inverse: Vec<f32> = Vec::new();
        for (index, (name, parent, offset)) in JOINTS.iter().enumerate() {
            let children: Vec<usize> = (0..18).filter(|child| JOINTS[*child].1 == index + 1).map(|c| c + 1).collect();
            let mut node = json!({"name": name, "translation": offset});
            if !children.is_empty() {
                node["children"] = json!(children);
            }
            nodes.push(node);
            let place: [f64; 3] = std::array::from_fn(|axis| places[*parent][axis] + offset[axis]);
            places.push(place);
            inverse.extend([1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
            inverse.extend(place.map(|c| -c as f32).into_iter().chain([1.0]));
        }
        figure.root["nodes"] = json!(nodes);
        let inverse = figure.floats(&inverse, "MAT4");
        figure.root["skins"] = json!([{"joints": (1..=18).collect::<Vec<_>>(), "inverseBindMatrices": inverse}]);
        let position = figure.floats(VERTICES.as_flattened(), "VEC3");
        figure.root["accessors"][position]["min"] = json!([-1, 0, -1]);
        figure.root["accessors"][position]["max"] = json!([1, 2, 1]);
        let joints = figure.accessor(&[3, 0, 0, 0].repeat(3), 5121, "VEC4", 3);
        let weights = figure.floats(&[1.0, 0.0, 0.0, 0.0].repeat(3), "VEC4");
        let attributes = json!({"POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights});
        figure.root["meshes"] = json!([{"primitives": [{"attributes": attributes}]}]);
        figure
    }

    /// Adds numbers; returns the accessor.
    fn accessor(&mut self, bytes: &[u8], kind: u32, shape: &str, count: usize) -> usize {
        let mut push = |list: &str, item: Value| {
            if self.root[list].is_null() {
                self.root[list] = json!([]);
            }
            let items = self.root[list].as_array_mut().unwrap();
            items.push(item);
            items.len() - 1
        };
        let view = push("bufferViews", json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()}));
        let item = json!({"bufferView": view, "componentType": kind, "count": count, "type": shape});
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        push("accessors", item)
    }

    fn floats(&mut self, all: &[f32], shape: &str) -> usize {
        let width = [("VEC3", 3), ("VEC4", 4), ("MAT4", 16)].iter().find(|(known, _)| *known == shape).unwrap().1;
        let bytes: Vec<u8> = all.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, shape, all.len() / width)
    }

    fn primitive(&mut self) -> &mut Value {
        &mut self.root["meshes"][0]["primitives"][0]
    }

    fn read_with(&self, map: &BTreeMap<String, String>) -> Result<SkinMesh, String> {
        let mut root = self.root.clone();
        if root["buffers"].is_null() {
            root["buffers"] = json!([{"uri": "b.bin", "byteLength": self.bytes.len()}]);
        }
        let bytes = |_: &str| Ok(self.bytes.clone());
        parse("a.gltf", root.to_string().as_bytes(), map, &bytes).map_err(|error| error.to_string())
    }

    fn read(&self) -> SkinMesh {
        self.read_with(&BTreeMap::new()).unwrap()
    }

    fn refused(&self) -> String {
        self.read_with(&BTreeMap::new()).unwrap_err()
    }

    /// Adds a node above the joints.
    fn below(mut self, node: Value) -> Self {
        let mut node = node;
        node["children"] = json!([1]);
        self.root["nodes"].as_array_mut().unwrap().push(node);
        self
    }
}

/// The triangle in body axes.
fn is_in_place(mesh: &SkinMesh) -> bool {
    let expected = VERTICES.map(|v| forward(Vector3::from(v.map(f64::from))));
    mesh.vertices.iter().zip(expected).all(|(found, expected)| (found - expected).norm() < 1e-5)
}

#[test]
fn a_skinned_triangle_is_converted_to_body_axes_and_its_joints_are_found() {
    let mesh = Figure::new().read();
    assert!(is_in_place(&mesh) && mesh.notes.is_empty(), "{:?} {:?}", mesh.vertices, mesh.notes);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.weights.unwrap()["head"], [(0, 1.0), (1, 1.0), (2, 1.0)]);
    assert!((mesh.landmarks["left_ankle"] - Point3::new(0.0, 0.09, 0.08)).norm() < 1e-6);
    let found = ["left_elbow", "head_top"].map(|landmark| mesh.joint_map[landmark].as_str());
    assert_eq!(found, ["LeftForeArm", "Head:tip"]);
}

/// The mesh followed a pose of the nodes that an animation had left.
#[test]
fn nodes_left_in_a_pose_do_not_move_the_mesh() {
    let mut figure = Figure::new();
    for (node, turn) in [(1, [0.0, 0.6, 0.0, 0.8]), (3, [0.28, 0.0, 0.0, 0.96]), (5, [0.0, 0.0, 0.6, 0.8])] {
        figure.root["nodes"][node]["rotation"] = json!(turn);
    }
    let mesh = figure.below(json!({"scale": [0.01, 0.01, 0.01]})).read();
    let expected = Figure::new().read();
    assert!(is_in_place(&mesh), "{:?}", mesh.vertices);
    for (name, place) in &expected.landmarks {
        assert!((mesh.landmarks[name] - place).norm() < 1e-5, "{name}");
    }
    assert!(mesh.notes.iter().any(|note| note.contains("in another pose")), "{:?}", mesh.notes);
}

/// VRM files were refused by their ending, and bones without telling names were not found.
#[test]
fn the_map_of_a_vrm_file_names_its_bones_and_the_body_is_turned_to_face_forward() {
    let bones = [4, 5, 6, 7, 8, 9, 10, 12, 13, 14, 15, 16, 17].map(|node| {
        let name = JOINTS[node - 1].0.replace("ForeArm", "LowerArm").replace("UpLeg", "UpperLeg");
        let name = if name.ends_with("tLeg") { name.replace("Leg", "LowerLeg") } else { name };
        let name = if name.ends_with("tArm") { name.replace("Arm", "UpperArm") } else { name };
        (name[..1].to_lowercase() + &name[1..], node)
    });
    let listed: Vec<Value> = bones.iter().map(|(bone, node)| json!({"bone": bone, "node": node})).collect();
    let named: serde_json::Map<String, Value> =
        bones.iter().map(|(bone, node)| (bone.clone(), json!({"node": node}))).collect();
    for (extension, bones, turn) in
        [("VRM", json!(listed), [0.0, 1.0, 0.0, 0.0]), ("VRMC_vrm", json!(named), [0.0, 0.0, 0.0, 1.0])]
    {
        let mut figure = Figure::new();
        (1..=18).for_each(|node| figure.root["nodes"][node]["name"] = json!(format!("bone{}", node * 7 % 19)));
        figure.root["extensions"] = json!({extension: {"humanoid": {"humanBones": bones}}});
        figure.root["extensionsRequired"] = json!([extension, "VRMC_springBone"]);
        let mesh = figure.below(json!({"rotation": turn})).read();
        assert!(is_in_place(&mesh), "{extension}: {:?}", mesh.vertices);
        assert_eq!(mesh.joint_map["left_shoulder"], format!("bone{}", 5 * 7 % 19));
    }
}

#[test]
fn figures_that_lie_or_are_in_another_unit_are_turned_and_scaled_with_a_note() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let lying = Figure::new().below(json!({"rotation": [half, 0.0, 0.0, half]})).read();
    assert!(is_in_place(&lying), "{:?}", lying.vertices);
    assert!(lying.notes[0].contains("its trunk points along +Z and it faces -Y"), "{:?}", lying.notes);
    let large = Figure::new().below(json!({"scale": [100, 100, 100]})).read();
    assert!(is_in_place(&large) && large.notes[0].contains("read as centimetres"), "{:?}", large.notes);
    let mirrored = Figure::new().below(json!({"scale": [-1, 1, 1]})).read();
    assert_eq!(mirrored.triangles, [[0, 2, 1]], "not inside out");
    assert_eq!(mirrored.joint_map["left_knee"], "RightLeg", "{:?}", mirrored.notes);
    assert!(Figure::new().below(json!({"scale": [3, 3, 3]})).refused().contains("scale it when exporting"));
}

#[test]
fn extensions_that_pack_the_shape_are_refused_with_the_tool_and_textures_are_ignored() {
    let required = |name: &str| {
        let mut figure = Figure::new();
        figure.root["extensionsRequired"] = json!(["KHR_materials_unlit", name]);
        figure.root["textures"] = json!([{"extensions": {"EXT_texture_webp": {"source": 0}}}]);
        figure.primitive()["attributes"]["_BATCH"] = json!(0);
        figure.read_with(&BTreeMap::new())
    };
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression"] {
        let found = required(name).unwrap_err();
        assert!(found.contains(name) && found.contains("npx @gltf-transform/cli copy"), "{found}");
    }
    assert!(required("ACME_folded_limbs").unwrap_err().contains("ACME_folded_limbs, which is not known"));
    assert!(required("EXT_texture_webp").is_ok());
}

#[test]
fn weights_are_normalised_and_more_than_four_are_read() {
    let mut figure = Figure::new();
    let more = figure.accessor(&[2, 0, 0, 0].repeat(3), 5121, "VEC4", 3);
    let weights = figure.accessor(&[51, 0, 0, 0].repeat(3), 5121, "VEC4", 3);
    figure.root["accessors"][weights]["normalized"] = json!(true);
    figure.primitive()["attributes"]["JOINTS_1"] = json!(more);
    figure.primitive()["attributes"]["WEIGHTS_1"] = json!(weights);
    let mesh = figure.read();
    assert!(mesh.notes[0].contains("of 3 vertices were normalised; they summed up to 1.200"), "{:?}", mesh.notes);
    let weights = mesh.weights.unwrap();
    assert!((weights["head"][0].1 - 1.0 / 1.2).abs() < 1e-12 && (weights["neck"][0].1 - 0.2 / 1.2).abs() < 1e-12);
}

/// Positions as 16-bit numbers, whose scale is in the inverse bind matrices, and a morph target of one moved vertex.
#[test]
fn quantised_positions_sparse_morph_targets_and_buffers_in_the_text_are_read() {
    let mut figure = Figure::new();
    let words: Vec<u8> =
        VERTICES.as_flattened().iter().flat_map(|c| ((c * 1000.0).round() as i16).to_le_bytes()).collect();
    let position = figure.accessor(&words, 5122, "VEC3", 3);
    figure.root["accessors"][position]["min"] = json!([-50, 1600, 0]);
    figure.root["accessors"][position]["max"] = json!([50, 1750, 100]);
    figure.primitive()["attributes"]["POSITION"] = json!(position);
    let mut inverse = Vec::new();
    for joint in 0..18 {
        for (at, own) in figure.bytes[64 * joint..64 * (joint + 1)].as_chunks::<4>().0.iter().enumerate() {
            inverse.push(f32::from_le_bytes(*own) * if at < 12 { 0.001 } else { 1.0 });
        }
    }
    figure.root["skins"][0]["inverseBindMatrices"] = json!(figure.floats(&inverse, "MAT4"));
    figure.root["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    assert!(is_in_place(&figure.read()), "{:?}", figure.read().vertices);
    let (at, to) = (figure.accessor(&[2], 5121, "SCALAR", 1), figure.floats(&[0.0, 50.0, 0.0], "VEC3"));
    let view = |accessor: usize| figure.root["accessors"][accessor]["bufferView"].clone();
    let sparse = json!({"count": 1, "indices": {"bufferView": view(at), "componentType": 5121}, "values": {"bufferView": view(to)}});
    let accessors = figure.root["accessors"].as_array_mut().unwrap();
    accessors.push(json!({"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse}));
    let target = accessors.len() - 1;
    figure.primitive()["targets"] = json!([{"POSITION": target}]);
    figure.root["meshes"][0]["weights"] = json!([0.5]);
    let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let encoded: String = figure
        .bytes
        .chunks(3)
        .flat_map(|own| {
            let whole = own.iter().fold(0_usize, |sum, byte| sum << 8 | usize::from(*byte)) << (8 * (3 - own.len()));
            (0..4).map(move |k| if k > own.len() { '=' } else { letters[whole >> (18 - 6 * k) & 63] as char })
        })
        .collect();
    let uri = format!("data:application/octet-stream;base64,{encoded}");
    figure.root["buffers"] = json!([{"uri": uri, "byteLength": figure.bytes.len()}]);
    let mesh = figure.read();
    assert!((mesh.vertices[2] - Point3::new(0.1, 0.0, 1.775)).norm() < 1e-5, "{}", mesh.vertices[2]);
    assert!(mesh.notes[0].contains("morph targets are applied"), "{:?}", mesh.notes);
}

/// Regression test: only meshes of the first skin were read; hair and clothes with separate skins were dropped
/// silently.
#[test]
fn all_meshes_of_one_skeleton_become_one_skin_and_meshes_without_joints_are_noted() {
    let with = |name: &str, joints: [usize; 4]| {
        let mut figure = Figure::new();
        let nodes = figure.root["nodes"].as_array_mut().unwrap();
        let more =
            [json!({"name": name, "mesh": 0, "skin": 1}), json!({"name": "Sword", "mesh": 0}), json!({"name": "Tail"})];
        nodes.extend(more);
        let inverse = figure.root["skins"][0]["inverseBindMatrices"].clone();
        let skin = json!({"joints": joints, "inverseBindMatrices": inverse});
        figure.root["skins"].as_array_mut().unwrap().push(skin);
        figure
    };
    let mesh = with("Hair", [1, 2, 3, 4]).read();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len(), mesh.triangles[1]), (6, 2, [3, 4, 5]));
    assert_eq!(mesh.weights.unwrap()["head"].len(), 6);
    assert!(mesh.notes.iter().any(|note| note.ends_with("(they have no skin): mesh `Sword`")), "{:?}", mesh.notes);
    let found = with("Dog", [21; 4]).refused();
    assert!(found.contains("several skeletons: mesh 0, and separately mesh `Dog`;"), "{found}");
}

/// Regression test: hidden meshes, such as a second figure, were part of the skin.
#[test]
fn only_the_default_scene_is_read_and_the_rest_is_noted() {
    let mut figure = Figure::new();
    figure.root["nodes"].as_array_mut().unwrap().push(json!({"name": "Copy", "mesh": 0, "skin": 0}));
    figure.root["scenes"] = json!([{"nodes": [0, 1]}]);
    assert_eq!(figure.read().vertices.len(), 6, "no scene is the default");
    figure.root["scene"] = json!(0);
    let mesh = figure.read();
    assert_eq!(mesh.vertices.len(), 3);
    assert_eq!(mesh.notes, ["meshes left out because they are not in the default scene: mesh `Copy`"]);
    figure.root["scenes"] = json!([{"nodes": [1]}]);
    assert!(figure.refused().contains("a skin in its default scene, found none"));
}

#[test]
fn joints_that_are_not_found_are_named_by_the_user() {
    let mut figure = Figure::new();
    let map = |landmark: &str, joint: &str| BTreeMap::from([(landmark.to_owned(), joint.to_owned())]);
    let found = figure.read_with(&map("left_knee", "Tentacle")).unwrap_err();
    assert!(found.contains("joint_map: `Tentacle` is no joint; its joints are: Hips, Spine"), "{found}");
    assert!(figure.read_with(&map("tail", "Hips")).unwrap_err().contains("`tail` is not a landmark"));
    let other = figure.read_with(&map("thorax", "Head")).unwrap();
    assert_eq!(other.joint_map["thorax"], "Head");
    // legs as short as those of a lizard
    [9, 10, 16, 17].iter().for_each(|node: &usize| figure.root["nodes"][*node]["translation"] = json!([0, 0, 0]));
    figure.root["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices");
    let found = figure.refused();
    assert!(found.contains("no human body is found") && found.contains("joint_map = { thorax = \"\""), "{found}");
}

#[test]
fn missing_short_and_outside_buffers_and_other_formats_are_refused() {
    let with = |uri: &str, length: usize| {
        let mut figure = Figure::new();
        figure.root["buffers"] = json!([{"uri": uri, "byteLength": length}]);
        figure.refused()
    };
    assert!(with("b.bin", 5000).contains("expected 5000 bytes, found"));
    assert!(with("https://example.org/b.bin", 96).contains("is no file beside this one"));
    assert!(with("data:application/octet-stream;base64,?", 96).contains("save it as .glb"));
    for bytes in [&b"glTF"[..], b"glTF\x02\0\0\0\x05\0\0\0", b"{}", b"", b"Kaydara FBX Binary  \0", b"PK\x03\x04"] {
        let found = parse("a.glb", bytes, &BTreeMap::new(), &|_| Ok(Vec::new())).unwrap_err().to_string();
        assert!(found.contains("expected glTF 2.0"), "{found}");
    }
}

#[test]
fn names_of_buffers_are_decoded() {
    for (uri, name) in
        [("my%20b%C3%A9.bin", "my bé.bin"), ("%2e%2E/b.bin", "../b.bin"), ("50%.bin", "50%.bin"), ("%ff", "%ff")]
    {
        let asked = std::cell::RefCell::new(String::new());
        let mut figure = Figure::new();
        figure.root["buffers"] = json!([{"uri": uri, "byteLength": figure.bytes.len()}]);
        let read = |name: &str| {
            asked.replace(name.to_owned());
            Ok(figure.bytes.clone())
        };
        assert!(parse("a.gltf", figure.root.to_string().as_bytes(), &BTreeMap::new(), &read).is_ok());
        assert_eq!(*asked.borrow(), name);
    }
}

#[test]
fn invalid_types_and_counts_and_files_without_a_head_are_refused() {
    for (pointer, value, part) in [
        ("/accessors/2/componentType", json!(5126), "expected Vec4 of [U8, U16]"),
        ("/accessors/2/count", json!(4_000_000_000_u32), "expected at most"),
        ("/accessors/2/count", json!(2), "3 positions, 2 joints and 3 weights"),
        ("/meshes/0/primitives/0/attributes/JOINTS_1", json!(2), "no WEIGHTS_1"),
        ("/nodes/2/children", json!([1]), "their own ancestors"),
        ("/nodes/0/skin", Value::Null, "a node with a mesh and a skin"),
    ] {
        let mut figure = Figure::new();
        match figure.root.pointer_mut(pointer) {
            Some(place) => *place = value,
            None => figure.primitive()["attributes"]["JOINTS_1"] = value,
        }
        let found = figure.refused();
        assert!(found.contains(part), "{pointer}: {found}");
    }
    let mut figure = Figure::new();
    let at = figure.root["bufferViews"][2]["byteOffset"].as_u64().unwrap() as usize;
    figure.bytes[at] = 99;
    assert!(figure.refused().contains("vertex 0 has joint 99"));
    // regression test: the message wrongly denied that there is a head joint
    (0..3).for_each(|vertex| figure.bytes[at + 4 * vertex] = 0);
    assert!(figure.refused().contains("head joint is recognised, but no vertex"));
    let at = figure.root["bufferViews"][1]["byteOffset"].as_u64().unwrap() as usize;
    figure.bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(figure.refused().contains("NaN"));
}
