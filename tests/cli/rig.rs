//! `skiagraph bound`, `place`, `check-tracker` and `plan-seeds`.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY};

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room
}

fn json(room: &Sandbox, command: &str) -> Value {
    serde_json::from_str(&room.succeed(command).stdout).unwrap()
}

#[test]
fn a_bound_is_the_same_of_scenario_and_set_and_falls_with_more_cameras() {
    let room = room();
    room.succeed("render tiny.toml --out set");
    let of = |command: &str| json(&room, command)["sources"][0]["alone_mm"].as_f64().unwrap();
    let [scenario, set] = ["bound tiny.toml --json", "bound set --json"].map(of);
    assert!((scenario / set - 1.0).abs() < 1e-6, "{scenario} {set}");
    assert!(of("bound tiny.toml rig.ring.count=4 --json") < scenario);
    assert!(of("bound tiny.toml --outline-px 2 --correlation-px 8 --json") > 2.0 * scenario);
    room.succeed("run tiny.toml --out run");
    let report = json(&room, "bound set --run run --out found --json");
    let times = report["run"]["times_the_bound"][0][0].as_f64().unwrap();
    assert!((times * scenario - report["run"]["error_mm"].as_f64().unwrap()).abs() < 1e-3, "{report}");
    assert!(room.path("found/bound.json").is_file() && room.path("found/bound.html").is_file());
}

/// The mean of a bound over the computed frames from `first` on.
fn mean_over_frames(source: &Value, first: usize, name: &str) -> f64 {
    let frames = &source["per_frame"].as_array().unwrap()[first..];
    frames.iter().map(|frame| frame[name].as_f64().unwrap()).sum::<f64>() / frames.len() as f64
}

#[test]
fn both_means_of_a_bound_are_over_the_frames_that_a_run_is_scored_in() {
    let room = room();
    let source = &json(&room, "bound tiny.toml --json")["sources"][0];
    for name in ["alone_mm", "filtered_mm"] {
        let (mean, scored) = (source[name].as_f64().unwrap(), mean_over_frames(source, 1, name));
        assert!((mean / scored - 1.0).abs() < 1e-9, "{name}: {mean} {scored}");
    }
    let first = &source["per_frame"][0];
    assert_eq!(first["frame"], 0);
    assert!(first["filtered_mm"].as_f64().unwrap() < 0.1 * source["filtered_mm"].as_f64().unwrap(), "{first}");
}

#[test]
fn a_filter_of_a_body_that_hardly_moves_is_bounded_by_its_own_motion() {
    let room = room();
    std::fs::write(room.path("slow.toml"), TINY.replace("[rig.ring]", "speed = 0.05\n\n[rig.ring]")).unwrap();
    let source = &json(&room, "bound slow.toml --json")["sources"][0];
    let mean = |name: &str| source[name].as_f64().unwrap();
    // the start is known, and the body changes 20 times more slowly than a walk
    assert!(mean("filtered_mm") < 0.05 * mean("alone_mm"), "{source}");
}

#[test]
fn the_bound_of_keypoints_is_that_of_the_errors_of_each_point() {
    let room = room();
    room.succeed(
        "render tiny.toml observation.keypoints.layout=coco17 observation.keypoints.white_percent=1 --key default \
         --out set",
    );
    let found = json(&room, "bound set --every 2 --json");
    let source = found["sources"].as_array().unwrap().iter().find(|source| source["source"] == "keypoints").unwrap();
    let of = |name: &str| {
        let joint = source["joints"].as_array().unwrap().iter().find(|joint| joint["joint"] == name).unwrap();
        joint["alone_mm"].as_f64().unwrap()
    };
    // COCO's annotations of hips are four times as uncertain as those of eyes and ears
    assert!(of("left_hip") > 1.3 * of("head_top"), "{source}");
}

#[test]
fn bounds_that_cannot_be_computed_are_refused_with_the_reason() {
    let room = room();
    room.succeed("render tiny.toml --out public --truth secret");
    let refused = |command: &str, words: &str| {
        let said = room.skiagraph(command.split(' '));
        assert!(said.code == 2 && said.stderr.contains(words), "{command}: {}", said.stderr);
    };
    refused("bound public", "a bound needs the pose of every frame");
    room.succeed("bound public --truth secret --quiet");
    refused("bound secret rig.ring.count=3", "a set cannot be changed");
    refused("place secret --cameras 2", "expected a scenario");
    refused("place tiny.toml --cameras 60 --azimuths 4", "at most the number of candidates, 12");
    refused("place tiny.toml --cameras 2 --radius 0.3 --heights 1 --azimuths 8", "8 of 8 places are nearer than 0.5 m");
    refused("place tiny.toml --cameras 2 --outline-px 2", "expected --correlation-px too");
    refused("bound tiny.toml --correlation-px 2", "expected --outline-px too");
    refused("check-tracker --tracker frozen --inline", "--inline: only programs have this option");
    refused("check-tracker", "--tracker NAME for a built-in tracker, --exec COMMAND for a program; found neither");
    refused("plan-seeds nowhere --margin 2mm", "nowhere");
    refused("plan-seeds nowhere --margin 2parsecs", "expected a number of 0 or more with its unit");
}

#[test]
fn placed_cameras_are_a_scenario_that_runs_and_are_better_than_opposite_ones() {
    let room = room();
    let placed = json(&room, "place tiny.toml --cameras 2 --azimuths 8 --frames 2 --out placed --json");
    let own = placed["own"][1].as_f64().unwrap();
    assert!(placed["expected_mm"].as_f64().unwrap() <= own, "{placed}");
    assert!(room.path("placed/placement.png").is_file());
    room.succeed("check placed/scenario.toml");
    // with all frames, the expected error is the bound of the frame alone, frame 0 included
    let bound = json(&room, "bound tiny.toml --json");
    let place = format!("place tiny.toml --cameras 2 --frames {} --json", bound["frames"]);
    let own = json(&room, &place)["own"][1].as_f64().unwrap();
    let bound = mean_over_frames(&bound["sources"][0], 0, "alone_mm");
    assert!((own / bound - 1.0).abs() < 1e-9, "{own} {bound}");
}

#[test]
fn no_camera_is_placed_where_the_body_comes() {
    let room = room();
    let grid = "place tiny.toml --cameras 2 --candidates grid --radius 0.8 --spacing 0.2 --heights 1,2.9 --json";
    let placed = json(&room, grid);
    let (left, near) = (placed["candidates"].as_u64().unwrap(), placed["too_near"].as_u64().unwrap());
    assert!(near > 0 && left > 0, "{placed}");
    for camera in placed["chosen"].as_array().unwrap() {
        let centre: Vec<f64> = camera["centre_m"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        assert!(centre[2] > 2.0 || centre[0].hypot(centre[1]) > 0.4, "{placed}");
    }
    assert!(json(&room, "place tiny.toml --cameras 2 --json")["too_near"].is_null());
}

#[test]
fn a_pilot_of_five_seeds_plans_more_for_smaller_margins() {
    let room = room();
    room.succeed("run tiny.toml --seeds 5 --out run");
    let seeds = |margin: &str| {
        let plan = json(&room, &format!("plan-seeds run --margin {margin} --json"));
        assert!(plan["seconds_per_seed"].as_f64().unwrap() > 0.0, "{plan}");
        plan["needed"][0]["seeds"].as_u64().unwrap_or(u64::MAX)
    };
    assert!(seeds("20%") < seeds("2%"));
}

#[test]
fn the_truth_passes_every_relation() {
    let room = room();
    let checked = json(&room, "check-tracker tiny.toml --tracker oracle --json");
    assert_eq!(checked["verdict"], "pass", "{checked}");
    assert_eq!(checked["relations"].as_array().unwrap().len(), 6);
}

/// Stays at the start pose; declares a frame lost whose images are those of the frame before.
#[cfg(unix)]
const LOST_IF_REPEATED: &str = r#"
read -r hello; markers=$(printf %s "$hello" | sed 's/.*"start":.*"markers":\({[^}]*}\).*/\1/')
echo '{"type":"ready","name":"lost-if-repeated"}'
while read -r told; do
    case $told in *'"type":"end"'*) exit;; esac
    frame=${told#*'"frame":'}; frame=${frame%%,*}; seen=${told#*'"views":'}
    if [ "$seen" = "$before" ]; then echo "{\"type\":\"lost\",\"frame\":$frame}"
    else echo "{\"type\":\"pose\",\"frame\":$frame,\"markers\":$markers}"; fi
    before=$seen
done
"#;

#[cfg(unix)]
#[test]
fn a_program_that_declares_a_repeated_frame_lost_does_not_fail() {
    let room = room();
    room.write("program.sh", LOST_IF_REPEATED);
    let program = format!("sh {}", room.path("program.sh").display());
    let checked = room.skiagraph(["check-tracker", "tiny.toml", "--exec", &program, "--inline", "--json"]);
    let checked: Value = serde_json::from_str(&checked.stdout).unwrap();
    assert_eq!(checked["coverage"], 1.0, "{checked}");
    let twice = &checked["relations"][5];
    assert_eq!([&twice["relation"], &twice["verdict"]], ["frame_twice", "pass"], "{twice}");
}
