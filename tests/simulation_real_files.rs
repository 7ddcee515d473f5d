//! A recorded walk that is simulated on the ground; `benches/study_simulation.rs` measures more of them.

mod support;

use skiagraph::body::retarget::{RetargetOptions, retarget};
use skiagraph::body::shipped;
use skiagraph::contact::{SimulationSettings, simulate};
use skiagraph::mocap::{ReadOptions, read};

#[test]
fn a_recorded_walk_stays_up_with_help_and_stands_on_the_ground() {
    let Some(folder) = support::test_data("mocap/cmu_asf_amc") else { return };
    let clip = read(&folder.join("16_22.amc"), &ReadOptions::default()).unwrap().without_inserted_rest_pose();
    let walk = retarget(&clip, &shipped("actor").unwrap(), &RetargetOptions::default()).unwrap();
    let mut motion = walk.motion.resampled(&walk.humanoid, 60.0).unwrap();
    motion.poses.truncate(91);
    let settings = SimulationSettings { root_wrench: 1.0, ..SimulationSettings::default() };
    let found = simulate(&walk.humanoid, &motion, &settings).unwrap();
    assert_eq!(found.motion.poses.len(), 91);
    assert_eq!(found.report.fell_at_s, None, "{}", found.report);
    // what is wanted is a body that follows; a body left to itself lies on the ground a metre off
    assert!(found.report.moved_mm < 50.0, "{}", found.report);
    assert!(found.report.quality.penetration_mm < 10.0, "{}", found.report);
}
