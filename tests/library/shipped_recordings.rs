//! The shipped recordings are read, retargeted, measured, planted and simulated: the same checks as on the external
//! recordings, which are not always available.

use std::path::{Path, PathBuf};

use skiagraph_core::body::shipped;
use skiagraph_core::contact::ContactRule;
use skiagraph_physics::{SimulationSettings, plant_feet, simulate};
use skiagraph_truth::mocap::{Clip, ReadOptions, read};
use skiagraph_truth::retarget::{RetargetOptions, Retargeted, retarget};

fn clip(name: &str) -> Clip {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motions");
    read(&folder.join(name), &ReadOptions::default()).unwrap().without_inserted_rest_pose()
}

fn walk() -> Clip {
    clip("humanoid3d_walk.txt").looped(4.0).unwrap()
}

/// CMU's subject 1 jumps forward and turns: 4 s at 30 Hz.
fn jumps() -> Clip {
    clip("01_01.bvh").crop(240..720).unwrap().resampled(30.0).unwrap()
}

fn on(body: &str, clip: &Clip) -> Retargeted {
    retarget(clip, &shipped(body).unwrap(), &RetargetOptions::default()).unwrap()
}

#[test]
fn landmarks_come_as_close_as_on_other_recordings() {
    for (name, clip, actor_mm, tracker_mm) in [("walk", walk(), 5.0, 30.0), ("jumps", jumps(), 5.0, 17.0)] {
        let [actor, tracker] = ["actor", "tracker25"].map(|body| on(body, &clip).report.mean_residual_mm);
        println!("{name}: actor {actor:.1} mm, tracker25 {tracker:.1} mm");
        assert!(actor < actor_mm && tracker < tracker_mm, "{name}: {actor} and {tracker} mm");
    }
}

#[test]
fn a_walk_has_the_same_stances_at_all_rates_within_a_frame_of_the_slowest() {
    let apart = crate::walks::stances_apart(|rate| on("actor", &walk().resampled(rate).unwrap()));
    assert!(apart.is_some_and(|frames| frames <= 1.0 + 1e-6), "{apart:?}");
}

#[test]
fn planted_feet_neither_skate_nor_sink() {
    for (name, clip) in [("walk", walk()), ("jumps", jumps())] {
        let actor = on("actor", &clip);
        let planted = plant_feet(&actor.humanoid, &actor.motion, &ContactRule::default()).unwrap();
        println!("{name}: {}", planted.report);
        let after = planted.report.after;
        assert!(
            after.skate_mm_per_s <= 20.0 && after.penetration_mm <= 2.0 && after.float_mm <= 10.0,
            "{name}: {after}"
        );
    }
}

#[test]
fn the_actor_refits_to_the_trackers_body() {
    let truth = on("actor", &jumps());
    let mean = crate::support::refit_to_the_trackers_body_m(&truth);
    assert!(mean < 0.025, "{mean} m");
}

#[test]
fn a_simulated_walk_stays_up_with_a_fifth_of_its_weight_at_most() {
    let walk = on("actor", &walk());
    let motion = walk.motion.resampled(&walk.humanoid, 60.0).unwrap();
    let settings = SimulationSettings { root_wrench: 0.2, ..SimulationSettings::default() };
    let report = simulate(&walk.humanoid, &motion, &settings).unwrap().report;
    assert_eq!(report.fell_at_s, None, "{report}");
    assert!(report.root_wrench_most <= 0.2 + 1e-9 && report.moved_mm < 60.0, "{report}");
}
