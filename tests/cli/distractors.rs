//! Other people in the scene: in silhouettes and images, never in the truth.

use skiagraph::benchmark_set::BenchmarkSet;

use crate::sandbox::{Sandbox, TINY};

/// Between the second camera and the actor, in a skin.
const PASSER_BY: &str = "[[distractor]]\nname = \"passer-by\"\nskin = \"person_coarse\"\n\
                         motion = { clip = \"embedded:walk\", last_frame = 2, start_m = [-0.9, -0.9], heading_deg = 90.0 }\n";

#[test]
fn a_distractor_appears_in_silhouettes_and_occludes_the_actor() {
    let room = Sandbox::new();
    room.write("alone.toml", TINY);
    let layers = "seeds = 2\nlayers = [\"depth\", \"parts\", \"coverage\", \"colour\"]\n";
    room.write("two.toml", TINY.replace("seeds = 2\n", layers) + PASSER_BY);
    room.succeed("render alone.toml motion.start_m=[0,0] --quiet --out alone");
    let answer = room.succeed("render two.toml motion.start_m=[0,0] --out two");
    assert!(answer.stderr.contains("`passer-by` stands still after"), "{}", answer.stderr);
    let answer = room.succeed("verify two");
    assert!(answer.stdout.contains("two is sound: 16 checks, no fault"), "{}", answer.stdout);
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
    let readme = String::from_utf8(room.read("two/README.txt")).unwrap();
    assert!(
        readme.contains("Other people") && !String::from_utf8(room.read("alone/README.txt")).unwrap().contains("Other")
    );

    // faults in their files are found
    let masks = "observations/cam01/silhouette/000001.png";
    room.write(&format!("two/{masks}"), room.read(&format!("alone/{masks}")));
    let answer = room.skiagraph(["verify", "two"]);
    assert_eq!(answer.code, 1);
    assert!(answer.stdout.contains("FAULT hashes"), "{}", answer.stdout);

    room.succeed("run two.toml motion.start_m=[0,0] --quiet --out run");
    let record: serde_json::Value = serde_json::from_slice(&room.read("run/run.json")).unwrap();
    let iou = record["segmentation"]["iou"].as_f64().unwrap();
    assert!(iou < 0.8, "silhouettes are not the actor's alone: {iou}");
}

#[test]
fn invalid_distractors_are_refused_by_key() {
    let room = Sandbox::new();
    for (from, to, words) in [
        ("person_coarse", "persona", "distractor[0].skin"),
        ("embedded:walk", "embedded:wlak", "distractor[0].motion.clip"),
        ("skin", "skim", "did you mean `skin`?"),
    ] {
        room.write("two.toml", TINY.to_owned() + &PASSER_BY.replace(from, to));
        let answer = room.skiagraph(["render", "two.toml", "--out", "two"]);
        assert_eq!(answer.code, 2, "{to}: {}", answer.stderr);
        assert!(answer.stderr.contains(words), "{to}: {}", answer.stderr);
    }
    room.write("two.toml", format!("{TINY}{PASSER_BY}{PASSER_BY}"));
    let answer = room.skiagraph(["render", "two.toml", "--out", "two"]);
    assert!(answer.code == 2 && answer.stderr.contains("two distractors are named"), "{}", answer.stderr);
    room.write("two.toml", TINY);
    let answer = room.skiagraph(["check", "two.toml", "observation.images.jpeg_quality=0"]);
    assert!(answer.code == 2 && answer.stderr.contains("jpeg_quality"), "{}", answer.stderr);
}
