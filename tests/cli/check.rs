//! `skiagraph check`: all errors that `run` would report, the cameras' views of the actor, and the cost.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY};

#[test]
fn check_tells_path_views_cost() {
    let room = Sandbox::tiny();
    let said: Value = room.json_of("check tiny.toml --json");
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

/// Within a factor of two.
#[test]
fn sizes_on_disk_are_estimated() {
    let room = Sandbox::new();
    let scenario = TINY.replace("last_frame = 3", "last_frame = 30");
    room.write("tiny.toml", scenario.replace("seeds = 2", "seeds = 2\ntruth_images = [\"depth\"]"));
    let said: Value = room.json_of("check tiny.toml --json");
    let cost = |key: &str| said["cost"][key].as_f64().unwrap_or_else(|| panic!("{key}: {said}"));
    room.succeed("render tiny.toml --out set");
    room.succeed("run tiny.toml --out run");
    let bytes_below =
        |folder: &str| room.files_below(folder).iter().map(|file| room.read(file).len()).sum::<usize>() as f64;
    for (estimate, folder) in [("set_bytes", "set"), ("run_bytes", "run")] {
        let (told, found) = (cost(estimate), bytes_below(folder));
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
