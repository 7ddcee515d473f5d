//! Recordings of people: imported, tracked and measured without a truth. Synthetic sets stand for them, so what should
//! be found is known.

use serde_json::Value;
use skiagraph_core::npz::Npz;

use crate::sandbox::Sandbox;

/// Frames and cameras of the stand-in.
const FRAMES: usize = 6;
const CAMERAS: usize = 3;

/// A sandbox with the set of a walk, its cameras and keypoints in other programs' files, and a recording of them.
fn recorded(start: &str) -> Sandbox {
    let room = Sandbox::tiny();
    let scene = "observation.keypoints.layout=halpe26 actor.skin=person_coarse tracker_body.robot=tracker40 \
                 rig.ring.count=3 rig.ring.size_px=[160,120] motion.last_frame=6 rig.ring.field_of_view_deg=45";
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
fn estimates_of_reimported_set_are_equal() {
    let room = recorded(START_OF_SET);
    room.succeed("import walk.toml --out back -q");
    for set in ["truth", "back"] {
        let settings = "annealed_particle_filter particles=20 layers=3 evidence=both";
        room.succeed(&format!("track {set} --tracker {settings} --seed 3 --out {set}-run -q"));
    }
    assert!(room.read("truth-run/poses.npz") == room.read("back-run/poses.npz"), "estimates differ");
}

#[test]
fn recording_needs_no_truth_to_be_tracked() {
    let room = recorded("[tracker_body]\nstature_m = 1.7\n");
    let told = room.succeed("import walk.toml --out set");
    assert!(
        told.stderr.contains("keypoints triangulated from all cameras are off by (median): cam00 0.0 px"),
        "{}",
        told.stderr
    );
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
    for words in ["Silhouette overlap (IoU)", "overlap in cam02", "worst image: overlap"] {
        assert!(table.contains(words), "{words}: {table}");
    }
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
    let refused = room.ask("export set --to coco --out coco");
    assert!(refused.code == 2 && refused.stderr.contains("is a recording of a person"), "{}", refused.stderr);
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
