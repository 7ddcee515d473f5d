//! Estimates of programs that have bodies of their own: PARSEC's bodytrack and models of OpenSim.

use std::fs;
use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;
use nalgebra::Point3;
use serde_json::Value;
use skiagraph::benchmark_set::BlindSet;
use skiagraph::body::LANDMARKS;
use skiagraph::npz::Npz;

use crate::sandbox::{Sandbox, TINY};

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --quiet --out set");
    room
}

/// Names and positions (frames x names x 3, metres) of the markers of a measured estimate.
fn markers(room: &Sandbox, folder: &str) -> (Vec<String>, Vec<f64>) {
    let npz = Npz::from_bytes("poses.npz", &room.read(&format!("{folder}/poses.npz"))).unwrap();
    let names = npz.names("poses.npz", "marker_names").unwrap().unwrap().to_vec();
    let places = npz.numbers("poses.npz", "estimate_markers", &[Some(1), None, Some(names.len()), Some(3)]).unwrap();
    (names, places)
}

#[test]
fn an_export_to_bodytrack_is_complete_and_its_poses_are_measured() {
    let room = room();
    room.succeed("export set --to bodytrack");
    let file = |name: &str| fs::read_to_string(room.path(&format!("set-bodytrack/{name}"))).unwrap();
    let count = |name: &str| file(name).split_whitespace().filter(|word| word.parse::<f64>().is_ok()).count();
    assert_eq!([count("BodyShapeParameters.txt"), count("InitialPose.txt"), count("PoseParameters.txt")], [58, 31, 93]);
    assert!(file("README.txt").contains("bodytrack . 2 5 1000 5"), "{}", file("README.txt"));

    // the initial pose in four of the five frames
    room.write("set-bodytrack/poses.txt", file("InitialPose.txt").repeat(4));
    let measured = room.succeed("evaluate set set-bodytrack/poses.txt --from bodytrack --json --out measured");
    let run: Value = serde_json::from_str(&measured.stdout).unwrap();
    let of = |name: &str| run["metrics"][name]["mean"].as_f64().unwrap();
    assert!(of("humaneva_mm") < 120.0 && of("coverage") > 0.7 && of("lost_frames") == 0.25, "{run}");
    let note = "no row with a position is at 1 of the set's 5 frames (the first: 4)";
    assert!(measured.stderr.contains(note), "{}", measured.stderr);
    assert!(run["read_as"].to_string().contains("0.001"), "{}", run["read_as"]);
    let (names, first) = markers(&room, "measured");
    room.succeed("evaluate set set-bodytrack/poses.txt --out again");
    assert_eq!(markers(&room, "again").1[..45], first[..45], "recognised without --from");

    let start = BlindSet::read(&room.path("set")).unwrap().start;
    let expected = start.body.markers(&start.body.link_frames(&start.pose));
    for (index, place) in first.as_chunks::<3>().0.iter().take(15).enumerate() {
        assert_eq!(names[index], LANDMARKS[index].name());
        let apart = (Point3::from(*place) - expected[index].unwrap()).norm();
        assert!(apart < 0.01, "{} is {apart} m from the start pose's", names[index]);
    }

    let refused = |name: &str, text: &str, words: &str| {
        room.write(name, text);
        let answer = room.skiagraph(["evaluate", "set", name, "--from", "bodytrack", "--out", "refused"]);
        assert!(answer.code == 2 && answer.stderr.contains(words), "{words}: {}", answer.stderr);
        assert!(!room.path("refused").exists());
    };
    let pose = file("InitialPose.txt");
    refused("set-bodytrack/poses.txt", "1 2 3\n", "line 1: expected the 31 numbers of a pose, found 3");
    refused("set-bodytrack/poses.txt", &(pose.clone() + &pose.replacen("0.", "nan ", 1)), "line 2: expected");
    refused("set-bodytrack/poses.txt", &pose.repeat(6), "its last frame is 5, the set's is 4");
    refused("poses.txt", &pose, "BodyShapeParameters.txt, which is not in the same folder");
    room.write("BodyShapeParameters.txt", "1 2 3");
    refused("poses.txt", &pose, "BodyShapeParameters.txt: expected 58 numbers");
}

/// A leg in the plane x, y of OpenSim's axes: hip at 0.1, 1.0, 0.2, thigh and lower leg of 0.4 m.
const LEG: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="40000"><Model name="leg">
  <Ground name="ground"/>
  <BodySet name="bodyset"><objects>
    <Body name="thigh"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>
    <Body name="shank"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>
  </objects></BodySet>
  <JointSet name="jointset"><objects>
    <PinJoint name="hip_r">
      <socket_parent_frame>hip_in_ground</socket_parent_frame>
      <socket_child_frame>/bodyset/thigh</socket_child_frame>
      <coordinates><Coordinate name="hip_flexion_r"/></coordinates>
      <frames><PhysicalOffsetFrame name="hip_in_ground">
        <socket_parent>/ground</socket_parent><translation>0.1 1.0 0.2</translation>
      </PhysicalOffsetFrame></frames>
    </PinJoint>
    <PinJoint name="knee_r">
      <socket_parent_frame>knee_in_thigh</socket_parent_frame>
      <socket_child_frame>/bodyset/shank</socket_child_frame>
      <coordinates><Coordinate name="knee_angle_r"/></coordinates>
      <frames><PhysicalOffsetFrame name="knee_in_thigh">
        <socket_parent>/bodyset/thigh</socket_parent><translation>0 -0.4 0</translation>
      </PhysicalOffsetFrame></frames>
    </PinJoint>
  </objects></JointSet>
  <MarkerSet name="markerset"><objects>
    <Marker name="ANK"><socket_parent_frame>/bodyset/shank</socket_parent_frame><location>0 -0.4 0</location></Marker>
  </objects></MarkerSet>
</Model></OpenSimDocument>
"#;

/// Two coordinates in five frames: straight, bent by right angles, and straight again.
fn motion(in_degrees: &str, labels: [&str; 2], right_angle: f64) -> String {
    let rows = [[0.0, 0.0], [right_angle, 0.0], [right_angle, -right_angle], [0.0, -right_angle], [0.0, 0.0]];
    let row = |(frame, [hip, knee]): (usize, &[f64; 2])| format!("{}\t{hip}\t{knee}\n", frame as f64 / 60.0);
    let rows: String = rows.iter().enumerate().map(row).collect();
    format!(
        "Coordinates\nversion=1\nnRows=5\nnColumns=3\ninDegrees={in_degrees}\nendheader\ntime\t{}\n{rows}",
        labels.join("\t")
    )
}

/// Runs `evaluate` with a Python first on the path.
fn evaluate(room: &Sandbox, path: &str, arguments: &str) -> (i32, String) {
    let done = cargo_bin_cmd!("skiagraph")
        .args(["evaluate", "set"].into_iter().chain(arguments.split(' ')))
        .current_dir(room.path("."))
        .env("PATH", path)
        .output()
        .unwrap();
    (done.status.code().unwrap(), String::from_utf8(done.stderr).unwrap())
}

#[test]
fn coordinates_of_an_opensim_model_give_the_positions_computed_by_hand() {
    let Some(python) = crate::support::python_with_numpy() else { return };
    let room = room();
    let beside = python.parent().unwrap_or(Path::new("")).display().to_string();
    let path = format!("{beside}:{}", std::env::var("PATH").unwrap_or_default());
    room.write("leg.osim", LEG);
    room.write("map.toml", "hip_r = \"right_hip\"\nshank = \"right_knee\"\nANK = \"right_ankle\"\n");
    room.write("degrees.mot", motion(" Yes", ["hip_flexion_r", "knee_angle_r"], 90.0));
    let labels = ["/jointset/hip_r/hip_flexion_r/value", "/jointset/knee_r/knee_angle_r/value"];
    room.write("radians.sto", motion("no", labels, std::f64::consts::FRAC_PI_2));
    for file in ["degrees.mot", "radians.sto"] {
        let arguments = format!("{file} --model leg.osim --joint-map map.toml --out {file}-measured");
        let (code, said) = evaluate(&room, &path, &arguments);
        if said.contains("No module named 'opensim'") {
            return crate::support::skip("no OpenSim to compute positions (pip install opensim)");
        }
        assert!(code == 0, "{said}");
        let (names, found) = markers(&room, &format!("{file}-measured"));
        let at = |frame: usize, name: &str| {
            let column = names.iter().position(|known| known == name).unwrap();
            let first = 3 * (frame * names.len() + column);
            [found[first], found[first + 1], found[first + 2]]
        };
        // the set's axes are x, -z, y of the file's
        for (frame, knee, ankle) in [
            (0, [0.1, -0.2, 0.6], [0.1, -0.2, 0.2]),
            (1, [0.5, -0.2, 1.0], [0.9, -0.2, 1.0]),
            (2, [0.5, -0.2, 1.0], [0.5, -0.2, 0.6]),
            (3, [0.1, -0.2, 0.6], [-0.3, -0.2, 0.6]),
        ] {
            for (name, expected) in [("right_hip", [0.1, -0.2, 1.0]), ("right_knee", knee), ("right_ankle", ankle)] {
                let place = at(frame, name);
                let near = (0..3).all(|i| (place[i] - expected[i]).abs() < 1e-9);
                assert!(near, "{file}, frame {frame}: {name} {place:?}, expected {expected:?}");
            }
        }
    }
    assert!(!room.path("opensim.log").exists());
    room.write("other.mot", motion("yes", ["hip_flexion_r", "knee_flexion"], 90.0));
    let (code, said) = evaluate(&room, &path, "other.mot --model leg.osim");
    assert!(code == 2 && said.contains("no coordinate knee_flexion; it has hip_flexion_r, knee_angle_r"), "{said}");
    room.write("empty.osim", "<OpenSimDocument/>");
    let (code, said) = evaluate(&room, &path, "other.mot --model empty.osim");
    assert!(code == 2 && said.contains("empty.osim: --model: expected an OpenSim model"), "{said}");
}

#[test]
fn a_model_without_python_or_of_no_use_is_refused_with_what_to_do() {
    let room = room();
    room.write("angles.mot", motion("yes", ["hip_flexion_r", "knee_angle_r"], 90.0));
    room.write("leg.osim", LEG);
    room.write("undeclared.mot", motion("yes", ["hip_flexion_r", "knee_angle_r"], 90.0).replace("inDegrees=yes\n", ""));
    room.write("twice.mot", motion("yes", ["knee_angle_r", "knee_angle_r"], 90.0));
    room.write("robot.osim", "<robot name=\"leg\"/>");
    room.write("points.csv", "pelvis_x,pelvis_y,pelvis_z\n1,1,1\n");
    for (arguments, words) in [
        ("angles.mot", "give its model, an .osim file, with --model"),
        ("angles.mot --model leg.osim", "pip install opensim"),
        ("angles.mot --model missing.osim", "missing.osim: --model: there is no such file"),
        ("angles.mot --model set", "is a folder; expected an .osim file"),
        ("angles.mot --from pose2sim", "it writes no .mot"),
        ("points.csv --from bodytrack", "it writes no .csv but .txt"),
        ("points.csv --from pose2sim", "it writes no .csv but .trc or .c3d"),
        ("leg.osim --from anipose", "it writes no .osim but .csv or .npz"),
        ("angles.mot --model robot.osim", "robot.osim: --model: expected an OpenSim model"),
        ("undeclared.mot --model leg.osim", "undeclared.mot: expected inDegrees=yes or inDegrees=no in the header"),
        ("twice.mot --model leg.osim", "found \"knee_angle_r\" twice"),
        ("points.csv --model leg.osim", "is for .mot and .sto files"),
    ] {
        let (code, said) = evaluate(&room, "/nowhere", arguments);
        assert!(code == 2 && said.contains(words) && said.lines().count() == 1, "{arguments}: {said}");
    }
}
