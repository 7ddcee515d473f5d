//! Interrupted runs over several seeds: finished seeds are kept, with the bytes of an uninterrupted run.

use std::fs;
use std::time::Duration;

use serde_json::Value;

use crate::programs::write_still;
use crate::sandbox::{Sandbox, interrupt, wait_until};

/// With the set and the slow program `t`, which is lost in frame 2 for odd seeds and appends its seed to `begun`.
fn with_slow_program(pause: &str) -> Sandbox {
    let room = Sandbox::with_set();
    let lost = "[ $((seed % 2))$frame = 12 ] && { lost; continue; }";
    write_still(&room, "echo $seed >>begun", &format!("sleep {pause}; {lost}"));
    room.executable("t", "#!/bin/sh\nexec sh t.sh\n");
    room
}

/// A record of a run without what differs from run to run.
fn without_times(room: &Sandbox, file: &str) -> Value {
    let mut record = room.json(file);
    record.as_object_mut().unwrap().remove("timing");
    record
}

fn finished(room: &Sandbox) -> usize {
    room.entries_of("run.partial").iter().filter(|name| name.starts_with("seed-")).count()
}

#[test]
fn killed_program_run_is_resumed() {
    let room = with_slow_program("0.02");
    let track = "track set --exec ./t --seeds 8 -q --out";
    room.succeed(&format!("{track} whole"));
    let (mut killed, mut amid) = (0, 0);
    for attempt in 0..6 {
        let before = finished(&room);
        let is_due = || attempt % 3 == 0 || finished(&room) > before;
        let moment = Duration::from_millis(30 * attempt);
        killed += usize::from(room.run_and_kill_once(&format!("{track} run"), is_due, moment));
        if room.path("run").exists() {
            break;
        }
        amid += usize::from(finished(&room) > before);
        assert!(finished(&room) >= before, "no finished seed is lost");
    }
    assert!(killed >= 2 && amid >= 1, "{killed} kills, {amid} of them after a finished seed");
    // the last kill may have come after the run was finished and before its seeds were removed
    let kept = if room.path("run").exists() { 0 } else { finished(&room) };
    fs::remove_file(room.path("begun")).unwrap();
    let done = room.succeed("track set --exec ./t --seeds 8 --out run").stderr;
    if kept > 0 {
        assert!(done.contains(&format!("resumed: {kept} of 8 seeds were finished")), "{done}");
        // a tracker whose program was just killed may begin late on a busy machine
        let begun = room.text("begun").lines().count();
        assert!((8 - kept..=9 - kept).contains(&begun), "{begun} seeds ran, {kept} were finished");
    }
    assert_eq!(room.read("run/poses.npz"), room.read("whole/poses.npz"));
    assert_eq!(without_times(&room, "run/program.json"), without_times(&room, "whole/program.json"));
    let answers = |run: &str| -> Vec<String> {
        let untimed = |row: &str| row.split(',').take(3).collect::<Vec<_>>().join(",");
        room.text(&format!("{run}/answers.csv")).lines().map(untimed).collect()
    };
    assert_eq!(answers("run"), answers("whole"));
    assert!(!room.path("run.partial").exists());
    room.succeed("evaluate set run -q");
}

#[test]
fn killed_tracker_run_is_resumed() {
    let room = Sandbox::with_set();
    let track = "track set --tracker annealed_particle_filter particles=400 layers=3 --calibrate --seeds 6 -q --out";
    room.succeed(&format!("{track} whole"));
    for attempt in 0..5 {
        let before = finished(&room);
        room.run_and_kill(&format!("{track} run"), Duration::from_millis(150 + 60 * attempt));
        assert!(room.path("run").exists() || finished(&room) >= before);
    }
    room.succeed(&format!("{track} run"));
    for file in ["poses.npz", "search.npz"] {
        assert_eq!(room.read(&format!("run/{file}")), room.read(&format!("whole/{file}")), "{file}");
    }
    let record = without_times(&room, "run/track.json");
    assert_eq!(record, without_times(&room, "whole/track.json"));
    assert_eq!(record["calibration"].as_array().unwrap().len(), 6);
    // a seed does not depend on previous ones
    room.succeed(&track.replace("--seeds 6", "--seed 5").replace("-q --out", "-q --out last"));
    for run in ["last", "whole"] {
        room.succeed(&format!("evaluate set {run} -q"));
    }
    let error = |run: &str| room.json(&format!("{run}/run.json"))["metrics"]["humaneva_mm"]["per_run"].clone();
    assert_eq!(error("last")[0], error("whole")[5]);
}

/// Other settings are refused by key.
#[test]
fn interrupted_run_keeps_finished_seeds() {
    let room = with_slow_program("0.05");
    let mut child = room.start("track set --exec ./t --seeds 20 --out run");
    wait_until(&mut child, || finished(&room) >= 2);
    let said = interrupt(child);
    assert!(said.contains("progress is saved in run.partial: run the same command to resume"), "{said}");
    assert!(!room.path("run").exists());
    let track = "track set --seeds 4 --out run";
    room.refused(&format!("{track} --exec ./t --restarts 1"), "restarts: was nothing, now 1");
    let words = "command: was skiagraph track --exec, now skiagraph track";
    room.refused(&format!("{track} --tracker frozen"), words);
    let whole = room.read("t");
    room.write("t", "#!/bin/sh\n# another version\nexec sh t.sh\n");
    room.refused(&format!("{track} --exec ./t"), "SHA-256 of ./t");
    room.write("t", whole);
    assert!(finished(&room) >= 2);
    // fewer seeds than at first resume the same run
    room.notes("track set --exec ./t --seeds 4 --out run", &["seeds were finished before"]);
    assert_eq!(room.json("run/program.json")["answers"]["poses"], 18);
    assert!(!room.path("run.partial").exists());
}
