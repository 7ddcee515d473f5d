//! Skins on robots, and errors for files that are not skins.

use std::fs;

use nalgebra::Point3;
use skiagraph::body::{Humanoid, Landmark, shipped as shipped_robot, shipped_skin};
use skiagraph::mocap::{ReadOptions, read};
use skiagraph::retarget::{RetargetOptions, retarget, with_skin};

use crate::sandbox::{Sandbox, TINY, shipped};
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
    let clip = read(&shipped("scenarios/motions/01_01.bvh"), &ReadOptions::default()).unwrap();
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

#[test]
fn a_robot_without_recognised_limbs_is_refused_with_expected_and_found_names() {
    let room = Sandbox::new();
    let link = |name: &str| {
        format!("<link name=\"{name}\"><visual><geometry><box size=\"0.2 0.2 0.2\"/></geometry></visual></link>")
    };
    let joint = "<joint name=\"j\" type=\"revolute\"><parent link=\"crate\"/><child link=\"lid\"/>\
                 <origin xyz=\"0 0 0.5\"/><axis xyz=\"0 1 0\"/><limit lower=\"-1\" upper=\"1\" effort=\"9\" velocity=\"9\"/></joint>";
    room.write("crate.urdf", format!("<robot name=\"crate\">{}{}{joint}</robot>", link("crate"), link("lid")));
    room.write("tiny.toml", TINY);
    let answer = room.skiagraph(["check", "tiny.toml", "actor.robot=crate.urdf", "actor.skin=person_coarse"]);
    assert_eq!(answer.code, 2, "{}", answer.stdout);
    let said = &answer.stderr;
    assert!(
        said.contains("actor.skin") && said.contains("left_thigh") && said.contains("its links are: crate, lid"),
        "{said}"
    );
    assert!(said.contains("lacks the landmarks"), "{said}");
}

#[test]
fn errors_in_files_and_settings_of_skins_name_the_skin() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let figure = r#"{"asset": {"version": "2.0"}, "buffers": [{"uri": "figure.bin", "byteLength": 4}]}"#;
    room.write("figure.gltf", figure);
    let answer = room.skiagraph(["inspect", "figure.gltf"]);
    assert_eq!(answer.code, 2);
    let said = "figure.gltf: refers to the file `figure.bin`, which cannot be read";
    assert!(answer.stderr.contains(said), "{}", answer.stderr);
    let answer = room.skiagraph(["check", "tiny.toml", "actor.skin_blending=dual_quaternion"]);
    assert_eq!(answer.code, 2);
    assert!(answer.stderr.contains("actor.skin_blending: only valid with a `skin`"), "{}", answer.stderr);
    let answer = room.skiagraph(["check", "tiny.toml", "actor.skin=persn"]);
    assert_eq!(answer.code, 2);
    for words in
        ["actor.skin: `persn` is neither a built-in skin (person, ", ") nor the file ", "did you mean `person`?"]
    {
        assert!(answer.stderr.contains(words), "{words}: {}", answer.stderr);
    }
}

#[test]
fn notes_on_the_trackers_skin_name_it() {
    let room = Sandbox::new();
    let folder = shipped("robots/skins");
    for file in ["person_coarse.obj", "person_coarse.toml"] {
        fs::copy(folder.join(file), room.path(file)).unwrap();
    }
    let weights = fs::read_to_string(folder.join("person_coarse.weights.json")).unwrap();
    room.write(
        "person_coarse.weights.json",
        weights.replacen("\"weights\": {", "\"weights\": {\"tail\": [], ", 1).replacen(
            "\"weights\":{",
            "\"weights\":{\"tail\": [], ",
            1,
        ),
    );
    room.write("tiny.toml", TINY);
    let said = room.succeed("check tiny.toml tracker_body.skin=person_coarse.toml");
    let said = format!("{}{}", said.stdout, said.stderr);
    let note = "tracker_body.skin: person_coarse.toml: groups of person_coarse.weights.json without any weight";
    assert!(said.contains(note) && !said.contains("actor.robot: skin"), "{said}");
}

/// The meshes are decimated asymmetrically, and the cuts at the hips of `woman` differ (`robots/README.md`).
#[test]
fn masses_of_paired_segments_of_shipped_skins_differ_as_documented() {
    for (skin, most) in [("person", 0.05), ("woman", 0.17), ("man", 0.06)] {
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
