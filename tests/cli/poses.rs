//! `skiagraph evaluate --poses`: estimates in other programs' formats.

use std::fmt::Write;

use serde_json::Value;
use skiagraph::benchmark_set::TruthSet;
use skiagraph::body::LANDMARKS;

use crate::sandbox::{Sandbox, TINY};

/// A sandbox with a set, and its true markers, `[frame][marker]`, metres.
fn room() -> (Sandbox, Vec<Vec<[f64; 3]>>) {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    let truth = TruthSet::read(&room.path("set")).unwrap().ground_truth;
    let of = |markers: &skiagraph::body::Markers| markers.iter().map(|m| m.unwrap().coords.into()).collect();
    let markers = truth.frames.iter().map(|frame| of(&frame.markers)).collect();
    (room, markers)
}

fn names() -> Vec<&'static str> {
    LANDMARKS.iter().map(|landmark| landmark.name()).collect()
}

/// A table of these markers after `change`, with one column per coordinate.
fn csv(markers: &[Vec<[f64; 3]>], names: &[&str], change: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let columns: Vec<String> = names.iter().flat_map(|n| ["x", "y", "z"].map(|axis| format!("{n}_{axis}"))).collect();
    let mut text = columns.join(",") + "\n";
    for frame in markers {
        let numbers: Vec<String> = frame.iter().flat_map(|place| change(*place)).map(|v| v.to_string()).collect();
        writeln!(text, "{}", numbers.join(",")).unwrap();
    }
    text
}

/// The same as TRC, at 60 frames a second.
fn trc(markers: &[Vec<[f64; 3]>], names: &[&str], unit: &str, change: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let mut trc = format!(
        "PathFileType\t4\t(X/Y/Z)\tmine.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n60\t60\t{}\t{}\t{unit}\nFrame#\tTime",
        markers.len(),
        names.len()
    );
    names.iter().for_each(|name| write!(trc, "\t{name}\t\t").unwrap());
    trc.push_str("\n\t\tX1\n\n");
    for (frame, markers) in markers.iter().enumerate() {
        let numbers: Vec<String> = markers.iter().flat_map(|place| change(*place)).map(|v| v.to_string()).collect();
        writeln!(trc, "{}\t{}\t{}", frame + 1, frame as f64 / 60.0, numbers.join("\t")).unwrap();
    }
    trc
}

fn error(room: &Sandbox, arguments: &str) -> f64 {
    let json: Value = serde_json::from_str(&room.succeed(&format!("evaluate set {arguments} --json")).stdout).unwrap();
    json["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap()
}

#[test]
fn frames_numbered_from_one_and_semicolons_are_recognised() {
    let (room, truth) = room();
    let text = csv(&truth, &names(), |place| place);
    let (head, rows) = text.split_once('\n').unwrap();
    let rows: String = rows.lines().enumerate().map(|(row, line)| format!("{},{line}\n", row + 1)).collect();
    room.write("one.csv", format!("frame,{head}\n{rows}"));
    room.write("semicolons.csv", text.replace(',', ";"));
    let (last, frames) = (truth.len(), truth.len() - 1);
    let from_one =
        format!("its last frame is {last}, the set's is {frames}: frames count from 0; its first is 1: subtract 1");
    for (file, words) in [("one.csv", from_one.as_str()), ("semicolons.csv", "found semicolons")] {
        let refused = room.skiagraph(["evaluate", "set", "--poses", file]);
        assert!(refused.code == 2 && refused.stderr.contains(words), "{file}: {}", refused.stderr);
    }
    room.write("angles.csv", csv(&truth, &names(), |place| place));
    let refused = room.skiagraph(["evaluate", "set", "--poses", "angles.csv", "--angles", "deg"]);
    assert!(refused.code == 2 && refused.stderr.contains("leave out --angles"), "{}", refused.stderr);
}

#[test]
fn a_known_error_is_found_in_every_format_unit_and_axis() {
    let (room, truth) = room();
    let off = |[x, y, z]: [f64; 3]| [x + 0.03, y, z + 0.04];
    room.write("mine.csv", csv(&truth, &names(), off));
    assert!((error(&room, "--poses mine.csv") - 50.0).abs() < 1e-6);
    assert!((error(&room, "mine.csv --out again") - 50.0).abs() < 1e-6, "also without --poses");
    // Y up, millimetres: x, z, -y
    let turned = |place| {
        let [x, y, z] = off(place);
        [1000.0 * x, 1000.0 * z, -1000.0 * y]
    };
    room.write("turned.csv", csv(&truth, &names(), turned));
    assert!((error(&room, "--poses turned.csv --units mm --up y") - 50.0).abs() < 1e-6);
    room.write("mine.trc", trc(&truth, &names(), "mm", turned));
    assert!((error(&room, "--poses mine.trc") - 50.0).abs() < 1e-6);
    room.succeed("export set --to c3d --out c3d");
    assert!(error(&room, "--poses c3d/markers.c3d") < 1e-3, "single precision, millimetres");
    let other: Vec<String> = names().iter().map(|name| format!("their {name}")).collect();
    let other: Vec<&str> = other.iter().map(String::as_str).collect();
    room.write("named.csv", csv(&truth, &other, off));
    let map: String = names().iter().map(|name| format!("\"their {name}\" = \"{name}\"\n")).collect();
    room.write("map.toml", map);
    assert!((error(&room, "--poses named.csv --joint-map map.toml") - 50.0).abs() < 1e-6);
}

#[test]
fn files_of_pipelines_are_read_with_their_axes_names_and_missing_frames() {
    let (room, truth) = room();
    // Pose2Sim's axes, names and filtered files: the last row is missing, and NumFrames is that of the unfiltered file
    let theirs = [
        "Neck",
        "Hip",
        "LShoulder",
        "LElbow",
        "LWrist",
        "RShoulder",
        "RElbow",
        "RWrist",
        "LHip",
        "LKnee",
        "LAnkle",
        "RHip",
        "RKnee",
        "RAnkle",
        "Head",
    ];
    let whole = trc(&truth, &theirs, "m", |[x, y, z]| [y, z, x + 0.05]);
    let filtered = whole.trim_end().rsplit_once('\n').unwrap().0;
    room.write("filtered.trc", filtered);
    let answer = room.succeed("evaluate set filtered.trc --from pose2sim --json");
    let json: Value = serde_json::from_str(&answer.stdout).unwrap();
    let of = |name: &str| json["metrics"][name]["mean"].as_f64().unwrap();
    assert!((of("humaneva_mm") - 50.0).abs() < 1e-6, "{json}");
    assert!((of("lost_frames") - 1.0 / (truth.len() - 1) as f64).abs() < 1e-9, "frame 0 is the start pose: {json}");
    for words in ["NumFrames is 5, but the file has 4 rows", "no row is at 1 of the set's 5 frames (the first: 4)"] {
        assert!(answer.stderr.contains(words), "{words}: {}", answer.stderr);
    }
    let described = room.succeed("evaluate set filtered.trc --from pose2sim --out again").stdout;
    assert!(described.contains("metres (declared in the file); Y up, axes y,z,x (--from)"), "{described}");
    room.write("unit.trc", filtered.replacen("\tm\n", "\tpx\n", 1));
    let unit = room.skiagraph(["evaluate", "set", "unit.trc", "--from", "pose2sim"]);
    assert!(unit.code == 2 && unit.stderr.contains("found \"px\""), "{}", unit.stderr);
    let declared = room.succeed("evaluate set unit.trc --from pose2sim --units m --json").stdout;
    let declared: Value = serde_json::from_str(&declared).unwrap();
    assert_eq!(declared["metrics"]["humaneva_mm"]["mean"], json["metrics"]["humaneva_mm"]["mean"]);
    let unknown = room.skiagraph(["evaluate", "set", "filtered.trc", "--from", "pose3sim"]);
    assert!(unknown.code == 2 && unknown.stderr.contains("pose2sim"), "{}", unknown.stderr);
    room.write("angles.mot", "ik\nversion=1\nendheader\ntime\tpelvis_tilt\tknee_angle_r\n0\t1\t2\n");
    let angles = room.skiagraph(["evaluate", "set", "angles.mot"]);
    assert!(angles.code == 2 && angles.stderr.contains("report_marker_locations"), "{}", angles.stderr);
}

#[test]
fn an_estimate_replaces_the_run_of_a_tracker_only_with_force() {
    let (room, truth) = room();
    room.succeed("track set --tracker frozen --out run");
    room.write("mine.csv", csv(&truth, &names(), |place| place));
    let refused = room.skiagraph(["evaluate", "set", "mine.csv", "--out", "run"]);
    let words = "run: this is a result made with other settings (command: was skiagraph track, now skiagraph evaluate)";
    assert!(refused.code == 2 && refused.stderr.contains(words), "{}", refused.stderr);
    assert!(room.path("run/track.json").exists());
    room.succeed("evaluate set mine.csv --out run --force");
    assert!(room.path("run~/track.json").exists(), "it was moved aside");
    assert!(!room.path("run/track.json").exists());
    room.succeed("evaluate set mine.csv --out run");
}

#[test]
fn an_exported_bvh_equals_the_truth() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml tracker_body.robot=actor tracker_body.mismatch=none --out set");
    room.succeed("export set --to bvh --out bvh");
    let found = error(&room, "--poses bvh/actor.bvh");
    assert!(found < 0.01, "six decimals of centimetres and degrees: {found} mm");
}

#[test]
fn an_exported_bvh_is_measured_against_a_body_with_other_links() {
    let (room, _) = room();
    room.succeed("export set --to bvh --out bvh");
    let found = error(&room, "--poses bvh/actor.bvh");
    assert!(found < 0.01, "the file has the markers too: {found} mm");
    let json: Value = serde_json::from_str(&room.succeed("evaluate set --poses bvh/actor.bvh --json").stdout).unwrap();
    assert_eq!(json["metrics"]["humaneva_mm"]["coverage"], 1.0);
}

/// Without hands, feet and a head, the skeleton is short; its unit must still be recognised.
#[test]
fn an_exported_bvh_without_hands_and_feet_equals_the_truth() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml actor.robot=tracker25 --out set");
    room.succeed("export set --to bvh --out bvh");
    let found = error(&room, "--poses bvh/actor.bvh");
    assert!(found < 0.01, "{found} mm");
    room.succeed("inspect bvh/actor.bvh");
}

#[test]
fn impossible_coordinates_are_refused_with_file_frame_and_marker() {
    let (room, truth) = room();
    let mut far = truth.clone();
    far[2][4] = [0.0, 1e300, 1.0];
    room.write("far.csv", csv(&far, &names(), |place| place));
    far[2][4] = [0.0, 1.1e9, 1.0];
    room.write("far_mm.csv", csv(&far, &names(), |[x, y, z]| [1000.0 * x, y, 1000.0 * z]));
    for (file, arguments) in [("far.csv", "--poses far.csv"), ("far_mm.csv", "--poses far_mm.csv --units mm")] {
        let refused = room.skiagraph(format!("evaluate set {arguments}").split(' '));
        assert_eq!(refused.code, 2, "{}", refused.stdout);
        for part in [file, "frame 2", "left_wrist", "1000000 m"] {
            assert!(refused.stderr.contains(part), "{part}: {}", refused.stderr);
        }
        assert_eq!(refused.stderr.lines().count(), 1, "{}", refused.stderr);
    }
    // at the limit: all output is finite
    far[2][4] = [0.0, 9.9e5, 1.0];
    room.write("far.csv", csv(&far, &names(), |place| place));
    room.succeed("evaluate set --poses far.csv --out far");
    let text = String::from_utf8(room.read("far/run.json")).unwrap();
    let json: Value = serde_json::from_str(&text).unwrap();
    let means = json["metrics"].as_object().unwrap().iter().map(|(name, metric)| (name, &metric["mean"]));
    means.for_each(|(name, mean)| assert!(mean.is_number(), "{name}: {mean}"));
    room.succeed("evaluate set --poses far.csv --out again");
    room.succeed("compare far again --json");
}

#[test]
fn files_of_other_lengths_need_their_first_frame() {
    let (room, truth) = room();
    room.write("late.csv", csv(&truth[2..], &names(), |place| place));
    let refused = room.skiagraph(["evaluate", "set", "--poses", "late.csv"]);
    assert!(refused.code == 2 && refused.stderr.contains("--shift"), "{}", refused.stderr);
    let json = room.succeed("evaluate set --poses late.csv --shift 2 --json").stdout;
    let json: Value = serde_json::from_str(&json).unwrap();
    assert!(json["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap() < 1e-6);
    assert_eq!(json["metrics"]["lost_frames"]["mean"], 0.25, "frame 1 of 4 that count");
    assert_eq!(json["read_as"]["shift_frames"], 2);
}

#[test]
fn invalid_options_are_refused_with_an_example() {
    let (room, truth) = room();
    room.write("mine.csv", csv(&truth, &names(), |place| place));
    for (arguments, words) in [
        (vec!["--axes", "x,y"], "y,z,x"),
        (vec!["--axes", "x,y,y"], "x, y and z once each"),
        (vec!["--offset", "1,2"], "three numbers"),
        (vec!["--offset", "1,2,1e300"], "three numbers"),
        (vec!["--shift", "many"], "--shift"),
        (vec!["--up", "y", "--axes", "y,z,x"], "cannot be used with"),
    ] {
        let all: Vec<&str> = ["evaluate", "set", "mine.csv"].into_iter().chain(arguments.clone()).collect();
        let refused = room.skiagraph(all);
        assert!(refused.code == 2 && refused.stderr.contains(words), "{arguments:?}: {}", refused.stderr);
    }
}

#[test]
fn an_estimate_with_a_wrong_first_frame_has_a_note() {
    let (room, truth) = room();
    let noted = |file: &str| {
        room.succeed(&format!("evaluate set --poses {file}")).stderr.contains("the estimate of frame 0 is")
    };
    room.write("moved.csv", csv(&truth, &names(), |[x, y, z]| [x + 0.8, y, z]));
    room.write("turned.csv", csv(&truth, &names(), |[x, y, z]| [x, -z, y]));
    room.write("poor.csv", csv(&truth, &names(), |[x, y, z]| [x + 0.3, y, z]));
    assert!(noted("moved.csv") && noted("turned.csv"));
    assert!(!noted("poor.csv"));
}

#[test]
fn wrongly_declared_units_are_refused_and_named() {
    let (room, truth) = room();
    for (unit, per_metre) in [("cm", 100.0), ("mm", 1000.0), ("in", 1.0 / 0.0254)] {
        room.write(&format!("{unit}.csv"), csv(&truth, &names(), |place| place.map(|v| per_metre * v)));
    }
    for (is, declared) in [("cm", "mm"), ("cm", "in"), ("mm", "cm"), ("mm", "in"), ("in", "cm"), ("in", "mm")] {
        let file = format!("{is}.csv");
        let refused = room.skiagraph(["evaluate", "set", "--poses", &file, "--units", declared]);
        let words = format!("use --units {is}");
        assert!(refused.code == 2 && refused.stderr.contains(&words), "{is} as {declared}: {}", refused.stderr);
    }
    assert!(error(&room, "--poses in.csv --units in") < 1e-6);
    assert!(error(&room, "--poses cm.csv --units cm") < 1e-6);
}

#[test]
fn wrong_units_missing_frames_and_unknown_names_are_refused() {
    let (room, truth) = room();
    let refused = |arguments: &str, parts: &[&str]| {
        let answer = room.skiagraph(format!("evaluate set {arguments}").split_whitespace());
        assert_eq!(answer.code, 2, "{arguments}: {}", answer.stdout);
        for part in parts {
            assert!(answer.stderr.contains(part), "{arguments}: {part}: {}", answer.stderr);
        }
    };
    room.write("mm.csv", csv(&truth, &names(), |place| place.map(|v| 1000.0 * v)));
    refused("--poses mm.csv", &["times the size of the start pose", "--units mm"]);
    room.write("cm.csv", csv(&truth, &names(), |place| place.map(|v| 100.0 * v)));
    refused("--poses cm.csv", &["100 times the size", "--units cm"]);
    room.write("m.csv", csv(&truth, &names(), |place| place));
    for unit in ["mm", "cm", "in"] {
        refused(&format!("--poses m.csv --units {unit}"), &["declared as another unit", "--units m"]);
    }
    room.write("short.csv", csv(&truth[..3], &names(), |place| place));
    refused("--poses short.csv", &["it has 3 frames, the set 5"]);
    let unknown: Vec<String> = (0..15).map(|i| format!("point{i}")).collect();
    let unknown: Vec<&str> = unknown.iter().map(String::as_str).collect();
    room.write("unknown.csv", csv(&truth, &unknown, |place| place));
    refused("--poses unknown.csv", &["no name is known", "--joint-map"]);
    room.write("mine.xls", "x");
    refused("--poses mine.xls", &[".csv, .trc, .c3d, .sto, .mot or .bvh"]);
    room.write("bad.csv", "pelvis_x,pelvis_y,pelvis_z\n1,2,three\n");
    refused("--poses bad.csv", &["bad.csv", "line 2"]);
}

#[test]
fn ignored_names_are_listed_in_the_summary_of_how_a_file_was_read() {
    let (room, truth) = room();
    let all: Vec<&str> = names().into_iter().chain(["nose"]).collect();
    let with_nose: Vec<Vec<[f64; 3]>> =
        truth.iter().map(|frame| frame.iter().copied().chain([[0.1, 0.2, 1.5]]).collect()).collect();
    room.write("nose.csv", csv(&with_nose, &all, |place| place));
    let answer = room.succeed("evaluate set nose.csv");
    let said = answer.stdout;
    let line = said.lines().find(|line| line.contains("read nose.csv: ")).unwrap_or_else(|| panic!("{said}"));
    assert!(line.ends_with("; not used: nose"), "{line}");
    assert!(answer.stderr.contains("nose.csv has names that are not used: nose"), "{}", answer.stderr);
    assert!(!said.contains("misread"), "{said}");
}

#[test]
fn positions_of_exact_zeros_are_reported_first_with_their_count() {
    let (room, mut truth) = room();
    truth[2][3] = [0.0; 3];
    truth[4][3] = [0.0; 3];
    room.write("zeros.csv", csv(&truth, &names(), |place| place));
    let said = room.succeed("evaluate set zeros.csv -q").stdout;
    let words = "The estimate may have been misread: zeros.csv has 2 of 75 positions with three equal coordinates";
    assert!(said.starts_with(words) && said.contains(&format!("`{}` in frame 2 at 0, 0, 0", names()[3])), "{said}");
}

#[test]
fn rows_of_a_trc_file_that_go_backwards_are_refused_with_their_line() {
    let (room, truth) = room();
    let whole = trc(&truth, &names(), "m", |[x, y, z]| [x, z, -y]);
    let mut lines: Vec<&str> = whole.lines().collect();
    lines.swap(8, 9);
    room.write("exchanged.trc", lines.join("\n"));
    let refused = room.skiagraph(["evaluate", "set", "exchanged.trc"]);
    let words = "line 10: expected a later row than in line 9, frame 4 at 0.05 s, found frame 3";
    assert!(refused.code == 2 && refused.stderr.contains(words), "{}", refused.stderr);
}

/// The message must not contain NaN.
#[test]
fn a_shift_beyond_all_frames_is_refused() {
    let (room, truth) = room();
    room.write("mine.csv", csv(&truth, &names(), |place| place));
    for shift in ["400", "-4"] {
        let refused = room.skiagraph(["evaluate", "set", "mine.csv", "--shift", shift]);
        let words = format!("mine.csv: --shift {shift} leaves nothing to measure: the file's 5 frames would be");
        assert!(refused.code == 2 && refused.stderr.contains(&words), "{}", refused.stderr);
    }
}

/// OpenSim itself writes the positions of a TRC file in both of its forms.
#[test]
fn positions_that_opensim_writes_are_the_truth() {
    let Some(python) = crate::support::python_with_numpy() else { return };
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --quiet --out set");
    room.succeed("export set --to trc --out trc");
    let script = "import opensim\n\
                  points = opensim.TimeSeriesTableVec3('trc/markers.trc')\n\
                  opensim.STOFileAdapterVec3.write(points, 'vectors.sto')\n\
                  opensim.STOFileAdapter.write(points.flatten(['_tx', '_ty', '_tz']), 'new.sto')\n\
                  opensim.Storage.printResult(opensim.Storage('new.sto'), 'old', '.', -1, '.sto')\n";
    let written = std::process::Command::new(python).args(["-c", script]).current_dir(room.path(".")).output().unwrap();
    if String::from_utf8_lossy(&written.stderr).contains("ModuleNotFoundError") {
        return crate::support::skip("no OpenSim to write .sto (pip install opensim)");
    }
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    for file in ["vectors.sto", "new.sto", "old.sto"] {
        // the exported file is in millimetres, which .sto does not declare
        let said = room.succeed(&format!("evaluate set {file} --units mm --json --out {file}-measured")).stdout;
        let run: serde_json::Value = serde_json::from_str(&said).unwrap();
        assert!(run["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap() < 1e-3, "{file}: {run}");
        assert!(run["read_as"].to_string().contains("assumed for OpenSim"), "{}", run["read_as"]);
    }
}
