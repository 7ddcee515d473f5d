//! Sets with keypoints: rendered, checked, given to programs, as a ladder, and with errors in their settings.

use serde_json::Value;
use skiagraph::npz::{Npz, Values};

use crate::sandbox::{Sandbox, TINY, shipped};
use crate::support::python_with_numpy;

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room
}

#[test]
fn the_python_example_triangulates_exact_keypoints_to_the_joints() {
    let Some(python) = python_with_numpy() else { return };
    let room = room();
    room.succeed("render tiny.toml observation.keypoints.layout=halpe26 --out set");
    let told = String::from_utf8(room.read("set/set.toml")).unwrap();
    assert!(told.contains("[observation.keypoints]") && told.contains("layout = \"halpe26\""), "{told}");
    assert!(room.succeed("verify set").stdout.contains("frames of halpe26 in 2 cameras"));
    let command = format!("{} {}", python.display(), shipped("examples/external/keypoints.py").display());
    room.skiagraph(["track", "set", "--exec", &command, "--out", "run"]);
    room.succeed("evaluate set run");
    let run: Value = serde_json::from_slice(&room.read("run/run.json")).unwrap();
    let joints = &run["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap();
    assert!(*joints < 2.0, "{run}");
}

#[test]
fn the_eyes_of_every_skin_are_seen_by_some_camera_around_it() {
    let room = room();
    for skin in ["person", "man", "woman"] {
        let settings = "observation.keypoints.layout=coco17 rig.ring.count=8 rig.ring.size_px=[320,240]";
        room.succeed(&format!("render tiny.toml {settings} actor.skin={skin} --out {skin} -q"));
        let truth = Npz::from_bytes("truth", &room.read(&format!("{skin}/truth/keypoints.npz"))).unwrap();
        let Some(Values::U8(sight)) = truth.get("sight").map(|array| &array.values) else { panic!("no sight") };
        for eye in [1, 2] {
            let in_view = sight.chunks_exact(17).filter(|points| points[eye] == 0).count();
            let all = sight.len() / 17;
            assert!(3 * in_view > all && in_view < all, "{skin}, eye {eye}: {in_view} of {all}");
        }
    }
}

#[test]
fn a_ladder_of_keypoint_errors_makes_a_set_per_level_and_a_sweep_varies_them() {
    let room = room();
    let ladder =
        "render tiny.toml observation.keypoints.layout=coco17 --ladder keypoints.white_percent --levels 0,2 --out sets";
    room.succeed(ladder);
    assert_eq!(room.entries().iter().filter(|entry| entry.as_str() == "sets").count(), 1);
    for (level, words) in [("0", "layout = \"coco17\""), ("2", "white_percent = 2.0")] {
        let told = String::from_utf8(room.read(&format!("sets/keypoints.white_percent-{level}/set.toml"))).unwrap();
        assert!(told.contains(words), "{told}");
    }
    let exact = room.read("sets/keypoints.white_percent-0/observations/keypoints.npz");
    assert_ne!(exact, room.read("sets/keypoints.white_percent-2/observations/keypoints.npz"));
}

#[test]
fn settings_that_cannot_be_are_refused_by_key() {
    let room = room();
    for (setting, words) in [
        ("observation.keypoints.layout=coco", ["observation.keypoints.layout", "coco17"]),
        ("observation.keypoints.slow_percent=1", ["observation.keypoints", "missing key `layout`"]),
        ("observation.keypoints={layout=\"coco17\",missing=1.5}", ["observation.keypoints.missing", "0 to 1"]),
        ("observation.keypoints={layout=\"coco17\",slow=1.0}", ["slow", "unknown"]),
        ("observation.preset=beach", ["observation.preset", "studio"]),
    ] {
        let refused = room.skiagraph(["render", "tiny.toml", setting, "--out", "set"]);
        assert_eq!(refused.code, 2, "{setting}");
        assert!(words.iter().all(|word| refused.stderr.contains(word)), "{setting}: {}", refused.stderr);
    }
}

#[test]
fn one_camera_is_too_few_to_triangulate() {
    let room = room();
    let words = "expected at least two cameras, not 1: keypoints of one camera have no depth";
    let given = "tiny.toml observation.keypoints.layout=coco17 rig.ring.count=1";
    room.succeed(&format!("render {given} --out set"));
    for command in [
        format!("run {given} tracker.keypoints={{}} --out run"),
        format!("check {given} tracker.keypoints={{}}"),
        "track set --tracker keypoints --out tracked".to_owned(),
    ] {
        let refused = room.skiagraph(command.split(' '));
        assert!(refused.code == 2 && refused.stderr.contains(words), "{command}: {}", refused.stderr);
    }
    assert!(!room.path("run").exists() && !room.path("tracked").exists());
}
