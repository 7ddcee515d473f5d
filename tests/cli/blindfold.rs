//! Trackers cannot read poses of the test, and cannot learn from the test or from copies of it.

use std::fs;
use std::path::PathBuf;

use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_set::{BenchmarkSet, BlindSet, Training, VerifyOptions, verify};
use skiagraph_truth::mocap::{Clip, ReadOptions, read};
use skiagraph_truth::retarget::MotionFingerprint;

use crate::sandbox::Sandbox;

fn shipped(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/motions")).join(name)
}

const SMALL: &str = r#"
schema = "skiagraph.scenario/1"
name = "small"
[motion]
clip = "embedded:walk"
START
[rig.ring]
count = 2
size_px = [80, 60]
TRAINING
[tracker.annealed_particle_filter]
particles = 12
layers = 2
"#;

fn small(start: &str, training: &str) -> String {
    SMALL.replace("START", start).replace("TRAINING", training)
}

#[test]
fn tracker_input_has_no_test_pose() {
    let room = Sandbox::new();
    room.succeed("render rig.ring.size_px=[80,60] --out default");
    room.write("jumps.bvh", fs::read(shipped("01_01.bvh")).unwrap());
    let training = "[[training.clips]]\nclip = \"jumps.bvh\"\nfirst_frame = 200\nlast_frame = 500";
    room.write("small.toml", small("", training));
    room.succeed("render small.toml --out trained");
    let faults = |set: &str| {
        let found = verify(&room.path(set), VerifyOptions::default()).unwrap();
        found.faults().map(|(check, fault)| format!("{check}: {}", fault.file)).collect::<Vec<String>>()
    };
    assert_eq!([faults("default"), faults("trained")].concat(), [""; 0]);
    let blind = BlindSet::read(&room.path("default")).unwrap();
    assert!(matches!(&blind.start.training, Training::Spread(spread) if spread.change.iter().all(|x| *x > 0.0)));
    assert!(!room.path("default/start/training.npz").exists());
    let set_toml = fs::read_to_string(room.path("default/set.toml")).unwrap();
    assert!(!set_toml.contains("embedded") && set_toml.contains("start/spread.npz"), "{set_toml}");
    assert!(fs::read_to_string(room.path("default/truth/facts.toml")).unwrap().contains("embedded:walk"));

    room.write("default/start/training.npz", room.read("default/truth/truth.npz"));
    assert_eq!(faults("default"), ["hashes: start/training.npz"]);
}

/// Rows `first` to `last` of the shipped BVH file in steps of `step`, renumbered.
fn part_of_jumps(first: usize, last: usize, step: usize) -> String {
    let text = fs::read_to_string(shipped("01_01.bvh")).unwrap();
    let (skeleton, motion) = text.split_once("MOTION").unwrap();
    let rows: Vec<&str> = motion.trim().lines().skip(2).skip(first - 1).take(last + 1 - first).step_by(step).collect();
    let frame_time = step as f64 / 120.0;
    format!("{skeleton}MOTION\nFrames: {}\nFrame Time: {frame_time}\n{}\n", rows.len(), rows.join("\n"))
}

/// As training, at any name, rate and part.
#[test]
fn copies_of_the_test_are_refused() {
    let room = Sandbox::new();
    let walk = fs::read_to_string(shipped("humanoid3d_walk.txt")).unwrap();
    room.write("renamed.txt", &walk);
    room.write("renamed.json", &walk);
    room.write("spaced.json", walk.replace("],", "] ,"));
    #[cfg(unix)]
    std::os::unix::fs::symlink(room.path("renamed.txt"), room.path("linked.txt")).unwrap();
    room.write("jumps.bvh", part_of_jumps(1000, 1400, 1));
    room.write("cropped.bvh", part_of_jumps(1350, 1700, 1));
    room.write("slow.bvh", part_of_jumps(1200, 1700, 4));
    room.write("other.bvh", part_of_jumps(1401, 1700, 1));
    let test_of_jumps =
        |clip: &str| small("", &format!("[[training.clips]]\nclip = \"{clip}\"")).replace("embedded:walk", "jumps.bvh");
    let test_of_walk = |clip: &str| small("", &format!("[[training.clips]]\nclip = \"{clip}\""));
    let mut cases = vec![
        ("renamed.txt", test_of_walk("renamed.txt")),
        ("renamed.json", test_of_walk("renamed.json")),
        ("spaced.json", test_of_walk("spaced.json")),
        ("cropped.bvh", test_of_jumps("cropped.bvh")),
        ("slow.bvh", test_of_jumps("slow.bvh")),
    ];
    if cfg!(unix) {
        cases.push(("linked.txt", test_of_walk("linked.txt")));
    }
    for (clip, scenario) in cases {
        room.write("copied.toml", scenario);
        room.refused("check copied.toml", &format!("of `{clip}` are also frames of [motion]"));
    }
    room.write("other.toml", test_of_jumps("other.bvh"));
    room.succeed("check other.toml");
}

/// And formats of one take are not.
#[test]
fn different_takes_are_distinguished() {
    let Some(folder) = crate::support::test_data("mocap") else { return };
    let mut files: Vec<PathBuf> =
        fs::read_dir(folder.join("cmu_asf_amc")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "amc"));
    files.sort();
    let clips: Vec<Clip> = files.iter().map(|path| read(path, &ReadOptions::default()).unwrap()).collect();
    let of = |clip: &Clip| MotionFingerprint::from_clip(clip, &Default::default()).unwrap();
    let takes: Vec<MotionFingerprint> = clips.iter().map(of).collect();
    for (i, a) in takes.iter().enumerate() {
        for (j, b) in takes.iter().enumerate().skip(i) {
            assert_eq!(a.shared_with(b).is_some(), i == j, "{} and {}", files[i].display(), files[j].display());
        }
        let (clip, middle) = (&clips[i], clips[i].frames.len() / 2);
        let half = |frames| of(&clip.clone().crop(frames).unwrap());
        let shared = half(0..middle).shared_with(&half(middle..clip.frames.len()));
        assert_eq!(shared, None, "halves of {}", files[i].display());
    }
    let bvh = of(&read(&folder.join("bvh/cmu_mb_01_01.bvh"), &ReadOptions::default()).unwrap());
    let amc = files.iter().position(|path| path.ends_with("01_01_f0001-0700.amc")).unwrap();
    let shared = takes[amc].shared_with(&bvh).expect("one take in two formats");
    assert!(shared.own.0.abs_diff(shared.other.0) <= 1, "the BVH's first frame is a rest pose: {shared:?}");
}

/// By `run` and by `evaluate`.
#[test]
fn model_of_a_copy_is_refused() {
    let room = Sandbox::new();
    room.write("copy.json", fs::read(shipped("humanoid3d_walk.txt")).unwrap());
    room.succeed("train copy.json --model gpdm --out copy.model --quiet");
    room.succeed("train embedded:run --model gpdm --out run.model --quiet");
    let on = |model: &str| format!("tracker.gpdm.model_file={model} tracker.gpdm.particles=20");
    room.write(
        "small.toml",
        small("last_frame = 12", "").replace("[tracker.annealed_particle_filter]\nparticles = 12\nlayers = 2\n", ""),
    );
    room.refused(
        &format!("run small.toml {} --out refused", on("copy.model")),
        "of `copy.json`, which are also frames",
    );

    room.succeed("render small.toml --out set");
    room.succeed("track set --tracker gpdm model_file=copy.model particles=20 --out blind");
    let learned = room.json("blind/track.json")["learned_from"].to_string();
    assert!(learned.contains("copy.model: copy.json"), "{learned}");
    room.refused("evaluate set blind", "memory, not tracking");
    assert!(!room.path("blind/run.json").exists());

    let npz = Npz::from_bytes("m", &fs::read(room.path("copy.model")).unwrap()).unwrap();
    let old: Npz = npz.iter().filter(|(n, _)| !n.starts_with("fingerprint")).map(|(n, a)| (n, a.clone())).collect();
    // like a file of an older version, with another file's hash and name
    let facts: Vec<u8> = match &old.get("facts").unwrap().values {
        Values::U8(bytes) => {
            String::from_utf8(bytes.clone()).unwrap().replace("copy.json", "elsewhere.txt").into_bytes()
        }
        other => panic!("{other:?}"),
    };
    let old: Npz = old
        .iter()
        .map(|(n, a)| if n == "facts" { (n, Array::new(&[facts.len()], facts.clone())) } else { (n, a.clone()) })
        .collect();
    room.write("old.model", old.to_bytes("m").unwrap());
    let said = room.ask(&format!("run small.toml {} --out old", on("old.model"))).stderr;
    assert!(said.contains("old.model has no motion fingerprints"), "{said}");

    room.says(&format!("run small.toml {} --out fine", on("run.model")), &["learned from: run.model: embedded:run"]);
    assert_eq!(room.json("fine/run.json")["learned_from"][0], "run.model: embedded:run, frames 1 to 25");
    let report = room.text("fine/report.html");
    assert!(report.contains("learned from") && report.contains("run.model: embedded:run"));
}

/// And the set has its heading.
#[test]
fn motion_begins_at_its_placement() {
    let room = Sandbox::new();
    room.write("placed.toml", small("start_m = [1.5, -2.0]\nheading_deg = 90", ""));
    room.write("plain.toml", small("", ""));
    let of = |set: &str| {
        room.succeed(&format!("render {set}.toml --out {set}"));
        let manifest: toml::Table = toml::from_slice(&fs::read(room.path(format!("{set}/set.toml"))).unwrap()).unwrap();
        let forward = manifest["sequence"]["forward"].as_array().unwrap().iter().map(|x| x.as_float().unwrap());
        let world = manifest["convention"]["world"].as_str().unwrap().to_owned();
        assert!(!world.contains("forward"), "{world}");
        (BenchmarkSet::read(&room.path(set)).unwrap(), forward.collect::<Vec<f64>>())
    };
    let (placed, forward) = of("placed");
    let first = &placed.truth.ground_truth.frames[0].pose;
    assert!(
        (first.world_from_root.translation.x - 1.5).abs() + (first.world_from_root.translation.y + 2.0).abs() < 1e-9
    );
    assert!((first.heading().unwrap().to_degrees() - 90.0).abs() < 1e-9);
    // refers to the tracker's body, which leans slightly differently
    assert!(forward[1] > 0.99 && forward[2] == 0.0 && placed.blind.forward == Some([forward[0], forward[1], 0.0]));
    let last = placed.truth.ground_truth.frames.last().unwrap().pose.world_from_root.translation;
    assert!(last.y > -1.5 && (last.x - 1.5).abs() < 0.3, "it walks the way it faces: {last:?}");
    let (plain, forward) = of("plain");
    assert_eq!(plain.truth.ground_truth.actor, placed.truth.ground_truth.actor);
    assert!(forward[0] > 0.95, "the shipped walk goes along +X: {forward:?}");
    room.refused("check plain.toml motion.heading_deg=1000", "heading_deg");
}
