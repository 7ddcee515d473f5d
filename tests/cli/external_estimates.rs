//! Estimates of other programs are matched by name, measured where they have values, and never changed.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use skiagraph::benchmark_set::BlindSet;
use skiagraph::npz::{Array, Npz, Values};

use crate::sandbox::{Sandbox, TINY};

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

fn angle_names(room: &Sandbox) -> Vec<String> {
    let body = BlindSet::read(&room.path("set")).unwrap().start.body;
    body.degrees_of_freedom.into_iter().map(|degree| degree.name).collect()
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

fn record(room: &Sandbox, folder: &str) -> Value {
    serde_json::from_slice(&room.read(&format!("{folder}/run.json"))).unwrap()
}

fn mean(record: &Value, metric: &str) -> f64 {
    record["metrics"][metric]["mean"].as_f64().unwrap_or_else(|| panic!("no {metric}"))
}

/// Every file below a folder, with its bytes.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    files.map(|file| (file.file_name().into_string().unwrap(), fs::read(file.path()).unwrap())).collect()
}

#[test]
fn markers_with_frames_of_nan_have_the_errors_computed_with_numpy() {
    let Some(python) = crate::support::python_with_numpy() else { return };
    let room = room(30);
    fs::create_dir(room.path("out")).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop/score_estimate.py");
    let program = assert_cmd::cargo::cargo_bin!("skiagraph");
    let answer =
        Command::new(python).arg(script).args([room.path("set"), room.path("out")]).arg(program).output().unwrap();
    assert!(answer.status.success(), "{}", String::from_utf8_lossy(&answer.stderr));
    let html = String::from_utf8(room.read("out/estimate.npz-evaluation/report.html")).unwrap();
    assert!(html.contains("Metrics that could not be measured") && html.contains("Coverage, %"));
    let table = room.succeed("evaluate set out/estimate.npz").stdout;
    for words in [
        "coverage",
        "Frames without an estimate",
        "no silhouette_iou: needs poses of the tracker's body",
        "frames of all runs have no estimate",
        "no estimate in ",
    ] {
        assert!(table.contains(words), "{words}: {table}");
    }
}

#[test]
fn a_folder_with_foreign_poses_is_not_replaced() {
    let room = room(3);
    let theirs = of_poses(poses(&room));
    for command in ["run tiny.toml --quiet --out theirs", "track set --tracker frozen --quiet --out theirs"] {
        fs::create_dir(room.path("theirs")).unwrap();
        room.write("theirs/poses.npz", &theirs);
        let refused = room.skiagraph(command.split_whitespace());
        assert_eq!(refused.code, 2, "{command}");
        assert!(
            refused.stderr.contains("theirs: this exists and is not an unchanged skiagraph result"),
            "{}",
            refused.stderr
        );
        assert_eq!(contents(&room.path("theirs")), BTreeMap::from([("poses.npz".to_owned(), theirs.clone())]));
        room.succeed(&format!("{command} --force"));
        assert_eq!(room.read("theirs~/poses.npz"), theirs, "{command}");
        fs::remove_dir_all(room.path("theirs")).unwrap();
        fs::remove_dir_all(room.path("theirs~")).unwrap();
    }
}

#[test]
fn an_estimate_is_measured_beside_and_stays_unchanged() {
    let room = room(3);
    fs::create_dir(room.path("theirs")).unwrap();
    room.write("theirs/poses.npz", of_poses(poses(&room)));
    room.write("theirs/run.json", "their own notes");
    let before = contents(&room.path("theirs"));
    let said = room.succeed("evaluate set theirs").stdout;
    assert!(said.contains("report: theirs-evaluation/report.html"), "{said}");
    room.succeed("evaluate set theirs");
    assert_eq!(contents(&room.path("theirs")), before);
    assert_eq!(room.entries(), ["set", "theirs", "theirs-evaluation", "tiny.toml"]);
    let record = record(&room, "theirs-evaluation");
    assert_eq!(record["tracker"], "external");
    assert!(mean(&record, "humaneva_mm") > 5.0 && mean(&record, "coverage") > 0.9);
    room.write("theirs-evaluation/run.json", "changed");
    let refused = room.skiagraph(["evaluate", "set", "theirs"]);
    assert!(refused.code == 2 && refused.stderr.contains("theirs-evaluation: this exists"), "{}", refused.stderr);
    room.succeed("evaluate set theirs --out elsewhere");
    assert_eq!(self::record(&room, "elsewhere"), record);
    assert_eq!(room.skiagraph(["evaluate", "set", "theirs", "--force", "--out", "."]).code, 2);
    for out in ["theirs", "set"] {
        let refused = room.skiagraph(["evaluate", "set", "theirs", "--force", "--out", out]);
        assert!(
            refused.code == 2 && refused.stderr.contains(", which the command reads; choose another --out"),
            "{}",
            refused.stderr
        );
    }
    assert_eq!(contents(&room.path("theirs")), before);
}

#[test]
fn columns_are_matched_by_name() {
    let room = room(3);
    let [root, (shape, angles)] = poses(&room);
    let names = angle_names(&room);
    let order: Vec<usize> = (0..names.len()).map(|i| (7 * i + 3) % names.len()).collect();
    let named = |angles: Vec<f64>, names: &[String]| {
        estimate(vec![
            ("estimate_root", Array::new(&root.0, root.1.clone())),
            ("estimate_angles", Array::new(&shape, angles)),
            ("estimate_angle_names", Array::names(names.iter().map(String::as_str))),
        ])
    };
    let permuted = angles.chunks(names.len()).flat_map(|row| order.iter().map(|i| row[*i])).collect::<Vec<f64>>();
    let permuted_names: Vec<String> = order.iter().map(|i| names[*i].clone()).collect();
    room.write("a.npz", named(angles.clone(), &names));
    room.write("b.npz", named(permuted, &permuted_names));
    room.succeed("evaluate set a.npz");
    room.succeed("evaluate set b.npz");
    let [a, b] = ["a.npz-evaluation", "b.npz-evaluation"].map(|folder| record(&room, folder));
    assert_eq!(a["metrics"], b["metrics"]);
    let mut unknown = names.clone();
    unknown[2] = "tail".to_owned();
    for (names, words) in [
        (unknown, "\"tail\" is not a degree of freedom".to_owned()),
        (names[1..].to_vec(), format!("{:?} is missing", names[0])),
    ] {
        room.write("c.npz", named(angles.clone(), &names));
        let refused = room.skiagraph(["evaluate", "set", "c.npz"]);
        assert!(refused.code == 2 && refused.stderr.contains(&words), "{words}: {}", refused.stderr);
    }
    room.write("d.npz", of_poses([root.clone(), (shape.clone(), angles.clone())]));
    let said = room.succeed("evaluate set d.npz").stderr;
    assert!(said.contains("note: d.npz has no estimate_angle_names"), "{said}");
}

#[test]
fn poses_with_lost_frames_are_measured_in_the_other_frames() {
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
    let [whole, gaps] = ["whole.npz-evaluation", "gaps.npz-evaluation"].map(|folder| record(&room, folder));
    let verdict = gaps["verdict"]["line"].as_str().unwrap();
    assert!(verdict.contains("no estimate in ") && !verdict.contains("whole clip"), "{verdict}");
    assert!((mean(&gaps, "lost_frames") - 2.0 / (frames - 1) as f64).abs() < 1e-12);
    assert!((mean(&gaps, "coverage") - mean(&whole, "coverage") * (1.0 - mean(&gaps, "lost_frames"))).abs() < 1e-12);
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
    assert_eq!(voided("residual_wrench_body_weights").len(), 18, "four frames either way of each at 60 Hz");
}

#[test]
fn joints_alone_are_measured_on_the_markers_that_lie_on_them() {
    let room = room(3);
    let body = BlindSet::read(&room.path("set")).unwrap().start.body;
    let npz = Npz::from_bytes("truth.npz", &room.read("set/truth/truth.npz")).unwrap();
    let (shape, markers) = numbers(&npz, "markers");
    let names = ["right_knee", "left_elbow"];
    let Some(Values::Text(known)) = npz.get("marker_names").map(|array| array.values.clone()) else { panic!() };
    let columns = names.map(|name| known.iter().position(|known| known == name).unwrap());
    let joint =
        |landmark: usize| (0..body.joints.len()).find(|j| body.markers_on_joint(*j).any(|l| l == landmark)).unwrap();
    let joints = columns.map(|landmark| body.joints[joint(landmark)].name.as_str());
    let places = (0..shape[0]).flat_map(|frame| {
        columns.map(|landmark| {
            let at = 3 * (15 * frame + landmark);
            [markers[at] + 0.03, markers[at + 1], markers[at + 2]]
        })
    });
    let places = Array::new(&[1, shape[0], 2, 3], places.flatten().collect::<Vec<f64>>());
    room.write(
        "theirs.npz",
        estimate(vec![("estimate_joints", places), ("estimate_joint_names", Array::names(joints))]),
    );
    let said = room.succeed("evaluate set theirs.npz").stderr;
    assert!(said.contains("gives 2 of the 15 markers"), "{said}");
    let record = record(&room, "theirs.npz-evaluation");
    assert!((mean(&record, "humaneva_mm") - 30.0).abs() < 1e-9);
    assert!((mean(&record, "coverage") - 2.0 / 15.0).abs() < 1e-12);
    assert_eq!(mean(&record, "lost_frames"), 0.0);
    assert_eq!(record["absent"]["mpjpe_root_mm"], "needs the pelvis in truth and estimate");
}

#[test]
fn a_skiagraph_run_is_evaluated_in_place_and_other_files_stay() {
    let room = room(3);
    room.succeed("track set --tracker frozen --quiet --out run");
    room.write("run/notes.txt", "what I saw");
    room.succeed("evaluate set run");
    room.succeed("evaluate set run");
    assert_eq!(room.read("run/notes.txt"), b"what I saw");
    assert_eq!(record(&room, "run")["tracker"], "frozen");
    let refused = room.skiagraph(["run", "tiny.toml", "--out", "run"]);
    assert_eq!(refused.code, 2, "notes.txt would be lost: {}", refused.stderr);
    fs::remove_file(room.path("run/notes.txt")).unwrap();
    room.write("run/report.html", "my own report");
    let refused = room.skiagraph(["evaluate", "set", "run"]);
    assert!(refused.code == 2 && refused.stderr.contains("run/report.html: this exists"), "{}", refused.stderr);
    fs::remove_file(room.path("run/report.html")).unwrap();
    room.succeed("evaluate set run");
    let refused = room.skiagraph(["run", "tiny.toml", "--out", "run"]);
    let words = "command: was skiagraph track, now skiagraph run";
    assert!(refused.code == 2 && refused.stderr.contains(words), "{}", refused.stderr);
    room.succeed("run tiny.toml --quiet --force --out run");
    assert_eq!(room.entries(), ["run", "run~", "set", "tiny.toml"]);
}

#[test]
fn foreign_poses_in_a_skiagraph_run_are_treated_as_foreign() {
    let room = room(3);
    room.succeed("track set --tracker frozen --quiet --out run");
    room.write("run/poses.npz", of_poses(poses(&room)));
    let before = contents(&room.path("run"));
    let said = room.succeed("evaluate set run");
    assert_eq!(contents(&room.path("run")), before);
    assert_eq!(record(&room, "run-evaluation")["tracker"], "external");
    assert!(said.stderr.contains("run/poses.npz was changed after the run"), "{}", said.stderr);
    let refused = room.skiagraph(["track", "set", "--tracker", "frozen", "--out", "run"]);
    assert_eq!(refused.code, 2, "{}", refused.stderr);
}

#[test]
fn joint_angles_in_degrees_are_refused_unless_declared() {
    let room = room(3);
    let [root, (shape, angles)] = poses(&room);
    room.write("right.npz", of_poses([root.clone(), (shape.clone(), angles.clone())]));
    room.succeed("evaluate set right.npz");
    let degrees = angles.iter().map(|angle| angle.to_degrees()).collect();
    room.write("degrees.npz", of_poses([root, (shape, degrees)]));
    let refused = room.skiagraph(["evaluate", "set", "--poses", "degrees.npz"]);
    let words = "joint angles exceed a whole turn";
    assert!(refused.code == 2 && refused.stderr.contains(words), "{}", refused.stderr);
    assert!(refused.stderr.contains("--angles deg"), "{}", refused.stderr);
    room.succeed("evaluate set --poses degrees.npz --angles deg");
    let error = |folder: &str| mean(&record(&room, folder), "humaneva_mm");
    let apart = (error("right.npz-evaluation") - error("degrees.npz-evaluation")).abs();
    assert!(apart < 1e-6, "{apart}");
    room.succeed("evaluate set --poses degrees.npz --angles rad --out as-said");
}

#[test]
fn a_file_without_the_axis_of_seeds_is_refused_with_the_expected_shape() {
    let room = room(3);
    let [(shape, root), angles] = poses(&room);
    room.write("flat.npz", of_poses([(shape[1..].to_vec(), root), angles]));
    let refused = room.skiagraph(["evaluate", "set", "flat.npz"]);
    let words = "estimate_angles has a leading axis of seeds and estimate_root has none";
    assert!(refused.code == 2 && refused.stderr.contains(words), "{}", refused.stderr);
}

#[test]
fn a_file_that_holds_no_estimate_is_refused() {
    let room = room(3);
    let [root, angles] = poses(&room);
    let nothing = |(shape, values): (Vec<usize>, Vec<f64>)| (shape, vec![NAN; values.len()]);
    room.write("nan.npz", of_poses([nothing(root.clone()), nothing(angles.clone())]));
    let (shape, values) = root;
    let short = (vec![1, 2, 7], values[..14].to_vec());
    let two = (vec![1, 2, angles.0[2]], angles.1[..2 * angles.0[2]].to_vec());
    room.write("short.npz", of_poses([short, two]));
    let at_rate = |fps: f64| {
        let (root, angles) = (poses(&room), ["estimate_root", "estimate_angles"]);
        let mut npz = Npz::from_iter([("fps", Array::new(&[], vec![fps])), ("seeds", Array::new(&[1], vec![5_i64]))]);
        root.into_iter().zip(angles).for_each(|((shape, values), name)| npz.push(name, Array::new(&shape, values)));
        npz.to_bytes("theirs.npz").unwrap()
    };
    room.write("rate.npz", at_rate(NAN));
    room.write("empty.npz", estimate(vec![]));
    room.write("text.npz", "no archive");
    for (file, words) in [
        ("nan.npz", "every frame of every seed is NaN"),
        ("short.npz", "it has 2 frames, the set"),
        ("rate.npz", "the run has NaN frames a second"),
        ("empty.npz", "empty.npz: contains no estimate; expected estimate_root"),
        ("text.npz", "text.npz: not a complete .npz archive"),
        ("nowhere.npz", "nowhere.npz"),
    ] {
        let refused = room.skiagraph(["evaluate", "set", file]);
        assert!(refused.code == 2 && refused.stderr.contains(words), "{file}, {shape:?}: {}", refused.stderr);
        assert!(!room.path(&format!("{file}-evaluation")).exists());
    }
}
