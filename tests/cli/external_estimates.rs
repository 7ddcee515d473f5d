//! Estimates of other programs are matched by name, measured where they have values, and never changed.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use skiagraph_core::npz::{Array, Npz, Values};

use crate::sandbox::{PROGRAM, Sandbox, TINY};

const NAN: f64 = f64::NAN;

/// A sandbox with a set of 5 frames, or of `frames`.
fn room(last_frame: usize) -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY.replace("last_frame = 3", &format!("last_frame = {last_frame}")));
    room.succeed("render tiny.toml --quiet --out set");
    room
}

fn numbers(npz: &Npz, name: &str) -> (Vec<usize>, Vec<f64>) {
    match npz.get(name) {
        Some(Array { shape, values: Values::F64(values) }) => (shape.clone(), values.clone()),
        other => panic!("{name}: {other:?}"),
    }
}

/// Poses of the set's body that are off by 10 mm along x and a little in every angle: arrays `estimate_root`,
/// `estimate_angles`.
fn poses(room: &Sandbox) -> [(Vec<usize>, Vec<f64>); 2] {
    let npz = Npz::from_bytes("truth.npz", &room.read("set/truth/truth.npz")).unwrap();
    let ((roots, mut root), (angles, mut angle)) = (numbers(&npz, "refitted_root"), numbers(&npz, "refitted_angles"));
    root.iter_mut().step_by(7).for_each(|x| *x += 0.01);
    angle.iter_mut().enumerate().for_each(|(i, angle)| *angle += 0.001 * (i % 7) as f64);
    [([&[1], &roots[..]].concat(), root), ([&[1], &angles[..]].concat(), angle)]
}

/// An `.npz` with `fps`, `seeds` and these arrays.
fn estimate(arrays: Vec<(&str, Array)>) -> Vec<u8> {
    let mut npz = Npz::from_iter([
        ("fps", Array::new(&[], vec![60_i64])),
        ("seeds", Array::new(&[1], vec![5_i64])),
        ("their_own", Array::new(&[2], vec![1.0, 2.0])),
    ]);
    arrays.into_iter().for_each(|(name, array)| npz.push(name, array));
    npz.to_bytes("theirs.npz").unwrap()
}

fn of_poses([root, angles]: [(Vec<usize>, Vec<f64>); 2]) -> Vec<u8> {
    estimate(vec![("estimate_root", Array::new(&root.0, root.1)), ("estimate_angles", Array::new(&angles.0, angles.1))])
}

/// Every file below a folder, with its bytes.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    files.map(|file| (file.file_name().into_string().unwrap(), fs::read(file.path()).unwrap())).collect()
}

/// Of markers with frames of NaN.
#[test]
fn errors_equal_those_of_numpy() {
    let Some(python) = crate::support::python_with_numpy() else { return };
    let room = room(30);
    fs::create_dir(room.path("out")).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop/score_estimate.py");
    let answer =
        Command::new(python).arg(script).args([room.path("set"), room.path("out")]).arg(PROGRAM).output().unwrap();
    assert!(answer.status.success(), "{}", String::from_utf8_lossy(&answer.stderr));
    let html = room.text("out/estimate.npz-evaluation/report.html");
    assert!(html.contains("Metrics that could not be measured") && html.contains("Coverage, %"));
    let table = room.succeed("evaluate set out/estimate.npz").stdout;
    for words in ["coverage", "Frames without an estimate", "no silhouette_iou: needs poses of the tracker's body"] {
        assert!(table.contains(words), "{words}: {table}");
    }
}

#[test]
fn measured_estimates_stay_unchanged() {
    let room = room(3);
    fs::create_dir(room.path("theirs")).unwrap();
    room.write("theirs/poses.npz", of_poses(poses(&room)));
    room.write("theirs/run.json", "their own notes");
    let before = contents(&room.path("theirs"));
    room.says("evaluate set theirs", &["report: theirs-evaluation/report.html"]);
    room.succeed("evaluate set theirs");
    assert_eq!(contents(&room.path("theirs")), before);
    assert_eq!(room.entries(), ["set", "theirs", "theirs-evaluation", "tiny.toml"]);
    let record = room.json("theirs-evaluation/run.json");
    assert_eq!(record["tracker"], "external");
    let evaluation = "theirs-evaluation";
    assert!(room.mean(evaluation, "humaneva_mm") > 5.0 && room.mean(evaluation, "coverage") > 0.9);
    room.write("theirs-evaluation/run.json", "changed");
    room.refused("evaluate set theirs", "theirs-evaluation: this exists");
    room.succeed("evaluate set theirs --out elsewhere");
    assert_eq!(room.json("elsewhere/run.json"), record);
    assert_eq!(room.ask("evaluate set theirs --force --out .").code, 2);
    for out in ["theirs", "set"] {
        room.refused(&format!("evaluate set theirs --force --out {out}"), ", which the command reads; write elsewhere");
    }
    assert_eq!(contents(&room.path("theirs")), before);
}

#[test]
fn lost_frames_are_left_out() {
    let room = room(30);
    let whole = poses(&room);
    let frames = whole[0].0[1];
    let degrees = whole[1].0[2];
    room.write("whole.npz", of_poses(whole.clone()));
    let [mut root, mut angles] = whole;
    for frame in [9, 30] {
        root.1[7 * frame..7 * (frame + 1)].fill(NAN);
        angles.1[degrees * frame..degrees * (frame + 1)].fill(NAN);
    }
    room.write("gaps.npz", of_poses([root, angles]));
    room.succeed("evaluate set whole.npz");
    room.succeed("evaluate set gaps.npz");
    let [whole, gaps] =
        ["whole.npz-evaluation", "gaps.npz-evaluation"].map(|folder| room.json(&format!("{folder}/run.json")));
    let verdict = gaps["verdict"]["line"].as_str().unwrap();
    assert!(verdict.contains("Frames without an estimate 3.4 %"), "{verdict}");
    let lost = room.mean("gaps.npz-evaluation", "lost_frames");
    assert!((lost - 2.0 / (frames - 1) as f64).abs() < 1e-12);
    let [all, covered] = ["whole", "gaps"].map(|file| room.mean(&format!("{file}.npz-evaluation"), "coverage"));
    assert!((covered - all * (1.0 - lost)).abs() < 1e-12);
    for metric in
        whole["metrics"].as_object().unwrap().keys().filter(|name| *name != "lag_ms" && *name != "lag_corrected_mm")
    {
        assert!(gaps["metrics"].get(metric).is_some(), "{metric} is lost with two frames: {}", gaps["absent"]);
        if metric.starts_with("truth_") {
            assert_eq!(gaps["metrics"][metric]["mean"], whole["metrics"][metric]["mean"], "{metric}");
        }
    }
    // per frame: values equal those without gaps, and values that depend on a gap are missing
    let rows = |folder: &str| -> Vec<BTreeMap<String, String>> {
        let bytes = room.read(&format!("{folder}/per_frame.csv"));
        csv::Reader::from_reader(bytes.as_slice()).deserialize().map(Result::unwrap).collect()
    };
    let (whole, gaps) = (rows("whole.npz-evaluation"), rows("gaps.npz-evaluation"));
    let voided = |metric: &str| -> Vec<usize> {
        (0..frames).filter(|f| gaps[*f][metric].is_empty() && !whole[*f][metric].is_empty()).collect()
    };
    for metric in
        ["humaneva_mm", "body_orientation_deg", "silhouette_iou", "ground_penetration_mm", "self_penetration_mm"]
    {
        assert_eq!(voided(metric), [9, 30], "{metric}");
        let same = |f: &usize| gaps[*f][metric].is_empty() || gaps[*f][metric] == whole[*f][metric];
        assert!((0..frames).all(|f| same(&f)), "{metric}");
    }
    assert_eq!(voided("velocity_error_mm_per_s"), [9, 10, 30, 31]);
    assert_eq!(voided("acceleration_error_m_per_s2"), [9, 10, 11, 30, 31, 32]);
}

/// And other files stay.
#[test]
fn own_runs_are_evaluated_in_place() {
    let room = room(3);
    room.succeed("track set --tracker frozen --quiet --out run");
    room.write("run/notes.txt", "what I saw");
    room.succeed("evaluate set run");
    room.succeed("evaluate set run");
    assert_eq!(room.read("run/notes.txt"), b"what I saw");
    assert_eq!(room.json("run/run.json")["tracker"], "frozen");
    // notes.txt would be lost
    room.refused("run tiny.toml --out run", "");
    fs::remove_file(room.path("run/notes.txt")).unwrap();
    room.write("run/report.html", "my own report");
    room.refused("evaluate set run", "run/report.html: this exists");
    fs::remove_file(room.path("run/report.html")).unwrap();
    room.succeed("evaluate set run");
    room.refused("run tiny.toml --out run", "command: was skiagraph track, now skiagraph run");
    room.succeed("run tiny.toml --quiet --force --out run");
    assert_eq!(room.entries(), ["run", "run~", "set", "tiny.toml"]);
}

/// In a run of this program.
#[test]
fn foreign_poses_stay_foreign() {
    let room = room(3);
    room.succeed("track set --tracker frozen --quiet --out run");
    room.write("run/poses.npz", of_poses(poses(&room)));
    let before = contents(&room.path("run"));
    let said = room.succeed("evaluate set run");
    assert_eq!(contents(&room.path("run")), before);
    assert_eq!(room.json("run-evaluation/run.json")["tracker"], "external");
    assert!(said.stderr.contains("run/poses.npz was changed after the run"), "{}", said.stderr);
    room.refused("track set --tracker frozen --out run", "");
}

#[test]
fn undeclared_degrees_are_refused() {
    let room = room(3);
    let [root, (shape, angles)] = poses(&room);
    room.write("right.npz", of_poses([root.clone(), (shape.clone(), angles.clone())]));
    room.succeed("evaluate set right.npz");
    let degrees = angles.iter().map(|angle| angle.to_degrees()).collect();
    room.write("degrees.npz", of_poses([root, (shape, degrees)]));
    let said = room.refused("evaluate set --poses degrees.npz", "joint angles exceed a whole turn");
    assert!(said.contains("--angles deg"), "{said}");
    room.succeed("evaluate set --poses degrees.npz --angles deg");
    let error = |folder: &str| room.mean(folder, "humaneva_mm");
    let apart = (error("right.npz-evaluation") - error("degrees.npz-evaluation")).abs();
    assert!(apart < 1e-6, "{apart}");
    room.succeed("evaluate set --poses degrees.npz --angles rad --out as-said");
}
