//! Recordings of people: imported, tracked and measured without a truth. Synthetic sets stand for them, so what should
//! be found is known.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use skiagraph_core::body::KeypointLayout;
use skiagraph_core::npz::Npz;

use crate::sandbox::{Sandbox, assert_contains};
use crate::support::skip;

/// Frames and cameras of the stand-in.
const FRAMES: usize = 6;
const CAMERAS: usize = 3;
/// Images of each camera of a recording of [`FRAMES`] frames of the clip, which has half the rate.
const IMAGES: usize = 11;

/// A sandbox with the set of a walk, its cameras and keypoints in other programs' files, and a recording of them.
fn recorded(start: &str) -> Sandbox {
    recorded_with("halpe26", FRAMES, start)
}

fn recorded_with(layout: &str, frames: usize, start: &str) -> Sandbox {
    let room = Sandbox::tiny();
    let scene = format!(
        "observation.keypoints.layout={layout} actor.skin=person_coarse tracker_body.robot=tracker40 rig.ring.count=3 \
         rig.ring.size_px=[160,120] motion.last_frame={frames} rig.ring.field_of_view_deg=45"
    );
    room.succeed(&format!("render tiny.toml {scene} --out truth -q"));
    room.succeed("export truth --to opencv,openpose --out other -q");
    let text = format!(
        "schema = \"skiagraph.recording/1\"\nname = \"walk\"\nframes_per_second = 60\n\n[[rig.file]]\npath = \"other/opencv\"\n\n[masks]\npath = \
         \"truth/observations\"\n\n[keypoints]\npath = \"other/openpose\"\n\n{start}\n"
    );
    room.write("walk.toml", text);
    room
}

const START_OF_SET: &str = "[start]\nset = \"truth\"\n";

/// The numbers at a JSON pointer of every camera.
fn numbers(cameras: &Value, pointer: &str) -> Vec<f64> {
    let mut found = Vec::new();
    for camera in cameras["cameras"].as_array().unwrap() {
        let mut open = vec![camera.pointer(pointer).unwrap()];
        while let Some(value) = open.pop() {
            match value {
                Value::Array(inner) => open.extend(inner),
                number => found.push(number.as_f64().unwrap()),
            }
        }
    }
    found
}

#[test]
fn exported_set_comes_back_by_import() {
    let room = recorded(START_OF_SET);
    room.succeed("import walk.toml --out back");
    for camera in 0..CAMERAS {
        for frame in 0..FRAMES {
            let mask = format!("observations/cam{camera:02}/silhouette/{frame:06}.png");
            assert!(room.read(&format!("back/{mask}")) == room.read(&format!("truth/{mask}")), "{mask}");
        }
    }
    let [own, back] = ["truth", "back"].map(|set| room.json(&format!("{set}/cameras.json")));
    for pointer in ["/K", "/R", "/t", "/distortion", "/camera_from_world/quaternion_wxyz"] {
        let pairs = numbers(&own, pointer).into_iter().zip(numbers(&back, pointer));
        let off = pairs.map(|(own, back)| (own - back).abs()).fold(0.0, f64::max);
        println!("{pointer}: {off:e}");
        assert!(off < 1e-9, "{pointer}: {off:e}");
    }
    let points = |set: &str| {
        let file = format!("{set}/observations/keypoints.npz");
        Npz::from_bytes("keypoints", &room.read(&file)).unwrap().get("keypoints").cloned().unwrap()
    };
    assert_eq!(format!("{:?}", points("truth")), format!("{:?}", points("back")));
    for file in ["start/start.json", "start/body.json", "start/spread.npz"] {
        assert!(room.read(&format!("truth/{file}")) == room.read(&format!("back/{file}")), "{file}");
    }
    room.succeed("verify back");
}

#[test]
fn recording_needs_no_truth_to_be_tracked() {
    let room = recorded("[tracker_body]\nstature_m = 1.7\n");
    let told = room.succeed("import walk.toml --out set");
    assert_contains(&told.stderr, &["keypoints triangulated from all cameras are off by (median): cam00 0.0 px"]);
    assert!(told.stderr.contains("by the keypoints of the first frame"), "{}", told.stderr);
    let [own, guessed] = ["truth", "set"].map(|set| room.json(&format!("{set}/start/start.json")));
    for axis in 0..3 {
        let place = |start: &Value| start["root"]["position"][axis].as_f64().unwrap_or(f64::NAN);
        assert!((place(&own) - place(&guessed)).abs() < 0.15, "{own} {guessed}");
    }
    room.succeed("track set --tracker annealed_particle_filter particles=60 layers=4 --out run -q");
    let table = room.succeed("evaluate set run").stdout;
    let run: Value = room.json("run/run.json");
    let mean = |name: &str| run["metrics"][name]["mean"].as_f64().unwrap();
    assert!(mean("silhouette_iou") > 0.7 && mean("keypoint_residual_px") < 8.0, "{table}");
    assert_eq!(run["observation"]["silhouette"], "footage");
    assert!(run["verdict"].get("grade").is_none(), "{}", run["verdict"]);
    assert_contains(&table, &["Silhouette overlap (IoU)", "overlap in cam02", "worst image: overlap"]);
    assert!(!table.contains("truth") && !table.contains("true"), "{table}");
    room.succeed("verify set");
    room.succeed("inspect set --out set.html");
    room.succeed("export set --to opencv,openpose,pose2sim --out again -q");
    room.succeed("track set --tracker keypoints --out points -q");
    room.succeed("evaluate set points -q");
    room.succeed("compare run points");
    let few = "annealed_particle_filter particles=60 layers=4 --leave-out cam02 --out two -q";
    room.succeed(&format!("track set --tracker {few}"));
    let table = room.succeed("evaluate set two").stdout;
    assert!(table.contains("left out, cam02: overlap 0.") && !table.contains("overlap in cam02"), "{table}");
    room.refused("track set --tracker frozen --leave-out cam2 --out one", "expected a camera of cam00, cam01, cam02");
    room.refused("export set --to coco --out coco", "is a recording of a person");
}

#[test]
fn masks_alone_tell_place_and_stature() {
    let room = recorded("");
    let keypoints = "[keypoints]\npath = \"other/openpose\"";
    room.write("walk.toml", room.text("walk.toml").replace(keypoints, "[start]\nheading_deg = 0"));
    let told = room.succeed("import walk.toml --out set").stderr;
    assert!(told.contains("by the masks of the first frame"), "{told}");
    let body: Value = room.json("truth/start/start.json");
    let start: Value = room.json("set/start/start.json");
    for axis in 0..2 {
        let place = |start: &Value| start["root"]["position"][axis].as_f64().unwrap_or(f64::NAN);
        assert!((place(&body) - place(&start)).abs() < 0.12, "{told} {body} {start}");
    }
}

/// A recording of its own files, which may be spoilt.
fn loose(layout: &str, frames: usize) -> Sandbox {
    let room = recorded_with(layout, frames, "");
    room.write(
        "walk.toml",
        room.text("walk.toml").replace("truth/observations", "masks").replace("other/openpose", "pose"),
    );
    fs::rename(room.path("other/openpose"), room.path("pose")).unwrap();
    for camera in 0..CAMERAS {
        let name = format!("cam{camera:02}");
        fs::create_dir_all(room.path("masks")).unwrap();
        let masks = room.path(format!("truth/observations/{name}/silhouette"));
        fs::rename(masks, room.path(format!("masks/{name}"))).unwrap();
    }
    room
}

fn files_of(room: &Sandbox, folder: &str) -> Vec<String> {
    room.entries_of(folder).into_iter().map(|name| format!("{folder}/{name}")).collect()
}

fn pose_of(room: &Sandbox, camera: usize) -> String {
    let folders = fs::read_dir(room.path("pose")).unwrap().map(|entry| entry.unwrap().path());
    let mut folders: Vec<_> = folders.filter(|path| path.is_dir()).collect();
    folders.sort();
    format!("pose/{}", folders[camera].file_name().unwrap().to_str().unwrap())
}

/// Draws every mask of a camera anew, as a PGM: its size and the place in the old one of each pixel.
fn redraw(room: &Sandbox, camera: &str, size: [u32; 2], place: impl Fn(u32, u32) -> Option<[u32; 2]>, invert: bool) {
    for file in files_of(room, &format!("masks/{camera}")) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(room.read(&file))).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!(info.bit_depth, png::BitDepth::Eight);
        let mut bytes = format!("P5 {} {} 255\n", size[0], size[1]).into_bytes();
        for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
            let value = place(x, y).map_or(0, |[x, y]| pixels[(y * info.width + x) as usize]);
            bytes.push(if invert { 255 - value } else { value });
        }
        fs::remove_file(room.path(&file)).unwrap();
        room.write(&Path::new(&file).with_extension("pgm").to_string_lossy(), bytes);
    }
}

/// Changes the points of every person in the images of a camera: x, y, confidence by index.
fn repoint(room: &Sandbox, camera: usize, frames: std::ops::Range<usize>, change: impl Fn(usize, &[f64]) -> Vec<f64>) {
    for file in &files_of(room, &pose_of(room, camera))[frames] {
        let mut image = room.json(file);
        for person in image["people"].as_array_mut().unwrap() {
            let old: Vec<f64> = serde_json::from_value(person["pose_keypoints_2d"].clone()).unwrap();
            let new: Vec<f64> = (0..old.len() / 3).flat_map(|point| change(point, &old)).collect();
            person["pose_keypoints_2d"] = json!(new);
        }
        room.write(file, image.to_string());
    }
}

fn mirrored(point: usize) -> usize {
    let points = KeypointLayout::Halpe26.keypoints();
    points.iter().position(|own| *own == points[point].mirrored()).unwrap()
}

fn exchanged(point: usize, old: &[f64]) -> Vec<f64> {
    old[3 * mirrored(point)..][..3].to_vec()
}

/// Removes the first masks and keypoints of a camera: it starts late.
fn start_late(room: &Sandbox, camera: usize, frames: usize) {
    for folder in [format!("masks/cam{camera:02}"), pose_of(room, camera)] {
        files_of(room, &folder)[..frames].iter().for_each(|file| fs::remove_file(room.path(file)).unwrap());
    }
}

fn upside_down(room: &Sandbox) {
    redraw(room, "cam01", [160, 120], |x, y| Some([159 - x, 119 - y]), false);
    repoint(room, 1, 0..IMAGES, |point, old| {
        vec![159.0 - old[3 * point], 119.0 - old[3 * point + 1], old[3 * point + 2]]
    });
}

fn in_a_mirror(room: &Sandbox) {
    redraw(room, "cam01", [160, 120], |x, y| Some([159 - x, y]), false);
    repoint(room, 1, 0..IMAGES, |point, old| {
        let [x, y, confidence] = exchanged(point, old).try_into().unwrap();
        vec![159.0 - x, y, confidence]
    });
}

fn in_millimetres(room: &Sandbox) {
    for file in files_of(room, "other/opencv") {
        if !file.ends_with("yml") {
            continue;
        }
        let text = room.text(&file);
        let start = text.find("T: ").unwrap();
        let open = start + text[start..].find('[').unwrap();
        let end = open + text[open..].find(']').unwrap();
        let far: Vec<String> =
            text[open + 1..end].split(',').map(|t| (1000.0 * t.trim().parse::<f64>().unwrap()).to_string()).collect();
        room.write(&file, format!("{}[{}{}", &text[..open], far.join(", "), &text[end..]));
    }
}

/// What is spoilt in a recording, how, and what import says: refused, or with a note.
type Case = (&'static str, fn(&Sandbox), &'static str, bool, &'static str);

const CASES: [Case; 17] = [
    ("nothing", |_| (), "", false, "cam00 0.0 px, cam01 0.0 px, cam02 0.0 px\n"),
    (
        "a camera starts late",
        |room| start_late(room, 1, 2),
        "",
        true,
        "cam01: 9, cam02: 11: if all began together, give last_frame = 8; if some began earlier, give the number of images that only they have, [skip] CAMERA = NUMBER",
    ),
    (
        "a camera dropped a frame",
        |room| fs::remove_file(room.path("masks/cam02/000003.png")).unwrap(),
        "keypoints.path=truth/observations/keypoints.npz",
        true,
        "cam02: 10: if",
    ),
    ("more is skipped than there is", |_| (), "skip.cam01=11", true, "expected fewer than the 11 images"),
    ("an unknown camera is skipped", |_| (), "skip.cam1=1", true, "did you mean `cam"),
    (
        "half the size",
        |room| redraw(room, "cam01", [80, 60], |x, y| Some([2 * x, 2 * y]), false),
        "",
        true,
        "the proportions are the same: \"scaled\"",
    ),
    (
        "bars",
        |room| redraw(room, "cam01", [150, 120], |_, _| None, false),
        "",
        true,
        "\"letterboxed\" if the images have bars (0 columns left and right, 4 rows above and below), else \"cropped\"",
    ),
    (
        "portrait",
        |room| redraw(room, "cam01", [120, 160], |x, y| Some([y, x]), false),
        "",
        true,
        "they are on their side: turn the images by 90 degrees",
    ),
    (
        "calibration of another resolution",
        |_| (),
        "rig.file=[{path=\"other/opencv\",calibrated_at_px=[320,240]}]",
        true,
        "cameras, images and keypoints do not belong together",
    ),
    (
        "inverted masks",
        |room| redraw(room, "cam01", [160, 120], |x, y| Some([x, y]), true),
        "",
        true,
        "give masks.inverted = true",
    ),
    (
        "nobody in a camera",
        |room| redraw(room, "cam01", [160, 120], |_, _| None, false),
        "",
        true,
        "nobody is in any mask of camera `cam01`",
    ),
    ("upside down", upside_down, "", false, "`cam01` looks upside down"),
    ("in a mirror", in_a_mirror, "", false, "`cam01` looks mirrored"),
    (
        "left and right exchanged",
        |room| repoint(room, 2, 2..5, exchanged),
        "",
        false,
        "exchanged, by what the other cameras see: cam02 3 frames (2-4)\n",
    ),
    ("millimetres", in_millimetres, "", true, "metres_per_unit = 0.001 in [[rig.file]]"),
    ("one camera", |_| (), "leave_out=[\"cam00\",\"cam01\"]", true, "expected at least two cameras"),
    (
        "no video",
        |room| {
            fs::remove_dir_all(room.path("masks/cam01")).unwrap();
            room.write("masks/cam01.mp4", "not a video");
        },
        "",
        true,
        "cam01.mp4",
    ),
];

#[test]
fn spoilt_recordings_are_refused_or_noted_with_what_to_do() {
    let sound = loose("halpe26", FRAMES);
    for (what, spoil, overrides, is_refused, words) in CASES {
        let room = Sandbox::new();
        for file in sound.files_below(".") {
            room.write(&file, sound.read(&file));
        }
        spoil(&room);
        let told = room.ask(&format!("import walk.toml {overrides} --out set"));
        assert_eq!(told.code, if is_refused { 2 } else { 0 }, "{what}: {}", told.stderr);
        assert!(told.stderr.contains(words), "{what}: no {words:?} in: {}", told.stderr);
        println!("{what}:\n{}", told.stderr);
        assert_eq!(room.path("set").exists(), !is_refused, "{what}");
        assert!(!room.path("set/frames").exists(), "{what}");
    }
}

/// Masks and keypoints of two sets are the same.
fn assert_same_observations(room: &Sandbox, [one, other]: [&str; 2]) {
    for camera in 0..CAMERAS {
        let folder = |set: &str| format!("{set}/observations/cam{camera:02}/silhouette");
        let (ours, theirs) = (files_of(room, &folder(one)), files_of(room, &folder(other)));
        assert_eq!(ours.len(), theirs.len());
        for (a, b) in ours.iter().zip(&theirs) {
            assert!(room.read(a) == room.read(b), "{a} {b}");
        }
    }
    let points = "observations/keypoints.npz";
    assert!(room.read(&format!("{one}/{points}")) == room.read(&format!("{other}/{points}")), "{one} {other}");
}

#[test]
fn a_late_camera_is_found_by_the_motion_and_mended_by_skip() {
    let room = loose("halpe26", 20);
    room.succeed("import walk.toml first_frame=3 --out sound");
    start_late(&room, 1, 3);
    let told = room.succeed("import walk.toml last_frame=35 --out late").stderr;
    assert_contains(&told, &["frames: cam01 -3.0 (-3.0 and -3.0); ", "[skip] cam00 = 3, cam02 = 3\n"]);
    room.write("walk.toml", room.text("walk.toml") + "\n[skip]\ncam00 = 3\ncam02 = 3\n");
    let told = room.succeed("import walk.toml --out mended").stderr;
    assert!(!told.contains("lag"), "{told}");
    assert_same_observations(&room, ["sound", "mended"]);
}

/// Detections of one camera as a program's list of results, those of another as annotations.
#[test]
fn coco_keypoints_are_read_as_pycocotools_has_them() {
    let room = loose("coco17", FRAMES);
    room.succeed("import walk.toml --out sound");
    let (mut images, mut all) = (Vec::new(), Vec::new());
    for camera in 0..CAMERAS {
        let mut results = Vec::new();
        for (frame, file) in files_of(&room, &pose_of(&room, camera)).iter().enumerate() {
            let id = 100 * camera + frame + 1;
            images.push(
                json!({ "id": id, "file_name": format!("cam{camera:02}/{frame:06}.jpg"), "width": 160, "height": 120 }),
            );
            for person in room.json(file)["people"].as_array().unwrap() {
                let keypoints = &person["pose_keypoints_2d"];
                results.push(json!({ "image_id": frame, "category_id": 1, "keypoints": keypoints, "score": 0.9 }));
                all.push(json!({ "id": all.len() + 1, "image_id": id, "category_id": 1, "keypoints": keypoints }));
            }
        }
        room.write(&format!("results/cam{camera:02}.json"), json!(results).to_string());
    }
    // annotations are not in the order of the images
    all.reverse();
    room.write("all.json", json!({ "images": images, "annotations": all, "categories": [] }).to_string());
    for (path, set) in [("results", "by-camera"), ("all.json", "of-all")] {
        room.succeed(&format!("import walk.toml keypoints.path={path} --out {set}"));
        assert_same_observations(&room, ["sound", set]);
    }
    room.write("other.json", "{\"people\": []}");
    room.refused("import walk.toml keypoints.path=other.json --out none", "expected COCO's keypoints");
    room.write("few.json", json!({ "images": images[..3], "annotations": all }).to_string());
    room.refused("import walk.toml keypoints.path=few.json --out none", "found 0 of this camera");
}

/// A second person stands beside the first, listed first, and the masks show both or nobody there.
#[test]
fn of_two_people_the_one_is_taken_in_whom_cameras_agree() {
    let room = loose("halpe26", FRAMES);
    room.succeed("import walk.toml --out sound");
    for camera in 0..CAMERAS {
        for file in files_of(&room, &pose_of(&room, camera)) {
            let mut image = room.json(&file);
            let mut other = image["people"][0].clone();
            for (index, number) in other["pose_keypoints_2d"].as_array_mut().unwrap().iter_mut().enumerate() {
                // as far to the right in every image, where nobody can be
                if index % 3 == 0 {
                    *number = json!(number.as_f64().unwrap() + 30.0);
                }
            }
            image["people"].as_array_mut().unwrap().insert(0, other);
            room.write(&file, image.to_string());
        }
    }
    room.succeed("import walk.toml --out two");
    let points = "observations/keypoints.npz";
    assert!(room.read(&format!("sound/{points}")) == room.read(&format!("two/{points}")), "the other person");
}

#[test]
fn videos_of_masks_give_the_masks() {
    let is_there = |program: &str| Command::new(program).arg("-version").output().is_ok();
    if !is_there("ffmpeg") || !is_there("ffprobe") {
        return skip("no ffmpeg (apt-get install ffmpeg)");
    }
    let room = loose("halpe26", FRAMES);
    room.succeed("import walk.toml --out sound");
    let encode = |rate: &str, options: &str, video: &str| {
        let arguments =
            format!("-v error -framerate {rate} -i masks/cam01/%06d.png {options} -pix_fmt yuv444p -y {video}");
        let done = Command::new("ffmpeg").args(arguments.split(' ')).current_dir(room.path(".")).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    };
    encode("60", "-c:v libx264 -crf 1", "one.mp4");
    encode("30", "-c:v libx264 -crf 1", "slow.mp4");
    // every third frame is left out, and the others keep their times
    encode("60", "-c:v libx264 -crf 1 -vf select=mod(n\\,3) -fps_mode passthrough", "dropped.mp4");
    fs::rename(room.path("masks/cam01"), room.path("cam01")).unwrap();
    let put = |video: &str| fs::copy(room.path(video), room.path("masks/cam01.mp4")).unwrap();
    put("one.mp4");
    room.succeed("import walk.toml --out same");
    assert_same_observations(&room, ["sound", "same"]);
    assert!(!room.path("same/frames").exists());
    room.succeed("verify same");
    put("slow.mp4");
    room.refused("import walk.toml --out none", "cam01.mp4 has 30.000 frames a second, but frames_per_second is 60");
    put("dropped.mp4");
    let told = room.ask("import walk.toml --out none").stderr;
    assert!(told.contains("cam01: 4, cam02: 11") || told.contains("frames a second"), "{told}");
    let mut program = room.program(["import", "walk.toml", "--out", "none"]);
    let told = program.env("PATH", "").output().unwrap();
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    assert!(told.contains("install ffmpeg, or give a folder of images") && told.lines().count() < 4, "{told}");
}

/// One mask shows the person elsewhere.
#[test]
fn images_that_contradict_the_estimate_are_named() {
    let room = loose("halpe26", FRAMES);
    redraw(&room, "cam01", [160, 120], |x, y| Some([x, y]), false);
    let moved = room.read("masks/cam01/000005.pgm");
    let (header, pixels) = moved.split_at(moved.len() - 160 * 120);
    let mut pixels = pixels.to_vec();
    pixels.rotate_right(12);
    room.write("masks/cam01/000005.pgm", [header, &pixels].concat());
    room.succeed("import walk.toml --out set");
    room.succeed("track set --tracker annealed_particle_filter particles=60 layers=4 --out run -q");
    let table = room.succeed("evaluate set run").stdout;
    assert_contains(&table, &["far below the rest, cam01: overlap below 0.", "in 1 frame (5)"]);
}

#[test]
fn reference_is_found_in_time_and_measured() {
    // the recording begins 20 frames after the reference, at 60 Hz
    let room = recorded_with("halpe26", 30, "[tracker_body]\nstature_m = 1.7\n");
    room.succeed("import walk.toml first_frame=20 --out set -q");
    room.succeed("export truth --to bvh --out files -q");
    let record =
        room.json_of("evaluate set files/actor.bvh --shift=-20 --reference files/actor.bvh --out measured -q --json");
    let found = &record["reference"]["seeds"][0];
    let number = |name: &str| found[name].as_f64().unwrap();
    assert!((number("offset_s") - 20.0 / 60.0).abs() < 0.01, "{found}");
    assert!(number("mean_mm") < 25.0 && number("without_constant_mm") < 10.0, "{found}");
    assert!(number("own_mm") < 0.1 && number("correlation") > 0.99, "{found}");
    // keys that the file needs are those of [motion], in a scenario
    let reference = "schema = \"skiagraph.scenario/1\"\nname = \"reference\"\n[motion]\nclip = \"files/actor.bvh\"\n\
                     first_frame = 11\n[rig.ring]\ncount = 2\n[tracker.frozen]\n";
    room.write("reference.toml", reference);
    let estimate = "evaluate set files/actor.bvh --shift=-20 --out measured";
    let told = room.succeed(&format!("{estimate} --reference reference.toml --force")).stdout;
    for words in ["the reference's clock: the first frame is at 0.16", "its limbs have fixed lengths", "1.0"] {
        assert!(told.contains(words), "{words}\n{told}");
    }
    room.refused(&format!("{estimate} --reference walk.toml --force"), "expected a scenario");
    let of_truth = "evaluate truth files/actor.bvh --reference files/actor.bvh --out other";
    room.refused(of_truth, "--reference: expected the set of a recording");
}

#[test]
fn each_camera_is_left_out_once() {
    let room = recorded(START_OF_SET);
    room.succeed("import walk.toml --out set -q");
    room.succeed("track set --tracker annealed_particle_filter particles=10 layers=2 --calibrate false --out run -q");
    let told = room.succeed("evaluate set run --leave-one-out").stdout;
    let run: Value = room.json("run/run.json");
    for camera in ["cam00", "cam01", "cam02"] {
        let own = &run["left_out"][camera];
        let [mean, worst] = ["mean", "worst"].map(|name| own[name].as_f64().unwrap());
        assert!(mean > 0.6 && worst <= mean, "{camera}: {own}");
        assert!(told.contains(&format!("left out, {camera}: overlap")), "{told}");
        // the same as tracking without the camera
        room.succeed(&format!(
            "track set --tracker annealed_particle_filter particles=10 layers=2 --calibrate false --leave-out {camera} \
             --out without-{camera} -q"
        ));
        room.succeed(&format!("evaluate set without-{camera} -q"));
        let without: Value = room.json(&format!("without-{camera}/run.json"));
        assert_eq!(without["left_out"][camera], *own, "{camera}");
    }
    room.refused("evaluate set without-cam00 --leave-one-out", "--leave-one-out: expected a run with all cameras");
    room.succeed("track truth --tracker frozen --out still -q");
    room.refused("evaluate truth still --leave-one-out", "--leave-one-out: expected the set of a recording");
}
