//! A command replaces output of the same command, and nothing else.

use std::fs;

use serde_json::Value;

use crate::sandbox::{CommandOutput, Sandbox, TINY};

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set -q");
    room
}

fn ask(room: &Sandbox, command: &str) -> CommandOutput {
    room.skiagraph(command.split(' '))
}

/// Repeating the command succeeds; another command is refused with the difference, and renames the output with --force.
fn assert_rule(room: &Sandbox, place: &str, same: &str, other: &str, difference: &str) {
    room.succeed(same);
    room.succeed(same);
    let file = |place: &str| {
        let path = room.path(place);
        fs::read(if path.is_dir() { path.join("skiagraph.sha256") } else { path }).unwrap()
    };
    let before = file(place);
    let refused = ask(room, other);
    assert_eq!(refused.code, 2, "{other}: {}", refused.stderr);
    assert!(refused.stderr.contains(difference), "{other}: {}", refused.stderr);
    assert!(refused.stderr.contains("--out") && refused.stderr.contains("--force"), "{}", refused.stderr);
    assert_eq!(file(place), before, "{other} changed nothing");
    room.succeed(&format!("{other} --force"));
    assert_eq!(file(&format!("{place}~")), before, "{other} --force moved it aside");
    assert_ne!(file(place), before);
}

#[test]
fn runs_with_other_settings_are_refused_with_the_key_that_differs() {
    let room = room();
    let run = "run tiny.toml -q --out run";
    assert_rule(&room, "run", run, &format!("{run} particles=13"), "particles: was 12, now 13");
    let track = "track set --tracker frozen --seeds 2 -q --out track";
    assert_rule(&room, "track", track, &track.replace("--seeds 2", "--seeds 3"), "seeds: was [0,1], now [0,1,2]");
    let apf = "track set --tracker annealed_particle_filter particles=9 layers=1 -q --out apf";
    assert_rule(&room, "apf", apf, &apf.replace("=9", "=8"), "particles: was 9, now 8");
    let other_command = ask(&room, "track set --tracker frozen --out run");
    let said = "command: was skiagraph run, now skiagraph track";
    assert!(other_command.code == 2 && other_command.stderr.contains(said), "{}", other_command.stderr);
    let exec = "track set --exec true --out track";
    assert!(ask(&room, exec).stderr.contains("now skiagraph track --exec"), "refused before it is started");
    // without --out, each has a separate folder
    for (overrides, place) in [("", "tiny"), ("particles=13", "tiny-2"), ("", "tiny"), ("particles=13", "tiny-2")] {
        room.succeed(&format!("run tiny.toml {overrides}"));
        assert!(room.path(&format!("runs/{place}/run.json")).exists());
    }
    assert_eq!(fs::read_dir(room.path("runs")).unwrap().count(), 2);
}

#[test]
fn evaluations_of_different_estimates_have_different_folders() {
    let room = room();
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
        let run: Value = serde_json::from_slice(&room.read(&format!("{place}/run.json"))).unwrap();
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
    let tracked = ask(&room, "evaluate set mine.npz --out run");
    let said = "command: was skiagraph track, now skiagraph evaluate";
    assert!(tracked.code == 2 && tracked.stderr.contains(said), "{}", tracked.stderr);
}

#[test]
fn an_export_to_another_format_or_of_another_set_does_not_replace_an_earlier_one() {
    let room = room();
    room.succeed("render tiny.toml name=other --out other -q");
    let export = "export set --to trc -q --out exported";
    assert_rule(&room, "exported", export, &export.replace("trc", "tum"), "format: was Markers as TRC, now The root's");
    let of_set = "export set --to opencv -q --out cameras";
    assert_rule(&room, "cameras", of_set, &of_set.replace("export set", "export other"), "set: was \"tiny\" of");
    room.succeed("track set --tracker frozen -q --out run");
    for (command, difference) in [
        ("export set --to trc --out run", "was skiagraph track, now skiagraph export"),
        ("track set --tracker frozen --out cameras", "was skiagraph export, now skiagraph track"),
    ] {
        let refused = ask(&room, command);
        assert!(refused.code == 2 && refused.stderr.contains(difference), "{command}: {}", refused.stderr);
    }
}

#[test]
fn models_of_another_training_are_refused_and_sets_are_replaced_with_force_only() {
    let room = room();
    let train = "train embedded:walk --model gpdm -q --out walk.model";
    assert_rule(&room, "walk.model", train, &format!("{train} --last-frame 30"), "learned_from");
    for (force, code) in [("", 2), (" --force", 0)] {
        let again = ask(&room, &format!("render tiny.toml --out set{force}"));
        assert_eq!(again.code, code, "{}", again.stderr);
        assert!(!room.path("set~").exists(), "the same command made it");
    }
    // a set of another scenario, view or noise draw is kept
    let hash = |set: &str| room.read(&format!("{set}/files.sha256"));
    let mut aside = "set~".to_owned();
    for (number, (other, difference)) in [
        ("rig.ring.radius_m=4.0", "its motion, bodies, cameras or observations differ"),
        ("rig.ring.count=1", "cameras: was 2, now 1"),
        ("rig.ring.count=1 layers=[\"depth\"]", "its layers, shards or other files differ"),
        ("rig.ring.count=1 motion.last_frame=2", "frames: was 5, now 3"),
    ]
    .into_iter()
    .enumerate()
    {
        let before = hash("set");
        let made = ask(&room, &format!("render tiny.toml {other} --out set --force"));
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
