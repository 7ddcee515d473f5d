//! Deliberately corrupted observations.

use crate::sandbox::Sandbox;

fn observation(room: &Sandbox, set: &str) -> toml::Table {
    let text = room.text(&format!("{set}/set.toml"));
    let mut manifest: toml::Table = text.parse().unwrap();
    match manifest.remove("observation") {
        Some(toml::Value::Table(observation)) => observation,
        _ => toml::Table::new(),
    }
}

#[test]
fn corruption_leaves_the_truth() {
    let room = Sandbox::tiny();
    room.succeed("render tiny.toml --out exact");
    assert!(observation(&room, "exact").is_empty());
    for level in ["0.0", "0.2"] {
        room.succeed(&format!(
            "render tiny.toml observation.silhouette=corrupted holes={level} --key default --out holes-{level}"
        ));
    }
    let level = observation(&room, "holes-0.2");
    assert_eq!(level["silhouette"].as_str(), Some("corrupted"));
    assert_eq!(level["corruption"]["holes"].as_float(), Some(0.2));
    assert!(!level.contains_key("seed"), "with the seed a tracker could undo what was drawn");
    let mask = "observations/cam00/silhouette/000003.png";
    assert_eq!(room.read(&format!("holes-0.0/{mask}")), room.read(&format!("exact/{mask}")));
    assert_ne!(room.read(&format!("holes-0.2/{mask}")), room.read(&format!("exact/{mask}")));
    for truth in ["truth/truth.npz", "truth/actor.json", "cameras.json", "start/start.json"] {
        assert_eq!(room.read(&format!("holes-0.2/{truth}")), room.read(&format!("exact/{truth}")), "{truth}");
    }
}

/// Trackers get erroneous ones.
#[test]
fn truth_has_the_true_cameras() {
    let room = Sandbox::tiny();
    room.succeed("render tiny.toml --out exact");
    room.succeed("render tiny.toml calibration_mm=50 start_mm=100 --out told");
    assert_eq!(room.read("told/truth/cameras.json"), room.read("exact/cameras.json"));
    assert_ne!(room.read("told/cameras.json"), room.read("exact/cameras.json"));
    assert_ne!(room.read("told/start/start.json"), room.read("exact/start/start.json"));
    let mask = "observations/cam00/silhouette/000003.png";
    assert_eq!(room.read(&format!("told/{mask}")), room.read(&format!("exact/{mask}")));
}

#[test]
fn quality_of_silhouettes_is_reported() {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml --out exact");
    let rough = room
        .succeed("run tiny.toml observation.silhouette=corrupted boundary_px=2 blobs=0.2 missing_limb=1 --out rough");
    let record = |run: &str| -> serde_json::Value { room.json(&format!("{run}/run.json")) };
    assert!(record("exact").get("segmentation").is_none());
    let quality = &record("rough")["segmentation"];
    let iou = quality["iou"].as_f64().unwrap();
    assert!(iou > 0.3 && iou < 0.9, "{quality}");
    assert!(quality["boundary_f"].as_f64().unwrap() < 1.0 && quality["false_positives"].as_f64().unwrap() > 0.0);
    let page = room.text("rough/report.html");
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
    let quality = "observed silhouettes: recall 0.536, precision 0.558";
    assert!(rough.stdout.contains(quality), "{}", rough.stdout);
}
