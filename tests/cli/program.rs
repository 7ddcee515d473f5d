//! `skiagraph track --exec`: programs of all kinds, the examples and hostile ones.

use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY, shipped};
use crate::support::{python_with_numpy, skip};

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    room
}

/// Tracks with a command and returns `program.json`.
fn record(room: &Sandbox, command: &str, more: &[&str]) -> Value {
    // another program's run is not replaced
    std::fs::remove_dir_all(room.path("run")).ok();
    let answer = room.skiagraph([&["track", "set", "--exec", command, "--out", "run"], more].concat());
    assert_eq!(answer.code, 0, "{command}: {}", answer.stderr);
    serde_json::from_slice(&room.read("run/program.json")).unwrap()
}

/// Evaluates the run; its error must be that of a tracker that never moves.
fn assert_frozen(room: &Sandbox) {
    room.succeed("evaluate set run");
    let run: Value = serde_json::from_slice(&room.read("run/run.json")).unwrap();
    let (mean, frozen) = (&run["metrics"]["humaneva_mm"]["mean"], &run["frozen"]["humaneva_mm"]);
    assert!((mean.as_f64().unwrap() - frozen.as_f64().unwrap()).abs() < 1e-6, "{mean} {frozen}");
    assert_eq!(run["metrics"]["coverage"]["mean"], 1.0);
}

#[cfg(unix)]
#[test]
fn the_shell_example_never_moves_and_is_measured() {
    let room = room();
    let script = format!("sh {}", shipped("examples/external/frozen.sh").display());
    let found = record(&room, &script, &["--seeds", "2"]);
    assert_eq!(found["answers"], serde_json::json!({"poses": 10, "lost": 0, "failed": 0}));
    assert_eq!(found["name"], "frozen.sh");
    assert_frozen(&room);
    let entries = std::fs::read_dir(room.path("run")).unwrap().map(|entry| entry.unwrap().file_name());
    assert!(entries.into_iter().all(|name| name != "handed-out"), "what was handed out is gone");
    let dry = room.skiagraph(["track", "set", "--exec", &script, "--dry-run"]);
    assert!(dry.code == 0 && dry.stdout.contains("frozen.sh follows the protocol"), "{}{}", dry.stdout, dry.stderr);
}

#[test]
fn an_empty_program_is_refused() {
    let room = room();
    for command in ["", "  "] {
        let refused = room.skiagraph(["track", "set", "--exec", command, "--out", "run"]);
        assert!(
            refused.code == 2 && refused.stderr.contains("expected a command line, as in --exec"),
            "{}",
            refused.stderr
        );
    }
}

#[cfg(unix)]
#[test]
fn the_c_example_never_moves() {
    let room = room();
    let source = shipped("examples/external/frozen.c");
    let compiled = Command::new("cc").args(["-O1", "-o"]).arg(room.path("frozen")).arg(&source).status();
    if !compiled.is_ok_and(|status| status.success()) {
        return skip("no C compiler (cc)");
    }
    let found = record(&room, "./frozen", &[]);
    assert_eq!((&found["name"], &found["answers"]["poses"]), (&"frozen.c".into(), &5.into()));
    assert_frozen(&room);
}

#[test]
fn the_python_example_follows_the_silhouettes() {
    let Some(python) = python_with_numpy() else { return };
    let room = room();
    let command = format!("{} {}", python.display(), shipped("examples/external/centroid.py").display());
    let found = record(&room, &command, &["--inline"]);
    assert_eq!(found["answers"]["poses"], 5);
    room.succeed("evaluate set run");
    let run: Value = serde_json::from_slice(&room.read("run/run.json")).unwrap();
    let error = run["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap();
    assert!(error < 100.0, "it stays at the body: {error}");
    assert_eq!(run["program"]["name"], "centroid");
}

#[cfg(unix)]
#[test]
fn errors_of_a_program_lose_its_frames_and_are_reported() {
    let room = room();
    let frozen = shipped("examples/external/frozen.sh");
    let frozen = frozen.display();
    // a filter changes the answers, so that one or more are invalid
    for (filter, failed, part) in [
        (r#"sed -u '/"frame":1,/s/.*/loading weights.../'"#, 1, "print messages to standard error"),
        (r#"sed -u 's/"frame":1,/"frame":7,/'"#, 1, "expected an answer to frame 1, found one to frame 7"),
        (r#"sed -u '/"frame":1,/s/pelvis/nose/'"#, 1, "\"nose\" is unknown"),
        (r#"sed -u '/"frame":2,/s/\[[^]]*\]/[1e999,0,0]/'"#, 1, "JSON"),
    ] {
        let found = record(&room, &format!("sh {frozen} | {filter}"), &[]);
        assert_eq!(found["answers"]["failed"], failed, "{filter}: {found}");
        let what = found["incidents"][0]["what"].as_str().unwrap();
        assert!(what.contains(part), "{filter}: {what}");
    }
    room.succeed("evaluate set run");
    let run: Value = serde_json::from_slice(&room.read("run/run.json")).unwrap();
    assert!((run["metrics"]["lost_frames"]["mean"].as_f64().unwrap() - 0.25).abs() < 1e-9);
}

#[cfg(unix)]
#[test]
fn crashed_and_late_programs_are_restarted_and_their_children_killed() {
    let room = room();
    // dies at frame 1, once: a marker file records it
    let script = std::fs::read_to_string(shipped("examples/external/frozen.sh")).unwrap();
    let dies =
        "case $told in *'\"frame\":1,'*) [ -e died ] || { touch died; echo 'out of memory' >&2; exit 9; };; esac; f=";
    room.write("crash.sh", script.replacen("f=", dies, 1));
    let found = record(&room, "sh crash.sh", &[]);
    assert_eq!(found["answers"], serde_json::json!({"poses": 4, "lost": 0, "failed": 1}), "{found}");
    let incident = &found["incidents"][0];
    assert!(incident["what"].as_str().unwrap().contains("ended (exit status: 9); started again"), "{incident}");
    assert_eq!(incident["standard_error"][0], "out of memory");
    room.write("hang.sh", "read -r hello; echo '{\"type\":\"ready\"}'; sleep 300 & read -r frame; sleep 300");
    let begin = Instant::now();
    let answer = room.skiagraph(["track", "set", "--exec", "sh hang.sh", "--out", "hung", "--frame-limit", "0.2"]);
    assert!(begin.elapsed() < Duration::from_secs(20), "{:?}", begin.elapsed());
    assert!(answer.code == 1 && answer.stdout.contains("no answer within 200ms"), "{}{}", answer.stdout, answer.stderr);
    let found: Value = serde_json::from_slice(&room.read("hung/program.json")).unwrap();
    assert_eq!(found["answers"]["failed"], 5, "four starts, then none");
}

#[cfg(unix)]
#[test]
fn a_program_that_never_works_is_an_error_and_memory_is_bounded() {
    let room = room();
    for (command, part) in [
        ("no-such-program", "ended before it was ready"),
        ("echo hello", "print messages to standard error"),
        ("yes", "expected one JSON object per line"),
        ("cat /dev/zero", "more than 1 MiB"),
        ("sleep 60", "was not ready within 300ms"),
        ("echo '{\"type\":\"ready\",\"protocol\":\"skiagraph.tracker/9\"}'", "skiagraph.tracker/9"),
    ] {
        let answer = room.skiagraph(["track", "set", "--exec", command, "--out", "run", "--start-limit", "0.3"]);
        assert!(answer.code == 2 && answer.stderr.contains(part), "{command}: {}", answer.stderr);
        assert!(answer.stderr.contains("docs/protocol.md"), "{}", answer.stderr);
        assert!(!room.path("run").exists());
    }
    // ready, then garbage without end
    let flood = "read -r hello; echo '{\"type\":\"ready\"}'; yes";
    let answer = room.skiagraph(["track", "set", "--exec", flood, "--out", "run"]);
    assert!(answer.stdout.contains("0 frames with a pose, 0 lost, 5 failed"), "{}{}", answer.stdout, answer.stderr);
    assert!(answer.code == 1 && answer.stdout.contains("no frame was answered"), "{}", answer.stdout);
    let dry = room.skiagraph(["track", "set", "--exec", flood, "--dry-run"]);
    assert!(dry.code == 1 && dry.stdout.contains("FAILED"), "{}", dry.stdout);
    let refused = room.skiagraph(["evaluate", "set", "run"]);
    assert!(refused.code == 2 && refused.stderr.contains("it has no estimate"), "{}", refused.stderr);
}

/// A program that answers `lost` to every frame.
#[cfg(unix)]
const LOSES: &str = "read -r hello; echo '{\"type\":\"ready\"}'; n=0; while read -r told; do \
                     echo \"{\\\"type\\\":\\\"lost\\\",\\\"frame\\\":$n}\"; n=$((n + 1)); done";

#[cfg(unix)]
#[test]
fn a_program_that_is_lost_in_every_frame_leaves_nothing_to_measure() {
    let room = room();
    let answer = room.skiagraph(["track", "set", "--exec", LOSES, "--out", "run"]);
    assert!(answer.stdout.contains("0 frames with a pose, 5 lost, 0 failed"), "{}{}", answer.stdout, answer.stderr);
    assert!(answer.code == 1 && answer.stdout.contains("no frame was answered with a pose"), "{}", answer.stdout);
    let json = room.skiagraph(["track", "set", "--exec", LOSES, "--out", "run", "--json"]);
    assert_eq!(json.code, 1);
}

#[cfg(unix)]
#[test]
fn late_answers_are_skipped_and_an_endless_stream_of_them_ends() {
    let room = room();
    let script = std::fs::read_to_string(shipped("examples/external/frozen.sh")).unwrap();
    // the answer to frame 1 comes with that of frame 2
    let late = "case $told in *'\"frame\":1,'*) echo junk; late=1; continue;; esac; \
                [ -n \"$late\" ] && echo '{\"type\":\"lost\",\"frame\":1}'; late=; f=";
    room.write("late.sh", script.replacen("f=", late, 1));
    let found = record(&room, "sh late.sh", &[]);
    assert_eq!(found["answers"], serde_json::json!({"poses": 4, "lost": 0, "failed": 1}), "{found}");
    let flood = "read -r hello; echo '{\"type\":\"ready\"}'; read -r frame; yes '{\"type\":\"lost\",\"frame\":0}'";
    let answer = room.skiagraph(["track", "set", "--exec", flood, "--out", "flooded", "--restarts", "0"]);
    assert!(answer.code == 1 && answer.stdout.contains("no frame was answered with a pose"), "{}", answer.stdout);
    let found: Value = serde_json::from_slice(&room.read("flooded/program.json")).unwrap();
    assert_eq!(found["answers"]["lost"], 1, "{found}");
    assert_eq!(found["answers"]["failed"], 4, "{found}");
    assert!(found["incidents"][0]["what"].as_str().unwrap().contains("a thousand earlier frames"), "{found}");
}

#[cfg(unix)]
#[test]
fn a_program_gets_no_truth() {
    let room = room();
    room.write("spy.sh", "read -r h; f=$(printf %s \"$h\" | sed 's/.*\"folder\":\"\\([^\"]*\\)\".*/\\1/'); find \"$f\" > \
        seen.txt; echo '{\"type\":\"ready\"}'; while read -r l; do n=${l#*'\"frame\":'}; case $l in *end*) exit;; esac; echo \
        \"{\\\"type\\\":\\\"lost\\\",\\\"frame\\\":${n%%,*}}\"; done");
    let answer = room.skiagraph(["track", "set", "--exec", "sh spy.sh", "--out", "run"]);
    assert_eq!(answer.code, 1, "it is lost in every frame: {}", answer.stderr);
    let found: Value = serde_json::from_slice(&room.read("run/program.json")).unwrap();
    assert_eq!(found["answers"]["lost"], 5, "{found}");
    let seen = String::from_utf8(room.read("seen.txt")).unwrap();
    assert!(seen.contains("cameras.json") && seen.contains("000004.png"), "{seen}");
    // `read_truth.py` reads the truth of a complete set
    assert!(!seen.contains("/truth") && !seen.contains("sha256") && !seen.contains("/set/"), "{seen}");
}

#[cfg(unix)]
#[test]
fn a_program_that_modifies_its_copy_does_not_change_the_set() {
    let room = room();
    let script = std::fs::read_to_string(shipped("examples/external/frozen.sh")).unwrap();
    let spoils = "folder=$(printf %s \"$hello\" | sed 's/.*\"folder\":\"\\([^\"]*\\)\".*/\\1/'); \
                  find \"$folder\" -name '*.png' -exec sh -c 'echo broken > \"$1\"; echo 1 >> spoilt' _ {} \\;";
    room.write("spoil.sh", script.replacen("read -r hello;", &format!("read -r hello; {spoils};"), 1));
    assert_eq!(record(&room, "sh spoil.sh", &[])["answers"]["poses"], 5);
    assert!(room.read("spoilt").len() >= 10, "it found images to spoil");
    room.succeed("verify set");
}

#[test]
fn a_set_without_its_truth_is_tracked_and_measured_with_the_complete_set() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out public --truth secret");
    assert!(!room.path("public/truth").exists() && room.path("secret/truth/truth.npz").exists());
    room.succeed("track public --tracker frozen --out run");
    room.succeed("evaluate secret run");
    for (out, truth) in [("nested", "nested"), ("nested", "nested/truth"), ("nested/public", "nested")] {
        let nested = room.skiagraph(["render", "tiny.toml", "--out", out, "--truth", truth]);
        assert!(
            nested.code == 2
                && nested.stderr.contains("--truth: expected a directory that neither contains nor lies within"),
            "{}",
            nested.stderr
        );
        assert!(!room.path("nested").exists());
    }
    let again = room.skiagraph(["render", "tiny.toml", "--out", "other", "--truth", "secret"]);
    assert!(again.code == 2 && again.stderr.contains("secret"), "{}", again.stderr);
    assert!(!room.path("other").exists());
}
