//! `skiagraph inspect`: models, recordings, robots and sets, and a clear error for anything else.

use std::fs;

use crate::sandbox::{Sandbox, TINY, shipped};

fn json(room: &Sandbox, arguments: &[&str]) -> serde_json::Value {
    let answer = room.skiagraph(["inspect"].iter().chain(arguments).chain(&["--json"]));
    assert_eq!(answer.code, 0, "{arguments:?}: {}", answer.stderr);
    let said: serde_json::Value = serde_json::from_str(&answer.stdout).unwrap();
    assert_eq!(said["schema"], "skiagraph.inspect/1");
    said
}

#[test]
fn a_model_has_its_page() {
    let room = Sandbox::new();
    room.succeed("train embedded:walk --model gpdm-graph --threshold 1e-6 --out walk.model");
    let answer = room.succeed("inspect walk.model --out pages/walk.html");
    assert!(answer.stdout.contains("pictures: pages/walk.html"), "{}", answer.stdout);
    let html = fs::read_to_string(room.path("pages/walk.html")).unwrap();
    let models = json(&room, &["walk.model"])["models"].as_array().unwrap().len();
    assert!(models > 1);
    assert_eq!(html.matches("<figure id=\"model-").count(), models);
    assert!(html.contains("data:image/png;base64,") && html.contains("embedded:walk"));
}

#[test]
fn a_recording_a_robot_and_a_set_are_described_as_text_and_as_json() {
    let room = Sandbox::new();
    let walk = json(&room, &["embedded:walk"]);
    assert_eq!((walk["what"].as_str(), walk["cyclic"].as_bool()), (Some("clip"), Some(true)));
    let bvh = shipped("scenarios/motions/01_01.bvh");
    let jumps = json(&room, &[bvh.to_str().unwrap()]);
    assert_eq!(jumps["frames_per_second"], 120.0);
    assert!((1.3..2.0).contains(&jumps["height_m"].as_f64().unwrap()), "{}", jumps["height_m"]);
    assert!(jumps["notes"].to_string().contains("unit guessed"), "{}", jumps["notes"]);
    let robot = json(&room, &["tracker25"]);
    assert_eq!(robot["degrees_of_freedom"].as_array().unwrap().len(), 19);
    assert!((robot["mass_kg"].as_f64().unwrap() - 73.0).abs() < 0.01);
    let urdf = shipped("robots/actor.urdf");
    assert_eq!(json(&room, &[urdf.to_str().unwrap()])["degrees_of_freedom"].as_array().unwrap().len(), 44);
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    let set = json(&room, &["set"]);
    assert_eq!((set["frames"].as_u64(), set["hashes_ok"].as_bool()), (Some(5), Some(true)));
    assert_eq!(set["cameras"].as_array().unwrap().len(), 2);
    for (what, words) in
        [("embedded:walk", "recording of"), ("actor", "44 joint angles"), ("set", "all match files.sha256")]
    {
        let answer = room.succeed(&format!("inspect {what}"));
        assert!(answer.stdout.contains(words), "{}", answer.stdout);
    }
    room.write("set/observations/cam00/silhouette/000002.png", "nothing");
    let broken = room.skiagraph(["inspect", "set"]);
    assert!(broken.code == 1 && broken.stdout.contains("BROKEN"), "{}", broken.stdout);
}

#[test]
fn what_is_nothing_of_ours_is_refused_with_one_message() {
    let room = Sandbox::new();
    room.write("mine.doc", "years of work");
    room.write("mine.model", "years of work");
    fs::create_dir(room.path("folder")).unwrap();
    let cases: [(&[&str], &str); 8] = [
        (&["nowhere"], "nowhere: cannot be read"),
        (&["mine.doc"], "expected a model of skiagraph train, a recording"),
        (&["mine.model"], "not a complete skiagraph model"),
        (&["folder"], "is not a complete benchmark set"),
        (&["embedded:wolk"], "did you mean `embedded:walk`"),
        (&["nowhere.bvh"], "nowhere.bvh"),
        (&["nowhere.urdf"], "nowhere.urdf"),
        (&["embedded:walk", "--out", "x.txt"], "--out: expected the name of a .png or .html file"),
    ];
    for (arguments, words) in cases {
        let answer = room.skiagraph(["inspect"].iter().chain(arguments));
        assert_eq!(answer.code, 2, "{arguments:?}: {}", answer.stderr);
        assert!(answer.stderr.contains(words), "{arguments:?}: {}", answer.stderr);
    }
    assert!(!room.path("x.txt").exists());
}

#[test]
fn robots_recordings_and_skins_are_pictured() {
    let room = Sandbox::new();
    for (what, picture) in [("tracker25", "robot.png"), ("embedded:walk", "clip.html"), ("person_coarse", "skin.png")] {
        room.succeed(&format!("inspect {what} --out {picture}"));
        let bytes = fs::read(room.path(picture)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG") || bytes.starts_with(b"<!doctype html>"), "{picture}");
    }
    let skin = json(&room, &["person_coarse"]);
    assert_eq!((skin["what"].as_str(), skin["triangles"].as_u64()), (Some("skin"), Some(1000)));
    assert!((40.0..90.0).contains(&skin["litres"].as_f64().unwrap()), "{}", skin["litres"]);
    let clip = json(&room, &["embedded:walk"]);
    assert!(clip["fit"]["mean_mm"].as_f64().unwrap() < 5.0, "{}", clip["fit"]);
}

/// A picture of a recording with unknown names.
#[test]
fn facts_of_a_recording_with_unknown_joints_are_printed_although_there_is_no_picture() {
    let room = Sandbox::new();
    let text = fs::read_to_string(shipped("scenarios/motions/01_01.bvh")).unwrap();
    let mut count = 0;
    let renamed = text.lines().map(|line| {
        let indent = &line[..line.len() - line.trim_start().len()];
        let kind = line.trim_start().split(' ').next().unwrap();
        count += 1;
        if ["ROOT", "JOINT"].contains(&kind) { format!("{indent}{kind} thing{count}\n") } else { format!("{line}\n") }
    });
    room.write("strange.bvh", renamed.collect::<String>());
    let plain = room.skiagraph(["inspect", "strange.bvh"]);
    let drawn = room.skiagraph(["inspect", "strange.bvh", "--out", "strange.png"]);
    assert_eq!((plain.code, drawn.code), (0, 0), "{}", drawn.stderr);
    assert!(drawn.stdout.contains("cannot be retargeted") && drawn.stdout.contains("there is no picture"));
    assert!(!drawn.stdout.contains("pictures:") && room.entries() == ["strange.bvh"], "{:?}", room.entries());
}

/// A standing body whose third axis points up: markers by the names of landmarks, two frames, metres.
const Z_UP: [(&str, [f64; 3]); 15] = [
    ("pelvis", [2.0, 3.0, 0.95]),
    ("thorax", [2.0, 3.0, 1.45]),
    ("head_top", [2.0, 3.0, 1.75]),
    ("left_shoulder", [2.0, 3.18, 1.4]),
    ("left_elbow", [2.0, 3.2, 1.1]),
    ("left_wrist", [2.05, 3.2, 0.85]),
    ("right_shoulder", [2.0, 2.82, 1.4]),
    ("right_elbow", [2.0, 2.8, 1.1]),
    ("right_wrist", [2.05, 2.8, 0.85]),
    ("left_hip", [2.0, 3.09, 0.93]),
    ("left_knee", [2.02, 3.09, 0.5]),
    ("left_ankle", [2.0, 3.09, 0.08]),
    ("right_hip", [2.0, 2.91, 0.93]),
    ("right_knee", [2.02, 2.91, 0.5]),
    ("right_ankle", [2.0, 2.91, 0.08]),
];

#[test]
fn a_trc_file_with_z_up_stands_and_it_is_said_why() {
    let room = Sandbox::new();
    let names: String = Z_UP.iter().map(|(name, _)| format!("\t{name}\t\t")).collect();
    let row: String = Z_UP.iter().flat_map(|(_, place)| place).map(|c| format!("\t{c}")).collect();
    room.write(
        "z.trc",
        format!(
            "PathFileType\t4\t(X/Y/Z)\tz.trc\nDataRate\tUnits\n60\tm\nFrame#\tTime{names}\n\t\tX1\n\n1\t0.0{row}\n2\t0.1{row}\n"
        ),
    );
    let said = json(&room, &["z.trc"]);
    assert!((1.5..1.8).contains(&said["height_m"].as_f64().unwrap()), "{said}");
    assert!(said["notes"].to_string().contains("up axis: Z, although TRC files usually have Y"), "{said}");
}
