//! Bad input gives exit code 2 and one message with the error, its place and the remedy, and leaves nothing behind.

use std::fs;

use crate::sandbox::{Sandbox, TINY, shipped};

/// `skiagraph run tiny.toml` with changes must be refused with a message that contains all of `words`.
fn assert_refused(room: &Sandbox, changes: &[&str], words: &[&str]) {
    if !room.path("tiny.toml").exists() {
        room.write("tiny.toml", TINY);
    }
    let before = room.entries();
    let answer = room.skiagraph(["run", "tiny.toml"].iter().chain(changes));
    let said = &answer.stderr;
    assert_eq!(answer.code, 2, "{changes:?}: {said}");
    let errors = said.lines().filter(|line| line.starts_with("error: ")).count();
    assert_eq!(errors, 1, "{changes:?}: {said}");
    for word in words {
        assert!(said.contains(word), "{changes:?}: no {word:?} in: {said}");
    }
    assert!(answer.stdout.is_empty() && !said.contains("panicked"), "{said}");
    assert_eq!(room.entries(), before, "{changes:?}");
}

/// The DeepMimic walk with modified frames.
fn walk_with(change: impl FnOnce(&mut Vec<Vec<serde_json::Value>>)) -> String {
    let text = fs::read_to_string(shipped("scenarios/motions/humanoid3d_walk.txt")).unwrap();
    let mut clip: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut frames = serde_json::from_value(clip["Frames"].take()).unwrap();
    change(&mut frames);
    clip["Frames"] = serde_json::to_value(frames).unwrap();
    clip.to_string()
}

#[test]
fn unusable_recordings_are_refused() {
    let room = Sandbox::new();
    let refused = |name: &str, text: &[u8], words: &[&str]| {
        room.write(name, text);
        assert_refused(&room, &[&format!("motion.clip={name}")], words);
        fs::remove_file(room.path(name)).unwrap();
    };
    room.write("tiny.toml", TINY);
    assert_refused(&room, &["motion.clip=missing.bvh"], &["motion.clip", "`missing.bvh`", "--mocap-dir"]);
    assert_refused(&room, &["motion.clip=embedded:wlak"], &["motion.clip", "did you mean `embedded:walk`?"]);
    refused("empty.bvh", b"", &["empty.bvh:1: expected"]);
    refused("binary.bvh", &[0xff, 0x00, 0x80], &["binary.bvh:1: expected"]);
    refused("truncated.bvh", b"HIERARCHY\nROOT Hips\n{\n  OFFSET 0 0", &["truncated.bvh:4: expected"]);
    let whole = walk_with(|_| {});
    refused("truncated.txt", &whole.as_bytes()[..whole.len() / 2], &["truncated.txt:"]);
    refused("huge.txt", walk_with(|f| f[5][3] = 1e300.into()).as_bytes(), &["huge.txt: frame 6", "found"]);
    refused("nan.txt", whole.replacen("0.84753", "NaN", 1).as_bytes(), &["nan.txt:"]);
    refused("none.txt", walk_with(Vec::clear).as_bytes(), &["none.txt", "at least 2 frames, found 0"]);
    refused("one.txt", walk_with(|f| f.truncate(1)).as_bytes(), &["one.txt", "at least 2 frames, found 1"]);
    refused("walk.doc", b"walk", &["walk.doc", ".bvh"]);
}

#[test]
fn a_frame_of_zeros_is_repaired_with_a_note() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY.replace("last_frame = 3", "last_frame = 12"));
    room.write("lost.txt", walk_with(|f| f[7][1..].fill(0.into())));
    let answer = room.succeed("check tiny.toml motion.clip=lost.txt");
    assert!(answer.stderr.contains("note: all channels were zero in frame 8"), "{}", answer.stderr);
}

#[test]
fn frames_beyond_the_clip_are_refused() {
    let room = Sandbox::new();
    assert_refused(&room, &["motion.last_frame=400"], &["override motion.last_frame=400", "1 to 39", "found 400"]);
    assert_refused(&room, &["motion.first_frame=0"], &["motion.first_frame: expected a frame number from 1, found 0"]);
    assert_refused(
        &room,
        &["motion.first_frame=9"],
        &["tiny.toml:8: motion.last_frame: expected a frame after the first, 9"],
    );
}

#[test]
fn missing_recordings_are_named_with_their_hash_and_source() {
    let room = Sandbox::new();
    let scenario = shipped("scenarios/cmu/walk4.toml").display().to_string();
    for more in [vec![], vec!["--mocap-dir", "nowhere"], vec!["--mocap-dir", "."]] {
        let answer = room.skiagraph([vec!["run", &scenario], more].concat());
        assert_eq!(answer.code, 2);
        for word in ["49_01.amc", "mocap.cs.cmu.edu", "ea482f9a4aec1cbc"] {
            assert!(answer.stderr.contains(word), "{}", answer.stderr);
        }
    }
}

#[test]
fn unusable_robots_are_refused() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let urdf = fs::read_to_string(shipped("robots/tracker25.urdf")).unwrap();
    let refused = |text: &str, words: &[&str]| {
        room.write("robot.urdf", text);
        assert_refused(&room, &["actor.robot=robot.urdf"], words);
    };
    assert_refused(&room, &["actor.robot=bender"], &["actor.robot", "`bender`", "tracker25, actor"]);
    refused(&urdf.replace("</robot>", ""), &["robot.urdf"]);
    let twice = r#"<joint name="again" type="fixed"><parent link="head"/><child link="pelvis"/></joint></robot>"#;
    refused(&urdf.replace("</robot>", twice), &["robot.urdf:", "pelvis"]);
    refused(&urdf.replace("</robot>", r#"<link name="other"/></robot>"#), &["robot.urdf", "other"]);
    let mesh = r#"<visual><geometry><mesh filename="gone.stl"/></geometry></visual>"#;
    let with_mesh = format!(
        r#"<link name="hat">{mesh}</link><joint name="hat_on" type="fixed"><parent link="head"/><child link="hat"/></joint></robot>"#
    );
    // a missing mesh is left out with a note if the body has other solids, and refused otherwise
    room.write("robot.urdf", urdf.replace("</robot>", &with_mesh));
    let noted = room.succeed("check tiny.toml actor.robot=robot.urdf");
    assert!(
        noted.stderr.contains("actor.robot: 1 of the meshes cannot be read and are left out: gone.stl"),
        "{}",
        noted.stderr
    );
    let alone = format!(r#"<robot name="hat"><link name="hat">{mesh}</link></robot>"#);
    refused(&alone, &["robot.urdf:", "gone.stl", "this body has no other geometry"]);
    room.write("robot.urdf", format!("{urdf}\0"));
    room.succeed("check tiny.toml actor.robot=robot.urdf");
}

#[test]
fn cameras_that_see_nothing_are_refused() {
    let room = Sandbox::new();
    assert_refused(&room, &["rig.ring.height_m=-0.5"], &["rig.ring.height_m", "above the ground", "-0.500"]);
    assert_refused(
        &room,
        &["rig.ring.look_at_m=[100.0, 0.0, 1.0]"],
        &["no camera sees the subject", "move the cameras"],
    );
    assert_refused(&room, &["rig.ring.count=0"], &["rig.ring.count: expected 1 to 64, found 0"]);
    let camera = |focal: f64, z: f64| {
        format!(
            "rig.camera=[{{size_px=[80, 60], matrix=[[{focal:.1}, 0, 40], [0, 60, 30], [0, 0, 1]], \
             rotation=[[1, 0, 0], [0, 0, -1], [0, 1, 0]], translation_m=[0, {z:.1}, 3]}}]"
        )
    };
    assert_refused(&room, &[&camera(0.0, 1.0)], &["rig.camera[0].matrix", "focal lengths", "found 0 and 60"]);
    assert_refused(&room, &[&camera(60.0, -1.0)], &["rig.camera[0].translation_m", "above the ground"]);
}

#[test]
fn settings_out_of_range_are_refused() {
    let room = Sandbox::new();
    for (setting, words) in [
        ("particles=0", "expected at least 1, found 0"),
        ("layers=0", "expected at least 1, found 0"),
        ("survival_rate=0.0", "above 0 and at most 1, found 0"),
        ("survival_rate=1.01", "above 0 and at most 1, found 1.01"),
        ("survival_rate=nan", "expected a finite number"),
        ("particles=many", "expected a whole number"),
        ("partciles=3", "did you mean `particles`?"),
    ] {
        assert_refused(&room, &[&format!("tracker.annealed_particle_filter.{setting}")], &[setting, words]);
    }
    assert_refused(&room, &["tracker.frosen={}"], &["did you mean `frozen`?"]);
    assert_refused(&room, &["seeds=0"], &["override seeds=0: seeds: expected 1 to"]);
    assert_refused(&room, &["tracker_body.mismatch.percent={length=80.0, girth=1.0}"], &["0 to 50, found 80"]);
}

#[test]
fn unknown_layers_are_refused() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    for (layers, words) in [
        ("layers=[\"heat\"]", "known here: depth, parts"),
        ("layers=[\"depth\",\"depth\"]", "every layer at most once"),
    ] {
        let answer = room.skiagraph(["render", "tiny.toml", layers, "--out", "set"]);
        assert_eq!(answer.code, 2, "{}", answer.stderr);
        assert!(answer.stderr.contains("layers") && answer.stderr.contains(words), "{}", answer.stderr);
    }
    assert_eq!(room.entries(), ["tiny.toml"]);
}

#[test]
fn unknown_keys_are_reported_with_their_line() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY.replace("radius_m", "raduis_m"));
    let line = "12 | raduis_m = 3.5\n     | ^^^^^^^^";
    assert_refused(&room, &[], &["tiny.toml:12: rig.ring.raduis_m: unknown key", "did you mean `radius_m`?", line]);
    room.write("tiny.toml", TINY.replace("skiagraph.scenario/1", "skiagraph.scenario/9"));
    assert_refused(&room, &[], &["tiny.toml:2: schema", "skiagraph.scenario/1"]);
    room.write("tiny.toml", format!("{TINY}\n[tracker.frozen]\n"));
    assert_refused(&room, &[], &["tiny.toml", "tracker"]);
    let missing = room.skiagraph(["run", "nowhere.toml"]);
    assert_eq!(missing.code, 2);
    assert!(missing.stderr.contains("nowhere.toml: cannot read the scenario"), "{}", missing.stderr);
}

#[test]
fn unwritable_paths_are_refused() {
    let room = Sandbox::new();
    room.write("a.txt", "a file");
    assert_refused(&room, &["--out", "a.txt/run"], &["a.txt", "cannot create the directory"]);
    assert_refused(&room, &["--out", "a.txt"], &["a.txt: this exists and is not an unchanged skiagraph result"]);
    assert_refused(&room, &["--out", "/"], &["/: this exists and is not an unchanged"]);
    if cfg!(target_os = "linux") {
        // nobody, including root, may create directories there
        assert_refused(&room, &["--out", "/proc/run"], &["/proc: cannot write into the directory"]);
        assert_refused(&room, &["--out", "/dev/full/run"], &["/dev/full", "cannot create the directory"]);
    }
}

/// Runs `skiagraph ARGUMENTS` in a shell after the command `before`.
#[cfg(unix)]
fn in_a_shell(room: &Sandbox, before: &str, arguments: &str) -> (Option<i32>, String) {
    let program = assert_cmd::cargo::cargo_bin!("skiagraph");
    let script = format!("{before}; exec '{}' {arguments}", program.display());
    let output = std::process::Command::new("sh").args(["-c", &script]).current_dir(room.path(".")).output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_no_incomplete_result() {
    // No file may exceed one block. The signal kills programs that do not handle it.
    let full = "ulimit -f 1";
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let (code, said) = in_a_shell(&room, full, "run tiny.toml --quiet --out a/run");
    assert_eq!((code, room.entries()), (Some(75), vec!["tiny.toml".to_owned()]), "{said}");
    assert!(said.starts_with("error: a/") && said.contains("File too large"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    let (code, said) = in_a_shell(&room, full, "render tiny.toml --quiet --out set");
    assert_eq!(code, Some(75), "{said}");
    assert!(said.contains("File too large") && !room.path("set").exists(), "{said}");
    // the saved progress is resumed
    room.succeed("render tiny.toml --quiet --out set");
    let (code, said) = in_a_shell(&room, full, "track set --tracker frozen --quiet --out run");
    assert_eq!((code, room.entries()), (Some(75), vec!["set".to_owned(), "tiny.toml".to_owned()]), "{said}");
    room.succeed("track set --tracker frozen --quiet --out run");
    let (code, said) = in_a_shell(&room, full, "evaluate set run");
    assert_eq!(code, Some(75), "{said}");
    let left = std::fs::read_dir(room.path("run")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let left: Vec<String> = left.filter(|name| name == "run.json" || name.ends_with(".partial")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_write_error_on_standard_output_is_reported() {
    let (code, said) = in_a_shell(&Sandbox::new(), "exec > /dev/full", "schema");
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("cannot write the result to standard output"), "{said}");
}

#[test]
fn paths_that_are_not_sets_or_runs_are_refused() {
    let room = Sandbox::new();
    for (arguments, words) in [
        (vec!["track", "nowhere", "--tracker", "frozen", "--out", "run"], "nowhere"),
        (vec!["track", ".", "--tracker", "frozen", "--out", "run"], "is not a complete benchmark set"),
        (vec!["track", ".", "--tracker", "frosen", "--out", "run"], "did you mean `frozen`?"),
        (vec!["track", ".", "--tracker", "frozen", "speed=3", "--out", "run"], "unknown key `speed`"),
        (vec!["evaluate", ".", "run"], "is not a complete benchmark set"),
    ] {
        let answer = room.skiagraph(&arguments);
        assert_eq!(answer.code, 2, "{arguments:?}: {}", answer.stderr);
        assert!(answer.stderr.contains(words), "{}", answer.stderr);
    }
    assert!(room.entries().is_empty(), "{:?}", room.entries());
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_nothing_and_says_130() {
    use std::process::{Command, Stdio};
    let room = Sandbox::new();
    let mut child = Command::new(assert_cmd::cargo::cargo_bin!("skiagraph"))
        .args(["run", "tracker.annealed_particle_filter.particles=20000", "--out", "run"])
        .current_dir(room.path("."))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while room.entries().is_empty() {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    std::thread::sleep(std::time::Duration::from_millis(200));
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(room.entries().is_empty(), "{:?}", room.entries());
}

#[test]
fn unknown_camera_models_and_excessive_sizes_are_refused() {
    let room = Sandbox::new();
    let camera = "[[rig.camera]]\nsize_px = [80, 60]\nmatrix = [[70.0, 0.0, 40.0], [0.0, 70.0, 30.0], [0.0, 0.0, 1.0]]\n\
                  rotation = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]\ntranslation_m = [0.0, 1.0, 4.0]\n";
    for (line, words) in [
        ("model = \"fisheye\"", ["rig.camera[0].model", "unknown key"]),
        ("distortion = [0.1, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0]", ["distortion", "length 8"]),
    ] {
        room.write("tiny.toml", format!("{TINY}{camera}{line}\n"));
        assert_refused(&room, &[], &words);
    }
    room.write("tiny.toml", TINY);
    assert_refused(
        &room,
        &["rig.ring.count=64", "rig.ring.size_px=[8192, 8192]"],
        &["64 cameras with 4294967296 pixels", "at most 999 cameras and 150000000 pixels"],
    );
}

#[test]
fn subjects_without_a_visible_pixel_are_refused() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    // a dot far away, smaller than a pixel
    assert_refused(
        &room,
        &["rig.ring.radius_m=1000", "rig.ring.size_px=[8, 6]"],
        &["sees the subject", "no pixel of it"],
    );
    // a robot without any geometry
    let robot = fs::read_to_string(shipped("robots/tracker25.urdf")).unwrap();
    let mut bare = robot.clone();
    for element in ["visual", "collision"] {
        while let Some(from) = bare.find(&format!("<{element}")) {
            let end = format!("</{element}>");
            let to = from + bare[from..].find(&end).unwrap() + end.len();
            bare.replace_range(from..to, "");
        }
    }
    assert_ne!(robot, bare);
    room.write("bare.urdf", bare);
    assert_refused(&room, &["actor.robot=bare.urdf"], &["actor.robot", "no link with geometry", "or a skin"]);
    assert_refused(&room, &["tracker_body.robot=bare.urdf"], &["tracker_body.robot", "no link with geometry"]);
}

#[test]
fn sets_of_a_newer_format_edited_and_partial_ones_are_refused_by_every_reader() {
    use sha2::{Digest, Sha256};
    let readers = |room: &Sandbox| {
        [
            "track set --tracker frozen --out other",
            "evaluate set run",
            "export set --to coco --out other",
            "inspect set",
        ]
        .map(|command| (command, room.skiagraph(command.split(' '))))
    };
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --quiet --out set");
    room.succeed("track set --tracker frozen --quiet --out run");
    let (manifest, listing) = (room.read("set/set.toml"), room.read("set/files.sha256"));
    let before = room.entries();

    // another format, with keys that this version does not know and good hashes
    let newer = String::from_utf8(manifest.clone()).unwrap().replace("skiagraph.set/1", "skiagraph.set/3");
    let newer = newer.replace("frames_per_second", "rate_hz");
    let hash = |bytes: &[u8]| Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let listed = String::from_utf8(listing.clone()).unwrap().replace(&hash(&manifest), &hash(newer.as_bytes()));
    room.write("set/set.toml", &newer);
    room.write("set/files.sha256", listed);
    for (command, answer) in readers(&room) {
        assert_eq!(answer.code, 2, "{command}: {}", answer.stderr);
        assert!(
            answer.stderr.contains("use the version of skiagraph that made the set"),
            "{command}: {}",
            answer.stderr
        );
    }
    // edited
    room.write("set/set.toml", String::from_utf8(manifest.clone()).unwrap().replace("tiny", "tidy"));
    room.write("set/files.sha256", &listing);
    for (command, answer) in readers(&room) {
        assert_eq!(answer.code, 2, "{command}: {}", answer.stderr);
        assert!(answer.stderr.contains("set.toml"), "{command}: {}", answer.stderr);
    }
    // only a part of it
    room.write("set/set.toml", &manifest);
    fs::remove_file(room.path("set/observations/cam01/silhouette/000001.png")).unwrap();
    for (command, answer) in readers(&room).into_iter().take(3) {
        assert_eq!(answer.code, 2, "{command}: {}", answer.stderr);
        assert!(answer.stderr.contains("observations/cam01/silhouette/000001.png"), "{command}: {}", answer.stderr);
    }
    assert_eq!(room.entries(), before);
}
