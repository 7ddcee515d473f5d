//! Opens a glTF 2.0 file: the document without all that does not touch the shape, the buffers, and VRM's map of bones.
//! The `gltf` crate validates the document.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde_json::Value;

use super::gltf_numbers::Buffers;
use super::mesh::SkinError;
use crate::input::{excerpt, foreign, unquoted};

const MOST_NODES: usize = 1_000_000;

/// Extensions that pack the geometry.
const PACKING: [&str; 3] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Words in names of extensions that do not touch the shape, or that are read here.
const HARMLESS: [&str; 13] = [
    "material",
    "texture",
    "light",
    "audio",
    "xmp",
    "metadata",
    "physics",
    "collision",
    "spring",
    "constraint",
    "packing",
    "khr_mesh_quantization",
    "khr_animation_pointer",
];

/// Parts of the document that are not read.
const UNUSED: [&str; 6] = ["materials", "textures", "images", "samplers", "cameras", "extensions"];

/// Beginnings of files that are renamed to `.glb`, and what they are.
const OTHER_FORMATS: [(&[u8], &str); 4] =
    [(b"Kaydara FBX Binary", "FBX"), (b"; FBX", "FBX"), (b"PK\x03\x04", "a zip archive"), (b"<?xml", "XML")];

/// A command that converts FBX, which is not read, to what is.
#[doc(hidden)]
pub const FBX_TO_GLB: &str = "blender --background --python-expr \"import bpy; \
    bpy.ops.wm.read_factory_settings(use_empty=True); bpy.ops.import_scene.fbx(filepath='in.fbx'); \
    bpy.ops.export_scene.gltf(filepath='out.glb')\"";

type BinaryChunk<'a> = Option<Cow<'a, [u8]>>;

pub(super) struct GltfFile {
    pub(super) document: gltf::Document,
    pub(super) buffers: Buffers,
    /// Nodes of VRM's bones (`leftUpperLeg`), if the file has such a map.
    pub(super) humanoid: BTreeMap<String, usize>,
    /// Whether it is a VRM 0 file, whose bodies face -Z.
    pub(super) is_vrm0: bool,
}

impl GltfFile {
    /// Opens a file; `read` returns the contents of referenced buffer files.
    pub(super) fn open(
        file: &str,
        bytes: &[u8],
        read: &dyn Fn(&str) -> Result<Vec<u8>, SkinError>,
    ) -> Result<Self, SkinError> {
        let (mut gltf, blob) = Self::without_buffers(file, bytes)?;
        for buffer in gltf.document.buffers() {
            gltf.buffers.push(buffer_bytes(file, &buffer, blob.as_deref(), read)?);
        }
        Ok(gltf)
    }

    /// The document alone, and the binary chunk of the file.
    pub(super) fn without_buffers<'a>(file: &str, bytes: &'a [u8]) -> Result<(Self, BinaryChunk<'a>), SkinError> {
        let malformed = |detail: String| SkinError::Malformed { file: file.to_owned(), detail };
        for (beginning, what) in OTHER_FORMATS {
            if bytes.starts_with(beginning) {
                let remedy = if what == "FBX" { format!("; convert it: {FBX_TO_GLB}") } else { String::new() };
                return Err(malformed(format!("expected glTF 2.0, found {what}{remedy}")));
            }
        }
        // the crate subtracts the header's length from the length that a .glb states
        let length = bytes.get(8..12).and_then(|own| own.first_chunk()).map_or(0, |own| u32::from_le_bytes(*own));
        if bytes.starts_with(b"glTF") && length < 12 {
            return Err(malformed("expected glTF 2.0, found a header without content".to_owned()));
        }
        let not_gltf = |detail: String| malformed(format!("expected glTF 2.0: {}", excerpt(&detail)));
        let (text, blob) = if bytes.starts_with(b"glTF") {
            let glb = gltf::Glb::from_slice(bytes).map_err(|error| not_gltf(foreign(error)))?;
            (glb.json, glb.bin)
        } else {
            (bytes.into(), None)
        };
        let mut root: Value = serde_json::from_slice(&text).map_err(|error| not_gltf(unquoted(error)))?;
        check_extensions(&root).map_err(malformed)?;
        let (humanoid, is_vrm0) = humanoid(&root);
        leave_shape(&mut root);
        let document = document(root).map_err(not_gltf)?;
        if document.nodes().len() > MOST_NODES {
            return Err(malformed(format!("{} nodes; expected at most {MOST_NODES}", document.nodes().len())));
        }
        if document.buffers().len() > 16 {
            return Err(malformed(format!("{} buffers; expected at most 16", document.buffers().len())));
        }
        Ok((Self { document, buffers: Buffers::new(), humanoid, is_vrm0 }, blob))
    }
}

/// Refuses required extensions that pack geometry, or that are unknown.
fn check_extensions(root: &Value) -> Result<(), String> {
    for name in root["extensionsRequired"].as_array().into_iter().flatten().filter_map(Value::as_str) {
        if PACKING.contains(&name) {
            return Err(format!(
                "its geometry is packed by the required extension {name}, which is not read; unpack it: npx \
                 @gltf-transform/cli copy packed.glb unpacked.glb"
            ));
        }
        let lower = name.to_ascii_lowercase();
        if !lower.starts_with("vrm") && !HARMLESS.iter().any(|word| lower.contains(word)) {
            return Err(format!(
                "it requires the extension {}, which is not known; export the file without it, or remove its name \
                 from `extensionsRequired` if it does not touch the shape",
                excerpt(name)
            ));
        }
    }
    Ok(())
}

/// The nodes of VRM's bones, and whether the file is of version 0.
fn humanoid(root: &Value) -> (BTreeMap<String, usize>, bool) {
    let mut bones = BTreeMap::new();
    let mut put = |name: Option<&str>, bone: &Value| {
        if let (Some(name), Some(node)) = (name, bone["node"].as_u64()) {
            bones.insert(name.to_owned(), node as usize);
        }
    };
    let extensions = &root["extensions"];
    let is_vrm0 = extensions["VRM"].is_object() && !extensions["VRMC_vrm"].is_object();
    for name in ["VRM", "VRMC_vrm", "VRMC_vrm_animation"] {
        match &extensions[name]["humanoid"]["humanBones"] {
            Value::Object(named) => named.iter().for_each(|(name, bone)| put(Some(name), bone)),
            Value::Array(listed) => listed.iter().for_each(|bone| put(bone["bone"].as_str(), bone)),
            _ => {}
        }
    }
    (bones, is_vrm0)
}

/// Removes what the crate might reject although the shape does not depend on it.
fn leave_shape(root: &mut Value) {
    let Some(own) = root.as_object_mut() else { return };
    UNUSED.iter().chain(&["extensionsRequired", "extensionsUsed"]).for_each(|key| drop(own.remove(*key)));
    let is_read = |name: &str| name == "POSITION" || name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_");
    let mut each = |list: &str, change: &mut dyn FnMut(&mut serde_json::Map<String, Value>)| {
        let items = own.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten();
        items.filter_map(Value::as_object_mut).for_each(change);
    };
    each("nodes", &mut |node| ["camera", "extensions"].iter().for_each(|key| drop(node.remove(*key))));
    each("meshes", &mut |mesh| {
        let primitives = mesh.get_mut("primitives").and_then(Value::as_array_mut).into_iter().flatten();
        for primitive in primitives.filter_map(Value::as_object_mut) {
            ["material", "extensions"].iter().for_each(|key| drop(primitive.remove(*key)));
            if let Some(attributes) = primitive.get_mut("attributes").and_then(Value::as_object_mut) {
                attributes.retain(|name, _| is_read(name));
            }
        }
    });
    // an animation may turn a light or a material, which has no node
    each("animations", &mut |animation| {
        if let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) {
            let paths = ["translation", "rotation", "scale"];
            channels.retain(|channel| channel["target"]["path"].as_str().is_some_and(|path| paths.contains(&path)));
            channels.retain(|channel| channel["target"]["node"].is_u64());
        }
    });
}

/// The validated document.
fn document(root: Value) -> Result<gltf::Document, String> {
    let root: gltf::json::Root = serde_json::from_value(root).map_err(unquoted)?;
    // the validation looks up attributes without checking that they exist
    let attributes = root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|own| own.attributes.values());
    if let Some(astray) = attributes.map(|index| index.value()).find(|index| *index >= root.accessors.len()) {
        let last = root.accessors.len().saturating_sub(1);
        return Err(format!("an attribute refers to accessor {astray}; expected 0 to {last}"));
    }
    // nor does it look at the nodes that are animated
    let mut targets = root.animations.iter().flat_map(|own| &own.channels).map(|channel| channel.target.node.value());
    if let Some(astray) = targets.find(|node| *node >= root.nodes.len()) {
        let last = root.nodes.len().saturating_sub(1);
        return Err(format!("an animation moves node {astray}; expected 0 to {last}"));
    }
    gltf::Document::from_json(root).map_err(foreign)
}

/// The file of a buffer beside the document, if it has one.
pub(super) fn file_of(buffer: &gltf::Buffer<'_>) -> Option<String> {
    match buffer.source() {
        gltf::buffer::Source::Uri(uri) if !uri.contains(':') => Some(decoded(uri)),
        _ => None,
    }
}

/// The bytes of a buffer, from the file itself, its text or a separate file.
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
            let encoded = uri.split_once(";base64,").map(|(_, encoded)| encoded);
            encoded.and_then(from_base64).ok_or_else(|| {
                malformed(format!("buffer {} is embedded as text, but not as base64; save it as .glb", buffer.index()))
            })?
        }
        gltf::buffer::Source::Uri(uri) if uri.contains(':') => {
            return Err(malformed(format!("buffer `{}` is no file beside this one; save it as .glb", excerpt(uri))));
        }
        gltf::buffer::Source::Uri(uri) => read(&decoded(uri))?,
    };
    if bytes.len() < buffer.length() {
        let (found, expected) = (bytes.len(), buffer.length());
        return Err(malformed(format!("buffer {}: expected {expected} bytes, found {found}", buffer.index())));
    }
    Ok(bytes)
}

fn from_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut held, mut bits) = (0_u32, 0);
    for letter in text.trim_end_matches('=').bytes() {
        let value = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        held = held << 6 | u32::from(value);
        bits += 6;
        if bits >= 8 {
            bits -= 8;
            bytes.push((held >> bits) as u8);
        }
    }
    Some(bytes)
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
