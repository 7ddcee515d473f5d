//! Robots of other projects as actors and as trackers' bodies.

use std::path::PathBuf;

use crate::sandbox::{Sandbox, shipped};
use crate::support::test_data;

/// File, and the maximum distance of its landmarks from the recorded ones, mm. The simple humanoid's joint limits do
/// not fit a human (its left knee bends from -120 to 40 degrees), so it cannot follow the recorded walk.
const ROBOTS: [(&str, f64); 5] = [
    ("pybullet_humanoid/humanoid.urdf", 2.0),
    ("gepetto_human/human_description/robots/human.urdf", 8.0),
    ("gepetto_simple_humanoid/simple_humanoid_description/urdf/simple_humanoid.urdf", 60.0),
    ("human_gazebo/humanSubject01_48dof.urdf", 12.0),
    ("human_gazebo/humanSubject01_66dof.urdf", 8.0),
];

fn robots() -> impl Iterator<Item = (PathBuf, f64)> {
    ROBOTS.into_iter().filter_map(|(file, most)| Some((test_data(&format!("robots/{file}"))?, most)))
}

/// The override for a body's solids: the simple humanoid has hardly any.
fn solids(table: &str, robot: &std::path::Path) -> String {
    let is_bare = robot.ends_with("simple_humanoid.urdf");
    if is_bare { format!(" {table}.solids=from_joints") } else { String::new() }
}

fn frozen(room: &Sandbox, settings: &str) {
    let scenario = shipped("scenarios/smoke/frozen.toml").display().to_string();
    let command = format!("run {scenario} rig.ring.size_px=[80,60] {settings} --quiet --force --out run");
    room.succeed(&command);
}

#[test]
fn other_robots_have_all_markers() {
    let room = Sandbox::new();
    for (robot, _) in robots() {
        let summary = room.json_of(&format!("inspect {} --json", robot.display()));
        assert_eq!(summary["missing_markers"].as_array().unwrap().len(), 0, "{summary}");
        let notes = summary["notes"].to_string();
        assert!(notes.contains("markers proposed") && notes.contains("marker_NAME overrides one"), "{notes}");
    }
}

#[test]
fn other_robots_walk_upright() {
    let room = Sandbox::new();
    for (robot, most) in robots() {
        let own = format!("actor.robot={}{}", robot.display(), solids("actor", &robot));
        let name = robot.display();
        let said = room.json_of(&format!("check {} {own} --json", shipped("scenarios/smoke/frozen.toml").display()));
        assert!(said["retarget_residual_mm"].as_f64().unwrap() < most, "{name}: {said}");
        frozen(&room, &own);
        let (body, heading) = (room.mean("run", "body_orientation_deg"), room.mean("run", "heading_deg"));
        // a confused axis would give an error of 90 degrees
        assert!(body < 45.0 && heading < 20.0, "{name}: frozen is {body} degrees off, {heading} about the vertical");
    }
}

#[test]
fn other_robots_are_trackers_bodies() {
    let room = Sandbox::new();
    for (robot, _) in robots() {
        let name = robot.display();
        frozen(
            &room,
            &format!("tracker_body.robot={name}{} tracker_body.mismatch=none", solids("tracker_body", &robot)),
        );
        let body = room.mean("run", "body_orientation_deg");
        assert!(body < 45.0, "{name}: frozen is {body} degrees off");
    }
}
