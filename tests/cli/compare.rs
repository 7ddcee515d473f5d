//! `skiagraph compare`.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY};

/// A sandbox with two runs on one set, and one on another set of the same name.
fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("run tiny.toml --seeds 3 --out runs/main");
    room.succeed("run tiny.toml --seeds 3 particles=4 --out runs/mine");
    room.succeed("run tiny.toml --seeds 3 rig.ring.count=1 --out runs/one");
    room
}

#[test]
fn differences_are_the_same_in_every_format() {
    let room = room();
    let json: Value = serde_json::from_str(&room.succeed("compare runs/main runs/mine --json").stdout).unwrap();
    assert_eq!((&json["schema"], &json["others"][0]["paired"]), (&"skiagraph.compare/1".into(), &true.into()));
    let run = |name: &str| -> Value { serde_json::from_slice(&room.read(&format!("runs/{name}/run.json"))).unwrap() };
    let mean = |name: &str| run(name)["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap();
    let error = &json["others"][0]["metrics"][0];
    assert_eq!(error["metric"], "humaneva_mm");
    assert!((error["difference"].as_f64().unwrap() - (mean("mine") - mean("main"))).abs() < 1e-9, "{error}");
    assert_eq!(error["also"][0], "mpjpe_mm");
    let text = room.succeed("compare runs/main runs/mine --all --html page.html");
    for part in ["base: main", "HumanEva 3-D error, mm", "left knee", "runs that lost the body: 0 of 3"] {
        assert!(text.stdout.contains(part), "{part}: {}", text.stdout);
    }
    assert!(String::from_utf8(room.read("page.html")).unwrap().contains("HumanEva 3-D error, mm"));
    let markdown = room.succeed("compare runs/main runs/mine runs/main/run.json --markdown").stdout;
    assert!(markdown.starts_with("### ") && markdown.contains("<details>"), "{markdown}");
    for (text, words) in [(&text.stdout, "  mine is "), (&markdown, "**mine is ")] {
        let found = text.contains(words) || text.contains("No difference between mine and ");
        assert!(found && text.contains("A marker is more than 150 mm off in "), "{text}");
    }
    assert!(text.stdout.contains("the actor's own values are equal on both sides: truth_"), "{}", text.stdout);
    assert!(!text.stdout.lines().any(|line| line.trim_start().starts_with("Foot float of the actor")));
    let folder = room.succeed("compare runs/main runs/main").stdout;
    assert!(folder.contains("equal"), "the same run: {folder}");
}

#[test]
fn incomparable_runs_are_refused_with_the_difference() {
    let room = room();
    let refused = |arguments: &str, parts: &[&str]| {
        let answer = room.skiagraph(arguments.split_whitespace());
        assert_eq!(answer.code, 2, "{arguments}: {}", answer.stdout);
        for part in parts {
            assert!(answer.stderr.contains(part), "{arguments}: {part}: {}", answer.stderr);
        }
    };
    refused("compare runs/main runs/one", &["different sets", "hashes", "--calibrate true or false", "--across-sets"]);
    room.succeed("compare runs/main runs/one --across-sets");
    refused("compare runs/main", &["expected two runs or more"]);
    refused("compare runs/main nowhere", &["nowhere", "no such file or folder"]);
    room.succeed("render tiny.toml --out set");
    room.succeed("track set --tracker frozen --out tracked");
    refused("compare runs/main tracked", &["not measured", "skiagraph evaluate"]);
    let record = String::from_utf8(room.read("runs/main/run.json")).unwrap();
    for (name, text, part) in [
        ("newer", record.replace("skiagraph.run/1", "skiagraph.run/9"), "skiagraph.run/9"),
        ("nan", record.replacen("\"mean\": ", "\"mean\": NaN, \"mean_\": ", 1), "line"),
        ("short", record.replacen("\"frames\": 5", "\"frames\": \"5\"", 1), "frames"),
    ] {
        std::fs::create_dir(room.path(name)).unwrap();
        room.write(&format!("{name}/run.json"), text);
        refused(&format!("compare runs/main {name}"), &[name, part]);
    }
    room.write("thesis.html", "years of work");
    refused("compare runs/main runs/mine --html thesis.html", &["thesis.html", "--force"]);
    assert_eq!(room.read("thesis.html"), b"years of work");
}

/// Seeds left out of the intervals are named.
#[test]
fn compare_and_gate_name_unpaired_seeds_and_count_pairs() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("run tiny.toml --seeds 5 --out main");
    room.succeed("run tiny.toml --seeds 8 particles=4 --out mine");
    let out = "seeds 5 to 7 of `tiny` are in `mine` only and have no pair";
    let text = room.succeed("compare main mine --html page.html").stdout;
    assert!(text.contains(&format!("  left out: {out}\n")), "{text}");
    assert!(text.contains("intervals are over 5 pairs of seeds of one clip (tiny, "), "{text}");
    let markdown = room.succeed("compare main mine --markdown").stdout;
    assert!(
        markdown.contains("- left out: seeds 5 to 7 of ") && markdown.contains("over 5 pairs of seeds"),
        "{markdown}"
    );
    let json: Value = serde_json::from_str(&room.succeed("compare main mine --json").stdout).unwrap();
    assert_eq!(json["others"][0]["skipped"], serde_json::json!([out]));
    let page = String::from_utf8(room.read("page.html")).unwrap();
    assert!(page.contains("seeds 5 to 7 of ") && page.contains("over 5 pairs of seeds"), "the page says it too");
    room.succeed("baseline save main main");
    let gate = room.skiagraph("gate mine --baseline main --margin 999mm".split(' ')).stdout;
    let out = "note: left out: seeds 5 to 7 of `tiny` are in `the run` only and have no pair";
    assert!(gate.contains(out) && gate.contains("over 5 pairs of seeds"), "{gate}");
}

#[test]
fn a_comparison_of_a_run_with_itself_has_a_note() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("run tiny.toml --out run");
    room.succeed("run tiny.toml particles=4 --out other");
    let said = |arguments: &str| room.succeed(&format!("compare {arguments}")).stderr;
    let remark = "note: run/../run is the same run on both sides";
    assert!(said("run run/../run").contains(remark), "{}", said("run run/../run"));
    assert!(said("run --vs run/../run").contains(remark));
    assert!(!said("run other").contains("same run"));
}

#[test]
fn several_runs_of_one_set_are_on_one_page_side_by_side() {
    let room = room();
    room.succeed("report runs/main runs/mine --out both.html");
    let page = String::from_utf8(room.read("both.html")).unwrap();
    // of the four frames, each run's worst: one or two frames, each in two cameras
    let moments = page.matches(": among the worst of ").count();
    assert!((1..=2).contains(&moments), "{moments}");
    let (_, chosen) = page.split_once(": among the worst of ").unwrap();
    assert!(chosen.contains("main (") && chosen.contains("mine ("), "each run with its error");
    assert_eq!(page.matches("data:image/png;base64,").count(), 2 * moments);
    for run in 0..2 {
        assert_eq!(page.matches(&format!("<path class=\"run run{run}\" d=\"M")).count(), 2 * moments);
    }
    let record =
        |name: &str| -> Value { serde_json::from_slice(&room.read(&format!("runs/{name}/run.json"))).unwrap() };
    for name in ["main", "mine"] {
        let joints = record(name)["per_joint"].clone();
        let ankle = joints.as_array().unwrap().iter().find(|joint| joint["joint"] == "left_ankle").unwrap().clone();
        let (_, row) = page.split_once("<td>left ankle</td>").unwrap();
        let shown = format!(">{:.1}<", ankle["mean_mm"].as_f64().unwrap());
        assert!(row.split("</tr>").next().unwrap().contains(&shown), "{name}: {shown}");
    }
    // estimates of another program, with the set, whose folder they do not know
    room.succeed("render tiny.toml --key default --out set");
    let poses = room.path("runs/mine/poses.npz");
    std::fs::copy(poses, room.path("theirs.npz")).unwrap();
    room.succeed("evaluate set theirs.npz --out runs/theirs");
    room.succeed("report runs/theirs runs/main --set set --out three.html");
    let drawn = room.succeed("report runs/main runs/mine --figures figures").stdout;
    assert!(drawn.contains("figures: 2 figures"), "{drawn}");
    let svg = String::from_utf8(room.read("figures/error.svg")).unwrap();
    assert!(svg.starts_with("<svg ") && svg.contains("main") && svg.contains("mine"), "{svg}");
    let refused = |arguments: &str, words: &str| {
        let answer = room.skiagraph(arguments.split(' '));
        assert!(answer.code == 2 && answer.stderr.contains(words), "{arguments}: {}", answer.stderr);
        assert_eq!(answer.stderr.lines().count(), 1, "{}", answer.stderr);
    };
    refused("report runs/main runs/one --figures no", "runs/one is a run of another set than runs/main");
    refused("report runs/main runs/one --out no.html", "runs/one is a run of another set than runs/main");
    refused("report runs/theirs runs/main --out no.html", "give its set with --set SET");
    room.succeed("render tiny.toml rig.ring.radius_m=9 --key default --out wide");
    refused(
        "report runs/main runs/mine --set wide --out no.html",
        "runs/main does not fit wide: the run's set has hash",
    );
    refused("report runs/main runs/mine --png no.png", "--png: expected one directory, found 2");
    refused(
        "report runs/main runs/mine runs/mine runs/mine runs/mine runs/mine runs/mine",
        "expected 2 to 6 runs, found 7",
    );
    refused("report runs/main runs/mine --out no.md", "no.md: expected a file that ends in .html");
    refused(
        "report runs runs/main --out no.html",
        "expected runs, found a folder of runs, runs: name its runs (runs/main, runs/mine, runs/one",
    );
    refused("report nowhere runs/main --out no.html", "no such file or folder");
    std::fs::create_dir(room.path("l")).unwrap();
    room.write("l/plan.json", "{}");
    refused("report l runs/main --out no.html", "only runs can be drawn over each other, and l is a sweep");
    assert!(!room.path("no.html").exists() && !room.path("runs.html").exists());
}
