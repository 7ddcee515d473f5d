//! `skiagraph faults` on an example for external trackers, and on bad input.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY, shipped};
use crate::support::python_with_numpy;

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml observation.keypoints.layout=halpe26 --out set");
    room
}

#[test]
fn a_program_is_silent_about_millimetres_and_declares_frames_without_detections_lost() {
    let Some(python) = python_with_numpy() else { return };
    let room = room();
    let program = format!("{} {}", python.display(), shipped("examples/external/keypoints.py").display());
    let faults = |more: &[&str]| {
        let only = ["millimetres", "lost-detections", "lens-ignored"].into_iter().flat_map(|name| ["--only", name]);
        let fixed = ["faults", "set", "--exec", &program, "--seeds", "1", "--out", "faults.md"].into_iter();
        room.skiagraph(fixed.chain(only).chain(more.iter().copied()))
    };
    let before = room.read("set/observations/keypoints.npz");
    let found = faults(&["--json"]);
    assert_eq!(found.code, 0, "{}", found.stderr);
    let report: Value = serde_json::from_str(&found.stdout).unwrap();
    // in the order of the catalogue
    let verdict = |fault: usize| [&report["faults"][fault]["fault"], &report["faults"][fault]["verdict"]];
    assert_eq!(verdict(0), ["lens-ignored", "not_applicable"], "{report}");
    assert_eq!(verdict(1), ["millimetres", "silent"], "{report}");
    assert_eq!(verdict(2), ["lost-detections", "noticed"], "{report}");
    assert!(report["faults"][1]["change_mm"].as_f64().unwrap() > 1000.0, "{report}");
    assert_eq!(report["faults"][2]["lost"], 1.0, "{report}");
    assert_eq!(room.read("set/observations/keypoints.npz"), before);

    let page = String::from_utf8(room.read("faults.md")).unwrap();
    assert!(page.contains("| `millimetres` | positions of cameras are in millimetres | SILENT |"), "{page}");
    assert!(page.contains("more frames declared lost") && page.contains("no camera has lens coefficients"), "{page}");

    // such a page is replaced by the same command, but no other file
    assert_eq!(faults(&[]).code, 0);
    let other = faults(&["--only", "y-up"]);
    assert!(other.code == 2 && other.stderr.contains("the faults are others"), "{}", other.stderr);
    room.write("faults.md", format!("{page}my notes"));
    let edited = faults(&[]);
    assert!(edited.code == 2 && edited.stderr.contains("the table was edited"), "{}", edited.stderr);
    room.write("faults.md", "mine");
    let refused = faults(&[]);
    assert!(refused.code == 2 && refused.stderr.contains("faults.md"), "{}", refused.stderr);
    assert_eq!(room.read("faults.md"), b"mine");
    assert_eq!(room.entries(), ["faults.md", "set", "tiny.toml"]);
}

#[test]
fn what_cannot_be_planted_is_refused_with_what_to_do() {
    let room = room();
    room.succeed("render tiny.toml observation.colour_images=png --out seen");
    for (command, words) in [
        ("faults set --tracker keypoints --only late-camra", "did you mean `late-camera`?"),
        ("faults set --tracker oracle", "given the truth"),
        ("faults set --tracker keypoint", "keypoints"),
        ("faults set", "--tracker"),
        ("faults tiny.toml --tracker keypoints", "tiny.toml"),
        ("faults nowhere --tracker keypoints", "nowhere"),
        ("faults set --exec false --only y-up", "exit"),
        ("faults seen --exec false", "it has images, which no fault changes"),
    ] {
        let refused = room.skiagraph(command.split(' '));
        assert!(refused.code == 2 && refused.stderr.contains(words), "{command}: {}", refused.stderr);
    }
    assert_eq!(room.succeed("faults --list").stdout.lines().count(), 24);
}
