//! Tests with known answers: the actor moves by known angles, a recording with arbitrary joint axes is made from it,
//! and retargeting must recover the motion.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::{RetargetOptions, fit_shape, retarget};
use crate::mocap::{Clip, Skeleton, SkeletonJoint};
use skiagraph_core::body::{Humanoid, Landmark, Motion, Pose, shipped};

/// Recorded joint, its parent, and the corresponding link of the actor.
const JOINTS: [(&str, Option<usize>, &str); 18] = [
    ("root", None, "pelvis"),
    ("chest", Some(0), "thorax"),
    ("neck", Some(1), "neck"),
    ("head", Some(2), "head"),
    ("left_shoulder", Some(1), "left_upper_arm"),
    ("left_elbow", Some(4), "left_forearm"),
    ("left_wrist", Some(5), "left_hand"),
    ("right_shoulder", Some(1), "right_upper_arm"),
    ("right_elbow", Some(7), "right_forearm"),
    ("right_wrist", Some(8), "right_hand"),
    ("left_hip", Some(0), "left_thigh"),
    ("left_knee", Some(10), "left_shank"),
    ("left_ankle", Some(11), "left_foot"),
    ("left_toes", Some(12), "left_toes"),
    ("right_hip", Some(0), "right_thigh"),
    ("right_knee", Some(14), "right_shank"),
    ("right_ankle", Some(15), "right_foot"),
    ("right_toes", Some(16), "right_toes"),
];

/// A stepping motion with swinging arms, in which every angle oscillates within a natural range.
fn motion_of(body: &Humanoid, frames: usize) -> Motion {
    let pose = |frame: usize| {
        let phase = 0.12 * frame as f64;
        let mut pose = body.zero_pose();
        pose.world_from_root = Isometry3::new(
            Vector3::new(0.02 * frame as f64, 0.1 * libm::sin(phase), 0.95),
            Vector3::new(0.0, 0.0, 0.4 + 0.3 * libm::sin(0.5 * phase)),
        );
        for (i, (angle, limits)) in pose.joint_angles.iter_mut().zip(&body.degrees_of_freedom).enumerate() {
            let name = limits.name.as_str();
            let is_hinge = name.contains("knee") || name.contains("elbow_flexion");
            let reach = if is_hinge { 0.8 } else { 0.25 * limits.upper.min(-limits.lower).min(1.0) };
            let is_trunk = ["lumbar", "thoracic", "neck", "head"].iter().any(|part| name.contains(part));
            let swing = libm::sin(phase + 0.7 * i as f64);
            *angle = if is_hinge { 0.5 + 0.4 * swing } else { reach * swing * if is_trunk { 0.2 } else { 1.0 } };
        }
        pose
    };
    Motion { frames_per_second: 60.0, poses: (0..frames).map(pose).collect() }
}

/// A recording of `body`: joints at its links, each with a constant rotation.
fn recording_of(body: &Humanoid, motion: &Motion) -> Clip {
    let links = JOINTS.map(|(_, _, link)| body.find_link(link).unwrap());
    let odd = |joint: usize| {
        let k = joint as f64;
        UnitQuaternion::from_scaled_axis(Vector3::new(0.3 * k, 1.0 - 0.1 * k, 0.5))
    };
    let tip = |landmark: Landmark, joint: usize| {
        body.markers[landmark as usize].map(|m| odd(joint).inverse() * m.point_in_link.coords)
    };
    let skeleton = Skeleton {
        joints: JOINTS
            .iter()
            .enumerate()
            .map(|(joint, (name, parent, _))| SkeletonJoint {
                name: (*name).into(),
                parent: *parent,
                tip: if *name == "head" { tip(Landmark::HeadTop, joint) } else { None },
            })
            .collect(),
    };
    let frame = |pose: &Pose| {
        let frames = body.link_frames(pose);
        let world = |joint: usize| frames[links[joint]] * odd(joint);
        let local = |(joint, (_, parent, _)): (usize, &(&str, Option<usize>, &str))| match parent {
            Some(parent) => world(*parent).inverse() * world(joint),
            None => world(joint),
        };
        JOINTS.iter().enumerate().map(local).collect()
    };
    Clip {
        name: "planted".into(),
        skeleton,
        frames_per_second: motion.frames_per_second,
        frames: motion.poses.iter().map(frame).collect(),
        notes: vec!["a note of the reader".into()],
        ..Clip::default()
    }
}

fn without_grounding() -> RetargetOptions {
    RetargetOptions { ground: super::Ground::Recorded, ..RetargetOptions::default() }
}

#[test]
fn a_motion_of_the_actor_is_recovered_to_a_millimetre() {
    let body = shipped("actor").unwrap();
    let motion = motion_of(&body, 120);
    let found = retarget(&recording_of(&body, &motion), &body, &without_grounding()).unwrap();
    assert!(found.report.mean_residual_mm < 1.0, "{:?}", found.report.landmarks);
    assert!(found.report.landmarks.iter().all(|l| l.max_mm < 5.0), "{:?}", found.report.landmarks);
    assert_eq!(found.report.notes, ["a note of the reader"]);
    for (planted, pose) in motion.poses.iter().zip(&found.motion.poses) {
        for joint in ["left_knee_flexion", "right_knee_flexion", "left_elbow_flexion", "right_elbow_flexion"] {
            let index = body.find_degree_of_freedom(joint).unwrap();
            let error = (planted.joint_angles[index] - pose.joint_angles[index]).abs();
            assert!(error < 0.03, "{joint}: {error} rad");
        }
        let error = planted.world_from_root.rotation.angle_to(&pose.world_from_root.rotation);
        assert!(error < 0.05, "the pelvis is {error} rad off");
    }
}

#[test]
fn a_taller_subject_gives_a_taller_body() {
    let template = shipped("actor").unwrap();
    let mut lengths = super::SegmentLengths::from_body(&template);
    for (pair, factor) in [(&mut lengths.thigh, 1.1), (&mut lengths.upper_arm, 0.9), (&mut lengths.shank, 1.05)] {
        *pair = pair.map(|length| length.map(|l| factor * l));
    }
    lengths.hip_width = lengths.hip_width.map(|w| 1.2 * w);
    let subject = template.reshaped(&fit_shape(&template, &lengths));
    let motion = motion_of(&subject, 60);
    let found = retarget(&recording_of(&subject, &motion), &template, &without_grounding()).unwrap();
    assert!(found.report.mean_residual_mm < 1.0, "{:?}", found.report.landmarks);
    let (own, planted) =
        (super::SegmentLengths::from_body(&found.humanoid), super::SegmentLengths::from_body(&subject));
    for side in 0..2 {
        for (a, b) in [(own.thigh, planted.thigh), (own.upper_arm, planted.upper_arm), (own.shank, planted.shank)] {
            assert!((a[side].unwrap() - b[side].unwrap()).abs() < 1e-6);
        }
    }
    assert!((own.hip_width.unwrap() - planted.hip_width.unwrap()).abs() < 1e-6);
    let grown = own.ankle_to_crown().unwrap() / super::SegmentLengths::from_body(&template).ankle_to_crown().unwrap();
    let hand = template.find_link("left_hand").unwrap();
    assert!((found.shape.links[hand].girth - grown.sqrt()).abs() < 1e-9);
}

#[test]
fn results_are_reproducible_and_stand_on_the_ground() {
    let body = shipped("actor").unwrap();
    let clip = recording_of(&body, &motion_of(&body, 30));
    let options = RetargetOptions { centre_path: true, ..RetargetOptions::default() };
    let [once, twice] = [(); 2].map(|()| retarget(&clip, &body, &options).unwrap());
    assert_eq!(once, twice);
    let height = once.report.foot_height.unwrap();
    assert!(height.min_mm > -150.0 && height.min_mm < 20.0, "{height:?}");
    let xs: Vec<f64> = once.motion.poses.iter().map(|p| p.world_from_root.translation.x).collect();
    let (low, high) = xs.iter().fold((f64::MAX, f64::MIN), |(l, h), &x| (l.min(x), h.max(x)));
    assert!((low + high).abs() < 1e-9, "{low} {high}");
}

/// Jumps are judged at the recorded speed.
#[test]
fn a_recording_played_faster_does_not_jump() {
    let body = shipped("actor").unwrap();
    let mut motion = motion_of(&body, 4);
    // 5 m/s along x
    for (frame, pose) in motion.poses.iter_mut().enumerate() {
        pose.world_from_root.translation.x = 5.0 / motion.frames_per_second * frame as f64;
    }
    let clip = recording_of(&body, &motion).at_speed(4.0);
    let jumps = |speed: f64| {
        let found = retarget(&clip, &body, &RetargetOptions { speed, ..without_grounding() }).unwrap();
        found.report.notes.iter().any(|note| note.starts_with("the recording jumps"))
    };
    assert!(jumps(1.0) && !jumps(4.0));
}

#[test]
fn one_frame_suffices_and_none_is_refused() {
    let body = shipped("actor").unwrap();
    let mut clip = recording_of(&body, &motion_of(&body, 1));
    assert_eq!(retarget(&clip, &body, &RetargetOptions::default()).unwrap().motion.poses.len(), 1);
    clip.frames.clear();
    let message = retarget(&clip, &body, &RetargetOptions::default()).unwrap_err().to_string();
    assert!(message.contains("no frames"), "{message}");
}

#[test]
fn a_missing_marker_is_refused_by_name() {
    let mut body = shipped("actor").unwrap();
    let clip = recording_of(&body, &motion_of(&body, 1));
    body.markers[Landmark::LeftKnee as usize] = None;
    let message = retarget(&clip, &body, &RetargetOptions::default()).unwrap_err().to_string();
    assert!(message.contains("left_knee") && message.contains("marker_NAME"), "{message}");
}

#[test]
fn a_gap_above_the_thorax_joint_is_closed_by_the_bone_below() {
    let body = shipped("actor").unwrap();
    let mut clip = recording_of(&body, &motion_of(&body, 3));
    let whole = super::anatomy::Anatomy::from_clip(&clip, &Default::default()).unwrap();
    assert_eq!(whole.restored_bone_m(), None);
    let before = whole.observe(&clip, 1).markers;
    for frame in &mut clip.frames {
        for child in [2, 4, 7] {
            frame[child].translation.vector = Vector3::zeros();
        }
    }
    let closed = super::anatomy::Anatomy::from_clip(&clip, &Default::default()).unwrap();
    let after = closed.observe(&clip, 1);
    let bone = closed.restored_bone_m().unwrap();
    let place = |landmark: Landmark| after.markers[landmark as usize].unwrap();
    let thorax = Point3::from(clip.joint_frames(1)[1].translation.vector);
    assert!(((place(Landmark::LeftShoulder) - thorax).norm() - bone).abs() < 1e-12);
    assert_eq!(place(Landmark::LeftKnee), before[Landmark::LeftKnee as usize].unwrap());
}
