//! Verdicts on runs.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY, assert_contains};
use crate::support::{python_with_numpy, skip};

/// The energy at the truth is the same for a built-in tracker with default settings and for another program.
#[test]
fn foreign_poses_have_energies() {
    let room = Sandbox::with_set();
    room.succeed("track set --tracker annealed_particle_filter --out ours");
    room.write("theirs.npz", room.read("ours/poses.npz"));
    room.succeed("evaluate set ours");
    room.succeed("evaluate set theirs.npz --out theirs");
    let [ours, theirs] = ["ours", "theirs"].map(|run| room.json(&format!("{run}/run.json")));
    let gap = |run: &Value| run["metrics"]["energy_gap"]["mean"].as_f64();
    let (one, other) = (gap(&ours).unwrap(), gap(&theirs).unwrap());
    assert!((one - other).abs() < 1e-6 * one.abs().max(1e-3), "the same poses and likelihood: {one} {other}");
    let protocol = theirs["metrics"]["energy_gap"]["protocol"].as_str().unwrap();
    assert!(protocol.contains("skiagraph's silhouette likelihood with its default settings"), "{protocol}");
    assert!(ours["metrics"]["energy_gap"]["protocol"].as_str().unwrap().contains("the tracker's own likelihood"));
    assert_eq!(theirs["verdict"]["preferred"], ours["verdict"]["preferred"]);
    assert_eq!(theirs["verdict"]["preferred"]["frames"], 4);
    assert!(room.text("theirs/report.html").contains("Energy of truth and estimate"));
    let table = room.text("theirs/per_frame.csv");
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
    let run = room.json("markers/run.json");
    assert!(run["metrics"].get("energy_gap").is_none() && run["absent"].get("energy_gap").is_some());
    assert!(run["verdict"].get("preferred").is_none(), "absent and not null: {}", run["verdict"]);
    let html = room.text("markers/report.html");
    let visible = html.split("id=\"absent\"").next().unwrap();
    for words in ["Energy gap", "Better fit to the images", "<th class=\"n\">Overlap, %</th>", "None"] {
        assert!(!visible.contains(words), "{words}");
    }
}

/// An oracle with the actor's body overlaps the exact silhouettes fully, regardless of corruption of the observed ones.
#[test]
fn corruption_costs_the_truth_nothing() {
    let room = Sandbox::tiny();
    let matched = "tracker.oracle={} actor.robot=tracker25 tracker_body.robot=tracker25 tracker_body.mismatch=none";
    room.succeed(&format!("run tiny.toml {matched} --out exact"));
    room.succeed(&format!(
        "run tiny.toml {matched} observation.silhouette=corrupted boundary_px=2 blobs=0.2 calibration_mm=20 --out rough"
    ));
    let [exact, rough] = ["exact", "rough"].map(|run| room.json(&format!("{run}/run.json")));
    let value = |run: &Value, name: &str| run["metrics"][name]["mean"].as_f64();
    assert!(value(&exact, "silhouette_iou").unwrap() > 0.999 && value(&exact, "silhouette_iou_exact").is_none());
    assert!(value(&rough, "silhouette_iou").unwrap() < 0.9);
    assert!(value(&rough, "silhouette_iou_exact").unwrap() > 0.999, "{}", rough["metrics"]["silhouette_iou_exact"]);
    let graded = |run: &Value| {
        let rows = run["verdict"]["rows"].as_array().unwrap().clone();
        rows.into_iter().find(|c| c["metric"].as_str().unwrap().starts_with("silhouette")).unwrap()
    };
    assert_eq!(graded(&exact)["metric"], "silhouette_iou");
    let criterion = graded(&rough);
    assert_eq!((&criterion["metric"], &criterion["grade"]), (&"silhouette_iou_exact".into(), &"good".into()));
}

#[test]
fn lost_limbs_decide_the_grade() {
    let room = Sandbox::tiny();
    let table = room.succeed("run tiny.toml tracker.oracle.root_offset_m=[0.2,0,0] --out off").stdout;
    let row = table.lines().find(|line| line.contains("Frames with a marker over 150 mm off")).unwrap();
    assert!(row.contains("1.00"), "{row}");
    let run = room.json("off/run.json");
    assert!(table.contains(run["verdict"]["line"].as_str().unwrap()), "{table}");
    assert_contains(&table, &["  Grade poor: HumanEva 3-D error ", "(good: at most 50.0 mm; fair"]);
    let rows = run["verdict"]["rows"].as_array().unwrap();
    let lost = rows.iter().find(|row| row["metric"] == "lost_limb").unwrap();
    assert_eq!((&lost["value"], &lost["grade"], &lost["fair"]), (&1.0.into(), &"poor".into(), &0.5.into()));
    assert_eq!((&run["longest_lost"]["first_frame"], &run["longest_lost"]["last_frame"]), (&1.into(), &4.into()));
    assert!(room.text("off/report.html").contains("How often any marker is more than 150 mm off"));
}

#[test]
fn methods_are_compared_on_one_page() {
    let room = Sandbox::new();
    let methods = TINY.replace(
        "[tracker.annealed_particle_filter]",
        "[methods.truth_refitted.oracle]\n[methods.still.frozen]\n[methods.filter.annealed_particle_filter]",
    );
    room.write("methods.toml", methods);
    room.says("run methods.toml --out methods", &["limb >150 mm"]);
    let html = room.text("methods/comparison.html");
    assert_eq!(html.matches("a reference that uses the ground truth").count(), 1);
    for words in ["<h2>All sides", "id=\"error\"", "still&#x2f;report.html", "HumanEva 3-D error, mm: still "] {
        assert!(html.contains(words), "{words}");
    }
    room.refused("report methods --out no.html", "its page is methods/comparison.html");
}
