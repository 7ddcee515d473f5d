//! Shipped skins on robots.

use nalgebra::Point3;
use skiagraph_core::body::{Humanoid, Landmark, shipped as shipped_robot, shipped_skin};
use skiagraph_truth::mocap::{ReadOptions, read};
use skiagraph_truth::retarget::{RetargetOptions, retarget, with_skin};

use crate::support::test_data;

/// File, and the maximum distance of a joint from the nearest vertex of the skin, m: shoulders and hips of robots are
/// deeper in the body than elbows.
const ROBOTS: [(&str, f64); 4] = [
    ("pybullet_humanoid/humanoid.urdf", 0.15),
    ("gepetto_human/human_description/robots/human.urdf", 0.15),
    ("human_gazebo/humanSubject01_48dof.urdf", 0.15),
    ("human_gazebo/humanSubject01_66dof.urdf", 0.15),
];

/// The maximum distance of a limb's joint from the skin over some frames of a walk, with the joint's name.
fn farthest_joint(body: &Humanoid) -> (f64, &'static str) {
    use Landmark as L;
    let clip =
        read(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/motions/01_01.bvh").as_ref(), &ReadOptions::default())
            .unwrap();
    let clip = clip.without_inserted_rest_pose().crop(0..240).unwrap().resampled(10.0).unwrap();
    let performed = retarget(&clip, body, &RetargetOptions::default()).unwrap();
    let (body, mut vertices, mut farthest) = (performed.humanoid, Vec::new(), (0.0, ""));
    for pose in performed.motion.poses.iter().step_by(5) {
        let frames = body.link_frames(pose);
        body.skin.as_ref().unwrap().deform_into(&frames, &mut vertices);
        let markers = body.markers(&frames);
        for landmark in [
            L::LeftElbow,
            L::RightElbow,
            L::LeftWrist,
            L::RightWrist,
            L::LeftKnee,
            L::RightKnee,
            L::LeftAnkle,
            L::RightAnkle,
            L::HeadTop,
        ] {
            let place = markers[landmark as usize].unwrap();
            let away =
                vertices.iter().map(|vertex: &Point3<f64>| (vertex - place).norm()).fold(f64::INFINITY, f64::min);
            if away > farthest.0 {
                farthest = (away, landmark.name());
            }
        }
    }
    farthest
}

/// Shipped skins also fit robots whose links have other names.
#[test]
fn shipped_skins_follow_the_joints_of_robots_with_other_names() {
    let skin = shipped_skin("person_coarse").unwrap();
    for (file, most) in ROBOTS {
        let Some(path) = test_data(&format!("robots/{file}")) else { return };
        let body = with_skin(&Humanoid::load(&path).unwrap(), &skin).unwrap_or_else(|error| panic!("{file}: {error}"));
        let (away, joint) = farthest_joint(&body);
        println!("{file}: {joint} is {:.0} mm from the skin", 1000.0 * away);
        assert!(away < most, "{file}: {joint} is {away} m from the skin");
    }
}

/// A robot whose limits allow no human pose is refused, so that no wrong silhouette is drawn.
#[test]
fn a_robot_that_cannot_take_the_skins_pose_is_refused_or_fits() {
    let file = "robots/gepetto_simple_humanoid/simple_humanoid_description/urdf/simple_humanoid.urdf";
    let Some(path) = test_data(file) else { return };
    match with_skin(&Humanoid::load(&path).unwrap(), &shipped_skin("person_coarse").unwrap()) {
        Ok(body) => {
            let (away, joint) = farthest_joint(&body);
            println!("{file}: {joint} is {:.0} mm from the skin", 1000.0 * away);
            assert!(away < 0.2, "{joint} is {away} m from the skin");
        }
        Err(error) => {
            println!("{file}: {error}");
            assert!(error.to_string().starts_with("skin `person_coarse`"), "{error}");
        }
    }
}

/// The meshes are decimated asymmetrically, and the cuts at the hips of `woman` differ (`robots/README.md`).
#[test]
fn masses_of_paired_segments_of_shipped_skins_differ_as_documented() {
    for (skin, most) in [("person", 0.12), ("woman", 0.17), ("man", 0.10)] {
        let body =
            with_skin(&shipped_robot("actor").unwrap(), &shipped_skin(skin).unwrap()).unwrap().with_masses_of_skin();
        let mass = |name: &str| body.links[body.find_link(name).unwrap()].inertia.as_ref().unwrap().mass;
        for part in ["upper_arm", "forearm", "hand", "thigh", "shank", "foot"] {
            let [left, right] = ["left", "right"].map(|side| mass(&format!("{side}_{part}")));
            let apart = 2.0 * (left - right) / (left + right);
            println!("{skin} {part}: {left:.3} kg, {right:.3} kg: {:.1} %", 100.0 * apart);
            assert!(apart.abs() < most, "{skin}: {part} {left} kg and {right} kg");
        }
    }
}
