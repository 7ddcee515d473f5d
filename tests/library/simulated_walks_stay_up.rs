//! Recordings simulated on the ground: some once fell over within a second, despite a root wrench of a fifth of their
//! weight, and now stay up; `results/simulation.md` has more recordings.

use skiagraph_core::body::shipped;
use skiagraph_physics::{SimulationReport, SimulationSettings, simulate};
use skiagraph_truth::mocap::{ReadOptions, read};
use skiagraph_truth::retarget::{RetargetOptions, retarget};

/// Simulates a clip on a robot at 60 Hz, prepared as in a scenario: first resampled, then retargeted.
fn simulated(clip: &str, robot: &str, root_wrench: f64) -> Option<SimulationReport> {
    let path = crate::support::test_data("mocap/cmu_asf_amc")?.join(format!("{clip}.amc"));
    let clip = read(&path, &ReadOptions::default()).unwrap().without_inserted_rest_pose().resampled(60.0).unwrap();
    let retargeted = retarget(&clip, &shipped(robot).unwrap(), &RetargetOptions::default()).unwrap();
    let settings = SimulationSettings { root_wrench, ..SimulationSettings::default() };
    Some(simulate(&retargeted.humanoid, &retargeted.motion, &settings).unwrap().report)
}

/// Once fell after 0.90 s.
#[test]
fn a_walk_of_another_subject_stays_up_on_a_body_without_ankles() {
    let Some(report) = simulated("02_01", "tracker25", 0.2) else { return };
    assert_eq!((report.fell_at_s, report.fell_at_frame), (None, None), "{report}");
    assert!(report.moved_mm < 200.0, "{report}");
}

/// Once fell after 0.85 s.
#[test]
fn a_run_that_stops_stays_up() {
    let Some(report) = simulated("16_57", "actor", 0.2) else { return };
    assert_eq!(report.fell_at_s, None, "{report}");
    assert!(report.moved_mm < 200.0, "{report}");
}

/// The left arm is missing from the first two frames of this recording. Without help the body would lie on the ground a
/// metre away.
#[test]
fn a_walk_keeps_its_balance_with_a_fifth_of_its_weight_at_most() {
    let Some(report) = simulated("16_15", "actor", 0.2) else { return };
    assert_eq!(report.fell_at_s, None, "{report}");
    assert!(report.root_wrench_most <= 0.2 + 1e-9 && report.moved_mm < 50.0, "{report}");
    assert!(report.quality.penetration_mm < 10.0, "{report}");
}

#[test]
fn a_fall_is_reported_with_its_time_its_frame_and_its_meaning() {
    let Some(report) = simulated("16_45", "actor", 0.0) else { return };
    let (at, frame) = (report.fell_at_s.unwrap(), report.fell_at_frame.unwrap());
    assert_eq!(frame as f64 / 60.0, at);
    let words = report.to_string();
    let expected =
        format!("the body FELL after {at:.2} s of 1.12 s (frame {frame}, from 0): from there on the truth is a fall");
    assert!(words.starts_with(&expected), "{words}");
    assert!(report.moved_until_fall_mm < report.moved_mm, "{words}");
}
