//! Skins in files: a `.toml` that names a mesh and its weights, or `.glb`, `.gltf` and `.vrm` with their own.
//!
//! ```toml
//! schema = "skiagraph.skin/1"
//! mesh = "person.obj"                # OBJ, STL or Collada, beside this file
//! weights = "person.weights.json"    # optional; without it, weights are found by distance
//! metres_per_unit = 1.0              # optional
//! up = "z"                           # optional: "z" (X forward), or "y" (Z forward)
//! [landmarks]                        # where the body's landmarks are in the mesh, in its own units and axes
//! left_shoulder = [0.01, 0.17, 1.34]
//! ```

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Point3;
use serde::Deserialize;

use super::gltf_document::FBX_TO_GLB;
use super::gltf_file;
use super::mesh::{SkinError, SkinMesh};
use crate::body::{LANDMARKS, mesh_from_bytes};
use crate::input::{self, excerpt, foreign_about, is_own_output, limits, unquoted};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SkinSettings {
    schema: String,
    mesh: String,
    weights: Option<String>,
    #[serde(default = "one")]
    metres_per_unit: f64,
    #[serde(default)]
    up: MeshUp,
    #[serde(default)]
    landmarks: BTreeMap<String, [f64; 3]>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum MeshUp {
    #[default]
    Z,
    Y,
}

impl MeshUp {
    /// Converts from the file's axes to X forward, Y left, Z up.
    fn turned(self, [x, y, z]: [f64; 3]) -> Point3<f64> {
        match self {
            Self::Z => Point3::new(x, y, z),
            Self::Y => Point3::new(z, x, y),
        }
    }
}

fn one() -> f64 {
    1.0
}

/// Reads a skin; the meshes, weights and buffers that it names are relative to its folder. `joint_map` names joints of
/// glTF files by landmark (`Joint`, or `Joint:tip` for the crown above the head's joint); the others are found.
pub fn read_skin(path: &Path, joint_map: &BTreeMap<String, String>) -> Result<SkinMesh, SkinError> {
    let folder = path.parent().map(Path::to_owned).unwrap_or_default();
    let read = |name: &str, limit: u64| -> Result<Vec<u8>, SkinError> {
        input::read(&folder.join(name), limit).map_err(|source| {
            let detail = format!("refers to the file `{}`, which cannot be read: {source}", excerpt(name));
            SkinError::Malformed { file: path.display().to_string(), detail }
        })
    };
    let whole =
        input::read(path, limits::MESH).map_err(|source| SkinError::Unreadable { path: path.to_owned(), source })?;
    let file = path.display().to_string();
    match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
        Some("glb" | "gltf" | "vrm") => gltf_file::parse(&file, &whole, joint_map, &|uri| read(uri, limits::MESH)),
        Some("toml") if joint_map.is_empty() => parse(&file, &String::from_utf8_lossy(&whole), &read),
        Some("toml") => Err(malformed(&file, "has no joints of its own that `joint_map` could name".to_owned())),
        Some("fbx") => Err(malformed(&file, format!("FBX is not read; convert it: {FBX_TO_GLB}"))),
        _ => Err(malformed(
            &file,
            "expected a skin ending in .glb, .gltf, .vrm or .toml (with the names of a mesh and its weights); Blender \
             imports .dae, .obj and .ply and exports .glb with the armature"
                .to_owned(),
        )),
    }
}

/// Reads a `.glb` or `.gltf` with embedded buffers; `file` names it in messages.
pub fn skin_from_gltf(file: &str, bytes: &[u8]) -> Result<SkinMesh, SkinError> {
    let missing = |uri: &str| SkinError::Malformed {
        file: file.to_owned(),
        detail: format!("refers to the buffer `{}`, which is not embedded", excerpt(uri)),
    };
    gltf_file::parse(file, bytes, &BTreeMap::new(), &|uri| Err(missing(uri)))
}

fn malformed(file: &str, detail: String) -> SkinError {
    SkinError::Malformed { file: file.to_owned(), detail }
}

/// Returns the bytes of the file with this name, at most this many.
pub(super) type Read<'a> = dyn Fn(&str, u64) -> Result<Vec<u8>, SkinError> + 'a;

/// Whether a skin may place this landmark: one of the body's, or a ball of a foot.
fn is_landmark(name: &str) -> bool {
    LANDMARKS.iter().any(|landmark| landmark.name() == name) || ["left_toes", "right_toes"].contains(&name)
}

/// Reads a skin's `.toml`; `read` returns the bytes of referenced files.
pub(super) fn parse(file: &str, text: &str, read: &Read<'_>) -> Result<SkinMesh, SkinError> {
    let malformed = |detail: String| SkinError::Malformed { file: file.to_owned(), detail };
    let record: SkinSettings = toml::from_str(text).map_err(|e| {
        let before = e.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
        let line = before.matches('\n').count() + 1;
        malformed(format!("line {line}: {}", foreign_about(text.as_bytes(), e.message())))
    })?;
    if record.schema != "skiagraph.skin/1" {
        let found = if is_own_output(text.as_bytes()) { excerpt(&record.schema) } else { "another".to_owned() };
        return Err(malformed(format!("schema: expected \"skiagraph.skin/1\", found {found:?}")));
    }
    if !(record.metres_per_unit > 0.0 && record.metres_per_unit <= 1000.0) {
        return Err(malformed(format!("metres_per_unit: expected a length, found {}", record.metres_per_unit)));
    }
    let unknown = record.landmarks.keys().find(|name| !is_landmark(name));
    if let Some(name) = unknown {
        return Err(malformed(format!("landmarks: `{}` is not a landmark", excerpt(name))));
    }
    let (vertices, triangles) = mesh_from_bytes(&record.mesh, &read(&record.mesh, limits::MESH)?)
        .map_err(|detail| malformed(format!("mesh `{}`: {detail}", excerpt(&record.mesh))))?;
    let mut notes = Vec::new();
    let weights = match &record.weights {
        None => None,
        Some(name) => {
            let bytes = read(name, limits::MESH)?;
            let mut weights = parse_weights(name, &String::from_utf8_lossy(&bytes))?;
            notes.extend(without_empty_groups(name, &mut weights));
            Some(weights)
        }
    };
    let place = |point: [f64; 3]| record.up.turned(point.map(|c| c * record.metres_per_unit));
    let name = Path::new(file).file_stem().map_or_else(|| file.to_owned(), |stem| stem.to_string_lossy().into_owned());
    let mesh = SkinMesh {
        name,
        vertices: vertices.iter().map(|v| place((*v).into())).collect(),
        triangles,
        weights,
        landmarks: record.landmarks.iter().map(|(name, point)| (name.clone(), place(*point))).collect(),
        joint_map: BTreeMap::new(),
        notes,
    };
    mesh.checked(file)
}

/// Removes groups without weights; returns a note on them.
fn without_empty_groups(file: &str, weights: &mut BTreeMap<String, Vec<(u32, f64)>>) -> Option<String> {
    let is_empty = |own: &Vec<(u32, f64)>| own.iter().all(|(_, weight)| *weight == 0.0);
    let empty: Vec<&str> = weights.iter().filter(|(_, own)| is_empty(own)).map(|(name, _)| name.as_str()).collect();
    let note = format!("groups of {} without any weight were left out: {}", excerpt(file), excerpt(&empty.join(", ")));
    let note = (!empty.is_empty()).then_some(note);
    weights.retain(|_, own| !is_empty(own));
    note
}

#[derive(Deserialize)]
struct WeightsRecord {
    weights: BTreeMap<String, Vec<(u32, f64)>>,
}

/// Reads weights in the format of MakeHuman and MPFB2: JSON with `"weights": { "BONE": [[VERTEX, WEIGHT], ...] }`,
/// vertices counted from 0. Other keys are ignored.
fn parse_weights(file: &str, text: &str) -> Result<BTreeMap<String, Vec<(u32, f64)>>, SkinError> {
    let record: Result<WeightsRecord, _> = serde_json::from_str(text);
    record.map(|record| record.weights).map_err(|e| SkinError::Malformed {
        file: file.to_owned(),
        detail: format!("expected JSON {{\"weights\": {{\"BONE\": [[VERTEX, WEIGHT], ...]}}}}: {}", unquoted(e)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(text: &str) -> Result<SkinMesh, SkinError> {
        let read = |name: &str, _: u64| -> Result<Vec<u8>, SkinError> {
            Ok(match name {
                "m.obj" => b"v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n".to_vec(),
                "w.json" => br#"{"weights": {"pelvis": [[0, 1], [1, 1], [2, 1]]}}"#.to_vec(),
                "empty.json" => {
                    br#"{"weights": {"pelvis": [[0, 1], [1, 1], [2, 1]], "head": [[0, 0]], "tail": []}}"#.to_vec()
                }
                "short.json" => br#"{"weights": {"pelvis": [[0, 1], [1, 0.4], [2, 1]]}}"#.to_vec(),
                _ => return Err(SkinError::Unsuited(name.to_owned())),
            })
        };
        parse("s.toml", &format!("schema = \"skiagraph.skin/1\"\n{text}"), &read)
    }

    #[test]
    fn units_axes_and_landmarks_are_converted_to_metres_and_z_up() {
        let text = "mesh = \"m.obj\"\nweights = \"w.json\"\nmetres_per_unit = 0.01\nup = \"y\"\n[landmarks]\npelvis = [0, 90, 5]";
        let mesh = with(text).unwrap();
        assert_eq!(mesh.vertices[2], Point3::new(0.0, 0.0, 1.0));
        assert!((mesh.landmarks["pelvis"] - Point3::new(0.05, 0.0, 0.9)).norm() < 1e-15);
        assert_eq!(mesh.weights.unwrap()["pelvis"].len(), 3);
    }

    #[test]
    fn errors_name_the_file_and_the_key() {
        let message = |text: &str| with(text).unwrap_err().to_string();
        assert!(message("mesh = \"m.obj\"\nweights = \"short.json\"").contains("vertex 1, from 0, sum to 0.4000"));
        assert!(message("mesh = \"m.obj\"\n[landmarks]\ntail = [0, 0, 0]").contains("`tail` is not a landmark"));
        assert!(message("mesh = \"m.obj\"\nmetres_per_unit = nan").contains("metres_per_unit: expected a length"));
        assert!(message("mash = \"m.obj\"").starts_with("s.toml: "));
    }

    #[test]
    fn groups_without_weights_are_left_out_with_a_note() {
        let mesh = with("mesh = \"m.obj\"\nweights = \"empty.json\"").unwrap();
        assert_eq!(mesh.weights.unwrap().into_keys().collect::<Vec<_>>(), ["pelvis"]);
        assert_eq!(mesh.notes, ["groups of empty.json without any weight were left out: head, tail"]);
    }

    #[test]
    fn nothing_of_a_file_of_another_kind_is_quoted() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("skins")).unwrap();
        std::fs::write(folder.path().join("secret.obj"), "password: tulip\n").unwrap();
        let skin = folder.path().join("skins/s.toml");
        std::fs::write(&skin, "schema = \"skiagraph.skin/1\"\nmesh = \"../secret.obj\"").unwrap();
        let found = read_skin(&skin, &BTreeMap::new()).unwrap_err().to_string();
        assert!(found.contains("secret.obj") && !found.contains("tulip"), "{found}");
    }

    #[test]
    fn weights_are_read_by_bone_and_invalid_ones_are_refused_with_their_position() {
        let text = r#"{"name": "x", "weights": {"a": [[0, 0.5], [2, 1]], "b": []}}"#;
        let found = parse_weights("w.json", text).unwrap();
        assert_eq!(found["a"], [(0, 0.5), (2, 1.0)]);
        for wrong in ["", "[]", r#"{"weights": {"a": [[-1, 0.5]]}}"#, r#"{"weights": {"a": [0, 1]}}"#] {
            let message = parse_weights("w.json", wrong).unwrap_err().to_string();
            assert!(message.starts_with("w.json: expected JSON") && message.contains("line 1"), "{message}");
        }
    }
}
