//! One function for every parser. Whatever the bytes, the parser must return a valid value or a printable error.
//! `fuzz/` runs these functions under libFuzzer, `main.rs` next to this file with its own mutator.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use skiagraph::scenario::{ScenarioFile, TrackerSettings};
use skiagraph::train::LearnedModel;
use skiagraph_core::body::{Humanoid, mesh_from_bytes, shipped, skin_from_gltf};
use skiagraph_core::camera::{CameraFile, CameraFileFormat, read_cameras};
use skiagraph_core::npz::Npz;
use skiagraph_set::{Estimates, body_from_json, fuzzing, recordings_from_npz};
use skiagraph_truth::mocap::{
    Clip, MocapError, ReadOptions, parse_amass, parse_amc, parse_asf, parse_bvh, parse_deepmimic, parse_gltf,
    parse_markers,
};

/// A parser's target, which is given the bytes of a file.
pub type Target = fn(&[u8]);

/// Every target by its name, which is also that of its file in `fuzz/fuzz_targets/`.
pub const TARGETS: [(&str, Target); 20] = [
    ("bvh", bvh),
    ("asf", asf),
    ("amc", amc),
    ("deepmimic", deepmimic),
    ("amass", amass),
    ("c3d", c3d),
    ("trc", trc),
    ("urdf", urdf),
    ("obj", obj),
    ("stl", stl),
    ("collada", collada),
    ("gltf", gltf),
    ("scenario", scenario),
    ("manifest", manifest),
    ("cameras", cameras),
    ("camera_files", camera_files),
    ("body", body),
    ("npz", npz),
    ("poses", poses),
    ("model", model),
];

/// Divides an input into two texts; this byte does not occur in UTF-8.
pub const DIVIDER: u8 = 0xff;

/// The message fits on a screen and has no control characters, which a terminal would obey.
fn assert_printable(error: &dyn Display) {
    let message = error.to_string();
    assert!(message.chars().count() < 3000, "{} characters", message.len());
    assert!(!message.contains(|c: char| c.is_control() && c != '\n'), "{message:?}");
}

fn assert_read<T>(read: Result<T, impl Display>, check: impl FnOnce(T)) {
    match read {
        Ok(value) => check(value),
        Err(error) => assert_printable(&error),
    }
}

fn assert_clip(read: Result<Clip, MocapError>) {
    let clip = match read {
        Ok(clip) => clip,
        Err(error) => return assert_printable(&error),
    };
    assert!(clip.frames.len() >= 2 && clip.frames_per_second > 0.0);
    for transform in clip.frames.iter().flatten() {
        assert!(transform.translation.vector.iter().all(|number| number.is_finite()));
        assert!((transform.rotation.norm() - 1.0).abs() < 1e-9);
    }
    let frames = clip.frames.len();
    for changed in [clip.resampled(60.0), clip.looped(2.0), clip.crop(0..frames.min(2))] {
        assert_read(changed, drop);
    }
}

fn text(data: &[u8]) -> String {
    String::from_utf8_lossy(data).into_owned()
}

fn split_at_divider(data: &[u8]) -> (String, String) {
    let mut parts = data.splitn(2, |byte| *byte == DIVIDER).map(text);
    (parts.next().unwrap_or_default(), parts.next().unwrap_or_default())
}

/// A BVH file.
pub fn bvh(data: &[u8]) {
    assert_clip(parse_bvh(&text(data), "f", &ReadOptions::default()));
}

/// An Acclaim skeleton.
pub fn asf(data: &[u8]) {
    assert_read(parse_asf(&text(data), "f"), drop);
}

/// An Acclaim skeleton and, after the divider, its motion.
pub fn amc(data: &[u8]) {
    let (skeleton, motion) = split_at_divider(data);
    if let Ok(skeleton) = parse_asf(&skeleton, "f") {
        assert_clip(parse_amc(&motion, "f", &skeleton, &ReadOptions::default()));
    }
}

/// A DeepMimic clip.
pub fn deepmimic(data: &[u8]) {
    assert_clip(parse_deepmimic(&text(data), "f", &ReadOptions::default()));
}

/// A motion of AMASS, without a body model and with the one in the same archive.
pub fn amass(data: &[u8]) {
    let bytes = with_correct_checksums(data);
    for model in [None, Some(bytes.as_slice())] {
        assert_clip(parse_amass(&bytes, model, "f", &ReadOptions::default()));
    }
}

/// Markers of a C3D file.
pub fn c3d(data: &[u8]) {
    assert_clip(parse_markers(data, "f", &ReadOptions::default()));
}

/// Markers of a TRC file.
pub fn trc(data: &[u8]) {
    assert_clip(parse_markers(data, "f.trc", &ReadOptions::default()));
}

fn assert_body(body: &Humanoid) {
    assert_eq!(body.links.len(), body.joints.len() + 1);
    let frames = body.link_frames(&body.zero_pose());
    assert!(
        frames.0.iter().all(|frame| frame.translation.vector.iter().all(|x| x.is_finite())),
        "a link's place is not finite"
    );
    assert!(body.total_mass().is_finite());
}

/// A URDF, each of whose meshes is one triangle.
pub fn urdf(data: &[u8]) {
    let mesh = |_: &str| Ok(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec());
    assert_read(Humanoid::from_urdf(&text(data), "f", &mesh), |body| assert_body(&body));
}

fn mesh(name: &str, data: &[u8]) {
    assert_read(mesh_from_bytes(name, data), |(vertices, triangles)| {
        assert!(triangles.as_flattened().iter().all(|v| (*v as usize) < vertices.len()));
        assert!(vertices.iter().all(|v| v.iter().all(|x| x.is_finite())));
    });
}

/// A Wavefront mesh.
pub fn obj(data: &[u8]) {
    mesh("f.obj", data);
}

/// An STL mesh, text or binary.
pub fn stl(data: &[u8]) {
    mesh("f.stl", data);
}

/// A Collada mesh.
pub fn collada(data: &[u8]) {
    mesh("f.dae", data);
}

/// A skin, or an animation, from a glTF file with embedded buffers.
pub fn gltf(data: &[u8]) {
    assert_clip(parse_gltf(data, "f.glb", &ReadOptions::default(), &|_| Ok(Vec::new())));
    assert_read(skin_from_gltf("f", data), |skin| {
        let count = skin.vertices.len();
        assert!(skin.triangles.as_flattened().iter().all(|v| (*v as usize) < count));
        assert!(skin.vertices.iter().chain(skin.landmarks.values()).all(|v| v.iter().all(|x| x.is_finite())));
        let mut sums = vec![0.0; count];
        let weights = skin.weights.iter().flat_map(|weights| weights.values().flatten());
        weights.for_each(|(vertex, weight)| sums[*vertex as usize] += weight);
        assert!(sums.iter().all(|sum| (sum - 1.0_f64).abs() < 1e-9));
    });
}

/// A scenario and, after the divider, one override per line.
pub fn scenario(data: &[u8]) {
    let (text, overrides) = split_at_divider(data);
    let overrides: Vec<String> = overrides.lines().map(str::to_owned).collect();
    let read = ScenarioFile::parse(&text, "f", PathBuf::new(), &overrides);
    assert_read(read, |file| assert!(file.scenario.seeds > 0 && !file.scenario.name.is_empty()));
    assert_read(TrackerSettings::default().overridden(&overrides), drop);
}

/// A set's `set.toml`.
pub fn manifest(data: &[u8]) {
    assert_read(fuzzing::manifest(data), drop);
}

/// A set's `cameras.json`, or `truth/props.json`.
pub fn cameras(data: &[u8]) {
    assert_read(fuzzing::cameras(data), |rig| assert!(rig.cameras.iter().all(|camera| camera.validate().is_ok())));
    assert_read(fuzzing::props(data), drop);
}

/// A camera file of another program and, after the divider, the other half of its format.
pub fn camera_files(data: &[u8]) {
    let (one, other) = split_at_divider(data);
    let texts = [&one[..], &other[..]];
    let texts = if other.is_empty() { &texts[..1] } else { &texts[..] };
    let Some(format) = CameraFileFormat::from_texts(texts) else { return };
    let options = CameraFile { size_px: Some([640, 480]), ..CameraFile::default() };
    assert_read(read_cameras(texts, format, &options), |cameras| {
        assert!(!cameras.is_empty() && cameras.iter().all(|camera| camera.validate().is_ok()));
    });
}

/// A body of a set.
pub fn body(data: &[u8]) {
    assert_read(body_from_json("f", data), |body| assert_body(&body));
}

/// An archive of arrays, as it is and with corrected checksums.
pub fn npz(data: &[u8]) {
    for bytes in [data.to_vec(), with_correct_checksums(data)] {
        assert_read(Npz::from_bytes("f", &bytes), |npz| {
            let written = npz.to_bytes("f").unwrap_or_else(|error| panic!("what was read cannot be written: {error}"));
            let again = Npz::from_bytes("f", &written).and_then(|npz| npz.to_bytes("f"));
            assert!(again.is_ok_and(|again| again == written), "it is read back differently from how it was written");
        });
        assert_read(fuzzing::training(&bytes, 19), drop);
        assert_read(recordings_from_npz("f", &bytes), drop);
        if let Some(body) = smaller_body() {
            assert_read(fuzzing::spread(&bytes, body), drop);
        }
    }
}

fn smaller_body() -> Option<&'static Humanoid> {
    static BODY: LazyLock<Option<Humanoid>> = LazyLock::new(|| shipped("tracker25").ok());
    BODY.as_ref()
}

/// A run's estimates of the smaller shipped body.
pub fn poses(data: &[u8]) {
    let Some(body) = smaller_body() else { return };
    let read = Estimates::from_bytes("f", &with_correct_checksums(data), body);
    assert_read(read, |run| assert_eq!(run.seeds.len(), run.sequences.len()));
}

/// A learned model.
pub fn model(data: &[u8]) {
    assert_read(LearnedModel::from_bytes(Path::new("f"), &with_correct_checksums(data)), |model| {
        assert_body(&model.body);
        assert!(model.to_bytes().is_ok());
    });
}

/// The archive with every entry's checksum corrected: otherwise the checksums would reject every changed byte.
fn with_correct_checksums(data: &[u8]) -> Vec<u8> {
    let mut bytes = data.to_vec();
    let half = |bytes: &[u8], at: usize| Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize);
    let word = |bytes: &[u8], at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize);
    let places: Vec<usize> =
        bytes.windows(4).enumerate().filter(|(_, w)| *w == b"PK\x01\x02").map(|(at, _)| at).collect();
    for at in places {
        let entry = || {
            let (offset, size) = (word(&bytes, at + 42)?, word(&bytes, at + 24)?);
            let start = offset + 30 + half(&bytes, offset + 26)? + half(&bytes, offset + 28)?;
            bytes.get(start..)?.get(..size).map(crc32fast::hash)
        };
        if let Some(checksum) = entry() {
            bytes[at + 16..at + 20].copy_from_slice(&checksum.to_le_bytes());
        }
    }
    bytes
}
