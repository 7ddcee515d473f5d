use std::io;

use nalgebra::{Point3, Vector3};

use crate::body::{Humanoid, JointKind, Landmark, Solid, UrdfError};
use crate::test_data;

fn no_meshes(_: &str) -> io::Result<Vec<u8>> {
    Err(io::Error::new(io::ErrorKind::NotFound, "no meshes here"))
}

fn parse(text: &str) -> Result<Humanoid, UrdfError> {
    Humanoid::from_urdf(text, "test.urdf", &no_meshes)
}

fn link(name: &str) -> String {
    format!("<link name=\"{name}\"/>\n")
}

fn hinge(name: &str, parent: &str, child: &str, inside: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>{inside}</joint>\n"
    )
}

const LIMIT: &str = "<limit lower=\"-1\" upper=\"2\" effort=\"3\" velocity=\"4\"/>";

fn robot(parts: &[String]) -> String {
    format!("<robot name=\"r\">\n{}</robot>", parts.concat())
}

/// Two links and a joint with this content.
fn elbow(inside: &str) -> String {
    robot(&[link("a"), link("b"), hinge("j", "a", "b", inside)])
}

/// One link with this content.
fn block(inside: &str) -> String {
    format!("<robot name=\"r\">\n<link name=\"a\">{inside}</link></robot>")
}

#[test]
fn every_fault_of_a_urdf_is_refused_with_its_line_and_element() {
    let ring = [link("a"), link("b"), hinge("ab", "a", "b", LIMIT), hinge("ba", "b", "a", LIMIT)];
    let side_ring = [link("root"), ring.concat()];
    let bad_mimic = |target: &str| format!("{LIMIT}<mimic joint=\"{target}\"/>");
    let sphere = |attributes: &str| block(&format!("<visual><geometry><sphere {attributes}/></geometry></visual>"));
    let mass = |value: &str| {
        let inertia = "<inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/>";
        block(&format!("<inertial><mass value=\"{value}\"/>{inertia}</inertial>"))
    };
    let taper =
        |name: &str| block(&format!("<visual name=\"{name}\"><geometry><sphere radius=\"1\"/></geometry></visual>"));
    let cases = [
        (robot(&ring), "test.urdf:5: joint `ba`: the links form a cycle (a -> b -> a)"),
        (robot(&side_ring), "the links form a cycle"),
        (robot(&[link("a"), link("b")]), "test.urdf:3: link `b`: has no parent joint, and neither has `a`"),
        (robot(&[]), "no <link>"),
        (robot(&[link("a"), link("a")]), "test.urdf:3: link `a`: a second link named `a`"),
        (robot(&[link("a"), hinge("j", "a", "b", LIMIT)]), "joint `j`: child link `b` does not exist"),
        (robot(&[link("a"), hinge("j", "c", "a", LIMIT)]), "joint `j`: parent link `c` does not exist"),
        (robot(&[link("a"), link("b"), hinge("j", "a", "b", LIMIT), hinge("k", "a", "b", LIMIT)]), "has one parent"),
        (
            robot(&[link("a"), link("b"), link("c"), hinge("j", "a", "b", LIMIT), hinge("j", "b", "c", LIMIT)]),
            "second joint",
        ),
        (elbow(&format!("<axis xyz=\"0 0 0\"/>{LIMIT}")), "test.urdf:4: joint `j`: the axis is zero"),
        (elbow(&format!("<axis xyz=\"0 NaN 1\"/>{LIMIT}")), "joint `j`: <axis xyz=\"0 NaN 1\">: expected 3 numbers"),
        (elbow(&format!("<axis xyz=\"0 x 1 0\"/>{LIMIT}")), "expected 3 numbers"),
        (elbow(&format!("<origin xyz=\"0 inf 0\"/>{LIMIT}")), "<origin xyz=\"0 inf 0\">"),
        (elbow(&format!("<origin xyz=\"0 1e300 0\"/>{LIMIT}")), "finite and at most"),
        (elbow("<limit lower=\"2\" upper=\"1\" effort=\"1\" velocity=\"1\"/>"), "lower limit 2 is above upper limit 1"),
        (elbow("<limit lower=\"nan\" upper=\"1\" effort=\"1\" velocity=\"1\"/>"), "expected a number"),
        (elbow("<limit lower=\"0\" upper=\"1\" effort=\"1\"/>"), "<limit> needs `velocity`"),
        (elbow(&bad_mimic("j")), "mimics itself"),
        (elbow(&bad_mimic("q")), "mimics joint `q`, which does not exist"),
        (
            robot(&[link("a"), link("b"), link("c"), hinge("i", "a", "b", LIMIT), hinge("j", "b", "c", "")])
                .replace("\"j\" type=\"revolute\"", "\"j\" type=\"planar\""),
            "joint `j`: planar joints are only supported between a root without geometry and the body",
        ),
        (
            elbow(&format!("<origin xyz=\"0 ${{length}} 0\"/>{LIMIT}")),
            "expected 3 numbers, finite and at most 1000000; expand the macros first",
        ),
        (elbow("").replace("revolute", "screw"), "unknown joint type `screw`; expected revolute"),
        (elbow("").replace("<child link=\"b\"/>", ""), "needs <child link"),
        (elbow("").replace(" type=\"revolute\"", ""), "<joint> needs the attribute `type`"),
        (sphere("radius=\"-1\""), "link `a`: a solid of size -1; expected 0 to"),
        (sphere("radius=\"500\""), "a solid of size 500; expected 0 to 100 m"),
        (sphere(""), "<sphere> needs `radius`"),
        (block("<visual><geometry/></visual>"), "<visual> needs a <geometry> with one of sphere"),
        (
            block("<visual><geometry><mesh filename=\"gone.stl\"/></geometry></visual>"),
            "mesh `gone.stl`: cannot be read: no meshes here; this body has no other geometry",
        ),
        (
            block("<visual><geometry><mesh filename=\"gone.glb\"/></geometry></visual>"),
            "mesh `gone.glb`: extension `.glb` is not supported; convert it to .stl, .obj or .dae",
        ),
        (mass("-1"), "test.urdf:2: link `a`: a mass is -1 kg"),
        (mass("NaN"), "<mass value=\"NaN\">"),
        (mass("1e6"), "a mass is 1000000 kg"),
        (mass("1").replace("izz=\"1\"", "izz=\"-1e-6\""), "test.urdf:2: link `a`: a moment of inertia is negative"),
        (taper("taper:arm:a"), "taper:arm:a has no counterpart"),
        (taper("taper:arm"), "expected taper:NAME:a or taper:NAME:b"),
        ("<robot name=\"r\"><link name=\"a\">".into(), "test.urdf:1: not well-formed XML"),
        ("<urdf/>".into(), "expected <robot>"),
        (String::new(), "not well-formed XML"),
        (format!("<robot>{}{}</robot>", "<a>".repeat(100), "</a>".repeat(100)), "no <link>"),
        (block(&format!("{}{}", "<a>".repeat(100_000), "</a>".repeat(100_000))), "nested deeper"),
    ];
    for (text, expected) in cases {
        let message = parse(&text).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains(expected), "expected `{expected}`, got `{message}`");
        assert!(message.starts_with("test.urdf:"), "{message}");
    }
}

#[test]
fn byte_order_marks_trailing_nul_bytes_and_windows_line_ends_are_accepted() {
    let text = format!("\u{feff}{}\n\0\0", elbow(LIMIT)).replace('\n', "\r\n");
    assert_eq!(parse(&text).unwrap().degrees_of_freedom[0].name, "j");
}

#[test]
fn unneeded_elements_may_be_invalid() {
    let inside = format!(
        "{LIMIT}<safety_controller soft_lower_limit=\"x\"/><dynamics damping=\"${{d}}\"/><calibration rising=\"?\"/>"
    );
    let extras = "<material name=\"\"><texture/></material><gazebo><controller:plugin x=\"1\"/></gazebo>\
                  <transmission><mechanicalReduction>?</mechanicalReduction></transmission><xacro:macro name=\"m\"/>";
    let visual = "<visual><geometry><sphere radius=\"1\"/></geometry><material><texture/><color/></material></visual>";
    let text = elbow(&inside).replace("</robot>", &format!("{extras}</robot>"));
    let text =
        text.replace("<link name=\"a\"/>", &format!("<link name=\"a\">{visual}<sensor/><collision_checking/></link>"));
    let body = parse(&text).unwrap();
    assert_eq!((body.links.len(), body.links[0].solids.len(), body.degrees_of_freedom[0].upper), (2, 1, 2.0));
    // line numbers are unchanged
    let broken = text.replace("upper=\"2\"", "upper=\"-2\"");
    assert!(parse(&broken).unwrap_err().to_string().starts_with("test.urdf:4: joint `j`: lower limit -1 is above"));
}

#[test]
fn slightly_negative_inertia_is_rounded_to_none() {
    let inertia = "<inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"-5e-20\"/>";
    let body = parse(&block(&format!("<inertial><mass value=\"1\"/>{inertia}</inertial>"))).unwrap();
    assert_eq!(body.links[0].inertia.as_ref().unwrap().tensor[(2, 2)], 0.0);
}

// a shoulder turned by quat_xyzw without version="1.1" was straight, without a word
#[test]
fn a_quaternion_that_is_not_read_is_noted() {
    let turned = elbow(&format!("<origin quat_xyzw=\"0 0 1 0\"/>{LIMIT}"));
    let body = parse(&turned).unwrap();
    assert!(body.notes[0].starts_with("quat_xyzw of 1 <origin> is ignored, the first in line 4"), "{:?}", body.notes);
    let body = parse(&turned.replace("<robot", "<robot version=\"1.1\"")).unwrap();
    assert!(body.notes.is_empty() && body.joints[0].parent_from_joint.rotation.angle() > 3.1, "{:?}", body.notes);
}

#[test]
fn mimic_on_a_fixed_joint_is_ignored_with_a_note() {
    let text = elbow("<mimic joint=\"other\"/>").replace("revolute", "fixed");
    let body = parse(&text).unwrap();
    assert_eq!(body.joints[0].kind, JointKind::Fixed);
    assert!(body.notes[0].contains("joint `j`: fixed, so <mimic joint=\"other\"> is ignored"), "{:?}", body.notes);
}

#[test]
fn an_empty_root_on_which_the_body_floats_is_left_out_with_a_note() {
    let parts = [link("world"), link("a"), link("b"), hinge("free", "world", "a", ""), hinge("j", "a", "b", LIMIT)];
    for kind in ["floating", "planar"] {
        let text = robot(&parts).replace("\"free\" type=\"revolute\"", &format!("\"free\" type=\"{kind}\""));
        let body = parse(&text).unwrap();
        assert_eq!((body.links.len(), body.links[0].name.as_str(), body.degrees_of_freedom.len()), (2, "a", 1));
        assert!(body.notes[0].contains("link `world` and joint `free` are left out"), "{:?}", body.notes);
    }
}

#[test]
fn missing_meshes_are_left_out_with_a_note_and_replaced_by_collision_solids() {
    let visual = |shape: &str| format!("<visual><geometry>{shape}</geometry></visual>");
    let gone = visual("<mesh filename=\"package://r/gone.dae\"/>");
    let other = visual("<mesh filename=\"other.ply\"/>");
    let ball = "<collision><geometry><sphere radius=\"0.5\"/></geometry></collision>";
    let text = robot(&[
        format!("<link name=\"a\">{gone}{gone}{ball}</link>"),
        format!("<link name=\"b\">{other}{}</link>", visual("<sphere radius=\"1\"/>")),
        format!("<link name=\"c\">{other}</link>"),
        hinge("j", "a", "b", LIMIT),
        hinge("k", "b", "c", LIMIT),
    ]);
    let body = parse(&text).unwrap();
    let solids: Vec<usize> = body.links.iter().map(|link| link.solids.len()).collect();
    assert_eq!(solids, [1, 1, 0]);
    let note = "2 of the meshes cannot be read and are left out: package://r/gone.dae, other.ply; the body lacks";
    assert!(body.notes.iter().any(|n| n.starts_with(note)), "{:?}", body.notes);
}

#[test]
fn axes_are_normalised_and_limits_kept() {
    let body = parse(&elbow(&format!("<axis xyz=\"0 3 4\"/>{LIMIT}"))).unwrap();
    let JointKind::Revolute { axis, .. } = &body.joints[0].kind else { panic!("a revolute joint") };
    assert!((axis.into_inner() - Vector3::new(0.0, 0.6, 0.8)).norm() < 1e-15);
    let freedom = &body.degrees_of_freedom[0];
    assert_eq!((freedom.lower, freedom.upper, freedom.max_velocity, freedom.max_effort), (-1.0, 2.0, 4.0, 3.0));
    assert!(body.notes.is_empty());
}

#[test]
fn assumptions_about_limits_are_noted() {
    let unlimited = parse(&elbow("")).unwrap();
    assert_eq!(unlimited.degrees_of_freedom[0].upper, f64::INFINITY);
    assert!(unlimited.notes[0].contains("no <limit>, assumed unlimited"));
    let locked = parse(&elbow("<limit lower=\"0.5\" upper=\"0.5\" effort=\"0\" velocity=\"0\"/>")).unwrap();
    assert!(locked.notes[0].contains("locked"), "{:?}", locked.notes);
    assert_eq!(locked.degrees_of_freedom[0].max_velocity, f64::INFINITY);
    // From version 1.2 on, missing limits mean unlimited.
    let newer = elbow("<limit effort=\"1\"/>").replace("<robot", "<robot version=\"1.2\"");
    assert_eq!(parse(&newer).unwrap().degrees_of_freedom[0].lower, f64::NEG_INFINITY);
}

#[test]
fn a_chain_of_mimics_is_resolved_to_its_end() {
    let text = robot(&[
        ["a", "b", "c", "d"].map(link).concat(),
        hinge("last", "c", "d", &format!("{LIMIT}<mimic joint=\"middle\" multiplier=\"3\" offset=\"0.5\"/>")),
        hinge("middle", "b", "c", &format!("{LIMIT}<mimic joint=\"first\" multiplier=\"-2\" offset=\"0.25\"/>")),
        hinge("first", "a", "b", LIMIT),
    ]);
    let body = parse(&text).unwrap();
    assert_eq!(body.degrees_of_freedom.len(), 1);
    let drives: Vec<(f64, f64)> = body
        .joints
        .iter()
        .map(|joint| match joint.kind {
            JointKind::Revolute { drive, .. } => (drive.multiplier, drive.offset),
            _ => panic!("hinges only"),
        })
        .collect();
    assert_eq!(drives, [(1.0, 0.0), (-2.0, 0.25), (-6.0, 1.25)]);
}

#[test]
fn tapers_capsules_and_scaled_meshes_become_solids() {
    let visual = |attributes: &str, origin: &str, shape: &str| {
        format!("<visual {attributes}><origin {origin}/><geometry>{shape}</geometry></visual>")
    };
    let text = block(
        &[
            visual("name=\"taper:x:b\"", "xyz=\"0 0 1\"", "<sphere radius=\"0.2\"/>"),
            visual("", "xyz=\"1 0 0\" rpy=\"0 1.5707963267948966 0\"", "<capsule radius=\"0.1\" length=\"2\"/>"),
            visual("name=\"taper:x:a\"", "xyz=\"0 0 0\"", "<sphere radius=\"0.1\"/>"),
            visual("", "xyz=\"0 0 5\"", "<mesh filename=\"t.obj\" scale=\"2 3 4\"/>"),
        ]
        .concat(),
    );
    let meshes = |uri: &str| {
        assert_eq!(uri, "t.obj");
        Ok(b"v 1 1 1\nv 0 1 0\nv 0 0 1\nf 1 2 3".to_vec())
    };
    let body = Humanoid::from_urdf(&text, "f", &meshes).unwrap();
    let [Solid::TaperedCapsule(capsule), Solid::TaperedCapsule(taper), Solid::Mesh { vertices, triangles }] =
        body.links[0].solids.as_slice()
    else {
        panic!("{:?}", body.links[0].solids)
    };
    assert!((capsule.b - Point3::new(2.0, 0.0, 0.0)).norm() < 1e-12, "{capsule:?}");
    assert_eq!((taper.a.z, taper.radius_a, taper.b.z, taper.radius_b), (0.0, 0.1, 1.0, 0.2));
    assert_eq!((vertices[0], triangles.len()), (Point3::new(2.0, 3.0, 9.0), 1));
}

/// Regression test: the triangles of a mirrored mesh kept their order, so that `actor.json` had it inside out.
#[test]
fn a_mesh_with_negative_scale_is_not_inside_out() {
    for (scale, corners) in
        [("1 1 1", [0, 1, 2]), ("1 -1 1", [0, 2, 1]), ("-1 -1 1", [0, 1, 2]), ("-2 -1 -1", [0, 2, 1])]
    {
        let text =
            block(&format!("<visual><geometry><mesh filename=\"t.obj\" scale=\"{scale}\"/></geometry></visual>"));
        let body = Humanoid::from_urdf(&text, "f", &|_| Ok(b"v 1 1 1\nv 0 1 0\nv 0 0 1\nf 1 2 3".to_vec())).unwrap();
        let [Solid::Mesh { triangles, .. }] = body.links[0].solids.as_slice() else { panic!() };
        assert_eq!(triangles[0], corners, "{scale}");
    }
}

#[test]
fn a_marker_with_mass_or_on_a_moving_joint_is_refused() {
    let text = robot(&[link("a"), link("marker_pelvis"), hinge("j", "a", "marker_pelvis", LIMIT)]);
    assert!(parse(&text).unwrap_err().to_string().contains("a marker must be a link without mass"));
}

#[test]
fn robots_of_other_projects_load_with_their_meshes_and_recognised_markers() {
    let robots = [
        ("pybullet_humanoid/humanoid.urdf", 16, 28, 15),
        ("gepetto_human/human_description/robots/human.urdf", 37, 36, 15),
        ("gepetto_simple_humanoid/simple_humanoid_description/urdf/simple_humanoid.urdf", 31, 29, 15),
        ("human_gazebo/humanSubject01_48dof.urdf", 51, 48, 15),
        ("human_gazebo/humanSubject01_66dof.urdf", 69, 66, 15),
    ];
    for (file, links, freedoms, markers) in robots {
        let Some(path) = test_data::path(&format!("robots/{file}")) else { return };
        let body = Humanoid::load(&path).unwrap();
        let solid = body.links.iter().map(|l| l.solids.len()).sum::<usize>();
        assert_eq!((body.links.len(), body.degrees_of_freedom.len()), (links, freedoms), "{file}");
        assert_eq!(body.markers.iter().flatten().count(), markers, "{file}");
        assert!(solid > 0, "{file}");
        let placed = body.markers(&body.link_frames(&body.zero_pose()));
        if let [Some(hip), Some(knee)] = [Landmark::LeftHip, Landmark::LeftKnee].map(|l| placed[l as usize]) {
            let length = (hip - knee).norm();
            assert!((0.3..2.0).contains(&length), "{file}: thigh of {length}");
        }
    }
}

#[test]
fn a_missing_file_and_a_file_that_is_not_text_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.urdf");
    assert!(matches!(Humanoid::load(&path), Err(UrdfError::Unreadable { .. })));
    std::fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
    assert!(Humanoid::load(&path).unwrap_err().to_string().contains("not UTF-8"));
    std::fs::write(&path, "").unwrap();
    assert!(Humanoid::load(&path).unwrap_err().to_string().contains("not well-formed XML"));
}
