//! Images of the scene for trackers: rendered, given to programs, and refused where they cannot be taken.

use std::process::Command;

use serde_json::Value;

use crate::sandbox::{Sandbox, shipped};
use crate::support::python_with_numpy;

#[test]
fn opencv_program_tracks_in_images() {
    let Some(python) = python_with_numpy() else { return };
    if !Command::new(&python).args(["-c", "import cv2"]).status().is_ok_and(|status| status.success()) {
        return;
    }
    let room = Sandbox::tiny();
    let program = format!("{} {}", python.display(), shipped("examples/external/background.py").display());
    room.ask(&format!("run tiny.toml observation.colour_images=jpeg observation.images.background_frames=2 rig.ring.size_px=[160,120] observation.images.clothing_contrast=120 --exec '{program}' --seeds 1 --out run"));
    let run: Value = room.json("run/run.json");
    assert_eq!(run["metrics"]["lost_frames"]["mean"], 0.0, "{run}");
    assert!(run["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap() < 200.0);
    // without images the program says what it needs
    room.refused(&format!("run tiny.toml --exec '{program}' --seeds 1 --out none"), "observation.colour_images=png");
}

#[test]
fn plain_sets_name_no_images() {
    let room = Sandbox::tiny();
    room.succeed("render tiny.toml --out plain");
    let told = room.text("plain/set.toml");
    assert!(!told.contains("colour_images") && !told.contains("[observation"), "{told}");
    let moved = "rig.motion=[{camera=\"cam00\",keyframes=[{time_s=0,position_m=[3.2,3.2,1.6],look_at_m=[0,0,1]}]}]";
    room.refused("render tiny.toml observation.colour_images=gif --out set", "png");
    room.refused(
        &format!("render tiny.toml observation.colour_images=png {moved} --out set"),
        "observation.colour_images",
    );
}
