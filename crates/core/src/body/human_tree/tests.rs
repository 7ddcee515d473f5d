use nalgebra::{Point3, Vector3};

use super::*;

/// Where a point of a walking person of 1.75 m is, facing X; the first letter of a point in a limb is its side.
fn place(point: &str, phase: f64) -> Point3<f64> {
    let (sign, swing) = if point.starts_with('r') { (-1.0, -libm::sin(phase)) } else { (1.0, libm::sin(phase)) };
    let down = |angle: f64, length: f64| Vector3::new(libm::sin(angle), 0.0, -libm::cos(angle)) * length;
    let hip = Point3::new(0.0, 0.09 * sign, 0.92);
    let (thigh, shank, foot) = (0.5 * swing, 0.5 * swing - 0.5 - 0.4 * swing, 0.2 * swing);
    let knee = hip + down(thigh, 0.42);
    let ankle = knee + down(shank, 0.42);
    let toes = ankle + Vector3::new(0.14 * libm::cos(foot), 0.0, -0.06 + 0.14 * libm::sin(foot));
    let shoulder = Point3::new(0.0, 0.18 * sign, 1.43);
    let elbow = shoulder + down(-0.4 * swing, 0.29);
    let wrist = elbow + down(-0.4 * swing + 0.6 + 0.3 * swing, 0.26);
    let fingers = wrist + down(0.3 + 0.3 * swing, 0.17);
    let middle = |x: f64, z: f64| Point3::new(x, 0.0, z);
    match point.trim_start_matches(['l', 'r']) {
        "hip" => hip,
        "thigh_twist" => nalgebra::center(&hip, &knee),
        "knee" => knee,
        "ankle" => ankle,
        "toes" => toes,
        "heel" => ankle + Vector3::new(-0.05, 0.0, -0.06),
        "tip" => toes + Vector3::new(0.07, 0.0, 0.0),
        "filler" => middle(0.0, 0.92),
        "clavicle" => Point3::new(0.0, 0.03 * sign, 1.43),
        "shoulder" => shoulder,
        "elbow" => elbow,
        "forearm_twist" => nalgebra::center(&elbow, &wrist),
        "wrist" => wrist,
        "fingers" => fingers,
        "knuckle" => wrist + (fingers - wrist) * 0.5 + Vector3::new(0.0, 0.02, 0.0),
        "thumb" => wrist + (fingers - wrist) * 0.4 + Vector3::new(0.03, 0.0, 0.0),
        "eye" => Point3::new(0.08, 0.03 * sign, 1.645),
        "brow" => Point3::new(0.06, 0.02 * sign, 1.72),
        "pelvis" => middle(0.0, 0.94),
        "spine" => middle(0.0, 1.02),
        "spine2" => middle(0.0, 1.10),
        "chest" => middle(0.0, 1.18),
        "chest2" => middle(0.0, 1.27),
        "neck" => middle(0.0, 1.47),
        "head" => middle(0.0, 1.57),
        "jaw" => middle(0.03, 1.585),
        "crown" => middle(0.0, 1.75),
        _ => Point3::origin(),
    }
}

/// The points of a limb: those of bit 31 always, others by habit.
fn limb(side: &str, points: [(&str, u32); 5], has: &dyn Fn(u32) -> bool) -> Vec<String> {
    let present = points.into_iter().filter(|(_, bit)| *bit == 31 || has(*bit));
    present.map(|(point, _)| format!("{side}{point}")).collect()
}

/// Joints with their parents, as points of [`place`].
#[derive(Default)]
struct Skeleton {
    points: Vec<String>,
    parents: Vec<Option<usize>>,
}

impl Skeleton {
    fn add(&mut self, point: &str, parent: Option<usize>) -> usize {
        self.points.push(point.to_owned());
        self.parents.push(parent);
        self.points.len() - 1
    }

    fn at(&self, point: &str) -> usize {
        self.points.iter().position(|own| own == point).unwrap()
    }

    fn chain(&mut self, points: &[String], parent: usize) -> usize {
        points.iter().fold(parent, |parent, point| self.add(point, Some(parent)))
    }

    /// What programs do differently, one bit each.
    fn of(habits: u32) -> Self {
        let has = |bit: u32| habits >> bit & 1 == 1;
        let mut skeleton = Self::default();
        let mut root = skeleton.add("pelvis", None);
        if has(0) {
            skeleton.points[0] = "origin".to_owned();
            // bones for inverse kinematics, which follow hands and feet
            for point in ["lankle", "rankle", "lwrist", "rwrist"] {
                skeleton.add(point, Some(0));
            }
            root = skeleton.add("pelvis", Some(0));
        }
        let sides = if has(1) { ["r", "l"] } else { ["l", "r"] };
        let trunk_first = has(2);
        for part in if trunk_first { [0, 1] } else { [1, 0] } {
            if part == 0 {
                skeleton.upper_body(root, sides, &has);
                continue;
            }
            for side in sides {
                let leg = [("filler", 3), ("hip", 31), ("thigh_twist", 4), ("knee", 31), ("ankle", 31)];
                let ankle = skeleton.chain(&limb(side, leg, &has), root);
                if has(5) {
                    skeleton.add(&format!("{side}heel"), Some(ankle));
                }
                if !has(6) {
                    skeleton.chain(&[format!("{side}toes"), format!("{side}tip")], ankle);
                }
            }
        }
        skeleton
    }

    fn upper_body(&mut self, root: usize, sides: [&str; 2], has: &dyn Fn(u32) -> bool) {
        let spine: &[&str] = if has(7) { &["spine", "spine2", "chest", "chest2"] } else { &["spine", "chest"] };
        let spine: Vec<String> = spine.iter().map(|point| (*point).to_owned()).collect();
        let chest = self.chain(&spine, root);
        let neck = if has(8) { chest } else { self.add("neck", Some(chest)) };
        let head = self.add("head", Some(neck));
        if has(9) {
            for point in ["jaw", "leye", "reye"] {
                self.add(point, Some(head));
            }
        }
        if !has(10) {
            self.add("crown", Some(head));
        }
        for side in sides {
            let arm = [("clavicle", 11), ("shoulder", 31), ("elbow", 31), ("forearm_twist", 12), ("wrist", 31)];
            let wrist = self.chain(&limb(side, arm, has), chest);
            if has(13) {
                for finger in ["thumb", "knuckle", "knuckle", "knuckle"] {
                    self.chain(&[format!("{side}{finger}"), format!("{side}fingers")], wrist);
                }
            }
        }
    }

    fn tree<'a>(&self, names: &'a [String]) -> JointTree<'a> {
        let mut tree = JointTree { parents: self.parents.clone(), ..JointTree::default() };
        tree.names = names.iter().map(String::as_str).collect();
        for frame in 0..12 {
            let phase = 0.5 * f64::from(frame);
            tree.poses.push(self.points.iter().map(|point| place(point, phase)).collect());
        }
        tree
    }
}

/// Names of joints, each for its point: meaningless, with a prefix, or in another language.
fn names(skeleton: &Skeleton, style: u32) -> Vec<String> {
    let mut names = Vec::new();
    for (index, point) in skeleton.points.iter().enumerate() {
        let is_sided = point.starts_with('l') || point.starts_with('r');
        names.push(match style {
            0 => format!("joint_{index}"),
            1 => format!("Actor07_{point}"),
            _ if is_sided => format!("{}_{index}", if point.starts_with('l') { "Links" } else { "Rechts" }),
            _ => format!("Mitte_{index}"),
        });
    }
    names
}

/// Skeletons of many programs, without names that say anything: every joint must be the right one.
#[test]
fn limbs_are_found_in_skeletons_without_names() {
    let mut seed = 7_u32;
    for round in 0..300 {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let (habits, style) = (seed >> 8 & 0x3fff, round % 3);
        let skeleton = Skeleton::of(habits);
        let names = names(&skeleton, style);
        let body = find(&skeleton.tree(&names)).unwrap_or_else(|why| panic!("{habits:b}, style {style}: {why}"));
        let point = |joint: usize| skeleton.points[joint].as_str();
        for (side, letter) in ["l", "r"].iter().enumerate() {
            let leg = body.legs[side].map(point);
            let arm = body.arms[side].map(point);
            for (found, part) in leg.iter().chain(&arm).zip(["hip", "knee", "ankle", "shoulder", "elbow", "wrist"]) {
                assert_eq!(*found, format!("{letter}{part}"), "{habits:b}, style {style}: {leg:?} {arm:?}");
            }
        }
        let has = |point: &str| skeleton.points.iter().any(|own| own == point);
        assert_eq!(body.head.crown.map(point), has("crown").then_some("crown"), "{habits:b}, style {style}");
        assert_eq!(body.head.head.map(point), Some("head"), "{habits:b}, style {style}");
        assert_eq!(body.head.neck.map(point), has("neck").then_some("neck"), "{habits:b}, style {style}");
        assert!((body.stature / 1.75 - 1.0).abs() < 0.02 && body.unusual.is_empty(), "{:?}", body.unusual);
    }
}

/// An animal in the proportions of a dog: legs of three bones each, a long level trunk, a tail.
fn dog() -> (Vec<String>, JointTree<'static>) {
    let mut points = vec![Point3::new(0.0, 0.0, 0.5)];
    let mut parents = vec![None];
    let mut chain = |from: usize, steps: &[[f64; 3]]| {
        let mut last = from;
        for step in steps {
            let next: Point3<f64> = points[last] + Vector3::from(*step);
            points.push(next);
            parents.push(Some(last));
            last = points.len() - 1;
        }
        last
    };
    let withers = chain(0, &[[0.2, 0.0, 0.0], [0.3, 0.0, 0.03]]);
    chain(withers, &[[0.15, 0.0, 0.1], [0.12, 0.0, 0.05], [0.15, 0.0, -0.03]]);
    chain(0, &[[-0.15, 0.0, 0.0], [-0.15, 0.0, -0.05]]);
    for y in [0.06, -0.06] {
        chain(0, &[[0.0, y, 0.0], [0.03, 0.0, -0.18], [-0.08, 0.0, -0.17], [0.02, 0.0, -0.13], [0.06, 0.0, 0.0]]);
        chain(withers, &[[0.0, y, -0.05], [-0.03, 0.0, -0.16], [0.03, 0.0, -0.17], [0.0, 0.0, -0.1], [0.05, 0.0, 0.0]]);
    }
    let names = (0..points.len()).map(|joint| format!("b{joint}")).collect();
    (names, JointTree { parents, poses: vec![points], ..JointTree::default() })
}

#[test]
fn animals_and_chains_are_refused() {
    let (names, mut tree) = dog();
    tree.names = names.iter().map(String::as_str).collect();
    let why = find(&tree).unwrap_err();
    assert!(why.contains("trunk") || why.contains("proportions"), "{why}");
    // a crab: eight legs and two claws from one joint
    let mut crab = JointTree { names: vec!["crab"], parents: vec![None], ..JointTree::default() };
    let mut points = vec![Point3::new(0.0, 0.0, 0.1)];
    for limb in 0..10 {
        let (angle, mut last) = (0.6 * f64::from(limb), 0);
        for reach in [0.05, 0.1, 0.18, 0.22] {
            points.push(Point3::new(reach * libm::cos(angle), reach * libm::sin(angle), 0.1));
            (crab.parents, last) = ([crab.parents, vec![Some(last)]].concat(), points.len() - 1);
            crab.names.push("leg");
        }
    }
    crab.poses = vec![points];
    find(&crab).unwrap_err();
    let chain: Vec<Point3<f64>> = (0..20).map(|joint| Point3::new(0.0, 0.0, 0.1 * f64::from(joint))).collect();
    let parents = (0..20_usize).map(|joint| joint.checked_sub(1)).collect();
    let why = find(&JointTree { names: vec!["a"; 20], parents, poses: vec![chain], pins: Vec::new() }).unwrap_err();
    assert!(why.contains("no two legs"), "{why}");
}

// A skin of Mixamo with short upper arms had its shoulders at the clavicles, which Mixamo calls shoulders.
#[test]
fn a_shoulder_above_an_arm_is_a_clavicle() {
    let skeleton = Skeleton::of(1 << 11);
    let mut names = skeleton.points.clone();
    for (own, mixamo) in [("shoulder", "Arm"), ("clavicle", "Shoulder"), ("elbow", "ForeArm")] {
        for (letter, side) in [("l", "Left"), ("r", "Right")] {
            names[skeleton.at(&format!("{letter}{own}"))] = format!("{side}{mixamo}");
        }
    }
    let mut tree = skeleton.tree(&names);
    tree.poses.truncate(1);
    for side in ["l", "r"] {
        let [shoulder, elbow, wrist] = ["shoulder", "elbow", "wrist"].map(|part| skeleton.at(&format!("{side}{part}")));
        let pose = &mut tree.poses[0];
        let forearm = pose[wrist] - pose[elbow];
        pose[elbow] = pose[shoulder] + 0.72 * (pose[elbow] - pose[shoulder]);
        pose[wrist] = pose[elbow] + 1.23 * forearm;
        pose[skeleton.at(&format!("{side}clavicle"))].y *= 2.0;
    }
    let body = find(&tree).unwrap();
    assert_eq!(body.arms.map(|arm| skeleton.points[arm[0]].as_str()), ["lshoulder", "rshoulder"]);
}

// DeepMimic's kick and a dance of Ready Player Me look down: their heads were placed by proportion.
#[test]
fn a_bowed_head_with_a_name_is_a_head() {
    let skeleton = Skeleton::of(0);
    let mut tree = skeleton.tree(&skeleton.points);
    let bow = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 1.2);
    for pose in &mut tree.poses {
        let neck = pose[skeleton.at("neck")];
        for point in ["head", "crown"] {
            pose[skeleton.at(point)] = neck + bow * (pose[skeleton.at(point)] - neck);
        }
    }
    let head = find(&tree).unwrap().head;
    assert_eq!([head.neck, head.head, head.crown], ["neck", "head", "crown"].map(|point| Some(skeleton.at(point))));
}

// LAFAN1's head, without its name, was the crown; and so was a nose, the only end of a head.
#[test]
fn a_high_head_and_a_nose_are_no_crown() {
    for has_nose in [false, true] {
        let skeleton = Skeleton::of(if has_nose { 0 } else { 1 << 10 });
        let names = names(&skeleton, u32::from(has_nose));
        let mut tree = skeleton.tree(&names);
        let [neck, head] = ["neck", "head"].map(|point| skeleton.at(point));
        for pose in &mut tree.poses {
            let (joint, place) = if has_nose { (head + 1, [0.33, 1.57]) } else { (head, [0.0, 1.62]) };
            pose[joint] = Point3::new(place[0], 0.0, place[1]);
        }
        let found = find(&tree).unwrap().head;
        assert_eq!([found.neck, found.head, found.crown], [Some(neck), Some(head), None], "{has_nose}");
    }
}

// SMPL-X in Blender has no end above the head, and that of its jaw was the top of the head.
#[test]
fn jaws_brows_and_hair_are_no_crown() {
    let mut skeletons = [0; 3].map(|_| Skeleton::of(1 << 10));
    let head = skeletons[0].at("head");
    skeletons[0].chain(&["jaw", "brow"].map(str::to_owned), head);
    // MakeHuman's muscles of the face end above the eyes, and one of them was the top of the head
    for point in ["lbrow", "rbrow"] {
        skeletons[1].add(point, Some(head));
    }
    // a tongue below the jaw was the crown, and the jaw the neck
    skeletons[2].chain(&["jaw", "jaw", "crown"].map(str::to_owned), head);
    for (index, skeleton) in skeletons.iter().enumerate() {
        let mut names = skeleton.points.clone();
        if index == 0 {
            names.last_mut().unwrap().clear();
        }
        let found = find(&skeleton.tree(&names)).unwrap().head;
        assert!(found.head == Some(head) && found.crown.is_none(), "{index}: {found:?}");
    }
    // the name of a figure is before each of its joints
    let skeleton = Skeleton::of(0);
    let names: Vec<String> = skeleton.points.iter().map(|name| format!("Philip_{name}")).collect();
    assert!(find(&skeleton.tree(&names)).unwrap().head.crown.is_some());
}

// A jump of Mixamo had its ankles at the balls of the feet, and a crown far above a named neck made the head the neck.
#[test]
fn a_named_foot_is_the_ankle_and_a_named_neck_the_neck() {
    let skeleton = Skeleton::of(1 << 11);
    let name = |p: &String| p.replace("ankle", "Foot").replace("toes", "ToeBase").replace("crown", "HeadTop");
    let names: Vec<String> = skeleton.points.iter().map(name).collect();
    let mut tree = skeleton.tree(&names);
    tree.poses.truncate(1);
    let pose = &mut tree.poses[0];
    for side in ["l", "r"] {
        // a short shank above a high heel
        let [knee, ankle, toes] = ["knee", "ankle", "toes"].map(|part| skeleton.at(&format!("{side}{part}")));
        pose[ankle] = pose[knee] + 0.8 * (pose[ankle] - pose[knee]);
        pose[toes] = pose[ankle] + Vector3::new(0.04, 0.0, -0.1);
    }
    pose[skeleton.at("crown")].z += 0.16;
    let body = find(&tree).unwrap();
    assert_eq!(body.legs.map(|leg| skeleton.points[leg[2]].as_str()), ["lankle", "rankle"]);
    assert_eq!([body.head.neck, body.head.crown], ["neck", "crown"].map(|point| Some(skeleton.at(point))));
}

// MocapNET's and DragPoser's second neck was the base of the neck, 0.05 to 0.2 m too high.
#[test]
fn of_two_necks_the_one_above_the_shoulders_is_the_base() {
    let skeleton = Skeleton::of(0);
    let [lower, upper, head] = ["neck", "head", "crown"].map(|point| skeleton.at(point));
    let mut names = skeleton.points.clone();
    [names[lower], names[upper], names[head]] = ["lowerneck", "upperneck", "head"].map(str::to_owned);
    let mut tree = skeleton.tree(&names);
    for (heights, base) in [([0.03, 0.06], 0), ([0.02, 0.07], 0), ([-0.04, 0.02], 1), ([-0.06, -0.01], 1)] {
        for pose in &mut tree.poses {
            [pose[lower].z, pose[upper].z, pose[head].z] = [heights[0], heights[1], 0.09].map(|up| 1.43 + 1.75 * up);
        }
        assert_eq!(find(&tree).unwrap().head.neck, Some([lower, upper][base]), "{heights:?}");
    }
}

// The hip was MakeHuman's upperleg02, which twists the thigh 8 cm below upperleg01.
#[test]
fn a_joint_that_twists_the_thigh_is_no_hip() {
    let skeleton = Skeleton::of(1 << 4);
    let name = |p: &String| p.replace("thigh_twist", "upperleg02").replace("hip", "upperleg01");
    let names: Vec<String> = skeleton.points.iter().map(name).collect();
    let mut tree = skeleton.tree(&names);
    for (joint, _) in skeleton.points.iter().enumerate().filter(|(_, point)| point.ends_with("thigh_twist")) {
        tree.poses
            .iter_mut()
            .for_each(|pose| pose[joint] = pose[joint - 1] + (pose[joint + 1] - pose[joint - 1]) * 0.2);
    }
    let hips = find(&tree).unwrap().legs.map(|leg| skeleton.points[leg[0]].as_str());
    assert_eq!(hips, ["lhip", "rhip"]);
}

// The left forearm of a converted file was half as long as the right one, and its wrist the end of a finger.
#[test]
fn a_hand_and_a_finger_are_no_pair_of_wrists() {
    let skeleton = Skeleton::of(1 << 13);
    let name = |p: &String| p.replace("wrist", "Hand").replace("knuckle", "finger1").replace("fingers", "finger2");
    let names: Vec<String> = skeleton.points.iter().map(name).collect();
    let mut tree = skeleton.tree(&names);
    for pose in &mut tree.poses {
        let missing = 0.5 * (pose[skeleton.at("lwrist")] - pose[skeleton.at("lelbow")]);
        (skeleton.at("lwrist")..skeleton.at("rshoulder")).for_each(|joint| pose[joint] -= missing);
    }
    let wrists = find(&tree).unwrap().arms.map(|arm| skeleton.points[arm[2]].as_str());
    assert_eq!(wrists, ["lwrist", "rwrist"]);
}
