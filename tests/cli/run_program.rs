//! `skiagraph run --exec`: programs as trackers of a scenario, with settings, beside built-in ones, resumed.

use std::fs;
use std::time::Duration;

use serde_json::{Value, json};

use crate::sandbox::{Sandbox, TINY};

/// A program that never moves and is lost from the frame on that its argument names; without one, the setting `until`
/// of its environment. It appends its seed to `begun`, and waits for `pause` seconds before each answer.
fn program(pause: &str) -> String {
    format!(
        r#"until=${{1:-${{SKIAGRAPH_SETTING_UNTIL:-99}}}}
read -r hello
seed=$(printf %s "$hello" | sed 's/.*"seed":\([0-9]*\).*/\1/')
echo $seed >> begun
printf '%s\n' "$hello" | sed -n 's/.*"settings":\({{[^}}]*}}\).*/\1/p' >> told
m=$(printf %s "$hello" | sed 's/.*"start":.*"markers":\({{[^}}]*}}\).*/\1/')
echo '{{"type":"ready","name":"still","version":"1"}}'
while read -r told; do
  case $told in *'"type":"end"'*) exit;; esac
  f=${{told#*'"frame":'}}; f=${{f%%,*}}; sleep {pause}
  if [ "$f" -ge "$until" ]; then echo "{{\"type\":\"lost\",\"frame\":$f}}"
  else echo "{{\"type\":\"pose\",\"frame\":$f,\"markers\":$m}}"; fi
done
"#
    )
}

/// A room with the scenario `tiny.toml` and the program `t.sh`.
pub(crate) fn room_with_program(pause: &str) -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.write("t.sh", program(pause));
    room
}

pub(crate) fn json_of(room: &Sandbox, path: &str) -> Value {
    serde_json::from_slice(&room.read(path)).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

#[test]
fn one_command_gives_the_numbers_of_render_track_and_evaluate() {
    let room = room_with_program("0");
    let answer = room.skiagraph(["run", "tiny.toml", "--exec", "sh t.sh", "--out", "runs/at-once"]);
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    assert!(answer.stdout.contains("report: runs/at-once/report.html"), "{}", answer.stdout);
    assert_eq!(fs::read_to_string(room.path("begun")).unwrap(), "0\n1\n");
    room.succeed("render tiny.toml --key default --out set");
    let tracked = room.skiagraph(["track", "set", "--exec", "sh t.sh", "--seeds", "2", "--out", "runs/by-steps"]);
    assert_eq!(tracked.code, 0, "{}", tracked.stderr);
    room.succeed("evaluate set runs/by-steps");
    let [one, other] = ["at-once", "by-steps"].map(|run| json_of(&room, &format!("runs/{run}/run.json")));
    for key in ["metrics", "frozen", "set_hash", "runs", "scenario"] {
        assert_eq!(one[key], other[key], "{key}");
    }
    assert_eq!(room.read("runs/at-once/poses.npz"), room.read("runs/by-steps/poses.npz"));
    // what takes runs of built-in trackers takes this one
    room.succeed("compare runs/at-once runs/by-steps");
    room.succeed("report runs/at-once --png once.png");
    // two equal seeds are one run, of which no baseline is made
    let refused = room.skiagraph(["baseline", "save", "still", "runs/at-once"]);
    assert!(refused.code == 2 && refused.stderr.contains("the 2 runs of `tiny` are identical"), "{}", refused.stderr);
    assert!(room.path("runs/at-once/answers.csv").is_file() && room.path("runs/at-once/scenario.toml").is_file());
}

#[test]
fn settings_reach_a_program_by_its_command_its_environment_and_hello() {
    let room = room_with_program("0");
    let coverage = |command: &str, setting: &str, out: &str| {
        let answer = room.skiagraph(["run", "tiny.toml", "--exec", command, setting, "seeds=1", "--out", out]);
        assert_eq!(answer.code, 0, "{}", answer.stderr);
        let run = json_of(&room, &format!("{out}/run.json"));
        assert_eq!(run["program"]["options"]["settings"], json!({"until": 2}), "{run}");
        number(&run["metrics"]["coverage"]["mean"])
    };
    // of the four frames after the start, one is answered
    let by_argument = coverage("sh t.sh {until}", "until=2", "a");
    assert!((by_argument - 0.25).abs() < 1e-12, "{by_argument}");
    assert_eq!(coverage("sh t.sh", "settings.until=2", "b"), by_argument);
    assert_eq!(fs::read_to_string(room.path("told")).unwrap(), "{\"until\":2}\n{\"until\":2}\n");
    room.succeed("render tiny.toml --key default --out set");
    let tracked = room.skiagraph(["track", "set", "--exec", "sh t.sh {until}", "until=2", "--out", "c"]);
    assert_eq!(tracked.code, 0, "{}", tracked.stderr);
    room.succeed("evaluate set c");
    assert_eq!(room.read("a/poses.npz"), room.read("c/poses.npz"));
}

#[test]
fn programs_and_built_in_trackers_are_compared_side_by_side() {
    let room = room_with_program("0");
    let both = ["--exec", "sh t.sh", "--name", "whole", "--exec", "sh t.sh {until}", "--name", "half"];
    let more = ["until=2", "--tracker", "frozen", "--tracker", "annealed_particle_filter", "--out", "runs/all"];
    let answer = room.skiagraph([&["run", "tiny.toml"][..], &both, &more].concat());
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    let methods = &json_of(&room, "runs/all/comparison.json")["methods"];
    let error = |name: &str| number(&methods[name]["metrics"]["humaneva_mm"]["mean"]);
    assert!((error("whole") - error("frozen")).abs() < 1e-6, "it never moves");
    // the scenario's own settings of that tracker
    assert_eq!(methods["annealed_particle_filter"]["settings"]["annealed_particle_filter"]["particles"], 12);
    assert_eq!(json_of(&room, "runs/all/half/run.json")["program"]["name"], "half");
    room.succeed("compare runs/all");
    assert!(answer.stdout.contains("half") && room.path("runs/all/comparison.html").is_file(), "{}", answer.stdout);
}

#[test]
fn a_finished_seed_is_not_tracked_again() {
    let room = room_with_program("0.05");
    let run =
        ["run", "tiny.toml", "--exec", "sh t.sh", "--name", "slow", "--tracker", "frozen", "seeds=6", "-q", "--out"];
    let whole = room.skiagraph(run.iter().chain(&["whole"]));
    assert_eq!(whole.code, 0, "{}", whole.stderr);
    fs::remove_file(room.path("begun")).unwrap();
    let killed = "run tiny.toml --exec ./t --name slow --tracker frozen seeds=6 -q --out killed";
    room.write("t", "#!/bin/sh\nexec sh t.sh\n");
    std::process::Command::new("chmod").args(["+x", "t"]).current_dir(room.path(".")).status().unwrap();
    let mut kills = 0;
    let seeds_begun = || fs::read_to_string(room.path("begun")).map_or(0, |begun| begun.lines().count());
    for moment in [0, 60, 120] {
        let before = seeds_begun();
        let has_finished_a_seed = || seeds_begun() > before + 1;
        kills += usize::from(room.run_and_kill_once(killed, has_finished_a_seed, Duration::from_millis(moment)));
    }
    assert!(kills >= 2, "{kills}");
    room.succeed(killed);
    assert!(!room.path("killed.partial").exists());
    assert_eq!(room.read("killed/slow/poses.npz"), room.read("whole/slow/poses.npz"));
    let begun = fs::read_to_string(room.path("begun")).unwrap();
    // a seed is begun again only if it was killed on its way
    assert!((6..=6 + kills).contains(&begun.lines().count()), "{kills} kills: {begun}");
}

#[test]
fn what_does_not_fit_is_refused_before_anything_runs() {
    let room = room_with_program("0");
    let program = "schema = \"skiagraph.scenario/1\"\nname = \"evil\"\nmotion.clip = \"embedded:walk\"\n\
                   [tracker.program]\ncommand = \"touch begun\"\n";
    room.write("evil.toml", program);
    room.write("method.toml", program.replace("[tracker.program]", "[methods.a.program]"));
    let refused = |arguments: &[&str], words: &str| {
        let answer = room.skiagraph(arguments);
        assert_eq!(answer.code, 2, "{arguments:?}: {}", answer.stderr);
        assert!(answer.stderr.contains(words), "{arguments:?}: no {words:?} in {}", answer.stderr);
    };
    for file in ["evil.toml", "method.toml"] {
        refused(&["run", file], "a file cannot start programs");
        refused(&["check", file], "a file cannot start programs");
        refused(&["render", file, "--out", "set"], "a file cannot start programs");
    }
    let run =
        |more: &[&str]| ["run", "tiny.toml"].iter().chain(more).map(|word| (*word).to_owned()).collect::<Vec<_>>();
    for (more, words) in [
        (&["--exec", "sh t.sh {until}"][..], "the placeholder {until} has no value: give until=VALUE"),
        (&["--exec", "sh t.sh {until}", "util=2"], "did you mean `until`?"),
        (&["--exec", "sh t.sh {until}", "until=[1]"], "expected a number, true, false, or a text"),
        (&["--exec", "sh t.sh", "--exec", "sh t.sh"], "expected one name for each --exec, 2 in their order, found 0"),
        (&["--exec", "sh t.sh", "--exec", "sh t.sh", "--name", "a", "--name", "a"], "found a twice"),
        (&["--exec", "sh t.sh", "--tracker", "frosen"], "did you mean `frozen`?"),
        (&["--exec", "sh no-such-file.sh"], "ended before it was ready"),
    ] {
        let arguments = run(more);
        refused(&arguments.iter().map(String::as_str).collect::<Vec<_>>(), words);
    }
    assert!(!room.path("begun").exists() && !room.path("runs/tiny").exists());
}

/// The sweep of a program's setting and of a key of the scenario, in this directory: eight cells.
fn sweep(room: &Sandbox, out: &str) -> String {
    let exec = ["--exec", "./t {until}", "until=2,3", "rig.ring.count=1,2", "--seeds", "2", "-j", "2"];
    room.write("t", "#!/bin/sh\nexec sh t.sh \"$@\"\n");
    std::process::Command::new("chmod").args(["+x", "t"]).current_dir(room.path(".")).status().unwrap();
    let answer = room.skiagraph([&["sweep", "tiny.toml", "--out", out][..], &exec].concat());
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    answer.stdout
}

#[test]
fn settings_of_a_program_are_swept_with_keys_of_the_scenario() {
    let room = room_with_program("0");
    let text = sweep(&room, "whole");
    assert!(text.contains("rig.ring.count=1 until=2"), "{text}");
    // deterministic, so the seeds count as one run
    assert!(text.contains("the same estimates for every seed") && !text.contains("ignores"), "{text}");
    let table = String::from_utf8(room.read("whole/runs.csv")).unwrap();
    assert_eq!((table.lines().count(), fs::read_dir(room.path("whole/sets")).unwrap().count()), (9, 2));
    // by cells, in another order, from another directory, where the program's path does not exist
    let planned =
        ["sweep", "plan", "tiny.toml", "--exec", "./t {until}", "until=2,3", "rig.ring.count=1,2", "--out", "cells"];
    assert_eq!(room.skiagraph(planned).code, 0);
    for index in [7, 2, 0] {
        room.succeed(&format!("sweep cell cells --index {index}"));
    }
    fs::create_dir(room.path("elsewhere")).unwrap();
    let elsewhere = assert_cmd::cargo::cargo_bin_cmd!("skiagraph")
        .args(["sweep", "run", "../cells"])
        .current_dir(room.path("elsewhere"))
        .output()
        .unwrap();
    assert!(elsewhere.status.success(), "{}", String::from_utf8_lossy(&elsewhere.stderr));
    for name in ["runs.csv", "runs.jsonl"] {
        assert_eq!(room.read(&format!("cells/{name}")), room.read(&format!("whole/{name}")), "{name}");
    }
    room.succeed("report whole");
    let page = String::from_utf8(room.read("whole/report.html")).unwrap();
    assert!(
        page.contains("the same estimates for every seed") && page.contains("--exec &#x27;.&#x2f;t {until}"),
        "{page}"
    );
    // another program is another sweep
    room.write("t", "#!/bin/sh\nexec sh t.sh 1\n");
    let changed = room.skiagraph(["sweep", "run", "whole"]);
    assert!(changed.code == 2 && changed.stderr.contains("changed since"), "{}", changed.stderr);
    // its results are listed and gathered without it
    fs::remove_file(room.path("t")).unwrap();
    assert!(room.succeed("sweep status whole").stdout.contains("8 of 8 cells have results"));
    room.succeed("sweep gather whole");
}

#[test]
fn a_setting_given_twice_and_once_as_an_axis_is_refused() {
    let room = room_with_program("0");
    let one = ["sweep", "tiny.toml", "--exec", "sh t.sh {until}", "--out", "a"];
    let two = ["--exec", "sh t.sh {until}", "--name", "b", "--name", "c"];
    for (more, words) in [
        (
            &["until=1,2", "settings.until=3"][..],
            "`until` and `settings.until` both set tracker.program.settings.until",
        ),
        (&["until=3", "until=1,2"], "`until` and `until` both set"),
        (
            &[&two[..], &["until=1,2", "methods.c.program.settings.until=3"]].concat(),
            "both set methods.c.program.settings",
        ),
        (
            &["until=1", "rig.ring.count=1,2", "ring.count=3"],
            "`rig.ring.count` and `ring.count` both set rig.ring.count",
        ),
        (&["rig.ring.count=1,2", "ring.count=2,1"], "`rig.ring.count` and `ring.count` both set rig.ring.count"),
        (&["until=1,2", "settings.until=3,4"], "`until` and `settings.until` both set tracker.program.settings.until"),
        (&["until=1", "until=3"], "`until` and `until` both set tracker.program.settings.until, so one"),
    ] {
        let answer = room.skiagraph([&one[..], more].concat());
        assert!(answer.code == 2 && answer.stderr.contains(words), "{more:?}: {}", answer.stderr);
        assert_eq!(answer.stderr.lines().count(), 1, "{}", answer.stderr);
    }
    let one = ["run", "tiny.toml", "--exec", "sh t.sh {until}", "--out", "a"];
    for (more, words) in [
        (&["until=1", "until=3"][..], "`until=1` and `until=3` both set tracker.program.settings.until"),
        (&["until=1", "rig.ring.count=1", "ring.count=2"], "`rig.ring.count=1` and `ring.count=2` both set"),
        (&[&two[..], &["until=1", "settings.until=3"]].concat(), "both set methods."),
        (&["until=1,2"], "expected one value, found 2; several are for skiagraph sweep"),
        (&["until=1", "smoothing=0.5"], "a setting of the program is given as settings.smoothing=0.5"),
    ] {
        let answer = room.skiagraph([&one[..], more].concat());
        assert!(answer.code == 2 && answer.stderr.contains(words), "{more:?}: {}", answer.stderr);
    }
    let checked = room.skiagraph(["check", "tiny.toml", "rig.ring.count=1", "ring.count=2"]);
    assert!(checked.code == 2 && checked.stderr.contains("both set rig.ring.count"), "{}", checked.stderr);
    assert!(!room.path("a").exists() && !room.path("begun").exists());
}

/// A program that loses the body is farther from the truth than any unit or origin explains.
#[test]
fn a_program_that_answers_in_millimetres_is_told_so_although_it_does_not_follow_the_body() {
    let room = room_with_program("0");
    let scaled = "m=$(printf '%s\\n' \"$m\" | awk '{ while (match($0, /-?[0-9][-0-9.e]*/)) { printf \"%s%.9f\", \
                  substr($0, 1, RSTART - 1), 1000 * substr($0, RSTART, RLENGTH); $0 = substr($0, RSTART + RLENGTH) } print }')\n\
                  echo '{\"type\":\"ready\"";
    room.write("mm.sh", program("0").replace("echo '{\"type\":\"ready\"", scaled));
    let words = "it answers in units of 0.001 m, expected metres. Correct the program";
    let long = ["run", "tiny.toml", "motion.last_frame=39", "--seeds", "1", "--exec", "sh mm.sh"];
    let alone = room.skiagraph([&long[..], &["--out", "run"]].concat());
    assert!(alone.code == 0 && alone.stdout.contains(words), "{}{}", alone.stdout, alone.stderr);
    assert!(alone.stdout.contains("compared with the start pose"), "{}", alone.stdout);
    let beside = ["--exec", "sh t.sh", "--name", "mm", "--name", "m", "--out", "both"];
    let beside = room.skiagraph([&long[..], &beside].concat());
    assert!(beside.stderr.contains(words) && beside.stderr.matches("misread").count() == 1, "{}", beside.stderr);
    // in steps
    room.succeed("render tiny.toml motion.last_frame=39 --key default --out set");
    let tracked = room.skiagraph(["track", "set", "--exec", "sh mm.sh", "--out", "tracked"]);
    assert!(tracked.stderr.contains(words), "{}", tracked.stderr);
    assert!(room.succeed("evaluate set tracked").stdout.contains(words));
}

#[test]
fn a_program_that_ignores_its_setting_is_reported_and_draws_give_intervals() {
    let room = room_with_program("0");
    room.write("deaf.sh", program("0").replace("${1:-${SKIAGRAPH_SETTING_UNTIL:-99}}", "99"));
    let noise = ["observation.silhouette=corrupted", "start_mm=20"];
    let arguments = ["sweep", "tiny.toml", "--exec", "sh deaf.sh", "settings.until=1,2", "--seeds", "3", "--draws"];
    let answer = room.skiagraph([&arguments[..], &noise, &["--out", "deaf", "--json"]].concat());
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    let summary = serde_json::from_str::<Value>(&answer.stdout).unwrap()["summary"].clone();
    let remarks = summary["remarks"].as_array().unwrap();
    assert!(remarks.len() == 1 && remarks[0].as_str().unwrap().contains("ignores its setting"), "{summary}");
    assert!(summary["settings"][0]["ci95"][0].is_number(), "{summary}");
    assert_eq!(fs::read_dir(room.path("deaf/sets")).unwrap().count(), 3, "one set per draw");
}

#[test]
fn a_killed_sweep_of_a_program_gathers_the_same_bytes() {
    let room = room_with_program("0.01");
    sweep(&room, "whole");
    room.write("plan.sh", "");
    let planned =
        ["sweep", "plan", "tiny.toml", "--exec", "./t {until}", "until=2,3", "rig.ring.count=1,2", "--out", "killed"];
    assert_eq!(room.skiagraph(planned).code, 0);
    for attempt in 0..20 {
        room.run_and_kill("sweep run killed -j 2", Duration::from_millis(20 + 40 * attempt));
    }
    room.succeed("sweep run killed -j 2");
    for name in ["runs.csv", "runs.jsonl"] {
        assert_eq!(room.read(&format!("killed/{name}")), room.read(&format!("whole/{name}")), "{name}");
    }
}

#[test]
fn sweeps_start_only_programs_of_the_command_line() {
    let room = room_with_program("0");
    let head = "schema = \"skiagraph.sweep/1\"\nname = \"a\"\nbase = \"tiny.toml\"\n";
    for more in [
        "set = [\"tracker={ program = { command = \\\"touch begun\\\" } }\"]\n",
        "[axes]\ntracker = [{ program = { command = \"touch begun\" } }, { frozen = {} }]\n",
        "[axes]\nt = [{ name = \"a\", set = [\"tracker.program.command='touch begun'\"] }]\n",
    ] {
        room.write("a.toml", format!("{head}{more}"));
        let answer = room.skiagraph(["sweep", "a.toml"]);
        assert!(answer.code == 2 && answer.stderr.contains("a file cannot start programs"), "{more}{}", answer.stderr);
    }
    let unset = room.skiagraph(["sweep", "tiny.toml", "--exec", "sh t.sh {until} {other}", "until=1,2"]);
    assert!(unset.code == 2 && unset.stderr.contains("the placeholder {other} has no value"), "{}", unset.stderr);
    assert!(!room.path("begun").exists() && !room.path("sweeps").exists());
    // methods: a setting belongs to one program, and the built-in tracker has one setting
    let both = ["--exec", "sh t.sh {until}", "--name", "mine", "--tracker", "frozen", "until=1,2", "--out", "both"];
    let answer = room.skiagraph([&["sweep", "tiny.toml"][..], &both].concat());
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    let table = String::from_utf8(room.read("both/runs.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + 2 * 3, "{table}");
}

#[test]
fn programs_with_the_same_placeholder_get_the_same_value() {
    let room = room_with_program("0");
    let programs = ["--exec", "sh t.sh {until}", "--exec", "sh t.sh {until} x", "--name", "a", "--name", "b"];
    let values = ["--tracker", "frozen", "until=1,2", "--seeds", "1"];
    let answer = room.skiagraph([&["sweep", "tiny.toml"][..], &programs, &values, &["--out", "both"]].concat());
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    // one axis of both programs, with numbers; the built-in tracker does not have it
    let cells = String::from_utf8(room.read("both/cells.jsonl")).unwrap();
    let axes: Vec<Value> =
        cells.lines().map(|cell| serde_json::from_str::<Value>(cell).unwrap()["axes"].clone()).collect();
    assert_eq!(axes.len(), 5, "{axes:?}");
    for (until, method) in [(1, "a"), (2, "a"), (1, "b"), (2, "b")] {
        assert!(axes.contains(&json!({ "until": until, "method": method })), "{axes:?}");
    }
    assert!(axes.contains(&json!({ "method": "frozen" })), "{axes:?}");
    let table = String::from_utf8(room.read("both/runs.csv")).unwrap();
    let lost_frames = |until: &str, method: &str| {
        let mut rows = csv::Reader::from_reader(table.as_bytes());
        let at = |name: &str| table.lines().next().unwrap().split(',').position(|title| title == name).unwrap();
        let [until_at, method_at, lost_at] = ["until", "method", "lost_frames"].map(at);
        let is_it = |row: &csv::StringRecord| row[until_at] == *until && row[method_at] == *method;
        rows.records().map(Result::unwrap).find(is_it).unwrap()[lost_at].to_owned()
    };
    for until in ["1", "2"] {
        assert_eq!(lost_frames(until, "a"), lost_frames(until, "b"), "the same value reached both");
    }
    assert_ne!(lost_frames("1", "a"), lost_frames("2", "a"));
    // one value, in a run
    let one = [&["run", "tiny.toml"][..], &programs, &["until=2", "--seeds", "1", "--out", "run"]].concat();
    let answer = room.skiagraph(one);
    assert_eq!(answer.code, 0, "{}", answer.stderr);
}

#[test]
fn a_ladder_is_one_command_with_a_curve_per_tracker_and_axis() {
    let room = room_with_program("0");
    let trackers = ["--exec", "sh t.sh", "--name", "mine", "--tracker", "frozen"];
    let axes = ["--axis", "start_mm=100,400", "--axis", "boundary_px=2", "--draws", "3", "--json"];
    let ladder = [&["ladder", "tiny.toml"][..], &trackers, &axes].concat();
    let answer = room.skiagraph(&ladder);
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    let found: Value = serde_json::from_str(&answer.stdout).unwrap();
    let curves = found["curves"].as_array().unwrap();
    assert_eq!((curves.len(), &found["draws"], &found["incomplete"]), (4, &json!(3), &json!(0)), "{found}");
    let curve = |axis: &str, tracker: &str| {
        curves.iter().find(|curve| curve["axis"] == axis && curve["tracker"] == tracker).unwrap()
    };
    let means = |axis: &str, tracker: &str| -> Vec<f64> {
        curve(axis, tracker)["levels"].as_array().unwrap().iter().map(|level| number(&level["mean"])).collect()
    };
    for axis in ["start_mm", "boundary_px"] {
        let (mine, frozen) = (means(axis, "mine"), means(axis, "frozen"));
        assert!(mine.iter().zip(&frozen).all(|(a, b)| (a - b).abs() < 1e-6), "neither moves: {mine:?} {frozen:?}");
    }
    let start = means("start_mm", "mine");
    assert_eq!(start[0], means("boundary_px", "mine")[0], "one clean level for all axes");
    // the curve at the level where it doubles
    let at = number(&curve("start_mm", "mine")["doubles_at"]);
    let (from, to) = if start[1] >= 2.0 * start[0] { (0, 1) } else { (1, 2) };
    let levels = [0.0, 100.0, 400.0];
    let share = (at - levels[from]) / (levels[to] - levels[from]);
    assert!((start[from] + share * (start[to] - start[from]) - 2.0 * start[0]).abs() < 1e-6, "{at}: {start:?}");
    assert!(
        curve("start_mm", "mine")["levels"][1]["ci95"].is_array()
            && curve("boundary_px", "mine")["doubles_at"].is_null()
    );
    let page = String::from_utf8(room.read("ladders/tiny/ladder.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("doubles at") && page.contains("never moves"));
    let again = room.skiagraph(&ladder);
    assert_eq!((again.code, again.stdout), (0, answer.stdout), "nothing is run again");
    // the page again, from the results alone
    fs::remove_file(room.path("ladders/tiny/ladder.html")).unwrap();
    fs::remove_file(room.path("t.sh")).unwrap();
    room.succeed("report ladders/tiny");
    assert_eq!(String::from_utf8(room.read("ladders/tiny/ladder.html")).unwrap(), page);
    for (axis, words) in [("boundry_px", "did you mean `boundary_px`?"), ("holes=7", "expected levels from 0 to 1")] {
        let refused = room.skiagraph(["ladder", "tiny.toml", "--axis", axis]);
        assert!(refused.code == 2 && refused.stderr.contains(words), "{}", refused.stderr);
    }
}

#[test]
fn a_suite_has_intervals_over_clips_and_goes_on_without_a_missing_clip() {
    let room = room_with_program("0");
    let suite = "schema = \"skiagraph.suite/1\"\nname = \"small\"\nbase = \"tiny.toml\"\n[clips]\n\
                 walk = []\nrun = [\"motion.clip=embedded:run\"]\njump = [\"motion.clip=embedded:jump\"]\n";
    room.write("whole.toml", format!("{suite}[cameras]\ntwo = []\none = [\"rig.ring.count=1\"]\n"));
    let trackers = ["--exec", "sh t.sh", "--name", "mine", "--tracker", "frozen", "--json"];
    let answer = room.skiagraph([&["suite", "whole.toml"][..], &trackers].concat());
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    let found: Value = serde_json::from_str(&answer.stdout).unwrap();
    let names: Vec<&str> =
        found["strata"].as_array().unwrap().iter().map(|row| row["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["all", "cameras = one", "cameras = two", "clip = jump", "clip = run", "clip = walk"], "{found}");
    let all = &found["strata"][0]["values"];
    assert_eq!((found["trackers"].clone(), &all[0]["clips"]), (json!(["frozen", "mine"]), &json!(3)));
    assert!((number(&all[0]["mean"]) - number(&all[1]["mean"])).abs() < 1e-6 && all[1]["ci95"].is_array(), "{all}");
    // the mean over clips, by another road: the runs in their folders
    let of_run = |name: &str| {
        number(&json_of(&room, &format!("suites/small/reports/mine/{name}/run.json"))["metrics"]["humaneva_mm"]["mean"])
    };
    let runs = ["one-jump", "one-run", "one-walk", "two-jump", "two-run", "two-walk"].map(of_run);
    assert!((number(&all[1]["mean"]) - runs.iter().sum::<f64>() / 6.0).abs() < 1e-6, "{runs:?} {all}");
    // planned, as for a cluster, and run by cells: the same tables and the same page
    let planned = [&["sweep", "plan", "whole.toml"][..], &trackers[..6], &["--out", "planned"]].concat();
    assert_eq!(room.skiagraph(planned).code, 0);
    room.succeed("sweep run planned");
    room.succeed("report planned");
    for file in ["runs.csv", "runs.jsonl"] {
        assert!(room.read(&format!("planned/{file}")) == room.read(&format!("suites/small/{file}")), "{file}");
    }
    let [by_cells, at_once] =
        ["planned", "suites/small"].map(|name| String::from_utf8(room.read(&format!("{name}/suite.html"))).unwrap());
    assert!(at_once.contains("--out suites&#x2f;small") && by_cells.contains("--out planned"));
    // each names the folder that was given
    assert!(by_cells.replace("--out planned", "--out suites&#x2f;small") == at_once, "the pages differ");
    // runs of the same clip are not independent: each clip is one observation, the mean over its conditions
    let compared = room.succeed("compare suites/small --json");
    let compared: Value = serde_json::from_str(&compared.stdout).unwrap();
    assert_eq!(compared["base"]["seeds"].as_object().map_or(0, serde_json::Map::len), 3, "{compared}");
    let refused = room.skiagraph(["baseline", "save", "mine", "suites/small/reports/mine"]);
    assert!(refused.code == 2 && refused.stderr.contains("expected 5 or more"), "{}", refused.stderr);
    // a clip is missing: the others go on
    room.write("gap.toml", format!("{suite}gone = [\"motion.clip=gone.bvh\"]\n"));
    let gap = room.skiagraph(["suite", "gap.toml", "--exec", "sh t.sh", "--out", "gap"]);
    assert_eq!(gap.code, 1, "{}{}", gap.stdout, gap.stderr);
    assert!(
        gap.stdout.contains("INCOMPLETE: 1 without a value") && gap.stdout.contains("3 clips, 1 missing"),
        "{}",
        gap.stdout
    );
    assert!(
        gap.stdout.find("failed").unwrap() < gap.stdout.find("condition").unwrap(),
        "failures first: {}",
        gap.stdout
    );
    room.write("bad.toml", suite.replace("walk = []", "\"a walk\" = []"));
    for axis in [["--exec", "sh t.sh {alpha}", "alpha=1,2"], ["--tracker", "frozen", "rig.ring.radius_m=4,5"]] {
        let refused = room.skiagraph([&["suite", "whole.toml"][..], &axis].concat());
        assert!(refused.code == 2 && refused.stderr.contains("run one suite per value"), "{}", refused.stderr);
    }
    let bad = room.skiagraph(["suite", "bad.toml"]);
    assert!(bad.code == 2 && bad.stderr.contains("expected names of 1 to 15 letters"), "{}", bad.stderr);
}
