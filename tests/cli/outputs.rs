//! Results are never lost: to a second process, to an interruption, to a kill, to another kind of run, or to a mistaken
//! `--out`.

use crate::sandbox::{Sandbox, TINY};

/// A walk that takes long to render and to write, even on a fast machine.
#[cfg(unix)]
const LONG: [&str; 3] = ["motion.loop_to_s=40", "rig.ring.count=8", "tracker.frozen={}"];

#[test]
fn inputs_are_never_replaced() {
    let room = Sandbox::new();
    std::fs::create_dir(room.path("mine")).unwrap();
    room.write("mine/tiny.toml", TINY);
    let bvh = std::fs::read(crate::sandbox::shipped("scenarios/motions/01_01.bvh")).unwrap();
    room.write("jump.bvh", &bvh);
    room.succeed("render mine/tiny.toml --out set -q");
    room.succeed("train embedded:walk --model gpdm --out walk.model -q");
    let model = room.read("walk.model");
    std::fs::hard_link(room.path("walk.model"), room.path("hard.model")).unwrap();
    let before = room.entries();
    for arguments in [
        "render mine/tiny.toml --out mine/tiny.toml",
        "render mine/tiny.toml --out mine",
        "run mine/tiny.toml --out mine",
        "run mine/tiny.toml motion.clip=../jump.bvh --out jump.bvh",
        "track set --tracker frozen --out set",
        "track set --tracker frozen --out set/runs/frozen",
        "train jump.bvh --model gpdm --last-frame 60 --out jump.bvh",
        "inspect walk.model --out walk.model",
        "inspect walk.model --out hard.model",
        "inspect set --contacts --out set/chart.svg",
    ] {
        for force in [None, Some("--force")] {
            let answer = room.skiagraph(arguments.split(' ').chain(force));
            assert_eq!(answer.code, 2, "{arguments}: {}", answer.stderr);
            assert!(answer.stderr.contains("which the command reads"), "{arguments}: {}", answer.stderr);
        }
    }
    assert_eq!(room.entries(), before);
    assert!(room.read("mine/tiny.toml") == TINY.as_bytes() && room.read("jump.bvh") == bvh);
    assert!(room.read("walk.model") == model);
    room.succeed("inspect set");
}

#[test]
fn foreign_files_are_refused_and_with_force_renamed() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("train embedded:walk --model gpdm --out walk.model -q");
    for (name, arguments) in [
        ("thesis.html", "inspect walk.model --out thesis.html"),
        ("chart.svg", "inspect embedded:walk --contacts --out chart.svg"),
        ("mine.model", "train embedded:walk --model gpdm -q --out mine.model"),
        ("other.model.partial", "train embedded:walk --model gpdm -q --out other.model"),
    ] {
        room.write(name, "<html>years of work");
        let refused = room.skiagraph(arguments.split(' '));
        assert!(
            refused.code == 2 && refused.stderr.contains("not an unchanged skiagraph result"),
            "{arguments}: {}",
            refused.stderr
        );
        assert_eq!(room.read(name), b"<html>years of work");
        room.succeed(&format!("{arguments} --force"));
        assert_eq!(room.read(&format!("{name}~")), b"<html>years of work");
    }
    // own output is replaced without --force
    room.succeed("inspect walk.model --out thesis.html");
    room.succeed("inspect embedded:walk --contacts --out chart.svg");
    // a folder with foreign estimates is not a skiagraph run
    std::fs::create_dir(room.path("estimates")).unwrap();
    room.write("estimates/poses.npz", "years of work");
    let refused = room.skiagraph(["run", "tiny.toml", "--out", "estimates"]);
    assert!(refused.code == 2 && refused.stderr.contains("not an unchanged skiagraph result"), "{}", refused.stderr);
    assert_eq!(room.read("estimates/poses.npz"), b"years of work");
}

#[test]
fn runs_of_one_and_of_several_methods_replace_each_other_with_force() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let (before, _) = TINY.split_once("[tracker.").unwrap();
    room.write("methods.toml", format!("{before}[methods.floor.frozen]\n[methods.truth.oracle]\n"));
    for (scenario, force) in
        [("tiny.toml", ""), ("methods.toml", " --force"), ("methods.toml", ""), ("tiny.toml", " --force")]
    {
        if !force.is_empty() {
            let refused = room.skiagraph(["run", scenario, "--out", "run"]);
            assert!(refused.code == 2 && refused.stderr.contains("made with other settings"), "{}", refused.stderr);
        }
        room.succeed(&format!("run {scenario} --out run -q{force}"));
        assert_eq!(room.path("run/comparison.json").exists(), scenario == "methods.toml");
        assert_eq!(room.path("run/run.json").exists(), scenario == "tiny.toml");
        if !force.is_empty() {
            std::fs::remove_dir_all(room.path("run~")).unwrap();
        }
    }
    assert_eq!(room.entries(), ["methods.toml", "run", "tiny.toml"]);
    // a set is not a run
    room.succeed("render tiny.toml --out set -q");
    assert_eq!(room.skiagraph(["run", "tiny.toml", "--out", "set"]).code, 2);
}

#[cfg(unix)]
mod signals {
    use std::path::Path;
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant};

    use super::LONG;
    use crate::sandbox::{Sandbox, TINY};

    /// Maximum time of a command to end after Ctrl-C.
    const A_SECOND: Duration = Duration::from_secs(1);

    fn start<'a>(room: &Sandbox, arguments: impl IntoIterator<Item = &'a str>) -> Child {
        Command::new(assert_cmd::cargo::cargo_bin!("skiagraph"))
            .args(arguments)
            .current_dir(room.path("."))
            .env_remove("SKIAGRAPH_MOCAP")
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    fn send(signal: &str, child: &Child) {
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    }

    /// Waits until `ready`, which must come before the process ends.
    fn wait_until(child: &mut Child, ready: impl Fn() -> bool) {
        while !ready() {
            assert!(child.try_wait().unwrap().is_none(), "it was too fast");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn said(mut child: Child) -> String {
        let mut text = String::new();
        std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut text).unwrap();
        text
    }

    fn below(room: &Sandbox, prefix: &str, inside: &str) -> bool {
        let there = |name: &String| inside.is_empty() || room.path(name).join(inside).exists();
        room.entries().iter().any(|name| name.starts_with(prefix) && there(name))
    }

    #[test]
    fn ctrl_c_ends_every_command_within_a_second_and_leaves_nothing() {
        let room = Sandbox::new();
        room.write("tiny.toml", TINY);
        let render = [&["render", "tiny.toml", "motion.last_frame=39"], &LONG[..], &["--out", "set"]].concat();
        let big = ["rig.ring.size_px=[1920,1080]", "rig.ring.count=8"];
        let large_render = [&["render", "tiny.toml", "layers=[\"depth\"]"], &big[..], &["--out", "set"]].concat();
        let run = vec!["run", "tiny.toml", "particles=200000", "--out", "run"];
        let train = vec!["train", "embedded:walk", "--model", "gpdm", "--fps", "1000", "--out", "a.model"];
        let fixed = [&["run", "tiny.toml", "motion.last_frame=39", "actor.contact=simulate"], &LONG[..]].concat();
        // the file that shows a command's progress, and the time until it is interrupted
        for (arguments, begun, inside, millis) in [
            (render, "set.partial", "", 1500),
            (large_render, "set.partial", "", 500),
            (run, ".run.partial", "", 1500),
            (fixed, "runs", "", 1500),
            (train, "a.model.partial", "", 500),
        ] {
            let mut child = start(&room, arguments.iter().copied());
            wait_until(&mut child, || below(&room, begun, inside));
            std::thread::sleep(Duration::from_millis(millis));
            assert!(child.try_wait().unwrap().is_none(), "{arguments:?} was too fast");
            let begin = Instant::now();
            send("-INT", &child);
            let code = child.wait().unwrap().code();
            let took = begin.elapsed();
            let said = said(child);
            assert_eq!(code, Some(130), "{arguments:?}: {said}");
            assert!(took < A_SECOND, "{arguments:?} took {took:?}");
            if said.contains("error: interrupted; progress is saved in set.partial: run the same command to resume") {
                assert_eq!(room.entries(), ["set.partial", "tiny.toml"], "{arguments:?}");
                assert!(begun == "set.partial" && room.path("set.partial/set/truth/truth.npz").exists());
                std::fs::remove_dir_all(room.path("set.partial")).unwrap();
                continue;
            }
            assert!(said.contains("error: interrupted; nothing was written"), "{arguments:?}: {said}");
            assert_eq!(room.entries(), ["tiny.toml"], "{arguments:?}");
        }
    }

    #[test]
    fn an_interrupted_inspection_leaves_nothing_and_says_130() {
        let room = Sandbox::new();
        let mut lines: Vec<String> = Vec::new();
        let bvh = std::fs::read_to_string(crate::sandbox::shipped("scenarios/motions/01_01.bvh")).unwrap();
        let (head, frames) = bvh.split_once("Frame Time").unwrap();
        let (rate, rows) = frames.split_once('\n').unwrap();
        let rows: Vec<&str> = rows.lines().filter(|row| !row.trim().is_empty()).collect();
        for _ in 0..40 {
            lines.extend(rows.iter().map(|row| (*row).to_owned()));
        }
        let head = head.replace(&format!("{}", rows.len()), &lines.len().to_string());
        room.write("long.bvh", format!("{head}Frame Time{rate}\n{}\n", lines.join("\n")));
        let mut child = start(&room, ["inspect", "long.bvh", "--contacts", "--out", "long.svg"]);
        wait_until(&mut child, || room.entries().len() > 1);
        send("-INT", &child);
        let begin = Instant::now();
        assert_eq!(child.wait().unwrap().code(), Some(130));
        assert!(begin.elapsed() < A_SECOND, "{:?}", begin.elapsed());
        assert_eq!(room.entries(), ["long.bvh"]);
    }

    #[test]
    fn an_interrupted_training_names_a_file_that_exists() {
        let room = Sandbox::new();
        let arguments = ["train", "embedded:walk", "--model", "gpdm-graph", "--threshold", "1e-9", "--fps", "400"];
        let arguments = [&arguments[..], &["--clip-length", "20", "--out", "a.model"]].concat();
        let mut child = start(&room, arguments);
        // at first the file only tests that the path is writable; then it contains a model
        wait_until(&mut child, || room.path("a.model.partial").metadata().is_ok_and(|found| found.len() > 0));
        let first = std::fs::read(room.path("a.model.partial")).unwrap();
        wait_until(&mut child, || std::fs::read(room.path("a.model.partial")).is_ok_and(|now| now.len() > first.len()));
        send("-INT", &child);
        assert_eq!(child.wait().unwrap().code(), Some(130));
        let said = said(child);
        assert!(said.contains("progress is saved in a.model.partial"), "{said}");
        assert_eq!(room.entries(), ["a.model.partial"]);
    }

    #[test]
    fn leftovers_of_a_killed_process_are_removed_and_the_old_result_is_kept() {
        let room = Sandbox::new();
        room.write("tiny.toml", TINY);
        room.succeed("render tiny.toml --out set -q");
        let old = room.read("set/files.sha256");
        let again =
            [&["render", "tiny.toml", "motion.last_frame=39"], &LONG[..], &["--force", "--out", "set"]].concat();
        let mut child = start(&room, again);
        wait_until(&mut child, || below(&room, "set.partial", "set/observations/cam00"));
        send("-KILL", &child);
        child.wait().unwrap();
        assert_eq!(room.entries().len(), 4, "{:?}", room.entries());
        assert_eq!(room.read("set/files.sha256"), old);
        let other = room.skiagraph(["render", "tiny.toml", "seed=3", "--out", "set"]);
        assert_eq!(other.code, 2, "the set that is there: {}", other.stderr);
        room.succeed("render tiny.toml seed=3 --force --out set -q");
        assert_eq!(room.entries(), ["set", "tiny.toml"]);
        room.succeed("inspect set");
    }

    #[test]
    fn of_two_processes_that_write_to_one_path_one_is_refused() {
        let room = Sandbox::new();
        room.write("tiny.toml", TINY);
        let render = ["render", "tiny.toml", "motion.last_frame=39", "motion.loop_to_s=4", "--out", "set"];
        let mut first = start(&room, render);
        wait_until(&mut first, || below(&room, "set.partial", ""));
        let second = room.skiagraph(["render", "tiny.toml", "--out", "./set"]);
        assert_eq!(second.code, 75, "{}", second.stderr);
        assert!(second.stderr.contains("set: another skiagraph process is writing here"), "{}", second.stderr);
        room.succeed("render tiny.toml --out beside -q");
        assert_eq!(first.wait().unwrap().code(), Some(0));
        assert_eq!(room.entries(), ["beside", "set", "tiny.toml"]);
        assert!(Path::new(&room.path("set/files.sha256")).exists());
    }
}
