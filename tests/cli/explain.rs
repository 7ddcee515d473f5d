//! `skiagraph explain`: planted causes are found, parts add up, and worst seconds repeat.

use serde_json::Value;
use skiagraph_core::npz::Npz;
use std::fs;
use std::process::Command;
use std::time::Duration;

use crate::sandbox::{PROGRAM, Sandbox, TINY, shipped};
use crate::support::python_with_numpy;

/// A quarter of a second of walking, tracked with the actor's own body, so that nothing is wrong but what is planted.
const MATCHED: &str = r#"
schema = "skiagraph.scenario/1"
name = "matched"

[motion]
clip = "embedded:walk"
last_frame = 16

[actor]
robot = "tracker25"

[tracker_body]
robot = "tracker25"
mismatch = "none"

[rig.ring]
radius_m = 3.5
size_px = [160, 120]

[tracker.annealed_particle_filter]
particles = 30
layers = 3
"#;

fn explained(room: &Sandbox, arguments: &str) -> Value {
    room.json_of(&format!("explain {arguments} --json"))
}

/// The part of a cause, mm; 0 if it is left out.
fn part(explanation: &Value, player: &str) -> f64 {
    let causes = explanation["causes"].as_array().unwrap();
    causes.iter().find(|cause| cause["player"] == player).map_or(0.0, |cause| cause["error_mm"].as_f64().unwrap())
}

/// The parts must add up to the run's error: in all, by joint and in every frame.
fn assert_sums(room: &Sandbox, run: &str, explanation: &Value) {
    let record: Value = room.json(&format!("{run}/run.json"));
    let sum = |value: &dyn Fn(&Value) -> f64| {
        let causes: f64 = explanation["causes"].as_array().unwrap().iter().map(value).sum();
        causes + explanation["interaction_mm"].as_f64().unwrap_or(0.0)
    };
    let error = record["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap();
    let all = sum(&|cause| cause["error_mm"].as_f64().unwrap()) + explanation["rest_mm"].as_f64().unwrap();
    assert!((all - error).abs() < 1e-9, "{all} {error}");
    assert!((explanation["error_mm"].as_f64().unwrap() - error).abs() < 1e-9);
    if explanation["interaction_mm"].is_null() {
        let wrist = |parts: &Value| parts["joints"]["left_wrist"].as_f64().unwrap();
        let all = sum(&|cause| wrist(&cause["parts"])) + wrist(&explanation["rest"]);
        let joints = record["metrics"]["humaneva_mm"]["joints"].as_array();
        assert!(all > 0.0 && joints.is_none_or(|joints| !joints.is_empty()));
    }
}

/// Most of it, and the parts add up.
#[test]
fn planted_causes_get_the_error() {
    let room = Sandbox::new();
    room.write("matched.toml", MATCHED);
    let late: Vec<String> = (0..4).map(|n| format!("{{camera=\"cam{n:02}\",offset_ms=50.0}}")).collect();
    let late = format!("rig.timing=[{}]", late.join(","));
    for (player, name, planted) in [("cameras", "cameras", "calibration_deg=2"), ("time", "timing", &late)] {
        room.succeed(&format!("run matched.toml {planted} --out {player}"));
        let explanation = explained(&room, player);
        let (error, part) = (explanation["error_mm"].as_f64().unwrap(), part(&explanation, player));
        assert!(part > 0.8 * error, "{player}: {part} of {error} mm\n{explanation}");
        assert_sums(&room, player, &explanation);
        assert_eq!(explanation["repetition"]["is_identical"], true);
        let page = room.text(&format!("{player}-explained/explain.html"));
        assert!(page.contains(&format!("mm: {name} ")) && page.contains("id=\"joints\""));
    }
}

/// The study of planted causes on a small case: where nothing else is wrong, all of the excess is found.
#[test]
fn whole_planted_excess_is_found() {
    let Some(python) = python_with_numpy() else { return };
    let done = Command::new(python)
        .arg(shipped("examples/planted_causes.py"))
        .args(["--takes", "embedded:walk", "--frames", "6", "--settings", "rig.ring.size_px=[80,60]", "--skiagraph"])
        .arg(PROGRAM)
        .output()
        .unwrap();
    let table = String::from_utf8(done.stdout).unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert_eq!(table.lines().count(), 8, "{table}");
    assert!(table.lines().skip(2).all(|row| row.ends_with(" | 100 % |")), "{table}");
}

/// And a full one has none.
#[test]
fn quick_explanation_has_an_interaction() {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml calibration_mm=50 start_mm=50 --out run");
    let quick = explained(&room, "run --quick --out quick");
    let names: Vec<&str> =
        quick["causes"].as_array().unwrap().iter().map(|cause| cause["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["body", "cameras", "start pose", "search"]);
    assert!(quick["interaction_mm"].is_number() && quick["cells"].as_array().unwrap().len() == 6, "{quick}");
    assert_sums(&room, "run", &quick);
    let full = explained(&room, "run --out full");
    assert!(full["interaction_mm"].is_null() && full["cells"].as_array().unwrap().len() == 9, "{full}");
    assert_sums(&room, "run", &full);
    let again = explained(&room, "run --out full");
    assert_eq!(again, full, "an explanation replaces itself, and is the same again");
    for shorter in ["--quick", "--seeds 1"] {
        room.refused(&format!("explain run --out full {shorter}"), "a fuller explanation");
    }
    room.refused("explain run --out other --from-start", "--worst");
}

#[test]
fn killed_explanation_is_resumed() {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml calibration_mm=50 start_mm=50 particles=300 layers=4 --out run");
    room.succeed("explain run --out whole -q");
    let finished = || {
        let kept = fs::read_dir(room.path("again.partial")).into_iter().flatten().flatten();
        kept.filter(|entry| entry.file_name().to_string_lossy().contains("seed-")).count()
    };
    let mut amid = 0;
    for attempt in 0..5 {
        let before = finished();
        let is_due = || attempt == 0 || finished() > before;
        room.run_and_kill_once("explain run --out again -q", is_due, Duration::from_millis(7 * attempt));
        amid += usize::from(finished() > before && !room.path("again").exists());
        assert!(room.path("again").exists() || finished() >= before, "no finished repetition is lost");
    }
    assert!(amid > 0, "no kill came between two repetitions");
    // other repetitions of the same run are not lost either, but those of another run are refused
    let kept = finished();
    room.succeed("run tiny.toml start_mm=50 particles=300 layers=4 --out other");
    if kept > 0 {
        room.refused("explain other --out again", "run: was run, now other");
    }
    let done = room.succeed("explain run --out again");
    assert!(kept == 0 || done.stderr.contains(" of 14 were finished before the interruption"), "{}", done.stderr);
    for file in ["explain.json", "explain.html"] {
        assert_eq!(room.read(&format!("again/{file}")), room.read(&format!("whole/{file}")), "{file}");
    }
    assert!(!room.path("again.partial").exists());
}

#[test]
fn explained_sets_equal_scenarios() {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml start_mm=50 --out whole");
    room.succeed("render tiny.toml start_mm=50 --key default --out set");
    room.succeed("track set --tracker annealed_particle_filter particles=12 layers=2 --seeds 2 --out parts");
    room.succeed("evaluate set parts");
    room.refused("explain parts", "give its set with --set SET");
    let [whole, parts] = ["whole", "parts --set set"].map(|arguments| explained(&room, arguments));
    assert_eq!(whole["causes"], parts["causes"]);
}

/// Where the tracker remembers nothing else.
#[test]
fn worst_seconds_repeat() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY.replace("last_frame = 3", "loop_to_s = 1.5\nframes_per_second = 30.0"));
    room.succeed("run tiny.toml tracker.frozen={} --seeds 1 --out run");
    let explanation = explained(&room, "run --worst 2");
    let worst = explanation["worst"].as_array().unwrap();
    assert_eq!(worst.len(), 1, "a second and a half has one whole second that does not overlap another: {explanation}");
    // a frozen tracker stays where it starts, which is the run's start pose in every frame
    assert_eq!(worst[0]["is_identical"], true, "{explanation}");
    let set = format!("run-explained/{}", worst[0]["folder"].as_str().unwrap());
    let readme = room.text(&format!("{set}/README.txt"));
    assert!(readme.contains("Cut out by skiagraph explain --worst: frames "), "{readme}");
    room.succeed(&format!("track {set} --tracker frozen --out again"));
    room.succeed(&format!("evaluate {set} again"));
}

/// Before anything is tracked.
#[test]
fn uncut_worst_second_is_refused() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY.replace("last_frame = 3", "loop_to_s = 1.5\nframes_per_second = 30.0"));
    let noisy = "observation.keypoints.layout=coco17 observation.keypoints.white_percent=1";
    room.succeed(&format!("run tiny.toml tracker.frozen={{}} {noisy} --seeds 1 --out run"));
    let refused = room.ask("explain run --worst 2");
    assert!(refused.code == 2 && refused.stderr.contains("cannot be cut out; use --from-start"), "{}", refused.stderr);
    let begins = |words: &str| refused.stderr.contains(words);
    assert!(begins("--worst 2: only 1") && !begins("to check that the run repeats"), "{}", refused.stderr);
    room.succeed("explain run --worst 1 --from-start");
}

/// Of a calibrated run.
#[test]
fn landscape_has_the_trackers_energy() {
    let room = Sandbox::new();
    let given = MATCHED.replacen("tracker25", "actor", 1).replace("mismatch = \"none\"", "calibrate = true");
    room.write("tiny.toml", given.replace("last_frame = 16", "last_frame = 29\nframes_per_second = 20.0"));
    room.succeed("run tiny.toml calibration_deg=1 --seeds 1 --out run");
    let record: Value = room.json("run/track.json");
    assert_eq!(record["calibration"][0]["verdict"], "kept");
    assert!(record["calibration"][0]["cameras"].is_array(), "the cameras are corrected: {record}");
    let done = room.succeed("explain run --quick --worst 2 --json");
    assert!(!done.stderr.contains("calibration, seed"), "{}", done.stderr);
    let explanation: Value = serde_json::from_str(&done.stdout).unwrap();
    let worst = explanation["worst"].as_array().unwrap();
    assert_eq!(worst.len(), 1, "{explanation}");
    let landscape = &worst[0]["landscape"];
    let search = Npz::from_bytes("search.npz", &room.read("run/search.npz")).unwrap();
    let energies = search.f64s("search.npz", "energy", &[Some(1), None]).unwrap();
    let frame = usize::try_from(landscape["frame"].as_u64().unwrap()).unwrap();
    assert_eq!(landscape["energy_of_estimate"].as_f64().unwrap(), energies[frame]);
}

/// If they are named again and repeat.
#[cfg(unix)]
#[test]
fn programs_are_explained() {
    let room = Sandbox::tiny();
    room.succeed("render tiny.toml start_mm=100 --key default --out set");
    let program = format!("sh {}", shipped("examples/external/frozen.sh").display());
    let track = |program: &str, out: &str| {
        room.succeed(&format!("track set --exec '{program}' --out {out}"));
        room.succeed(&format!("evaluate set {out}"));
    };
    track(&program, "run");
    room.refused("explain run --set set", "give --exec ");
    room.refused("explain run --set set --exec true", "expected the program of the run");
    let found = room.json_of(&format!("explain run --set set --exec '{program}' --json"));
    // it never moves, so its whole error but the motion comes from where it starts
    assert!(part(&found, "start") > 50.0 && part(&found, "search") == 0.0, "{found}");
}

#[test]
fn unrepeatable_runs_are_refused() {
    let room = Sandbox::tiny();
    room.succeed("render tiny.toml start_mm=100 --out whole --key default");
    room.succeed("run tiny.toml paper=true --seeds 1 --out run");
    for (arguments, words) in [
        ("explain nowhere", "run.json"),
        ("explain whole", "is a benchmark set, but a run was expected"),
        ("explain run --set whole --seeds 0", "0 is not in 1..=100000"),
        ("explain run --exec true", "the run's tracker is built in"),
        ("explain run --out run", "run"),
    ] {
        room.refused(arguments, words);
    }
    // estimates that the tracker does not give again
    let record = room.text("run/track.json");
    room.write("run/track.json", record.replace("\"layers\": 2", "\"layers\": 3"));
    room.refused("explain run", "not deterministic");
}
