//! Contact of real walks: labels that do not depend on the frame rate, and walks settled on the ground.

mod support;

use skiagraph::body::retarget::{RetargetOptions, Retargeted, retarget};
use skiagraph::body::shipped;
use skiagraph::contact::{ContactRule, GroundContacts, fix};
use skiagraph::mocap::{ReadOptions, read};

/// The first 400 frames of a clip on the actor.
fn walk(name: &str) -> Option<Retargeted> {
    let path = support::test_data("mocap/cmu_asf_amc")?.join(name);
    let mut clip = read(&path, &ReadOptions::default()).unwrap().without_inserted_rest_pose();
    clip.frames.truncate(400);
    Some(retarget(&clip, &shipped("actor").unwrap(), &RetargetOptions::default()).unwrap())
}

#[test]
fn the_same_walk_at_30_60_and_120_hz_has_the_same_stances_within_a_frame_of_the_slowest() {
    for name in ["49_01.amc", "16_15.amc"] {
        let Some(walk) = walk(name) else { return };
        let stances = |fps: f64| {
            let motion = walk.motion.resampled(&walk.humanoid, fps).unwrap();
            let found = GroundContacts::of_motion(&walk.humanoid, &motion, &ContactRule::default()).unwrap();
            found.feet.map(|foot| {
                let seconds = |s: std::ops::Range<usize>| [s.start as f64 / fps, (s.end - 1) as f64 / fps];
                foot.stances().into_iter().map(seconds).collect::<Vec<_>>()
            })
        };
        let fastest = stances(120.0);
        println!("{name}: {fastest:.3?}");
        for fps in [60.0, 30.0] {
            let found = stances(fps);
            println!("  at {fps}: {found:.3?}");
            for (a, b) in fastest.iter().zip(&found) {
                assert_eq!(a.len(), b.len(), "{name} at {fps} Hz");
                for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                    assert!((a - b).abs() <= 1.0 / 30.0 + 1e-9, "{name} at {fps} Hz: {a} and {b} s");
                }
            }
        }
        assert!(fastest.iter().all(|foot| foot.len() >= 2), "{name}: {fastest:?}");
    }
}

/// Prints the table of `results/contact.md`.
#[test]
fn fixed_walks_neither_skate_nor_sink() {
    println!(
        "| clip | frames | skate mm/s | in the stances as they were | penetration mm | float mm | joints moved mm | most |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for name in ["49_01", "16_15", "16_17", "16_22", "35_02", "02_01"] {
        let Some(walk) = walk(&format!("{name}.amc")) else { return };
        let report = fix(&walk.humanoid, &walk.motion, &ContactRule::default()).unwrap().report;
        let (a, b, old) = (report.before, report.after, report.after_in_old_stances);
        let most = &report.moved_most;
        println!(
            "| {name} | {} | {:.1} -> {:.1} | {:.1} | {:.1} -> {:.1} | {:.1} -> {:.1} | {:.1} | {:.0} ({}, {}) |",
            walk.motion.poses.len(),
            a.skate_mm_per_s,
            b.skate_mm_per_s,
            old.skate_mm_per_s,
            a.penetration_mm,
            b.penetration_mm,
            a.float_mm,
            b.float_mm,
            report.moved_mm,
            most.mm,
            most.link,
            most.frame
        );
        for after in [b, old] {
            assert!(after.skate_mm_per_s <= 20.0 && after.penetration_mm <= 2.0, "{name}: {after:?}");
            assert!(after.float_mm <= 10.0, "{name}: {after:?}");
        }
        assert!(report.moved_mm <= 15.0, "{name}: {report}");
    }
}
