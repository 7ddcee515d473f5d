//! Images of the scene for trackers: rendered, given to programs, and refused where they cannot be taken.

use std::process::Command;

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY, shipped};
use crate::support::python_with_numpy;

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room
}

#[test]
fn an_opencv_program_tracks_in_the_images_alone() {
    let Some(python) = python_with_numpy() else { return };
    if !Command::new(&python).args(["-c", "import cv2"]).status().is_ok_and(|status| status.success()) {
        return;
    }
    let room = room();
    let program = format!("{} {}", python.display(), shipped("examples/external/background.py").display());
    room.skiagraph([
        "run",
        "tiny.toml",
        "observation.colour_images=jpeg",
        "observation.images.background_frames=2",
        "rig.ring.size_px=[160,120]",
        "observation.images.clothing_contrast=120",
        "--exec",
        &program,
        "--seeds",
        "1",
        "--out",
        "run",
    ]);
    let run: Value = serde_json::from_slice(&room.read("run/run.json")).unwrap();
    assert_eq!(run["metrics"]["lost_frames"]["mean"], 0.0, "{run}");
    assert!(run["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap() < 200.0);
    // without images the program says what it needs
    let none = room.skiagraph(["run", "tiny.toml", "--exec", &program, "--seeds", "1", "--out", "none"]);
    assert!(none.code == 2 && none.stderr.contains("observation.colour_images=png"), "{}", none.stderr);
}

#[test]
fn other_sets_keep_their_bytes_and_moving_cameras_are_refused() {
    let room = room();
    room.succeed("render tiny.toml --out plain");
    let told = String::from_utf8(room.read("plain/set.toml")).unwrap();
    assert!(!told.contains("colour_images") && !told.contains("[observation"), "{told}");
    let moved = "rig.motion=[{camera=\"cam00\",keyframes=[{time_s=0,position_m=[3.2,3.2,1.6],look_at_m=[0,0,1]}]}]";
    let refused = room.skiagraph(["render", "tiny.toml", "observation.colour_images=gif", "--out", "set"]);
    assert!(refused.code == 2 && refused.stderr.contains("png"), "{}", refused.stderr);
    let refused = room.skiagraph(["render", "tiny.toml", "observation.colour_images=png", moved, "--out", "set"]);
    assert!(refused.code == 2 && refused.stderr.contains("observation.colour_images"), "{}", refused.stderr);
}
