//! Runs every command of README.md and docs/*.md unchanged, in the order of its page, in a folder like a fresh
//! checkout.
//!
//! Only the scenarios in that folder are changed: fewer frames, smaller images and fewer particles (`shrunk`), so that
//! a page takes seconds. `skiagraph`, `cargo run --release --` and the examples are the programs built for the tests.
//! Not run: other commands of cargo (their targets must exist), and lines that end in a comment `# with your own ...`,
//! which need files that are not shipped.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use toml::{Table, Value};

use crate::sandbox::{PROGRAM, Sandbox, shipped};
use crate::support::{python_with_numpy, skip};

/// Folders of the checkout that commands read.
const FOLDERS: [&str; 2] = ["scenarios", "examples"];
/// End of a line that needs a file that is not shipped.
const OWN: &str = "# with your own ";
/// Maximum number of such lines, which are not tested.
const MOST_OWN: usize = 1;

/// A code block of a page.
#[derive(Debug)]
struct Block {
    page: String,
    /// Its first line in the page, from 1.
    line: usize,
    language: Language,
    text: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Language {
    Shell,
    Python,
    /// A GitHub workflow, whose `run` steps are run.
    Yaml,
    /// JSON and file listings.
    Other,
}

/// Code blocks of a page: fenced, or indented by four spaces.
fn blocks(page: &str, text: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let lines: Vec<&str> = text.lines().collect();
    let mut at = 0;
    while at < lines.len() {
        let begin = at;
        let (named, body): (Option<&str>, Vec<&str>) = match lines[at].strip_prefix("```") {
            Some(named) => {
                let body: Vec<&str> = lines[at + 1..].iter().take_while(|line| **line != "```").copied().collect();
                at += body.len() + 2;
                (Some(named), body)
            }
            None => {
                let body: Vec<&str> = lines[at..].iter().map_while(|line| line.strip_prefix("    ")).collect();
                at += body.len().max(1);
                (None, body)
            }
        };
        if !body.is_empty() {
            let language = language(named, body[0]);
            found.push(Block { page: page.to_owned(), line: begin + 1, language, text: body.join("\n") });
        }
    }
    found
}

fn language(named: Option<&str>, first: &str) -> Language {
    match (named, first.split([' ', '(']).find(|word| !word.is_empty()).unwrap_or_default()) {
        (Some("bash" | "sh" | "shell"), _) => Language::Shell,
        (Some("yaml"), _) => Language::Yaml,
        (Some("python"), _) | (None, "import") => Language::Python,
        (None, "skiagraph" | "cargo" | "cd" | "for" | "set") => Language::Shell,
        _ => Language::Other,
    }
}

/// The `run` steps of a workflow.
fn steps(yaml: &str) -> String {
    let (mut script, mut inside) = (String::new(), None);
    for line in yaml.lines() {
        let indent = line.len() - line.trim_start().len();
        if inside.is_some_and(|around| indent > around) {
            script += &format!("{}\n", line.trim_start());
            continue;
        }
        inside = None;
        match line.trim_start().trim_start_matches("- ").strip_prefix("run: ") {
            Some("|") => inside = Some(indent),
            Some(step) => script += &format!("{}\n", step.trim_matches('"')),
            None => {}
        }
    }
    script
}

/// The shell script of a block: cargo commands become built programs, or nothing.
fn script(block: &Block) -> String {
    let text = if block.language == Language::Yaml { steps(&block.text) } else { block.text.clone() };
    let line = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            _ if line.contains(OWN) => String::new(),
            ["cargo", "run", "--release", "--", ..] => line.replacen("cargo run --release --", "skiagraph", 1),
            ["cargo", "run", "--release", "--example", name, ..] => {
                assert!(shipped(&format!("examples/{name}.rs")).is_file(), "{}: no example {name}", block.page);
                String::new()
            }
            ["cargo", ..] => String::new(),
            _ => line.to_owned(),
        }
    };
    text.lines().map(|text| line(text) + "\n").collect()
}

/// `skiagraph` as a shell function: a gate may fail or be inconclusive.
const PRELUDE: &str = "set -eu\nskiagraph() {\n  local code=0; command skiagraph \"$@\" || code=$?\n  case \"$1-$code\" in \
                       gate-1|gate-3) code=0;; esac\n  [ $code = 0 ] || echo \"exit code $code: skiagraph $*\" >&2\n  return \
                       $code\n}\n";

/// A scenario that takes little time: half a second, small images, few particles, no calibration. Missing keys are
/// not added, except the last frame.
fn shrunk(text: &str) -> String {
    let mut scenario: Table = text.parse().unwrap();
    let motion = |motion: &mut Table| {
        motion.remove("loop_to_s");
        motion.remove("frames");
        if !motion.contains_key("path_m") {
            let first = motion.get("first_frame").and_then(Value::as_integer).unwrap_or(1);
            let last = motion.get("last_frame").and_then(Value::as_integer).unwrap_or(i64::MAX);
            motion.insert("last_frame".to_owned(), Value::Integer(last.min(first + 16)));
        }
    };
    if let Some(Value::Table(table)) = scenario.get_mut("motion") {
        motion(table);
    }
    if let Some(Value::Array(clips)) = scenario.get_mut("training").and_then(|training| training.get_mut("clips")) {
        for clip in clips.iter_mut().filter_map(Value::as_table_mut) {
            let first = clip.get("first_frame").and_then(Value::as_integer).unwrap_or(1);
            clip.insert("last_frame".to_owned(), Value::Integer(first + 99));
        }
    }
    for rig in scenario.get_mut("rig").and_then(Value::as_table_mut).into_iter().flat_map(|rigs| rigs.iter_mut()) {
        if let Some(table) = rig.1.as_table_mut().filter(|table| table.contains_key("size_px")) {
            table.insert("size_px".to_owned(), Value::Array(vec![Value::Integer(96), Value::Integer(72)]));
        }
    }
    let few = |tracker: &mut Table| {
        for (name, settings) in tracker.iter_mut().filter_map(|(name, value)| Some((name, value.as_table_mut()?))) {
            if ["annealed_particle_filter", "gpdm", "switching_gpdm", "gpdm_graph"].contains(&name.as_str()) {
                settings.insert("particles".to_owned(), Value::Integer(10));
                settings.insert("layers".to_owned(), Value::Integer(2));
            }
        }
    };
    if let Some(Value::Table(table)) = scenario.get_mut("tracker") {
        few(table);
    }
    if let Some(body) = scenario.get_mut("tracker_body").and_then(Value::as_table_mut) {
        body.insert("calibrate".to_owned(), Value::Boolean(false));
    }
    let methods = scenario.get_mut("methods").and_then(Value::as_table_mut);
    methods.into_iter().flat_map(|methods| methods.iter_mut()).for_each(|(_, method)| {
        method.as_table_mut().map(few);
    });
    toml::to_string(&scenario).unwrap()
}

/// A sweep over clips, which have few frames in small images.
fn shrunk_sweep(text: &str) -> String {
    let mut sweep: Table = text.parse().unwrap();
    let short = |sets: &mut Vec<Value>| {
        let is_long = |set: &str| set.starts_with("motion.loop_to_s") || set.starts_with("motion.frames_per_second");
        sets.retain(|set| !is_long(set.as_str().unwrap()));
        let first = sets.iter().find_map(|set| set.as_str()?.strip_prefix("motion.first_frame=")?.parse::<i64>().ok());
        for set in sets.iter_mut().filter(|set| set.as_str().unwrap().starts_with("motion.last_frame=")) {
            *set = Value::String(format!("motion.last_frame={}", first.unwrap_or(1) + 11));
        }
        for set in sets.iter_mut().filter(|set| set.as_str().unwrap().starts_with("rig.ring.size_px=")) {
            *set = Value::String("rig.ring.size_px=[96, 72]".to_owned());
        }
    };
    let clips = sweep["axes"]["clip"].as_array_mut().unwrap();
    clips.iter_mut().filter_map(|clip| clip["set"].as_array_mut()).for_each(short);
    sweep.get_mut("set").and_then(Value::as_array_mut).into_iter().for_each(short);
    toml::to_string(&sweep).unwrap()
}

/// Copies a folder; scenarios and sweeps over named clips are shrunk.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let (path, target) = (entry.as_ref().unwrap().path(), to.join(entry.unwrap().file_name()));
        if path.is_dir() {
            copy(&path, &target);
        } else if path.extension().is_some_and(|ending| ending == "toml") {
            let text = fs::read_to_string(&path).unwrap();
            let shorter = if text.contains("\"skiagraph.scenario/1\"") {
                shrunk(&text)
            } else if text.contains("\nnamed = true\n") {
                shrunk_sweep(&text)
            } else {
                text
            };
            fs::write(&target, shorter).unwrap();
        } else {
            fs::copy(&path, &target).unwrap();
        }
    }
}

fn pages() -> Vec<(String, String)> {
    let mut paths: Vec<PathBuf> = fs::read_dir(shipped("docs")).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "md"));
    paths.sort();
    paths.insert(0, shipped("README.md"));
    let name = |path: &Path| path.strip_prefix(shipped("")).unwrap().display().to_string();
    paths.into_iter().map(|path| (name(&path), fs::read_to_string(&path).unwrap())).collect()
}

/// Runs the blocks of a page; returns descriptions of failures.
fn type_page(blocks: &[Block], programs: &Path) -> Vec<String> {
    let room = Sandbox::new();
    FOLDERS.iter().for_each(|folder| copy(&shipped(folder), &room.path(folder)));
    let path = std::env::join_paths(
        [programs.to_owned()].into_iter().chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())),
    );
    let path = path.unwrap();
    let mut failed = Vec::new();
    for block in blocks {
        let mut command = match block.language {
            Language::Other => continue,
            // a snippet continues the previous one
            Language::Python if !block.text.contains("savez") => continue,
            Language::Python => {
                let mut python = Command::new(programs.join("python3"));
                python.args(["-c", &block.text]);
                python
            }
            Language::Shell | Language::Yaml => {
                let mut bash = Command::new("bash");
                bash.arg("-c").arg(PRELUDE.to_owned() + &script(block));
                bash
            }
        };
        let command = command.current_dir(room.path(".")).env("PATH", &path).env_remove("SKIAGRAPH_MOCAP");
        let output = command.env("GITHUB_STEP_SUMMARY", room.path("summary.md")).output().unwrap();
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            failed.push(format!("{}:{}: {}\n{said}", block.page, block.line, block.text));
        }
    }
    failed
}

#[cfg(unix)]
#[test]
fn documented_commands_run_as_typed() {
    let Some(python) = python_with_numpy() else { return };
    let has_bubblewrap = Command::new("bwrap").args(["--unshare-all", "--ro-bind", "/", "/", "true"]).output();
    if !has_bubblewrap.is_ok_and(|output| output.status.success()) {
        return skip(
            "no bubblewrap that can make namespaces (apt-get install bubblewrap), which docs/protocol.md uses",
        );
    }
    let programs = tempfile::tempdir().unwrap();
    let python = Command::new(python).args(["-c", "import sys; print(sys.executable)"]).output().unwrap();
    let python = String::from_utf8(python.stdout).unwrap();
    // a link would leave a virtual environment
    let wrapper = format!("#!/bin/sh\nexec '{}' \"$@\"\n", python.trim());
    fs::write(programs.path().join("python3"), wrapper).unwrap();
    let executable = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    fs::set_permissions(programs.path().join("python3"), executable).unwrap();
    std::os::unix::fs::symlink(PROGRAM, programs.path().join("skiagraph")).unwrap();
    let pages: Vec<Vec<Block>> = pages().iter().map(|(page, text)| blocks(page, text)).collect();
    let typed = pages.iter().flatten().filter(|block| block.language != Language::Other);
    let commands = typed.flat_map(|block| block.text.lines()).filter(|line| line.contains("skiagraph ")).count();
    assert!(commands > 50, "only {commands} commands were found");
    let failed: Vec<String> = std::thread::scope(|scope| {
        let begun: Vec<_> = pages.iter().map(|page| scope.spawn(|| type_page(page, programs.path()))).collect();
        begun.into_iter().flat_map(|page| page.join().unwrap()).collect()
    });
    assert!(failed.is_empty(), "{} blocks fail as typed:\n{}", failed.len(), failed.join("\n"));
}

/// And few need other files.
#[test]
fn documented_commands_are_tested() {
    let mut own = 0;
    for (page, text) in pages() {
        for block in blocks(&page, &text) {
            let is_typed = block.language != Language::Other;
            let commands = block.text.lines().filter(|line| line.trim_start().starts_with("skiagraph "));
            assert!(is_typed || commands.count() == 0, "{page}:{}: {}", block.line, block.text);
            own += block.text.lines().filter(|line| line.contains(OWN)).count();
        }
    }
    assert!(own <= MOST_OWN, "{own} lines need what does not ship");
}
