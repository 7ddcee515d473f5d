//! `skiagraph track --exec`: programs of all kinds, the examples and hostile ones.

use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::programs::write_still;
use crate::sandbox::{Sandbox, shipped};
use crate::support::{python_with_numpy, skip};

/// Tracks with a command and options and returns `program.json`.
fn record(room: &Sandbox, command: &str) -> Value {
    // another program's run is not replaced
    std::fs::remove_dir_all(room.path("run")).ok();
    room.succeed(&format!("track set --out run --exec {command}"));
    room.json("run/program.json")
}

/// Evaluates the run; its error must be that of a tracker that never moves.
fn assert_frozen(room: &Sandbox) {
    room.succeed("evaluate set run");
    let run = room.json("run/run.json");
    let (mean, frozen) = (&run["metrics"]["humaneva_mm"]["mean"], &run["frozen"]["humaneva_mm"]);
    assert!((mean.as_f64().unwrap() - frozen.as_f64().unwrap()).abs() < 1e-6, "{mean} {frozen}");
    assert_eq!(run["metrics"]["coverage"]["mean"], 1.0);
}

#[test]
fn shell_example_never_moves() {
    let room = Sandbox::with_set();
    let script = format!("'sh {}'", shipped("examples/external/frozen.sh").display());
    let found = record(&room, &format!("{script} --seeds 2"));
    assert_eq!(found["answers"], json!({"poses": 10, "lost": 0, "failed": 0}));
    assert_eq!(found["name"], "frozen.sh");
    assert_frozen(&room);
    assert!(!room.path("run/handed-out").exists(), "what was handed out is gone");
    room.says(&format!("track set --exec {script} --dry-run"), &["frozen.sh follows the protocol"]);
}

#[test]
fn c_example_never_moves() {
    let room = Sandbox::with_set();
    let source = shipped("examples/external/frozen.c");
    let compiled = Command::new("cc").args(["-O1", "-o"]).arg(room.path("frozen")).arg(&source).status();
    if !compiled.is_ok_and(|status| status.success()) {
        return skip("no C compiler (cc)");
    }
    let found = record(&room, "./frozen");
    assert_eq!((&found["name"], &found["answers"]["poses"]), (&"frozen.c".into(), &5.into()));
    assert_frozen(&room);
}

#[test]
fn python_example_follows_silhouettes() {
    let Some(python) = python_with_numpy() else { return };
    let room = Sandbox::with_set();
    let program = shipped("examples/external/centroid.py");
    let found = record(&room, &format!("'{} {}' --inline", python.display(), program.display()));
    assert_eq!((&found["name"], &found["answers"]["poses"]), (&"centroid".into(), &5.into()));
    room.succeed("evaluate set run");
    let error = room.mean("run", "humaneva_mm");
    assert!(error < 100.0, "it stays at the body: {error}");
}

#[test]
fn invalid_answers_lose_their_frames() {
    let room = Sandbox::with_set();
    write_still(&room, "", "");
    // a filter changes the answers, so that one is invalid
    for (filter, part) in [
        (r#"/"frame":1,/s/.*/loading weights.../"#, "print messages to standard error"),
        (r#"s/"frame":1,/"frame":7,/"#, "expected an answer to frame 1, found one to frame 7"),
        (r#"/"frame":1,/s/pelvis/nose/"#, "\"nose\" is unknown"),
        (r#"/"frame":2,/s/\[[^]]*\]/[1e999,0,0]/"#, "JSON"),
    ] {
        room.write("filter.sed", filter);
        let found = record(&room, "'sh t.sh | sed -u -f filter.sed'");
        assert_eq!(found["answers"]["failed"], 1, "{filter}: {found}");
        let what = found["incidents"][0]["what"].as_str().unwrap();
        assert!(what.contains(part), "{filter}: {what}");
    }
    room.succeed("evaluate set run");
    assert!((room.mean("run", "lost_frames") - 0.25).abs() < 1e-9);
}

/// And their children are killed.
#[test]
fn crashed_and_late_programs_restart() {
    let room = Sandbox::with_set();
    // dies at frame 1, once: a marker file records it
    let dies = "[ \"$frame\" = 1 ] && [ ! -e died ] && { touch died; echo 'out of memory' >&2; exit 9; }";
    write_still(&room, "", dies);
    let found = record(&room, "'sh t.sh'");
    assert_eq!(found["answers"], json!({"poses": 4, "lost": 0, "failed": 1}), "{found}");
    let incident = &found["incidents"][0];
    assert!(incident["what"].as_str().unwrap().contains("ended (exit status: 9); started again"), "{incident}");
    assert_eq!(incident["standard_error"][0], "out of memory");
    write_still(&room, "", "sleep 300 & sleep 300");
    let begin = Instant::now();
    let answer = room.ask("track set --exec 'sh t.sh' --out hung --frame-limit 0.2");
    assert!(begin.elapsed() < Duration::from_secs(20), "{:?}", begin.elapsed());
    assert!(answer.code == 1 && answer.stdout.contains("no answer within 200ms"), "{}{}", answer.stdout, answer.stderr);
    assert_eq!(room.json("hung/program.json")["answers"]["failed"], 5, "four starts, then none");
}

/// A process that died while it tracked left a finished run of the frames before.
#[test]
fn program_asks_for_another_time() {
    let room = Sandbox::with_set();
    write_still(&room, "", "[ $seed$frame = 12 ] && [ ! -e waited ] && { touch waited; exit 75; }");
    let track = "track set --exec 'sh t.sh' --seeds 3 --out run";
    let answer = room.ask(track);
    assert!(answer.code == 75 && answer.stderr.contains("asks for another time"), "{} {}", answer.code, answer.stderr);
    assert!(!room.path("run").exists() && room.path("run.partial/seed-0").exists());
    room.notes(track, &["resumed: 1 of 3 seeds were finished"]);
    assert_eq!(room.json("run/program.json")["answers"]["failed"], 0);
}

/// An endless stream of them ends, too.
#[test]
fn late_answers_are_skipped() {
    let room = Sandbox::with_set();
    // the answer to frame 1 comes with that of frame 2
    let late = "[ \"$frame\" = 1 ] && { echo junk; continue; }; [ \"$frame\" = 2 ] && (frame=1; lost)";
    write_still(&room, "", late);
    let found = record(&room, "'sh t.sh'");
    assert_eq!(found["answers"], json!({"poses": 4, "lost": 0, "failed": 1}), "{found}");
    write_still(&room, "", "yes '{\"type\":\"lost\",\"frame\":0}'");
    let answer = room.ask("track set --exec 'sh t.sh' --out flooded --restarts 0");
    assert!(answer.code == 1 && answer.stdout.contains("no frame was answered with a pose"), "{}", answer.stdout);
    let found = room.json("flooded/program.json");
    assert_eq!((&found["answers"]["lost"], &found["answers"]["failed"]), (&1.into(), &4.into()), "{found}");
    assert!(found["incidents"][0]["what"].as_str().unwrap().contains("a thousand earlier frames"), "{found}");
}

/// It is lost in every frame, so there is nothing to measure.
#[test]
fn programs_get_no_truth() {
    let room = Sandbox::with_set();
    write_still(&room, "find \"$folder\" >seen.txt", "lost; continue");
    let answer = room.ask("track set --exec 'sh t.sh' --out run");
    assert!(answer.stdout.contains("0 frames with a pose, 5 lost, 0 failed"), "{}{}", answer.stdout, answer.stderr);
    assert!(answer.code == 1 && answer.stdout.contains("no frame was answered with a pose"), "{}", answer.stdout);
    assert_eq!(room.ask("track set --exec 'sh t.sh' --out run --json").code, 1);
    let seen = room.text("seen.txt");
    assert!(seen.contains("cameras.json") && seen.contains("000004.png"), "{seen}");
    // `read_truth.py` reads the truth of a complete set
    assert!(!seen.contains("/truth") && !seen.contains("sha256") && !seen.contains("/set/"), "{seen}");
}

#[test]
fn programs_change_their_copy_only() {
    let room = Sandbox::with_set();
    let spoils = "find \"$folder\" -name '*.png' -exec sh -c 'echo broken >\"$1\"; echo 1 >>spoilt' _ {} \\;";
    write_still(&room, spoils, "");
    assert_eq!(record(&room, "'sh t.sh'")["answers"]["poses"], 5);
    assert!(room.read("spoilt").len() >= 10, "it found images to spoil");
    room.succeed("verify set");
}
