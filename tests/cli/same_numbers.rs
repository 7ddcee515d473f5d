//! The same scenario and seed give the same bytes with all commands.

use serde_json::Value;
use skiagraph_set::{BlindSet, Estimates};

use crate::sandbox::Sandbox;

/// `run.json` without the part that differs from run to run.
fn run_json(room: &Sandbox, run: &str) -> Value {
    let mut record: Value = room.json(&format!("{run}/run.json"));
    assert!(record.as_object_mut().unwrap().remove("timing").is_some());
    record
}

/// `report.html` without the part that differs from run to run.
pub(crate) fn report(room: &Sandbox, run: &str) -> String {
    let page = room.text(&format!("{run}/report.html"));
    let (before, rest) = page.split_once("<section id=\"this-run\">").unwrap();
    before.to_owned() + rest.split_once("</section>").unwrap().1
}

fn assert_same(room: &Sandbox, a: &str, b: &str) {
    assert_eq!(run_json(room, a), run_json(room, b));
    assert!(report(room, a) == report(room, b), "{a}/report.html and {b}/report.html differ");
    for file in ["poses.npz", "search.npz", "per_frame.csv"] {
        assert!(
            room.read(&format!("{a}/{file}")) == room.read(&format!("{b}/{file}")),
            "{a}/{file} and {b}/{file} differ"
        );
    }
}

#[test]
fn threads_change_no_byte() {
    let room = Sandbox::tiny();
    for threads in [1, 2, 8] {
        room.succeed(&format!("run tiny.toml --threads {threads} --out t{threads}"));
    }
    assert_same(&room, "t1", "t2");
    assert_same(&room, "t1", "t8");
    room.succeed("run tiny.toml --seed 7 --out other");
    assert_ne!(room.read("t1/poses.npz"), room.read("other/poses.npz"));
}

#[test]
fn run_equals_render_track_and_evaluate() {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml --out whole");
    room.succeed("render tiny.toml --out set");
    room.succeed("track set --tracker annealed_particle_filter particles=12 layers=2 --seeds 2 --out parts");
    let table = room.succeed("evaluate set parts").stdout;
    assert_same(&room, "whole", "parts");
    assert!(table.contains("HumanEva 3-D error (mm)") && table.contains("frozen"), "{table}");
    let json: Value = room.json_of("evaluate set parts --json");
    assert_eq!(json["schema"], "skiagraph.run/1");
    assert_eq!(json["metrics"], run_json(&room, "whole")["metrics"]);
}

#[test]
fn unwritable_evaluation_changes_nothing() {
    let room = Sandbox::with_run();
    // a directory is in the way
    std::fs::create_dir(room.path("run/.report.html.partial")).unwrap();
    room.refused("evaluate set run", "");
    for absent in ["contact_sheet.png", "per_frame.csv", "run.json", ".per_frame.csv.partial"] {
        assert!(!room.path("run").join(absent).exists(), "{absent}");
    }
}

/// At another rate, or with a repeated seed.
#[test]
fn misfitting_poses_are_refused() {
    let room = Sandbox::with_run();
    std::fs::remove_file(room.path("run/track.json")).unwrap();
    let body = BlindSet::read(&room.path("set")).unwrap().start.body;
    let poses = Estimates::from_bytes("poses.npz", &room.read("run/poses.npz"), &body).unwrap();
    let twice =
        Estimates { seeds: vec![poses.seeds[0]; 2], sequences: vec![poses.sequences[0].clone(); 2], ..poses.clone() };
    let faster = Estimates { frames_per_second: 2.0 * poses.frames_per_second, ..poses };
    for (broken, expected) in [(faster, "frames a second, the set"), (twice, "twice")] {
        room.write("run/poses.npz", broken.to_bytes("poses.npz", &body, None).unwrap());
        room.refused("evaluate set run", expected);
    }
}

#[test]
fn scenario_of_a_run_reproduces_it() {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml seeds=1 rig.ring.count=3 --out a");
    room.succeed("run a/made_by.json --out b");
    assert_same(&room, "a", "b");
}
