//! Options of all commands: verbosity, completions.

use crate::sandbox::{Sandbox, assert_contains};

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
    assert_contains(&loud, &["note: rendering: 5 frames in ", "note: wrote set/observations, "]);
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
        room.says(&format!("completions {shell}"), &["skiagraph", "inspect", "mocap-dir"]);
    }
}
