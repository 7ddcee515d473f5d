//! A command replaces output of the same command, and nothing else.

use std::fs;

use serde_json::Value;

use crate::sandbox::Sandbox;

/// Repeating the command succeeds; another command is refused with the difference, and renames the output with --force.
fn assert_rule(room: &Sandbox, place: &str, same: &str, other: &str, difference: &str) {
    room.succeed(same);
    room.succeed(same);
    let file = |place: &str| {
        let path = room.path(place);
        fs::read(if path.is_dir() { path.join("skiagraph.sha256") } else { path }).unwrap()
    };
    let before = file(place);
    let said = room.refused(other, difference);
    assert!(said.contains("write elsewhere") && said.contains("--force"), "{said}");
    assert_eq!(file(place), before, "{other} changed nothing");
    room.succeed(&format!("{other} --force"));
    assert_eq!(file(&format!("{place}~")), before, "{other} --force moved it aside");
    assert_ne!(file(place), before);
}

/// They are refused with the key that differs.
#[test]
fn other_settings_replace_no_run() {
    let room = Sandbox::with_set();
    let run = "run tiny.toml -q --out run";
    assert_rule(&room, "run", run, &format!("{run} particles=13"), "particles: was 12, now 13");
    let track = "track set --tracker frozen --seeds 2 -q --out track";
    assert_rule(&room, "track", track, &track.replace("--seeds 2", "--seeds 3"), "seeds: was [0,1], now [0,1,2]");
    let apf = "track set --tracker annealed_particle_filter particles=9 layers=1 -q --out apf";
    assert_rule(&room, "apf", apf, &apf.replace("=9", "=8"), "particles: was 9, now 8");
    // without --out, each has a separate folder
    for (overrides, place) in [("", "tiny"), ("particles=13", "tiny-2"), ("", "tiny"), ("particles=13", "tiny-2")] {
        room.succeed(&format!("run tiny.toml {overrides}"));
        assert!(room.path(format!("runs/{place}/run.json")).exists());
    }
    assert_eq!(room.entries_of("runs"), ["tiny", "tiny-2"]);
}

#[test]
fn estimates_have_their_own_folders() {
    let room = Sandbox::with_set();
    room.succeed("track set --tracker frozen -q --out run");
    let poses = room.read("run/poses.npz");
    fs::create_dir(room.path("mine")).unwrap();
    for name in ["mine.npz", "mine/poses.npz", "yours.npz"] {
        room.write(name, &poses);
    }
    for (estimate, place) in
        [("mine.npz", "mine.npz-evaluation"), ("mine", "mine-evaluation"), ("mine.npz", "mine.npz-evaluation")]
    {
        room.succeed(&format!("evaluate set {estimate} -q"));
        let run: Value = room.json(&format!("{place}/run.json"));
        assert_eq!(run["estimate"], estimate);
    }
    // another set uses the next name
    room.succeed("render tiny.toml name=other --out other -q");
    room.succeed("evaluate other mine.npz -q");
    assert!(room.path("mine.npz-evaluation-2/run.json").exists());
    let entries = room.entries();
    assert_eq!(entries.iter().filter(|name| name.contains("-evaluation")).count(), 3, "{entries:?}");
    let evaluate = "evaluate set mine.npz -q --out results";
    let other = "evaluate set yours.npz -q --out results";
    assert_rule(&room, "results", evaluate, other, "mine.npz, now ");
}

/// Models of another training are refused, and sets are replaced with `--force` only.
#[test]
fn force_keeps_what_differs() {
    let room = Sandbox::with_set();
    let train = "train embedded:walk --model gpdm -q --out walk.model";
    assert_rule(&room, "walk.model", train, &format!("{train} --last-frame 30"), "learned_from");
    for (force, code) in [("", 2), (" --force", 0)] {
        let again = room.ask(&format!("render tiny.toml --out set{force}"));
        assert_eq!(again.code, code, "{}", again.stderr);
        assert!(!room.path("set~").exists(), "the same command made it");
    }
    // a set of another scenario, view or noise draw is kept
    let hash = |set: &str| room.read(&format!("{set}/files.sha256"));
    let mut aside = "set~".to_owned();
    for (number, (other, difference)) in [
        ("rig.ring.radius_m=4.0", "rig.ring.radius_m: was 3.5, now 4.0"),
        ("rig.ring.count=1", "rig.ring.count: was 2, now 1"),
        ("rig.ring.count=1 truth_images=[\"depth\"]", "truth_images: was nothing, now [\"depth\"]"),
        ("rig.ring.count=1 motion.last_frame=2", "motion.last_frame: was 3, now 2"),
    ]
    .into_iter()
    .enumerate()
    {
        let before = hash("set");
        let made = room.ask(&format!("render tiny.toml {other} --out set --force"));
        assert_eq!(made.code, 0, "{}", made.stderr);
        let words = format!("note: set: another set was here ({difference}); it is kept as {aside}");
        assert!(made.stderr.contains(&words), "{other}: {}", made.stderr);
        assert_eq!(hash(&aside), before, "{other}");
        assert_ne!(hash("set"), before, "{other}");
        aside = format!("set~{}", number + 2);
    }
    // a fresh key differs every time, but the command is the same
    let drawn = "render tiny.toml calibration_mm=20 --out drawn -q";
    room.succeed(drawn);
    let before = hash("drawn");
    room.succeed(&format!("{drawn} --force"));
    assert!(hash("drawn") != before && !room.path("drawn~").exists());
    room.succeed(&format!("{drawn} --force --key default"));
    assert!(room.path("drawn~").exists(), "a stated key is a setting");
    // a truth at the output path of a public set is kept
    let truth = hash("drawn");
    room.succeed("render tiny.toml calibration_mm=20 --out drawn --truth whole --force -q");
    assert_eq!(hash("drawn~2"), truth);
    room.succeed("render tiny.toml calibration_mm=20 --out drawn --truth whole --force -q");
    assert!(!room.path("drawn~3").exists() && !room.path("whole~").exists(), "the same command made both");
}
