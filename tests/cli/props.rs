//! Props, from the scenario to silhouettes, contact truth and report.

use serde_json::Value;
use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_set::BenchmarkSet;

use crate::sandbox::Sandbox;

/// The first third of a second, at 60 Hz.
const FRAMES: usize = 21;
const SCENARIO: &str = "schema = \"skiagraph.scenario/1\"\nname = \"hall\"\n[motion]\nclip = \"embedded:walk\"\nlast_frame = 11\n\
                        [rig.ring]\nsize_px = [80, 60]\n[tracker.oracle]\n";
/// A wall in front of the second camera of the ring, and a plate on which the walk begins.
const PROPS: &str = "[[prop]]\nname = \"screen\"\nshape = { box = { size_m = [2.0, 0.1, 1.0] } }\nplace_m = [-1.5, 1.5, 0.5]\n\
                     rotation_deg = [0.0, 0.0, 45.0]\n[[prop]]\nname = \"plate\"\n\
                     shape = { cylinder = { radius_m = 3.0, length_m = 0.2 } }\nplace_m = [0.0, 0.0, -0.1]\n";

fn pixels(set: &BenchmarkSet) -> Vec<u64> {
    let seen = set.blind.observation(5).unwrap().silhouettes;
    seen.iter().map(|mask| mask.count()).collect()
}

#[test]
fn props_occlude_and_are_touched() {
    let room = Sandbox::new();
    room.write("bare.toml", SCENARIO);
    room.write("hall.toml", format!("{SCENARIO}{PROPS}"));
    room.succeed("render bare.toml --out bare");
    room.succeed("render hall.toml --out hall");
    let [bare, hall] = ["bare", "hall"].map(|set| BenchmarkSet::read(&room.path(set)).unwrap());
    assert!(bare.truth.ground_truth.props.is_empty() && !room.path("bare/truth/props.json").exists());
    let names: Vec<&str> = hall.truth.ground_truth.props.iter().map(|prop| prop.name.as_str()).collect();
    assert_eq!(names, ["screen", "plate"]);
    let (all, left) = (pixels(&bare), pixels(&hall));
    assert!(left[1] > 0 && 8 * left[1] < 7 * all[1], "the screen hides an eighth at least: {left:?} of {all:?}");
    for camera in [0, 2, 3] {
        assert_eq!(left[camera], all[camera], "camera {camera}: nothing stands before the walker");
    }
    // markers are occluded as well
    let seen = |set: &BenchmarkSet| {
        set.truth.ground_truth.frames.iter().flat_map(|frame| frame.visible[1]).filter(|visible| *visible).count()
    };
    assert!(seen(&hall) < seen(&bare));
    // the plate is flush with the ground, so a foot on one touches the other
    let contact = Npz::from_bytes("contact.npz", &room.read("hall/truth/contact.npz")).unwrap();
    let links = contact.f64s("contact.npz", "gap", &[None, None]).unwrap().len() / FRAMES;
    let gaps = contact.f64s("contact.npz", "gap", &[Some(FRAMES), Some(links)]).unwrap();
    let prop_gaps = contact.f64s("contact.npz", "prop_gap", &[Some(FRAMES), Some(2), Some(links)]).unwrap();
    let Some(Array { values: Values::Bool(touches), .. }) = contact.get("prop_in_contact") else { panic!() };
    for frame in 0..FRAMES {
        for link in 0..links {
            let (ground, plate) = (gaps[frame * links + link], prop_gaps[(frame * 2 + 1) * links + link]);
            assert!((ground - plate).abs() < 5e-4, "frame {frame}, link {link}: {ground} and {plate} m");
        }
    }
    assert!(
        touches.chunks(links).skip(1).step_by(2).any(|plate| plate.contains(&true)),
        "somebody stands on the plate"
    );
    assert!(!touches.chunks(links).step_by(2).any(|screen| screen.contains(&true)), "nobody touches the screen");
    room.says("inspect hall", &["screen, plate"]);
    room.succeed("run hall.toml --out run");
    let record: Value = room.json("run/run.json");
    for metric in ["prop_penetration_mm", "truth_prop_penetration_mm"] {
        assert!(record["metrics"][metric]["mean"].is_number(), "{metric}");
    }
    let page = room.text("run/report.html");
    assert!(page.contains("hidden by props: screen, plate"));
}
