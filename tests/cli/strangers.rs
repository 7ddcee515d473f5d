//! Untrusted files: the files that they may refer to, and what messages quote.

use std::fs;
use std::path::Path;

use crate::sandbox::{Sandbox, TINY, shipped};

const SECRET: &str = "hunter2correcthorse";

/// Files with a secret, in formats that this program does not read.
fn secrets() -> Vec<(&'static str, String)> {
    vec![
        ("environ", format!("HOME=/root\0PASSWORD={SECRET}\0PATH=/usr/bin")),
        ("credentials", format!("[default]\naws_access_key_id = {SECRET}\naws_secret_access_key = {SECRET}\n")),
        (
            "keys.toml",
            format!("name = \"{SECRET}\"\nseeds = \"{SECRET}\"\nmesh = [\"{SECRET}\"]\nweights = \"{SECRET}\"\n"),
        ),
        ("token.toml", format!("{SECRET} = \"{SECRET}\"\n")),
        (
            "token.json",
            format!(
                "{{\"schema\": \"{SECRET}\", \"Loop\": [\"{SECRET}\"], \"weights\": \"{SECRET}\", \"name\": \"{SECRET}\"}}"
            ),
        ),
        ("list.json", format!("[\"{SECRET}\"]")),
        ("secret.yaml", format!("name: [{SECRET}]\nimage_width: {SECRET}\nK: {SECRET}\n")),
        ("secret.xml", format!("<{SECRET}><camera serial=\"{SECRET}\"></{SECRET}2></{SECRET}>")),
        ("notes.txt", format!("{SECRET}\n")),
        ("numbers.txt", format!("12 13 {SECRET}\n")),
        ("comment.txt", format!("# a comment\n{SECRET} {SECRET}\n")),
        ("mesh.txt", format!("v 0 0 0\nf {SECRET} 1 2\n")),
        ("id_rsa", format!("-----BEGIN KEY-----\n{SECRET}\n-----END KEY-----\n")),
    ]
}

/// A sandbox with `mine/`, which may be untrusted, and secrets beside it.
fn room() -> Sandbox {
    let room = Sandbox::new();
    fs::create_dir(room.path("mine")).unwrap();
    room.write("mine/tiny.toml", TINY);
    room
}

/// Runs a command that must fail as bad input without revealing the secret.
fn refused(room: &Sandbox, arguments: &[&str], what: &str) -> String {
    let answer = room.skiagraph(arguments);
    assert_eq!(answer.code, 2, "{what}: {arguments:?}: {}{}", answer.stdout, answer.stderr);
    for said in [&answer.stdout, &answer.stderr] {
        assert!(!said.contains(SECRET), "{what}: {arguments:?} tells the secret: {said}");
    }
    assert!(!answer.stderr.contains("panicked"), "{}", answer.stderr);
    answer.stderr
}

/// A scenario with one line of settings added or replaced.
fn with(line: &str) -> String {
    match line.split_once(' ').map(|(key, _)| key) {
        Some("clip") => TINY.replace("clip = \"embedded:walk\"", line),
        Some("skeleton") => TINY.replace("clip = \"embedded:walk\"", &format!("clip = \"a.amc\"\n{line}")),
        Some("robot" | "skin") => TINY.replace("[rig.ring]", &format!("[actor]\n{line}\n[rig.ring]")),
        Some("file") => {
            TINY.replace("[rig.ring]", &format!("[[rig.file]]\n{}\n[rig.ring]", line.replacen("file", "path", 1)))
        }
        Some("model_file") => TINY.split_once("[tracker.").unwrap().0.to_owned() + "[tracker.gpdm]\n" + line + "\n",
        _ => panic!("{line}"),
    }
}

const KEYS: [&str; 6] = ["clip", "skeleton", "robot", "skin", "file", "model_file"];

#[test]
fn no_message_quotes_a_file_that_is_not_of_its_kind() {
    let room = room();
    let set = room.succeed("render mine/tiny.toml --quiet --out set");
    assert_eq!(set.code, 0);
    room.write("mine/a.amc", "1\nroot 0 0 0 0 0 0\n");
    room.write("mine/a.asf", ":units\nlength 0.45\n:root\norder TX TY TZ RX RY RZ\n:bonedata\n:hierarchy\n");
    for (name, text) in secrets() {
        // a link inside the untrusted folder, with an extension for every reader
        for (key, endings) in [
            ("clip", &["bvh", "amc", "c3d", "trc", "txt", "json"][..]),
            ("skeleton", &["asf"]),
            ("robot", &["urdf"]),
            ("skin", &["glb", "gltf", "toml"]),
            ("file", &["yml", "cal", "xml"]),
            ("model_file", &["model"]),
        ] {
            for ending in endings {
                room.write(&format!("mine/x.{ending}"), &text);
                room.write("mine/b.toml", with(&format!("{key} = \"x.{ending}\"")));
                refused(&room, &["check", "mine/b.toml"], &format!("{name} as {key} .{ending}"));
                fs::remove_file(room.path(&format!("mine/x.{ending}"))).unwrap();
            }
        }
        for (file, lines) in [
            ("mesh.obj", "<visual><geometry><mesh filename=\"mesh.obj\"/></geometry></visual>"),
            ("mesh.stl", "<visual><geometry><mesh filename=\"mesh.stl\"/></geometry></visual>"),
            ("mesh.dae", "<visual><geometry><mesh filename=\"mesh.dae\"/></geometry></visual>"),
        ] {
            room.write(&format!("mine/{file}"), &text);
            room.write("mine/r.urdf", format!("<robot name=\"r\"><link name=\"a\">{lines}</link></robot>"));
            refused(&room, &["inspect", "mine/r.urdf"], &format!("{name} as {file}"));
        }
        room.write("mine/s.toml", "schema = \"skiagraph.skin/1\"\nmesh = \"m.obj\"\nweights = \"w.json\"\n");
        room.write("mine/m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        room.write("mine/w.json", &text);
        refused(&room, &["inspect", "mine/s.toml"], &format!("{name} as weights"));
        // as the file of a command
        room.write("mine/any.toml", &text);
        for command in ["check", "run", "sweep", "inspect"] {
            refused(&room, &[command, "mine/any.toml"], &format!("{name} as a scenario"));
        }
        refused(&room, &["gate", "set", "--baseline", "x", "--rules", "mine/any.toml"], &format!("{name} as rules"));
        for file in ["set.toml", "cameras.json", "start/start.json", "start/body.json"] {
            let before = room.read(&format!("set/{file}"));
            room.write(&format!("set/{file}"), &text);
            refused(&room, &["track", "set", "--tracker", "frozen", "--out", "run"], &format!("{name} as {file}"));
            room.write(&format!("set/{file}"), before);
        }
    }
}

#[test]
fn files_outside_a_scenarios_folder_are_read_only_if_allowed() {
    let room = room();
    room.write("secret.bvh", format!("HIERARCHY\nROOT {SECRET}\n"));
    let outside = room.path("secret.bvh");
    let names = [
        "../secret.bvh".to_owned(),
        outside.display().to_string(),
        "a/../../secret.bvh".to_owned(),
        "../gone.bvh".to_owned(),
    ];
    for key in KEYS {
        for name in &names {
            let format = if key == "file" { "\nformat = \"opencv\"" } else { "" };
            room.write("mine/b.toml", with(&format!("{key} = \"{name}\"{format}")));
            room.write("mine/a.amc", "1\nroot 0 0 0 0 0 0\n");
            for command in ["check", "run", "render"] {
                // rendering does not read the tracker's model
                if (command, key) == ("render", "model_file") {
                    continue;
                }
                let arguments =
                    [vec![command, "mine/b.toml"], if command == "check" { vec![] } else { vec!["--out", "out"] }]
                        .concat();
                let said = refused(&room, &arguments, key);
                assert!(said.contains("leads out of") && said.contains("--allow-outside"), "{key} {name}: {said}");
                assert!(!room.path("out").exists());
            }
        }
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&outside, room.path("mine/link.bvh")).unwrap();
        room.write("mine/b.toml", with("clip = \"link.bvh\""));
        let said = refused(&room, &["check", "mine/b.toml"], "a link");
        assert!(said.contains("leads out of"), "{said}");
    }
}

#[test]
fn files_of_the_command_line_and_of_the_project_are_allowed() {
    let room = room();
    let walk = fs::read(shipped("scenarios/motions/humanoid3d_walk.txt")).unwrap();
    fs::create_dir(room.path("recordings")).unwrap();
    room.write("recordings/walk.txt", walk);
    room.write("mine/b.toml", with("clip = \"../recordings/walk.txt\""));
    let refusal = refused(&room, &["check", "mine/b.toml"], "outside");
    assert!(refusal.contains("mine/b.toml:") && refusal.contains("motion.clip"), "{refusal}");
    let render = "render mine/b.toml --quiet --out";
    room.succeed(&format!("{render} a --allow-outside"));
    room.succeed(&format!("{render} b --mocap-dir recordings"));
    room.succeed("render mine/tiny.toml --quiet --out c motion.clip=../recordings/walk.txt");
    room.succeed(&format!(
        "render mine/tiny.toml --quiet --out d motion.clip={}",
        room.path("recordings/walk.txt").display()
    ));
    room.write("skiagraph.project", "");
    room.succeed(&format!("{render} e"));
}

/// A missing file must not be reported as outside the folder.
#[test]
fn a_missing_file_of_the_command_line_is_reported_with_a_similar_name() {
    let room = room();
    fs::create_dir(room.path("recordings")).unwrap();
    room.write("recordings/walk.txt", "x");
    for key in ["motion.clip", "actor.robot"] {
        for typed in ["../recordings/wakl.txt".to_owned(), room.path("recordings/wakl.txt").display().to_string()] {
            let said = refused(&room, &["check", "mine/tiny.toml", &format!("{key}={typed}")], key);
            assert!(!said.contains("leads out of"), "{key}: {said}");
            // a robot may be the name of a built-in one
            let words = if key == "motion.clip" { "there is no file `" } else { "is neither a built-in robot (" };
            assert!(said.contains(words) && said.contains("recordings/walk.txt`?"), "{key}: {said}");
        }
    }
    // files named in a file are not searched outside, so messages reveal nothing about other folders
    for name in ["../recordings/walk.txt", "../recordings/wakl.txt"] {
        room.write("mine/b.toml", with(&format!("clip = \"{name}\"")));
        let said = refused(&room, &["check", "mine/b.toml"], name);
        assert!(said.contains(", and is not looked for there: ") && !said.contains("no file"), "{said}");
    }
}

#[test]
fn a_sweep_may_use_the_files_of_its_scenario_and_its_cells_the_planned_ones() {
    let room = room();
    let walk = fs::read(shipped("scenarios/motions/humanoid3d_walk.txt")).unwrap();
    room.write("walk.txt", walk);
    let head = "schema = \"skiagraph.sweep/1\"\nname = \"a\"\n";
    for text in [
        format!("{head}base = \"../b.toml\"\n"),
        format!("{head}base = \"{}\"\n", room.path("b.toml").display()),
        format!("{head}base = \"tiny.toml\"\nset = [\"motion.clip=../walk.txt\"]\n"),
        format!("{head}base = \"tiny.toml\"\n[axes]\nmotion.clip = [\"../walk.txt\", \"embedded:walk\"]\n"),
    ] {
        room.write("b.toml", TINY);
        room.write("mine/s.toml", &text);
        let answer = room.skiagraph("sweep mine/s.toml --out s".split(' '));
        assert!(answer.code != 0 && (answer.stdout + &answer.stderr).contains("leads out of"), "{text}");
        fs::remove_dir_all(room.path("s")).ok();
        room.succeed("sweep mine/s.toml --out s --allow-outside --seeds 1");
        fs::remove_dir_all(room.path("s")).unwrap();
    }
    // axes from the command line are stored in the plan for the cells
    room.succeed("sweep plan mine/tiny.toml motion.clip=../walk.txt,embedded:walk --seeds 1 --out s");
    room.succeed("sweep run s");
}

#[test]
fn a_foreign_plan_reveals_nothing_of_the_files_that_it_names() {
    let room = room();
    room.succeed("sweep plan mine/tiny.toml particles=6,12 --out s");
    room.write("mine/tiny.toml", format!("{SECRET}\n"));
    let said = refused(&room, &["sweep", "run", "s"], "base");
    assert!(said.contains("is no longer a scenario"), "{said}");
}

#[test]
fn shipped_sweeps_and_scenarios_use_files_of_their_project() {
    let room = Sandbox::new();
    for file in ["scenarios/sweeps/cameras.toml", "scenarios/sweeps/grid-5x5.toml"] {
        room.succeed(&format!(
            "sweep plan {} --out {}",
            shipped(file).display(),
            Path::new(file).file_stem().unwrap().display()
        ));
    }
    for file in ["scenarios/smoke/latent.toml", "scenarios/monocular/embedded.toml"] {
        let answer = room.skiagraph(["inspect", shipped(file).to_str().unwrap()]);
        assert_eq!(answer.code, 0, "{}", answer.stderr);
    }
}
