//! Options of all commands: short keys, verbosity, completions, manual pages.

use std::fs;

use crate::sandbox::Sandbox;

fn particles(room: &Sandbox, run: &str) -> Option<u64> {
    let record: serde_json::Value = room.json(&format!("{run}/track.json"));
    record["tracker"]["annealed_particle_filter"]["particles"].as_u64()
}

#[test]
fn keys_may_be_short() {
    let room = Sandbox::with_set();
    let keys = ["particles", "annealed_particle_filter.particles", "tracker.annealed_particle_filter.particles"];
    for (key, number) in keys.into_iter().zip(7..) {
        room.succeed(&format!("run tiny.toml {key}={number} --out run"));
        room.succeed(&format!("track set --tracker annealed_particle_filter layers=2 {key}={number} --out track"));
        assert_eq!((particles(&room, "run"), particles(&room, "track")), (Some(number), Some(number)));
        ["run", "track"].iter().for_each(|run| fs::remove_dir_all(room.path(run)).unwrap());
    }
}

#[test]
fn quiet_and_verbose_change_output() {
    let room = Sandbox::tiny();
    let quiet = room.succeed("-q run tiny.toml --out run");
    assert!(quiet.stderr.is_empty() && quiet.stdout.contains("report: run/report.html"), "{}", quiet.stderr);
    let loud = room.succeed("run tiny.toml --out run -v").stderr;
    for expected in ["note: tracking: 10 frames in ", "note: measuring: 5 frames in ", "note: wrote run/run.json, "] {
        assert!(loud.contains(expected), "{expected}: {loud}");
    }
    let loud = room.succeed("render tiny.toml --out set --verbose").stderr;
    assert!(
        loud.contains("note: rendering: 5 frames in ") && loud.contains("note: wrote set/observations, "),
        "{loud}"
    );
    for arguments in
        ["check tiny.toml", "inspect embedded:walk --contacts", "schema", "evaluate set track", "completions bash"]
    {
        if arguments.starts_with("evaluate") {
            room.succeed("track set --tracker frozen --out track -q");
        }
        assert_eq!(room.succeed(&format!("{arguments} --quiet")).stderr, "", "{arguments}");
        room.succeed(&format!("{arguments} -v"));
    }
}

#[test]
fn shells_complete_every_command() {
    let room = Sandbox::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = room.succeed(&format!("completions {shell}")).stdout;
        for word in ["skiagraph", "inspect", "mocap-dir"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    assert!(room.succeed("man").stdout.contains(".TH skiagraph 1"));
    room.succeed("man --out pages");
    let page = room.text("pages/skiagraph-run.1");
    assert!(page.contains("Render, track, evaluate and report in one step"), "{page}");
}
