//! Messages for common mistakes.

use crate::sandbox::{Sandbox, TINY};

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room
}

fn said(room: &Sandbox, arguments: &str) -> String {
    let answer = room.skiagraph(arguments.split_whitespace());
    assert_eq!(answer.code, 2, "{arguments}: {}{}", answer.stdout, answer.stderr);
    answer.stderr
}

#[test]
fn a_negative_number_is_refused_with_its_range_everywhere() {
    let room = room();
    for (arguments, words) in [
        ("check tiny.toml particles=-5", "expected 1 to 1000000, found -5"),
        ("run tiny.toml particles=-5", "expected 1 to 1000000, found -5"),
        ("run tiny.toml --seeds -1", "-1 is not in 1..=100000"),
        ("sweep tiny.toml particles=6,-5 --out s", "expected 1 to 1000000, found -5"),
    ] {
        let said = said(&room, arguments);
        assert!(said.contains(words), "{arguments}: {said}");
    }
    room.write("b.toml", TINY.replace("particles = 12", "particles = -5"));
    let said = said(&room, "run b.toml");
    let line = "b.toml:16: tracker.annealed_particle_filter.particles: expected 1 to 1000000, found -5";
    assert!(said.contains(line), "{said}");
}

#[test]
fn lengths_have_a_unit_and_cameras_within_a_body_are_refused() {
    let room = room();
    for found in ["0.2", "5000"] {
        let said = said(&room, &format!("check tiny.toml radius_m={found}"));
        assert!(said.contains(&format!("rig.ring.radius_m: expected 0.5 to 1000 m, found {found}")), "{said}");
    }
}

#[test]
fn a_missing_recording_of_an_absolute_path_is_not_searched_elsewhere() {
    let room = room();
    let said = said(&room, "check tiny.toml motion.clip=/nope/x.bvh --allow-outside");
    assert!(said.contains("motion.clip: there is no file `/nope/x.bvh`") && !said.contains("is not in"), "{said}");
}

#[test]
fn two_trackers_are_refused_with_a_hint_at_methods() {
    let room = room();
    room.write("two.toml", format!("{TINY}[tracker.frozen]\n"));
    let said = said(&room, "check two.toml");
    for words in ["expected one tracker, found several", "[methods.A.NAME]"] {
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn swapped_sets_and_runs_are_recognised() {
    let room = room();
    room.succeed("render tiny.toml --quiet --out sets/walk");
    room.succeed("track sets/walk --tracker frozen --quiet --out runs/mine");
    for (arguments, words) in [
        (
            "evaluate runs/mine sets/walk",
            "SET and RUN are swapped: sets/walk is the set; use skiagraph evaluate sets/walk runs/mine",
        ),
        ("evaluate runs/mine runs/mine", "SET: runs/mine is a run, but a benchmark set was expected"),
        ("verify runs/mine", "SET: runs/mine is a run"),
        ("export runs/mine --to npz", "SET: runs/mine is a run"),
        ("track runs/mine --tracker frozen --out b", "SET: runs/mine is a run"),
        ("inspect runs/mine", "SET: runs/mine is a run"),
        (
            "evaluate nothing_here runs/mine",
            "SET: no such folder: nothing_here; expected the directory of a benchmark set",
        ),
        ("export runs/mine/track.json --to npz", "SET: runs/mine/track.json is a file, but the directory"),
        ("compare runs/mine sets/walk", "RUN: sets/walk is a benchmark set, but a run was expected"),
        ("gate sets/walk --baseline x --margin 2mm", "RUN: sets/walk is a benchmark set"),
        ("baseline save x sets/walk", "RUN: sets/walk is a benchmark set"),
        ("report sets/walk", "RUN: sets/walk is a benchmark set"),
    ] {
        let said = said(&room, arguments);
        assert!(said.contains(words), "{arguments}: {said}");
    }
}

#[test]
fn misspelt_files_and_names_get_a_suggestion() {
    let room = room();
    room.succeed("render tiny.toml --quiet --out walk_set");
    for (arguments, words) in [
        ("run tniy.toml", "did you mean tiny.toml?"),
        ("check tniy.toml", "did you mean tiny.toml?"),
        ("verify wlak_set", "did you mean walk_set?"),
        ("track wlak_set --tracker frozen --out a", "did you mean walk_set?"),
        ("track walk_set --tracker frosen --out a", "did you mean `frozen`?"),
        ("check tiny.toml tracker_body.robot=traker25", "did you mean `tracker25`?"),
        ("check tiny.toml motion.clip=embedded:wlak", "did you mean `embedded:walk`?"),
    ] {
        let said = said(&room, arguments);
        assert!(said.contains(words), "{arguments}: {said}");
    }
    room.write("walk.bvh", "x");
    let said = said(&room, "check tiny.toml motion.clip=wlak.bvh");
    assert!(said.contains("did you mean `walk.bvh`?"), "{said}");
}

#[test]
fn invalid_keys_of_a_motion_are_named() {
    let room = room();
    for (arguments, words) in [
        (
            "check motion.last_frame=3",
            "motion.last_frame: the part in use, frames 1 to 3, cannot be repeated for `loop_to_s`",
        ),
        ("check motion.skeleton=a.asf", "motion.skeleton: only valid with an .amc clip"),
    ] {
        let said = said(&room, arguments);
        assert!(said.contains(words), "{arguments}: {said}");
    }
}

#[test]
fn formulas_and_control_characters_in_names_are_escaped_in_tables() {
    let room = room();
    let evil = "=cmd|' /C calc'!A0\\u001b[2J\\nsecond line";
    room.write(
        "sweep.toml",
        format!(
            "schema = \"skiagraph.sweep/1\"\nname = \"a\"\nbase = \"tiny.toml\"\nseeds = 1\n[axes]\nwhat = [{{ name = \"{evil}\", set = \
             [\"particles=6\"] }}, {{ name = \"b\", set = [\"particles=7\"] }}]\n"
        ),
    );
    room.succeed("sweep sweep.toml --out s");
    let table = String::from_utf8(room.read("s/runs.csv")).unwrap();
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let cells: Vec<String> =
        reader.records().flat_map(|row| row.unwrap().iter().map(str::to_owned).collect::<Vec<_>>()).collect();
    assert!(cells.iter().any(|cell| cell == "'=cmd|' /C calc'!A0\u{fffd}[2J second line"), "{table}");
    assert!(!table.contains('\u{1b}') && table.lines().count() == 3, "{table}");
    // cameras of a set
    let camera = "[[rig.camera]]\nname = \"=1+1\\u001b[2J\\nx\"\nsize_px = [80, 60]\nmatrix = [[60, 0, 39.5], [0, 60, 29.5], [0, 0, 1]]\n\
                  rotation = [[0, 1, 0], [0, 0, -1], [-1, 0, 0]]\ntranslation_m = [0, 1, 4]\n";
    room.write("camera.toml", TINY.replace("[rig.ring]", &format!("{camera}[rig.ring]")));
    room.succeed("render camera.toml --quiet --out set");
    let shown = room.succeed("inspect set").stdout;
    assert!(!shown.contains('\u{1b}') && shown.contains("=1+1\u{fffd}[2J x, 80x60"), "{shown}");
    room.succeed("export set --to croissant --out exported");
    let frames = String::from_utf8(room.read("exported/frames.csv")).unwrap();
    assert!(frames.contains("'=1+1") && !frames.contains('\u{1b}'), "{frames}");
}

#[test]
fn a_scenario_given_as_a_set_is_refused_with_the_render_command() {
    let room = room();
    for command in ["verify tiny.toml", "track tiny.toml --tracker frozen --out run", "export tiny.toml --to coco"] {
        let said = said(&room, command);
        assert!(
            said.contains("SET: tiny.toml is a scenario") && said.contains("skiagraph render tiny.toml --out SET"),
            "{said}"
        );
    }
}

#[test]
fn commands_that_need_a_measured_run_ask_to_evaluate_a_tracked_one() {
    let room = room();
    room.succeed("render tiny.toml --out made");
    room.succeed("track made --tracker frozen --out unmeasured");
    let report = "report unmeasured";
    let [figures, picture] = ["--figures out", "--png out.png"].map(|option| format!("{report} {option}"));
    for command in [report, &figures, &picture, "bound made --run unmeasured", "compare unmeasured unmeasured"] {
        let said = said(&room, command);
        assert!(said.contains("tracked but not measured; run skiagraph evaluate SET unmeasured"), "{command}: {said}");
    }
}
