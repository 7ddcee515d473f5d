//! Forward kinematics against pinocchio: `forward_kinematics.csv` holds the link frames that pinocchio 4.1.0 computed
//! for random configurations of the shipped robots and of others (ball joints as three hinges).

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use skiagraph_core::body::{Humanoid, shipped};

#[derive(Default)]
struct Configuration {
    world_from_root: Isometry3<f64>,
    angles: Vec<(String, f64)>,
    links: Vec<(String, Isometry3<f64>)>,
}

fn configurations() -> BTreeMap<(String, String), Configuration> {
    let mut all: BTreeMap<(String, String), Configuration> = BTreeMap::new();
    let mut reader = csv::Reader::from_reader(include_str!("../forward_kinematics.csv").as_bytes());
    for record in reader.records() {
        let record = record.unwrap();
        let number = |i: usize| record[4 + i].parse::<f64>().unwrap();
        let isometry = || {
            let rotation = UnitQuaternion::new_normalize(Quaternion::new(number(3), number(4), number(5), number(6)));
            Isometry3::from_parts(Vector3::new(number(0), number(1), number(2)).into(), rotation)
        };
        let configuration = all.entry((record[0].to_owned(), record[1].to_owned())).or_default();
        match &record[2] {
            "root" => configuration.world_from_root = isometry(),
            "angle" => configuration.angles.push((record[3].to_owned(), number(0))),
            "link" => configuration.links.push((record[3].to_owned(), isometry())),
            kind => panic!("unknown kind {kind}"),
        }
    }
    all
}

fn robot(file: &str) -> Option<Humanoid> {
    match file.strip_prefix("robots/") {
        Some(name) => Some(shipped(name.trim_end_matches(".urdf")).unwrap()),
        None => crate::support::test_data(&format!("robots/{file}")).map(|path| Humanoid::load(&path).unwrap()),
    }
}

#[test]
fn link_frames_agree_with_pinocchio_on_seven_robots() {
    let mut compared = 0;
    for ((file, number), configuration) in configurations() {
        let Some(body) = robot(&file) else { continue };
        let mut pose = body.zero_pose();
        pose.world_from_root = configuration.world_from_root;
        assert_eq!(configuration.angles.len(), body.degrees_of_freedom.len(), "{file}");
        for (name, value) in &configuration.angles {
            let index = body.find_degree_of_freedom(name).unwrap_or_else(|| panic!("{file}: no {name}"));
            pose.joint_angles[index] = *value;
        }
        let frames = body.link_frames(&pose);
        assert_eq!(configuration.links.len(), body.links.len(), "{file}");
        for (name, expected) in &configuration.links {
            let frame = frames[body.find_link(name).unwrap_or_else(|| panic!("{file}: no link {name}"))];
            let offset = (frame.translation.vector - expected.translation.vector).norm();
            let turn = frame.rotation.angle_to(&expected.rotation);
            // The table has nine digits; angles add up along a chain.
            assert!(offset < 5e-8, "{file} {number} {name}: {offset} m apart");
            assert!(turn < 2e-7, "{file} {number} {name}: {turn} rad apart");
            compared += 1;
        }
    }
    assert!(compared >= 130, "only {compared} links were compared");
}
