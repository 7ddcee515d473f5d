//! Estimates of programs that have bodies of their own: models of OpenSim, with the Python of `docs/estimates.md`.

use std::process::Command;

use skiagraph_core::npz::Npz;

use crate::sandbox::Sandbox;
use crate::support::{python_with_numpy, skip};

/// The documentation's Python that writes a model's positions.
const PAGE: &str = include_str!("../../docs/estimates.md");

/// Names and positions (frames x names x 3, metres) of the markers of a measured estimate.
fn markers(room: &Sandbox, folder: &str) -> (Vec<String>, Vec<f64>) {
    let npz = Npz::from_bytes("poses.npz", &room.read(&format!("{folder}/poses.npz"))).unwrap();
    let names = npz.names("poses.npz", "marker_names").unwrap().unwrap().to_vec();
    let places = npz.numbers("poses.npz", "estimate_markers", &[Some(1), None, Some(names.len()), Some(3)]).unwrap();
    (names, places)
}

/// A leg in the plane x, y of OpenSim's axes: hip at 0.1, 1.0, 0.2, thigh and lower leg of 0.4 m.
const LEG: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="40000"><Model name="leg">
  <Ground name="ground"/>
  <BodySet name="bodyset"><objects>
    <Body name="thigh"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>
    <Body name="shank"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>
  </objects></BodySet>
  <JointSet name="jointset"><objects>
    <PinJoint name="hip_r">
      <socket_parent_frame>hip_in_ground</socket_parent_frame>
      <socket_child_frame>/bodyset/thigh</socket_child_frame>
      <coordinates><Coordinate name="hip_flexion_r"/></coordinates>
      <frames><PhysicalOffsetFrame name="hip_in_ground">
        <socket_parent>/ground</socket_parent><translation>0.1 1.0 0.2</translation>
      </PhysicalOffsetFrame></frames>
    </PinJoint>
    <PinJoint name="knee_r">
      <socket_parent_frame>knee_in_thigh</socket_parent_frame>
      <socket_child_frame>/bodyset/shank</socket_child_frame>
      <coordinates><Coordinate name="knee_angle_r"/></coordinates>
      <frames><PhysicalOffsetFrame name="knee_in_thigh">
        <socket_parent>/bodyset/thigh</socket_parent><translation>0 -0.4 0</translation>
      </PhysicalOffsetFrame></frames>
    </PinJoint>
  </objects></JointSet>
  <MarkerSet name="markerset"><objects>
    <Marker name="ANK"><socket_parent_frame>/bodyset/shank</socket_parent_frame><location>0 -0.4 0</location></Marker>
  </objects></MarkerSet>
</Model></OpenSimDocument>
"#;

/// Two coordinates in five frames, degrees: straight, bent by right angles, and straight again.
const MOTION: &str = "Coordinates\nversion=1\nnRows=5\nnColumns=3\ninDegrees=yes\nendheader\n\
                      time\thip_flexion_r\tknee_angle_r\n0\t0\t0\n0.0166667\t90\t0\n0.0333333\t90\t-90\n\
                      0.05\t0\t-90\n0.0666667\t0\t0\n";

#[test]
fn documented_opensim_positions_are_right() {
    let Some(python) = python_with_numpy() else { return };
    let room = Sandbox::with_set();
    room.write("walk.osim", LEG);
    room.write("walk_ik.mot", MOTION);
    room.write("joints.toml", "hip_r = \"right_hip\"\nknee_r = \"right_knee\"\nANK = \"right_ankle\"\n");
    let script = PAGE.split("```python\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let written = Command::new(python).args(["-c", script]).current_dir(room.path(".")).output().unwrap();
    let said = String::from_utf8_lossy(&written.stderr);
    if said.contains("ModuleNotFoundError") {
        return skip("no OpenSim to compute positions (pip install opensim)");
    }
    assert!(written.status.success(), "{said}");
    room.succeed("evaluate set walk.trc --joint-map joints.toml --out measured");
    let (names, found) = markers(&room, "measured");
    // the set's axes are x, -z, y of the file's
    for (frame, knee, ankle) in [
        (0, [0.1, -0.2, 0.6], [0.1, -0.2, 0.2]),
        (1, [0.5, -0.2, 1.0], [0.9, -0.2, 1.0]),
        (2, [0.5, -0.2, 1.0], [0.5, -0.2, 0.6]),
        (3, [0.1, -0.2, 0.6], [-0.3, -0.2, 0.6]),
    ] {
        for (name, expected) in [("right_hip", [0.1, -0.2, 1.0]), ("right_knee", knee), ("right_ankle", ankle)] {
            let column = names.iter().position(|known| known == name).unwrap();
            let place = &found[3 * (frame * names.len() + column)..][..3];
            let near = (0..3).all(|i| (place[i] - expected[i]).abs() < 1e-6);
            assert!(near, "frame {frame}: {name} {place:?}, expected {expected:?}");
        }
    }
}
