//! Simulated motions of real recordings.

mod support;

use std::path::{Path, PathBuf};

use skiagraph::body::retarget::{RetargetOptions, Retargeted, retarget};
use skiagraph::body::shipped;
use skiagraph::contact::{SimulationSettings, simulate};
use skiagraph::mocap::{ReadOptions, read};

/// A recording on the actor, at most 10 s of it, at 60 frames a second.
fn performed(path: &Path, loop_to_s: Option<f64>) -> Retargeted {
    let mut clip = read(path, &ReadOptions::default()).unwrap().without_inserted_rest_pose();
    if let Some(seconds) = loop_to_s {
        clip = clip.looped(seconds).unwrap();
    }
    let mut found = retarget(&clip, &shipped("actor").unwrap(), &RetargetOptions::default()).unwrap();
    found.motion = found.motion.resampled(&found.humanoid, 60.0).unwrap();
    found.motion.poses.truncate(601);
    found
}

/// Prints the table of `results/contact.md`.
#[test]
#[ignore = "takes minutes"]
fn simulated_walks() {
    println!(
        "| motion | bound | kept up s | root wrench % (mean, most) | skate mm/s | joints from the recording mm (mean, most) |"
    );
    println!("|---|---|---|---|---|---|");
    for bound in [0.2, 1.0] {
        for (path, looped) in clips() {
            let performed = performed(&path, looped);
            let settings = SimulationSettings { root_wrench: bound, ..SimulationSettings::default() };
            let found = simulate(&performed.humanoid, &performed.motion, &settings).unwrap().report;
            println!(
                "| {} | {:.0} | {:.2} of {:.2} | {:.1}, {:.1} | {:.1} | {:.1}, {:.1} |",
                path.file_stem().unwrap().to_string_lossy(),
                100.0 * bound,
                found.fell_at_s.unwrap_or(found.duration_s),
                found.duration_s,
                100.0 * found.root_wrench_mean,
                100.0 * found.root_wrench_most,
                found.quality.skate_mm_per_s,
                found.moved_mm,
                found.moved_most_mm
            );
        }
    }
}

fn clips() -> Vec<(PathBuf, Option<f64>)> {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motions");
    let mut clips = vec![(shipped.join("humanoid3d_walk.txt"), Some(5.0))];
    if let Some(folder) = support::test_data("mocap/cmu_asf_amc") {
        let walks = ["49_01", "16_15", "16_17", "16_22", "35_02", "02_01"];
        clips.extend(walks.iter().map(|name| (folder.join(format!("{name}.amc")), None)));
    }
    clips
}
