use super::*;
use crate::body::{BodyShape, DrawnShares, Inertia, LANDMARKS, Link, LinkShape, SHIPPED_ROBOTS, shipped};

fn capsules(body: &Humanoid, link: &str) -> Vec<TaperedCapsule> {
    let of_solid = |solid: &Solid| match solid {
        Solid::TaperedCapsule(capsule) => *capsule,
        other => panic!("{other:?}"),
    };
    body.links[body.find_link(link).unwrap()].solids.iter().map(of_solid).collect()
}

#[test]
fn every_link_of_built_in_robots_gets_capsules_and_nothing_else_changes() {
    for (name, _) in SHIPPED_ROBOTS {
        let own = shipped(name).unwrap();
        let drawn = own.with_solids_from_joints();
        let shares = DrawnShares::new(&drawn);
        assert!(shares.missing.is_empty(), "{name}: {shares:?}");
        assert_eq!([shares.height, shares.reach], [Some(1.0); 2], "{name}");
        let bare = |body: &Humanoid| {
            let links = body.links.iter().map(|link| Link { solids: Vec::new(), ..link.clone() }).collect();
            Humanoid { links, ..body.clone() }
        };
        assert_eq!(bare(&own), bare(&drawn), "{name}");
        drawn.check_bounds().unwrap();
    }
}

#[test]
fn a_limb_extends_from_its_joint_to_the_next_with_a_persons_thickness() {
    let body = shipped("actor").unwrap().with_solids_from_joints();
    let [thigh] = capsules(&body, "left_thigh")[..] else { panic!("one capsule") };
    let knee = body.joints[body.find_link("left_shank").unwrap() - 1].parent_from_joint.translation.vector;
    assert!(thigh.a.coords.norm() < 1e-12 && (thigh.b.coords - knee).norm() < 1e-9, "{thigh:?}");
    assert!((thigh.radius_a - 0.080).abs() < 1e-3 && (thigh.radius_b - 0.056).abs() < 1e-3, "{thigh:?}");
    // pelvis to both hips and to the spine
    assert_eq!(capsules(&body, "pelvis").len(), 3);
}

/// The outline is that of a person: crown, soles, hands and toes are where those of the actor are.
#[test]
fn the_body_from_joints_is_as_large_as_the_modelled_one() {
    let own = shipped("actor").unwrap();
    let drawn = own.with_solids_from_joints();
    let along = |body: &Humanoid, turn: nalgebra::UnitQuaternion<f64>| {
        let mut pose = body.standing_pose();
        pose.world_from_root.rotation = turn * pose.world_from_root.rotation;
        let links: Vec<usize> = (0..body.links.len()).collect();
        body.lowest_point(&body.link_frames(&pose), &links).unwrap().z
    };
    use std::f64::consts::{FRAC_PI_2, PI};
    for (direction, axis, angle, most) in [
        ("soles", nalgebra::Vector3::x(), 0.0, 0.005),
        ("crown", nalgebra::Vector3::x(), PI, 0.03),
        ("left", nalgebra::Vector3::x(), -FRAC_PI_2, 0.04),
        ("right", nalgebra::Vector3::x(), FRAC_PI_2, 0.04),
        ("ahead", nalgebra::Vector3::y(), FRAC_PI_2, 0.04),
        ("behind", nalgebra::Vector3::y(), -FRAC_PI_2, 0.04),
    ] {
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle);
        let (a, b) = (along(&own, turn), along(&drawn, turn));
        assert!((a - b).abs() < most, "{direction}: {a:.3} and {b:.3} m");
    }
}

#[test]
fn left_and_right_are_mirrored() {
    for (name, _) in SHIPPED_ROBOTS {
        let body = shipped(name).unwrap().with_solids_from_joints();
        for link in body.links.iter().filter(|link| link.name.starts_with("left_")) {
            let (left, right) = (capsules(&body, &link.name), capsules(&body, &link.name.replacen("left", "right", 1)));
            for (l, r) in left.iter().zip(&right) {
                let mirrored = |p: &Point3<f64>| Point3::new(p.x, -p.y, p.z);
                assert!((l.a - mirrored(&r.a)).norm() < 1e-6 && (l.b - mirrored(&r.b)).norm() < 1e-6, "{}", link.name);
                assert!((l.radius_a - r.radius_a).abs() < 1e-6, "{}", link.name);
            }
            assert_eq!(left.len(), right.len());
        }
    }
}

/// Radii of a robot in other units are those of the scaled body: girths grow with the square root of the stature.
#[test]
fn a_robot_of_four_times_the_size_matches_a_person_after_scaling() {
    let own = shipped("actor").unwrap();
    let scaled = |body: &Humanoid, length: f64, girth: f64| {
        let shape = LinkShape { length: Vector3::repeat(length), girth };
        body.reshaped(&BodyShape { links: vec![shape; body.links.len()] })
    };
    let back = scaled(&scaled(&own, 4.0, 2.0).with_solids_from_joints(), 0.25, 0.5);
    let at_once = own.with_solids_from_joints();
    for link in ["left_thigh", "right_forearm", "head", "abdomen"] {
        for (a, b) in capsules(&back, link).iter().zip(capsules(&at_once, link)) {
            assert!((a.radius_a - b.radius_a).abs() < 1e-6 && (a.a - b.a).norm() < 0.05, "{link}: {a:?} {b:?}");
        }
    }
}

#[test]
fn sensors_get_no_capsules_and_heavy_end_links_extend_to_twice_the_distance_of_their_centre_of_mass() {
    let mut body = shipped("actor").unwrap();
    let hang = |body: &mut Humanoid, name: &str, on: usize, mass: Option<f64>| {
        let mut joint = body.joints[0].clone();
        (joint.name, joint.parent, joint.kind) = (format!("{name}_joint"), on, crate::body::JointKind::Fixed);
        joint.parent_from_joint = nalgebra::Isometry3::translation(-0.15, 0.0, 0.1);
        let centre_of_mass = Point3::new(-0.05, 0.0, 0.0);
        let tensor = nalgebra::Matrix3::identity() * 1e-3;
        let inertia = mass.map(|mass| Inertia { mass, centre_of_mass, tensor });
        body.joints.push(joint);
        body.links.push(Link { name: name.to_owned(), solids: Vec::new(), inertia });
    };
    let thorax = body.find_link("thorax").unwrap();
    hang(&mut body, "backpack", thorax, Some(5.0));
    hang(&mut body, "imu", thorax, Some(0.02));
    hang(&mut body, "camera_frame", thorax, None);
    let drawn = body.with_solids_from_joints();
    assert!(capsules(&drawn, "imu").is_empty() && capsules(&drawn, "camera_frame").is_empty());
    let [pack] = capsules(&drawn, "backpack")[..] else { panic!("one capsule") };
    assert!((pack.b.x - pack.radius_b + 0.1).abs() < 1e-9 && pack.b.y.abs() < 1e-9, "{pack:?}");
    let before = capsules(&shipped("actor").unwrap().with_solids_from_joints(), "thorax").len();
    assert_eq!(capsules(&drawn, "thorax").len(), before + 1, "a bone to the backpack, none to the sensors");
}

#[test]
fn a_one_piece_trunk_extends_to_the_neck_and_a_forearm_without_a_wrist_gets_a_hand() {
    let body = shipped("tracker25").unwrap().with_solids_from_joints();
    let forearm = capsules(&body, "left_forearm");
    assert_eq!(forearm.len(), 2, "forearm and hand: {forearm:?}");
    let shank = capsules(&body, "left_shank");
    assert_eq!(shank.len(), 3, "shank, sole and instep");
    assert!(LANDMARKS.len() == 15 && capsules(&body, "head").len() == 1);
    let highest = capsules(&body, "pelvis").iter().map(|c| c.b.z).fold(0.0, f64::max);
    assert!(highest > 0.5, "the trunk reaches the neck: {highest}");
}

#[test]
fn a_skeleton_from_a_file_needs_no_meshes() {
    let (_, text) = SHIPPED_ROBOTS[0];
    // a mesh for every sphere
    let mut parts = text.split("<sphere");
    let first = parts.next().unwrap().to_owned();
    let mesh = "<mesh filename=\"gone.stl\"/>";
    let text = parts.fold(first, |text, part| text + mesh + part.split_once("/>").unwrap().1);
    let body = Humanoid::from_urdf_skeleton(&text, "a.urdf").unwrap();
    let own = shipped("tracker25").unwrap().with_solids_from_joints();
    assert_eq!(body.links, own.links);
    assert!(body.notes.iter().any(|note| note.contains("capsules from joint to joint")), "{:?}", body.notes);
}
