//! `verify` finds every planted fault, names the file, and finds no fault in a set as written.
//!
//! The faults are data: a row says what is changed in which set, and which check names which file. The list of hashes
//! is made again after each change, so that only the content reveals it; except in the rows of the check `hashes`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;

use super::{CHECKS, VerifyOptions, verify};
use crate::{BenchmarkSet, SetParts, Start, Training, TruthFacts, TruthImage};
use skiagraph_core::body::{Humanoid, Motion, Prop, Solid, shipped};
use skiagraph_core::camera::{
    Camera, CameraKeyframe, CameraPath, CameraRig, CameraTiming, Distortion, FieldOfView, TimedRig,
};
use skiagraph_core::input::{files_below, hex_sha256, listing_of};
use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_truth::observing::{ObservationSettings, SilhouetteObserver, tracker_start};
use skiagraph_truth::scene::{Distractor, GroundTruth};

const FRAMES: usize = 5;
const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;
const TRUTH: &str = "truth/truth.npz";
const VIEWS: &str = "truth/views.npz";
const MASK: &str = "observations/cam01/silhouette/000002.png";
const LAYER: &str = "truth/layers/cam00/000001.exr";
const DEPTH: &str = "truth/layers/cam00/000001-depth.png";

/// A change of a file.
#[derive(Clone, Copy, Debug)]
enum Change {
    /// The first occurrence of a text.
    Text(&'static str, &'static str),
    /// Adds to an element of an array of numbers, or inverts a flag.
    Element(&'static str, usize, f64),
    /// Multiplies all elements of an array of numbers.
    Times(&'static str, f64),
    /// Every row is that of the frame before; the first stays.
    Late(&'static str),
    /// Exchanges the first two names of an array.
    Names(&'static str),
    /// Removes an array.
    Without(&'static str),
    /// Adds an array with the numbers of one of `truth.npz`.
    With(&'static str),
    /// Adds to the number at a JSON pointer, or replaces another value.
    Json(&'static str, f64),
    /// Adds a key to the object at a JSON pointer.
    Key(&'static str),
    /// Inverts a pixel.
    Pixel(usize),
    /// Mirrors an image left to right.
    Mirror,
    /// The first half of the bytes.
    Cut,
    /// Other bytes.
    Bytes(&'static str),
    /// Bytes after the last one.
    Longer(&'static str),
    /// The content of another file.
    From(&'static str),
    /// No such file.
    Removed,
    /// A pipe in place of the file.
    Pipe,
    /// A link to the same file outside the set.
    Link,
    /// A file of a terabyte, which takes no space.
    Huge,
}

use Change::*;

/// A planted fault: the set, the file, its change, the check that finds it, the file that it names, and words of it.
type Row = (&'static str, &'static str, Change, &'static str, &'static str, &'static str);

#[rustfmt::skip]
const ROWS: &[Row] = &[
    // the files, with the hashes of the files before
    ("exact", "cameras.json", Text("0.002", "0.003"), "hashes", "cameras.json", "changed or truncated"),
    ("exact", MASK, Cut, "hashes", MASK, "changed or truncated"),
    ("exact", MASK, Removed, "hashes", MASK, "No such file"),
    ("exact", MASK, Pipe, "hashes", MASK, "expected a regular file"),
    ("exact", MASK, Huge, "hashes", MASK, "the limit for a file of this kind"),
    ("exact", "start/body.json", Link, "hashes", "start/body.json", "leads out of the set"),
    ("exact", "start/notes.txt", Bytes("x"), "hashes", "start/notes.txt", "does not list it"),
    ("exact", "observations/more", Pipe, "hashes", "observations/more", "does not list it"),
    ("exact", "observations/much.npz", Huge, "hashes", "observations/much.npz", "does not list it"),
    // what cannot be read, or does not fit together
    ("exact", "set.toml", Text("frames = 5", "frames = 4"), "formats", TRUTH, "5 frames, set.toml says 4"),
    ("exact", "set.toml", Text("cameras = 2", "cameras = 3"), "formats", "cameras.json", "2 cameras, set.toml says 3"),
    ("exact", TRUTH, Cut, "formats", TRUTH, ""),
    ("exact", TRUTH, Bytes("no zip"), "formats", TRUTH, ""),
    ("exact", TRUTH, Without("joints"), "formats", TRUTH, "joints"),
    ("exact", "truth/actor.json", Cut, "formats", "truth/actor.json", ""),
    ("exact", "truth/facts.toml", Text("matched", "note = 1\nmatched"), "formats", "truth/facts.toml", "unknown field"),
    ("exact", "start/start.json", Cut, "formats", "start/start.json", ""),
    ("exact", "start/spread.npz", Element("change", 3, 1e300), "formats", "start/spread.npz", "root mean squares"),
    ("exact", "cameras.json", Json("/cameras/0/K/0/0", -1e4), "formats", "cameras.json", ""),
    ("exact", "cameras.json", Json("/cameras/1/R/0/1", 0.1), "formats", "cameras.json", "R is not a rotation"),
    ("corrupted", "truth/key.txt", Bytes("nonsense\n"), "formats", "truth/key.txt", "expected 32"),
    ("filmed", "cameras.npz", Removed, "formats", "", "lists no cameras.npz"),
    ("filmed", "cameras.npz", Element("time_s", 5, -1.0), "given", "cameras.npz", "time_s"),
    ("people", "truth/distractors.npz", Without("01_root"), "formats", "truth/distractors.npz", "01_root"),
    ("people", "truth/props.json", Bytes("{}"), "formats", "truth/props.json", ""),
    // the files that trackers may read, and nothing else in them
    ("exact", "start/prior.npz", With("angles"), "blindfold", "start/prior.npz", "trackers may read"),
    ("exact", "start/spread.npz", With("angles"), "blindfold", "start/spread.npz", "angles"),
    ("exact", "start/body.json", Text("\"notes\": [", "\"notes\": [ "), "blindfold", "start/body.json", "line"),
    ("exact", "observations/cam00/silhouette/000005.png", From(MASK), "blindfold", "observations/cam00/silhouette/000005.png", "trackers may read"),
    ("exact", MASK, Longer("pose"), "blindfold", MASK, "byte"),
    ("exact", MASK, Removed, "blindfold", MASK, "is missing"),
    ("exact", "set.toml", Text("Z up", "Y up"), "blindfold", "set.toml", "Y up"),
    ("exact", "set.toml", Text("name = ", "note = 1\nname = "), "blindfold", "set.toml", "note"),
    ("exact", "cameras.json", Text("y down, z forward", "y up, z backward"), "blindfold", "cameras.json", "y up"),
    ("exact", "cameras.json", Key("/cameras/0"), "formats", "cameras.json", "unknown field"),
    ("images", "observations/colour/cam01/000002.png", Longer("pose"), "blindfold", "observations/colour/cam01/000002.png", "byte"),
    ("filmed", "observations/cam01/silhouette/000003.png", From(MASK), "blindfold", "observations/cam01/silhouette/000003.png", "trackers may read"),
    ("corrupted", "observations/keypoints.npz", With("angles"), "blindfold", "observations/keypoints.npz", "angles"),
    // what trackers are given before the first frame
    ("exact", "set.toml", Text("frames_per_second = 30.0", "frames_per_second = 60.0"), "given", "set.toml", "30.0"),
    ("exact", "set.toml", Text("forward = [0.", "forward = [-0."), "given", "set.toml", "forward"),
    ("exact", "start/start.json", Json("/root/position/0", 0.005), "given", "start/start.json", "line"),
    ("exact", "start/body.json", Json("/links/0/inertia/mass", 1.0), "given", "truth/facts.toml", "different"),
    ("corrupted", "start/start.json", Json("/angles/4", 0.01), "given", "start/start.json", "line"),
    ("corrupted", "set.toml", Text("start_mm = 20.0", "start_mm = 30.0"), "given", "start/start.json", "line"),
    ("corrupted", "truth/facts.toml", Text("observation_seed = 5", "observation_seed = 6"), "given", "cameras.json", "line"),
    ("corrupted", "cameras.json", Json("/cameras/1/K/0/0", 0.5), "given", "cameras.json", "line"),
    ("filmed", "cameras.npz", Element("camera_from_world", 21, 0.004), "given", "cameras.npz", "camera_from_world"),
    ("filmed", "cameras.npz", Late("camera_from_world"), "given", "cameras.npz", "camera_from_world"),
    ("filmed", "cameras.npz", Element("line_delay_s", 1, 1e-6), "given", "cameras.npz", "line_delay_s"),
    // what follows from bodies, poses and cameras
    ("exact", TRUTH, Element("joints", 40, f64::NAN), "truth", TRUTH, "joints"),
    ("exact", TRUTH, Element("link_frames", 70, 1e-9), "truth", TRUTH, "link_frames"),
    ("exact", TRUTH, Times("markers", 1000.0), "truth", TRUTH, "markers"),
    ("exact", TRUTH, Late("joints"), "truth", TRUTH, "joints"),
    ("exact", TRUTH, Late("refitted_angles"), "truth", TRUTH, "refitted_angles"),
    ("exact", TRUTH, Element("root", 21, 0.01), "truth", TRUTH, "link_frames"),
    ("exact", TRUTH, Element("in_view", 17, 1.0), "truth", TRUTH, "in_view"),
    ("exact", TRUTH, Element("visible", 20, 1.0), "truth", TRUTH, "visible"),
    ("exact", TRUTH, Element("parents", 2, 1.0), "truth", TRUTH, "parents"),
    ("exact", TRUTH, Names("camera_names"), "truth", TRUTH, "camera_names"),
    ("exact", TRUTH, Names("refitted_angle_names"), "truth", TRUTH, "refitted_angle_names"),
    ("exact", TRUTH, With("angles"), "truth", TRUTH, "does not belong"),
    ("exact", "truth/actor.json", Json("/links/0/inertia/mass", 1.0), "given", "truth/facts.toml", "different"),
    ("exact", VIEWS, Cut, "truth", VIEWS, "cannot be read"),
    ("exact", VIEWS, Bytes("no zip"), "truth", VIEWS, "cannot be read"),
    ("exact", VIEWS, Without("joints_2d"), "truth", VIEWS, "the array joints_2d is missing"),
    ("exact", VIEWS, Removed, "truth", VIEWS, "is missing"),
    ("exact", VIEWS, Element("joint_sight", 8, 1.0), "truth", VIEWS, "joint_sight"),
    ("exact", VIEWS, Names("sight_names"), "truth", VIEWS, "sight_names"),
    ("exact", "truth/contact.npz", Element("gap", 4, 0.01), "truth", "truth/contact.npz", "gap"),
    ("exact", "truth/contact.npz", Removed, "truth", "truth/contact.npz", "is missing"),
    ("exact", "truth/notes.npz", With("angles"), "truth", "truth/notes.npz", "is not a file of this set"),
    ("corrupted", "truth/keypoints.npz", Element("keypoints_2d", 4, 1.0), "truth", "truth/keypoints.npz", "keypoints_2d"),
    ("corrupted", "truth/cameras.json", Text("\"axes\": \"O", "\"axes\": \"o"), "truth", "truth/cameras.json", "line"),
    ("filmed", "truth/filming.json", Json("/cameras/1/line_delay_s", 1e-6), "given", "cameras.npz", "line_delay_s"),
    ("people", "truth/distractors.npz", Names("00_angle_names"), "truth", "truth/distractors.npz", "00_angle_names"),
    ("people", "truth/distractors.npz", With("angles"), "truth", "truth/distractors.npz", "does not belong"),
    ("people", "truth/props.json", Json("/props/0/solid/cylinder/radius", 0.2), "truth", VIEWS, "sight"),
    // images for trackers
    ("exact", MASK, Pixel(500), "observations", MASK, "1 of 3072"),
    ("exact", MASK, Mirror, "observations", MASK, "values of its pixels differ"),
    ("exact", MASK, From("observations/cam01/silhouette/000003.png"), "observations", MASK, "values of its pixels"),
    ("exact", "truth/actor.json", Json("/links/0/solids/0/tapered_capsule/radius_a", 0.2), "observations", MASK, ""),
    ("corrupted", MASK, Pixel(500), "observations", MASK, "1 of 3072"),
    ("corrupted", "set.toml", Text("holes = 0.05", "holes = 0.3"), "observations", MASK, "values"),
    ("corrupted", "truth/key.txt", Bytes("00112233445566778899aabbccddeeff\n"), "observations", MASK, "values"),
    ("corrupted", "observations/keypoints.npz", Element("confidence", 3, 0.001), "observations", "observations/keypoints.npz", "confidence"),
    ("filmed", MASK, Pixel(500), "observations", MASK, "1 of 3072"),
    ("filmed", "truth/filming.json", Json("/cameras/1/line_delay_s", 0.01), "observations", MASK, "values"),
    ("people", MASK, Pixel(500), "observations", MASK, "1 of 3072"),
    ("images", MASK, Pixel(500), "observations", MASK, "1 of 3072"),
    ("images", "observations/colour/cam00/000001.png", From("observations/colour/cam00/000002.png"), "observations", "observations/colour/cam00/000001.png", "values"),
    ("images", "observations/background/cam00/000001.png", Pixel(7), "observations", "observations/background/cam00/000001.png", "1 of"),
    // truth images
    ("exact", LAYER, From("truth/layers/cam00/000002.exr"), "layers", LAYER, "byte"),
    ("exact", LAYER, Cut, "layers", LAYER, "byte"),
    ("exact", LAYER, Removed, "layers", LAYER, "is missing"),
    ("exact", "truth/layers/cam01/000002-colour.exr", From("truth/layers/cam01/000003-colour.exr"), "layers", "truth/layers/cam01/000002-colour.exr", "byte"),
    ("exact", DEPTH, Pixel(900), "layers", DEPTH, "values of its pixels differ"),
    ("exact", DEPTH, Removed, "layers", DEPTH, "is missing"),
    ("exact", "truth/layers/cam00/000009.exr", From(LAYER), "truth", "truth/layers/cam00/000009.exr", "is not a file of this set"),
    // the witnesses
    ("exact", VIEWS, Element("joints_2d", 9, 0.5), "projection", VIEWS, "joints_2d: 1 pixels of camera \"front\""),
    ("exact", VIEWS, Element("joints_2d", 9, f64::NAN), "projection", VIEWS, "joints_2d: 1 pixels of camera \"front\""),
    ("exact", VIEWS, Element("markers_2d", 60, 1e-3), "projection", VIEWS, "markers_2d"),
    ("exact", VIEWS, Without("joints_2d"), "projection", VIEWS, "joints_2d"),
    ("exact", "cameras.json", Json("/cameras/1/distortion/0", 0.05), "projection", VIEWS, "\"lens\""),
    ("corrupted", VIEWS, Element("joints_2d", 9, 0.5), "projection", VIEWS, "joints_2d"),
    ("filmed", VIEWS, Element("joints_2d", 9, 0.5), "projection", VIEWS, "joints_2d"),
    ("exact", VIEWS, Times("joints_2d", 0.5), "masks", "observations/cam00", "visible joints are in the silhouettes"),
    ("filmed", VIEWS, Times("joints_2d", 0.5), "masks", "observations/cam00", "visible joints are in the silhouettes"),
];

fn cameras() -> Vec<Camera> {
    let camera = |name: &str, eye: [f64; 3], distortion| {
        let (eye, target, view) = (Point3::from(eye), Point3::new(0.1, 0.0, 1.0), FieldOfView::Vertical(0.75));
        let camera = Camera::look_at(name, eye, target, Vector3::z(), view, WIDTH, HEIGHT).unwrap();
        Camera { distortion: Distortion::from_coefficients(distortion), ..camera }
    };
    let lens = [-0.18, 0.06, 0.002, -0.001, -0.01];
    vec![camera("front", [3.0, 0.8, 1.3], [0.0; 5]), camera("lens", [-1.0, 2.8, 1.6], lens)]
}

/// The body moves forward, turns a little and swings every joint differently.
fn motion() -> Motion {
    let pose = |frame: usize| {
        let mut pose = actor().zero_pose();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3 + 0.05 * frame as f64);
        pose.world_from_root = Isometry3::from_parts(Translation3::new(0.06 * frame as f64, 0.1, 0.97), turn);
        let angle = |i: usize| 0.15 * ((7 * i) as f64 + 0.35 * frame as f64).sin();
        pose.joint_angles.iter_mut().enumerate().for_each(|(i, value)| *value = angle(i));
        pose
    };
    Motion { frames_per_second: 30.0, poses: (0..FRAMES).map(pose).collect() }
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

/// The built-in actor.
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
    let settings: ObservationSettings = toml::from_str(settings).unwrap();
    let motion = motion();
    let (is_exact, people) = (settings.is_exact() && others.is_empty(), others.len());
    let truth = GroundTruth::among(actor.clone(), &motion, rig, props, others).unwrap();
    let pose = tracker_start(&actor, &motion.poses[0], &settings.corruption, settings.keyed_seed());
    let start = Start {
        pose,
        training: Training::none(&actor),
        body: actor,
        calibrate: false.into(),
        has_known_stature: false,
    };
    let mut facts = TruthFacts { motion: "made up".into(), matched: true, ..TruthFacts::default() };
    facts.observation_seed = (!is_exact).then_some(settings.seed);
    let mut observed = settings.facts();
    observed.distractors = people;
    let parts = SetParts {
        name,
        rig,
        start: &start,
        ground_truth: &truth,
        refitted: Some(&motion),
        facts: &facts,
        recordings: &[],
        observation: (!is_exact).then_some(&observed),
        key: settings.keyed_seed().key,
    };
    let observer = SilhouetteObserver::new(&truth, rig, &observed, settings.keyed_seed()).unwrap();
    BenchmarkSet::assemble(&parts, |frame| observer.observe(frame)).unwrap()
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
fn changed(folder: &Path, file: &str, change: Change) -> Vec<u8> {
    let before = || fs::read(folder.join(file)).unwrap();
    match change {
        Text(from, to) => {
            let text = String::from_utf8(before()).unwrap();
            assert!(text.contains(from), "{file} has no {from}");
            text.replacen(from, to, 1).into_bytes()
        }
        Element(array, index, by) => changed_npz(&before(), array, |own| with_element(&mut own.values, index, by)),
        Times(array, factor) => changed_npz(&before(), array, |own| {
            let Values::F64(values) = &mut own.values else { panic!("{array}") };
            values.iter_mut().for_each(|value| *value *= factor);
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
        Pixel(index) => changed_png(&before(), |pixels, _| pixels[index] = 255 - pixels[index]),
        Mirror => changed_png(&before(), |pixels, line| pixels.chunks_mut(line).for_each(<[u8]>::reverse)),
        Cut => before()[..before().len() / 2].to_vec(),
        Bytes(text) => text.as_bytes().to_vec(),
        Longer(text) => [&before()[..], text.as_bytes()].concat(),
        From(other) => fs::read(folder.join(other)).unwrap(),
        Removed | Pipe | Link | Huge => Vec::new(),
    }
}

/// Plants a fault; `elsewhere` is a folder outside the set.
fn plant(folder: &Path, elsewhere: &Path, file: &str, change: Change) {
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
fn sign(folder: &Path) {
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
    let (set, file, change, check, place, words) = *row;
    let root = tempfile::tempdir().unwrap();
    let folder: PathBuf = root.path().join("set");
    copy(&sets.join(set), &folder);
    plant(&folder, root.path(), file, change);
    if check != "hashes" {
        sign(&folder);
    }
    let found = verify(&folder, VerifyOptions::default()).unwrap();
    let all: Vec<_> = found.faults().collect();
    let is_it = all.iter().any(|(name, fault)| *name == check && fault.file == place && fault.detail.contains(words));
    // observations were "exact" beside a damaged or removed image
    let is_seen = file != MASK || all.iter().any(|(name, _)| *name == "observations");
    let is_signed = check == "hashes" || all.iter().all(|(name, _)| *name != "hashes");
    let few: Vec<_> = all.iter().take(6).collect();
    (!is_it || !is_seen || !is_signed || found.is_sound()).then(|| format!("{row:?}\n    {few:#?}"))
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
    let planted: BTreeSet<&str> = ROWS.iter().map(|row| row.3).collect();
    assert_eq!(planted, CHECKS.iter().map(|(name, _)| *name).collect());
    let wrong = skiagraph_core::parallel::map(ROWS.len(), |index| wrong_row(sets.path(), &ROWS[index]));
    let wrong: Vec<String> = wrong.into_iter().flatten().collect();
    assert!(wrong.is_empty(), "{} of {} rows:\n{}", wrong.len(), ROWS.len(), wrong.join("\n"));
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
