//! Bodies and motions for tests.

use nalgebra::{DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use skiagraph_core::body::{
    DegreeOfFreedom, Drive, Humanoid, Joint, JointKind, LANDMARKS, Landmark, Link, LinkPoint, Motion, Pose, Solid,
    shipped,
};
use skiagraph_core::raster::TaperedCapsule;

fn capsule(b: [f64; 3], radius_a: f64, radius_b: f64) -> Solid {
    Solid::TaperedCapsule(TaperedCapsule { a: Point3::origin(), b: b.into(), radius_a, radius_b })
}

/// Torso, head, two arms of two links and two stiff legs; six hinges about the y axis; all fifteen markers.
pub fn person() -> Humanoid {
    let mut body = Humanoid {
        name: "stick".to_string(),
        links: vec![Link {
            name: "torso".to_string(),
            solids: vec![capsule([0.0, 0.0, 0.4], 0.14, 0.16)],
            inertia: None,
        }],
        joints: Vec::new(),
        degrees_of_freedom: Vec::new(),
        markers: [None; LANDMARKS.len()],
        skin: None,
        notes: Vec::new(),
    };
    let mut add = |name: &str, parent: usize, at: [f64; 3], solid: Solid, hinge: bool| {
        let kind = if hinge {
            body.degrees_of_freedom.push(DegreeOfFreedom {
                name: name.to_string(),
                lower: -2.0,
                upper: 2.0,
                max_velocity: f64::INFINITY,
                max_effort: f64::INFINITY,
            });
            JointKind::Revolute { axis: Vector3::y_axis(), drive: Drive::direct(body.degrees_of_freedom.len() - 1) }
        } else {
            JointKind::Fixed
        };
        let parent_from_joint = Isometry3::translation(at[0], at[1], at[2]);
        body.joints.push(Joint { name: format!("{name}_joint"), parent, parent_from_joint, kind });
        body.links.push(Link { name: name.to_string(), solids: vec![solid], inertia: None });
        body.links.len() - 1
    };
    let head = add("head", 0, [0.0, 0.0, 0.62], capsule([0.0, 0.0, 0.08], 0.09, 0.09), false);
    let mut markers = vec![
        (Landmark::Thorax, 0, [0.0, 0.0, 0.45]),
        (Landmark::Pelvis, 0, [0.0, 0.0, 0.0]),
        (Landmark::HeadTop, head, [0.0, 0.0, 0.15]),
    ];
    use Landmark::*;
    let left = [LeftShoulder, LeftElbow, LeftWrist, LeftHip, LeftKnee, LeftAnkle];
    let right = [RightShoulder, RightElbow, RightWrist, RightHip, RightKnee, RightAnkle];
    for (side, sign, [shoulder, elbow, wrist, hip, knee, ankle]) in [("left", 1.0, left), ("right", -1.0, right)] {
        let upper = capsule([0.0, 0.0, -0.3], 0.05, 0.04);
        let upper = add(&format!("{side}_upper_arm"), 0, [0.0, 0.21 * sign, 0.43], upper, true);
        let fore = capsule([0.0, 0.0, -0.25], 0.04, 0.03);
        let fore = add(&format!("{side}_forearm"), upper, [0.0, 0.0, -0.3], fore, true);
        let leg = capsule([0.0, 0.0, -0.85], 0.08, 0.05);
        let leg = add(&format!("{side}_leg"), 0, [0.0, 0.1 * sign, 0.0], leg, true);
        markers.extend([(shoulder, upper, [0.0; 3]), (elbow, fore, [0.0; 3]), (wrist, fore, [0.0, 0.0, -0.25])]);
        markers.extend([(hip, leg, [0.0; 3]), (knee, leg, [0.0, 0.0, -0.42]), (ankle, leg, [0.0, 0.0, -0.85])]);
    }
    for (landmark, link, point) in markers {
        body.markers[landmark as usize] = Some(LinkPoint { link, point_in_link: point.into() });
    }
    body
}

/// `frames` frames at 60 Hz of a person who walks along +X from the origin, limbs straight down in the first frame.
pub fn walk(frames: usize) -> Motion {
    let pose = |frame: usize| {
        let phase = frame as f64 / 10.0;
        let swing = 0.4 * libm::sin(phase);
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.2 * libm::sin(0.3 * phase));
        Pose {
            world_from_root: Isometry3::from_parts(Translation3::new(0.02 * frame as f64, 0.0, 0.95), yaw),
            joint_angles: DVector::from_vec(vec![swing, -swing.abs(), -swing, -swing, -0.5 * swing.abs(), swing]),
        }
    };
    Motion { frames_per_second: 60.0, poses: (0..frames).map(pose).collect() }
}

/// The actor with slightly bent knees, on the ground.
pub fn standing(frames: usize) -> (Humanoid, Motion) {
    standing_bent(frames, 0.2)
}

/// The actor with knees bent by twice this angle, on the ground.
pub fn standing_bent(frames: usize, angle: f64) -> (Humanoid, Motion) {
    let body = shipped("actor").unwrap();
    let mut pose = body.zero_pose();
    for side in ["left", "right"] {
        for (joint, angle) in [("hip_flexion", angle), ("knee_flexion", 2.0 * angle), ("ankle_dorsiflexion", angle)] {
            pose.joint_angles[body.find_degree_of_freedom(&format!("{side}_{joint}")).unwrap()] = angle;
        }
    }
    let links: Vec<usize> = (0..body.links.len()).collect();
    let lowest = body.lowest_point(&body.link_frames(&pose), &links).unwrap().z;
    pose.world_from_root = Isometry3::translation(0.0, 0.0, -lowest);
    (body, Motion { frames_per_second: 60.0, poses: vec![pose; frames] })
}
