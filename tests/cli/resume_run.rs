//! Interrupted runs over several seeds: finished seeds are kept, with the bytes of an uninterrupted run.

use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

use crate::sandbox::{Sandbox, TINY, shipped};

/// The shell example, slowed down, and lost in frame 2 for odd seeds.
fn slow_program(pause: &str) -> String {
    let script = fs::read_to_string(shipped("examples/external/frozen.sh")).unwrap();
    let seed = "seed=$(printf %s \"$hello\" | sed 's/.*\"seed\":\\([0-9]*\\).*/\\1/')";
    let script = script.replacen("read -r hello;", &format!("read -r hello; {seed}; echo $seed >> begun;"), 1);
    let lost =
        "if [ $((seed % 2)) = 1 ] && [ \"${f%%,*}\" = 2 ]; then echo '{\"type\":\"lost\",\"frame\":2}'; continue; fi";
    let script = script.replacen(
        "; echo \"{\\\"type\\\":\\\"pose\\\"",
        &format!("; sleep {pause}; {lost}; echo \"{{\\\"type\\\":\\\"pose\\\""),
        1,
    );
    assert!(script.contains("sleep") && script.contains("lost"), "{script}");
    script
}

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set -q");
    room.write("t.sh", slow_program("0.02"));
    Command::new("chmod").args(["+x", "t.sh"]).current_dir(room.path(".")).status().unwrap();
    // the example has no shebang line
    room.write("t", "#!/bin/sh\nexec sh t.sh\n");
    Command::new("chmod").args(["+x", "t"]).current_dir(room.path(".")).status().unwrap();
    room
}

/// The parts that are equal for deterministic programs.
fn without_times(room: &Sandbox, run: &str) -> (Value, Vec<String>) {
    let mut record: Value = serde_json::from_slice(&room.read(&format!("{run}/program.json"))).unwrap();
    record.as_object_mut().unwrap().remove("timing");
    let answers = String::from_utf8(room.read(&format!("{run}/answers.csv"))).unwrap();
    let untimed = |row: &str| row.split(',').take(3).collect::<Vec<_>>().join(",");
    (record, answers.lines().map(untimed).collect())
}

fn finished(room: &Sandbox, run: &str) -> usize {
    let names = fs::read_dir(room.path(&format!("{run}.partial"))).into_iter().flatten().flatten();
    names.filter(|entry| entry.file_name().to_string_lossy().starts_with("seed-")).count()
}

#[test]
fn an_external_program_killed_many_times_gives_the_bytes_of_an_uninterrupted_run() {
    let room = room();
    let track = "track set --exec ./t --seeds 8 -q --out";
    room.succeed(&format!("{track} whole"));
    let (mut killed, mut amid) = (0, 0);
    for attempt in 0..6 {
        let before = finished(&room, "run");
        let is_due = || attempt % 3 == 0 || finished(&room, "run") > before;
        let moment = Duration::from_millis(30 * attempt);
        killed += usize::from(room.run_and_kill_once(&format!("{track} run"), is_due, moment));
        if room.path("run").exists() {
            break;
        }
        amid += usize::from(finished(&room, "run") > before);
        assert!(finished(&room, "run") >= before, "no finished seed is lost");
    }
    assert!(killed >= 2 && amid >= 1, "{killed} kills, {amid} of them after a finished seed");
    // the last kill may have come after the run was finished and before its seeds were removed
    let kept = if room.path("run").exists() { 0 } else { finished(&room, "run") };
    fs::remove_file(room.path("begun")).unwrap();
    let done = room.skiagraph("track set --exec ./t --seeds 8 --out run".split(' '));
    assert_eq!(done.code, 0, "{}", done.stderr);
    if kept > 0 {
        assert!(done.stderr.contains(&format!("resumed: {kept} of 8 seeds were finished")), "{}", done.stderr);
        assert_eq!(
            String::from_utf8(room.read("begun")).unwrap().lines().count(),
            8 - kept,
            "only what was missing ran"
        );
    }
    assert_eq!(room.read("run/poses.npz"), room.read("whole/poses.npz"));
    assert_eq!(without_times(&room, "run"), without_times(&room, "whole"));
    assert!(!room.path("run.partial").exists());
    room.succeed("evaluate set run -q");
}

#[test]
fn a_built_in_tracker_killed_many_times_gives_the_bytes_of_an_uninterrupted_run() {
    let room = room();
    let track = "track set --tracker annealed_particle_filter particles=400 layers=3 --calibrate --seeds 6 -q --out";
    room.succeed(&format!("{track} whole"));
    for attempt in 0..5 {
        let before = finished(&room, "run");
        room.run_and_kill(&format!("{track} run"), Duration::from_millis(150 + 60 * attempt));
        assert!(room.path("run").exists() || finished(&room, "run") >= before);
    }
    room.succeed(&format!("{track} run"));
    for file in ["poses.npz", "search.npz"] {
        assert_eq!(room.read(&format!("run/{file}")), room.read(&format!("whole/{file}")), "{file}");
    }
    let record = |run: &str| {
        let mut record: Value = serde_json::from_slice(&room.read(&format!("{run}/track.json"))).unwrap();
        record.as_object_mut().unwrap().remove("timing");
        record
    };
    assert_eq!(record("run"), record("whole"));
    assert_eq!(record("run")["calibration"].as_array().unwrap().len(), 6);
    // a seed does not depend on previous ones
    room.succeed(&track.replace("--seeds 6", "--seed 5").replace("-q --out", "-q --out last"));
    let error = |run: &str, seed: usize| {
        room.succeed(&format!("evaluate set {run} -q"));
        let found: Value = serde_json::from_slice(&room.read(&format!("{run}/run.json"))).unwrap();
        found["metrics"]["humaneva_mm"]["per_run"][seed].clone()
    };
    assert_eq!(error("last", 0), error("whole", 5));
}

#[test]
fn ctrl_c_keeps_finished_seeds_and_other_settings_are_refused_by_key() {
    let room = room();
    room.write("t.sh", slow_program("0.05"));
    let track = "track set --exec ./t --seeds 20 --out run";
    let mut child = Command::new(cargo_bin("skiagraph"))
        .args(track.split(' '))
        .current_dir(room.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while finished(&room, "run") < 2 {
        assert!(child.try_wait().unwrap().is_none(), "it was too fast");
        std::thread::sleep(Duration::from_millis(5));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains("progress is saved in run.partial: run the same command to resume"), "{said}");
    assert!(!room.path("run").exists());
    let refused = |arguments: &[&str], part: &str| {
        let answer = room.skiagraph([&["track", "set", "--seeds", "4", "--out", "run"], arguments].concat());
        assert!(answer.code == 2 && answer.stderr.contains(part), "{}", answer.stderr);
    };
    refused(&["--exec", "./t", "--restarts", "1"], "restarts: was nothing, now 1");
    refused(&["--tracker", "frozen"], "command: was skiagraph track --exec, now skiagraph track");
    let whole = room.read("t");
    room.write("t", "#!/bin/sh\n# another version\nexec sh t.sh\n");
    refused(&["--exec", "./t"], "SHA-256 of ./t");
    room.write("t", whole);
    let kept = finished(&room, "run");
    assert!(kept >= 2);
    // fewer seeds than at first resume the same run
    let done = room.skiagraph("track set --exec ./t --seeds 4 --out run".split(' '));
    assert!(done.code == 0 && done.stderr.contains("seeds were finished before"), "{}", done.stderr);
    assert_eq!(without_times(&room, "run").0["answers"]["poses"], 18);
    assert!(!room.path("run.partial").exists());
}
