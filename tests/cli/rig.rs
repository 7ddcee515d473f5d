//! `skiagraph bound`, `place`, `check-tracker` and `plan-seeds`.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY};

/// And a set has the bound of its scenario.
#[test]
fn more_cameras_lower_the_bound() {
    let room = Sandbox::with_set();
    let of = |command: &str| room.json_of(command)["sources"][0]["alone_mm"].as_f64().unwrap();
    let [scenario, set] = ["bound tiny.toml --json", "bound set --json"].map(of);
    assert!((scenario / set - 1.0).abs() < 1e-6, "{scenario} {set}");
    assert!(of("bound tiny.toml rig.ring.count=4 --json") < scenario);
    assert!(of("bound tiny.toml --outline-px 2 --correlation-px 8 --json") > 2.0 * scenario);
    room.succeed("run tiny.toml --out run");
    let report = room.json_of("bound set --run run --out found --json");
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
fn bounds_cover_the_scored_frames() {
    let room = Sandbox::tiny();
    let source = &room.json_of("bound tiny.toml --json")["sources"][0];
    for name in ["alone_mm", "filtered_mm"] {
        let (mean, scored) = (source[name].as_f64().unwrap(), mean_over_frames(source, 1, name));
        assert!((mean / scored - 1.0).abs() < 1e-9, "{name}: {mean} {scored}");
    }
    let first = &source["per_frame"][0];
    assert_eq!(first["frame"], 0);
    assert!(first["filtered_mm"].as_f64().unwrap() < 0.1 * source["filtered_mm"].as_f64().unwrap(), "{first}");
}

#[test]
fn slow_bodies_have_low_bounds() {
    let room = Sandbox::tiny();
    std::fs::write(room.path("slow.toml"), TINY.replace("[rig.ring]", "speed = 0.05\n\n[rig.ring]")).unwrap();
    let source = &room.json_of("bound slow.toml --json")["sources"][0];
    let mean = |name: &str| source[name].as_f64().unwrap();
    // the start is known, and the body changes 20 times more slowly than a walk
    assert!(mean("filtered_mm") < 0.05 * mean("alone_mm"), "{source}");
}

#[test]
fn keypoint_bounds_differ_by_point() {
    let room = Sandbox::tiny();
    room.succeed(
        "render tiny.toml observation.keypoints.layout=coco17 observation.keypoints.white_percent=1 --key default \
         --out set",
    );
    let found = room.json_of("bound set --every 2 --json");
    let source = found["sources"].as_array().unwrap().iter().find(|source| source["source"] == "keypoints").unwrap();
    let of = |name: &str| {
        let joint = source["joints"].as_array().unwrap().iter().find(|joint| joint["joint"] == name).unwrap();
        joint["alone_mm"].as_f64().unwrap()
    };
    // COCO's annotations of hips are four times as uncertain as those of eyes and ears
    assert!(of("left_hip") > 1.3 * of("head_top"), "{source}");
}

#[test]
fn placed_cameras_beat_opposite_ones() {
    let room = Sandbox::tiny();
    let placed = room.json_of("place tiny.toml --cameras 2 --azimuths 8 --frames 2 --out placed --json");
    let own = placed["own"][1].as_f64().unwrap();
    assert!(placed["expected_mm"].as_f64().unwrap() <= own, "{placed}");
    let picture = String::from_utf8(room.read("placed/placement.svg")).unwrap();
    let picture = roxmltree::Document::parse(&picture).unwrap();
    let texts = picture.descendants().filter(|part| part.is_text()).filter_map(|part| part.text());
    let labels = texts.filter(|text| text.contains(" m high"));
    assert_eq!(labels.count(), 2);
    room.succeed("check placed/scenario.toml");
    // with all frames, the expected error is the bound of the frame alone, frame 0 included
    let bound = room.json_of("bound tiny.toml --json");
    let place = format!("place tiny.toml --cameras 2 --frames {} --json", bound["frames"]);
    let own = room.json_of(&place)["own"][1].as_f64().unwrap();
    let bound = mean_over_frames(&bound["sources"][0], 0, "alone_mm");
    assert!((own / bound - 1.0).abs() < 1e-9, "{own} {bound}");
}

#[test]
fn cameras_keep_off_the_body() {
    let room = Sandbox::tiny();
    let grid = "place tiny.toml --cameras 2 --candidates grid --radius 0.8 --spacing 0.2 --heights 1,2.9 --json";
    let placed = room.json_of(grid);
    let (left, near) = (placed["candidates"].as_u64().unwrap(), placed["too_near"].as_u64().unwrap());
    assert!(near > 0 && left > 0, "{placed}");
    for camera in placed["chosen"].as_array().unwrap() {
        let centre: Vec<f64> = camera["centre_m"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        assert!(centre[2] > 2.0 || centre[0].hypot(centre[1]) > 0.4, "{placed}");
    }
    assert!(room.json_of("place tiny.toml --cameras 2 --json")["too_near"].is_null());
}

#[test]
fn smaller_margins_need_more_seeds() {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml --seeds 5 --out run");
    let seeds = |margin: &str| {
        let plan = room.json_of(&format!("plan-seeds run --margin {margin} --json"));
        assert!(plan["seconds_per_seed"].as_f64().unwrap() > 0.0, "{plan}");
        plan["needed"][0]["seeds"].as_u64().unwrap_or(u64::MAX)
    };
    assert!(seeds("20%") < seeds("2%"));
}

#[test]
fn the_truth_passes_every_relation() {
    let room = Sandbox::tiny();
    let checked = room.json_of("check-tracker tiny.toml --tracker oracle --json");
    assert_eq!(checked["verdict"], "pass", "{checked}");
    assert_eq!(checked["relations"].as_array().unwrap().len(), 6);
}

// A tracker that always answers the start pose passed without a word.
#[test]
fn static_tracker_is_called_out() {
    let told = Sandbox::tiny().succeed("check-tracker tiny.toml --tracker frozen").stdout;
    let words = ["PASS: ", "no better than a tracker that never moves from its start pose"];
    assert!(words.iter().all(|word| told.contains(word)), "{told}");
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
fn lost_repeated_frame_is_no_failure() {
    let room = Sandbox::tiny();
    room.write("program.sh", LOST_IF_REPEATED);
    let program = format!("sh {}", room.path("program.sh").display());
    let checked = room.ask(&format!("check-tracker tiny.toml --exec '{program}' --inline --json")).json();
    assert_eq!(checked["coverage"], 1.0, "{checked}");
    let twice = &checked["relations"][5];
    assert_eq!([&twice["relation"], &twice["verdict"]], ["frame_twice", "pass"], "{twice}");
}

/// As if it were alive: in each of the scenes it dies at frame 3, and its error in the frames before is small.
#[cfg(unix)]
#[test]
fn dead_tracker_is_not_judged() {
    let room = Sandbox::tiny();
    room.write("program.sh", LOST_IF_REPEATED.replace("seen=${told", "[ $frame -ge 3 ] && exit 1; seen=${told"));
    let program = format!("sh {}", room.path("program.sh").display());
    let check = |form: &[&str]| room.skiagraph([&["check-tracker", "tiny.toml", "--exec", &program], form].concat());
    let told = check(&[]);
    assert_eq!(told.code, 3, "{}", told.stdout);
    let words = ["INCONCLUSIVE: ", "coverage 50 %", "not judged: no whole run: the program did not answer in "];
    assert!(words.iter().all(|word| told.stdout.contains(word)), "{}", told.stdout);
    let checked: Value = serde_json::from_str(&check(&["--json"]).stdout).unwrap();
    assert_eq!([&checked["verdict"], &checked["relations"]], [&"inconclusive".into(), &Value::Array(Vec::new())]);
}
