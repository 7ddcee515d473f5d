//! `skiagraph evaluate --poses`: estimates in other programs' formats.

use nalgebra::Point3;
use skiagraph_core::body::Markers;
use skiagraph_set::TruthSet;

use crate::marker_files::{changed, csv, names, trc};
use crate::sandbox::Sandbox;

/// A sandbox with a set, and its true markers of every frame, metres.
fn room() -> (Sandbox, Vec<Markers>) {
    let room = Sandbox::with_set();
    let truth = TruthSet::read(&room.path("set")).unwrap().ground_truth;
    (room, truth.frames.iter().map(|frame| frame.markers).collect())
}

/// The markers after a change of their coordinates, as CSV.
fn changed_csv(truth: &[Markers], change: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    csv(&changed(truth, |point| change(point.coords.into()).into()), &names())
}

fn error(room: &Sandbox, arguments: &str) -> f64 {
    let json = room.json_of(&format!("evaluate set {arguments} --json"));
    json["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap()
}

/// In every unit and axis.
#[test]
fn every_format_has_the_known_error() {
    let (room, truth) = room();
    let off = |[x, y, z]: [f64; 3]| [x + 0.03, y, z + 0.04];
    room.write("mine.csv", changed_csv(&truth, off));
    assert!((error(&room, "--poses mine.csv") - 50.0).abs() < 1e-6);
    assert!((error(&room, "mine.csv --out again") - 50.0).abs() < 1e-6, "also without --poses");
    // Y up, millimetres: x, z, -y
    let turned = |place| {
        let [x, y, z] = off(place);
        [1000.0 * x, 1000.0 * z, -1000.0 * y]
    };
    room.write("turned.csv", changed_csv(&truth, turned));
    assert!((error(&room, "--poses turned.csv --units mm --up y") - 50.0).abs() < 1e-6);
    room.write("mine.trc", trc(&changed(&truth, |point| turned(point.coords.into()).into()), &names(), "mm", 60.0));
    assert!((error(&room, "--poses mine.trc") - 50.0).abs() < 1e-6);
    room.succeed("export set --to c3d --out c3d");
    assert!(error(&room, "--poses c3d/markers.c3d") < 1e-3, "single precision, millimetres");
    // another block in POINT:DATA_START than in the header, after the name, the step, the type and the dimensions
    let mut bytes = room.read("c3d/markers.c3d");
    let name = bytes.windows(10).position(|name| name == b"DATA_START").unwrap();
    bytes[name + 14] += 1;
    room.write("block.c3d", bytes.clone());
    assert!(error(&room, "block.c3d") < 1e-3, "the header is right");
    assert!(room.succeed("evaluate set block.c3d").stderr.contains("by POINT:DATA_START: read by the header"));
    bytes[name + 14] -= 1;
    bytes[16] += 1;
    room.write("block.c3d", bytes);
    assert!(room.succeed("evaluate set block.c3d").stderr.contains("by POINT:DATA_START: read by the parameter"));
    let other: Vec<String> = names().iter().map(|name| format!("their {name}")).collect();
    let other: Vec<&str> = other.iter().map(String::as_str).collect();
    room.write("named.csv", csv(&changed(&truth, |point| off(point.coords.into()).into()), &other));
    let map: String = names().iter().map(|name| format!("\"their {name}\" = \"{name}\"\n")).collect();
    room.write("map.toml", map);
    assert!((error(&room, "--poses named.csv --joint-map map.toml") - 50.0).abs() < 1e-6);
}

/// With their axes, names and missing frames.
#[test]
fn files_of_pipelines_are_read() {
    let (room, truth) = room();
    // Pose2Sim's axes, names and filtered files: the last row is missing, and NumFrames is that of the unfiltered file
    let theirs = "Neck Hip LShoulder LElbow LWrist RShoulder RElbow RWrist LHip LKnee LAnkle RHip RKnee RAnkle Head";
    let theirs: Vec<&str> = theirs.split(' ').collect();
    let whole = trc(&changed(&truth, |p| Point3::new(p.y, p.z, p.x + 0.05)), &theirs, "m", 60.0);
    let filtered = whole.trim_end().rsplit_once('\n').unwrap().0;
    room.write("filtered.trc", filtered);
    let answer = room.succeed("evaluate set filtered.trc --from pose2sim --json");
    let json = answer.json();
    let of = |name: &str| json["metrics"][name]["mean"].as_f64().unwrap();
    assert!((of("humaneva_mm") - 50.0).abs() < 1e-6, "{json}");
    assert!((of("lost_frames") - 1.0 / (truth.len() - 1) as f64).abs() < 1e-9, "frame 0 is the start pose: {json}");
    for words in ["NumFrames is 5, but the file has 4 rows", "no row is at 1 of the set's 5 frames (the first: 4)"] {
        assert!(answer.stderr.contains(words), "{words}: {}", answer.stderr);
    }
    let described = room.succeed("evaluate set filtered.trc --from pose2sim --out again").stdout;
    assert!(described.contains("metres (declared in the file); Y up, axes y,z,x (--from)"), "{described}");
    room.write("unit.trc", filtered.replacen("\tm\n", "\tpx\n", 1));
    let declared = room.json_of("evaluate set unit.trc --from pose2sim --units m --json");
    assert_eq!(declared["metrics"]["humaneva_mm"]["mean"], json["metrics"]["humaneva_mm"]["mean"]);
}

/// Also against a body with other links, by the markers; and without hands, feet and a head, whose skeleton is short.
#[test]
fn an_exported_bvh_equals_the_truth() {
    for actor in ["tracker_body.robot=actor tracker_body.mismatch=none", "", "actor.robot=tracker25"] {
        let room = Sandbox::tiny();
        room.succeed(&format!("render tiny.toml {actor} --out set"));
        room.succeed("export set --to bvh --out bvh");
        let found = error(&room, "--poses bvh/actor.bvh");
        assert!(found < 0.01, "{actor}: six decimals of centimetres and degrees: {found} mm");
        room.succeed("inspect bvh/actor.bvh");
    }
}

/// Rows of another rate belong to frames by their times; one that never touches the set has a way out.
#[test]
fn bvh_is_read_by_its_times() {
    let (room, _) = room();
    room.succeed("export set --to bvh --out bvh");
    let text = room.text("bvh/actor.bvh");
    let (head, rows) = text.split_once("Frame Time:").unwrap();
    let (rate, rows) = rows.split_once('\n').unwrap();
    let step: f64 = rate.trim().parse().unwrap();
    let doubled: String = rows.lines().map(|row| format!("{row}\n{row}\n")).collect();
    let count = rows.lines().count();
    let head = head.replace(&format!("Frames: {count}"), &format!("Frames: {}", 2 * count));
    room.write("fast.bvh", format!("{head}Frame Time: {}\n{doubled}", step / 2.0));
    assert!(error(&room, "fast.bvh") < 0.01);
}

#[test]
fn distant_coordinates_stay_finite() {
    let (room, truth) = room();
    let mut far = truth.clone();
    // at the limit: all output is finite
    far[2][4] = Some(Point3::new(0.0, 9.9e5, 1.0));
    room.write("far.csv", csv(&far, &names()));
    room.succeed("evaluate set --poses far.csv --out far");
    let json = room.json("far/run.json");
    let means = json["metrics"].as_object().unwrap().iter().map(|(name, metric)| (name, &metric["mean"]));
    means.for_each(|(name, mean)| assert!(mean.is_number(), "{name}: {mean}"));
    room.succeed("evaluate set --poses far.csv --out again");
    room.succeed("compare far again --json");
}

#[test]
fn wrong_first_frame_has_a_note() {
    let (room, truth) = room();
    let noted = |file: &str| {
        room.succeed(&format!("evaluate set --poses {file}")).stderr.contains("the estimate of frame 0 is")
    };
    room.write("moved.csv", changed_csv(&truth, |[x, y, z]| [x + 0.8, y, z]));
    room.write("turned.csv", changed_csv(&truth, |[x, y, z]| [x, -z, y]));
    room.write("poor.csv", changed_csv(&truth, |[x, y, z]| [x + 0.3, y, z]));
    assert!(noted("moved.csv") && noted("turned.csv"));
    assert!(!noted("poor.csv"));
}

#[test]
fn ignored_names_are_listed() {
    let (room, truth) = room();
    let more = |(row, line)| format!("{line},{}\n", if row == 0 { "nose_x,nose_y,nose_z" } else { "0.1,0.2,1.5" });
    room.write("nose.csv", csv(&truth, &names()).lines().enumerate().map(more).collect::<String>());
    let answer = room.succeed("evaluate set nose.csv");
    let said = answer.stdout;
    let line = said.lines().find(|line| line.contains("read nose.csv: ")).unwrap_or_else(|| panic!("{said}"));
    assert!(line.ends_with("; not used: nose"), "{line}");
    assert!(answer.stderr.contains("nose.csv has names that are not used: nose"), "{}", answer.stderr);
    assert!(!said.contains("misread"), "{said}");
}
