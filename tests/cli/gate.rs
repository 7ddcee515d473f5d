//! `skiagraph gate` and `skiagraph baseline`.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY};

/// A sandbox with a run of five seeds and its baseline.
fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("run tiny.toml --seeds 5 --out run");
    room.succeed("baseline save tiny run");
    room
}

#[test]
fn the_same_run_passes_a_worse_one_fails_and_missing_seeds_are_added() {
    let room = room();
    let passed = room.succeed("gate run --baseline tiny --margin 0mm");
    assert!(passed.stdout.starts_with("PASS: run is within the margins of the baseline tiny"), "{}", passed.stdout);
    assert!(passed.stdout.contains("no run varies"), "{}", passed.stdout);
    // a tracker that never moves, under the same clip name: all seeds are equal, and worse by a known number
    room.succeed("run tiny.toml --seeds 5 tracker.annealed_particle_filter.particles=2 --out worse");
    let error = |run: &str| {
        let record: Value = serde_json::from_slice(&room.read(&format!("{run}/run.json"))).unwrap();
        record["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap()
    };
    let arguments = "gate worse --baseline tiny --margin 0.001mm --junit gate.xml --github";
    let verdict = room.skiagraph(arguments.split_whitespace());
    let expected = match verdict.code {
        1 => "FAIL",
        3 => "INCONCLUSIVE",
        0 => "PASS",
        other => panic!("exit code {other}: {}", verdict.stderr),
    };
    assert!(verdict.stdout.starts_with(expected), "{}", verdict.stdout);
    assert!(verdict.stdout.contains("the tracker's settings differ from the baseline's: "), "{}", verdict.stdout);
    assert!(verdict.stdout.contains("particles 12 → 2"), "{}", verdict.stdout);
    let json: Value =
        serde_json::from_str(&room.skiagraph("gate worse --baseline tiny --margin 0.001mm --json".split(' ')).stdout)
            .unwrap();
    let worse_by = json["checks"][0]["worse_by"].as_f64().unwrap();
    assert!((worse_by - (error("worse") - error("run"))).abs() < 1e-9, "{worse_by}");
    let junit = String::from_utf8(room.read("gate.xml")).unwrap();
    assert!(junit.contains("<testcase classname=\"skiagraph.gate\" name=\"humaneva_mm\">"), "{junit}");
}

#[test]
fn added_seeds_equal_those_of_a_longer_run_and_only_they_are_run() {
    let room = room();
    room.succeed("run tiny.toml --seeds 7 --out seven");
    room.succeed("run tiny.toml --seeds 5 particles=11 --out mine");
    let before = room.read("mine/run.json");
    // with a margin equal to the difference, the gate is inconclusive
    let ask = |margin: f64, more: &str| {
        let text = format!("gate mine --baseline tiny --margin {margin}mm --json {more}");
        let answer = room.skiagraph(text.split_whitespace());
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
            let record: Value = serde_json::from_slice(&room.read(path)).unwrap();
            record["metrics"]["humaneva_mm"]["per_run"][seed].as_f64().unwrap()
        };
        assert_eq!(value("mine/seeds-5-6/run.json", 0), value("mine-seven/run.json", 5));
        assert_eq!(value("mine/seeds-5-6/run.json", 1), value("mine-seven/run.json", 6));
        room.succeed("run tiny.toml --seeds 5 particles=11 --out mine");
        assert!(!room.path("mine/seeds-5-6").exists(), "a run that is made anew is replaced with all its seeds");
    }
    // additional seeds are accepted, different ones only with --other-seeds
    room.succeed("gate seven --baseline tiny --margin 99mm");
    room.succeed("run tiny.toml --seed 50 --seeds 5 --out other");
    let refused = room.skiagraph("gate other --baseline tiny --margin 99mm".split(' '));
    assert!(refused.code == 2 && refused.stderr.contains("seeds 0 to 4, the run 50 to 54"), "{}", refused.stderr);
    room.succeed("gate other --baseline tiny --margin 99mm --other-seeds");
}

#[test]
fn seeds_of_the_baseline_that_a_run_lacks_are_run_before_the_gate() {
    let room = room();
    room.succeed("run tiny.toml --seeds 3 --out three");
    let refused = room.skiagraph("gate three --baseline tiny --margin 0mm".split(' '));
    assert!(refused.code == 2 && refused.stderr.contains("3 seed(s)"), "{}", refused.stderr);
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
fn a_gate_stays_inconclusive_if_seeds_cannot_be_added() {
    let room = room();
    room.succeed("render tiny.toml --out set");
    room.succeed("run tiny.toml --seeds 5 particles=11 --out other");
    for run in ["run", "other"] {
        room.write(&format!("{run}.npz"), room.read(&format!("{run}/poses.npz")));
        room.succeed(&format!("evaluate set {run}.npz --out their-{run}"));
        room.succeed(&format!("baseline save their-{run} their-{run}"));
    }
    let error = |run: &str| {
        let record: Value = serde_json::from_slice(&room.read(&format!("their-{run}/run.json"))).unwrap();
        record["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap()
    };
    let (better, worse) = if error("run") < error("other") { ("run", "other") } else { ("other", "run") };
    let margin = error(worse) - error(better);
    let command = format!("gate their-{worse} --baseline their-{better} --margin {margin}mm --add-seeds 2 --json");
    let answer = room.skiagraph(format!("{command} --junit gate.xml").split_whitespace());
    assert_eq!(answer.code, 3, "{}{}", answer.stdout, answer.stderr);
    let json: Value = serde_json::from_str(&answer.stdout).unwrap();
    assert_eq!(json["verdict"], "inconclusive");
    let notes: Vec<&str> = json["notes"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let words = format!("--add-seeds: cannot run the tracker of their-{worse}");
    assert!(notes.iter().any(|note| note.starts_with(&words)), "{notes:?}");
    assert!(room.path("gate.xml").exists());
}

#[test]
fn a_negative_margin_is_refused_with_the_expected_range() {
    let room = room();
    let refused = room.skiagraph("gate run --baseline tiny --margin -2mm".split(' '));
    assert_eq!(refused.code, 2);
    assert!(
        refused.stderr.contains("margin `-2mm`: ") && refused.stderr.contains("must be 0 or more"),
        "{}",
        refused.stderr
    );
}

#[test]
fn baselines_are_listed_and_shown_and_mismatches_are_refused() {
    let room = room();
    assert!(room.succeed("baseline list").stdout.contains("tiny (seeds 0 to 4), annealed_particle_filter"));
    assert!(room.succeed("baseline show tiny").stdout.contains("humaneva_mm"));
    let size = room.read("results/baselines/tiny.json").len();
    assert!(size < 60_000, "a baseline is small: {size} bytes");
    let refused = |arguments: &str, part: &str| {
        let answer = room.skiagraph(arguments.split_whitespace());
        assert!(answer.code == 2 && answer.stderr.contains(part), "{arguments}: {part}: {}", answer.stderr);
    };
    refused("gate run --baseline tiny", "--margin 2mm");
    refused("gate run --baseline tiny --margin 2deg", "expected mm");
    refused("gate run --baseline tiny --margin 2parsecs", "expected a number");
    refused("gate run --baseline nothing --margin 2mm", "known: tiny");
    refused("gate nowhere --baseline tiny --margin 2mm", "no such file or folder");
    room.succeed("run tiny.toml --out two");
    refused("gate two --baseline tiny --margin 2mm", "has 2 seed(s) of `tiny`, a gate needs 5");
    refused("baseline save two two", "expected 5 or more seeds");
    room.succeed("run tiny.toml --seeds 5 rig.ring.count=1 --out one");
    refused("gate one --baseline tiny --margin 2mm", "another set than the baseline's (hashes ");
    room.write("gate.toml", "schema = \"skiagraph.gate/1\"\n[[budget]]\nmetric = \"pck150\"\nmargin = 0.5\n");
    assert!(room.succeed("gate run --baseline tiny").stdout.contains("pck150"));
    room.write("gate.toml", "schema = \"skiagraph.gate/1\"\n[[budget]]\nmetric = \"pck\"\nmargin = 0.5\n");
    refused("gate run --baseline tiny", "no metric `pck`");
    let text = String::from_utf8(room.read("results/baselines/tiny.json")).unwrap();
    room.write("results/baselines/tiny.json", text.replace("skiagraph.baseline/1", "skiagraph.baseline/2"));
    refused("gate run --baseline tiny --margin 2mm", "newer version");
    room.write("results/baselines/mine.json", "{}");
    refused("baseline save mine run", "mine.json");
    assert_eq!(room.read("results/baselines/mine.json"), b"{}", "somebody else's file stays");
}
