//! Units of recordings are recognised from motion and bones, regardless of the rest pose; for an impossible body, the
//! unit is requested.

use std::f64::consts::FRAC_PI_2;
use std::fs;

use nalgebra::{Rotation3, Vector3};
use skiagraph_truth::mocap::{Clip, ReadOptions, parse_bvh};

const FRAMES: usize = 90;
const RATE: f64 = 60.0;

/// Name, parent, rest position (standing with arms out, metres, facing +X, Z up) and, for leaves, tip.
type JointRow = (&'static str, Option<usize>, [f64; 3], Option<[f64; 3]>);

#[rustfmt::skip]
const BODY: [JointRow; 18] = [
    ("Hips",          None,     [0.0, 0.0, 0.95],     None),
    ("Spine",         Some(0),  [0.0, 0.0, 1.10],     None),
    ("Neck",          Some(1),  [0.0, 0.0, 1.50],     None),
    ("Head",          Some(2),  [0.0, 0.0, 1.58],     Some([0.0, 0.0, 1.76])),
    ("LeftShoulder",  Some(1),  [0.0, 0.03, 1.44],    None),
    ("LeftArm",       Some(4),  [0.0, 0.18, 1.44],    None),
    ("LeftForeArm",   Some(5),  [0.0, 0.47, 1.44],    None),
    ("LeftHand",      Some(6),  [0.0, 0.72, 1.44],    Some([0.0, 0.90, 1.44])),
    ("RightShoulder", Some(1),  [0.0, -0.03, 1.44],   None),
    ("RightArm",      Some(8),  [0.0, -0.18, 1.44],   None),
    ("RightForeArm",  Some(9),  [0.0, -0.47, 1.44],   None),
    ("RightHand",     Some(10), [0.0, -0.72, 1.44],   Some([0.0, -0.90, 1.44])),
    ("LeftUpLeg",     Some(0),  [0.0, 0.09, 0.92],    None),
    ("LeftLeg",       Some(12), [0.0, 0.09, 0.50],    None),
    ("LeftFoot",      Some(13), [0.0, 0.09, 0.08],    Some([0.20, 0.09, 0.02])),
    ("RightUpLeg",    Some(0),  [0.0, -0.09, 0.92],   None),
    ("RightLeg",      Some(15), [0.0, -0.09, 0.50],   None),
    ("RightFoot",     Some(16), [0.0, -0.09, 0.08],   Some([0.20, -0.09, 0.02])),
];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Rest {
    /// Standing.
    Stands,
    /// On its back, as in exports with confused axes.
    Lies,
    /// None: every bone lies along its own axis, and without rotation all lie on one line.
    Unrotated,
}

#[derive(Clone, Copy, Debug)]
struct Export {
    unit: f64,
    rest: Rest,
    y_up: bool,
    /// A root on the ground without an offset, on which the hips hang.
    reference: bool,
}

/// The rotation of a joint relative to its rest pose, in world axes at rest: a walk with the arms down.
fn motion(name: &str, frame: usize) -> Rotation3<f64> {
    let phase = (2.0 * std::f64::consts::PI * frame as f64 / 60.0).sin();
    let side = if name.starts_with("Left") { 1.0 } else { -1.0 };
    let swing = |amount: f64| Rotation3::from_axis_angle(&Vector3::y_axis(), amount * side * phase);
    match name.trim_start_matches("Left").trim_start_matches("Right") {
        "UpLeg" => swing(0.5),
        "Leg" => Rotation3::from_axis_angle(&Vector3::y_axis(), 0.3 + 0.3 * side * phase),
        "Arm" => swing(0.4) * Rotation3::from_axis_angle(&Vector3::x_axis(), -1.3 * side),
        "ForeArm" => Rotation3::from_axis_angle(&Vector3::z_axis(), -0.4 * side),
        _ => Rotation3::identity(),
    }
}

fn hips_at(frame: usize) -> Vector3<f64> {
    Vector3::new(0.02 * frame as f64, 0.3, 0.93 + 0.01 * (frame as f64 / 7.0).sin())
}

fn offset(joint: usize) -> Vector3<f64> {
    let at = |joint: usize| Vector3::from(BODY[joint].2);
    BODY[joint].1.map_or(Vector3::zeros(), |parent| at(joint) - at(parent))
}

/// Orientation of a joint's own frame in the standing rest pose.
fn own_frame(rest: Rest, joint: usize) -> Rotation3<f64> {
    match rest {
        Rest::Stands => Rotation3::identity(),
        Rest::Lies => Rotation3::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2),
        Rest::Unrotated => {
            let child = (0..BODY.len()).find(|other| BODY[*other].1 == Some(joint));
            let tip = BODY[joint].3.map(|tip| Vector3::from(tip) - Vector3::from(BODY[joint].2));
            let bone = child.map(offset).or(tip).unwrap_or(Vector3::y());
            let about_y = Rotation3::rotation_between(&Vector3::y(), &bone);
            about_y.unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
        }
    }
}

fn bvh(export: Export) -> String {
    let mut text = "HIERARCHY\n".to_owned();
    let mut open: Vec<usize> = Vec::new();
    let numbers =
        |v: Vector3<f64>| format!("{:.7} {:.7} {:.7}", v.x / export.unit, v.y / export.unit, v.z / export.unit);
    if export.reference {
        text += "ROOT Reference\n{\nOFFSET 0 0 0\nCHANNELS 0\n";
    }
    let frame_of = |joint: usize| own_frame(export.rest, joint);
    for (joint, (name, parent, at, tip)) in BODY.iter().enumerate() {
        while !open.is_empty() && open.last() != parent.as_ref() {
            open.pop();
            text += "}\n";
        }
        open.push(joint);
        let word = if joint == 0 && !export.reference { "ROOT" } else { "JOINT" };
        let off = parent.map_or(Vector3::zeros(), |parent| frame_of(parent).inverse() * offset(joint));
        let channels = if joint == 0 { "6 Xposition Yposition Zposition" } else { "3" };
        text +=
            &format!("{word} {name}\n{{\nOFFSET {}\nCHANNELS {channels} Zrotation Yrotation Xrotation\n", numbers(off));
        if let Some(tip) = tip {
            let tip = frame_of(joint).inverse() * (Vector3::from(*tip) - Vector3::from(*at));
            text += &format!("End Site\n{{\nOFFSET {}\n}}\n", numbers(tip));
        }
    }
    text += &"}\n".repeat(open.len() + usize::from(export.reference));
    text += &format!("MOTION\nFrames: {FRAMES}\nFrame Time: {}\n", 1.0 / RATE);
    let file_from_world =
        if export.y_up { Rotation3::from_axis_angle(&Vector3::x_axis(), -FRAC_PI_2) } else { Rotation3::identity() };
    for frame in 0..FRAMES {
        for (joint, (name, parent, ..)) in BODY.iter().enumerate() {
            let local = motion(name, frame) * frame_of(joint);
            let turned = parent.map_or(file_from_world * local, |parent| frame_of(parent).inverse() * local);
            if joint == 0 {
                text += &format!("{} ", numbers(file_from_world * hips_at(frame)));
            }
            let (x, y, z) = turned.euler_angles();
            text += &format!("{:.9} {:.9} {:.9} ", z.to_degrees(), y.to_degrees(), x.to_degrees());
        }
        text += "\n";
    }
    text
}

/// Positions of the joints, metres, Z up, computed without a file.
fn places(frame: usize) -> Vec<Vector3<f64>> {
    let mut found: Vec<(Vector3<f64>, Rotation3<f64>)> = Vec::new();
    for (joint, (name, parent, ..)) in BODY.iter().enumerate() {
        let turn = motion(name, frame);
        found.push(match parent.map(|parent| found[parent]) {
            None => (hips_at(frame), turn),
            Some((at, rotation)) => (at + rotation * offset(joint), rotation * turn),
        });
    }
    found.into_iter().map(|(at, _)| at).collect()
}

#[test]
fn the_unit_of_a_recording_is_recognised_for_all_rest_poses_and_axes() {
    for unit in [0.001, 0.01, 0.0254, 0.0254 / 0.45, 1.0] {
        for rest in [Rest::Stands, Rest::Lies, Rest::Unrotated] {
            for (y_up, reference) in [(true, false), (true, true), (false, false), (false, true)] {
                let export = Export { unit, rest, y_up, reference };
                let clip = parse_bvh(&bvh(export), "rokoko.bvh", &ReadOptions::default());
                let clip = clip.unwrap_or_else(|error| panic!("{export:?}: {error}"));
                for frame in [0, 17, FRAMES - 1] {
                    let found = clip.joint_positions(frame);
                    for (a, b) in found[usize::from(reference)..].iter().zip(places(frame)) {
                        let apart = (a.coords - b).norm();
                        assert!(apart < 1e-5, "{export:?}, frame {frame}: {apart} m apart; {:?}", clip.notes);
                    }
                }
            }
        }
    }
}

#[test]
fn an_impossible_unit_asks_for_metres_per_unit() {
    for unit in [7.0, 0.1e-3, 0.004] {
        let export = Export { unit, rest: Rest::Lies, y_up: true, reference: false };
        let error = parse_bvh(&bvh(export), "odd.bvh", &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.starts_with("odd.bvh: ") && error.contains("metres_per_unit"), "{unit}: {error}");
        let options = ReadOptions { metres_per_unit: Some(unit), ..ReadOptions::default() };
        let told = parse_bvh(&bvh(export), "odd.bvh", &options).unwrap();
        assert!((told.stature() - 1.76).abs() < 0.18, "{}", told.stature());
    }
}

fn scaled(text: &str, factor: f64) -> String {
    let (hierarchy, motion) = text.split_once("MOTION").unwrap();
    let number = |word: &str| format!("{:.6}", word.parse::<f64>().unwrap() * factor);
    // whether each channel is a length, in the order of the rows
    let mut lengths: Vec<bool> = Vec::new();
    let of_line = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.first().copied() {
            Some("OFFSET") => format!("OFFSET {}", words[1..].iter().map(|w| number(w)).collect::<Vec<_>>().join(" ")),
            Some("CHANNELS") => {
                lengths.extend(words[2..].iter().map(|channel| channel.to_lowercase().ends_with("position")));
                line.to_owned()
            }
            _ => line.to_owned(),
        }
    };
    let hierarchy: Vec<String> = hierarchy.lines().map(of_line).collect();
    let mut lines = motion.lines().filter(|line| !line.trim().is_empty());
    let header: Vec<&str> = lines.by_ref().take(2).collect();
    let row = |line: &str| {
        let values = line.split_whitespace().zip(&lengths);
        values
            .map(|(word, is_length)| if *is_length { number(word) } else { word.to_owned() })
            .collect::<Vec<_>>()
            .join(" ")
    };
    let rows: Vec<String> = lines.map(row).collect();
    format!("{}\nMOTION\n{}\n{}\n", hierarchy.join("\n"), header.join("\n"), rows.join("\n"))
}

/// The factor of the file's lengths.
fn unit_of(clip: &Clip, text: &str, file: &str) -> f64 {
    let plain = ReadOptions { metres_per_unit: Some(1.0), ..ReadOptions::default() };
    let bone = |clip: &Clip| clip.frames[0][2].translation.vector.norm();
    bone(clip) / bone(&parse_bvh(text, file, &plain).unwrap())
}

#[test]
fn shared_recordings_and_scaled_copies_are_read_in_their_unit_or_refused() {
    let Some(folder) = crate::support::test_data("mocap/bvh") else { return };
    let cmu = 0.0254 / 0.45;
    let table = [
        ("cmu_mb_01_01", cmu),
        ("cmu_3dsmax_131_01", cmu),
        ("ad_cmu_jumping_jacks", cmu),
        ("mocapbank_test", 0.01),
        // its unit is undocumented; of the usual units, only CMU's gives a human body, of 2.16 m, with a note
        ("ad_wave_hello", cmu),
    ];
    for (name, unit) in table {
        let whole = fs::read_to_string(folder.join(format!("{name}.bvh"))).unwrap();
        for factor in [1.0, 10.0, 100.0, 0.01] {
            let text = if factor == 1.0 { whole.clone() } else { scaled(&whole, factor) };
            let usual =
                [1.0, 0.1, 0.01, 0.001, 0.0254, 0.3048, cmu].iter().any(|u| (u / (unit / factor) - 1.0).abs() < 1e-9);
            match parse_bvh(&text, name, &ReadOptions::default()) {
                Ok(clip) => {
                    let found = unit_of(&clip, &text, name);
                    assert!(
                        (found / (unit / factor) - 1.0).abs() < 1e-3,
                        "{name} x {factor}: {found}, {:?}",
                        clip.notes
                    );
                    assert!((1.2..=2.3).contains(&clip.stature()), "{name} x {factor}: {}", clip.stature());
                }
                Err(error) => {
                    assert!(!usual && error.to_string().contains("metres_per_unit"), "{name} x {factor}: {error}");
                }
            }
        }
    }
}

#[test]
fn formats_that_declare_their_up_axis_do_not_guess_it() {
    let said = |notes: &[String]| notes.iter().any(|note| note.contains("up axis guessed"));
    let walk = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/motions/humanoid3d_walk.txt");
    assert!(!said(&skiagraph_truth::mocap::read(walk.as_ref(), &ReadOptions::default()).unwrap().notes));
    let bvh = parse_bvh(
        &bvh(Export { unit: 0.01, rest: Rest::Stands, y_up: true, reference: false }),
        "a.bvh",
        &ReadOptions::default(),
    );
    assert!(said(&bvh.unwrap().notes));
    let Some(folder) = crate::support::test_data("mocap/cmu_asf_amc") else { return };
    for name in ["49_01", "16_03", "02_04", "14_24"] {
        let clip = skiagraph_truth::mocap::read(&folder.join(format!("{name}.amc")), &ReadOptions::default()).unwrap();
        assert!(!said(&clip.notes), "{name}: {:?}", clip.notes);
        assert!((1.5..2.0).contains(&clip.stature()), "{name}: {}", clip.stature());
    }
}
