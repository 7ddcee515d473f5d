//! Units of intervals: seeds, noise draws and clips.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY};

/// A sandbox with five noise draws of one clip, each with a run of a deterministic tracker.
fn room_of_draws() -> Sandbox {
    let room = Sandbox::tiny();
    for draw in 1..=5 {
        let noise = format!("observation.corruption.start_mm=40 observation.seed={draw}");
        room.succeed(&format!("render tiny.toml {noise} --out set-{draw}"));
        room.succeed(&format!("track set-{draw} --tracker frozen --out still/{draw}"));
        room.succeed(&format!("evaluate set-{draw} still/{draw}"));
    }
    room
}

#[test]
fn draws_are_units_of_intervals() {
    let room = room_of_draws();
    for draw in 1..=5 {
        room.succeed(&format!("track set-{draw} --tracker annealed_particle_filter --seeds 2 --out moving/{draw}"));
        room.succeed(&format!("evaluate set-{draw} moving/{draw}"));
    }
    let found = room.json_of("compare still moving --json");
    let side = &found["others"][0];
    assert_eq!((&side["unit"], &side["paired"]), (&"draws".into(), &true.into()));
    let error = &side["metrics"][0];
    assert_eq!((&error["unit"], &error["over"]), (&"mm".into(), &"draws".into()));
    assert_eq!((&error["runs"], &error["freedom"]), (&serde_json::json!([5, 5]), &4.0.into()));
    let value = |run: &str| -> f64 { room.mean(run, "humaneva_mm") };
    let mean =
        (1..=5).map(|draw| value(&format!("moving/{draw}")) - value(&format!("still/{draw}"))).sum::<f64>() / 5.0;
    assert!((error["difference"].as_f64().unwrap() - mean).abs() < 1e-9, "each draw is the mean of its seeds");
    room.says("compare still moving", &["ntervals over 5 draws; clips: 1 (tiny, 0."]);
    // several folders a side
    let vs = "compare still/1 still/2 still/3 --vs moving/1 moving/2 moving/3 --json";
    assert_eq!(room.json_of(vs)["others"][0]["metrics"][0]["runs"], serde_json::json!([3, 3]));

    assert!(room.succeed("baseline save still still").stdout.contains("tiny (5 draws, seeds 0)"));
    let passed = room.succeed("gate still --baseline still --margin 1mm");
    assert!(passed.stdout.starts_with("PASS") && passed.stdout.contains("5 draws"), "{}", passed.stdout);
    let worse = room.json_of("gate still/1 still/2 still/3 still/4 still/5 --baseline still --margin 1mm --json");
    assert_eq!((&worse["unit"], &worse["verdict"]), (&"draws".into(), &"pass".into()));
    room.refused("gate still/1 still/2 --baseline still --margin 1mm", "the run lacks its draw with the hash");
    room.refused("gate still --baseline still --margin 1mm --unit clips", "a gate over clips needs 5");
}

/// `compare` needs three and the gate five.
#[test]
fn clips_are_units_of_intervals() {
    let room = Sandbox::new();
    for (number, last_frame) in (1..=5).zip([3, 4, 5, 6, 7]) {
        let scenario = TINY.replace("\"tiny\"", &format!("\"clip-{number}\""));
        room.write("clip.toml", scenario.replace("last_frame = 3", &format!("last_frame = {last_frame}")));
        room.succeed(&format!("run clip.toml --seeds 2 --out main/{number}"));
        room.succeed(&format!("run clip.toml --seeds 2 particles=4 --out mine/{number}"));
    }
    let found = room.json_of("compare main mine --json");
    let side = &found["others"][0];
    assert_eq!((&side["unit"], &side["metrics"][0]["freedom"]), (&"clips".into(), &4.0.into()), "clips less one");
    assert!(side["scope"].as_str().unwrap().starts_with("intervals over 5 clips; clips: 5 (clip-1, 0."), "{side}");
    let seeds = room.json_of("compare main mine --unit seeds --json");
    assert_eq!(seeds["others"][0]["unit"], "seeds");
    assert_eq!(seeds["others"][0]["metrics"][0]["runs"], serde_json::json!([10, 10]));
    room.succeed("baseline save all main");
    room.says("gate main --baseline all --margin 0mm", &["intervals over 5 clips"]);
    room.says("compare main/1 main/2 --vs mine/1 mine/2 --unit clips", &["too few clips that differ (3 or more)"]);
}

/// Five copies of a deterministic run must neither show an exact difference nor pass a gate.
#[test]
fn copies_are_one_observation() {
    let room = Sandbox::with_set();
    for (name, tracker) in [("still", "frozen"), ("truth", "oracle")] {
        room.succeed(&format!("track set --tracker {tracker} --seeds 5 --out {name}"));
        room.says(&format!("evaluate set {name}"), &["5 seeds with bit-identical estimates"]);
    }
    let found = room.json_of("compare still truth --json");
    let error = &found["others"][0]["metrics"][0];
    assert_eq!((&error["finding"], &error["p"], &error["ci95"]), (&"too_few".into(), &Value::Null, &Value::Null));
    room.says("compare still truth", &["one observation", "observation.seed=2"]);
    room.refused("baseline save still still", "copies count as one observation");
}

#[test]
fn other_sets_are_no_draws() {
    let room = Sandbox::tiny();
    for (number, change) in [(1, "observation.seed=1"), (2, "rig.ring.count=1"), (3, "motion.last_frame=2")] {
        let noise = "observation.corruption.start_mm=40";
        room.succeed(&format!("render tiny.toml {noise} {change} --out set-{number}"));
        room.succeed(&format!("track set-{number} --tracker frozen --out still/{number}"));
        room.succeed(&format!("evaluate set-{number} still/{number}"));
    }
    for other in [2, 3] {
        room.refused(&format!("compare still/1 still/{other} --vs still/1"), "more than the observation's noise");
    }
}
