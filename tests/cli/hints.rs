//! Misread files are recognised, with the options that correct them.

use std::collections::BTreeMap;
use std::fmt::Write;

use nalgebra::{Point3, Vector3};
use serde_json::Value;
use skiagraph::body::{LANDMARKS, Markers};
use skiagraph::evaluation::{AxisOrder, with_sides_exchanged};
use skiagraph::npz::{Array, Npz, Values};

use crate::sandbox::Sandbox;

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

[tracker.annealed_particle_filter]
particles = 25
layers = 3
"#;

/// A sandbox with a set and a tracked run; the estimate's markers, `[frame]`, and its error, mm.
fn room() -> (Sandbox, Vec<Markers>, f64) {
    let room = Sandbox::new();
    room.write("walk.toml", WALK);
    room.succeed("render walk.toml --out set");
    room.succeed("track set --tracker annealed_particle_filter particles=25 layers=3 --out run");
    let json: Value = serde_json::from_str(&room.succeed("evaluate set run --json").stdout).unwrap();
    assert!(json.get("hint").is_none(), "an honest run: {}", json["hint"]);
    let npz = Npz::from_bytes("poses.npz", &room.read("run/poses.npz")).unwrap();
    let numbers = npz.f64s("poses.npz", "estimate_markers", &[Some(1), None, Some(15), Some(3)]).unwrap();
    let frame =
        |frame: &[f64]| std::array::from_fn(|m| Some(Point3::new(frame[3 * m], frame[3 * m + 1], frame[3 * m + 2])));
    let markers = numbers.chunks_exact(45).map(frame).collect();
    (room, markers, json["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap())
}

/// Changes to an estimate before it is written.
struct Planted {
    /// The set's axes of the file's coordinates.
    axes: &'static str,
    /// Units per metre.
    per_metre: f64,
    swapped: bool,
    /// The set's frame of the file's first frame.
    shift: i64,
    origin: [f64; 3],
    renamed: bool,
}

const AS_IT_IS: Planted =
    Planted { axes: "x,y,z", per_metre: 1.0, swapped: false, shift: 0, origin: [0.0; 3], renamed: false };

impl Planted {
    fn markers(&self, estimate: &[Markers]) -> Vec<Markers> {
        let file_from_set = self.axes.parse::<AxisOrder>().unwrap().set_from_file().transpose();
        let origin = Vector3::from(self.origin);
        let last = estimate.len() as i64 - 1;
        let of = |frame: usize| {
            let markers = estimate[(frame as i64 + self.shift).clamp(0, last) as usize];
            let markers = if self.swapped { with_sides_exchanged(&markers) } else { markers };
            markers.map(|m| m.map(|point| Point3::from(self.per_metre * (file_from_set * (point.coords - origin)))))
        };
        (0..estimate.len()).map(of).collect()
    }

    /// The names of the columns.
    fn names(&self) -> Vec<&'static str> {
        let mut names: Vec<&str> = LANDMARKS.iter().map(|landmark| landmark.name()).collect();
        if self.renamed {
            // wrist, knee and head
            let (wrist, knee, head) = (names[4], names[12], names[14]);
            (names[4], names[12], names[14]) = (knee, head, wrist);
        }
        names
    }
}

fn coordinates(markers: &Markers) -> impl Iterator<Item = f64> {
    markers.iter().flat_map(|marker| <[f64; 3]>::from(marker.unwrap()))
}

fn csv(markers: &[Markers], names: &[&str]) -> Vec<u8> {
    let columns: Vec<String> = names.iter().flat_map(|n| ["x", "y", "z"].map(|axis| format!("{n}_{axis}"))).collect();
    let mut text = columns.join(",") + "\n";
    for frame in markers {
        let numbers: Vec<String> = coordinates(frame).map(|number| number.to_string()).collect();
        writeln!(text, "{}", numbers.join(",")).unwrap();
    }
    text.into_bytes()
}

fn trc(markers: &[Markers], names: &[&str], unit: &str) -> Vec<u8> {
    let mut text = format!(
        "PathFileType\t4\t(X/Y/Z)\tmine.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n30\t30\t{}\t15\t{unit}\nFrame#\tTime",
        markers.len()
    );
    names.iter().for_each(|name| write!(text, "\t{name}\t\t").unwrap());
    text.push_str("\n\t\tX1\n\n");
    for (frame, markers) in markers.iter().enumerate() {
        let numbers: Vec<String> = coordinates(markers).map(|number| number.to_string()).collect();
        writeln!(text, "{}\t{}\t{}", frame + 1, frame as f64 / 30.0, numbers.join("\t")).unwrap();
    }
    text.into_bytes()
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

/// The result of an evaluation: the options and the lines of a joint map in its hint, and the error.
struct Reading {
    options: Vec<String>,
    joint_map: BTreeMap<String, String>,
    kinds: Vec<String>,
    error: f64,
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
        return Reading { options, joint_map: BTreeMap::new(), kinds: vec!["refused".to_owned()], error: f64::NAN };
    }
    let json: Value = serde_json::from_str(&answer.stdout).unwrap();
    let texts = |value: &Value| -> Vec<String> {
        value.as_array().into_iter().flatten().map(|text| text.as_str().unwrap().to_owned()).collect()
    };
    let hint = &json["hint"];
    let map = hint["joint_map"].as_object().into_iter().flatten();
    Reading {
        options: texts(&hint["options"]),
        joint_map: map.map(|(theirs, ours)| (theirs.clone(), ours.as_str().unwrap().to_owned())).collect(),
        kinds: texts(&hint["kinds"]),
        error: json["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap(),
    }
}

#[test]
fn misread_files_are_reported_with_the_options_that_correct_them() {
    let (room, estimate, right) = room();
    room.succeed("export set --to c3d --out c3d");
    room.succeed("export set --to bvh --out bvh");
    let turned = |axes| Planted { axes, ..AS_IT_IS };
    let in_unit = |per_metre, axes| Planted { per_metre, axes, ..AS_IT_IS };
    let late = |shift, axes| Planted { shift, axes, ..AS_IT_IS };
    let swapped = |axes, shift| Planted { swapped: true, axes, shift, ..AS_IT_IS };
    let renamed = |axes| Planted { renamed: true, axes, ..AS_IT_IS };
    let moved = |axes| Planted { origin: [1.2, -0.7, 0.0], axes, ..AS_IT_IS };
    let (y_up, turned_y_up, left_handed) = ("x,z,-y", "y,z,x", "-x,y,z");
    let mut cases: Vec<(String, Vec<String>, Vec<&str>, f64)> = Vec::new();
    let mut plant = |kind: &str, planted: Planted, expected: &[&'static str]| {
        let name = format!("{}.{}", cases.len(), kind.split(' ').next().unwrap());
        let (markers, names) = (planted.markers(&estimate), planted.names());
        let bytes = match kind {
            "npz" => npz(&markers, &names),
            "csv" => csv(&markers, &names),
            other => trc(&markers, &names, other.strip_prefix("trc ").unwrap()),
        };
        room.write(&name, bytes);
        cases.push((name, Vec::new(), expected.to_vec(), right));
    };
    for kind in ["npz", "csv"] {
        plant(kind, turned(y_up), &["axes"]);
        plant(kind, in_unit(1000.0, "x,y,z"), &["refused"]);
        plant(kind, swapped("x,y,z", 0), &["sides"]);
    }
    plant("npz", turned(turned_y_up), &["axes"]);
    plant("npz", turned("x,-z,y"), &["axes"]);
    plant("npz", turned(left_handed), &["axes"]);
    plant("npz", in_unit(1000.0, y_up), &["refused"]);
    plant("npz", in_unit(100.0, turned_y_up), &["refused"]);
    plant("npz", in_unit(1.0 / 0.3048, "x,y,z"), &["units"]);
    plant("npz", late(5, "x,y,z"), &["shift"]);
    plant("npz", late(-3, "x,y,z"), &["shift"]);
    plant("npz", late(5, y_up), &["axes", "shift"]);
    plant("npz", swapped(y_up, 0), &["axes", "sides"]);
    plant("npz", renamed("x,y,z"), &["names"]);
    plant("npz", moved("x,y,z"), &["offset"]);
    plant("npz", moved(y_up), &["axes", "offset"]);
    plant("csv", swapped("x,y,z", 5), &["sides", "shift"]);
    // TRC is Y up by default
    plant("trc m", turned("x,y,z"), &["axes"]);
    plant("trc mm", in_unit(1000.0, turned_y_up), &["axes"]);
    plant("trc mm", in_unit(1.0, y_up), &["refused"]);
    plant("trc m", swapped(y_up, 0), &["sides"]);
    plant("trc m", late(5, y_up), &["shift"]);
    plant("trc m", late(-3, turned_y_up), &["axes", "shift"]);
    plant("trc m", renamed(y_up), &["names"]);
    // the truth itself, declared wrongly
    for (file, wrong) in [
        ("c3d/markers.c3d", "--up y"),
        ("c3d/markers.c3d", "--axes y,z,x"),
        ("bvh/actor.bvh", "--up z"),
        ("bvh/actor.bvh", "--axes x,z,-y"),
    ] {
        cases.push((file.to_owned(), wrong.split(' ').map(str::to_owned).collect(), vec!["axes"], 0.0));
    }
    let mut wrong = Vec::new();
    for (file, declared, expected, right) in &cases {
        let found = read(&room, file, declared);
        let mut arguments: Vec<String> =
            found.options.iter().flat_map(|option| option.split(' ').map(str::to_owned)).collect();
        // a wrong declaration is replaced
        arguments = arguments.iter().fold(Vec::new(), |mut all, word| {
            match word.starts_with("--") || all.is_empty() {
                true => all.push(word.clone()),
                // negative numbers are not options
                false => {
                    let option: String = all.pop().unwrap();
                    all.push(format!("{option}={word}"));
                }
            }
            all
        });
        if !found.joint_map.is_empty() {
            let lines: String =
                found.joint_map.iter().map(|(theirs, ours)| format!("{theirs:?} = {ours:?}\n")).collect();
            room.write("map.toml", lines);
            arguments.extend(["--joint-map".to_owned(), "map.toml".to_owned()]);
        }
        let mended = read(&room, file, &arguments);
        // a shift loses frames at an end, and an offset determined with the truth absorbs a bias of the estimate
        let near = mended.error <= 1.08 * right + 0.1 && mended.error >= 0.8 * right - 0.1;
        if found.kinds != *expected || !near || !mended.kinds.is_empty() {
            wrong.push(format!(
                "{file} {declared:?}: expected {expected:?}, found {:?} {arguments:?}; {:.1} mm, then {:.1} (right {right:.1}) {:?}",
                found.kinds, found.error, mended.error, mended.kinds
            ));
        }
    }
    assert!(wrong.is_empty(), "{} of {} wrong:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

#[test]
fn poses_in_other_axes_and_units_and_with_exchanged_angles_are_reported_too() {
    let (room, _, right) = room();
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
    room.write("sides.npz", written(numbers("estimate_root"), Array::names(exchanged.iter().map(String::as_str))));
    for (file, kind, option) in [("mm.npz", "units", "--units mm"), ("sides.npz", "sides", "--swap-sides")] {
        let found = read(&room, file, &[]);
        assert_eq!((found.kinds, found.options.clone()), (vec![kind.to_owned()], vec![option.to_owned()]), "{file}");
        let arguments: Vec<String> = option.split(' ').map(str::to_owned).collect();
        let mended = read(&room, file, &arguments);
        assert!((mended.error - right).abs() < 1e-6 && mended.kinds.is_empty(), "{file}: {}", mended.error);
    }
}

#[test]
fn the_hint_comes_first_and_assumptions_are_always_printed() {
    let (room, estimate, _) = room();
    let names = AS_IT_IS.names();
    room.write("right.csv", csv(&estimate, &names));
    let text = room.succeed("evaluate set right.csv").stdout;
    assert!(text.starts_with("walk: external"), "{text}");
    assert!(text.contains("read right.csv: metres (assumed); Z up, axes x,y,z (assumed)"), "{text}");
    room.write("wrong.trc", trc(&estimate, &names, "m"));
    let text = room.succeed("evaluate set wrong.trc --out wrong").stdout;
    assert!(text.starts_with("The estimate may have been misread: most of the error would go away"), "{text}");
    assert!(text.contains("Use --axes x,y,z."), "{text}");
    assert!(
        text.contains("read wrong.trc: metres (declared in the file); Y up, axes x,z,-y (assumed for .trc)"),
        "{text}"
    );
    let page = String::from_utf8(room.read("wrong/report.html")).unwrap();
    let (hint, verdict) = (page.find("--axes x,y,z").unwrap(), page.find("class=\"verdict\"").unwrap());
    assert!(hint < verdict);
    // a picture has no text to read; the lines of the hint make it higher
    let height = |run: &str| {
        room.succeed(&format!("report {run} --png {run}.png"));
        let bytes = room.read(&format!("{run}.png"));
        png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap().info().height
    };
    assert!(height("wrong") > height("right.csv-evaluation") + 28);
    let json: Value = serde_json::from_slice(&room.read("wrong/run.json")).unwrap();
    assert_eq!(json["read_as"]["axes"], "x,z,-y");
    assert_eq!(json["read_as"]["axes_from"], "assumed for .trc");
    // runs of this program have no hints
    let refused = room.skiagraph(["evaluate", "set", "run", "--axes", "y,z,x"]);
    assert!(refused.code == 2 && refused.stderr.contains("it is a run of skiagraph"), "{}", refused.stderr);
}

#[test]
fn a_gate_first_warns_that_a_run_may_have_been_misread() {
    let (room, estimate, _) = room();
    let names = AS_IT_IS.names();
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
    room.write("wrong.npz", several(&Planted { axes: "y,z,x", ..AS_IT_IS }.markers(&estimate)));
    room.succeed("evaluate set right.npz");
    room.succeed("evaluate set wrong.npz");
    room.succeed("baseline save walk right.npz-evaluation");
    let answer = room.skiagraph("gate wrong.npz-evaluation --baseline walk --margin 2mm".split(' '));
    assert!(
        answer.stdout.starts_with("the estimate may have been misread: walk: most of the error"),
        "{}",
        answer.stdout
    );
    assert!(answer.stdout.contains("Use --axes y,z,x"), "{}", answer.stdout);
    let answer = room.skiagraph("gate right.npz-evaluation --baseline walk --margin 2mm".split(' '));
    assert!(!answer.stdout.contains("misread"), "{}", answer.stdout);
}
