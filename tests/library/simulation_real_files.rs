//! A recorded walk simulated on the ground; `results/simulation.md` has more of them.

use skiagraph_core::body::shipped;
use skiagraph_physics::{SimulationSettings, simulate};
use skiagraph_truth::mocap::{ReadOptions, read};
use skiagraph_truth::retarget::{RetargetOptions, retarget};

/// The left arm is missing from the first two frames of this recording.
#[test]
fn a_recorded_walk_keeps_its_balance_with_a_fifth_of_its_weight_at_most() {
    let Some(folder) = crate::support::test_data("mocap/cmu_asf_amc") else { return };
    let clip = read(&folder.join("16_15.amc"), &ReadOptions::default()).unwrap().without_inserted_rest_pose();
    let walk = retarget(&clip, &shipped("actor").unwrap(), &RetargetOptions::default()).unwrap();
    let motion = walk.motion.resampled(&walk.humanoid, 60.0).unwrap();
    let settings = SimulationSettings { root_wrench: 0.2, ..SimulationSettings::default() };
    let found = simulate(&walk.humanoid, &motion, &settings).unwrap();
    assert_eq!(found.motion.poses.len(), motion.poses.len());
    assert_eq!(found.report.fell_at_s, None, "{}", found.report);
    assert!(found.report.root_wrench_most <= 0.2 + 1e-9, "{}", found.report);
    // the body must follow the motion; without help it would lie on the ground a metre away
    assert!(found.report.moved_mm < 50.0, "{}", found.report);
    assert!(found.report.quality.penetration_mm < 10.0, "{}", found.report);
}
