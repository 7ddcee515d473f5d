//! Verdicts on runs.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY};
use crate::support::{python_with_numpy, skip};

fn record(room: &Sandbox, run: &str) -> Value {
    serde_json::from_slice(&room.read(&format!("{run}/run.json"))).unwrap()
}

fn page(room: &Sandbox, run: &str) -> String {
    String::from_utf8(room.read(&format!("{run}/report.html"))).unwrap()
}

/// The energy at the truth is the same for a built-in tracker with default settings and for another program.
#[test]
fn poses_of_another_program_have_energies_and_markers_alone_have_none() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    room.succeed("track set --tracker annealed_particle_filter --out ours");
    room.write("theirs.npz", room.read("ours/poses.npz"));
    room.succeed("evaluate set ours");
    room.succeed("evaluate set theirs.npz --out theirs");
    let [ours, theirs] = ["ours", "theirs"].map(|run| record(&room, run));
    let gap = |run: &Value| run["metrics"]["energy_gap"]["mean"].as_f64();
    let (one, other) = (gap(&ours).unwrap(), gap(&theirs).unwrap());
    assert!((one - other).abs() < 1e-6 * one.abs().max(1e-3), "the same poses and likelihood: {one} {other}");
    let protocol = theirs["metrics"]["energy_gap"]["protocol"].as_str().unwrap();
    assert!(protocol.contains("skiagraph's silhouette likelihood with its default settings"), "{protocol}");
    assert!(ours["metrics"]["energy_gap"]["protocol"].as_str().unwrap().contains("the tracker's own likelihood"));
    assert!(theirs["verdict"]["cause"].as_str().unwrap().contains("by skiagraph's likelihood on the set's body"));
    assert!(page(&room, "theirs").contains("Energy of truth and estimate"));
    let table = String::from_utf8(room.read("theirs/per_frame.csv")).unwrap();
    let row: Vec<&str> = table.lines().last().unwrap().split(',').collect();
    let names: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    for name in ["energy_truth", "energy_estimate"] {
        let at = names.iter().position(|column| *column == name).unwrap();
        row[at].parse::<f64>().unwrap();
    }

    let Some(python) = python_with_numpy() else { return skip("no Python with NumPy") };
    let markers = "import numpy as np; a = np.load('theirs.npz'); np.savez('markers.npz', fps=a['fps'], \
                   seeds=a['seeds'], estimate_markers=a['estimate_markers'], marker_names=a['marker_names'])";
    let made = std::process::Command::new(python).args(["-c", markers]).current_dir(room.path(".")).status().unwrap();
    assert!(made.success());
    room.succeed("evaluate set markers.npz --out markers");
    let run = record(&room, "markers");
    assert!(run["metrics"].get("energy_gap").is_none() && run["absent"].get("energy_gap").is_some());
    assert!(run["verdict"].get("cause").is_none(), "absent and not null: {}", run["verdict"]);
    let html = page(&room, "markers");
    let visible = html.split("id=\"absent\"").next().unwrap();
    for words in ["Energy gap", "class=\"cause\"", "<th class=\"n\">Overlap, %</th>", "None"] {
        assert!(!visible.contains(words), "{words}");
    }
}

/// An oracle with the actor's body overlaps the exact silhouettes fully, regardless of corruption of the observed ones.
#[test]
fn the_truth_is_not_penalised_for_corrupted_silhouettes() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let matched = "tracker.oracle={} actor.robot=tracker25 tracker_body.robot=tracker25 tracker_body.mismatch=none";
    room.succeed(&format!("run tiny.toml {matched} --out exact"));
    room.succeed(&format!(
        "run tiny.toml {matched} observation.silhouette=corrupted boundary_px=2 blobs=0.2 calibration_mm=20 --out rough"
    ));
    let [exact, rough] = ["exact", "rough"].map(|run| record(&room, run));
    let value = |run: &Value, name: &str| run["metrics"][name]["mean"].as_f64();
    assert!(value(&exact, "silhouette_iou").unwrap() > 0.999 && value(&exact, "silhouette_iou_exact").is_none());
    assert!(value(&rough, "silhouette_iou").unwrap() < 0.9);
    assert!(value(&rough, "silhouette_iou_exact").unwrap() > 0.999, "{}", rough["metrics"]["silhouette_iou_exact"]);
    let graded = |run: &Value| {
        let criteria = run["verdict"]["criteria"].as_array().unwrap().clone();
        criteria.into_iter().find(|c| c["metric"].as_str().unwrap().starts_with("silhouette")).unwrap()
    };
    assert_eq!(graded(&exact)["metric"], "silhouette_iou");
    let criterion = graded(&rough);
    assert_eq!((&criterion["metric"], &criterion["grade"]), (&"silhouette_iou_exact".into(), &"good".into()));
    assert!(criterion["finding"].as_str().unwrap().contains("measured on the exact silhouettes"));
}

#[test]
fn table_verdict_and_page_have_the_share_of_frames_with_a_lost_limb() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let table = room.succeed("run tiny.toml tracker.oracle.root_offset_m=[0.2,0,0] --out off").stdout;
    let row = table.lines().find(|line| line.contains("Frames with a marker over 150 mm off")).unwrap();
    assert!(row.contains("1.00"), "{row}");
    assert!(table.contains("a marker is more than 150 mm off in 100 % of the frames"), "{table}");
    assert!(table.contains("Longest stretch: most of the body more than 150 mm off from frame 1 to 4"), "{table}");
    let run = record(&room, "off");
    assert_eq!(run["longest_lost"]["first_frame"], 1);
    assert_eq!((&run["longest_lost"]["last_frame"], &run["longest_lost"]["clip"]), (&4.into(), &"tiny".into()));
    assert!(page(&room, "off").contains("How often any marker is more than 150 mm off"));
}

#[test]
fn among_methods_an_oracle_is_a_reference_and_not_the_best_tracker() {
    let room = Sandbox::new();
    let methods = TINY.replace(
        "[tracker.annealed_particle_filter]",
        "[methods.truth_refitted.oracle]\n[methods.still.frozen]\n[methods.filter.annealed_particle_filter]",
    );
    room.write("methods.toml", methods);
    let table = room.succeed("run methods.toml --out methods").stdout;
    assert!(table.contains("limb >150 mm"), "{table}");
    let html = String::from_utf8(room.read("methods/comparison.html")).unwrap();
    let said = html.split("class=\"verdict\">").nth(1).unwrap().split("</p>").next().unwrap();
    assert!(said.contains("of the trackers") && !said.contains("truth_refitted"), "{said}");
    assert!(html.contains("a reference that uses the ground truth"));
    room.succeed("report methods --png methods.png");
}

/// Metrics missing from a baseline of an earlier version do not affect the gate.
#[test]
fn a_baseline_that_lacks_a_metric_still_gates() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("run tiny.toml --seeds 5 --out runs/main");
    room.succeed("baseline save old runs/main");
    let mut baseline: Value = serde_json::from_slice(&room.read("results/baselines/old.json")).unwrap();
    let mut removed = 0;
    remove(&mut baseline, &["lost_limb", "limbs_exchanged"], &mut removed);
    assert!(removed >= 2, "{removed}");
    room.write("results/baselines/old.json", serde_json::to_vec(&baseline).unwrap());
    let answer = room.skiagraph("gate runs/main --baseline old --margin 2mm".split(' '));
    assert_eq!(answer.code, 0, "{} {}", answer.stdout, answer.stderr);
}

fn remove(value: &mut Value, names: &[&str], removed: &mut usize) {
    match value {
        Value::Object(entries) => {
            names.iter().for_each(|name| *removed += usize::from(entries.remove(*name).is_some()));
            entries.values_mut().for_each(|inside| remove(inside, names, removed));
        }
        Value::Array(all) => all.iter_mut().for_each(|inside| remove(inside, names, removed)),
        _ => {}
    }
}
