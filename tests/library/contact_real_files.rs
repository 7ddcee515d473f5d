//! Ground contact of recorded walks: stances that do not depend on the frame rate, and feet fixed to the ground.

/// Clips whose stances once differed between frame rates: one split in two, some missing at the end, some that began
/// 1.75 frames apart.
#[test]
fn the_same_walk_at_30_60_and_120_hz_has_the_same_stances_within_a_frame_of_the_slowest() {
    let Some(folder) = crate::support::test_data("mocap/cmu_asf_amc") else { return };
    for name in ["16_17", "16_22", "02_01"] {
        let apart = crate::walks::stances_apart(|fps| crate::walks::walk(&folder, name, fps));
        assert!(apart.is_some_and(|frames| frames <= 1.0 + 1e-6), "{name}: {apart:?}");
    }
}

#[test]
fn walks_with_fixed_feet_neither_skate_nor_sink() {
    let Some(folder) = crate::support::test_data("mocap/cmu_asf_amc") else { return };
    for (name, fps) in [("16_22", 30.0), ("35_02", 30.0), ("16_22", 60.0), ("35_34", 120.0)] {
        let shortcomings = crate::walks::planted(&folder, name, fps);
        assert!(shortcomings.is_empty(), "{shortcomings:#?}");
    }
}
