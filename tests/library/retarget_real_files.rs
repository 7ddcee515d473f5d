//! Real recordings retargeted to the shipped bodies: how close the landmarks are, whether feet are on the ground, and
//! whether links jump. Clips are thinned so that the tests are fast even without optimisation.

use std::collections::BTreeMap;

use skiagraph_core::body::{Landmark, Markers, shipped};
use skiagraph_truth::mocap::{Clip, ReadOptions, read};
use skiagraph_truth::retarget::{RetargetOptions, Retargeted, retarget};

const THINNING: usize = 6;

/// A recording, with only every sixth frame if it has more than 100 per second.
fn thinned(relative: &str) -> Option<Clip> {
    let path = crate::support::test_data("mocap")?.join(relative);
    let mut clip = read(&path, &ReadOptions::default()).unwrap().without_inserted_rest_pose();
    if clip.frames_per_second > 100.0 {
        clip.frames = clip.frames.into_iter().step_by(THINNING).collect();
        clip.frames_per_second /= THINNING as f64;
    }
    Some(clip)
}

fn retargeted(clip: &Clip, body: &str) -> Retargeted {
    retarget(clip, &shipped(body).unwrap(), &RetargetOptions::default()).unwrap()
}

/// Greatest turn of any link in the world from one frame to the next, radians.
fn greatest_turn(result: &Retargeted) -> f64 {
    let frames: Vec<_> = result.motion.poses.iter().map(|pose| result.humanoid.link_frames(pose)).collect();
    let solid = (0..result.humanoid.links.len()).filter(|&link| !result.humanoid.links[link].solids.is_empty());
    solid
        .flat_map(|link| frames.windows(2).map(move |w| w[0][link].rotation.angle_to(&w[1][link].rotation)))
        .fold(0.0, f64::max)
}

/// Greatest turn of any recorded joint in the world from one frame to the next, radians, without thumbs and fingers.
fn greatest_recorded_turn(clip: &Clip) -> f64 {
    let frames: Vec<_> = (0..clip.frames.len()).map(|frame| clip.joint_frames(frame)).collect();
    let is_finger = |name: &str| ["thumb", "finger"].iter().any(|part| name.to_lowercase().contains(part));
    let joints = (0..clip.skeleton.joints.len()).filter(|&j| !is_finger(&clip.skeleton.joints[j].name));
    joints
        .flat_map(|joint| frames.windows(2).map(move |w| w[0][joint].rotation.angle_to(&w[1][joint].rotation)))
        .fold(0.0, f64::max)
}

#[test]
fn walks_come_within_5_mm_on_the_actor_and_17_mm_on_the_tracker() {
    println!("clip                   actor mm  worst landmark          feet mm (mean, min)  tracker25 mm");
    for name in ["49_01", "16_15", "16_17", "16_22", "35_02", "02_01", "01_01_f0001-0700"] {
        let Some(clip) = thinned(&format!("cmu_asf_amc/{name}.amc")) else { return };
        let [actor, tracker] = ["actor", "tracker25"].map(|body| retargeted(&clip, body));
        let worst = actor.report.landmarks.iter().max_by(|a, b| a.mean_mm.total_cmp(&b.mean_mm)).unwrap();
        let feet = actor.report.foot_height.unwrap();
        println!(
            "{name:22} {:8.1}  {:14} {:6.1}  {:9.1} {:9.1}  {:12.1}",
            actor.report.mean_residual_mm,
            worst.landmark,
            worst.mean_mm,
            feet.mean_mm,
            feet.min_mm,
            tracker.report.mean_residual_mm
        );
        assert!(actor.report.mean_residual_mm < 5.0, "{name}");
        assert!(worst.mean_mm < 15.0, "{name}: {worst:?}");
        assert!(tracker.report.mean_residual_mm < 17.0, "{name}");
        assert!(feet.min_mm > -30.0 && feet.mean_mm < 60.0, "{name}: {feet:?}");
        assert!(greatest_turn(&actor) < greatest_recorded_turn(&clip) + 0.2, "{name}: a link jumps");
    }
}

#[test]
fn other_formats_come_as_close_and_no_link_jumps() {
    for (file, bound_mm) in [
        ("bvh/cmu_3dsmax_131_01.bvh", 5.0),
        ("bvh/ad_cmu_jumping_jacks.bvh", 5.0),
        ("bvh/ad_wave_hello.bvh", 8.0),
        ("bvh/mocapbank_test.bvh", 5.0),
        ("deepmimic/humanoid3d_walk.txt", 5.0),
        ("deepmimic/humanoid3d_run.txt", 5.0),
        ("deepmimic/humanoid3d_jump.txt", 5.0),
        ("cmu_asf_amc/14_14_f0401-1100.amc", 5.0),
        ("cmu_asf_amc/16_03.amc", 5.0),
    ] {
        let Some(clip) = thinned(file) else { return };
        let result = retargeted(&clip, "actor");
        println!("{file}: {:.1} mm", result.report.mean_residual_mm);
        assert!(result.report.mean_residual_mm < bound_mm, "{file}: {} mm", result.report.mean_residual_mm);
        let (turn, recorded) = (greatest_turn(&result), greatest_recorded_turn(&clip));
        assert!(turn < recorded + 0.3, "{file}: {turn} rad, recorded {recorded}");
        let limits = &result.humanoid.degrees_of_freedom;
        for pose in &result.motion.poses {
            let inside = limits.iter().zip(pose.joint_angles.iter()).all(|(l, a)| *a >= l.lower && *a <= l.upper);
            assert!(inside, "{file}: an angle is outside its limits");
        }
    }
}

#[test]
fn retargeted_walks_bend_joints_the_human_way_and_face_forward() {
    for file in ["cmu_asf_amc/49_01.amc", "deepmimic/humanoid3d_walk.txt", "cmu_asf_amc/35_02.amc"] {
        let Some(clip) = thinned(file) else { return };
        let walk = retargeted(&clip, "actor");
        let angle = |name: &str| {
            let index = walk.humanoid.find_degree_of_freedom(name).unwrap();
            let of = |p: &skiagraph_core::body::Pose| p.joint_angles[index];
            let sum: f64 = walk.motion.poses.iter().map(of).sum();
            let greatest = walk.motion.poses.iter().map(of).fold(f64::MIN, f64::max);
            (sum / walk.motion.poses.len() as f64, greatest)
        };
        for side in ["left", "right"] {
            let (_, knee) = angle(&format!("{side}_knee_flexion"));
            assert!((0.7..1.6).contains(&knee), "{file}: the {side} knee bends by at most {knee} rad");
            let (elbow, _) = angle(&format!("{side}_elbow_flexion"));
            assert!(elbow > 0.1, "{file}: the {side} elbow does not bend forward");
            for twist in ["hip_rotation", "shoulder_rotation", "elbow_pronation", "clavicle_elevation"] {
                let (mean, _) = angle(&format!("{side}_{twist}"));
                assert!(mean.abs() < 0.9, "{file}: {side} {twist} is {mean} rad on average");
            }
        }
        let first = walk.motion.poses[0].world_from_root;
        let last = walk.motion.poses[walk.motion.poses.len() - 1].world_from_root;
        let travelled = last.translation.vector - first.translation.vector;
        for link in ["pelvis", "thorax", "head", "left_toes", "right_toes"] {
            let link = walk.humanoid.find_link(link).unwrap();
            let ahead: f64 = walk
                .motion
                .poses
                .iter()
                .map(|pose| (walk.humanoid.link_frames(pose)[link].rotation * nalgebra::Vector3::x()).dot(&travelled))
                .sum();
            let mean = ahead / travelled.norm() / walk.motion.poses.len() as f64;
            assert!(mean > 0.8, "{file}: {} points forward by only {mean}", walk.humanoid.links[link].name);
        }
    }
}

#[test]
fn a_recording_and_its_bvh_conversion_give_the_same_legs() {
    let (Some(amc), Some(mut bvh)) = (thinned("cmu_asf_amc/01_01_f0001-0700.amc"), thinned("bvh/cmu_mb_01_01.bvh"))
    else {
        return;
    };
    bvh.frames.truncate(amc.frames.len());
    let [a, b] = [&amc, &bvh].map(|clip| retargeted(clip, "actor"));
    assert!(b.report.notes.iter().any(|note| note.contains("lacks the bone")), "{:?}", b.report.notes);
    let distances = |landmarks: &[Landmark]| -> Vec<f64> {
        let frames = a.motion.poses.iter().zip(&b.motion.poses).flat_map(|(p, q)| {
            let p = a.humanoid.markers(&a.humanoid.link_frames(p));
            let q = b.humanoid.markers(&b.humanoid.link_frames(q));
            landmarks.iter().map(move |l| {
                let from_pelvis = |m: &Markers| m[*l as usize].unwrap() - m[Landmark::Pelvis as usize].unwrap();
                (from_pelvis(&p) - from_pelvis(&q)).norm()
            })
        });
        frames.collect()
    };
    use Landmark as L;
    let legs = distances(&[L::LeftHip, L::LeftKnee, L::LeftAnkle, L::RightHip, L::RightKnee, L::RightAnkle]);
    let upper_body = distances(&[L::Thorax, L::HeadTop, L::LeftElbow, L::LeftWrist, L::RightElbow, L::RightWrist]);
    let greatest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    println!("greatest distance: legs {:.4} m, upper body {:.4} m", greatest(&legs), greatest(&upper_body));
    assert!(greatest(&legs) < 0.005, "legs: {} m", greatest(&legs));
    assert!(greatest(&upper_body) < 0.03, "upper body: {} m", greatest(&upper_body));
}

#[test]
fn a_walk_on_a_tilted_floor_is_levelled() {
    let Some(clip) = thinned("cmu_asf_amc/02_01.amc") else { return };
    let place = |clip: &Clip, frame: usize| clip.frames[frame][0].translation.vector;
    let travelled = place(&clip, clip.frames.len() - 1) - place(&clip, 0);
    let across = nalgebra::UnitVector3::new_normalize(travelled.cross(&nalgebra::Vector3::z()));
    let mut tilted_clip = clip.clone();
    for frame in &mut tilted_clip.frames {
        frame[0] = nalgebra::UnitQuaternion::from_axis_angle(&across, 0.03) * frame[0];
    }
    let heights = |clip: &Clip| {
        let report = retargeted(clip, "actor").report;
        (report.foot_height.unwrap().mean_mm, report.ground_levelled_deg)
    };
    let (straight, own_tilt) = heights(&clip);
    let (levelled, tilt) = heights(&tilted_clip);
    assert!((tilt - own_tilt - 0.03_f64.to_degrees()).abs() < 0.2, "{own_tilt} degrees, tilted {tilt}");
    assert!((straight - levelled).abs() < 3.0, "{straight} mm, levelled {levelled} mm");
}

#[test]
fn jumps_of_a_recording_are_noted() {
    let Some(path) = crate::support::test_data("mocap/cmu_asf_amc/16_15.amc") else { return };
    let mut clip = read(&path, &ReadOptions::default()).unwrap();
    clip.frames.truncate(12);
    let notes = retargeted(&clip, "actor").report.notes;
    assert!(notes.iter().any(|note| note.contains("the recording jumps") && note.contains("frame 2")), "{notes:?}");
    clip.frames.drain(..3);
    let notes = retargeted(&clip, "actor").report.notes;
    assert!(!notes.iter().any(|note| note.contains("the recording jumps")), "{notes:?}");
}

#[test]
fn overrides_work_and_errors_name_what_is_missing() {
    let Some(mut clip) = thinned("bvh/mocapbank_test.bvh") else { return };
    clip.frames.truncate(1);
    let body = shipped("actor").unwrap();
    let with = |landmark: &str, place: &str| {
        let landmarks = BTreeMap::from([(landmark.to_owned(), place.to_owned())]);
        retarget(&clip, &body, &RetargetOptions { landmarks, ..RetargetOptions::default() })
    };
    assert!(with("thorax", "LeftShoulder+RightShoulder").is_ok());
    assert!(with("head_top", "Head:tip").is_ok());
    let message = with("left_knee", "LeftKnie").unwrap_err().to_string();
    assert!(message.contains("left_knee") && message.contains("LeftKnie") && message.contains("LeftKnee"), "{message}");
    let message = with("knee", "LeftKnee").unwrap_err().to_string();
    assert!(message.contains("`knee`") && message.contains("left_knee"), "{message}");
    let knee = clip.skeleton.find("LeftKnee").unwrap();
    clip.skeleton.joints[knee].name = "joint7".into();
    let found = retarget(&clip, &body, &RetargetOptions::default()).unwrap();
    assert_eq!(found.joint_map["left_knee"], "joint7", "whatever it is called");
}
