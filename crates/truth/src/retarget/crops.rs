//! Tests: parts of jumps retargeted separately agree with the same frames of the whole.

use super::{RetargetOptions, Retargeted, retarget};
use crate::mocap::{Clip, ReadOptions, read};
use crate::test_data;
use skiagraph_core::body::shipped;

/// CMU's jumps of three subjects, and the built-in jump.
fn jumps() -> Vec<Clip> {
    let shared = ["16_03", "02_04", "01_01_f0001-0700"].map(|name| format!("mocap/cmu_asf_amc/{name}.amc"));
    let shipped_jump = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/motions/humanoid3d_jump.txt").into();
    let files = shared.iter().filter_map(|file| test_data::path(file)).chain([shipped_jump]);
    files.map(|file: std::path::PathBuf| read(&file, &ReadOptions::default()).unwrap()).collect()
}

fn retargeted(clip: &Clip) -> Retargeted {
    retarget(clip, &shipped("actor").unwrap(), &RetargetOptions::default()).unwrap()
}

fn is_spine(name: &str) -> bool {
    ["lumbar", "thoracic", "neck", "head"].iter().any(|part| name.starts_with(part))
}

/// A crop has a different calibration and trunk length, so angles differ slightly, but the spine must bend alike.
#[test]
fn crops_of_jumps_agree_with_the_whole_to_5_degrees_at_the_spine_and_10_mm() {
    for clip in jumps() {
        let whole = retargeted(&clip);
        let frames = clip.frames.len();
        for crop in [0..frames / 2, frames / 4..3 * frames / 4, frames / 2..frames] {
            let part = retargeted(&Clip { frames: clip.frames[crop.clone()].to_vec(), ..clip.clone() });
            let (mut spine, mut sum, mut distance) = (0.0_f64, 0.0, 0.0_f64);
            for (a, b) in whole.motion.poses[crop.clone()].iter().zip(&part.motion.poses) {
                let names = whole.humanoid.degrees_of_freedom.iter().map(|d| &d.name);
                for ((a, b), name) in a.joint_angles.iter().zip(&b.joint_angles).zip(names) {
                    let difference = (a - b).abs().to_degrees();
                    sum += difference;
                    spine = if is_spine(name) { spine.max(difference) } else { spine };
                }
                let places = [(&whole, a), (&part, b)].map(|(of, p)| of.humanoid.markers(&of.humanoid.link_frames(p)));
                for (a, b) in places[0].iter().zip(&places[1]) {
                    distance = distance.max((a.unwrap() - b.unwrap()).norm());
                }
            }
            let mean = sum / (crop.len() * whole.humanoid.degrees_of_freedom.len()) as f64;
            println!(
                "{} {crop:?}: spine {spine:.1} degrees, mean {mean:.2} degrees, {:.1} mm",
                clip.name,
                1000.0 * distance
            );
            assert!(spine < 5.0, "{} {crop:?}: the spine differs by {spine} degrees", clip.name);
            assert!(mean < 1.5, "{} {crop:?}: angles differ by {mean} degrees on average", clip.name);
            assert!(distance < 0.01, "{} {crop:?}: landmarks are {distance} m apart", clip.name);
        }
    }
}

#[test]
fn jumps_rotate_no_faster_than_recorded_and_seldom_reach_joint_limits() {
    for clip in jumps() {
        let jump = retargeted(&clip);
        let faster: Vec<&String> =
            jump.report.notes.iter().filter(|note| note.contains("faster than recorded")).collect();
        assert!(faster.is_empty(), "{}: {faster:?}", clip.name);
        let recorded = super::turning::recorded_rotations(&clip, &(0..clip.skeleton.joints.len()).collect::<Vec<_>>());
        let most = recorded.iter().copied().fold(0.0, f64::max) * clip.frames_per_second;
        for pair in jump.motion.poses.windows(2) {
            for (index, limits) in
                jump.humanoid.degrees_of_freedom.iter().enumerate().filter(|(_, d)| is_spine(&d.name))
            {
                let turn = (pair[1].joint_angles[index] - pair[0].joint_angles[index]).abs();
                let speed = turn * clip.frames_per_second;
                assert!(speed < most, "{}: {} turns at {speed} rad/s, recorded {most}", clip.name, limits.name);
            }
        }
        for hits in &jump.report.limit_hits {
            let share = (hits.lower_frames + hits.upper_frames) as f64 / clip.frames.len() as f64;
            println!("{}: {} at a limit in {:.0} % of the frames", clip.name, hits.degree_of_freedom, 100.0 * share);
            assert!(share < 0.1, "{}: {hits:?} of {} frames", clip.name, clip.frames.len());
        }
    }
}
