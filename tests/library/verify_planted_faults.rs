//! `verify` finds every planted fault, names the file, and finds no fault in a set as written.
//!
//! One set is rendered for all tests, and each fault is planted in a copy. For faults in the content, the list of
//! hashes is recomputed, so that only the content can reveal them.

use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, ReadChannels, ReadLayers, WritableImage, f16};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;
use sha2::{Digest, Sha256};
use skiagraph::benchmark_set::{CHECKS, Layer, Verification, VerifyOptions, verify};
use skiagraph::body::{Motion, shipped};
use skiagraph::camera::{Camera, CameraKeyframe, CameraPath, CameraRig, CameraTiming, TimedRig};
use skiagraph::npz::{Array, Npz, Values};
use skiagraph::observation::ObservationSettings;

mod forged;

const FRAMES: usize = 5;
const WIDTH: u32 = 160;
const HEIGHT: u32 = 120;
const TRUTH: &str = "truth/truth.npz";

static SET: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let directory = tempfile::tempdir().unwrap();
    render(directory.path());
    directory
});

/// A smaller set with all layers.
static LAYERS: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let directory = tempfile::tempdir().unwrap();
    let set = crate::made_up_set::assemble("with layers", cameras([64, 48]), &motion());
    let layers = [Layer::Depth, Layer::Parts, Layer::Normals, Layer::Flow, Layer::Coverage, Layer::Colour];
    set.write_with_layers(directory.path(), &layers).unwrap();
    directory
});

fn observed(settings: &str) -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let settings: ObservationSettings = toml::from_str(settings).unwrap();
    let set = crate::made_up_set::assemble_observed("observed", cameras([WIDTH, HEIGHT]), &motion(), &settings);
    set.write_with_layers(directory.path(), &[]).unwrap();
    directory
}

/// A set of silhouettes segmented from images.
static SEGMENTED: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    observed("silhouette = \"segmented\"\nseed = 4\nimages = { clothing_contrast = 100.0, background_frames = 5 }")
});

/// A set of corrupted silhouettes.
static CORRUPTED: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    observed("silhouette = \"corrupted\"\nseed = 5\ncorruption = { boundary_px = 1.5, holes = 0.05 }")
});

/// A set whose first camera moves, and whose second takes every other image, late and with a rolling shutter.
static FILMED: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let directory = tempfile::tempdir().unwrap();
    let set = crate::made_up_set::assemble_filmed("filmed", &filming(), &motion(), &ObservationSettings::default());
    set.write_with_layers(directory.path(), &[Layer::Depth, Layer::Parts, Layer::Normals]).unwrap();
    directory
});

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
    let rig = CameraRig { cameras: cameras([WIDTH, HEIGHT]) };
    TimedRig::new(rig, vec![Some(path)], vec![CameraTiming::default(), late]).unwrap()
}

fn render(directory: &Path) {
    let set = crate::made_up_set::assemble("for faults", cameras([WIDTH, HEIGHT]), &motion());
    set.write_with_layers(directory, &[Layer::Depth, Layer::Parts]).unwrap();
}

fn cameras(size: [u32; 2]) -> Vec<Camera> {
    let camera = |name, eye, distortion| crate::made_up_set::camera(name, eye, distortion, size);
    let front = camera("front", [3.0, 0.8, 1.3], [0.0; 5]);
    vec![front, camera("lens", [-1.0, 2.8, 1.6], [-0.18, 0.06, 0.002, -0.001, -0.01])]
}

/// The body moves forward, turns a little and swings every joint differently.
fn motion() -> Motion {
    let root = |frame: usize| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3 + 0.05 * frame as f64);
        Isometry3::from_parts(Translation3::new(0.06 * frame as f64, 0.1, 0.97), turn)
    };
    let angle = |frame: usize, i: usize| 0.15 * (f64::from(i as u32 * 7) + 0.35 * frame as f64).sin();
    crate::made_up_set::motion(&shipped("actor").unwrap(), FRAMES, 30.0, root, angle)
}

/// A copy of the set, in which faults are planted.
struct Copy(tempfile::TempDir);

impl Copy {
    fn new() -> Self {
        Self::of(&SET)
    }

    fn of(set: &tempfile::TempDir) -> Self {
        let directory = tempfile::tempdir().unwrap();
        copy(set.path(), directory.path());
        Self(directory)
    }

    /// Changes the channels of the geometry of a truth image.
    fn layers(&self, camera: usize, frame: usize, change: impl FnOnce(&mut [AnyChannel<FlatSamples>])) -> String {
        self.channels(format!("truth/layers/cam{camera:02}/{frame:06}.exr"), change)
    }

    /// Changes the channels of the brightness of a truth image.
    fn colours(&self, camera: usize, frame: usize, change: impl FnOnce(&mut [AnyChannel<FlatSamples>])) -> String {
        self.channels(format!("truth/layers/cam{camera:02}/{frame:06}-colour.exr"), change)
    }

    fn channels(&self, file: String, change: impl FnOnce(&mut [AnyChannel<FlatSamples>])) -> String {
        let read = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().all_layers();
        let mut image = read.all_attributes().from_buffered(std::io::Cursor::new(self.read(&file))).unwrap();
        let mut channels: Vec<_> = image.layer_data[0].channel_data.list.drain(..).collect();
        change(&mut channels);
        image.layer_data[0].channel_data = AnyChannels::sort(channels.into_iter().collect());
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        self.write(&file, &bytes.into_inner());
        file
    }

    /// Changes the values of all channels whose names begin with `prefix`.
    fn floats(&self, camera: usize, frame: usize, prefix: &str, change: impl Fn(f32) -> f32) -> String {
        self.layers(camera, frame, |channels| {
            let chosen: Vec<_> = channels.iter_mut().filter(|c| c.name.to_string().starts_with(prefix)).collect();
            assert!(!chosen.is_empty());
            for channel in chosen {
                let FlatSamples::F32(values) = &mut channel.sample_data else { panic!() };
                values.iter_mut().for_each(|value| *value = change(*value));
            }
        })
    }

    fn read(&self, file: &str) -> Vec<u8> {
        fs::read(self.0.path().join(file)).unwrap()
    }

    fn write(&self, file: &str, bytes: &[u8]) {
        let path = self.0.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    fn text(&self, file: &str, change: impl FnOnce(String) -> String) {
        let before = String::from_utf8(self.read(file)).unwrap();
        let after = change(before.clone());
        assert_ne!(before, after, "nothing was planted in {file}");
        self.write(file, after.as_bytes());
    }

    fn json(&self, file: &str, change: impl FnOnce(&mut Value)) {
        let mut value: Value = serde_json::from_slice(&self.read(file)).unwrap();
        change(&mut value);
        self.write(file, serde_json::to_string_pretty(&value).unwrap().as_bytes());
    }

    /// Changes numbers of `truth.npz`, element by element: `change(index, values)`.
    fn truth(&self, array: &str, change: impl Fn(usize, &[f64]) -> f64) {
        self.array(TRUTH, array, |values| match values {
            Values::F64(v) => Values::F64((0..v.len()).map(|i| change(i, &v)).collect()),
            other => panic!("{array} holds {other:?}"),
        });
    }

    fn array(&self, file: &str, array: &str, change: impl Fn(Values) -> Values) {
        let npz = Npz::from_bytes(file, &self.read(file)).unwrap();
        assert!(npz.get(array).is_some(), "{file} has no {array}");
        let changed = npz.iter().map(|(name, old)| match name == array {
            true => (name, Array { shape: old.shape.clone(), values: change(old.values.clone()) }),
            false => (name, old.clone()),
        });
        self.write(file, &changed.collect::<Npz>().to_bytes(file).unwrap());
    }

    fn mask(camera: usize, frame: usize) -> String {
        format!("observations/cam{camera:02}/silhouette/{frame:06}.png")
    }

    /// Redraws a silhouette: `pixel(old, x, y)`.
    fn repaint(&self, camera: usize, frame: usize, pixel: impl Fn(&dyn Fn(u32, u32) -> u8, u32, u32) -> u8) {
        self.repaint_sized(camera, frame, [WIDTH, HEIGHT], pixel);
    }

    /// As [`Self::repaint`], for an image of this size.
    fn repaint_sized(
        &self,
        camera: usize,
        frame: usize,
        [width, height]: [u32; 2],
        pixel: impl Fn(&dyn Fn(u32, u32) -> u8, u32, u32) -> u8,
    ) {
        let file = Self::mask(camera, frame);
        let bytes = self.read(&file);
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let mut old = vec![0; (width * height) as usize];
        reader.next_frame(&mut old).unwrap();
        let at = |x: u32, y: u32| old[(y * width + x) as usize];
        let new: Vec<u8> =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(&at, x, y)).collect();
        assert_ne!(old, new);
        let mut encoded = Vec::new();
        let mut encoder = png::Encoder::new(&mut encoded, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header().unwrap().write_image_data(&new).unwrap();
        self.write(&file, &encoded);
    }

    /// Changes the pixels of a 16-bit image.
    fn repaint_wide(&self, file: &str, pixel: impl Fn(u16) -> u16) {
        let bytes = self.read(file);
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let (width, height) = (reader.info().width, reader.info().height);
        let mut old = vec![0; 2 * (width * height) as usize];
        reader.next_frame(&mut old).unwrap();
        let new = old.as_chunks::<2>().0.iter().flat_map(|b| pixel(u16::from_be_bytes(*b)).to_be_bytes());
        let new: Vec<u8> = new.collect();
        assert_ne!(old, new);
        let mut encoded = Vec::new();
        let mut encoder = png::Encoder::new(&mut encoded, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        encoder.write_header().unwrap().write_image_data(&new).unwrap();
        self.write(file, &encoded);
    }

    fn swap(&self, a: &str, b: &str) {
        let (first, second) = (self.read(a), self.read(b));
        self.write(a, &second);
        self.write(b, &first);
    }

    /// Recomputes the list of hashes, as if the set had been written like this.
    fn sign(&self) {
        let mut lines: Vec<String> = files(self.0.path(), "")
            .into_iter()
            .filter(|file| file != "files.sha256")
            .map(|file| {
                let digest = Sha256::digest(self.read(&file));
                format!("{}  {file}\n", digest.iter().map(|byte| format!("{byte:02x}")).collect::<String>())
            })
            .collect();
        lines.sort_by(|a, b| a[66..].cmp(&b[66..]));
        self.write("files.sha256", lines.concat().as_bytes());
    }

    fn verified(&self) -> Verification {
        verify(self.0.path(), VerifyOptions::default()).unwrap()
    }

    /// Asserts that the check `name` finds a fault in `file` whose description contains all of `words`.
    #[track_caller]
    fn found(&self, name: &str, file: &str, words: &[&str]) {
        let found = self.verified();
        let hit = found.faults().any(|(check, fault)| {
            check == name && fault.file == file && words.iter().all(|word| fault.detail.contains(word))
        });
        let all: Vec<_> = found.faults().collect();
        assert!(hit && !found.is_sound(), "{name}: {file}: {words:?} is not among {all:#?}");
    }

    /// As [`Self::found`], with the list of hashes recomputed.
    #[track_caller]
    fn found_in_spite_of_good_hashes(&self, name: &str, file: &str, words: &[&str]) {
        self.sign();
        self.found(name, file, words);
        assert!(self.verified().faults().all(|(check, _)| check != "hashes"));
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &to.join(entry.file_name())),
            false => drop(fs::copy(entry.path(), to.join(entry.file_name())).unwrap()),
        }
    }
}

fn files(directory: &Path, prefix: &str) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(directory).unwrap() {
        let entry = entry.unwrap();
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        match entry.file_type().unwrap().is_dir() {
            true => found.extend(files(&entry.path(), &format!("{name}/"))),
            false => found.push(name),
        }
    }
    found
}

fn camera(value: &mut Value, index: usize) -> &mut Value {
    &mut value["cameras"][index]
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn a_set_as_written_is_sound_and_every_check_was_made() {
    let found = Copy::new().verified();
    assert!(found.is_sound(), "{:#?}", found.faults().collect::<Vec<_>>());
    assert_eq!(found.checks.iter().map(|check| (check.name, check.proves)).collect::<Vec<_>>(), CHECKS);
    assert_eq!(found.name, "for faults");
}

// ---- the files -------------------------------------------------------------------------------------------------

#[test]
fn an_edited_number_is_found() {
    let set = Copy::new();
    set.text("cameras.json", |text| text.replacen("0.002", "0.003", 1));
    set.found("hashes", "cameras.json", &["changed or truncated"]);
}

#[test]
fn a_truncated_png_is_found() {
    let set = Copy::new();
    let (file, bytes) = (Copy::mask(1, 3), set.read(&Copy::mask(1, 3)));
    set.write(&file, &bytes[..bytes.len() / 2]);
    set.found("hashes", &file, &["changed or truncated"]);
    set.found_in_spite_of_good_hashes("silhouettes", &file, &[]);
}

#[test]
fn a_missing_silhouette_is_found() {
    let set = Copy::new();
    fs::remove_file(set.0.path().join(Copy::mask(0, 2))).unwrap();
    set.found("hashes", &Copy::mask(0, 2), &["No such file"]);
    set.found_in_spite_of_good_hashes("formats", &Copy::mask(0, 2), &["is missing"]);
}

#[test]
fn a_file_that_is_not_listed_is_found() {
    let set = Copy::new();
    set.write("observations/notes.txt", b"nothing");
    set.found("hashes", "observations/notes.txt", &["does not list it"]);
}

#[cfg(unix)]
#[test]
fn a_file_that_is_a_link_out_of_the_set_is_found() {
    let (set, elsewhere) = (Copy::new(), tempfile::tempdir().unwrap());
    let (body, moved) = (set.0.path().join("start/body.json"), elsewhere.path().join("body.json"));
    fs::rename(&body, &moved).unwrap();
    std::os::unix::fs::symlink(&moved, &body).unwrap();
    set.found("hashes", "start/body.json", &["is a symbolic link that leads out of the set"]);
}

#[test]
fn a_key_that_set_toml_does_not_have_is_found() {
    for (from, to, key) in
        [("name = ", "note = 1\nname = ", "\"note\""), ("frames = 5", "frames = 5\npose = [0.1]", "\"sequence.pose\"")]
    {
        let set = Copy::new();
        set.text("set.toml", |text| text.replacen(from, to, 1));
        set.found_in_spite_of_good_hashes("formats", "set.toml", &[key, "is not a key of this file"]);
    }
}

#[test]
fn a_frame_too_many_is_found() {
    let set = Copy::new();
    set.write(&Copy::mask(0, FRAMES), &set.read(&Copy::mask(0, 0)));
    set.found_in_spite_of_good_hashes("formats", &Copy::mask(0, FRAMES), &["belongs to none"]);
}

#[test]
fn another_frame_rate_is_found() {
    let set = Copy::new();
    set.text("set.toml", |text| text.replace("frames_per_second = 30.0", "frames_per_second = 60.0"));
    set.found_in_spite_of_good_hashes("formats", "set.toml", &["frames_per_second is 60", "fps 30"]);
}

#[test]
fn another_number_of_frames_is_found() {
    let set = Copy::new();
    set.text("set.toml", |text| text.replace("frames = 5", "frames = 4"));
    set.found_in_spite_of_good_hashes("formats", "set.toml", &["sequence.frames is 4", "has 5"]);
}

#[test]
fn names_in_another_order_are_found() {
    let set = Copy::new();
    set.array(TRUTH, "joint_names", |values| {
        let Values::Text(mut names) = values else { panic!() };
        names.swap(3, 9);
        Values::Text(names)
    });
    set.found_in_spite_of_good_hashes("formats", TRUTH, &["joint_names[3]"]);
}

#[test]
fn a_body_that_faces_another_direction_than_stated_is_found() {
    let set = Copy::new();
    set.text("set.toml", |text| {
        let line = text.lines().find(|line| line.starts_with("forward")).unwrap().to_owned();
        text.replace(&line, "forward = [-1.0, 0.0, 0.0]")
    });
    set.found_in_spite_of_good_hashes("formats", "set.toml", &["forward"]);
}

// ---- cameras ---------------------------------------------------------------------------------------------------

#[test]
fn a_negative_focal_length_is_found() {
    let set = Copy::new();
    set.json("cameras.json", |json| camera(json, 0)["K"][0][0] = (-number(&camera(json, 0)["K"][0][0])).into());
    set.found_in_spite_of_good_hashes("cameras", "cameras.json", &["\"front\"", "focal lengths"]);
}

#[test]
fn a_left_handed_camera_is_found() {
    let set = Copy::new();
    set.json("cameras.json", |json| {
        for column in 0..3 {
            camera(json, 1)["R"][0][column] = (-number(&camera(json, 1)["R"][0][column])).into();
        }
    });
    set.found_in_spite_of_good_hashes("cameras", "cameras.json", &["\"lens\"", "left-handed"]);
}

#[test]
fn other_camera_axes_are_found() {
    let set = Copy::new();
    set.text("cameras.json", |text| text.replace("y down, z forward", "y up, z backward"));
    set.found_in_spite_of_good_hashes("cameras", "cameras.json", &["axes"]);
}

#[test]
fn exchanged_cameras_are_found() {
    let set = Copy::new();
    set.json("cameras.json", |json| {
        let (a, b) = (camera(json, 0).clone(), camera(json, 1).clone());
        for key in ["K", "R", "t", "distortion", "camera_from_world"] {
            camera(json, 0)[key] = b[key].clone();
            camera(json, 1)[key] = a[key].clone();
        }
    });
    set.found_in_spite_of_good_hashes("projection", "cameras.json", &["\"front\"", "belong to another camera"]);
    set.found("silhouettes", &Copy::mask(0, 0), &["it is that of camera 1"]);
}

#[test]
fn names_of_exchanged_cameras_are_found() {
    let set = Copy::new();
    set.json("cameras.json", |json| {
        camera(json, 0)["name"] = "lens".into();
        camera(json, 1)["name"] = "front".into();
    });
    set.found_in_spite_of_good_hashes("formats", TRUTH, &["camera_names"]);
}

#[test]
fn a_camera_placed_in_millimetres_is_found() {
    let set = Copy::new();
    set.json("cameras.json", |json| {
        for i in 0..3 {
            let t = 1000.0 * number(&camera(json, 0)["t"][i]);
            camera(json, 0)["t"][i] = t.into();
            camera(json, 0)["camera_from_world"]["position"][i] = t.into();
        }
    });
    set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(0, 0), &["IoU 0.0"]);
}

#[test]
fn pixel_centres_at_halves_are_found() {
    let set = Copy::new();
    set.json("cameras.json", |json| {
        for i in 0..2 {
            camera(json, 0)["K"][i][2] = (0.5 + number(&camera(json, 0)["K"][i][2])).into();
        }
    });
    set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(0, 1), &["pixels differ"]);
}

#[test]
fn a_missing_lens_is_found() {
    let set = Copy::new();
    set.json("cameras.json", |json| camera(json, 1)["distortion"] = serde_json::json!([0.0, 0.0, 0.0, 0.0, 0.0]));
    set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(1, 4), &["pixels differ"]);
}

#[test]
fn a_transposed_rotation_is_found() {
    let set = Copy::new();
    set.json("cameras.json", |json| {
        let r = camera(json, 0)["R"].clone();
        for i in 0..3 {
            for j in 0..3 {
                camera(json, 0)["R"][i][j] = r[j][i].clone();
            }
        }
    });
    set.found_in_spite_of_good_hashes("formats", "cameras.json", &["R and t do not match camera_from_world"]);
}

// ---- the truth -------------------------------------------------------------------------------------------------

#[test]
fn a_flipped_axis_is_found() {
    let set = Copy::new();
    set.truth("joints", |i, v| if i % 3 == 1 { -v[i] } else { v[i] });
    set.found_in_spite_of_good_hashes("poses", TRUTH, &["joints", "y is flipped"]);
}

#[test]
fn y_up_is_found() {
    let set = Copy::new();
    set.truth("markers", |i, v| match i % 3 {
        0 => v[i],
        1 => v[i + 1],
        _ => -v[i - 1],
    });
    set.found_in_spite_of_good_hashes("poses", TRUTH, &["markers", "Y is up"]);
}

#[test]
fn millimetres_are_found() {
    let set = Copy::new();
    set.truth("markers", |i, v| 1000.0 * v[i]);
    set.found_in_spite_of_good_hashes("poses", TRUTH, &["markers", "millimetres"]);
}

#[test]
fn swapped_legs_are_found() {
    let set = Copy::new();
    // markers 8 to 10 are the left hip, knee and ankle, 11 to 13 the right ones
    set.truth("markers", |i, v| {
        let (marker, axis, frame) = (i / 3 % 15, i % 3, i / 45);
        let other = match marker {
            8..=10 => marker + 3,
            11..=13 => marker - 3,
            same => same,
        };
        v[45 * frame + 3 * other + axis]
    });
    set.found_in_spite_of_good_hashes("poses", TRUTH, &["markers", "root and angles"]);
}

#[test]
fn the_whole_left_side_swapped_with_the_right_is_found() {
    let set = Copy::new();
    set.truth("markers", |i, v| {
        let (marker, axis, frame) = (i / 3 % 15, i % 3, i / 45);
        let other = match marker {
            2..=4 | 8..=10 => marker + 3,
            5..=7 | 11..=13 => marker - 3,
            same => same,
        };
        v[45 * frame + 3 * other + axis]
    });
    set.found_in_spite_of_good_hashes("poses", TRUTH, &["left and right are exchanged"]);
}

#[test]
fn a_truth_that_is_one_frame_late_is_found() {
    let set = Copy::new();
    for array in ["joints", "markers", "root", "angles", "link_frames"] {
        set.truth(array, |i, v| v[i.saturating_sub(v.len() / FRAMES).max(i % (v.len() / FRAMES))]);
    }
    set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(0, 2), &["it is not"].map(|_| "frame 2"));
    let set = Copy::new();
    set.truth("joints", |i, v| v[if i < v.len() / FRAMES { i } else { i - v.len() / FRAMES }]);
    set.found_in_spite_of_good_hashes("poses", TRUTH, &["joints", "one frame late"]);
}

#[test]
fn angles_in_degrees_are_found() {
    let set = Copy::new();
    set.truth("angles", |i, v| v[i].to_degrees());
    set.found_in_spite_of_good_hashes("poses", TRUTH, &["link_frames"]);
}

#[test]
fn quaternions_with_w_last_are_found() {
    let set = Copy::new();
    set.truth("link_frames", |i, v| match i % 7 {
        3..=5 => v[i + 1],
        6 => v[i - 3],
        _ => v[i],
    });
    set.found_in_spite_of_good_hashes("poses", TRUTH, &["the rotation of", "degrees off"]);
}

#[test]
fn a_nan_is_found() {
    let set = Copy::new();
    set.truth("joints", |i, v| if i == 40 { f64::NAN } else { v[i] });
    set.found_in_spite_of_good_hashes("poses", TRUTH, &["joints"]);
}

#[test]
fn a_jump_is_found() {
    let set = Copy::new();
    set.truth("root", |i, v| if i / 7 == 3 && i % 7 == 0 { v[i] + 5.0 } else { v[i] });
    set.found_in_spite_of_good_hashes("poses", TRUTH, &["from frame 2 to 3", "m/s"]);
}

#[test]
fn markers_on_the_other_leg_are_found() {
    let set = Copy::new();
    set.json("truth/actor.json", |json| {
        let markers = json["markers"].as_object_mut().unwrap();
        let (left, right) = (markers["left_knee"].clone(), markers["right_knee"].clone());
        markers.insert("left_knee".into(), right);
        markers.insert("right_knee".into(), left);
    });
    set.found_in_spite_of_good_hashes("body", "truth/actor.json", &["left_knee", "left and right are exchanged"]);
}

#[test]
fn visible_always_true_is_found() {
    let set = Copy::new();
    set.array(TRUTH, "visible", |values| {
        let Values::Bool(flags) = values else { panic!() };
        assert!(flags.contains(&false), "some marker is hidden");
        Values::Bool(vec![true; flags.len()])
    });
    set.found_in_spite_of_good_hashes("visibility", TRUTH, &["visible:", "are wrong", "true"]);
}

#[test]
fn a_wrong_in_view_flag_is_found() {
    let set = Copy::new();
    set.array(TRUTH, "in_view", |values| {
        let Values::Bool(mut flags) = values else { panic!() };
        flags[17] = !flags[17];
        Values::Bool(flags)
    });
    set.found_in_spite_of_good_hashes("projection", TRUTH, &["in_view", "OpenCV's formula"]);
}

#[test]
fn pixels_from_the_corner_of_the_image_are_found() {
    let set = Copy::new();
    set.array("truth/views.npz", "joints_2d", |values| {
        let Values::F64(pixels) = values else { panic!() };
        Values::F64(pixels.iter().map(|x| x + 0.5).collect())
    });
    set.found_in_spite_of_good_hashes("projection", "truth/views.npz", &["joints_2d", "OpenCV's formula"]);
}

/// Projections were once not checked when the observations were not exact.
#[test]
fn projections_are_checked_with_corrupted_silhouettes_and_with_errors_of_calibration() {
    let miscalibrated = observed("seed = 5\ncorruption = { calibration_mm = 20.0, calibration_deg = 1.0 }");
    assert!(Copy::of(&miscalibrated).verified().is_sound());
    for base in [&miscalibrated, &*CORRUPTED, &*SEGMENTED] {
        for array in ["joints_2d", "markers_2d"] {
            let set = Copy::of(base);
            set.array("truth/views.npz", array, |values| {
                let Values::F64(pixels) = values else { panic!() };
                Values::F64(pixels.iter().map(|x| x + 5.0).collect())
            });
            set.found_in_spite_of_good_hashes("projection", "truth/views.npz", &[array, "OpenCV's formula"]);
        }
    }
}

#[test]
fn a_contact_that_was_edited_is_found() {
    let set = Copy::new();
    set.array("truth/contact.npz", "gap", |values| {
        let Values::F64(mut gaps) = values else { panic!() };
        gaps[4] += 0.01;
        Values::F64(gaps)
    });
    set.found_in_spite_of_good_hashes("contact", "truth/contact.npz", &["gap differs", "first number 4"]);
}

#[test]
fn missing_contacts_are_found_in_sets_that_describe_them() {
    let set = Copy::new();
    fs::remove_file(set.0.path().join("truth/contact.npz")).unwrap();
    set.found_in_spite_of_good_hashes("contact", "truth/contact.npz", &["is missing"]);
}

// ---- pictures --------------------------------------------------------------------------------------------------

#[test]
fn a_mirrored_silhouette_is_found() {
    let set = Copy::new();
    set.repaint(0, 2, |old, x, y| old(WIDTH - 1 - x, y));
    set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(0, 2), &["mirrored"]);
}

#[test]
fn a_silhouette_upside_down_is_found() {
    let set = Copy::new();
    set.repaint(0, 2, |old, x, y| old(x, HEIGHT - 1 - y));
    set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(0, 2), &["upside down"]);
}

#[test]
fn an_empty_and_an_inverted_silhouette_are_found() {
    let set = Copy::new();
    set.repaint(0, 2, |_, _, _| 0);
    set.repaint(1, 1, |old, x, y| 255 - old(x, y));
    set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(0, 2), &["empty"]);
    set.found("silhouettes", &Copy::mask(1, 1), &["inverted"]);
}

#[test]
fn silhouettes_off_by_one_frame_are_found() {
    let set = Copy::new();
    for frame in 0..FRAMES - 1 {
        set.write(&Copy::mask(0, frame), &set.read(&Copy::mask(0, frame + 1)));
    }
    set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(0, 1), &["it is that of frame 2"]);
}

#[test]
fn silhouettes_of_exchanged_cameras_are_found() {
    let set = Copy::new();
    (0..FRAMES).for_each(|frame| set.swap(&Copy::mask(0, frame), &Copy::mask(1, frame)));
    set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(1, 0), &["it is that of camera 0, \"front\""]);
}

#[test]
fn part_numbers_that_are_one_off_and_depth_in_millimetres_are_found() {
    let layers = |set: &Copy, file: &str, change: &dyn Fn(&mut exr::prelude::FlatSamples)| {
        let read = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().all_layers();
        let mut image = read.all_attributes().from_buffered(std::io::Cursor::new(set.read(file))).unwrap();
        image.layer_data[0].channel_data.list.iter_mut().for_each(|channel| change(&mut channel.sample_data));
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        set.write(file, &bytes.into_inner());
    };
    let set = Copy::new();
    let [parts, depth] = ["truth/layers/cam00/000001.exr", "truth/layers/cam01/000002.exr"];
    layers(&set, parts, &|samples| {
        if let FlatSamples::U32(part) = samples {
            part.iter_mut().filter(|part| **part > 0).for_each(|part| *part -= 1);
        }
    });
    layers(&set, depth, &|samples| {
        if let FlatSamples::F32(depth) = samples {
            depth.iter_mut().for_each(|depth| *depth *= 1000.0);
        }
    });
    set.found_in_spite_of_good_hashes("layers", parts, &["id.part", "one too low"]);
    set.found("layers", depth, &["depth.Z", "millimetres"]);
    set.swap("truth/layers/cam00/000003.exr", "truth/layers/cam01/000003.exr");
    set.found_in_spite_of_good_hashes(
        "layers",
        "truth/layers/cam00/000003.exr",
        &["id.part", "differ from the parts of the body"],
    );
}

#[test]
fn sets_with_all_layers_and_with_segmented_and_corrupted_silhouettes_are_sound_as_written() {
    for (set, words) in [(&LAYERS, "10 images redrawn"), (&SEGMENTED, "segmented"), (&CORRUPTED, "boundary_px 1.5")] {
        let found = Copy::of(set).verified();
        assert!(found.is_sound(), "{:#?}", found.faults().collect::<Vec<_>>());
        assert!(found.checks.iter().any(|check| check.looked_at.contains(words)), "{words}: {:#?}", found.checks);
    }
}

#[test]
fn normals_that_point_inwards_and_normals_in_the_camera_s_axes_are_found() {
    let set = Copy::of(&LAYERS);
    let inwards = set.floats(0, 1, "normal", |c| -c);
    let turned = set.layers(1, 2, |channels| {
        let text = Copy::of(&LAYERS).read("cameras.json");
        let json: Value = serde_json::from_slice(&text).unwrap();
        let r = |i: usize, j: usize| number(&json["cameras"][1]["R"][i][j]) as f32;
        let names = ["normal.X", "normal.Y", "normal.Z"];
        let at = names.map(|name| channels.iter().position(|c| c.name.to_string() == name).unwrap());
        let old = at.map(|i| match &channels[i].sample_data {
            FlatSamples::F32(values) => values.clone(),
            _ => panic!(),
        });
        for (row, index) in at.into_iter().enumerate() {
            let new = (0..old[0].len()).map(|i| (0..3).map(|j| r(row, j) * old[j][i]).sum()).collect();
            channels[index].sample_data = FlatSamples::F32(new);
        }
    });
    set.found_in_spite_of_good_hashes("layers", &inwards, &["normal", "inwards"]);
    set.found("layers", &turned, &["normal", "camera's axes"]);
}

#[test]
fn flow_of_the_opposite_sign_and_with_swapped_axes_is_found() {
    let set = Copy::of(&LAYERS);
    let opposite = set.floats(0, 1, "forward", |c| -c);
    let upwards = set.floats(1, 3, "forward.v", |c| -c);
    let exchanged = set.layers(1, 1, |channels| {
        for channel in channels {
            let other = match channel.name.to_string().as_str() {
                "forward.u" => "forward.v",
                "forward.v" => "forward.u",
                _ => continue,
            };
            channel.name = other.into();
        }
    });
    set.found_in_spite_of_good_hashes("layers", &opposite, &["forward", "opposite sign"]);
    set.found("layers", &upwards, &["forward", "upwards"]);
    set.found("layers", &exchanged, &["forward", "swapped"]);
}

#[test]
fn coverage_that_is_the_mask_or_of_the_background_is_found() {
    let set = Copy::of(&LAYERS);
    let mask = set.floats(0, 2, "A", f32::round);
    let background = set.floats(1, 2, "A", |share| 1.0 - share);
    set.found_in_spite_of_good_hashes("layers", &mask, &["A:", "not anti-aliased"]);
    set.found("layers", &background, &["A:", "background"]);
}

#[test]
fn brightness_with_red_and_blue_swapped_and_up_to_255_is_found() {
    let set = Copy::of(&LAYERS);
    let exchanged = set.colours(0, 2, |channels| {
        for channel in channels {
            let other = match channel.name.to_string().as_str() {
                "R" => "B",
                "B" => "R",
                _ => continue,
            };
            channel.name = other.into();
        }
    });
    let wide = set.colours(1, 2, |channels| {
        for channel in channels.iter_mut().filter(|c| ["R", "G", "B"].contains(&c.name.to_string().as_str())) {
            let FlatSamples::F16(values) = &mut channel.sample_data else { panic!() };
            values.iter_mut().for_each(|value| *value = f16::from_f32(value.to_f32() * 255.0));
        }
    });
    set.found_in_spite_of_good_hashes("layers", &exchanged, &["red and blue are swapped"]);
    set.found("layers", &wide, &["255"]);
}

#[test]
fn a_layer_that_one_image_lacks_is_found() {
    let set = Copy::of(&LAYERS);
    let lacking = set.layers(0, 2, |channels| {
        channels.iter_mut().filter(|c| c.name.to_string() == "A").for_each(|c| c.name = "B2".into());
    });
    set.found_in_spite_of_good_hashes("layers", &lacking, &["A: the channel is missing"]);
}

#[test]
fn depth_images_that_are_missing_of_another_frame_or_with_swapped_bytes_are_found() {
    let depth = |camera: usize, frame: usize| format!("truth/layers/cam{camera:02}/{frame:06}-depth.png");
    let set = Copy::of(&LAYERS);
    set.repaint_wide(&depth(0, 1), u16::swap_bytes);
    set.repaint_wide(&depth(1, 1), |mm| mm / 10);
    fs::remove_file(set.0.path().join(depth(1, 3))).unwrap();
    set.swap(&depth(0, 2), &depth(0, 3));
    set.found_in_spite_of_good_hashes("layers", &depth(0, 1), &["bytes are swapped"]);
    set.found("layers", &depth(1, 1), &["differ from the depth of the body"]);
    set.found("layers", &depth(0, 2), &["differ from the depth of the body"]);
    set.found("formats", &depth(1, 3), &["is missing"]);
}

#[test]
fn sights_that_were_edited_are_found() {
    for array in ["joint_sight", "marker_sight"] {
        let set = Copy::of(&LAYERS);
        set.array("truth/views.npz", array, |values| {
            let Values::I64(mut sights) = values else { panic!() };
            let seen = sights.iter().position(|sight| *sight == 0).unwrap();
            sights[seen] = 1;
            Values::I64(sights)
        });
        set.found_in_spite_of_good_hashes(
            "visibility",
            "truth/views.npz",
            &[array, "visibility codes are wrong", "self_occluded"],
        );
    }
}

#[test]
fn segmented_and_corrupted_silhouettes_of_another_frame_or_mirrored_are_found() {
    for base in [&SEGMENTED, &CORRUPTED] {
        let set = Copy::of(base);
        set.write(&Copy::mask(0, 1), &set.read(&Copy::mask(0, 4)));
        set.repaint(1, 2, |old, x, y| old(WIDTH - 1 - x, y));
        set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(0, 1), &["frame 1"]);
        set.found("silhouettes", &Copy::mask(1, 2), &["mirrored"]);
    }
}

#[test]
fn a_wrong_corruption_strength_is_found() {
    let set = Copy::of(&CORRUPTED);
    set.text("set.toml", |text| text.replace("holes = 0.05", "holes = 0.3"));
    set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(0, 1), &["pixels differ"]);
}

// ---- what trackers may see
// ---------------------------------------------------------------------------------------------

#[test]
fn a_leaked_pose_is_found() {
    let set = Copy::new();
    let truth = Npz::from_bytes(TRUTH, &set.read(TRUTH)).unwrap();
    let leak = Npz::from_iter([("prior", truth.get("angles").unwrap().clone())]);
    set.write("start/prior.npz", &leak.to_bytes("x").unwrap());
    set.found_in_spite_of_good_hashes("blindfold", "start/prior.npz", &["array prior", "joint angles of the actor"]);
}

#[test]
fn a_start_pose_of_a_later_frame_is_found() {
    let set = Copy::new();
    let truth = Npz::from_bytes(TRUTH, &set.read(TRUTH)).unwrap();
    let angles = truth.f64s(TRUTH, "angles", &[Some(FRAMES), None]).unwrap();
    let row = &angles[3 * angles.len() / FRAMES..4 * angles.len() / FRAMES];
    set.json("start/start.json", |json| json["angles"] = serde_json::json!(row));
    set.found_in_spite_of_good_hashes("blindfold", "start/start.json", &["of frame 3"]);
}

#[test]
fn data_hidden_in_an_image_is_found() {
    let set = Copy::new();
    let mut bytes = set.read(&Copy::mask(0, 4));
    bytes.extend(b"pose");
    set.write(&Copy::mask(0, 4), &bytes);
    set.found_in_spite_of_good_hashes("blindfold", &Copy::mask(0, 4), &["4 bytes after the image"]);
}

// ---- not a set --------------------------------------------------------------------------------------------

#[test]
fn a_folder_that_is_not_a_set_of_this_format_is_an_error_not_a_fault() {
    let error = |set: &Copy| verify(set.0.path(), VerifyOptions::default()).unwrap_err().to_string();
    let set = Copy::new();
    set.text("set.toml", |text| text.replace("skiagraph.set/1", "skiagraph.set/3"));
    let newer = error(&set);
    assert!(newer.contains("skiagraph.set/3") && newer.contains("use the version of skiagraph"), "{newer}");
    fs::remove_file(set.0.path().join("files.sha256")).unwrap();
    assert!(error(&set).contains("is not a complete benchmark set: it has no files.sha256"));
    let nowhere = verify(&set.0.path().join("nowhere"), VerifyOptions::default()).unwrap_err().to_string();
    assert!(nowhere.contains("No such file"), "{nowhere}");
}

// ---- cameras that move or have their own times --------------------------------------------------------------

/// For each frame and camera, this file has 7 numbers for its place.
const CAMERAS: &str = "cameras.npz";

fn changed(set: &Copy, array: &str, change: impl Fn(usize, &[f64]) -> f64) {
    set.array(CAMERAS, array, |values| match values {
        Values::F64(v) => Values::F64((0..v.len()).map(|i| change(i, &v)).collect()),
        other => panic!("{array} holds {other:?}"),
    });
}

#[test]
fn a_set_of_moving_cameras_is_sound_and_lacks_the_images_that_were_not_taken() {
    let set = Copy::of(&FILMED);
    let found = set.verified();
    assert!(found.is_sound(), "{:#?} {:#?}", found.faults().collect::<Vec<_>>(), found.checks);
    assert!(!set.0.path().join(Copy::mask(1, 3)).exists() && set.0.path().join(Copy::mask(1, 2)).exists());
    assert!(!set.0.path().join("truth/layers/cam01/000001.exr").exists());
    let text = String::from_utf8(set.read("set.toml")).unwrap();
    assert!(text.contains("skiagraph.set/2"), "{text}");
    assert!(!Copy::new().0.path().join(CAMERAS).exists(), "static cameras have no such file");
}

#[test]
fn camera_places_that_are_one_frame_late_are_found() {
    let set = Copy::of(&FILMED);
    changed(&set, "camera_from_world", |i, v| v[if i < 14 { i } else { i - 14 }]);
    set.found_in_spite_of_good_hashes("cameras", CAMERAS, &["front", "frame before"]);
    set.found("projection", CAMERAS, &["front"]);
}

#[test]
fn a_moving_camera_stored_as_static_is_found() {
    let set = Copy::of(&FILMED);
    changed(&set, "camera_from_world", |i, v| v[i % 14]);
    set.found_in_spite_of_good_hashes("projection", CAMERAS, &["front", "differ by"]);
}

#[test]
fn shuffled_time_stamps_are_found() {
    let set = Copy::of(&FILMED);
    // frames 2 and 4 of the second camera
    changed(&set, "time_s", |i, v| {
        v[match i {
            5 => 9,
            9 => 5,
            other => other,
        }]
    });
    set.found_in_spite_of_good_hashes("cameras", CAMERAS, &["do not increase", "camera 1"]);
    set.found("cameras", CAMERAS, &["lens", "first in frame 2"]);
}

#[test]
fn time_stamps_without_the_offset_are_found() {
    let set = Copy::of(&FILMED);
    changed(&set, "time_s", |i, v| if i % 2 == 1 { v[i] - 0.013 } else { v[i] });
    set.found_in_spite_of_good_hashes("cameras", CAMERAS, &["lens", "time_s", "expected 0.013 s"]);
}

#[test]
fn images_of_a_global_shutter_in_place_of_a_rolling_one_are_found() {
    let set = Copy::of(&FILMED);
    set.json("truth/filming.json", |file| file["cameras"][1]["line_delay_s"] = 0.0.into());
    set.sign();
    let found = set.verified();
    let checks: Vec<&str> = found.faults().map(|(check, _)| check).collect();
    assert!(checks.contains(&"cameras") && checks.contains(&"silhouettes"), "{checks:?}");
}

#[test]
fn an_image_of_a_frame_without_exposure_is_found() {
    let set = Copy::of(&FILMED);
    set.write(&Copy::mask(1, 3), &set.read(&Copy::mask(1, 2)));
    set.found_in_spite_of_good_hashes("formats", &Copy::mask(1, 3), &["camera 1 took no image of frame 3"]);
}

#[test]
fn a_set_of_moving_cameras_without_their_file_is_found() {
    let set = Copy::of(&FILMED);
    set.text("set.toml", |text| text.replace("skiagraph.set/2", "skiagraph.set/1"));
    set.found_in_spite_of_good_hashes("formats", CAMERAS, &["static cameras"]);
    let set = Copy::of(&FILMED);
    fs::remove_file(set.0.path().join(CAMERAS)).unwrap();
    set.sign();
    assert!(!set.verified().is_sound());
}
