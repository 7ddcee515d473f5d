//! Cameras that move or have their own timing, on the command line.

use skiagraph_core::npz::Npz;
use skiagraph_set::BenchmarkSet;

use crate::sandbox::{Sandbox, TINY, assert_contains};

/// In addition to the ring of [`TINY`], which has two cameras.
pub(super) const MOVING: &str = "[[rig.motion]]\ncamera = \"cam00\"\nkeyframes = [\n\
                      \x20 { time_s = 0.0, position_m = [3.0, 3.0, 1.6], look_at_m = [0.0, 0.0, 0.95] },\n\
                      \x20 { time_s = 0.1, position_m = [3.4, 2.4, 1.4], look_at_m = [0.1, 0.0, 0.95], roll_deg = 3.0 },\n]\n\
                      [[rig.timing]]\ncamera = \"cam01\"\nframes_per_second = 30.0\noffset_ms = 8.0\nline_delay_us = 20.0\n";

/// The actor walks from the middle of the ring.
pub(super) fn scenario(rig: &str) -> String {
    TINY.replace("last_frame = 3", "last_frame = 8\nstart_m = [0.0, 0.0]") + rig
}

/// Which is rendered, verified, tracked and shown.
#[test]
fn moving_cameras_make_a_set() {
    let room = Sandbox::new();
    room.write("film.toml", scenario(MOVING));
    let answer = room.succeed("check film.toml");
    assert_contains(&answer.stderr, &["camera `cam00`: moves", "8.000 ms late, rolling shutter, 20.000 us"]);
    room.succeed("render film.toml --out film");
    room.says("verify film", &["film is sound: 9 checks, no fault"]);
    let set = BenchmarkSet::read(&room.path("film")).unwrap();
    assert!(set.blind.has_image(0, 1) && !set.blind.has_image(1, 1));
    assert!(!room.path("film/observations/cam01/silhouette/000001.png").exists());
    assert!(room.text("film/README.txt").contains("cameras.npz has, for T frames"));
    room.says("inspect film", &["cam01", "8.000 ms late"]);
    // runs on the scenario and on the set are equal
    room.succeed("run film.toml --quiet --out run");
    room.succeed("track film --tracker annealed_particle_filter particles=12 layers=2 --seeds 2 --quiet --out tracked");
    room.succeed("evaluate film tracked --quiet");
    assert_eq!(room.read("run/per_frame.csv"), room.read("tracked/per_frame.csv"));
    let page = room.text("run/report.html");
    assert!(page.contains("20.000 us from row to row"));
    // calibration errors are added to moving cameras
    room.succeed("render film.toml calibration_mm=50 --quiet --out told");
    assert!(room.succeed("verify told").stdout.contains("told is sound"));
}

#[test]
fn programs_get_moving_cameras() {
    let room = Sandbox::new();
    room.write("film.toml", scenario(MOVING));
    room.succeed("render film.toml --quiet --out film");
    let script = "import json, sys\n\
                  out = open('heard.jsonl', 'w')\n\
                  for line in sys.stdin:\n\
                  \x20   out.write(line); out.flush()\n\
                  \x20   said = json.loads(line)\n\
                  \x20   if said['type'] == 'hello': print(json.dumps({'type': 'ready', 'protocol': PROTOCOL}), flush=True)\n\
                  \x20   if said['type'] == 'frame': print(json.dumps({'type': 'pose', 'frame': said['frame'], 'markers': {'pelvis': [0, 0, 1]}}), flush=True)\n";
    room.write("new.py", script.replace("PROTOCOL", "'skiagraph.tracker/2'"));
    room.write("old.py", script.replace("PROTOCOL", "'skiagraph.tracker/1'"));
    let python = std::env::var("SKIAGRAPH_TEST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    room.refused(&format!("track film --exec '{python} old.py' --out told"), "skiagraph.tracker/2");
    room.succeed(&format!("track film --exec '{python} new.py' --out told"));
    let heard = room.text("heard.jsonl");
    let heard: Vec<serde_json::Value> = heard.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(heard[0]["protocol"], "skiagraph.tracker/2");
    assert_eq!(heard[0]["cameras"][1]["line_delay_s"].as_f64(), Some(20.0 * 1e-6));
    let set = BenchmarkSet::read(&room.path("film")).unwrap();
    for (frame, message) in heard[1..].iter().filter(|message| message["type"] == "frame").enumerate() {
        let (moving, slow) = (&message["views"][0], &message["views"][1]);
        let t: Vec<f64> = moving["t"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        assert_eq!(t, set.blind.rig_at(frame).cameras[0].opencv_translation());
        assert!(moving["mask"].is_string() && slow["mask"].is_null() != (frame % 2 == 0));
        assert_eq!(slow["exposed_s"].is_null(), frame % 2 == 1);
    }
}

#[test]
fn exports_contain_moving_cameras() {
    let room = Sandbox::new();
    room.write("film.toml", scenario(MOVING));
    room.write("moving.toml", scenario(MOVING.split("[[rig.timing]]").next().unwrap()));
    room.succeed("render film.toml --quiet --out film");
    room.succeed("render moving.toml --quiet --out moving");
    for (set, formats) in
        [("film", ["npz", "bvh", "tum", "croissant"]), ("moving", ["npz", "colmap", "coco", "webdataset"])]
    {
        for format in formats {
            room.succeed(&format!("export {set} --to {format} --quiet --out {set}-{format}"));
        }
    }
    let images = room.text("moving-colmap/images.txt");
    let set = BenchmarkSet::read(&room.path("moving")).unwrap();
    let frames = set.blind.frame_count;
    assert_eq!(images.lines().filter(|line| line.ends_with(".png")).count(), 2 * frames);
    // two lines per image: the camera's pose, and its points
    let last = images.lines().filter(|line| !line.starts_with('#')).nth(2 * (2 * frames - 2)).unwrap();
    let numbers: Vec<f64> = last.split(' ').take(8).map(|number| number.parse().unwrap()).collect();
    let t = set.blind.rig_at(frames - 1).cameras[0].opencv_translation();
    assert!((0..3).all(|i| (numbers[5 + i] - t[i]).abs() < 1e-12) && last.ends_with(&format!("{:06}.png", frames - 1)));
    // points in the npz file, projected through its cameras, equal those of the set's truth
    let bytes = room.read("film-npz/truth.npz");
    let npz = Npz::from_bytes("truth.npz", &bytes).unwrap();
    let shape = |name: &str| npz.get(name).unwrap().shape.clone();
    let film = BenchmarkSet::read(&room.path("film")).unwrap();
    assert_eq!(shape("frame_R"), [film.blind.frame_count, 2, 3, 3]);
    let exposed = npz.f64s("truth.npz", "exposed_s", &[Some(film.blind.frame_count), Some(2)]).unwrap();
    assert!(exposed[3].is_nan() && (exposed[5] - (2.0 / 60.0 + 0.008)).abs() < 1e-12, "{exposed:?}");
    let views = Npz::from_bytes("views.npz", &room.read("film/truth/views.npz")).unwrap();
    assert_eq!(npz.get("markers_2d").unwrap().shape, views.get("markers_2d").unwrap().shape);
}

/// And are named where the search is blamed.
#[test]
fn missing_images_have_no_energies() {
    let room = Sandbox::new();
    let slow = |camera: u32| format!("[[rig.timing]]\ncamera = \"cam0{camera}\"\nframes_per_second = 20.0\n");
    room.write("slow.toml", scenario(&[0, 1].map(slow).concat()));
    room.says("run slow.toml --out slow", &["neither 0.0 % of 8 frames."]);
    let table = room.text("slow/per_frame.csv");
    let names: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let at = |name: &str| names.iter().position(|column| *column == name).unwrap();
    for row in table.lines().skip(1).map(|row| row.split(',').collect::<Vec<_>>()) {
        let frame: u32 = row[at("frame")].parse().unwrap();
        let has_image = frame.is_multiple_of(3);
        for name in ["energy_truth", "energy_estimate"] {
            assert_eq!(row[at(name)].is_empty(), !has_image, "{name}: {row:?}");
        }
        // the first frame is not scored
        assert_eq!(row[at("energy_gap")].is_empty(), !has_image || frame == 0, "{row:?}");
    }
    room.succeed("explain slow --quick --out why --quiet");
    assert_eq!(room.json("why/explain.json")["frames_without_image"], 10);
}
