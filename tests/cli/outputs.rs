//! Results are never lost: to a second process, to an interruption, to a kill, or to another kind of run.

use crate::sandbox::{Sandbox, TINY};

#[test]
fn methods_replace_a_run_with_force() {
    let room = Sandbox::tiny();
    let (before, _) = TINY.split_once("[tracker.").unwrap();
    room.write("methods.toml", format!("{before}[methods.floor.frozen]\n[methods.truth.oracle]\n"));
    for (scenario, force) in
        [("tiny.toml", ""), ("methods.toml", " --force"), ("methods.toml", ""), ("tiny.toml", " --force")]
    {
        if !force.is_empty() {
            room.refused(&format!("run {scenario} --out run"), "made with other settings");
        }
        room.succeed(&format!("run {scenario} --out run -q{force}"));
        assert_eq!(room.path("run/comparison.json").exists(), scenario == "methods.toml");
        assert_eq!(room.path("run/run.json").exists(), scenario == "tiny.toml");
        if !force.is_empty() {
            std::fs::remove_dir_all(room.path("run~")).unwrap();
        }
    }
    assert_eq!(room.entries(), ["methods.toml", "run", "tiny.toml"]);
}

#[cfg(unix)]
mod signals {
    use std::process::Child;
    use std::time::{Duration, Instant};

    use crate::sandbox::{Sandbox, interrupt, shipped, wait_until};

    /// A walk that takes long to render and to write, even on a fast machine.
    const LONG: &str = "tiny.toml motion.last_frame=39 motion.loop_to_s=40 rig.ring.count=8 tracker.frozen={}";
    /// Maximum time of a command to end after Ctrl-C.
    const A_SECOND: Duration = Duration::from_secs(1);

    /// Sends Ctrl-C; returns what the process says until it ends, within a second.
    fn soon_interrupted(child: Child, what: &str) -> String {
        let begin = Instant::now();
        let said = interrupt(child);
        assert!(begin.elapsed() < A_SECOND, "{what} took {:?}", begin.elapsed());
        said
    }

    fn has_begun(room: &Sandbox, prefix: &str) -> bool {
        room.entries().iter().any(|name| name.starts_with(prefix))
    }

    #[test]
    fn interrupted_commands_leave_nothing() {
        let room = Sandbox::tiny();
        let large = "truth_images=[\"depth\"] rig.ring.size_px=[1920,1080] rig.ring.count=8";
        // the file that shows a command's progress, and the time until it is interrupted
        for (command, begun, millis) in [
            (format!("render {LONG} --out set"), "set.partial", 1500),
            (format!("render tiny.toml {large} --out set"), "set.partial", 500),
            ("run tiny.toml particles=200000 --out run".to_owned(), ".run.partial", 1500),
            (format!("run {LONG} actor.contact=simulate"), "runs", 1500),
            ("train embedded:walk --model gpdm --fps 1000 --out a.model".to_owned(), "a.model.partial", 500),
        ] {
            let mut child = room.start(&command);
            wait_until(&mut child, || has_begun(&room, begun));
            std::thread::sleep(Duration::from_millis(millis));
            assert!(child.try_wait().unwrap().is_none(), "{command} was too fast");
            let said = soon_interrupted(child, &command);
            if said.contains("error: interrupted; progress is saved in set.partial: run the same command to resume") {
                assert_eq!(room.entries(), ["set.partial", "tiny.toml"], "{command}");
                assert!(begun == "set.partial" && room.path("set.partial/set/truth/truth.npz").exists());
                std::fs::remove_dir_all(room.path("set.partial")).unwrap();
                continue;
            }
            assert!(said.contains("error: interrupted; nothing was written"), "{command}: {said}");
            assert_eq!(room.entries(), ["tiny.toml"], "{command}");
        }
    }

    #[test]
    fn interrupted_inspection_leaves_nothing() {
        let room = Sandbox::new();
        let bvh = std::fs::read_to_string(shipped("scenarios/motions/01_01.bvh")).unwrap();
        let (head, frames) = bvh.split_once("Frame Time").unwrap();
        let (rate, rows) = frames.split_once('\n').unwrap();
        let count = rows.trim().lines().count();
        let head = head.replace(&count.to_string(), &(40 * count).to_string());
        room.write("long.bvh", format!("{head}Frame Time{rate}\n{}", format!("{}\n", rows.trim()).repeat(40)));
        let mut child = room.start("inspect long.bvh --contacts --out long.svg");
        wait_until(&mut child, || room.entries().len() > 1);
        soon_interrupted(child, "inspect");
        assert_eq!(room.entries(), ["long.bvh"]);
    }

    /// Its message names a file that exists.
    #[test]
    fn interrupted_training_is_saved() {
        let room = Sandbox::new();
        let model = "train embedded:walk --model gpdm-graph --threshold 1e-9 --fps 400 --clip-length 20 --out a.model";
        let mut child = room.start(model);
        // at first the file only tests that the path is writable; then it contains a model
        let length = || room.path("a.model.partial").metadata().map_or(0, |found| found.len());
        wait_until(&mut child, || length() > 0);
        let first = length();
        wait_until(&mut child, || length() > first);
        let said = soon_interrupted(child, model);
        assert!(said.contains("progress is saved in a.model.partial"), "{said}");
        assert_eq!(room.entries(), ["a.model.partial"]);
    }

    /// What it left is removed.
    #[test]
    fn killed_process_keeps_old_result() {
        let room = Sandbox::with_set();
        let old = room.read("set/files.sha256");
        let mut child = room.start(&format!("render {LONG} --force --out set"));
        wait_until(&mut child, || room.path("set.partial/set/observations/cam00").exists());
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(room.entries().len(), 4, "{:?}", room.entries());
        assert_eq!(room.read("set/files.sha256"), old);
        room.refused("render tiny.toml seed=3 --out set", "set");
        room.succeed("render tiny.toml seed=3 --force --out set -q");
        assert_eq!(room.entries(), ["set", "tiny.toml"]);
        room.succeed("inspect set");
    }

    #[test]
    fn second_writer_is_refused() {
        let room = Sandbox::tiny();
        let mut first = room.start("render tiny.toml motion.last_frame=39 motion.loop_to_s=4 --out set");
        wait_until(&mut first, || has_begun(&room, "set.partial"));
        let second = room.ask("render tiny.toml --out ./set");
        assert_eq!(second.code, 75, "{}", second.stderr);
        assert!(second.stderr.contains("set: another skiagraph process is writing here"), "{}", second.stderr);
        room.succeed("render tiny.toml --out beside -q");
        assert_eq!(first.wait().unwrap().code(), Some(0));
        assert_eq!(room.entries(), ["beside", "set", "tiny.toml"]);
        assert!(room.path("set/files.sha256").exists());
    }
}
