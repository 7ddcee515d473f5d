//! `verify` finds every planted fault, names the file, and finds no fault in a set as written.
//!
//! The faults are data, `planted_faults.jsonl`: a row says what is changed in which set, and which check names which
//! file. The list of hashes is made again after each change, so that only the content reveals it; except in the rows of
//! the check `hashes`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use serde_json::Value;

use super::{CHECKS, Fault, VerifyOptions, verify};
use crate::made_up_set::{self, assemble_among, camera};
use crate::{BenchmarkSet, TruthImage};
use skiagraph_core::body::{Humanoid, Motion, Prop, Solid, shipped};
use skiagraph_core::camera::{Camera, CameraKeyframe, CameraPath, CameraRig, CameraTiming, TimedRig};
use skiagraph_core::input::{files_below, hex_sha256, listing_of};
use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_truth::scene::Distractor;

const FRAMES: usize = 5;
const SIZE: [u32; 2] = [64, 48];
const TRUTH: &str = "truth/truth.npz";
const MASK: &str = "observations/cam01/silhouette/000002.png";

#[derive(Debug, Deserialize)]
enum Change {
    /// The first occurrence of a text.
    Text(String, String),
    /// Adds to an element of an array of numbers (`None`: NaN), or inverts a flag.
    Element(String, usize, Option<f64>),
    /// Multiplies all elements of an array of numbers.
    Times(String, f64),
    /// Every row is that of the frame before; the first stays.
    Late(String),
    /// Exchanges the first two names of an array.
    Names(String),
    Without(String),
    /// Adds an array with the numbers of one of `truth.npz`.
    With(String),
    /// Adds to the number at a JSON pointer, or replaces another value.
    Json(String, f64),
    /// Adds a key to the object at a JSON pointer.
    Key(String),
    Pixel(usize),
    /// Mirrors an image left to right.
    Mirror,
    /// The first half of the bytes.
    Cut,
    Bytes(String),
    /// Bytes after the last one.
    Longer(String),
    /// The content of another file.
    From(String),
    Removed,
    Pipe,
    /// A link to the same file outside the set.
    Link,
    /// A file of a terabyte, which takes no space.
    Huge,
}

use Change::*;

/// A planted fault: the set, the file, its change, the check that finds it, the file that it names, and words of it.
type Row = (String, String, Change, String, String, String);

fn rows() -> Vec<Row> {
    include_str!("planted_faults.jsonl").lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn cameras() -> Vec<Camera> {
    let lens = [-0.18, 0.06, 0.002, -0.001, -0.01];
    vec![camera("front", [3.0, 0.8, 1.3], [0.0; 5], SIZE), camera("lens", [-1.0, 2.8, 1.6], lens, SIZE)]
}

/// The body moves forward, turns a little and swings every joint differently.
fn motion() -> Motion {
    let root = |frame: usize| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3 + 0.05 * frame as f64);
        Isometry3::from_parts(Translation3::new(0.06 * frame as f64, 0.1, 0.97), turn)
    };
    let angle = |frame: usize, i: usize| 0.15 * ((7 * i) as f64 + 0.35 * frame as f64).sin();
    made_up_set::motion(&actor(), FRAMES, 30.0, root, angle)
}

/// The first camera moves; the second takes every other image, late and with a rolling shutter.
fn filming() -> TimedRig {
    let keyframe = |time_s: f64, position: [f64; 3]| CameraKeyframe {
        time_s,
        position,
        look_at: [0.1, 0.0, 1.0],
        roll: 0.5 * time_s,
    };
    let way = vec![keyframe(0.0, [3.0, 0.8, 1.3]), keyframe(0.08, [2.9, 0.3, 1.5]), keyframe(0.2, [2.5, -0.5, 1.2])];
    let path = CameraPath::new("front", way).unwrap();
    let late = CameraTiming { every: 2, offset_s: 0.013, line_delay_s: 1e-4 };
    TimedRig::new(CameraRig { cameras: cameras() }, vec![Some(path)], vec![CameraTiming::default(), late]).unwrap()
}

fn actor() -> Humanoid {
    shipped("actor").unwrap()
}

/// An actor with a tetrahedron as head: its marker at the top is outside.
fn with_tetrahedron() -> Humanoid {
    let mut body = actor();
    let head = body.links.iter_mut().find(|link| link.name == "head").unwrap();
    let vertices = [[0.1, 0.0, 0.0], [-0.05, 0.09, 0.0], [-0.05, -0.09, 0.0], [0.0, 0.0, 0.15]].map(Point3::from);
    let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    head.solids = vec![Solid::Mesh { vertices: vertices.to_vec(), triangles }];
    body
}

/// A set of this actor, with these people and props besides it.
fn made(
    name: &str,
    actor: Humanoid,
    rig: &TimedRig,
    settings: &str,
    props: Vec<Prop>,
    others: Vec<Distractor>,
) -> BenchmarkSet {
    let settings = toml::from_str(settings).unwrap();
    assemble_among(name, actor, rig, &motion(), &settings, props, others)
}

/// The sets of the rows, written below `folder`.
fn write_sets(folder: &Path) {
    use TruthImage::{Colour, Coverage, Depth, Flow, Normals, Parts};
    let still = TimedRig::from(&CameraRig { cameras: cameras() });
    let exact = made("exact", actor(), &still, "", Vec::new(), Vec::new());
    exact.write_with_truth_images(&folder.join("exact"), &[Depth, Parts, Normals, Flow, Coverage, Colour]).unwrap();
    let corrupted = "silhouette = \"corrupted\"\nseed = 5\nkey = \"ffeeddccbbaa99887766554433221100\"\n\
                     keypoints = { layout = \"coco17\", slow_percent = 1.0, missing = 0.1 }\n\
                     corruption = { boundary_px = 1.5, holes = 0.05, start_mm = 20.0, calibration_mm = 9.0 }";
    let corrupted = made("corrupted", actor(), &still, corrupted, Vec::new(), Vec::new());
    corrupted.write(&folder.join("corrupted")).unwrap();
    let images = "silhouette = \"segmented\"\nseed = 4\ncolour_images = \"png\"\n\
                  images = { clothing_contrast = 100.0, background_frames = 3 }";
    made("images", actor(), &still, images, Vec::new(), Vec::new()).write(&folder.join("images")).unwrap();
    let filmed = made("filmed", actor(), &filming(), "", Vec::new(), Vec::new());
    filmed.write_with_truth_images(&folder.join("filmed"), &[Depth]).unwrap();
    let other = |name: &str, y: f64| {
        let mut poses = motion().poses;
        poses.iter_mut().for_each(|pose| pose.world_from_root.translation.y += y);
        Distractor { name: name.to_owned(), body: actor(), poses }
    };
    let place = Isometry3::translation(0.9, 0.3, 0.8);
    let solid = Solid::Cylinder { link_from_cylinder: place, radius: 0.1, half_length: 0.8 };
    let post = vec![Prop { name: "post".to_owned(), solid }];
    let people = made("people", actor(), &still, "", post, vec![other("left", 0.8), other("right", -0.9)]);
    people.write_with_truth_images(&folder.join("people"), &[TruthImage::Parts]).unwrap();
    let tetrahedron = made("tetrahedron", with_tetrahedron(), &still, "", Vec::new(), Vec::new());
    tetrahedron.write_with_truth_images(&folder.join("tetrahedron"), &[Depth]).unwrap();
}

/// Adds to an element, or inverts a flag.
fn with_element(values: &mut Values, index: usize, by: f64) {
    match values {
        Values::F64(values) => values[index] += by,
        Values::F32(values) => values[index] += by as f32,
        Values::I64(values) => values[index] += by as i64,
        Values::U8(values) => values[index] += by as u8,
        Values::Bool(values) => values[index] = !values[index],
        Values::Text(_) => panic!("texts are no numbers"),
    }
}

fn changed_npz(bytes: &[u8], array: &str, change: impl FnOnce(&mut Array)) -> Vec<u8> {
    let npz = Npz::from_bytes("x", bytes).unwrap();
    let mut arrays: Vec<(String, Array)> = npz.iter().map(|(name, array)| (name.to_owned(), array.clone())).collect();
    change(&mut arrays.iter_mut().find(|(name, _)| name == array).unwrap().1);
    arrays.iter().map(|(name, array)| (name.as_str(), array.clone())).collect::<Npz>().to_bytes("x").unwrap()
}

/// Decodes a PNG, changes its samples, and encodes it again.
fn changed_png(bytes: &[u8], change: impl FnOnce(&mut [u8], usize)) -> Vec<u8> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    change(&mut pixels, info.line_size);
    let mut encoded = Vec::new();
    let mut encoder = png::Encoder::new(&mut encoded, info.width, info.height);
    encoder.set_color(info.color_type);
    encoder.set_depth(info.bit_depth);
    encoder.set_compression(png::Compression::Fastest);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&pixels).unwrap();
    writer.finish().unwrap();
    encoded
}

/// The bytes of the file after a change.
fn changed(folder: &Path, file: &str, change: &Change) -> Vec<u8> {
    let before = || fs::read(folder.join(file)).unwrap();
    match change {
        Text(from, to) => {
            let text = String::from_utf8(before()).unwrap();
            assert!(text.contains(from.as_str()), "{file} has no {from}");
            text.replacen(from.as_str(), to, 1).into_bytes()
        }
        Element(array, index, by) => {
            changed_npz(&before(), array, |own| with_element(&mut own.values, *index, by.unwrap_or(f64::NAN)))
        }
        Times(array, factor) => changed_npz(&before(), array, |own| {
            let Values::F64(values) = &mut own.values else { panic!("{array}") };
            values.iter_mut().for_each(|value| *value *= *factor);
        }),
        Late(array) => changed_npz(&before(), array, |own| {
            let Values::F64(values) = &mut own.values else { panic!("{array}") };
            let row = values.len() / FRAMES;
            values.rotate_right(row);
            values.copy_within(row..2 * row, 0);
        }),
        Names(array) => changed_npz(&before(), array, |own| {
            let Values::Text(names) = &mut own.values else { panic!("{array}") };
            names.swap(0, 1);
        }),
        Without(array) => {
            let npz = Npz::from_bytes("x", &before()).unwrap();
            assert!(npz.get(array).is_some(), "{file} has no {array}");
            let rest = npz.iter().filter(|(name, _)| *name != array).map(|(name, own)| (name, own.clone()));
            rest.collect::<Npz>().to_bytes("x").unwrap()
        }
        With(array) => {
            let truth = Npz::from_bytes("x", &fs::read(folder.join(TRUTH)).unwrap()).unwrap();
            let mut npz =
                fs::read(folder.join(file)).map_or_else(|_| Npz::default(), |b| Npz::from_bytes("x", &b).unwrap());
            npz.push(&format!("more_{array}"), truth.get(array).unwrap().clone());
            npz.to_bytes("x").unwrap()
        }
        Json(pointer, by) => {
            let mut value: Value = serde_json::from_slice(&before()).unwrap();
            let number = value.pointer_mut(pointer).unwrap_or_else(|| panic!("{file} has no {pointer}"));
            *number = (number.as_f64().unwrap() + by).into();
            serde_json::to_vec_pretty(&value).unwrap()
        }
        Key(pointer) => {
            let mut value: Value = serde_json::from_slice(&before()).unwrap();
            value.pointer_mut(pointer).unwrap()["pose"] = 1.into();
            serde_json::to_vec_pretty(&value).unwrap()
        }
        Pixel(index) => changed_png(&before(), |pixels, _| pixels[*index] = 255 - pixels[*index]),
        Mirror => changed_png(&before(), |pixels, line| pixels.chunks_mut(line).for_each(<[u8]>::reverse)),
        Cut => before()[..before().len() / 2].to_vec(),
        Bytes(text) => text.as_bytes().to_vec(),
        Longer(text) => [&before()[..], text.as_bytes()].concat(),
        From(other) => fs::read(folder.join(other)).unwrap(),
        Removed | Pipe | Link | Huge => Vec::new(),
    }
}

/// Plants a fault; `elsewhere` is a folder outside the set.
fn plant(folder: &Path, elsewhere: &Path, file: &str, change: &Change) {
    let (path, bytes) = (folder.join(file), changed(folder, file, change));
    match change {
        Removed => fs::remove_file(path).unwrap(),
        Pipe => {
            drop(fs::remove_file(&path));
            assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        }
        Link => {
            let moved = elsewhere.join("moved");
            fs::rename(&path, &moved).unwrap();
            std::os::unix::fs::symlink(&moved, &path).unwrap();
        }
        Huge => fs::File::create(path).unwrap().set_len(1 << 40).unwrap(),
        _ => fs::write(path, bytes).unwrap(),
    }
}

/// Makes the list of hashes again, as if the set had been written like this.
pub(crate) fn sign(folder: &Path) {
    let files = files_below(folder).unwrap().into_iter().filter(|file| file != "files.sha256");
    let hashes: BTreeMap<String, String> =
        files.map(|file| (file.clone(), hex_sha256(&fs::read(folder.join(file)).unwrap()))).collect();
    fs::write(folder.join("files.sha256"), listing_of(&hashes)).unwrap();
}

fn copy(from: &Path, to: &Path) {
    for file in files_below(from).unwrap() {
        let target = to.join(&file);
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(from.join(&file), target).unwrap();
    }
}

/// Why a row is not found as it says; `None` if it is.
fn wrong_row(sets: &Path, row: &Row) -> Option<String> {
    let (set, file, change, check, place, words) = row;
    let root = tempfile::tempdir().unwrap();
    let folder: PathBuf = root.path().join("set");
    copy(&sets.join(set), &folder);
    plant(&folder, root.path(), file, change);
    if check != "hashes" {
        sign(&folder);
    }
    let found = verify(&folder, VerifyOptions::default()).unwrap();
    let all: Vec<_> = found.faults().collect();
    let is_it =
        |(name, fault): &(&str, &Fault)| name == check && fault.file == *place && fault.detail.contains(words.as_str());
    // observations were "exact" beside a damaged or removed image
    let is_seen = file != MASK || all.iter().any(|(name, _)| *name == "observations");
    let is_signed = check == "hashes" || all.iter().all(|(name, _)| *name != "hashes");
    let few: Vec<_> = all.iter().take(6).collect();
    (!all.iter().any(is_it) || !is_seen || !is_signed || found.is_sound()).then(|| format!("{row:?}\n    {few:#?}"))
}

// Every fault of the table is found by the check that it is planted for, and every check has one.
#[cfg(unix)]
#[test]
fn planted_faults_are_found_by_every_check() {
    let sets = tempfile::tempdir().unwrap();
    write_sets(sets.path());
    for set in ["exact", "corrupted", "images", "filmed", "people", "tetrahedron"] {
        let found = verify(&sets.path().join(set), VerifyOptions::default()).unwrap();
        assert!(found.is_sound() && found.is_complete(), "{set}: {found:#?}");
        assert_eq!((found.name.as_str(), found.checks.len()), (set, CHECKS.len()));
    }
    let rows = rows();
    let planted: BTreeSet<&str> = rows.iter().map(|row| row.3.as_str()).collect();
    assert_eq!(planted, CHECKS.iter().map(|(name, _)| *name).collect());
    let wrong = skiagraph_core::parallel::map(rows.len(), |index| wrong_row(sets.path(), &rows[index]));
    let wrong: Vec<String> = wrong.into_iter().flatten().collect();
    assert!(wrong.is_empty(), "{} of {} rows:\n{}", wrong.len(), rows.len(), wrong.join("\n"));
}

// A folder that is not a set of this format is an error, not a fault.
#[test]
fn other_folders_are_refused() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("set");
    let still = TimedRig::from(&CameraRig { cameras: cameras() });
    made("set", actor(), &still, "", Vec::new(), Vec::new()).write(&folder).unwrap();
    let error = |folder: &Path| verify(folder, VerifyOptions::default()).unwrap_err().to_string();
    fs::write(folder.join("files.sha256"), "").unwrap();
    assert!(verify(&folder, VerifyOptions::default()).unwrap().checks[2].looked_at.ends_with("lists no set.toml"));
    let text = fs::read_to_string(folder.join("set.toml")).unwrap();
    fs::write(folder.join("set.toml"), text.replace("skiagraph.set/1", "skiagraph.set/9")).unwrap();
    let newer = error(&folder);
    assert!(newer.contains("skiagraph.set/9") && newer.contains("use the version of skiagraph"), "{newer}");
    fs::remove_file(folder.join("files.sha256")).unwrap();
    assert!(error(&folder).contains("is not a complete benchmark set: it has no files.sha256"));
    assert!(error(&root.path().join("nowhere")).contains("No such file"));
}
