//! `skiagraph check`: all errors that `run` would report, the cameras' views of the actor, and the cost.

use std::path::Path;

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY};

fn bytes_below(path: &Path) -> u64 {
    let entries = std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path());
    entries.map(|path| if path.is_dir() { bytes_below(&path) } else { path.metadata().unwrap().len() }).sum()
}

/// An OpenCV camera at a point, looking along +Y.
fn camera_at(x: f64, y: f64, z: f64) -> String {
    format!(
        "[[rig.camera]]\nsize_px = [80, 60]\nmatrix = [[60.0, 0.0, 40.0], [0.0, 60.0, 30.0], [0.0, 0.0, 1.0]]\n\
         rotation = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]\ntranslation_m = [{:?}, {z:?}, {:?}]\n",
        -x, -y
    )
}

#[test]
fn a_valid_scenario_has_a_path_views_and_a_cost() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let said: Value = serde_json::from_str(&room.succeed("check tiny.toml --json").stdout).unwrap();
    assert_eq!(said["sound"], true);
    let path = &said["path"];
    let [x0, y0, x1, y1] = ["start_m", "end_m"].map(|end| [0, 1].map(|i| path[end][i].as_f64().unwrap())).concat()[..]
    else {
        panic!("{path}")
    };
    // a twelfth of a second of a straight walk along x: the path is nearly as long as the distance between its ends
    let length = path["length_m"].as_f64().unwrap();
    assert!(x1 > x0 && (length - (x1 - x0).hypot(y1 - y0)).abs() < 0.01 && length < 0.3, "{path}");
    assert!(path["least_m"][0].as_f64().unwrap() <= x0 && path["greatest_m"][0].as_f64().unwrap() >= x1);
    let views = said["views"].as_array().unwrap();
    assert_eq!(views.len(), 2);
    for view in views {
        assert_eq!((view["in_view"].as_f64(), view["at_border"].as_f64()), (Some(1.0), Some(0.0)), "{view}");
        // a person of 1.6 to 1.8 m at about 3.5 m: 69 px of focal length times the angle
        let [least, median, greatest] = [0, 1, 2].map(|i| view["height_px"][i].as_u64().unwrap());
        assert!(28 <= least && least <= median && median <= greatest && greatest <= 40, "{view}");
    }
    let words = room.succeed("check tiny.toml").stdout;
    for expected in
        ["path     from (", "camera   cam01: in view in 100 % of the frames, ", "cost     run: about ", "on the disk"]
    {
        assert!(words.contains(expected), "{expected}: {words}");
    }
    assert_eq!(room.entries(), ["tiny.toml"]);
}

#[test]
fn check_names_cameras_in_which_the_body_is_a_few_pixels_high_and_people_who_are_not_tracked() {
    let room = Sandbox::new();
    let passer_by =
        "[[distractor]]\nname = \"passer-by\"\nskin = \"person_coarse\"\nmotion = { clip = \"embedded:walk\" }\n";
    room.write("tiny.toml", TINY);
    room.write("two.toml", TINY.to_owned() + passer_by);
    let near = room.succeed("check tiny.toml");
    assert!(!near.stderr.contains("px high") && !near.stderr.contains("not tracked"), "{}", near.stderr);
    let far = room.succeed("check two.toml rig.ring.radius_m=10");
    for expected in [
        "note: cam01: the actor is only ",
        " px high (median), so its limbs hardly show",
        "silhouettes also show people who are not tracked, wherever cameras see them: passer-by",
    ] {
        assert!(far.stderr.contains(expected), "{}", far.stderr);
    }
}

#[test]
fn sizes_on_disk_are_estimated_within_a_factor_of_two() {
    let room = Sandbox::new();
    let scenario = TINY.replace("last_frame = 3", "last_frame = 30");
    room.write("tiny.toml", scenario.replace("seeds = 2", "seeds = 2\nlayers = [\"depth\"]"));
    let said: Value = serde_json::from_str(&room.succeed("check tiny.toml --json").stdout).unwrap();
    let cost = |key: &str| said["cost"][key].as_f64().unwrap_or_else(|| panic!("{key}: {said}"));
    room.succeed("render tiny.toml --out set");
    room.succeed("run tiny.toml --out run");
    for (estimate, folder) in [("set_bytes", "set"), ("run_bytes", "run")] {
        let (told, found) = (cost(estimate), bytes_below(&room.path(folder)) as f64);
        assert!(told < 2.0 * found && found < 2.0 * told, "{estimate}: {told} told, {found} found");
    }
    assert!(cost("run_s") >= cost("track_s") && cost("track_s") > 0.0 && cost("render_s") > 0.0, "{}", said["cost"]);
    assert_eq!(cost("models_to_learn"), 0.0);
    // a hundred times the evaluations; the rest of a frame, without refinement, stays the same
    let tracking = |particles: u32| {
        let said = room.succeed(&format!("check tiny.toml paper=true particles={particles} --json")).stdout;
        serde_json::from_str::<Value>(&said).unwrap()["cost"]["track_s"].as_f64().unwrap()
    };
    let (few, many) = (tracking(12), tracking(1200));
    assert!(many > 3.0 * few, "{few} s and {many} s");
}

#[test]
fn check_and_run_refuse_with_the_same_message() {
    let room = Sandbox::new();
    let bare = TINY.split("[rig.ring]").next().unwrap();
    let (tracker, in_the_way) = ("[tracker.frozen]\n", "[[prop]]\nname = \"hood\"\nplace_m = [0, 0, 0]\n");
    let hidden = format!("{TINY}{in_the_way}shape = {{ box = {{ size_m = [4.0, 4.0, 5.0] }} }}\n");
    let inside = format!("{bare}{}{}{tracker}", camera_at(0.0, -3.0, 1.0), camera_at(0.0, 0.0, 0.95));
    let around = TINY.replace("radius_m = 3.5", "radius_m = 0.1\nheight_m = 1.0");
    let simulated = format!(
        "{TINY}[actor]\ncontact = \"simulate\"\n[[prop]]\nname = \"block\"\nplace_m = [0, 0, 1]\n\
         shape = {{ box = {{ size_m = [3, 3, 2.2] }} }}\n"
    );
    let on_a_model = format!("{bare}[tracker.gpdm_graph]\nmodel_file = \"nowhere.model\"\n");
    for (scenario, words) in [
        (hidden, "expected a camera that sees the subject, found no pixel of it"),
        (inside, "rig.camera[1]: expected every camera outside the actor: `cam01` is inside the actor's `"),
        (around, "rig.ring.radius_m: expected 0.5 to 1000 m, found 0.1"),
        (simulated, "mm inside the prop \"block\""),
        (on_a_model, "nowhere.model: cannot be read"),
    ] {
        room.write("a.toml", scenario);
        let checked = room.skiagraph(["check", "a.toml"]);
        let run = room.skiagraph(["run", "a.toml", "--out", "none"]);
        for answer in [&checked, &run] {
            assert_eq!(answer.code, 2, "{}", answer.stderr);
            assert!(answer.stderr.contains(words), "{words}: {}", answer.stderr);
        }
        let error = |said: &str| said.lines().find(|line| line.starts_with("error: ")).map(str::to_owned);
        assert_eq!(error(&checked.stderr), error(&run.stderr));
    }
    assert_eq!(room.entries(), ["a.toml"]);
}

#[test]
fn a_model_file_is_opened_and_must_fit() {
    let room = Sandbox::new();
    let (before, _) = TINY.split_once("[tracker.").unwrap();
    room.write("tiny.toml", format!("{before}[tracker.gpdm_graph]\nmodel_file = \"a.model\"\nparticles = 20\n"));
    room.succeed("train embedded:run --model gpdm-graph --fps 30 --out a.model --quiet");
    let refused = room.skiagraph(["check", "tiny.toml"]);
    assert!(
        refused.code == 2 && refused.stderr.contains("learned at 30 frames a second, needed at 60"),
        "{}",
        refused.stderr
    );
    room.succeed("train embedded:run --model gpdm-graph --out a.model --force --quiet");
    room.succeed("check tiny.toml");
    room.write("a.model", &room.read("a.model")[..999]);
    let refused = room.skiagraph(["check", "tiny.toml"]);
    assert!(refused.code == 2 && refused.stderr.contains("a.model"), "{}", refused.stderr);
}

#[test]
fn a_prop_in_the_actors_way_has_a_note() {
    let room = Sandbox::new();
    let prop =
        "[[prop]]\nname = \"pole\"\nplace_m = [0, 0, 1]\nshape = { capsule = { radius_m = 0.05, length_m = 1.0 } }\n";
    room.write("tiny.toml", format!("{TINY}{prop}"));
    let said = room.succeed("check tiny.toml").stderr;
    assert!(said.contains("note: the actor is inside the prop `pole` by up to "), "{said}");
}

#[test]
fn all_errors_are_listed_with_their_lines_including_missing_files() {
    let room = Sandbox::new();
    let scenario = TINY
        .replace("count = 2", "count = 0\nraduis_m = 1.0")
        .replace("particles = 12", "particles = \"many\"")
        .replace("embedded:walk", "gone.bvh")
        .replace("[rig.ring]", "[actor]\nrobot = \"gone.urdf\"\n[rig.ring]");
    room.write("tiny.toml", scenario);
    let answer = room.skiagraph(["check", "tiny.toml", "seeds=0"]);
    assert_eq!((answer.code, answer.stdout.as_str()), (2, ""));
    let errors: Vec<&str> = answer.stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    let expected = [
        "error: tiny.toml:13: rig.ring.count: expected 1 to 64, found 0",
        "error: tiny.toml:14: rig.ring.raduis_m: unknown key",
        "error: tiny.toml:19: tracker.annealed_particle_filter.particles: ",
        "error: override seeds=0: seeds: expected 1 to",
        "error: tiny.toml:7: motion.clip: `gone.bvh` is not in",
        "error: tiny.toml:11: actor.robot: `gone.urdf` is neither",
    ];
    assert_eq!(errors.len(), expected.len(), "{}", answer.stderr);
    for (error, expected) in errors.iter().zip(expected) {
        assert!(error.starts_with(expected), "{expected}: {error}");
    }
    let answer = room.skiagraph(["check", "tiny.toml", "seeds=0", "--json"]);
    let said: Value = serde_json::from_str(&answer.stdout).unwrap();
    assert_eq!((answer.code, said["sound"].as_bool(), answer.stderr.as_str()), (2, Some(false), ""));
    let errors = said["errors"].as_array().unwrap();
    assert_eq!(errors.len(), expected.len());
    assert_eq!((errors[1]["line"].as_u64(), errors[1]["column"].as_u64()), (Some(14), Some(1)));
    assert_eq!((errors[3]["key"].as_str(), &errors[3]["line"]), (Some("seeds"), &Value::Null));
    // `run` reports the first error
    let run = room.skiagraph(["run", "tiny.toml"]);
    assert_eq!(run.stderr.lines().filter(|line| line.starts_with("error: ")).count(), 1, "{}", run.stderr);
}

#[test]
fn settings_of_images_that_are_never_taken_are_noted() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let notes = |changes: &str| room.succeed(&format!("check tiny.toml {changes}")).stderr;
    let idle = notes("observation.images.clothing_contrast=5 observation.background.risk=10");
    for key in ["observation.images", "observation.background"] {
        assert!(idle.contains(&format!("{key}: the silhouettes are not segmented from images")), "{idle}");
    }
    let segmented = notes("observation.silhouette=segmented observation.images.background_frames=1");
    assert!(segmented.contains("1 image(s) tell little") && !segmented.contains("no effect"), "{segmented}");
}
