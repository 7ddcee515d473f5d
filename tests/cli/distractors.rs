//! Other people in the scene: in silhouettes and images, never in the truth.

use skiagraph_set::BenchmarkSet;

use crate::sandbox::{Sandbox, TINY};

/// Between the second camera and the actor, in a skin.
const PASSER_BY: &str = "[[distractor]]\nname = \"passer-by\"\nskin = \"person_coarse\"\n\
                         motion = { clip = \"embedded:walk\", last_frame = 2, start_m = [-0.9, -0.9], heading_deg = 90.0 }\n";

#[test]
fn distractors_occlude_the_actor() {
    let room = Sandbox::new();
    room.write("alone.toml", TINY);
    let layers = "seeds = 2\ntruth_images = [\"depth\", \"parts\", \"coverage\", \"colour\"]\n";
    room.write("two.toml", TINY.replace("seeds = 2\n", layers) + PASSER_BY);
    room.succeed("render alone.toml motion.start_m=[0,0] --quiet --out alone");
    room.notes("render two.toml motion.start_m=[0,0] --out two", &["`passer-by` stands still after"]);
    room.says("verify two", &["two is sound: 9 checks, no fault"]);
    let [alone, two] = ["alone", "two"].map(|set| BenchmarkSet::read(&room.path(set)).unwrap());
    let distractors = &two.truth.ground_truth.distractors;
    assert_eq!((distractors.len(), distractors[0].name.as_str()), (1, "passer-by"));
    assert!(distractors[0].body.skin.is_some());
    assert_eq!(two.truth.ground_truth.motion(), alone.truth.ground_truth.motion());
    assert_eq!(two.blind.observation.as_ref().map(|facts| facts.distractors), Some(1));
    let pixels = |set: &BenchmarkSet| -> u64 {
        set.blind.observation(1).unwrap().silhouettes.iter().map(|mask| mask.count()).sum()
    };
    assert!(pixels(&two) * 4 > pixels(&alone) * 5, "{} {}", pixels(&two), pixels(&alone));
    let hidden = |set: &BenchmarkSet| {
        let flags = set.truth.ground_truth.frames.iter().flat_map(|frame| frame.visible.as_flattened());
        flags.filter(|visible| !**visible).count()
    };
    assert!(hidden(&two) > hidden(&alone), "{} {}", hidden(&two), hidden(&alone));
    let readme = room.text("two/README.txt");
    assert!(readme.contains("Other people") && !room.text("alone/README.txt").contains("Other"));

    // faults in their files are found
    let masks = "observations/cam01/silhouette/000001.png";
    room.write(&format!("two/{masks}"), room.read(&format!("alone/{masks}")));
    let answer = room.ask("verify two");
    assert_eq!(answer.code, 1);
    assert!(answer.stdout.contains("FAULT hashes"), "{}", answer.stdout);

    room.succeed("run two.toml motion.start_m=[0,0] --quiet --out run");
    let record: serde_json::Value = room.json("run/run.json");
    let iou = record["segmentation"]["iou"].as_f64().unwrap();
    assert!(iou < 0.8, "silhouettes are not the actor's alone: {iou}");
}
