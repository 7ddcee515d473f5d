//! Robots with too few solids, and solids made from joints.

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY};
use crate::support::test_data;

const SIMPLE: &str = "gepetto_simple_humanoid/simple_humanoid_description/urdf/simple_humanoid.urdf";

/// `tracker25` with solids on its pelvis only.
fn hardly_drawn() -> String {
    let mut text = String::new();
    let mut is_pelvis = false;
    for line in include_str!("../../robots/tracker25.urdf").lines() {
        if line.contains("<link name=") {
            is_pelvis = line.contains("\"pelvis\"");
        }
        let is_visual = line.trim_start().starts_with("<visual");
        if !is_visual || is_pelvis {
            text += &format!("{line}\n");
        }
    }
    text
}

/// A `tracker25` with missing meshes instead of its solids.
fn without_meshes() -> String {
    let text = include_str!("../../robots/tracker25.urdf");
    let mut parts = text.split("<sphere");
    let mut changed = parts.next().unwrap().to_owned();
    for part in parts {
        changed += &format!("<mesh filename=\"gone.stl\"/>{}", part.split_once("/>").unwrap().1);
    }
    changed.replace("taper:", "part:")
}

fn room(robot: &str) -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.write("robot.urdf", robot);
    room
}

#[test]
fn a_body_with_too_few_solids_is_refused_and_solids_from_joints_work() {
    let room = room(&hardly_drawn());
    for table in ["actor", "tracker_body"] {
        for command in ["check", "run"] {
            let refused = room.skiagraph([command, "tiny.toml", &format!("{table}.robot=robot.urdf")]);
            assert_eq!(refused.code, 2, "{}", refused.stderr);
            for words in [
                &format!("{table}.robot"),
                "too little of `tracker25` is drawn",
                "1 of 10 links",
                "% of the height",
                "% of the reach",
                "without solids: head, left_upper_arm, left_forearm",
                &format!("[{table}] solids = \"from_joints\""),
            ] {
                assert!(refused.stderr.contains(words), "{command} {table}: no {words}: {}", refused.stderr);
            }
        }
    }
    assert_eq!(room.entries(), ["robot.urdf", "tiny.toml"]);
    let both =
        "actor.robot=robot.urdf actor.solids=from_joints tracker_body.robot=robot.urdf tracker_body.solids=from_joints";
    let said = room.succeed(&format!("check tiny.toml {both} --json"));
    let said: Value = serde_json::from_str(&said.stdout).unwrap();
    for body in ["actor_drawn", "tracker_body_drawn"] {
        assert_eq!((&said[body]["links_drawn"], &said[body]["links"]), (&10.into(), &10.into()), "{said}");
        assert_eq!((said[body]["height"].as_f64(), said[body]["reach"].as_f64()), (Some(1.0), Some(1.0)), "{said}");
    }
    room.succeed(&format!("run tiny.toml {both} --out run --quiet"));
    let run: Value = serde_json::from_slice(&room.read("run/run.json")).unwrap();
    assert!(run["metrics"]["silhouette_iou"]["mean"].as_f64().unwrap() > 0.3, "{}", run["metrics"]["silhouette_iou"]);
}

#[test]
fn a_skin_replaces_missing_solids() {
    let room = room(&hardly_drawn());
    room.succeed("check tiny.toml actor.robot=robot.urdf actor.skin=person_coarse");
    let said = room.succeed("check tiny.toml actor.robot=robot.urdf actor.skin=person_coarse").stdout;
    assert!(
        said.contains("surface  actor has a skin; tracker has solids on 17 of 17 links, 100 % of the height"),
        "{said}"
    );
}

#[test]
fn a_robot_without_its_mesh_files_runs_with_solids_from_joints() {
    let room = room(&without_meshes());
    let refused = room.skiagraph(["check", "tiny.toml", "actor.robot=robot.urdf"]);
    assert_eq!(refused.code, 2);
    assert!(
        refused.stderr.contains("gone.stl") && refused.stderr.contains("solids = \"from_joints\""),
        "{}",
        refused.stderr
    );
    let told = room.succeed("check tiny.toml actor.robot=robot.urdf actor.solids=from_joints");
    assert!(told.stderr.contains("capsules from joint to joint"), "{}", told.stderr);
    let refused = room.skiagraph(["inspect", "robot.urdf"]);
    assert!(refused.code == 2 && refused.stderr.contains("inspect: --solids from_joints"), "{}", refused.stderr);
    let shown = room.succeed("inspect robot.urdf --solids from_joints --out robot.png").stdout;
    assert!(shown.contains("drawn    10 of 10 links, 100 % of the height, 100 % of the reach"), "{shown}");
    assert!(room.read("robot.png").starts_with(b"\x89PNG"));
}

#[test]
fn inspect_shows_how_much_of_a_robot_its_solids_cover() {
    let room = room(&hardly_drawn());
    let shown = room.succeed("inspect robot.urdf").stdout;
    assert!(shown.contains("drawn    1 of 10 links") && shown.contains("undrawn  head, "), "{shown}");
    assert!(shown.contains("scenarios refuse it without a skin or solids = \"from_joints\""), "{shown}");
    let shown: Value = serde_json::from_str(&room.succeed("inspect actor --json").stdout).unwrap();
    assert_eq!((&shown["drawn"]["links_drawn"], &shown["drawn"]["links"]), (&21.into(), &21.into()), "{shown}");
    let refused = room.skiagraph(["inspect", "embedded:walk", "--solids", "from_joints"]);
    assert!(refused.code == 2 && refused.stderr.contains("--solids"), "{}", refused.stderr);
}

#[test]
fn solids_of_shipped_robots_suffice_for_all_scenarios() {
    let room = room("");
    room.succeed("render tiny.toml --out plain");
    room.succeed("render tiny.toml actor.solids=urdf tracker_body.solids=urdf --out said");
    assert_eq!(room.read("plain/files.sha256"), room.read("said/files.sha256"));
}

/// The simple humanoid has two usable solids, both on one link.
#[test]
fn the_simple_humanoid_is_refused_and_its_feet_stand_on_the_ground_from_its_joints() {
    let Some(robot) = test_data(&format!("robots/{SIMPLE}")) else { return };
    let room = room("");
    let robot = robot.display();
    let refused = room.skiagraph(["check", "tiny.toml", &format!("actor.robot={robot}")]);
    assert_eq!(refused.code, 2);
    assert!(refused.stderr.contains("1 of ") && refused.stderr.contains("from_joints"), "{}", refused.stderr);
    let own = format!("actor.robot={robot} actor.solids=from_joints");
    room.succeed(&format!("render tiny.toml {own} actor.contact=fix motion.last_frame=12 --out set"));
    let facts = room.succeed("inspect set").stdout;
    assert!(facts.contains("contact  "), "{facts}");
    // masses come from the file
    let mass = |solids: &str| -> f64 {
        let told = room.succeed(&format!("inspect {robot} --solids {solids} --json")).stdout;
        serde_json::from_str::<Value>(&told).unwrap()["mass_kg"].as_f64().unwrap()
    };
    assert_eq!(mass("urdf"), mass("from_joints"));
}
