//! The same scenario and seed give the same bytes with all commands.

use serde_json::Value;
use skiagraph::benchmark_set::{BlindSet, Estimates};

use crate::sandbox::{Sandbox, TINY};

/// `run.json` without the part that differs from run to run.
fn run_json(room: &Sandbox, run: &str) -> Value {
    let mut record: Value = serde_json::from_slice(&room.read(&format!("{run}/run.json"))).unwrap();
    assert!(record.as_object_mut().unwrap().remove("timing").is_some());
    record
}

/// `report.html` without the part that differs from run to run.
pub(crate) fn report(room: &Sandbox, run: &str) -> String {
    let page = String::from_utf8(room.read(&format!("{run}/report.html"))).unwrap();
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
fn any_number_of_threads_gives_the_same_bytes() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
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
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("run tiny.toml --out whole");
    room.succeed("render tiny.toml --out set");
    room.succeed("track set --tracker annealed_particle_filter particles=12 layers=2 --seeds 2 --out parts");
    let table = room.succeed("evaluate set parts").stdout;
    assert_same(&room, "whole", "parts");
    assert!(table.contains("HumanEva 3-D error (mm)") && table.contains("frozen"), "{table}");
    let json: Value = serde_json::from_str(&room.succeed("evaluate set parts --json").stdout).unwrap();
    assert_eq!(json["schema"], "skiagraph.run/1");
    assert_eq!(json["metrics"], run_json(&room, "whole")["metrics"]);
}

#[test]
fn a_tracker_never_opens_the_truth() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    std::fs::remove_dir_all(room.path("set/truth")).unwrap();
    room.succeed("track set --tracker annealed_particle_filter particles=12 layers=2 --out run");
    let oracle = room.skiagraph(["track", "set", "--tracker", "oracle", "--out", "oracle"]);
    assert_eq!(oracle.code, 2);
    assert!(oracle.stderr.contains("set has no truth"), "{}", oracle.stderr);
}

#[test]
fn poses_of_another_program_are_measured() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    room.succeed("track set --tracker frozen --out run");
    std::fs::remove_file(room.path("run/track.json")).unwrap();
    std::fs::remove_file(room.path("run/search.npz")).unwrap();
    room.succeed("evaluate set run");
    let record: Value = serde_json::from_slice(&room.read("run-evaluation/run.json")).unwrap();
    assert_eq!(record["tracker"], "external");
    assert_eq!(record["metrics"]["humaneva_mm"]["mean"], record["frozen"]["humaneva_mm"]);
}

#[test]
fn an_evaluation_that_cannot_be_written_changes_nothing() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    room.succeed("track set --tracker frozen --out run");
    // a directory is in the way
    std::fs::create_dir(room.path("run/.report.html.partial")).unwrap();
    let answer = room.skiagraph(["evaluate", "set", "run"]);
    assert_eq!(answer.code, 2, "{}", answer.stderr);
    for absent in ["contact_sheet.png", "per_frame.csv", "run.json", ".per_frame.csv.partial"] {
        assert!(!room.path("run").join(absent).exists(), "{absent}");
    }
}

#[test]
fn poses_at_another_rate_or_with_a_repeated_seed_are_refused() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    room.succeed("track set --tracker frozen --out run");
    std::fs::remove_file(room.path("run/track.json")).unwrap();
    let body = BlindSet::read(&room.path("set")).unwrap().start.body;
    let poses = Estimates::from_bytes("poses.npz", &room.read("run/poses.npz"), &body).unwrap();
    let twice =
        Estimates { seeds: vec![poses.seeds[0]; 2], sequences: vec![poses.sequences[0].clone(); 2], ..poses.clone() };
    let faster = Estimates { frames_per_second: 2.0 * poses.frames_per_second, ..poses };
    for (broken, expected) in [(faster, "frames a second, the set"), (twice, "twice")] {
        room.write("run/poses.npz", broken.to_bytes("poses.npz", &body, None).unwrap());
        let refused = room.skiagraph(["evaluate", "set", "run"]);
        assert_eq!(refused.code, 2, "{}", refused.stderr);
        assert!(refused.stderr.contains(expected), "{}", refused.stderr);
    }
}

#[test]
fn the_scenario_in_a_run_reproduces_its_numbers() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("run tiny.toml seeds=1 rig.ring.count=3 --out a");
    room.succeed("run a/scenario.toml --out b");
    assert_same(&room, "a", "b");
}

#[test]
fn a_run_of_another_set_is_refused() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    room.succeed("render tiny.toml rig.ring.radius_m=4.0 --out other");
    room.succeed("track set --tracker frozen --out run");
    let answer = room.skiagraph(["evaluate", "other", "run"]);
    assert_eq!(answer.code, 2);
    assert!(answer.stderr.contains("run does not fit other"), "{}", answer.stderr);
}
