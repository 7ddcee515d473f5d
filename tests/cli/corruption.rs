//! Deliberately corrupted observations.

use crate::sandbox::{Sandbox, TINY};

fn observation(room: &Sandbox, set: &str) -> toml::Table {
    let text = String::from_utf8(room.read(&format!("{set}/set.toml"))).unwrap();
    let mut manifest: toml::Table = text.parse().unwrap();
    match manifest.remove("observation") {
        Some(toml::Value::Table(observation)) => observation,
        _ => toml::Table::new(),
    }
}

#[test]
fn a_ladder_has_one_set_per_level_with_the_truth_of_the_exact_set() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out exact");
    assert!(observation(&room, "exact").is_empty());
    room.succeed("render tiny.toml --ladder holes --levels 0,0.2 --out ladder");
    let level = observation(&room, "ladder/holes-0.2");
    assert_eq!(level["silhouette"].as_str(), Some("corrupted"));
    assert_eq!(level["corruption"]["holes"].as_float(), Some(0.2));
    assert!(!level.contains_key("seed"), "with the seed a tracker could undo what was drawn");
    let mask = "observations/cam00/silhouette/000003.png";
    assert_eq!(room.read(&format!("ladder/holes-0/{mask}")), room.read(&format!("exact/{mask}")));
    assert_ne!(room.read(&format!("ladder/holes-0.2/{mask}")), room.read(&format!("exact/{mask}")));
    for truth in ["truth/truth.npz", "truth/actor.json", "cameras.json", "start/start.json"] {
        assert_eq!(room.read(&format!("ladder/holes-0.2/{truth}")), room.read(&format!("exact/{truth}")), "{truth}");
    }
    let again = room.skiagraph(["render", "tiny.toml", "--ladder", "holes", "--out", "ladder"]);
    assert_eq!(again.code, 2, "a level is there already");
    assert!(again.stderr.contains("a benchmark set exists here"), "{}", again.stderr);
}

#[test]
fn trackers_get_erroneous_cameras_and_the_truth_has_the_true_ones() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out exact");
    room.succeed("render tiny.toml calibration_mm=50 start_mm=100 --out told");
    assert_eq!(room.read("told/truth/cameras.json"), room.read("exact/cameras.json"));
    assert_ne!(room.read("told/cameras.json"), room.read("exact/cameras.json"));
    assert_ne!(room.read("told/start/start.json"), room.read("exact/start/start.json"));
    let mask = "observations/cam00/silhouette/000003.png";
    assert_eq!(room.read(&format!("told/{mask}")), room.read(&format!("exact/{mask}")));
}

#[test]
fn a_run_on_corrupted_silhouettes_reports_their_quality() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("run tiny.toml --out exact");
    let rough = room
        .succeed("run tiny.toml observation.silhouette=corrupted boundary_px=2 blobs=0.2 missing_limb=1 --out rough");
    let record =
        |run: &str| -> serde_json::Value { serde_json::from_slice(&room.read(&format!("{run}/run.json"))).unwrap() };
    assert!(record("exact").get("segmentation").is_none());
    let quality = &record("rough")["segmentation"];
    let iou = quality["iou"].as_f64().unwrap();
    assert!(iou > 0.3 && iou < 0.9, "{quality}");
    assert!(quality["boundary_f"].as_f64().unwrap() < 1.0 && quality["false_positives"].as_f64().unwrap() > 0.0);
    let page = String::from_utf8(room.read("rough/report.html")).unwrap();
    assert!(page.contains("corrupted: missing_limb 1, boundary_px 2 px, blobs 0.2") && page.contains("boundary F"));
    // pixels set and visible, counted in the layer of parts of the same set: five frames of two cameras; head and arms
    // have fewer than 20 pixels in some of these images, and are not counted here
    let trunk = [(8, 39), (27, 38), (37, 42), (38, 39), (41, 41), (34, 39), (30, 43), (40, 40), (10, 39), (42, 42)];
    let thighs = [(4, 33), (15, 33), (9, 35), (24, 38), (23, 33), (4, 30), (7, 26), (28, 28), (22, 27), (24, 24)];
    let shanks = [(6, 33), (6, 33), (0, 35), (12, 33), (13, 34), (0, 35), (0, 36), (8, 38), (16, 35), (7, 36)];
    for (part, of_images) in [("trunk", trunk), ("thighs", thighs), ("shanks_and_feet", shanks)] {
        let recall = quality["recall_by_part"][part].as_f64().unwrap();
        let counted = of_images.iter().map(|(set, visible)| f64::from(*set) / f64::from(*visible)).sum::<f64>() / 10.0;
        assert!((recall - counted).abs() < 1e-12, "{part}: {recall}");
    }
    let missed = "the observed silhouettes miss 46 % of the body, 80 % of the shanks and feet";
    assert!(rough.stdout.contains(missed), "{}", rough.stdout);
    assert!(page.contains("trunk 0.76, thighs 0.54, shanks and feet 0.20 (low)"));
}

#[test]
fn invalid_corruptions_are_refused_by_key() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    for (key, words) in [
        ("holes=1.5", "observation.corruption.holes: expected 0 to 1, found 1.5"),
        (
            "holes=0.1",
            "observation.corruption.holes: expected 0, or `observation.silhouette = \"corrupted\"`, found 0.1",
        ),
        ("start_mm=-3", "observation.corruption.start_mm: expected 0 to 100000 mm, found -3"),
        ("observation.silhouette=perfect", "observation.silhouette"),
        ("observation.corruption.hole=0.1", "hole"),
    ] {
        let refused = room.skiagraph(["render", "tiny.toml", key, "--out", "set"]);
        assert!(refused.code == 2 && refused.stderr.contains(words), "{key}: {}", refused.stderr);
    }
    let refused = room.skiagraph(["render", "tiny.toml", "--ladder", "speed", "--out", "set"]);
    assert!(refused.code == 2 && refused.stderr.contains("boundary_px"), "{}", refused.stderr);
}
