//! The description of a set's files in docs/sets.md and FORMATS.txt.

use std::process::Command;

use skiagraph_core::npz::{Array, Npz};

use crate::sandbox::{Sandbox, shipped};
use crate::support::python_with_numpy;

const DOCUMENT: &str = "docs/sets.md";

/// The indented lines after a heading.
fn code_after(document: &str, heading: &str) -> String {
    let after = document.split_once(heading).unwrap_or_else(|| panic!("no {heading}")).1;
    let code = after.lines().skip_while(|line| !line.starts_with("    "));
    let code = code.take_while(|line| line.is_empty() || line.starts_with("    "));
    code.map(|line| format!("{}\n", line.strip_prefix("    ").unwrap_or(line))).collect()
}

#[test]
fn documented_kinematics_give_the_truth() {
    let document = std::fs::read_to_string(shipped(DOCUMENT)).unwrap();
    let code = code_after(&document, "### Forward kinematics");
    assert!(code.contains("def link_frames(body, root, angles)") && code.lines().count() > 20, "{code}");
    let Some(python) = python_with_numpy() else { return };
    let room = Sandbox::tiny();
    let check = "
truth, actor = numpy.load('truth/truth.npz'), json.load(open('truth/actor.json'))
names, refitted = list(truth['marker_names']), truth['refitted_root'][0]
assert numpy.abs(root - refitted).max() < 1e-12 and len(joints) == len(body['joints'])
for frame in range(len(truth['root'])):
    frames = link_frames(actor, truth['root'][frame], truth['angles'][frame])
    places = numpy.array([t for R, t in frames])
    assert numpy.abs(places - truth['link_frames'][frame, :, :3]).max() < 1e-12
    assert numpy.abs(places[1:] - truth['joints'][frame]).max() < 1e-12
    for R, row in zip([R for R, t in frames], truth['link_frames'][frame]):
        assert numpy.abs(R - turn(row[3:])).max() < 1e-12
    for name, marker in actor['markers'].items():
        R, t = frames[marker['link']]
        assert numpy.abs(R @ marker['point'] + t - truth['markers'][frame, names.index(name)]).max() < 1e-12
print(len(truth['root']), 'frames', len(markers), 'markers')
";
    room.write("check.py", format!("{code}{check}"));
    for robot in ["actor", "tracker25"] {
        room.succeed(&format!(
            "render tiny.toml actor.robot={robot} rig.ring.size_px=[32,24] --force --quiet --out set"
        ));
        let formats = room.text("set/FORMATS.txt");
        assert_eq!(code_after(&formats, "Forward kinematics"), code.trim_end().to_owned() + "\n");
        let answer = Command::new(&python).arg("../check.py").current_dir(room.path("set")).output().unwrap();
        let [said, failed] = [&answer.stdout, &answer.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
        assert!(answer.status.success() && said.contains("5 frames 15 markers"), "{said}{failed}");
    }
}

#[test]
fn documents_describe_every_file() {
    let document = std::fs::read_to_string(shipped(DOCUMENT)).unwrap();
    let formats = std::fs::read_to_string(shipped("crates/set/src/format/formats.txt")).unwrap();
    for word in ["id.part", "depth.Z", "forward.u", "influences", "bind", "olling shutter", "start/start.json", "drive"]
    {
        assert!(document.contains(word) && formats.contains(word), "{word}");
    }
    let table = document.split_once("## What `verify` checks").unwrap().1;
    for file in
        ["set.toml", "cameras.json", "start/body.json", "start/spread.npz", "truth/recording.npz", "truth/layers/"]
    {
        assert!(table.lines().any(|line| line.starts_with("| ") && line.contains(&format!("`{file}`"))), "{file}");
    }
}

#[test]
fn impossible_rate_of_truth_is_refused() {
    let room = Sandbox::with_set();
    let file = "set/truth/truth.npz";
    let truth = Npz::from_bytes(file, &room.read(file)).unwrap();
    for rate in [1e300, -60.0, f64::NAN] {
        let forged = truth.iter().map(|(name, array)| match name {
            "fps" => (name, Array::new(&[], vec![rate])),
            _ => (name, array.clone()),
        });
        room.write(file, forged.collect::<Npz>().to_bytes(file).unwrap());
        room.sign("set");
        room.refused("inspect set --contacts", "truth.npz: fps: expected 0.001 to 100000 frames a second");
    }
}
