//! Tests of `gltf_file.rs`.

use super::*;

fn text(uri: &str, length: usize) -> String {
    text_with_more(uri, length, "", "")
}

/// A file as text with the joints required by a body's landmarks, each 0.1 m apart, and a triangle weighted to the
/// head, with its buffer at `uri`. The joints are nodes 1 to 15, followed by `more_nodes`; `more_skins` follow the
/// skin.
fn text_with_more(uri: &str, length: usize, more_nodes: &str, more_skins: &str) -> String {
    let [more_nodes, more_skins] =
        [more_nodes, more_skins].map(|more| if more.is_empty() { String::new() } else { format!(", {more}") });
    let names = ["Hips", "Neck", "Head"].map(str::to_owned).into_iter();
    let limbs = ["Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot"];
    let limbs = ["Left", "Right"].into_iter().flat_map(|side| limbs.map(|limb| format!("{side}{limb}")));
    let names: Vec<String> = names.chain(limbs).collect();
    let node = |name: &String| {
        let height = if name.ends_with("Foot") { 0.0 } else { 0.9 };
        format!(r#"{{"name": "{name}", "translation": [0, {height}, 0]}}"#)
    };
    let nodes = names.iter().map(node).collect::<Vec<_>>().join(",");
    let joints = (1..=names.len()).map(|node| node.to_string()).collect::<Vec<_>>().join(",");
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0, "skin": 0}}, {nodes}{more_nodes}],
        "skins": [{{"joints": [{joints}]}}{more_skins}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}}}]}}],
        "buffers": [{{"uri": "{uri}", "byteLength": {length}}}],
        "bufferViews": [{{"buffer": 0, "byteOffset": 0, "byteLength": 36}},
          {{"buffer": 0, "byteOffset": 36, "byteLength": 12}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 48}}],
        "accessors": [
          {{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}},
          {{"bufferView": 1, "componentType": 5121, "count": 3, "type": "VEC4"}},
          {{"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC4"}}]}}"#
    )
}

fn buffer() -> Vec<u8> {
    let positions = [0.0_f32, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.75, 0.5];
    let weights = [1.0_f32, 0.0, 0.0, 0.0].repeat(3);
    let floats = |all: &[f32]| all.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    [floats(&positions), [2, 0, 0, 0].repeat(3), floats(&weights)].concat()
}

fn message(text: &str, bytes: &[u8]) -> String {
    parse("a.gltf", text.as_bytes(), &|_| Ok(bytes.to_vec())).unwrap_err().to_string()
}

#[test]
fn a_skinned_triangle_is_read_in_its_nodes_pose_and_converted_to_body_axes() {
    let mesh = parse("a.gltf", text("b.bin", 96).as_bytes(), &|_| Ok(buffer())).unwrap();
    // the head raises its vertices by 0.9 m
    let lifted = Point3::new(0.5, 0.0, 0.75 + f64::from(0.9_f32));
    assert!((mesh.vertices[2] - lifted).norm() < 1e-12, "{}", mesh.vertices[2]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.weights.unwrap()["head"], [(0, 1.0), (1, 1.0), (2, 1.0)]);
    assert_eq!(mesh.landmarks["left_ankle"], Point3::origin());
}

fn more(nodes: &str, skins: &str) -> String {
    text_with_more("b.bin", 96, nodes, skins)
}

/// Regression test: only meshes of the first skin were read; hair and clothes with separate skins were dropped
/// silently.
#[test]
fn all_meshes_of_one_skeleton_become_one_skin_and_meshes_without_joints_are_noted() {
    let hair = r#"{"name": "Hair", "mesh": 0, "skin": 1}, {"name": "Sword", "mesh": 0}"#;
    let file = more(hair, r#"{"joints": [1, 2, 3]}"#);
    let mesh = parse("a.gltf", file.as_bytes(), &|_| Ok(buffer())).unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (6, 2));
    assert_eq!(mesh.triangles[1], [3, 4, 5]);
    assert_eq!(mesh.vertices[5], mesh.vertices[2]);
    assert_eq!(mesh.weights.unwrap()["head"].len(), 6);
    assert!(mesh.notes.iter().any(|note| note.ends_with("(they have no skin): mesh `Sword`")), "{:?}", mesh.notes);
    let dog = r#"{"name": "Dog", "mesh": 0, "skin": 1}, {"name": "Tail1"}, {"name": "Tail2"}, {"name": "Tail3"}"#;
    let found = message(&more(dog, r#"{"joints": [17, 18, 19]}"#), &buffer());
    assert!(found.contains("several skeletons: mesh 0, and separately mesh `Dog`;"), "{found}");
}

/// Regression test: hidden meshes, such as a second figure, were part of the skin.
#[test]
fn only_the_default_scene_is_read_and_the_rest_is_noted() {
    let children = (0..16).map(|node| node.to_string()).collect::<Vec<_>>().join(",");
    let nodes =
        format!(r#"{{"name": "Armature", "children": [{children}]}}, {{"name": "Copy", "mesh": 0, "skin": 0}}"#);
    let all = more(&nodes, "");
    let vertices = |text: &str| {
        let mesh = parse("a.gltf", text.as_bytes(), &|_| Ok(buffer())).unwrap();
        (mesh.vertices.len(), mesh.notes)
    };
    assert_eq!(vertices(&all), (6, Vec::new()));
    let scene = |key: &str| all.replacen("\"skins\"", &format!(r#"{key}"scenes": [{{"nodes": [16]}}], "skins""#), 1);
    assert_eq!(vertices(&scene("")), (6, Vec::new()), "no scene is the default");
    let note = "meshes left out because they are not in the default scene: mesh `Copy`".to_owned();
    assert_eq!(vertices(&scene(r#""scene": 0, "#)), (3, vec![note]));
    let empty = scene(r#""scene": 0, "#).replace("[16]", "[1]");
    assert!(message(&empty, &buffer()).contains("a skin in its default scene, found none"));
}

/// Regression test: the message wrongly denied that there is a head joint.
#[test]
fn a_head_without_weighted_vertices_is_reported() {
    let mut of_hips = buffer();
    for vertex in 0..3 {
        of_hips[36 + 4 * vertex] = 0;
    }
    let found = message(&text("b.bin", 96), &of_hips);
    assert!(found.contains("head joint is recognised, but no vertex"), "{found}");
}

#[test]
fn missing_short_and_outside_buffers_are_refused() {
    let with = |uri: &str, length| text(uri, length);
    assert!(message(&with("b.bin", 96), &[0; 10]).contains("expected 96 bytes, found 10"));
    assert!(message(&with("b.bin", 60), &buffer()[..60]).contains("beyond its buffer"), "a view beyond its buffer");
    let outside = message(&with("https://example.org/b.bin", 96), &buffer());
    assert!(outside.contains("expected a file in its own folder"), "{outside}");
    let inside = message(&with("data:application/octet-stream;base64,AAAA", 96), &buffer());
    assert!(inside.contains("save it as .glb"), "{inside}");
    for bytes in [&b"glTF"[..], b"glTF\x02\0\0\0\x05\0\0\0", b"{}", b"", b"glTF\x02\0\0\0\xff\xff\xff\xff"] {
        let found = parse("a.glb", bytes, &|_| Ok(Vec::new())).unwrap_err().to_string();
        assert!(found.contains("expected glTF 2.0"), "{found}");
    }
}

#[test]
fn names_of_buffers_are_decoded_before_their_folder_is_checked() {
    for (uri, name) in
        [("my%20b%C3%A9.bin", "my bé.bin"), ("%2e%2E/b.bin", "../b.bin"), ("50%.bin", "50%.bin"), ("%ff", "%ff")]
    {
        let asked = std::cell::RefCell::new(String::new());
        let read = |name: &str| {
            asked.replace(name.to_owned());
            Ok(buffer())
        };
        assert!(parse("a.gltf", text(uri, 96).as_bytes(), &read).is_ok());
        assert_eq!(*asked.borrow(), name);
    }
}

#[test]
fn invalid_types_and_counts_and_joints_of_another_skeleton_are_refused() {
    let good = text("b.bin", 96);
    let mut nan = buffer();
    nan[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(message(&good, &nan).contains("NaN"));
    let mut astray = buffer();
    astray[36] = 99;
    assert!(message(&good, &astray).contains("vertex 0 has joint 99"));
    for (from, to, part) in [
        ("5121, \"count\": 3", "5126, \"count\": 3", "expected Vec4 of [U8, U16]"),
        ("5121, \"count\": 3", "5121, \"count\": 4000000000", "expected at most"),
        ("5121, \"count\": 3", "5121, \"count\": 2", "3 positions, 2 joints and 3 weights"),
        ("\"WEIGHTS_0\": 2", "\"JOINTS_1\": 1", "more than four joints"),
        ("\"LeftLeg\"", "\"Tentacle\"", "no joint is recognised as left knee"),
        ("\"Hips\"", "\"Hips\", \"children\": [1]", "their own ancestors"),
        ("0.9, 0", "90, 0", "glTF uses metres"),
        (", \"skin\": 0", "", "a node with a mesh and a skin"),
    ] {
        assert!(good.contains(from), "{from}");
        let found = message(&good.replace(from, to), &buffer());
        assert!(found.contains(part), "{from}: {found}");
    }
}
