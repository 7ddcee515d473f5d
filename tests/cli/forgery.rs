//! Programs that try to modify their own run, to find the truth, or to outlive skiagraph.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use assert_cmd::cargo::{cargo_bin, cargo_bin_cmd};
use serde_json::Value;

use crate::sandbox::{CommandOutput, Sandbox, TINY, shipped};
use crate::support::skip;

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set -q");
    room
}

/// The shell example with a command that runs once `$folder`, its copy of the set, is known.
fn frozen_and(command: &str) -> String {
    let script = fs::read_to_string(shipped("examples/external/frozen.sh")).unwrap();
    let folder = "folder=$(printf %s \"$hello\" | sed 's/.*\"folder\":\"\\([^\"]*\\)\".*/\\1/')";
    script.replacen("read -r hello;", &format!("read -r hello; {folder}; {command};"), 1)
}

fn track(room: &Sandbox, script: &str, more: &[&str]) -> CommandOutput {
    room.write("t.sh", script);
    room.skiagraph([&["track", "set", "--exec", "sh t.sh", "--out", "run"], more].concat())
}

fn json(room: &Sandbox, file: &str) -> Value {
    serde_json::from_slice(&room.read(file)).unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn what_a_program_writes_around_its_folder_and_into_a_run_that_is_being_made_enters_no_run() {
    let room = room();
    let forged = "for name in run.json poses.npz per_frame.csv program.json skiagraph.sha256 seeds-9-9/run.json \
                  seeds-9-9/skiagraph.sha256; do \
                  for place in \"$folder\" \"$folder/..\" .run.partial-*; do \
                  mkdir -p \"$place/seeds-9-9\"; echo forged > \"$place/$name\"; done; done";
    let answer = track(&room, &frozen_and(forged), &[]);
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    let run = room.path("run");
    assert_eq!(
        names(&run).into_iter().filter(|name| run.join(name).is_file()).collect::<Vec<_>>(),
        ["answers.csv", "poses.npz", "program.json", "skiagraph.sha256"]
    );
    for name in ["answers.csv", "poses.npz", "program.json", "skiagraph.sha256"] {
        assert_ne!(room.read(&format!("run/{name}")), b"forged\n", "{name}");
    }
    assert_eq!(names(&room.path("run/seeds-9-9")), [""; 0]);
    let unmeasured = room.skiagraph(["compare", "run", "run"]);
    assert!(unmeasured.code == 2 && unmeasured.stderr.contains("not measured"), "{}", unmeasured.stderr);
    let left = &json(&room, "run/program.json")["left_behind"];
    assert_eq!(left["files"], 14, "{left}");
    let listed: Vec<&str> =
        left["listed"].as_array().unwrap().iter().map(|file| file["name"].as_str().unwrap()).collect();
    assert!(listed.contains(&"run.json") && listed.contains(&"blind/run.json"), "{listed:?}");
    room.succeed("evaluate set run");
    room.succeed("compare run run");
}

#[test]
fn a_file_that_is_planted_in_a_finished_run_is_read_by_nothing() {
    let room = room();
    let answer = track(&room, &frozen_and("true"), &["--seeds", "5"]);
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    // before it is measured
    room.write("run/run.json", "{\"schema\": \"skiagraph.run/1\"}");
    fs::create_dir(room.path("run/better")).unwrap();
    fs::copy(room.path("run/run.json"), room.path("run/better/run.json")).unwrap();
    for command in
        ["compare run run", "gate run --baseline run --margin 2mm", "report run --png a.png", "evaluate set run"]
    {
        let refused = room.skiagraph(command.split(' '));
        assert_eq!(refused.code, 2, "{command}: {}{}", refused.stdout, refused.stderr);
    }
    fs::remove_file(room.path("run/run.json")).unwrap();
    let below = room.skiagraph(["compare", "run", "run"]);
    assert!(below.code == 2 && below.stderr.contains("not measured"), "{}", below.stderr);
    fs::remove_dir_all(room.path("run/better")).unwrap();
    room.succeed("evaluate set run");
    // `frozen` answers the same for every seed: a baseline needs a tracker that draws random numbers
    room.succeed("run tiny.toml --seeds 5 --quiet --out own");
    room.succeed("baseline save mine own --baselines .");
    for file in ["run.json", "per_frame.csv"] {
        let whole = room.read(&format!("run/{file}"));
        let text = String::from_utf8(whole.clone()).unwrap();
        room.write(&format!("run/{file}"), text.replacen('1', "2", 1));
        let command = if file == "run.json" { "compare run run" } else { "report run --png a.png" };
        let refused = room.skiagraph(command.split(' '));
        let said = "skiagraph did not write this file, or it was changed since";
        assert!(refused.code == 2 && refused.stderr.contains(said), "{command}: {}", refused.stderr);
        if file == "run.json" {
            let gated = room.skiagraph("gate run --baseline mine --baselines . --margin 2mm".split(' '));
            assert!(gated.code == 2 && gated.stderr.contains(said), "{}", gated.stderr);
        }
        room.write(&format!("run/{file}"), whole);
    }
    room.succeed("compare run run");
}

#[test]
fn a_program_hears_nothing_of_where_recordings_lie() {
    let room = room();
    room.write("t.sh", frozen_and("env > seen.txt"));
    let output = cargo_bin_cmd!("skiagraph")
        .args(["track", "set", "--exec", "sh t.sh", "--out", "run"])
        .current_dir(room.path("."))
        .env("SKIAGRAPH_MOCAP", "/recordings/of/the/truth")
        .env("SKIAGRAPH_TEST_DATA", "/more/of/it")
        .env("MINE", "kept")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let seen = String::from_utf8(room.read("seen.txt")).unwrap();
    let ours: Vec<&str> = seen.lines().filter(|line| line.starts_with("SKIAGRAPH_")).collect();
    assert!(ours.len() == 1 && ours[0].starts_with("SKIAGRAPH_PROGRAM="), "{ours:?}");
    assert!(!seen.contains("of/the/truth") && !seen.contains("/more/of/it") && seen.contains("MINE=kept"), "{seen}");
}

#[test]
fn how_a_program_ends_after_its_last_answer_is_recorded() {
    let room = room();
    let script = frozen_and("true");
    for (name, at_end, code, killed, status) in [
        ("0", "exit", 0, false, "exit status: 0"),
        ("7", "{ echo broken >&2; exit 7; }", 1, false, "exit status: 7"),
        ("hang", "{ sleep 300 & sleep 300; }", 1, true, "did not end"),
    ] {
        let script = script.replacen(") exit;;", &format!(") {at_end};;"), 1);
        let dry = track_dry(&room, &script);
        assert_eq!(dry.code, code, "{name}: {}{}", dry.stdout, dry.stderr);
        assert_eq!(dry.stdout.contains("FAILED  ends by itself"), code == 1, "{}", dry.stdout);
        let begin = Instant::now();
        let answer = track(&room, &script, &[]);
        assert!(answer.code == 0 && begin.elapsed() < Duration::from_secs(20), "{name}: {}", answer.stderr);
        let record = json(&room, "run/program.json");
        assert_eq!(record["endings"], serde_json::json!([{"seed": 0, "status": status, "killed": killed}]), "{name}");
        assert_eq!(record["answers"]["poses"], 5, "the answers count all the same");
        let incidents = record["incidents"].as_array().unwrap();
        assert_eq!(incidents.len(), usize::from(code == 1), "{incidents:?}");
        let said = incidents.iter().map(|incident| incident["what"].as_str().unwrap()).collect::<String>();
        match name {
            "0" => {}
            "7" => assert!(said.contains("ended after its last answer (exit status: 7)"), "{said}"),
            _ => assert!(said.contains("did not end within 2s of its last answer and was killed"), "{said}"),
        }
    }
}

fn track_dry(room: &Sandbox, script: &str) -> CommandOutput {
    room.write("t.sh", script);
    room.skiagraph(["track", "set", "--exec", "sh t.sh", "--dry-run"])
}

/// Whether a process with this id is running.
#[cfg(target_os = "linux")]
fn lives(pid: &str) -> bool {
    let state = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // a zombie has ended, but its parent has not waited for it
    state.rsplit(')').next().is_some_and(|rest| !rest.trim_start().starts_with('Z') && !rest.is_empty())
}

#[cfg(target_os = "linux")]
#[test]
fn a_hanging_tracker_does_not_outlive_skiagraph_that_is_killed() {
    let room = room();
    let hangs = "echo $$ >> pids; echo $folder > where; sleep 300 & echo $! >> pids; \
                 setsid sh -c 'echo $$ >> pids; sleep 300' & sleep 300";
    room.write("t.sh", frozen_and(hangs));
    let mut child = Command::new(cargo_bin("skiagraph"))
        .args(["track", "set", "--exec", "sh t.sh", "--out", "run"])
        .current_dir(room.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    let pids = || fs::read_to_string(room.path("pids")).unwrap_or_default();
    while pids().lines().count() < 3 {
        assert!(begin.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none(), "{}", pids());
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(pids().lines().all(lives));
    child.kill().unwrap();
    child.wait().unwrap();
    let begin = Instant::now();
    let place = String::from_utf8(room.read("where")).unwrap();
    while pids().lines().any(lives) || Path::new(place.trim()).exists() {
        assert!(
            begin.elapsed() < Duration::from_secs(20),
            "alive: {:?}",
            pids().lines().filter(|pid| lives(pid)).collect::<Vec<_>>()
        );
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Whether a sandbox can be made here; otherwise reports that the test is skipped.
fn has_bubblewrap() -> bool {
    let tried = Command::new("bwrap").args(["--unshare-all", "--ro-bind", "/", "/", "true"]).output();
    let works = tried.is_ok_and(|output| output.status.success());
    if !works {
        skip("no bubblewrap that can make namespaces (apt-get install bubblewrap)");
    }
    works
}

#[test]
fn in_a_sandbox_a_program_sees_neither_truth_nor_network_and_cannot_write_the_blind_side() {
    if !has_bubblewrap() {
        return;
    }
    let room = room();
    let secret = room.path("set/truth/truth.npz");
    assert!(secret.is_file());
    let spy = format!(
        "{{ ls {secret} {set}; ls /proc/1/root{secret}; cat /proc/net/dev; echo spoilt > $folder/cameras.json; \
         tr '\\0' ' ' < /proc/$PPID/cmdline; ls $folder; echo mine > /tmp/mine; cat /tmp/mine; }} >&2; exit 3",
        secret = secret.display(),
        set = room.path("set").display()
    );
    room.write("t.sh", frozen_and(&spy));
    let readable = room.path(".").display().to_string();
    let seen = room.skiagraph([
        "track",
        "set",
        "--exec",
        "sh t.sh",
        "--out",
        "run",
        "--sandbox",
        "--readable",
        &readable,
        "--start-limit",
        "20",
    ]);
    assert!(seen.code == 2 && seen.stderr.contains("ended before it was ready"), "{}", seen.stderr);
    let said = seen.stderr;
    assert!(said.contains("cameras.json") && said.contains("mine"), "the blind side is there: {said}");
    assert!(said.contains("Read-only file system"), "{said}");
    assert!(!said.contains("eth0") && !said.contains("truth.npz\n") && !said.contains("track set"), "{said}");
    // a tracking program, with access to the program only
    room.write("t.sh", frozen_and("true"));
    let (script, command) = ("t.sh", "sh t.sh");
    let answer = room.skiagraph(["track", "set", "--exec", command, "--out", "run", "--sandbox", "--readable", script]);
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    let record = json(&room, "run/program.json");
    assert_eq!((&record["answers"]["poses"], &record["options"]["sandbox"]), (&5.into(), &true.into()));
    let not_granted = room.skiagraph(["track", "set", "--exec", command, "--out", "other", "--sandbox"]);
    assert!(not_granted.code == 2 && not_granted.stderr.contains("--readable PATH"), "{}", not_granted.stderr);
}

#[test]
fn a_sandbox_that_cannot_be_made_is_said_in_one_message_before_the_work() {
    let room = room();
    let output = cargo_bin_cmd!("skiagraph")
        .args(["track", "set", "--exec", "true", "--out", "run", "--sandbox"])
        .current_dir(room.path("."))
        .env("PATH", "/nowhere")
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("--sandbox: needs bwrap"), "{said}");
    assert!(said.contains("install the package bubblewrap") && said.lines().count() == 1, "{said}");
    assert!(!room.path("run").exists());
}
