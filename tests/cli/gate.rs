//! `skiagraph gate` and `skiagraph baseline`.

use serde_json::Value;

use crate::sandbox::{Sandbox, assert_contains};

/// A sandbox with a run of five seeds and its baseline.
fn room() -> Sandbox {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml --seeds 5 --out run");
    room.succeed("baseline save tiny run");
    room
}

/// And no worse one.
#[test]
fn gate_passes_the_same_run() {
    let room = room();
    let passed = room.succeed("gate run --baseline tiny --margin 0mm");
    assert!(passed.stdout.starts_with("PASS: run is within the margins of the baseline tiny"), "{}", passed.stdout);
    assert!(passed.stdout.contains("no run varies"), "{}", passed.stdout);
    // a tracker that never moves, under the same clip name: all seeds are equal, and worse by a known number
    room.succeed("run tiny.toml --seeds 5 tracker.annealed_particle_filter.particles=2 --out worse");
    let error = |run: &str| room.mean(run, "humaneva_mm");
    let arguments = "gate worse --baseline tiny --margin 0.001mm --junit gate.xml --github";
    let verdict = room.ask(arguments);
    let expected = match verdict.code {
        1 => "FAIL",
        3 => "INCONCLUSIVE",
        0 => "PASS",
        other => panic!("exit code {other}: {}", verdict.stderr),
    };
    assert!(verdict.stdout.starts_with(expected), "{}", verdict.stdout);
    assert_contains(&verdict.stdout, &["the tracker's settings differ from the baseline's: ", "particles 12 → 2"]);
    let json: Value = room.ask("gate worse --baseline tiny --margin 0.001mm --json").json();
    let worse_by = json["checks"][0]["worse_by"].as_f64().unwrap();
    assert!((worse_by - (error("worse") - error("run"))).abs() < 1e-9, "{worse_by}");
    let junit = room.text("gate.xml");
    assert!(junit.contains("<testcase classname=\"skiagraph.gate\" name=\"humaneva_mm\">"), "{junit}");
}

/// And only they are run.
#[test]
fn added_seeds_equal_longer_runs() {
    let room = room();
    room.succeed("run tiny.toml --seeds 7 --out seven");
    room.succeed("run tiny.toml --seeds 5 particles=11 --out mine");
    let before = room.read("mine/run.json");
    // with a margin equal to the difference, the gate is inconclusive
    let ask = |margin: f64, more: &str| {
        let answer = room.ask(&format!("gate mine --baseline tiny --margin {margin}mm --json {more}"));
        (answer.code, serde_json::from_str::<Value>(&answer.stdout).unwrap_or_default(), answer.stderr)
    };
    let (_, json, _) = ask(0.0, "");
    let difference = json["checks"][0]["worse_by"].as_f64().unwrap().max(0.0);
    let (code, json, _) = ask(difference, "");
    if code == 3 {
        assert_eq!(json["verdict"], "inconclusive");
        let (_, json, stderr) = ask(difference, "--add-seeds 2");
        // all runs, or those of shared seeds if pairing is more precise
        let runs = &json["checks"][0]["difference"]["runs"];
        assert!([[5, 7], [5, 5]].iter().any(|known| *runs == serde_json::json!(known)), "{runs}: {stderr}");
        assert_eq!(room.read("mine/run.json"), before, "the run itself is untouched");
        room.succeed("run tiny.toml --seeds 7 particles=11 --out mine-seven");
        let value = |path: &str, seed: usize| {
            let record: Value = room.json(path);
            record["metrics"]["humaneva_mm"]["per_run"][seed].as_f64().unwrap()
        };
        assert_eq!(value("mine/seeds-5-6/run.json", 0), value("mine-seven/run.json", 5));
        assert_eq!(value("mine/seeds-5-6/run.json", 1), value("mine-seven/run.json", 6));
        room.succeed("run tiny.toml --seeds 5 particles=11 --out mine");
        assert!(!room.path("mine/seeds-5-6").exists(), "a run that is made anew is replaced with all its seeds");
    }
    // additional seeds are accepted, and different ones with --other-seeds
    room.succeed("gate seven --baseline tiny --margin 99mm");
    room.succeed("run tiny.toml --seed 50 --seeds 5 --out other");
    room.succeed("gate other --baseline tiny --margin 99mm --other-seeds");
}

#[test]
fn missing_seeds_are_run_first() {
    let room = room();
    room.succeed("run tiny.toml --seeds 3 --out three");
    room.refused("gate three --baseline tiny --margin 0mm", "3 seed(s)");
    for _ in 0..2 {
        let passed = room.succeed("gate three --baseline tiny --margin 0mm --add-seeds 5");
        assert!(passed.stdout.starts_with("PASS") && passed.stdout.contains("no run varies"), "{}", passed.stdout);
        let folders =
            std::fs::read_dir(room.path("three")).unwrap().filter(|entry| entry.as_ref().unwrap().path().is_dir());
        assert_eq!(folders.count(), 1, "only what was missing is run, once");
        assert!(room.path("three/seeds-3-4/run.json").exists());
    }
}

#[test]
fn gate_without_seeds_is_inconclusive() {
    let room = room();
    room.succeed("render tiny.toml --out set");
    room.succeed("run tiny.toml --seeds 5 particles=11 --out other");
    for run in ["run", "other"] {
        room.write(&format!("{run}.npz"), room.read(&format!("{run}/poses.npz")));
        room.succeed(&format!("evaluate set {run}.npz --out their-{run}"));
        room.succeed(&format!("baseline save their-{run} their-{run}"));
    }
    let error = |run: &str| {
        let record: Value = room.json(&format!("their-{run}/run.json"));
        record["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap()
    };
    let (better, worse) = if error("run") < error("other") { ("run", "other") } else { ("other", "run") };
    let margin = error(worse) - error(better);
    let command = format!("gate their-{worse} --baseline their-{better} --margin {margin}mm --add-seeds 2 --json");
    let answer = room.ask(&format!("{command} --junit gate.xml"));
    assert_eq!(answer.code, 3, "{}{}", answer.stdout, answer.stderr);
    let json: Value = serde_json::from_str(&answer.stdout).unwrap();
    assert_eq!(json["verdict"], "inconclusive");
    let notes: Vec<&str> = json["notes"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let words = format!("--add-seeds: cannot run the tracker of their-{worse}");
    assert!(notes.iter().any(|note| note.starts_with(&words)), "{notes:?}");
    assert!(room.path("gate.xml").exists());
}
