//! Sets with keypoints: rendered, checked, given to programs, and with errors in their settings.

use serde_json::Value;
use skiagraph_core::npz::{Npz, Values};

use crate::sandbox::{Sandbox, shipped};
use crate::support::python_with_numpy;

#[test]
fn python_example_triangulates_exactly() {
    let Some(python) = python_with_numpy() else { return };
    let room = Sandbox::tiny();
    room.succeed("render tiny.toml observation.keypoints.layout=halpe26 --out set");
    let told = room.text("set/set.toml");
    assert!(told.contains("[observation.keypoints]") && told.contains("layout = \"halpe26\""), "{told}");
    room.succeed("verify set");
    let command = format!("{} {}", python.display(), shipped("examples/external/keypoints.py").display());
    room.ask(&format!("track set --exec '{command}' --out run"));
    room.succeed("evaluate set run");
    let run: Value = room.json("run/run.json");
    let joints = &run["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap();
    assert!(*joints < 2.0, "{run}");
}

/// In some camera around it.
#[test]
fn eyes_of_every_skin_show() {
    let room = Sandbox::tiny();
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
