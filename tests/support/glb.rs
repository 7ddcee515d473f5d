//! A skin as a `.glb` file like Mixamo's figures: centimetres below a scaling node, joints with Mixamo's names.

use std::collections::BTreeMap;

use nalgebra::{Matrix4, Point3, Vector3};
use serde_json::json;
use skiagraph_core::body::SkinMesh;

/// Segments, the joints as which they are exported, and the landmarks at these joints' places.
const JOINTS: [(&str, &str, &str); 5] = [
    ("pelvis", "mixamorig:Hips", "pelvis"),
    ("abdomen", "mixamorig:Spine", "pelvis"),
    ("thorax", "mixamorig:Spine1", "pelvis"),
    ("neck", "mixamorig:Neck", "thorax"),
    ("head", "mixamorig:Head", "thorax"),
];
const LIMBS: [(&str, &str, &str); 8] = [
    ("clavicle", "Shoulder", "shoulder"),
    ("upper_arm", "Arm", "shoulder"),
    ("forearm", "ForeArm", "elbow"),
    ("hand", "Hand", "wrist"),
    ("thigh", "UpLeg", "hip"),
    ("shank", "Leg", "knee"),
    ("foot", "Foot", "ankle"),
    ("toes", "ToeBase", "toes"),
];

pub(crate) fn bytes(mesh: &SkinMesh) -> Vec<u8> {
    let mut joints: Vec<(String, String, String)> =
        JOINTS.iter().map(|(a, b, c)| ((*a).into(), (*b).into(), (*c).into())).collect();
    for (side, word) in [("left", "Left"), ("right", "Right")] {
        joints.extend(LIMBS.iter().map(|(segment, name, landmark)| {
            (format!("{side}_{segment}"), format!("mixamorig:{word}{name}"), format!("{side}_{landmark}"))
        }));
    }
    // from X forward, Z up, metres to Y up, Z forward, centimetres
    let turned = |p: &Point3<f64>| Vector3::new(p.y, p.z, p.x) * 100.0;
    let places: Vec<Vector3<f64>> = joints.iter().map(|(.., landmark)| turned(&mesh.landmarks[landmark])).collect();
    let weights = mesh.weights.as_ref().unwrap();
    let mut own: Vec<Vec<(u16, f32)>> = vec![Vec::new(); mesh.vertices.len()];
    for (segment, pairs) in weights {
        let joint = joints.iter().position(|(known, ..)| known == segment).unwrap_or_else(|| panic!("{segment}"));
        pairs.iter().for_each(|(vertex, weight)| own[*vertex as usize].push((joint as u16, *weight as f32)));
    }
    let mut views = Vec::new();
    let mut bin: Vec<u8> = Vec::new();
    let mut view = |bytes: Vec<u8>| {
        views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len()}));
        bin.extend(bytes);
        while !bin.len().is_multiple_of(4) {
            bin.push(0);
        }
    };
    let floats = |all: &mut dyn Iterator<Item = f32>| all.flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let vertices: Vec<Vector3<f64>> = mesh.vertices.iter().map(turned).collect();
    view(floats(&mut vertices.iter().flat_map(|v| [v.x as f32, v.y as f32, v.z as f32])));
    // the four greatest weights, normalised to a sum of 1
    let four = |own: &Vec<(u16, f32)>| -> [(u16, f32); 4] {
        let mut sorted = own.clone();
        sorted.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        sorted.resize(4, (0, 0.0));
        let sum: f32 = sorted.iter().map(|(_, weight)| weight).sum();
        std::array::from_fn(|i| (sorted[i].0, sorted[i].1 / sum))
    };
    view(own.iter().flat_map(|own| four(own).map(|(joint, _)| joint.to_le_bytes())).flatten().collect());
    view(floats(&mut own.iter().flat_map(|own| four(own).map(|(_, weight)| weight))));
    view(mesh.triangles.as_flattened().iter().flat_map(|corner| corner.to_le_bytes()).collect());
    let inverse = places.iter().flat_map(|place| {
        let matrix = Matrix4::new_translation(&-place);
        (0..16).map(move |i| matrix[(i % 4, i / 4)] as f32).collect::<Vec<_>>()
    });
    view(floats(&mut inverse.collect::<Vec<_>>().into_iter()));
    // half a second in which an arm moves forward
    view(floats(&mut (0..16_u8).map(|key| f32::from(key) / 30.0)));
    view(floats(&mut (0..16_u8).flat_map(|key| [0.0, f32::from(key) * 0.02, 0.0, 1.0])));
    view(floats(&mut (0..16_u8).flat_map(|_| [0.0, 0.0, 0.0, 1.0])));
    let arm = joints.iter().position(|(segment, ..)| segment == "left_upper_arm").unwrap() + 2;
    let count = mesh.vertices.len();
    let (low, high) = vertices.iter().fold((vertices[0], vertices[0]), |(l, h), v| (l.inf(v), h.sup(v)));
    // the joint above each: the hips for legs and spine, the last of the spine for neck and arms
    let parent = |index: usize| match index.checked_sub(JOINTS.len()).map(|limb| limb % LIMBS.len()) {
        Some(0) => 2,
        Some(4) => 0,
        _ => index - 1,
    };
    let node = |index: usize| {
        let offset = if index == 0 { places[0] } else { places[index] - places[parent(index)] };
        let mut node = BTreeMap::from([
            ("name", json!(joints[index].1)),
            ("translation", json!([offset.x as f32, offset.y as f32, offset.z as f32])),
        ]);
        let children: Vec<usize> = (1..joints.len()).filter(|child| parent(*child) == index).map(|c| c + 2).collect();
        if !children.is_empty() {
            node.insert("children", json!(children));
        }
        json!(node)
    };
    let turn = |node: usize| json!({"sampler": u8::from(node != arm), "target": {"node": node, "path": "rotation"}});
    let mut nodes = vec![
        json!({"name": "Armature", "scale": [0.01, 0.01, 0.01], "children": [1, 2]}),
        json!({"name": "Body", "mesh": 0, "skin": 0}),
    ];
    nodes.extend((0..joints.len()).map(node));
    let document = json!({
        "asset": {"version": "2.0"},
        "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "skins": [{"joints": (2..joints.len() + 2).collect::<Vec<_>>(), "inverseBindMatrices": 4}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}, "indices": 3}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3",
             "min": [low.x as f32, low.y as f32, low.z as f32], "max": [high.x as f32, high.y as f32, high.z as f32]},
            {"bufferView": 1, "componentType": 5123, "count": count, "type": "VEC4"},
            {"bufferView": 2, "componentType": 5126, "count": count, "type": "VEC4"},
            {"bufferView": 3, "componentType": 5125, "count": 3 * mesh.triangles.len(), "type": "SCALAR"},
            {"bufferView": 4, "componentType": 5126, "count": joints.len(), "type": "MAT4"},
            {"bufferView": 5, "componentType": 5126, "count": 16, "type": "SCALAR", "min": [0.0], "max": [0.5]},
            {"bufferView": 6, "componentType": 5126, "count": 16, "type": "VEC4"},
            {"bufferView": 7, "componentType": 5126, "count": 16, "type": "VEC4"},
        ],
        "animations": [{
            "name": "wave", "samplers": [{"input": 5, "output": 6}, {"input": 5, "output": 7}],
            "channels": (2..joints.len() + 2).map(turn).collect::<Vec<_>>(),
        }],
        "bufferViews": views,
        "buffers": [{"byteLength": bin.len()}],
    });
    let mut text = document.to_string().into_bytes();
    while !text.len().is_multiple_of(4) {
        text.push(b' ');
    }
    let length = |bytes: &[u8]| (bytes.len() as u32).to_le_bytes();
    let total = (28 + text.len() + bin.len()) as u32;
    [b"glTF\x02\0\0\0", &total.to_le_bytes()[..], &length(&text), b"JSON", &text, &length(&bin), b"BIN\0", &bin]
        .concat()
}
