//! Real recordings: counts, rates, heights and speeds as the test data's manifest has them, and its traps.

mod support;

use std::path::PathBuf;

use skiagraph::mocap::{Clip, ReadOptions, read};

fn recordings() -> Option<PathBuf> {
    support::test_data("mocap")
}

fn load(relative: &str) -> Option<Clip> {
    let path = recordings()?.join(relative);
    Some(read(&path, &ReadOptions::default()).unwrap())
}

#[test]
fn every_bvh_says_its_frames_joints_and_rate() {
    let table = [
        ("cmu_mb_01_01", 2751, 31, 120.0),
        ("cmu_3dsmax_131_01", 994, 31, 120.0),
        ("ad_wave_hello", 839, 27, 119.875),
        ("ad_cmu_jumping_jacks", 125, 31, 30.0),
        ("mocapbank_test", 455, 19, 30.0),
    ];
    for (name, frames, joints, rate) in table {
        let Some(clip) = load(&format!("bvh/{name}.bvh")) else { return };
        assert_eq!((clip.frames.len(), clip.skeleton.joints.len()), (frames, joints), "{name}");
        assert!((clip.frames_per_second - rate).abs() < 1e-3, "{name}: {}", clip.frames_per_second);
    }
}
