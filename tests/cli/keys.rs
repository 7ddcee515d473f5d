//! Keys of sets: others cannot reproduce the random errors of observations, and no public file confirms a guess.

use nalgebra::Vector3;
use skiagraph_set::{BenchmarkSet, BlindSet};
use skiagraph_truth::observing::{Corruption, tracker_rig};
use skiagraph_truth::retarget::SegmentLengths;
use std::fs;

use crate::sandbox::{Sandbox, TINY, shipped, wait_until};

const KEY: &str = "00112233445566778899aabbccddeeff";

/// Errors of the cameras and the start pose that a tracker gets: metres and radians.
fn errors(room: &Sandbox, set: &str) -> Vec<f64> {
    let set = BenchmarkSet::read(&room.path(set)).unwrap();
    let pairs = set.blind.rig.cameras.iter().zip(&set.truth.rig.rig().cameras);
    let of_camera = |(told, seen): (&skiagraph_core::camera::Camera, &skiagraph_core::camera::Camera)| {
        let turned = told.camera_from_world.rotation * seen.camera_from_world.rotation.inverse();
        let parts: [Vector3<f64>; 2] = [told.centre() - seen.centre(), turned.scaled_axis()];
        parts.map(|part| [part.x, part.y, part.z]).concat()
    };
    let refitted = &set.truth.refitted.as_ref().unwrap().poses[0];
    let start = set.blind.start.pose.world_from_root.translation.vector - refitted.world_from_root.translation.vector;
    pairs.flat_map(of_camera).chain(start.iter().copied()).collect()
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    product(a, b) / (product(a, a) * product(b, b)).sqrt()
}

/// By those of another motion of the same rig and seed.
#[test]
fn errors_cannot_be_subtracted() {
    let room = Sandbox::tiny();
    let settings = "rig.ring.count=32 rig.ring.size_px=[16,12] calibration_mm=20 calibration_deg=1 start_mm=40";
    let (hidden, own) = ("motion.last_frame=3", "motion.first_frame=21 motion.last_frame=23");
    for (place, key) in [("public", "--key default"), ("fresh", "")] {
        room.succeed(&format!("render tiny.toml {hidden} {settings} {key} --out {place}-hidden -q"));
        room.succeed(&format!("render tiny.toml {own} {settings} {key} --out {place}-own -q"));
    }
    // all have about the same size: 20 mm, 17 mrad, 40 mm
    let [a, b] = ["public-hidden", "public-own"].map(|set| errors(&room, set));
    let farthest = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(a.len() == 195 && farthest < 1e-9, "the attack: {farthest} in {} numbers", a.len());
    let [a, b] = ["fresh-hidden", "fresh-own"].map(|set| errors(&room, set));
    let shared = correlation(&a, &b);
    assert!(shared.abs() < 5.0 / 195.0_f64.sqrt(), "{shared}");
    let rest: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    let size = |errors: &[f64]| errors.iter().map(|e| e * e).sum::<f64>();
    assert!(size(&rest) > 1.2 * size(&a), "subtraction makes it worse: {} and {}", size(&rest), size(&a));
}

/// A search over seeds finds only that of a set with the public key.
#[test]
fn own_keys_hide_the_seed() {
    let room = Sandbox::tiny();
    let settings = "calibration_mm=20 observation.seed=2137";
    room.succeed(&format!("render tiny.toml {settings} --key default --out public -q"));
    room.succeed(&format!("render tiny.toml {settings} --out fresh -q"));
    let corruption = Corruption { calibration_mm: 20.0, ..Corruption::default() };
    let found = |set: &str| -> Vec<u64> {
        let set = BenchmarkSet::read(&room.path(set)).unwrap();
        let told = set.blind.rig.cameras[0].centre();
        let draws =
            |seed: &u64| (tracker_rig(set.truth.rig.rig(), &corruption, *seed).cameras[0].centre() - told).norm();
        (0..20_000).filter(|seed| draws(seed) < 1e-5).collect()
    };
    assert_eq!(found("public"), [2137]);
    assert_eq!(found("fresh"), [] as [u64; 0]);
}

/// Every render draws one, which is printed once.
#[test]
fn keys_render_the_same_again() {
    let room = Sandbox::tiny();
    let settings = "observation.silhouette=corrupted boundary_px=1 wrong_body_percent=5 start_mm=10";
    let render = |more: &str| room.succeed(&format!("render tiny.toml {settings} {more}")).stderr;
    let said = render("--out a");
    assert_eq!(said.matches("only stored in a/truth/key.txt").count(), 1, "{said}");
    render("--out b");
    let [a, b] = ["a", "b"].map(|set| room.text(&format!("{set}/truth/key.txt")));
    assert!(a != b && a.trim_end().len() == 32, "{a} {b}");
    for file in ["observations/cam00/silhouette/000002.png", "start/start.json", "start/body.json"] {
        assert_ne!(room.read(&format!("a/{file}")), room.read(&format!("b/{file}")), "{file}");
    }
    let said = render(&format!("--key {} --out again", a.trim_end()));
    assert!(!said.contains("key"), "nothing was drawn: {said}");
    assert_eq!(room.read("again/files.sha256"), room.read("a/files.sha256"));
    // the public key is not secret, and the key of a scenario is used
    render("--key default --out public");
    render("--key 00000000000000000000000000000000 --out zeros");
    assert!(!room.path("public/truth/key.txt").exists());
    assert_eq!(room.read("public/files.sha256"), room.read("zeros/files.sha256"));
    room.write("keyed.toml", format!("{TINY}\n[observation]\nkey = \"{}\"\n", a.trim_end()));
    room.succeed(&format!("render keyed.toml {settings} --out keyed"));
    assert_eq!(room.read("keyed/files.sha256"), room.read("a/files.sha256"));
    room.succeed(&format!("render keyed.toml {settings} --key default --out overridden"));
    assert_eq!(room.read("overridden/files.sha256"), room.read("public/files.sha256"));
}

/// And runs have the public one.
#[test]
fn exact_sets_have_no_key() {
    let room = Sandbox::tiny();
    let layers = "truth_images=[\"colour\"]";
    for (set, key) in [("a", ""), ("b", ""), ("c", "--key default")] {
        let said = room.succeed(&format!("render tiny.toml {layers} {key} --out {set}")).stderr;
        assert!(!said.contains("key"), "{said}");
        assert_eq!(room.read(&format!("{set}/files.sha256")), room.read("a/files.sha256"));
    }
    assert!(!room.path("a/truth/key.txt").exists());
    let settings = "observation.silhouette=corrupted holes=0.1 start_mm=10";
    for run in ["one", "two"] {
        room.succeed(&format!("run tiny.toml seeds=1 {settings} --out {run}"));
    }
    assert_eq!(room.read("one/poses.npz"), room.read("two/poses.npz"));
    room.succeed(&format!("run tiny.toml seeds=1 {settings} observation.key=\"{KEY}\" --out other"));
    assert_ne!(room.read("one/poses.npz"), room.read("other/poses.npz"));
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

/// They hold no key, and no hash of the truth.
#[test]
fn public_files_confirm_no_guess() {
    let room = Sandbox::tiny();
    for (name, settings) in [("exact", ""), ("spoiled", "calibration_mm=20 truth_images=[\"depth\"]")] {
        room.succeed(&format!("render tiny.toml {settings} --out {name} --truth {name}-secret -q"));
        room.succeed(&format!("track {name} --tracker frozen --out {name}-run -q"));
        let key = room.text(&format!("{name}-secret/truth/key.txt"));
        let raw: Vec<u8> = (0..32).step_by(2).map(|at| u8::from_str_radix(&key[at..at + 2], 16).unwrap()).collect();
        // somebody who guesses the motion renders it exactly and with other random errors
        let mut known = Vec::new();
        for (guess, key) in [("plain", "--key default"), ("own", ""), ("told", KEY)] {
            let arguments = if key == KEY { format!("--key {KEY}") } else { key.to_owned() };
            let guess = format!("{name}-{guess}");
            room.succeed(&format!("render tiny.toml {settings} {arguments} --out {guess} -q"));
            let listing = room.text(&format!("{guess}/files.sha256"));
            let of_truth = listing.lines().filter(|line| line.contains("  truth/"));
            known.extend(of_truth.map(|line| line[..64].to_owned()));
            known.push(BlindSet::read(&room.path(&guess)).unwrap().set_hash);
        }
        assert!(known.len() > 15, "{}", known.len());
        for file in [room.files_below(name), room.files_below(&format!("{name}-run"))].concat() {
            let bytes = room.read(&file);
            assert!(!contains(&bytes, key.trim_end().as_bytes()) && !contains(&bytes, &raw));
            let confirmed = known.iter().find(|hash| contains(&bytes, hash.as_bytes()));
            assert_eq!(confirmed, None, "{}", String::from_utf8_lossy(&bytes));
        }
        // the public set and the truth match each other and no other set
        room.succeed(&format!("evaluate {name} {name}-run --truth {name}-secret -q"));
        room.says(&format!("verify {name} --truth {name}-secret"), &[&format!("{name} is sound")]);
        let refused = room.skiagraph(["verify", name, "--truth", &format!("{name}-plain")]);
        assert!(refused.code == 2 && refused.stderr.contains("is not the truth of"), "{}", refused.stderr);
    }
}

#[test]
fn killed_drawing_keeps_its_key() {
    let room = Sandbox::tiny();
    let settings = "observation.silhouette=corrupted boundary_px=1 motion.last_frame=39 motion.loop_to_s=20";
    let mut child = room.start(&format!("render tiny.toml {settings} --out set -q"));
    let journal = room.path("set.partial/finished.sha256");
    wait_until(&mut child, || fs::read_to_string(&journal).map_or(0, |text| text.lines().count()) >= 40);
    child.kill().unwrap();
    child.wait().unwrap();
    let begun = room.json("set.partial/made_by.json");
    let begun = begun["inputs"]["--key"].as_str().unwrap().to_owned();
    let other = room.ask(&format!("render tiny.toml {settings} --key {KEY} --out set"));
    assert!(other.code == 2 && other.stderr.contains("--key: the unfinished set has another key"), "{}", other.stderr);
    assert!(!other.stderr.contains(&begun), "{}", other.stderr);
    room.notes(&format!("render tiny.toml {settings} --out set"), &["note: resumed: "]);
    assert_eq!(room.text("set/truth/key.txt").trim_end(), begun);
    room.succeed(&format!("render tiny.toml {settings} --key {begun} --out whole -q"));
    assert_eq!(room.read("set/files.sha256"), room.read("whole/files.sha256"));

    for level in [0, 10, 20] {
        room.succeed(&format!("render tiny.toml calibration_mm={level} --key {KEY} --out level-{level} -q"));
    }
    let [exact, weak, strong] = ["0", "10", "20"].map(|level| errors(&room, &format!("level-{level}")));
    assert!(exact.iter().all(|e| e.abs() < 1e-9));
    // start and turns are exact in both
    assert!(weak.iter().zip(&strong).all(|(weak, strong)| (2.0 * weak - strong).abs() < 1e-9));
}

#[test]
fn keyless_set_is_the_baselines() {
    let room = Sandbox::new();
    let scenario = shipped("scenarios/smoke/matched.toml");
    let rendered = room.json_of(&format!("render {} --out set --json -q", scenario.display()));
    let baseline = fs::read(shipped("results/baselines/smoke-matched.json")).unwrap();
    let baseline: serde_json::Value = serde_json::from_slice(&baseline).unwrap();
    let mut hashes = Vec::new();
    let mut look = vec![&baseline];
    while let Some(value) = look.pop() {
        hashes.extend(value.get("set_hash"));
        look.extend(value.as_object().into_iter().flat_map(|object| object.values()));
    }
    assert_eq!(hashes, [&rendered["set_hash"]]);
}

/// Limb lengths of the tracker's body, relative to those without a mismatch.
fn factors(room: &Sandbox, settings: &str) -> Vec<f64> {
    let lengths = |set: &str, more: &str| {
        room.succeed(&format!("render tiny.toml {settings} {more} --out {set} --force -q"));
        let body = BlindSet::read(&room.path(set)).unwrap().start.body;
        let SegmentLengths { upper_arm, forearm, thigh, shank, .. } = SegmentLengths::from_body(&body);
        [upper_arm, forearm, thigh, shank].concat().into_iter().map(Option::unwrap).collect::<Vec<_>>()
    };
    let (wrong, right) = (lengths("wrong", ""), lengths("right", "mismatch=none"));
    wrong.iter().zip(&right).map(|(wrong, right)| wrong / right).collect()
}

/// That of all subjects, or of each, and of the key.
#[test]
fn mismatch_is_drawn_as_asked() {
    let room = Sandbox::tiny();
    let tall = "actor.shape={stature_m=1.95}";
    let key = format!("--key {KEY}");
    let [one, other] = [key.as_str(), &format!("{tall} {key}")].map(|settings| factors(&room, settings));
    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(near(&one, &other), "by the seed alone: {one:?} {other:?}");
    let by = |settings: &str| factors(&room, &format!("mismatch_by=subject {settings}"));
    let own = by("--key default");
    assert!(!near(&own, &one) && own.iter().all(|factor| (factor - 1.0).abs() <= 0.0301), "{own:?}");
    assert!(near(&by("--key default motion.first_frame=11 motion.last_frame=13"), &own), "the subject is the same");
    assert!(!near(&by(&format!("--key default {tall}")), &own));
    let keyed = by(&key);
    assert!(!near(&keyed, &own) && near(&by(&key), &keyed));
    assert!(!near(&by(""), &by("")), "fresh keys");
}
