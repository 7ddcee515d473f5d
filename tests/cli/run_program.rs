//! `skiagraph run --exec`: programs as trackers of a scenario, with settings, beside built-in ones.

use std::fs;

use serde_json::{Value, json};

use crate::programs::write_still;
use crate::sandbox::Sandbox;

/// With the program `t.sh`, which never moves and is lost from the frame on that its argument names; without one, the
/// setting `until` of its environment. It appends its seed to `begun` and its settings to `told`. `t` starts it, and
/// `deaf.sh` hears of no setting.
fn with_program() -> Sandbox {
    let room = Sandbox::tiny();
    let until = "${1:-${SKIAGRAPH_SETTING_UNTIL:-99}}";
    let start = format!("echo $seed >>begun; [ -z \"$settings\" ] || echo \"$settings\" >>told; until={until}");
    write_still(&room, &start, "[ \"$frame\" -lt \"$until\" ] || { lost; continue; }");
    room.write("deaf.sh", room.text("t.sh").replace(until, "99"));
    room.executable("t", "#!/bin/sh\nexec sh t.sh \"$@\"\n");
    room
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

#[test]
fn run_equals_three_steps() {
    let room = with_program();
    room.says("run tiny.toml --exec 'sh t.sh' --out runs/at-once", &["report: runs/at-once/report.html"]);
    assert_eq!(room.text("begun"), "0\n1\n");
    room.succeed("render tiny.toml --key default --out set");
    room.succeed("track set --exec 'sh t.sh' --seeds 2 --out runs/by-steps");
    room.succeed("evaluate set runs/by-steps");
    let [one, other] = ["runs/at-once/run.json", "runs/by-steps/run.json"].map(|run| room.json(run));
    for key in ["metrics", "frozen", "set_hash", "runs", "scenario"] {
        assert_eq!(one[key], other[key], "{key}");
    }
    assert_eq!(room.read("runs/at-once/poses.npz"), room.read("runs/by-steps/poses.npz"));
    // what takes runs of built-in trackers takes this one
    room.succeed("compare runs/at-once runs/by-steps");
    room.succeed("report runs/at-once --figures once");
    // two equal seeds are one run, of which no baseline is made
    room.refused("baseline save still runs/at-once", "the 2 runs of `tiny` are identical");
    assert!(room.path("runs/at-once/answers.csv").is_file() && room.path("runs/at-once/made_by.json").is_file());
}

/// By its command, its environment and the message `hello`.
#[test]
fn settings_reach_a_program() {
    let room = with_program();
    for (program, setting, out) in [("sh t.sh {until}", "until=2", "a"), ("sh t.sh", "settings.until=2", "b")] {
        room.succeed(&format!("run tiny.toml --exec '{program}' {setting} seeds=1 --out {out}"));
        let run = room.json(&format!("{out}/run.json"));
        assert_eq!(run["program"]["options"]["settings"], json!({"until": 2}), "{run}");
        // of the four frames after the start, one is answered
        assert!((room.mean(out, "coverage") - 0.25).abs() < 1e-12, "{run}");
    }
    assert_eq!(room.text("told"), "{\"until\":2}\n{\"until\":2}\n");
    room.succeed("render tiny.toml --key default --out set");
    room.succeed("track set --exec 'sh t.sh {until}' until=2 --out c");
    // which adds the truth to the poses
    room.succeed("evaluate set c");
    assert_eq!(room.read("a/poses.npz"), room.read("c/poses.npz"));
}

#[test]
fn programs_run_beside_built_in_trackers() {
    let room = with_program();
    let programs = "--exec 'sh t.sh' --name whole --exec 'sh t.sh {until}' --name half until=2";
    let built_in = "--tracker frozen --tracker annealed_particle_filter";
    let answer = room.succeed(&format!("run tiny.toml {programs} {built_in} --out runs/all"));
    let methods = &room.json("runs/all/comparison.json")["methods"];
    let [whole, frozen] = ["whole", "frozen"].map(|name| number(&methods[name]["metrics"]["humaneva_mm"]["mean"]));
    assert!((whole - frozen).abs() < 1e-6, "it never moves");
    // the scenario's own settings of that tracker
    assert_eq!(methods["annealed_particle_filter"]["settings"]["annealed_particle_filter"]["particles"], 12);
    assert_eq!(room.json("runs/all/half/run.json")["program"]["name"], "half");
    room.succeed("compare runs/all");
    assert!(answer.stdout.contains("half") && room.path("runs/all/comparison.html").is_file(), "{}", answer.stdout);
}

/// A program's setting and a key of the scenario: four settings, two sets.
const GRID: &str = "--exec './t {until}' until=2,99 rig.ring.count=1,2";

#[test]
fn settings_of_programs_are_swept() {
    let room = with_program();
    let text = room.succeed(&format!("sweep tiny.toml {GRID} --seeds 2 -j 2 --out whole")).stdout;
    assert!(text.contains("rig.ring.count=1 until=2"), "{text}");
    // deterministic, so the seeds count as one run
    assert!(text.contains("the same estimates for every seed") && !text.contains("ignores"), "{text}");
    assert_eq!((room.text("whole/runs.csv").lines().count(), room.entries_of("whole/sets").len()), (9, 2));
    // by cells, in another order, from another directory, where the program's path does not exist
    room.succeed(&format!("sweep plan tiny.toml {GRID} --out cells"));
    room.succeed("sweep run cells --part 2/3");
    fs::create_dir(room.path("elsewhere")).unwrap();
    let mut elsewhere = room.program(["sweep", "run", "../cells"]);
    assert!(elsewhere.current_dir(room.path("elsewhere")).output().unwrap().status.success());
    for name in ["runs.csv", "runs.jsonl"] {
        assert_eq!(room.read(&format!("cells/{name}")), room.read(&format!("whole/{name}")), "{name}");
    }
    room.succeed("report whole");
    let page = room.text("whole/report.html");
    assert!(page.contains("the same estimates for every seed") && page.contains("--exec &#x27;.&#x2f;t {until}"));
    // another program is another sweep
    room.write("t", "#!/bin/sh\nexec sh t.sh 1\n");
    room.refused("sweep run whole", "changed since");
    // its results are listed and gathered without it
    fs::remove_file(room.path("t")).unwrap();
    assert!(room.succeed("sweep status whole").stdout.contains("8 of 8 cells have results"));
}

/// Also if it loses the body, which is then farther from the truth than any unit or origin explains.
#[test]
fn answers_in_millimetres_are_named() {
    let room = with_program();
    let scaled = r#"markers=$(printf '%s\n' "$markers" | awk '{ while (match($0, /-?[0-9][-0-9.e]*/)) {
        printf "%s%.9f", substr($0, 1, RSTART - 1), 1000 * substr($0, RSTART, RLENGTH)
        $0 = substr($0, RSTART + RLENGTH) } print }')
        echo '{"type":"ready""#;
    room.write("mm.sh", room.text("t.sh").replace("echo '{\"type\":\"ready\"", scaled));
    let words = "it is in millimetres. Correct the program";
    let long = "run tiny.toml motion.last_frame=39 --seeds 1 --exec 'sh mm.sh'";
    room.says(&format!("{long} --out run"), &[words, "compared with the start pose"]);
    let beside = room.succeed(&format!("{long} --exec 'sh t.sh' --name mm --name m --out both")).stderr;
    assert!(beside.contains(words) && beside.matches("misread").count() == 1, "{beside}");
    room.succeed("render tiny.toml motion.last_frame=39 --key default --out set");
    let tracked = room.succeed("track set --exec 'sh mm.sh' --out tracked").stderr;
    assert!(tracked.contains(words), "{tracked}");
    assert!(room.succeed("evaluate set tracked").stdout.contains(words));
}

/// And draws of the noise give intervals.
#[test]
fn ignored_settings_are_named() {
    let room = with_program();
    let noise = "observation.silhouette=corrupted start_mm=20";
    let sweep = "sweep tiny.toml --exec 'sh deaf.sh' settings.until=1,2 --seeds 3 --draws";
    let summary = room.json_of(&format!("{sweep} {noise} --out deaf --json"))["summary"].clone();
    let remarks = summary["remarks"].as_array().unwrap();
    assert!(remarks.len() == 1 && remarks[0].as_str().unwrap().contains("ignores its setting"), "{summary}");
    assert!(summary["settings"][0]["ci95"][0].is_number(), "{summary}");
    assert_eq!(room.entries_of("deaf/sets").len(), 3, "one set per draw");
}

/// One axis of both programs, with numbers; a built-in tracker beside them does not have it.
#[test]
fn programs_share_a_placeholder() {
    let room = with_program();
    let programs = "--exec 'sh t.sh {until}' --exec 'sh t.sh {until} x' --name a --name b";
    room.succeed(&format!("sweep tiny.toml {programs} --tracker frozen until=2,3 --seeds 1 --out both"));
    let cells = room.text("both/runs.jsonl");
    let cells: Vec<Value> = cells.lines().map(|cell| serde_json::from_str(cell).unwrap()).collect();
    let lost = |axes: Value| {
        let cell = cells.iter().find(|cell| cell["axes"] == axes).unwrap_or_else(|| panic!("{axes}: {cells:?}"));
        number(&cell["metrics"]["lost_frames"])
    };
    assert_eq!((cells.len(), lost(json!({ "method": "frozen" }))), (5, 0.0), "{cells:?}");
    for until in [2, 3] {
        let [a, b] = ["a", "b"].map(|method| lost(json!({ "until": until, "method": method })));
        assert_eq!(a, b, "the same value reached both");
    }
    assert_ne!(lost(json!({ "until": 2, "method": "a" })), lost(json!({ "until": 3, "method": "a" })));
    // one value, in a run
    room.succeed(&format!("run tiny.toml {programs} until=2 --seeds 1 --out run"));
}

#[test]
fn one_at_a_time_has_curves() {
    let room = with_program();
    room.write(
        "errors.toml",
        "schema = \"skiagraph.sweep/1\"\nname = \"errors\"\nbase = \"tiny.toml\"\nseeds = 3\ndraws = true\n\
         method = \"one_at_a_time\"\nset = [\"observation.silhouette=corrupted\"]\n[axes]\n\
         observation.corruption.start_mm = [0.0, 100.0, 400.0]\nobservation.corruption.boundary_px = [0.0, 2.0]\n",
    );
    let found = room.json_of("sweep errors.toml --exec 'sh t.sh' --name mine --tracker frozen --json");
    assert_eq!(found["by_axis"]["trackers"], json!(["frozen", "mine"]));
    let [boundary, start] = &found["by_axis"]["axes"].as_array().unwrap()[..] else { panic!("{found}") };
    let means = |axis: &Value, tracker: usize| -> Vec<f64> {
        axis["values"].as_array().unwrap().iter().map(|value| number(&value["means"][tracker]["mean"])).collect()
    };
    for axis in [boundary, start] {
        let (frozen, mine) = (means(axis, 0), means(axis, 1));
        assert!(mine.iter().zip(&frozen).all(|(a, b)| (a - b).abs() < 1e-6), "neither moves: {mine:?} {frozen:?}");
    }
    assert_eq!(means(start, 1)[0], means(boundary, 1)[0], "one clean level for all axes");
    let first = &start["values"][1]["means"][1];
    assert!(first["ci95"].is_array() && first["coverage"] == 1.0, "{first}");
    assert!(number(&start["doubles_at"][1]) > 0.0 && boundary["doubles_at"][1].is_null(), "{start}");
    room.succeed("report sweeps/errors");
    let page = room.text("sweeps/errors/report.html");
    assert!(page.contains("<svg") && page.contains("error doubles at") && page.contains("never moves"));
}

/// Runs of the same clip are not independent: each clip is one observation, the mean over its conditions.
#[test]
fn sweep_over_clips_counts_clips() {
    let room = with_program();
    let sweep = "schema = \"skiagraph.sweep/1\"\nname = \"small\"\nbase = \"tiny.toml\"\nseeds = 1\ndraws = true\n\
                 reports = true\nnamed = true\n[axes]\nclip = [{ name = \"walk\", set = [] },\
                 { name = \"run\", set = [\"motion.clip=embedded:run\"] },\
                 { name = \"jump\", set = [\"motion.clip=embedded:jump\"] }";
    let cameras = "cameras = [{ name = \"two\", set = [] }, { name = \"one\", set = [\"rig.ring.count=1\"] }]\n";
    room.write("whole.toml", format!("{sweep}]\n{cameras}"));
    let found = room.json_of("sweep whole.toml --exec 'sh t.sh' --name mine --tracker frozen --json");
    let all = &found["by_axis"]["all"];
    assert_eq!((&found["by_axis"]["unit"], &all[0]["units"]), (&json!("clips"), &json!(3)));
    assert!((number(&all[0]["mean"]) - number(&all[1]["mean"])).abs() < 1e-6 && all[1]["ci95"].is_array(), "{all}");
    // the mean over clips, by another road: the runs in their folders
    let runs = ["one-jump", "one-run", "one-walk", "two-jump", "two-run", "two-walk"];
    let runs = runs.map(|name| room.mean(&format!("sweeps/small/reports/mine/{name}"), "humaneva_mm"));
    assert!((number(&all[1]["mean"]) - runs.iter().sum::<f64>() / 6.0).abs() < 1e-6, "{runs:?} {all}");
    let compared = room.json_of("compare sweeps/small --json");
    assert_eq!(compared["base"]["seeds"].as_object().map_or(0, serde_json::Map::len), 3, "{compared}");
    room.refused("baseline save mine sweeps/small/reports/mine", "expected 5 or more");
    // a clip is missing: the others go on
    room.write("gap.toml", format!("{sweep}, {{ name = \"gone\", set = [\"motion.clip=gone.bvh\"] }}]\n"));
    let gap = room.ask("sweep gap.toml --exec 'sh t.sh' --out gap");
    let words = ["not judged: 1 setting", "1 cell cannot be run"];
    assert!(gap.code == 1 && words.iter().all(|words| gap.stdout.contains(words)), "{}{}", gap.stdout, gap.stderr);
    // a condition would win over the command line in silence
    let changed = "sweep whole.toml --tracker frozen rig.ring.count=3 --out r";
    room.refused(changed, "set by a value of the axis cameras");
}

/// A tracker that dies early has a small error of the few frames that it estimates.
#[test]
fn partial_estimates_are_never_best() {
    let room = with_program();
    let said = room.succeed("sweep tiny.toml --exec 'sh t.sh {until}' until=2,99 --seeds 1 --out s").stdout;
    let (ranked, left_out) = said.split_once("not judged: 1 setting").unwrap();
    assert!(ranked.contains("until=99") && !ranked.contains("until=2 "), "{said}");
    assert!(left_out.contains("until=2 ") && left_out.contains(" %"), "{said}");
    room.succeed("report s");
    let page = room.text("s/report.html");
    let best = page.split("<tr class=\"best\">").nth(1).unwrap().split("</tr>").next().unwrap();
    assert!(best.contains("<td>99</td>") && best.contains("100 %"), "{best}");
    // no whole run at all, and no answer at all
    room.write("mute.sh", "read -r line\necho \"$line\" > /dev/null\nsleep 600\n");
    let mute = "--exec 'sh mute.sh' --start-limit 1 --restarts 0";
    for (program, code) in [("--exec 'sh t.sh {until}' until=2,3", 3), (mute, 1)] {
        let none = room.ask(&format!("sweep tiny.toml {program} --seeds 1 --out none{code}"));
        assert!(none.code == code && none.stdout.contains("nothing is judged"), "{}{}", none.stdout, none.stderr);
    }
}
