//! Robots with too few solids, and solids made from joints.

use crate::sandbox::Sandbox;
use crate::support::test_data;

const SIMPLE: &str = "robots/gepetto_simple_humanoid/simple_humanoid_description/urdf/simple_humanoid.urdf";

#[test]
fn solids_from_joints_can_be_tracked() {
    let room = Sandbox::tiny();
    // solids on its pelvis only
    let mut is_pelvis = false;
    let mut robot = String::new();
    for line in include_str!("../../robots/tracker25.urdf").lines() {
        if line.contains("<link name=") {
            is_pelvis = line.contains("\"pelvis\"");
        }
        if is_pelvis || !line.trim_start().starts_with("<visual") {
            robot += &format!("{line}\n");
        }
    }
    room.write("robot.urdf", robot);
    let both =
        "actor.robot=robot.urdf actor.solids=from_joints tracker_body.robot=robot.urdf tracker_body.solids=from_joints";
    let said = room.json_of(&format!("check tiny.toml {both} --json"));
    for body in ["actor_drawn", "tracker_body_drawn"] {
        assert_eq!((&said[body]["links_drawn"], &said[body]["links"]), (&10.into(), &10.into()), "{said}");
        assert_eq!((said[body]["height"].as_f64(), said[body]["reach"].as_f64()), (Some(1.0), Some(1.0)), "{said}");
    }
    room.succeed(&format!("run tiny.toml {both} --out run --quiet"));
    assert!(room.mean("run", "silhouette_iou") > 0.3);
}

/// The simple humanoid has two usable solids, both on one link.
#[test]
fn simple_humanoid_stands_from_joints() {
    let Some(robot) = test_data(SIMPLE) else { return };
    let room = Sandbox::tiny();
    let robot = robot.display();
    assert!(room.refused(&format!("check tiny.toml actor.robot={robot}"), "1 of ").contains("from_joints"));
    let own = format!("actor.robot={robot} actor.solids=from_joints");
    room.succeed(&format!("render tiny.toml {own} actor.contact=fix motion.last_frame=12 --out set"));
    room.says("inspect set", &["contact  "]);
    // masses come from the file
    let mass = |solids: &str| -> f64 {
        room.json_of(&format!("inspect {robot} --solids {solids} --json"))["mass_kg"].as_f64().unwrap()
    };
    assert_eq!(mass("urdf"), mass("from_joints"));
}
