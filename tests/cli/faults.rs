//! `skiagraph faults` on an example for external trackers, and on bad input.

use serde_json::Value;

use crate::sandbox::{Sandbox, shipped};
use crate::support::python_with_numpy;

fn room() -> Sandbox {
    let room = Sandbox::tiny();
    room.succeed("render tiny.toml observation.keypoints.layout=halpe26 --out set");
    room
}

/// It is silent about millimetres and declares frames without detections lost.
#[test]
fn program_notices_some_faults() {
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

    let page = room.text("faults.md");
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

/// Answers with a place that it draws anew in every run, whatever the seed.
#[cfg(unix)]
const NOISE: &str = r#"
read -r hello
echo '{"type":"ready","name":"noise"}'
while read -r told; do
    case $told in *'"type":"end"'*) exit;; esac
    frame=${told#*'"frame":'}; frame=${frame%%,*}; drawn=$(od -An -N2 -tu2 /dev/urandom)
    echo "{\"type\":\"pose\",\"frame\":$frame,\"markers\":{\"pelvis\":[0,0,1.$((drawn))]}}"
done
"#;

#[cfg(unix)]
#[test]
fn noise_hides_a_change() {
    let room = room();
    room.write("noise.sh", NOISE);
    let program = format!("sh {}", room.path("noise.sh").display());
    let report = room.ask(&format!("faults set --exec '{program}' --only y-up --json")).json();
    assert!(report["noise_mm"].as_f64().unwrap() > 1.0, "{report}");
    assert_eq!(report["faults"][0]["verdict"], "undecided", "{report}");
}
