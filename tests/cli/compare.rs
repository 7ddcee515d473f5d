//! `skiagraph compare`.

use serde_json::Value;

use crate::sandbox::{Sandbox, assert_contains};

/// A sandbox with two runs on one set, and one on another set of the same name.
fn room() -> Sandbox {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml --seeds 3 --out runs/main");
    room.succeed("run tiny.toml --seeds 3 particles=4 --out runs/mine");
    room.succeed("run tiny.toml --seeds 3 rig.ring.count=1 --out runs/one");
    room
}

#[test]
fn every_format_has_the_same_differences() {
    let room = room();
    let json: Value = room.json_of("compare runs/main runs/mine --json");
    assert_eq!((&json["schema"], &json["others"][0]["paired"]), (&"skiagraph.compare/1".into(), &true.into()));
    let error = &json["others"][0]["metrics"][0];
    assert_eq!(error["metric"], "humaneva_mm");
    assert!(
        (error["difference"].as_f64().unwrap()
            - (room.mean("runs/mine", "humaneva_mm") - room.mean("runs/main", "humaneva_mm")))
        .abs()
            < 1e-9,
        "{error}"
    );
    assert_eq!(error["also"][0], "mpjpe_mm");
    let text = room.succeed("compare runs/main runs/mine --all --html page.html");
    for part in ["base: main", "HumanEva 3-D error, mm", "left knee", "runs that lost the body: 0 of 3"] {
        assert!(text.stdout.contains(part), "{part}: {}", text.stdout);
    }
    assert!(room.text("page.html").contains("HumanEva 3-D error, mm"));
    let markdown = room.succeed("compare runs/main runs/mine runs/main/run.json --markdown").stdout;
    assert!(markdown.starts_with("### ") && markdown.contains("<details>"), "{markdown}");
    for (text, words) in
        [(&text.stdout, "  HumanEva 3-D error, mm: mine "), (&markdown, "**HumanEva 3-D error, mm: mine ")]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert!(text.stdout.contains("the actor's own values are equal on both sides: truth_"), "{}", text.stdout);
    assert!(!text.stdout.lines().any(|line| line.trim_start().starts_with("Foot float of the actor")));
    room.says("compare runs/main runs/main", &["equal"]);
}

/// Seeds left out of the intervals are named.
#[test]
fn unpaired_seeds_are_named() {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml --seeds 5 --out main");
    room.succeed("run tiny.toml --seeds 8 particles=4 --out mine");
    let out = "seeds 5 to 7 of `tiny` are in `mine` only and have no pair";
    let text = room.succeed("compare main mine --html page.html").stdout;
    assert!(text.contains(&format!("  left out: {out}\n")), "{text}");
    assert!(text.contains("ntervals over 5 pairs of seeds; clips: 1 (tiny, "), "{text}");
    let markdown = room.succeed("compare main mine --markdown").stdout;
    assert_contains(&markdown, &["- left out: seeds 5 to 7 of ", "over 5 pairs of seeds"]);
    let json: Value = room.json_of("compare main mine --json");
    assert_eq!(json["others"][0]["skipped"], serde_json::json!([out]));
    let page = room.text("page.html");
    assert!(page.contains("seeds 5 to 7 of ") && page.contains("over 5 pairs of seeds"), "the page says it too");
    room.succeed("baseline save main main");
    let gate = room.ask("gate mine --baseline main --margin 999mm").stdout;
    let out = "note: left out: seeds 5 to 7 of `tiny` are in `the run` only and have no pair";
    assert!(gate.contains(out) && gate.contains("over 5 pairs of seeds"), "{gate}");
}

#[test]
fn errors_over_time_need_one_set() {
    let room = room();
    let page = |arguments: &str| {
        room.succeed(&format!("compare {arguments} --html page.html"));
        room.text("page.html")
    };
    let both = page("runs/main runs/mine");
    assert!(both.contains("<h2>All sides") && both.contains("id=\"error\""));
    assert!(!page("runs/main runs/one --across-sets").contains("id=\"error\""));
    room.succeed("report runs/main runs/mine --figures figures");
    assert!(room.path("figures/methods.svg").is_file() && room.path("figures/error.svg").is_file());
}
