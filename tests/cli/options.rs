//! Options of all commands: short keys, verbosity, completions, manual pages; and the default output of `run`.

use std::fs;

use crate::sandbox::{Sandbox, TINY};

fn particles(room: &Sandbox, run: &str) -> Option<u64> {
    let record: serde_json::Value = serde_json::from_slice(&room.read(&format!("{run}/track.json"))).unwrap();
    record["tracker"]["annealed_particle_filter"]["particles"].as_u64()
}

#[test]
fn run_and_track_accept_short_and_full_keys() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    let keys = ["particles", "annealed_particle_filter.particles", "tracker.annealed_particle_filter.particles"];
    for (key, number) in keys.into_iter().zip(7..) {
        room.succeed(&format!("run tiny.toml {key}={number} --out run"));
        room.succeed(&format!("track set --tracker annealed_particle_filter layers=2 {key}={number} --out track"));
        assert_eq!((particles(&room, "run"), particles(&room, "track")), (Some(number), Some(number)));
        ["run", "track"].iter().for_each(|run| fs::remove_dir_all(room.path(run)).unwrap());
    }
    for (arguments, words) in [
        (
            vec!["run", "tiny.toml", "robot=actor"],
            "`robot` is ambiguous: actor.robot or tracker_body.robot; write the full key",
        ),
        (
            vec!["run", "tiny.toml", "partciles=3"],
            "override partciles=3: there is no key `partciles`, did you mean `particles`?",
        ),
        (
            vec!["track", "set", "--tracker", "frozen", "tracker.annealed_particle_filter.particles=3", "--out", "x"],
            "the tracker is `frozen`",
        ),
    ] {
        let refused = room.skiagraph(&arguments);
        assert!(refused.code == 2 && refused.stderr.contains(words), "{arguments:?}: {}", refused.stderr);
    }
}

#[test]
fn a_run_replaces_the_same_settings_and_else_takes_the_next_free_name() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let notes = |arguments: &str| room.succeed(arguments).stderr;
    let runs = || {
        let mut names: Vec<String> =
            fs::read_dir(room.path("runs")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    assert!(!notes("run tiny.toml").contains("runs/tiny"));
    assert!(!notes("run tiny.toml").contains("runs/tiny"), "the same settings replace");
    assert_eq!(runs(), ["tiny"]);
    let said = notes("run tiny.toml particles=13");
    assert!(said.contains("written to runs/tiny-2"), "{said}");
    notes("run tiny.toml particles=13");
    assert_eq!(runs(), ["tiny", "tiny-2"]);
    assert_eq!([particles(&room, "runs/tiny"), particles(&room, "runs/tiny-2")], [Some(12), Some(13)]);
    let refused = room.skiagraph(["run", "tiny.toml", "particles=14", "--out", "runs/tiny"]);
    assert!(refused.code == 2 && refused.stderr.contains("particles: was 12, now 14"), "{}", refused.stderr);
    assert_eq!((particles(&room, "runs/tiny"), runs().len()), (Some(12), 2));
}

#[test]
fn quiet_prints_less_and_verbose_prints_more_for_every_command() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
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
    assert_eq!(room.skiagraph(["check", "tiny.toml", "-q", "-v"]).code, 2);
}

#[test]
fn shells_complete_every_command_and_manual_pages_are_written_and_replaced() {
    let room = Sandbox::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = room.succeed(&format!("completions {shell}")).stdout;
        for word in ["skiagraph", "inspect", "mocap-dir"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    assert!(room.succeed("man").stdout.contains(".TH skiagraph 1"));
    room.succeed("man --out pages/man1");
    room.succeed("man --out pages/man1");
    let page = String::from_utf8(room.read("pages/man1/skiagraph-run.1")).unwrap();
    assert!(page.contains("Render, track, evaluate and report in one step"), "{page}");
    room.write("pages/man1/skiagraph-run.1", ".TH mine 1\n");
    let refused = room.skiagraph(["man", "--out", "pages/man1"]);
    assert!(refused.code == 2 && refused.stderr.contains("not an unchanged skiagraph result"), "{}", refused.stderr);
    room.succeed("man --out pages/man1 --force");
    assert_eq!(room.read("pages/man1/skiagraph-run.1~"), b".TH mine 1\n");
}
