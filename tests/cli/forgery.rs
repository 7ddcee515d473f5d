//! Programs that try to modify their own run, to find the truth, or to outlive skiagraph.

use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::programs::write_still;
use crate::sandbox::Sandbox;
use crate::support::skip;

const TRACK: &str = "track set --exec 'sh t.sh'";

/// What it writes around its folder and into a run that is being made enters no run.
#[test]
fn forged_files_enter_no_run() {
    let room = Sandbox::with_set();
    let forged = "for name in run.json poses.npz per_frame.csv program.json skiagraph.sha256 seeds-9-9/run.json \
                  seeds-9-9/skiagraph.sha256; do \
                  for place in \"$folder\" \"$folder/..\" .run.partial-*; do \
                  mkdir -p \"$place/seeds-9-9\"; echo forged > \"$place/$name\"; done; done";
    write_still(&room, forged, "");
    room.succeed(&format!("{TRACK} --out run"));
    let written = ["run/answers.csv", "run/made_by.json", "run/poses.npz", "run/program.json", "run/skiagraph.sha256"];
    assert_eq!(room.files_below("run"), written);
    assert!(written.iter().all(|name| room.read(name) != b"forged\n"));
    room.refused("compare run run", "not measured");
    let left = &room.json("run/program.json")["left_behind"];
    assert_eq!(left["files"], 14, "{left}");
    let listed = left["listed"].as_array().unwrap();
    for name in ["run.json", "blind/run.json"] {
        assert!(listed.iter().any(|file| file["name"] == name), "{left}");
    }
    room.succeed("evaluate set run");
    room.succeed("compare run run");
}

#[test]
fn planted_files_are_read_by_nothing() {
    let room = Sandbox::with_set();
    write_still(&room, "", "");
    room.succeed(&format!("{TRACK} --seeds 5 --out run"));
    // before it is measured
    fs::create_dir(room.path("run/better")).unwrap();
    for name in ["run/run.json", "run/better/run.json"] {
        room.write(name, "{\"schema\": \"skiagraph.run/1\"}");
    }
    for command in
        ["compare run run", "gate run --baseline run --margin 2mm", "report run --figures a", "evaluate set run"]
    {
        room.refused(command, "run");
    }
    fs::remove_file(room.path("run/run.json")).unwrap();
    room.refused("compare run run", "not measured");
    fs::remove_dir_all(room.path("run/better")).unwrap();
    room.succeed("evaluate set run");
    // a program that never moves answers the same for every seed: a baseline needs random numbers
    room.succeed("run tiny.toml --seeds 5 --quiet --out own");
    room.succeed("baseline save mine own --baselines .");
    let gate = "gate run --baseline mine --baselines . --margin 2mm";
    for (file, commands) in
        [("run/run.json", &["compare run run", gate][..]), ("run/per_frame.csv", &["report run --figures a"])]
    {
        let whole = room.text(file);
        room.write(file, whole.replacen('1', "2", 1));
        for command in commands {
            room.refused(command, "skiagraph did not write this file, or it was changed since");
        }
        room.write(file, whole);
    }
    room.succeed("compare run run");
}

/// Recordings lie where the environment says.
#[test]
fn programs_hear_nothing_of_recordings() {
    let room = Sandbox::with_set();
    write_still(&room, "env >seen.txt", "");
    let mut command = room.program(["track", "set", "--exec", "sh t.sh", "--out", "run"]);
    command.envs([("SKIAGRAPH_MOCAP", "/of/the/truth"), ("SKIAGRAPH_TEST_DATA", "/more/of/it"), ("MINE", "kept")]);
    assert!(command.output().unwrap().status.success());
    let seen = room.text("seen.txt");
    assert!(!seen.contains("SKIAGRAPH_") && !seen.contains("/of/") && seen.contains("MINE=kept"), "{seen}");
}

/// How a program ends after its last answer.
#[test]
fn endings_of_programs_are_recorded() {
    let room = Sandbox::with_set();
    for (at_end, code, killed, status, said) in [
        ("exit", 0, false, "exit status: 0", ""),
        ("{ echo broken >&2; exit 7; }", 1, false, "exit status: 7", "ended after its last answer (exit status: 7)"),
        (
            "{ sleep 300 & sleep 300; }",
            1,
            true,
            "did not end",
            "did not end within 2s of its last answer and was killed",
        ),
    ] {
        write_still(&room, "", "");
        room.write("t.sh", room.text("t.sh").replacen(") exit ;;", &format!(") {at_end};;"), 1));
        let dry = room.ask(&format!("{TRACK} --dry-run"));
        assert_eq!(dry.code, code, "{at_end}: {}{}", dry.stdout, dry.stderr);
        assert_eq!(dry.stdout.contains("FAILED  ends by itself"), code == 1, "{}", dry.stdout);
        let begin = Instant::now();
        room.succeed(&format!("{TRACK} --out run --force"));
        assert!(begin.elapsed() < Duration::from_secs(20), "{at_end}");
        let record = room.json("run/program.json");
        assert_eq!(record["endings"], json!([{"seed": 0, "status": status, "killed": killed}]), "{at_end}");
        assert_eq!(record["answers"]["poses"], 5, "the answers count all the same");
        let incidents: Vec<&str> =
            record["incidents"].as_array().unwrap().iter().map(|incident| incident["what"].as_str().unwrap()).collect();
        assert_eq!(incidents.len(), usize::from(code == 1), "{incidents:?}");
        assert!(incidents.concat().contains(said), "{incidents:?}");
    }
}

/// Neither truth nor network, and it cannot write the blind side.
#[test]
fn isolated_programs_see_nothing_else() {
    let tried = Command::new("bwrap").args(["--unshare-all", "--ro-bind", "/", "/", "true"]).output();
    if !tried.is_ok_and(|output| output.status.success()) {
        return skip("no bubblewrap that can make namespaces (apt-get install bubblewrap)");
    }
    let room = Sandbox::with_set();
    let (here, set) = (room.path(".").display().to_string(), room.path("set").display().to_string());
    let secret = room.path("set/truth/truth.npz").display().to_string();
    let spy = format!(
        "{{ ls {secret} {set}; ls /proc/1/root{secret}; cat /proc/net/dev; echo spoilt > $folder/cameras.json; \
         tr '\\0' ' ' < /proc/$PPID/cmdline; ls $folder; echo mine > /tmp/mine; cat /tmp/mine; }} >&2; exit 3"
    );
    write_still(&room, &spy, "");
    let spied = format!("{TRACK} --out run --sandbox --readable {here} --start-limit 20");
    let said = room.refused(&spied, "ended before it was ready");
    assert!(said.contains("cameras.json") && said.contains("mine"), "the blind side is there: {said}");
    assert!(said.contains("Read-only file system"), "{said}");
    assert!(!said.contains("eth0") && !said.contains("truth.npz\n") && !said.contains("track set"), "{said}");
    // a tracking program, with access to the program only
    write_still(&room, "", "");
    room.succeed(&format!("{TRACK} --out run --sandbox --readable t.sh"));
    let record = room.json("run/program.json");
    assert_eq!((&record["answers"]["poses"], &record["options"]["sandbox"]), (&5.into(), &true.into()));
    room.refused(&format!("{TRACK} --out other --sandbox"), "--readable PATH");
}
