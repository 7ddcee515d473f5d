//! Messages, as sessions at a console: `sessions/NAME.console` has commands (`$`, continued by `>`) and what they say,
//! with a line `? CODE` where the program does not succeed. In a sandbox with `tiny.toml`, every command is a shell
//! script after `sessions/prelude.sh`.
//!
//! A new case is a new `$` line. This writes what the program says now, to be read before it is committed:
//!
//!     SNAPSHOTS=overwrite cargo test --test cli sessions

use std::process::Command;

use snapbox::Data;
use snapbox::assert::Assert;

use crate::sandbox::{PROGRAM, Sandbox, shipped};

macro_rules! sessions {
    ($($name:ident)*) => {
        $(#[test]
        fn $name() {
            play(stringify!($name));
        })*

        #[test]
        fn every_session_is_played() {
            let mut names = vec![$(concat!(stringify!($name), ".console")),*, "prelude.sh"];
            let files = std::fs::read_dir(shipped("tests/cli/sessions")).unwrap();
            let mut files: Vec<String> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
            files.sort();
            names.sort_unstable();
            assert_eq!(files, names);
        }
    };
}

sessions! {
    estimates exports footage gates inspections kinds mistakes odd_paths programs public_sets quotes recordings results robots
    scenarios sets strangers sweeps training
}

/// Repeats a session; what the program says must be what the file says.
fn play(name: &str) {
    let path = shipped(&format!("tests/cli/sessions/{name}.console"));
    let sandbox = Sandbox::tiny();
    let mut played = String::new();
    let mut script = String::new();
    let is_command = |line: &str| line.starts_with("$ ");
    for (line, next) in with_next(&std::fs::read_to_string(&path).unwrap()) {
        let continues = !script.is_empty() && (line.starts_with("> ") || line == ">");
        if is_command(line) || continues {
            script += line.get(2..).unwrap_or_default();
            script.push('\n');
            played += &format!("{line}\n");
            if !next.starts_with('>') {
                played += &answer(&sandbox, &std::mem::take(&mut script));
                played.push('\n');
            }
        } else if !played.contains("\n$ ") || line.starts_with("# ") {
            // the heading and comments; what was said before is not copied
            played += &format!("{line}\n");
        }
    }
    let expected = Data::read_from(&path, None);
    let assert = Assert::new().action_env("SNAPSHOTS").normalize_paths(false);
    assert.eq(played.trim_end().to_owned() + "\n", expected);
}

fn with_next(text: &str) -> impl Iterator<Item = (&str, &str)> {
    text.lines().zip(text.lines().skip(1).chain([""]))
}

/// What a script says. Bad input leaves every file as it was.
fn answer(sandbox: &Sandbox, script: &str) -> String {
    let before = sandbox.files_below(".");
    let output = Command::new("sh")
        .args(["-c", &format!("{}\n{script}", include_str!("sessions/prelude.sh"))])
        .current_dir(sandbox.path("."))
        .envs([("PROGRAM", PROGRAM), ("REPO", env!("CARGO_MANIFEST_DIR"))])
        .env_remove("SKIAGRAPH_MOCAP")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(!said.contains("panicked"), "{script}{said}");
    if said.lines().any(|line| line == "? 2") {
        assert_eq!(sandbox.files_below("."), before, "{script}{said}");
    }
    let here = sandbox.path("").display().to_string();
    let said = said.replace(env!("CARGO_MANIFEST_DIR"), "[REPO]").replace(here.trim_end_matches('/'), "[HERE]");
    let said = without_hashes(&said);
    if said.is_empty() || said.ends_with('\n') { said } else { said + "\n" }
}

/// With `[HASH]` in place of every SHA-256.
fn without_hashes(text: &str) -> String {
    let is_hex = |c: char| matches!(c, '0'..='9' | 'a'..='f');
    let mut found = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(is_hex) {
        let word = rest[start..].split(|c| !is_hex(c)).next().unwrap_or_default();
        found += &rest[..start];
        found += if word.len() == 64 { "[HASH]" } else { word };
        rest = &rest[start + word.len()..];
    }
    found + rest
}
