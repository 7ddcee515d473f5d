//! Tests the simulation against closed forms, and the refusal of invalid input.

use approx::assert_relative_eq;
use nalgebra::{DVector, Isometry3, Matrix3, Point3, Unit, Vector3};

use super::simulated_body::SimulatedBody;
use super::*;
use crate::test_bodies::standing;
use skiagraph_core::body::{DegreeOfFreedom, Drive, Humanoid, Inertia, Joint, JointKind, Link, Motion, Pose, Solid};
use skiagraph_core::dynamics::GRAVITY;
use skiagraph_core::raster::TaperedCapsule;

const RATE: f64 = 480.0;

fn link(name: &str, mass: f64, centre: [f64; 3], moment: f64) -> Link {
    let centre_of_mass = Point3::from(centre);
    let inertia = Inertia { mass, centre_of_mass, tensor: Matrix3::from_diagonal_element(moment) };
    Link { name: name.into(), solids: Vec::new(), inertia: Some(inertia) }
}

fn hinge(parent: usize, name: &str, dof: usize) -> Joint {
    Joint {
        name: name.into(),
        parent,
        parent_from_joint: Isometry3::identity(),
        kind: JointKind::Revolute { axis: Vector3::y_axis(), drive: Drive::direct(dof) },
    }
}

fn body(links: Vec<Link>, joints: Vec<Joint>) -> Humanoid {
    Humanoid {
        name: "test".into(),
        degrees_of_freedom: joints.iter().map(|joint| DegreeOfFreedom::unlimited(&joint.name)).collect(),
        links,
        joints,
        markers: [None; 15],
        skin: None,
        notes: Vec::new(),
    }
}

/// A box of 20 kg, 0.4 m wide and 0.2 m high.
fn crate_of_20_kg() -> Humanoid {
    let mut link = link("box", 20.0, [0.0; 3], 0.4);
    link.solids.push(Solid::Box { link_from_box: Isometry3::identity(), half_extents: [0.2, 0.2, 0.1] });
    body(vec![link], Vec::new())
}

fn resting(z: f64) -> Pose {
    Pose { world_from_root: Isometry3::translation(0.0, 0.0, z), joint_angles: DVector::zeros(0) }
}

#[test]
fn the_ground_force_on_a_standing_body_is_its_weight() {
    let mut simulated = SimulatedBody::new(&crate_of_20_kg(), 0.8, RATE, false).unwrap();
    simulated.place(&resting(0.1), &[0.0; 6]);
    (0..480).for_each(|_| simulated.step());
    assert_relative_eq!(simulated.ground_normal_force(), 20.0 * GRAVITY, max_relative = 1e-3);
    let pose = simulated.pose().world_from_root;
    assert!((pose.translation.z - 0.1).abs() < 2e-3 && pose.rotation.angle() < 1e-3, "{pose:?}");
}

#[test]
fn a_sliding_box_decelerates_by_friction_times_gravity_and_stops_as_predicted() {
    let (friction, speed) = (0.3, 2.0);
    let mut simulated = SimulatedBody::new(&crate_of_20_kg(), friction, RATE, false).unwrap();
    simulated.place(&resting(0.1), &[speed, 0.0, 0.0, 0.0, 0.0, 0.0]);
    (0..96).for_each(|_| simulated.step());
    let brakes = (speed - simulated.root_velocity()[0].x) / 0.2;
    assert_relative_eq!(brakes, friction * GRAVITY, max_relative = 0.02);
    (0..480).for_each(|_| simulated.step());
    let stops_after = speed * speed / (2.0 * friction * GRAVITY);
    assert_relative_eq!(simulated.pose().world_from_root.translation.x, stops_after, max_relative = 0.02);
    assert!(simulated.root_velocity()[0].norm() < 1e-3);
}

/// Hangs 0.5 m below a hinge in the fixed root, through a massless link.
fn pendulum() -> Humanoid {
    let root = link("root", 1.0, [0.0; 3], 0.1);
    let massless = Link { name: "massless".into(), solids: Vec::new(), inertia: None };
    let bob = link("bob", 2.0, [0.0, 0.0, -0.5], 0.02);
    let mut pendulum = body(vec![root, massless, bob], vec![hinge(0, "swing", 0), hinge(1, "other", 1)]);
    // the second hinge rotates about x and stays at rest
    pendulum.joints[1].kind = JointKind::Revolute { axis: Vector3::x_axis(), drive: Drive::direct(1) };
    pendulum
}

/// Angle and speed of the pendulum after every step.
fn swing(from: f64, seconds: f64) -> Vec<[f64; 2]> {
    let mut simulated = SimulatedBody::new(&pendulum(), 0.8, RATE, true).unwrap();
    let pose = Pose {
        world_from_root: Isometry3::translation(0.0, 0.0, 3.0),
        joint_angles: DVector::from_vec(vec![from, 0.0]),
    };
    simulated.place(&pose, &[0.0; 8]);
    let mut step = |_| {
        simulated.step();
        assert!(simulated.pose().joint_angles[1].abs() < 1e-4);
        [simulated.pose().joint_angles[0], simulated.joint_speeds()[0]]
    };
    (0..(seconds * RATE) as usize).map(&mut step).collect()
}

#[test]
fn a_pendulum_behind_a_massless_link_swings_with_its_period() {
    let inertia = 2.0 * 0.25 + 0.02;
    let period = std::f64::consts::TAU * (inertia / (2.0 * GRAVITY * 0.5)).sqrt();
    let angles = swing(0.05, 6.0);
    let crossings: Vec<usize> = (1..angles.len()).filter(|&i| angles[i - 1][0] > 0.0 && angles[i][0] <= 0.0).collect();
    let (first, last) = (crossings[0], crossings[crossings.len() - 1]);
    let found = (last - first) as f64 / RATE / (crossings.len() - 1) as f64;
    // an amplitude of 0.05 rad lengthens the period by 0.016 %
    assert_relative_eq!(found, period, max_relative = 0.003);
}

#[test]
fn a_pendulum_without_damping_keeps_its_energy() {
    let energy = |[angle, speed]: [f64; 2]| 0.5 * 0.52 * speed * speed + 2.0 * GRAVITY * 0.5 * (1.0 - angle.cos());
    let start = energy([1.2, 0.0]);
    for state in swing(1.2, 4.0) {
        assert_relative_eq!(energy(state), start, max_relative = 0.02, epsilon = 0.0);
    }
}

#[test]
fn a_spring_holds_where_its_torque_balances_gravity() {
    let mut simulated = SimulatedBody::new(&pendulum(), 0.8, RATE, true).unwrap();
    simulated.place(&Pose { world_from_root: Isometry3::identity(), joint_angles: DVector::zeros(2) }, &[0.0; 8]);
    let (stiffness, rest) = (100.0, 0.5);
    simulated.set_spring(0, stiffness, 20.0, rest);
    (0..2400).for_each(|_| simulated.step());
    let angle = simulated.pose().joint_angles[0];
    assert_relative_eq!(stiffness * (rest - angle), 2.0 * GRAVITY * 0.5 * angle.sin(), max_relative = 1e-3);
}

#[test]
fn a_standing_person_is_simulated_identically_on_any_number_of_threads() {
    let (body, motion) = standing(20);
    let settings = SimulationSettings { root_wrench: 0.1, ..SimulationSettings::default() };
    let with_threads = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| simulate(&body, &motion, &settings).unwrap())
    };
    let found = with_threads(1);
    assert_eq!(found, with_threads(3));
    assert_eq!(found.report.fell_at_s, None);
    assert!(found.report.moved_mm < 10.0 && found.report.root_wrench_most <= 0.1 + 1e-9, "{}", found.report);
}

#[test]
fn a_push_topples_the_person_and_the_time_is_reported() {
    let (body, motion) = standing(75);
    let thorax = body.find_link("thorax").unwrap();
    let push = Push { at_s: 0.1, link: thorax, impulse_ns: 250.0, direction: Vector3::x_axis() };
    let settings = SimulationSettings { pushes: vec![push], ..SimulationSettings::default() };
    let found = simulate(&body, &motion, &settings).unwrap();
    let fell = found.report.fell_at_s.expect("250 N s is 3.4 m/s for the whole body");
    assert!(fell > 0.3 && found.report.to_string().contains("FELL after"), "{}", found.report);
    let ahead = found.motion.poses[74].world_from_root.translation.x - motion.poses[74].world_from_root.translation.x;
    assert!(ahead > 0.3, "{ahead} m ahead");
}

#[test]
fn a_shove_is_balanced_without_help() {
    let (body, motion) = standing(90);
    let thorax = body.find_link("thorax").unwrap();
    let shoved = |impulse_ns: f64| {
        let push = Push { at_s: 0.1, link: thorax, impulse_ns, direction: Vector3::x_axis() };
        simulate(&body, &motion, &SimulationSettings { pushes: vec![push], ..SimulationSettings::default() }).unwrap()
    };
    let (found, left_alone) = (shoved(15.0), shoved(0.0));
    assert_eq!(found.report.fell_at_s, None, "{}", found.report);
    let centre =
        |motion: &Motion, frame: usize| body.centre_of_mass(&body.link_frames(&motion.poses[frame])).unwrap().x;
    let ahead: Vec<f64> =
        (0..90).map(|frame| centre(&found.motion, frame) - centre(&left_alone.motion, frame)).collect();
    let furthest = ahead.iter().copied().fold(0.0, f64::max);
    // critically damped: the greatest displacement is the speed divided by e times the frequency of the return
    let expected = 15.0 / body.total_mass() / (std::f64::consts::E * 6.0);
    assert!(furthest > 0.3 * expected && furthest < 3.0 * expected, "displacement {furthest} m, expected {expected}");
    assert!(ahead[89].abs() < 0.5 * furthest, "not returned: {} m", ahead[89]);
}

/// Two rods hanging side by side from a fixed root, each on a hinge.
fn clappers(solid: bool) -> Humanoid {
    let mut links = vec![link("root", 1.0, [0.0; 3], 0.1)];
    let mut joints = Vec::new();
    for (index, x) in [-0.15, 0.15].into_iter().enumerate() {
        let mut rod = link("rod", 1.0, [0.0, 0.0, -0.2], 0.02);
        if solid {
            let [a, b] = [-0.1, -0.4].map(|z| Point3::new(0.0, 0.0, z));
            rod.solids.push(Solid::TaperedCapsule(TaperedCapsule { a, b, radius_a: 0.04, radius_b: 0.04 }));
        }
        links.push(rod);
        let mut joint = hinge(0, "swing", index);
        joint.parent_from_joint = Isometry3::translation(x, 0.0, 0.0);
        joints.push(joint);
    }
    body(links, joints)
}

#[test]
fn limbs_do_not_pass_through_each_other() {
    let gaps = |solid: bool| -> Vec<f64> {
        let body = clappers(solid);
        let mut simulated = SimulatedBody::new(&body, 0.8, RATE, true).unwrap();
        let pose = Pose { world_from_root: Isometry3::translation(0.0, 0.0, 3.0), joint_angles: DVector::zeros(2) };
        simulated.place(&pose, &[0.0; 8]);
        // hinges about y: a negative angle swings a hanging rod forwards
        [(0, -0.8), (1, 0.8)].into_iter().for_each(|(dof, to)| simulated.set_spring(dof, 5.0, 0.5, to));
        let mut gap = |_| {
            simulated.step();
            let frames = body.link_frames(&simulated.pose());
            let tips = [1, 2].map(|link| frames[link] * Point3::new(0.0, 0.0, -0.4));
            tips[1].x - tips[0].x
        };
        (0..960).map(&mut gap).collect()
    };
    let crossed = gaps(false);
    assert!(crossed[959] < -0.1, "without solids they cross: {} m", crossed[959]);
    // two radii, minus the distance of the one step in which they meet
    let solid = gaps(true);
    let step = solid.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f64::max);
    let nearest = solid.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(nearest > 0.08 - step - 1e-3 && step < 0.02, "{nearest} m at {step} m a step");
    assert!((solid[959] - 0.08).abs() < 3e-3, "they rest against each other: {} m", solid[959]);
}

#[test]
fn invalid_input_is_refused_by_name() {
    let (body, motion) = standing(3);
    let refused = |body: &Humanoid, motion: &Motion, settings: &SimulationSettings| {
        simulate(body, motion, settings).unwrap_err().to_string()
    };
    let plain = SimulationSettings::default();
    let mut weightless = body.clone();
    weightless.links.iter_mut().for_each(|link| link.inertia = None);
    assert!(refused(&weightless, &motion, &plain).contains("none of them has mass"));
    let mut hand = body.clone();
    let last = hand.find_link("left_hand").unwrap();
    hand.links[last].inertia = None;
    let message = refused(&hand, &motion, &plain);
    assert!(message.contains("left_wrist_flexion") && message.contains("mass"), "{message}");
    let mut negative = body.clone();
    negative.links[0].inertia.as_mut().unwrap().mass = -1.0;
    assert!(refused(&negative, &motion, &plain).contains("impossible mass properties"));
    let mut buried = motion.clone();
    buried.poses[0].world_from_root.translation.z -= 0.5;
    assert!(refused(&body, &buried, &plain).contains("under the ground (z = 0)"));
    let nobody = Push { at_s: 0.0, link: 999, impulse_ns: 1.0, direction: Unit::new_normalize(Vector3::x()) };
    let pushed = |push| SimulationSettings { pushes: vec![push], ..plain.clone() };
    assert!(refused(&body, &motion, &pushed(nobody)).contains("has no link with index 999"));
    let comet = Push { link: 0, impulse_ns: 1e9, ..nobody };
    let message = refused(&body, &motion, &pushed(comet));
    assert!(message.starts_with("frame 1 (from 0): the simulation diverged at link"), "{message}");
}

#[test]
fn links_with_zero_inertia_about_an_axis_are_simulated_with_a_small_one() {
    let (body, motion) = standing(12);
    let settings = SimulationSettings { root_wrench: 0.2, ..SimulationSettings::default() };
    for least in [0.0, 1e-20] {
        for link in 0..body.links.len() {
            let mut thin = body.clone();
            let Some(inertia) = thin.links[link].inertia.as_mut() else { continue };
            inertia.tensor.m33 = least;
            let simulated = simulate(&thin, &motion, &settings);
            assert!(simulated.is_ok(), "{}: {simulated:?}", thin.links[link].name);
        }
    }
    let mut points = body.clone();
    points.links.iter_mut().filter_map(|link| link.inertia.as_mut()).for_each(|i| i.tensor = Matrix3::zeros());
    if let Err(error) = simulate(&points, &motion, &settings) {
        assert!(error.to_string().contains("diverged"), "{error}");
    }
}

#[test]
fn a_box_dropped_on_a_prop_rests_on_it_and_a_sliding_box_stops_at_it() {
    let solid = Solid::Box { link_from_box: Isometry3::translation(0.0, 0.0, 0.25), half_extents: [0.5, 0.5, 0.25] };
    let stand = [skiagraph_core::body::Prop { name: "stand".into(), solid }];
    let mut simulated = SimulatedBody::new(&crate_of_20_kg(), 0.8, RATE, false).unwrap();
    simulated.insert_props(&stand, 0.8);
    simulated.place(&resting(0.7), &[0.0; 6]);
    (0..480).for_each(|_| simulated.step());
    assert!((simulated.pose().world_from_root.translation.z - 0.6).abs() < 3e-3, "0.5 m high, half of it 0.1 m");
    let mut sliding = resting(0.1);
    sliding.world_from_root.translation.x = -1.2;
    simulated.place(&sliding, &[3.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    (0..480).for_each(|_| simulated.step());
    let stopped = simulated.pose().world_from_root.translation.x;
    assert!(stopped < -0.7 + 5e-3, "its face would be in the stand beyond -0.7 m: {stopped}");
}
