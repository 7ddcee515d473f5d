//! Misread files are recognised, with the options that correct them.

use std::collections::BTreeMap;

use nalgebra::Point3;
use serde_json::Value;
use skiagraph_core::body::Markers;
use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_eval::{AxisOrder, with_sides_exchanged};
use skiagraph_set::BlindSet;

use crate::marker_files::{changed, coordinates, csv, names, trc};
use crate::sandbox::{Sandbox, assert_contains};

/// Two seconds of walking in small images.
const WALK: &str = r#"
schema = "skiagraph.scenario/1"
name = "walk"
seeds = 1

[motion]
clip = "embedded:walk"
frames_per_second = 30.0
loop_to_s = 2.0

[rig.ring]
count = 3
radius_m = 3.5
size_px = [96, 72]

[actor]
robot = "tracker25"

[tracker_body]
mismatch = "none"

[tracker.oracle]
"#;

/// A sandbox with a set and a run of the truth; markers with an error, `[frame]`, and this error, mm.
fn room() -> (Sandbox, Vec<Markers>, f64) {
    let room = Sandbox::new();
    room.write("walk.toml", WALK);
    room.succeed("render walk.toml --out set");
    room.succeed("track set --tracker oracle --out run");
    let npz = Npz::from_bytes("poses.npz", &room.read("run/poses.npz")).unwrap();
    let numbers = npz.f64s("poses.npz", "estimate_markers", &[Some(1), None, Some(15), Some(3)]).unwrap();
    // about 2 mm that depend on the frame, the marker and the axis
    let off = |index: usize| 0.002 * (index as f64 * 12.9898).sin();
    let numbers: Vec<f64> = numbers.iter().enumerate().map(|(index, number)| number + off(index)).collect();
    let frame =
        |frame: &[f64]| std::array::from_fn(|m| Some(Point3::new(frame[3 * m], frame[3 * m + 1], frame[3 * m + 2])));
    let markers: Vec<Markers> = numbers.chunks_exact(45).map(frame).collect();
    room.write("right.csv", csv(&markers, &names()));
    let right = read(&room, "right.csv", &[]);
    assert!(right.kinds.is_empty() && right.error > 1.0, "an honest file: {:?}", right.kinds);
    (room, markers, right.error)
}

fn in_axes(estimate: &[Markers], axes: &str) -> Vec<Markers> {
    let file_from_set = axes.parse::<AxisOrder>().unwrap().set_from_file().transpose();
    changed(estimate, |point| file_from_set * point)
}

/// A file whose first frame is the set's frame `shift`.
fn shifted(estimate: &[Markers], shift: i64) -> Vec<Markers> {
    let last = estimate.len() as i64 - 1;
    (0..=last).map(|frame| estimate[(frame + shift).clamp(0, last) as usize]).collect()
}

fn exchanged(estimate: &[Markers]) -> Vec<Markers> {
    estimate.iter().map(with_sides_exchanged).collect()
}

/// Without the axis of seeds, as for a single run.
fn npz(markers: &[Markers], names: &[&str]) -> Vec<u8> {
    let numbers: Vec<f64> = markers.iter().flat_map(coordinates).collect();
    let arrays = [
        ("fps", Array::new(&[], vec![30.0])),
        ("estimate_markers", Array::new(&[markers.len(), 15, 3], numbers)),
        ("marker_names", Array::names(names.iter().copied())),
    ];
    Npz::from_iter(arrays).to_bytes("p").unwrap()
}

/// The result of an evaluation: the options and the lines of a joint map in its hint, and the errors.
struct Reading {
    options: Vec<String>,
    without: Vec<String>,
    promised: Option<f64>,
    joint_map: BTreeMap<String, String>,
    kinds: Vec<String>,
    error: f64,
}

impl Reading {
    /// The given options, changed as the hint says.
    fn followed(&self, room: &Sandbox, given: &[String]) -> Vec<String> {
        let name = |option: &String| option.split(['=', ' ']).next().unwrap().to_owned();
        let replaced: Vec<String> = self.without.iter().chain(&self.options).map(name).collect();
        let mut all: Vec<String> = given.iter().filter(|option| !replaced.contains(&name(option))).cloned().collect();
        all.extend(self.options.iter().map(|option| option.replacen(' ', "=", 1)));
        if !self.joint_map.is_empty() {
            room.write("map.toml", toml::to_string(&self.joint_map).unwrap());
            all.retain(|option| name(option) != "--joint-map");
            all.push("--joint-map=map.toml".to_owned());
        }
        all
    }
}

fn read(room: &Sandbox, file: &str, arguments: &[String]) -> Reading {
    let mut all: Vec<String> =
        ["evaluate", "set", file, "--json", "--out", "out", "--force"].map(str::to_owned).to_vec();
    all.extend(arguments.iter().cloned());
    let answer = room.skiagraph(&all);
    if answer.code != 0 {
        // an impossible size is refused before the evaluation, with the same options
        assert_eq!(answer.code, 2, "{}", answer.stderr);
        let words: Vec<&str> =
            answer.stderr.split([' ', ')', ';', '\n']).map(|word| word.trim_end_matches('.')).collect();
        let mut options = Vec::new();
        for option in ["--units", "--axes"] {
            let at = words.iter().rposition(|word| word.trim_start_matches('(') == option);
            options.extend(at.map(|at| format!("{option} {}", words[at + 1])));
        }
        let (joint_map, without, kinds) = (BTreeMap::new(), Vec::new(), vec!["refused".to_owned()]);
        return Reading { options, without, promised: None, joint_map, kinds, error: f64::NAN };
    }
    let json: Value = serde_json::from_str(&answer.stdout).unwrap();
    let texts = |value: &Value| -> Vec<String> {
        value.as_array().into_iter().flatten().map(|text| text.as_str().unwrap().to_owned()).collect()
    };
    let hint = &json["hint"];
    let map = hint["joint_map"].as_object().into_iter().flatten();
    Reading {
        options: texts(&hint["options"]),
        without: texts(&hint["without"]),
        promised: hint["error_corrected_mm"].as_f64(),
        joint_map: map.map(|(theirs, ours)| (theirs.clone(), ours.as_str().unwrap().to_owned())).collect(),
        kinds: texts(&hint["kinds"]),
        error: json["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap(),
    }
}

/// Misread files, and options that are wrong or not needed.
#[test]
fn followed_hints_keep_their_promise() {
    let (room, estimate, right) = room();
    room.succeed("export set --to c3d --out c3d");
    room.succeed("export set --to bvh --out bvh");
    let mut renamed = names();
    // wrist, knee and head
    (renamed[4], renamed[12], renamed[14]) = (renamed[12], renamed[14], renamed[4]);
    let from_world = BlindSet::read(&room.path("set")).unwrap().rig.cameras[1].camera_from_world;
    let moved = changed(&estimate, |point| Point3::new(point.x - 1.2, point.y + 0.7, point.z));
    let in_mm = changed(&estimate, |point| 1000.0 * point);
    let y_up = "x,z,-y";
    let cases: Vec<(&str, Vec<u8>, &str, &[&str])> = vec![
        ("y_up.csv", csv(&in_axes(&estimate, y_up), &names()).into_bytes(), "", &["axes"]),
        ("left_handed.npz", npz(&in_axes(&estimate, "-x,y,z"), &names()), "", &["axes"]),
        ("mm.csv", csv(&in_mm, &names()).into_bytes(), "", &["refused"]),
        ("mm_y_up.npz", npz(&in_axes(&in_mm, y_up), &names()), "", &["refused"]),
        ("feet.npz", npz(&changed(&estimate, |point| point / 0.3048), &names()), "", &["units"]),
        ("sides.npz", npz(&exchanged(&estimate), &names()), "", &["sides"]),
        ("early.npz", npz(&shifted(&estimate, 5), &names()), "", &["shift"]),
        ("late.npz", npz(&in_axes(&shifted(&estimate, -3), y_up), &names()), "", &["axes", "shift"]),
        ("renamed.npz", npz(&estimate, &renamed), "", &["names"]),
        ("moved.npz", npz(&in_axes(&moved, y_up), &names()), "", &["axes", "offset"]),
        ("both.csv", csv(&shifted(&exchanged(&estimate), 5), &names()).into_bytes(), "", &["sides", "shift"]),
        ("camera.csv", csv(&changed(&estimate, |point| from_world * point), &names()).into_bytes(), "", &["camera"]),
        // TRC is Y up by default
        ("z_up.trc", trc(&estimate, &names(), "m", 30.0).into_bytes(), "", &["axes"]),
        (
            "camera.trc",
            trc(&changed(&estimate, |point| from_world * point), &names(), "m", 30.0).into_bytes(),
            "",
            &["camera"],
        ),
        ("declared_mm.trc", trc(&in_axes(&estimate, y_up), &names(), "mm", 30.0).into_bytes(), "", &["refused"]),
        ("renamed.trc", trc(&in_axes(&estimate, y_up), &renamed, "m", 30.0).into_bytes(), "", &["names"]),
        // the truth itself, declared wrongly
        ("c3d/markers.c3d", Vec::new(), "--axes=y,z,x", &["axes"]),
        ("bvh/actor.bvh", Vec::new(), "--up=z", &["axes"]),
        // files written above
        ("camera.csv", Vec::new(), "--camera=cam02", &["camera"]),
        ("camera.csv", Vec::new(), "--offset=1,0,0 --up=y", &["camera", "offset"]),
        ("y_up.csv", Vec::new(), "--camera=cam00", &["axes"]),
        ("y_up.csv", Vec::new(), "--offset=1,0,0", &["axes", "offset"]),
        ("moved.npz", Vec::new(), "--offset=1.2,-0.7,0", &["axes"]),
        (
            "declared_m.trc",
            trc(&in_axes(&estimate, y_up), &names(), "m", 30.0).into_bytes(),
            "--camera=cam01",
            &["axes"],
        ),
        ("declared_m.trc", Vec::new(), "--up=z", &["axes"]),
        ("declared_m.trc", Vec::new(), "--from=pose2sim", &["axes"]),
        ("z_up.trc", Vec::new(), "--up=y", &["axes"]),
        ("right.csv", Vec::new(), "--camera=cam01", &["camera"]),
        ("right.csv", Vec::new(), "--camera=cam01 --shift=6", &["camera", "shift"]),
        ("right.csv", Vec::new(), "--up=y", &["axes"]),
        ("right.csv", Vec::new(), "--axes=y,z,x", &["axes"]),
        ("right.csv", Vec::new(), "--offset=1,0.5,0", &["offset"]),
        ("right.csv", Vec::new(), "--units=mm", &["refused"]),
        ("right.csv", Vec::new(), "--swap-sides", &["sides"]),
        ("right.csv", Vec::new(), "--shift=6", &["shift"]),
        ("right.csv", Vec::new(), "--joint-map=wrong.toml", &["names"]),
    ];
    room.write("wrong.toml", "left_knee = \"left_wrist\"\nleft_wrist = \"left_knee\"\nright_knee = \"right_knee\"\n");
    let mut wrong = Vec::new();
    for (file, bytes, declared, expected) in &cases {
        if !bytes.is_empty() {
            room.write(file, bytes);
        }
        let given: Vec<String> = declared.split_whitespace().map(str::to_owned).collect();
        let found = read(&room, file, &given);
        let arguments = found.followed(&room, &given);
        let mended = read(&room, file, &arguments);
        let right = if file.contains('/') { 0.0 } else { right };
        // a shift loses frames at an end, and an offset determined with the truth absorbs a bias of the estimate
        let near = mended.error <= 1.08 * right + 0.1 && mended.error >= 0.8 * right - 0.1;
        let is_promised = found.promised.is_none_or(|promised| (promised - mended.error).abs() < 0.1 * promised + 1.0);
        if found.kinds != *expected || !near || !is_promised || !mended.kinds.is_empty() {
            wrong.push(format!(
                "{file} {declared:?}: expected {expected:?}, found {:?} {arguments:?}; {:.1} mm, then {:.1} (right {right:.1}) {:?}",
                found.kinds, found.error, mended.error, mended.kinds
            ));
        }
    }
    assert!(wrong.is_empty(), "{} of {} wrong:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

/// In other axes and units, and with exchanged angles.
#[test]
fn hints_correct_misread_poses() {
    let (room, ..) = room();
    room.write("poses.npz", room.read("run/poses.npz"));
    let right = read(&room, "poses.npz", &[]).error;
    let npz = Npz::from_bytes("poses.npz", &room.read("run/poses.npz")).unwrap();
    let numbers = |name: &str| match &npz.get(name).unwrap().values {
        Values::F64(numbers) => numbers.clone(),
        _ => panic!("{name}"),
    };
    let names = npz.get("estimate_angle_names").unwrap().clone();
    let Values::Text(texts) = &names.values else { panic!() };
    let exchanged: Vec<String> = texts
        .iter()
        .map(|name| match name.strip_prefix("left") {
            Some(rest) => format!("right{rest}"),
            None => name.strip_prefix("right").map_or(name.clone(), |rest| format!("left{rest}")),
        })
        .collect();
    assert_ne!(&exchanged, texts);
    let written = |root: Vec<f64>, names: Array| {
        let frames = root.len() / 7;
        let angles = numbers("estimate_angles");
        let arrays = [
            ("fps", Array::new(&[], vec![30.0])),
            ("estimate_root", Array::new(&[frames, 7], root)),
            ("estimate_angles", Array::new(&[frames, angles.len() / frames], angles)),
            ("estimate_angle_names", names),
        ];
        Npz::from_iter(arrays).to_bytes("p").unwrap()
    };
    let in_mm: Vec<f64> = numbers("estimate_root")
        .chunks_exact(7)
        .flat_map(|row| [&row[..3].iter().map(|v| 1000.0 * v).collect::<Vec<_>>()[..], &row[3..]].concat())
        .collect();
    room.write("mm.npz", written(in_mm, names.clone()));
    room.write("angles.npz", written(numbers("estimate_root"), names.clone()));
    room.write("sides.npz", written(numbers("estimate_root"), Array::names(exchanged.iter().map(String::as_str))));
    for (file, declared, kind, option) in [
        ("mm.npz", "", "units", "--units mm"),
        ("sides.npz", "", "sides", "--swap-sides"),
        ("angles.npz", "--angles=deg", "angles", "--angles rad"),
    ] {
        let declared: Vec<String> = declared.split_whitespace().map(str::to_owned).collect();
        let found = read(&room, file, &declared);
        assert!(found.kinds == [kind] && found.options == [option], "{file}: {:?} {:?}", found.kinds, found.options);
        let mended = read(&room, file, &found.followed(&room, &declared));
        assert!((mended.error - right).abs() < 1e-6 && mended.kinds.is_empty(), "{file}: {}", mended.error);
    }
}

/// And assumptions are always printed.
#[test]
fn hints_come_first() {
    let (room, estimate, _) = room();
    let names = names();
    let text = room.succeed("evaluate set right.csv").stdout;
    assert!(text.starts_with("walk: external"), "{text}");
    assert!(text.contains("read right.csv: metres (assumed); Z up, axes x,y,z (assumed)"), "{text}");
    room.write("wrong.trc", trc(&estimate, &names, "m", 30.0));
    let text = room.succeed("evaluate set wrong.trc --out wrong").stdout;
    assert!(text.starts_with("The estimate may have been misread: most of the error would go away"), "{text}");
    assert!(text.contains("Use --axes x,y,z."), "{text}");
    assert_contains(&text, &["read wrong.trc: metres (declared in the file); Y up, axes x,z,-y (assumed for .trc)"]);
    let page = room.text("wrong/report.html");
    let (hint, verdict) = (page.find("--axes x,y,z").unwrap(), page.find("class=\"verdict\"").unwrap());
    assert!(hint < verdict);
    let json: Value = room.json("wrong/run.json");
    assert_eq!(json["read_as"]["axes"], "x,z,-y");
    assert_eq!(json["read_as"]["axes_from"], "assumed for .trc");
}

#[test]
fn gate_warns_of_misread_runs() {
    let (room, estimate, _) = room();
    let names = names();
    let several = |markers: &[Markers]| {
        // copies would be one observation
        let of_seed = |seed: i32| markers.iter().flat_map(coordinates).map(move |x| x + 1e-4 * f64::from(seed));
        let numbers: Vec<f64> = (0..5).flat_map(of_seed).collect();
        let arrays = [
            ("fps", Array::new(&[], vec![30.0])),
            ("estimate_markers", Array::new(&[5, markers.len(), 15, 3], numbers)),
            ("marker_names", Array::names(names.iter().copied())),
        ];
        Npz::from_iter(arrays).to_bytes("p").unwrap()
    };
    room.write("right.npz", several(&estimate));
    room.write("wrong.npz", several(&in_axes(&estimate, "y,z,x")));
    room.succeed("evaluate set right.npz");
    room.succeed("evaluate set wrong.npz");
    room.succeed("baseline save walk right.npz-evaluation");
    let answer = room.ask("gate wrong.npz-evaluation --baseline walk --margin 2mm");
    assert!(
        answer.stdout.starts_with("the estimate may have been misread: walk: most of the error"),
        "{}",
        answer.stdout
    );
    assert!(answer.stdout.contains("Use --axes y,z,x"), "{}", answer.stdout);
    let answer = room.ask("gate right.npz-evaluation --baseline walk --margin 2mm");
    assert!(!answer.stdout.contains("misread"), "{}", answer.stdout);
}

/// Rows that count from 1 are a frame late; positions relative to the pelvis in a camera's axes; points never found.
#[test]
fn hints_name_other_conventions() {
    let (room, estimate, _) = room();
    let names = names();
    let table = csv(&estimate, &names);
    let lines: Vec<&str> = table.lines().collect();
    let rows = lines[1..lines.len() - 1].iter().enumerate();
    let numbered: String = rows.map(|(row, line)| format!("{},{line}\n", row + 1)).collect();
    room.write("from_one.csv", format!("frame,{}\n{numbered}", lines[0]));
    let turned = in_axes(&estimate, "x,z,-y");
    let text = trc(&turned[..turned.len() - 1], &names, "m", 30.0);
    let (mut late, mut from_two) = (String::new(), String::new());
    for (at, line) in text.lines().enumerate() {
        let mut fields: Vec<String> = line.split('\t').map(str::to_owned).collect();
        if at > 5 {
            fields[1] = (fields[0].parse::<f64>().unwrap() / 30.0).to_string();
        }
        late += &(fields.join("\t") + "\n");
        if at > 5 {
            fields[0] = (fields[0].parse::<u32>().unwrap() + 1).to_string();
        }
        from_two += &(fields.join("\t") + "\n");
    }
    room.write("from_two.trc", from_two);
    assert!(read(&room, "from_two.trc", &[]).kinds.is_empty(), "number 2 at the time of frame 1 is right");
    room.write("from_one.trc", late);
    for file in ["from_one.csv", "from_one.trc"] {
        let found = read(&room, file, &[]);
        assert_eq!((found.kinds, found.options), (vec!["shift".to_owned()], vec!["--shift -1".to_owned()]), "{file}");
        let mended = read(&room, file, &["--shift=-1".to_owned()]);
        assert!(mended.error < 0.3 * found.error && mended.kinds.is_empty(), "{file}: {}", mended.error);
    }
    let rotation = BlindSet::read(&room.path("set")).unwrap().rig.cameras[1].camera_from_world.rotation;
    let relative = |markers: &Markers| markers.map(|m| m.map(|point| rotation * (point - markers[0].unwrap().coords)));
    room.write("relative.csv", csv(&estimate.iter().map(relative).collect::<Vec<_>>(), &names));
    let found = read(&room, "relative.csv", &[]);
    assert_eq!((found.kinds, found.options), (vec!["camera".into(), "relative".into()], vec!["--camera cam01".into()]));
    let mended = read(&room, "relative.csv", &["--camera=cam01".to_owned()]);
    assert_eq!(mended.kinds, ["relative"]);
    // root-relative metrics need a pelvis
    let in_world = |markers: &Markers| markers.map(|m| m.map(|point| point - markers[0].unwrap().coords));
    let table = csv(&estimate.iter().map(in_world).collect::<Vec<_>>(), &names);
    room.write("no_pelvis.csv", table.replacen("pelvis", "nose", 3));
    room.says("evaluate set no_pelvis.csv --out no_pelvis", &["compare pa_mpjpe_mm (mpjpe_root_mm needs a `pelvis`"]);
    // a wrist that was never found, and a pelvis once, do not hide another origin
    let mut lost = changed(&estimate, |point| Point3::new(point.x - 1.2, point.y + 0.7, point.z));
    lost.iter_mut().for_each(|markers| markers[4] = Some(Point3::origin()));
    lost[7][0] = Some(Point3::origin());
    room.write("zeros.csv", csv(&lost, &names));
    assert_eq!(read(&room, "zeros.csv", &[]).kinds, ["offset"]);
    let notes = room.succeed("evaluate set zeros.csv --out zeros").stderr;
    assert!(notes.contains("positions at exactly 0, 0, 0 count as missing: thorax 1, left_wrist"), "{notes}");
    room.succeed("export set --to c3d --out c3d");
    let mut bytes = room.read("c3d/markers.c3d");
    let [points, block] = [1, 8].map(|word| usize::from(bytes[2 * word]));
    let place = 512 * (block - 1) + 16 * (7 * points + 3);
    bytes[place..place + 12].fill(0);
    room.write("zero.c3d", bytes);
    room.notes("evaluate set zero.c3d --out zero", &["positions at exactly 0, 0, 0 count as missing: "]);
    // advice on units would not help
    let difference = |at: usize| {
        std::array::from_fn(|m| {
            Some(Point3::from(estimate[at][m].unwrap() - estimate[at.saturating_sub(1)][m].unwrap()))
        })
    };
    room.write("differences.csv", csv(&(0..estimate.len()).map(difference).collect::<Vec<_>>(), &names));
    assert_eq!(read(&room, "differences.csv", &[]).kinds, ["differences"]);
}
