//! Units of intervals: seeds, noise draws and clips.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY};

/// A sandbox with five noise draws of one clip, each with a run of a deterministic tracker.
fn room_of_draws() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    for draw in 1..=5 {
        let noise = format!("observation.corruption.start_mm=40 observation.seed={draw}");
        room.succeed(&format!("render tiny.toml {noise} --out set-{draw}"));
        room.succeed(&format!("track set-{draw} --tracker frozen --out still/{draw}"));
        room.succeed(&format!("evaluate set-{draw} still/{draw}"));
    }
    room
}

fn json(room: &Sandbox, arguments: &str) -> Value {
    serde_json::from_str(&room.skiagraph(arguments.split_whitespace()).stdout).unwrap()
}

#[test]
fn a_deterministic_tracker_is_compared_and_gated_over_noise_draws() {
    let room = room_of_draws();
    for draw in 1..=5 {
        room.succeed(&format!("track set-{draw} --tracker annealed_particle_filter --seeds 2 --out moving/{draw}"));
        room.succeed(&format!("evaluate set-{draw} moving/{draw}"));
    }
    let found = json(&room, "compare still moving --json");
    let side = &found["others"][0];
    assert_eq!((&side["unit"], &side["paired"]), (&"draws".into(), &true.into()));
    let error = &side["metrics"][0];
    assert_eq!((&error["unit"], &error["over"]), (&"mm".into(), &"draws".into()));
    assert_eq!((&error["runs"], &error["freedom"]), (&serde_json::json!([5, 5]), &4.0.into()));
    let value = |run: &str| -> f64 {
        let record: Value = serde_json::from_slice(&room.read(&format!("{run}/run.json"))).unwrap();
        record["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap()
    };
    let mean =
        (1..=5).map(|draw| value(&format!("moving/{draw}")) - value(&format!("still/{draw}"))).sum::<f64>() / 5.0;
    assert!((error["difference"].as_f64().unwrap() - mean).abs() < 1e-9, "each draw is the mean of its seeds");
    let text = room.succeed("compare still moving").stdout;
    assert!(text.contains("5 draws of the noise of one clip (tiny, 0."), "{text}");
    assert!(text.contains("they do not cover other motions"), "{text}");
    // several folders a side
    let vs = "compare still/1 still/2 still/3 --vs moving/1 moving/2 moving/3 --json";
    assert_eq!(json(&room, vs)["others"][0]["metrics"][0]["runs"], serde_json::json!([3, 3]));

    assert!(room.succeed("baseline save still still").stdout.contains("tiny (5 draws, seeds 0)"));
    let passed = room.succeed("gate still --baseline still --margin 1mm");
    assert!(passed.stdout.starts_with("PASS") && passed.stdout.contains("draws of the noise"), "{}", passed.stdout);
    let worse = json(&room, "gate still/1 still/2 still/3 still/4 still/5 --baseline still --margin 1mm --json");
    assert_eq!((&worse["unit"], &worse["verdict"]), (&"draws".into(), &"pass".into()));
    let lacking = room.skiagraph("gate still/1 still/2 --baseline still --margin 1mm".split(' '));
    assert!(lacking.code == 2 && lacking.stderr.contains("the run lacks its draw with the hash"), "{}", lacking.stderr);
    let asked = room.skiagraph("gate still --baseline still --margin 1mm --unit clips".split(' '));
    assert!(asked.code == 2 && asked.stderr.contains("a gate over clips needs 5"), "{}", asked.stderr);
}

#[test]
fn compare_needs_three_clips_and_the_gate_five() {
    let room = Sandbox::new();
    for (number, last_frame) in (1..=5).zip([3, 4, 5, 6, 7]) {
        let scenario = TINY.replace("\"tiny\"", &format!("\"clip-{number}\""));
        room.write("clip.toml", scenario.replace("last_frame = 3", &format!("last_frame = {last_frame}")));
        room.succeed(&format!("run clip.toml --seeds 2 --out main/{number}"));
        room.succeed(&format!("run clip.toml --seeds 2 particles=4 --out mine/{number}"));
    }
    let found = json(&room, "compare main mine --json");
    let side = &found["others"][0];
    assert_eq!((&side["unit"], &side["metrics"][0]["freedom"]), (&"clips".into(), &4.0.into()), "clips less one");
    assert!(side["scope"].as_str().unwrap().starts_with("intervals are over 5 clips (clip-1, 0."), "{side}");
    let seeds = json(&room, "compare main mine --unit seeds --json");
    assert_eq!(seeds["others"][0]["unit"], "seeds");
    assert_eq!(seeds["others"][0]["metrics"][0]["runs"], serde_json::json!([10, 10]));
    room.succeed("baseline save all main");
    let passed = room.succeed("gate main --baseline all --margin 0mm");
    assert!(passed.stdout.contains("intervals are over 5 clips"), "{}", passed.stdout);
    let two = room.succeed("compare main/1 main/2 --vs mine/1 mine/2 --unit clips").stdout;
    assert!(two.contains("2 clips are too few for an interval over clips (3 or more)"), "{two}");
}

/// Five copies of a deterministic run must neither show an exact difference nor pass a gate.
#[test]
fn copies_of_one_run_count_as_one_observation() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    for (name, tracker) in [("still", "frozen"), ("truth", "oracle")] {
        room.succeed(&format!("track set --tracker {tracker} --seeds 5 --out {name}"));
        let said = room.succeed(&format!("evaluate set {name}")).stdout;
        assert!(said.contains("5 seeds with bit-identical estimates"), "{said}");
    }
    let found = json(&room, "compare still truth --json");
    let error = &found["others"][0]["metrics"][0];
    assert_eq!((&error["finding"], &error["p"], &error["ci95"]), (&"too_few".into(), &Value::Null, &Value::Null));
    let text = room.succeed("compare still truth").stdout;
    assert!(text.contains("copies are one observation") && text.contains("observation.seed=2"), "{text}");
    let refused = room.skiagraph("baseline save still still".split(' '));
    assert!(refused.code == 2 && refused.stderr.contains("copies count as one observation"), "{}", refused.stderr);
}

#[test]
fn runs_on_sets_that_differ_in_more_than_the_noise_are_not_draws() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    for (number, change) in [(1, "observation.seed=1"), (2, "rig.ring.count=1"), (3, "motion.last_frame=2")] {
        let noise = "observation.corruption.start_mm=40";
        room.succeed(&format!("render tiny.toml {noise} {change} --out set-{number}"));
        room.succeed(&format!("track set-{number} --tracker frozen --out still/{number}"));
        room.succeed(&format!("evaluate set-{number} still/{number}"));
    }
    for other in [2, 3] {
        let refused = room.skiagraph(format!("compare still/1 still/{other} --vs still/1").split(' '));
        assert!(
            refused.code == 2 && refused.stderr.contains("more than the observation's noise"),
            "{}",
            refused.stderr
        );
    }
}
