//! Tests a small robot with the names of many robots, upright and with other axes.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use crate::body::{Humanoid, LANDMARKS, Landmark, from_axes};

type Hinge = ([f64; 3], [u8; 3]);

/// The joints of one side: a leg's three hip, one knee and two ankle joints, and an arm's three shoulder, one elbow
/// and two wrist joints; positions in the parent's frame (X forward, Y left, Z up), and axes.
const LEG: [Hinge; 6] = [
    ([0.0, 0.09, 0.0], [0, 0, 1]),
    ([0.0, 0.0, 0.0], [1, 0, 0]),
    ([0.0, 0.0, 0.0], [0, 1, 0]),
    ([0.0, 0.0, -0.4], [0, 1, 0]),
    ([0.0, 0.0, -0.38], [0, 1, 0]),
    ([0.0, 0.0, 0.0], [1, 0, 0]),
];
/// The upper arm's axial rotation has its frame half-way down the arm, as in Unitree's robots.
const ARM: [Hinge; 6] = [
    ([0.0, 0.18, 0.4], [0, 1, 0]),
    ([0.0, 0.0, 0.0], [1, 0, 0]),
    ([0.0, 0.0, -0.12], [0, 0, 1]),
    ([0.0, 0.0, -0.16], [0, 1, 0]),
    ([0.0, 0.0, -0.24], [0, 0, 1]),
    ([0.0, 0.0, 0.0], [0, 1, 0]),
];

/// Naming convention of a robot's links. `{}` is the side; joints are named after the links that they move, or
/// unnamed.
struct Style {
    sides: [&'static str; 2],
    /// Six links each, outwards.
    leg: &'static str,
    arm: &'static str,
    /// Pelvis, trunk, neck, head.
    trunk: [&'static str; 4],
    finger: &'static str,
}

const STYLES: [Style; 9] = [
    // Unitree H1 and G1
    Style {
        sides: ["left", "right"],
        leg: "{}_hip_yaw_link {}_hip_roll_link {}_hip_pitch_link {}_knee_link {}_ankle_pitch_link {}_ankle_roll_link",
        arm: "{}_shoulder_pitch_link {}_shoulder_roll_link {}_shoulder_yaw_link {}_elbow_link {}_wrist_roll_link \
              {}_wrist_pitch_link",
        trunk: ["pelvis", "torso_link", "neck_link", "head_link"],
        finger: "{}_hand_middle_",
    },
    // Talos
    Style {
        sides: ["left", "right"],
        leg: "leg_{}_1_link leg_{}_2_link leg_{}_3_link leg_{}_4_link leg_{}_5_link leg_{}_6_link",
        arm: "arm_{}_1_link arm_{}_2_link arm_{}_3_link arm_{}_4_link arm_{}_5_link arm_{}_6_link",
        trunk: ["base_link", "torso_1_link", "head_1_link", "head_2_link"],
        finger: "gripper_{}_fingertip_",
    },
    // Atlas
    Style {
        sides: ["l", "r"],
        leg: "{}_uglut {}_lglut {}_uleg {}_lleg {}_talus {}_foot",
        arm: "{}_clav {}_scap {}_uarm {}_larm {}_farm {}_hand",
        trunk: ["pelvis", "utorso", "neck_ry", "head"],
        finger: "{}_f0_",
    },
    // iCub, ergoCub
    Style {
        sides: ["l", "r"],
        leg: "{}_hip_1 {}_hip_2 {}_upper_leg {}_lower_leg {}_ankle_1 {}_foot",
        arm: "{}_shoulder_1 {}_shoulder_2 {}_upper_arm {}_elbow_1 {}_wrist_1 {}_hand",
        trunk: ["root_link", "chest", "neck_1", "head"],
        finger: "{}_hand_thumb_",
    },
    // Valkyrie
    Style {
        sides: ["left", "right"],
        leg: "{}HipYawLink {}HipRollLink {}HipPitchLink {}KneePitchLink {}AnklePitchLink {}Foot",
        arm: "{}ShoulderPitchLink {}ShoulderRollLink {}ShoulderYawLink {}ElbowPitchLink {}WristRollLink {}Palm",
        trunk: ["pelvis", "torso", "lowerNeckPitchLink", "head"],
        finger: "{}ThumbPitch",
    },
    // NAO, Romeo
    Style {
        sides: ["L", "R"],
        leg: "{}HipYawPitch {}HipRoll {}Thigh {}Tibia {}AnklePitch {}Foot",
        arm: "{}ShoulderPitch {}ShoulderRoll {}Bicep {}ForeArm {}WristYaw {}Hand",
        trunk: ["base_link", "torso", "HeadYaw_link", "HeadPitch_link"],
        finger: "{}Finger",
    },
    // SMPL
    Style {
        sides: ["L", "R"],
        leg: "{}_Hip_x {}_Hip_y {}_Hip {}_Knee {}_Ankle_x {}_Ankle",
        arm: "{}_Shoulder_x {}_Shoulder_y {}_Shoulder {}_Elbow {}_Wrist {}_Hand",
        trunk: ["Pelvis", "Chest", "Neck", "Head"],
        finger: "{}_Index",
    },
    // Mixamo: LeftArm is the upper arm, LeftLeg the shank
    Style {
        sides: ["Left", "Right"],
        leg: "{}UpLeg_x {}UpLeg_y {}UpLeg {}Leg {}Foot_x {}Foot",
        arm: "{}Arm_x {}Arm_y {}Arm {}ForeArm {}Hand_x {}Hand",
        trunk: ["Hips", "Spine2", "Neck", "Head"],
        finger: "{}HandIndex",
    },
    // MakeHuman
    Style {
        sides: ["L", "R"],
        leg: "upperleg01.{} upperleg02.{} upperleg03.{} lowerleg01.{} foot_x.{} foot.{}",
        arm: "upperarm01.{} upperarm02.{} upperarm03.{} lowerarm01.{} wrist_x.{} wrist.{}",
        trunk: ["root", "spine01", "neck01", "head"],
        finger: "finger1-.{}",
    },
];

#[derive(Clone, Copy)]
struct Build<'a> {
    root_from_body: UnitQuaternion<f64>,
    head: bool,
    arm: &'a [Hinge],
    fingers: bool,
    legs: bool,
}

impl Build<'_> {
    fn whole() -> Self {
        Self { root_from_body: UnitQuaternion::identity(), head: true, arm: &ARM, fingers: false, legs: true }
    }
}

struct Writer {
    text: String,
    turn: UnitQuaternion<f64>,
}

impl Writer {
    fn link(&mut self, name: &str, shape: Option<(&str, [f64; 3])>) {
        let visual = shape.map_or(String::new(), |(shape, at)| {
            let [x, y, z] = self.turned(at);
            format!("<visual><origin xyz=\"{x} {y} {z}\"/><geometry>{shape}</geometry></visual>")
        });
        self.text += &format!("<link name=\"{name}\">{visual}</link>\n");
    }

    fn joint(&mut self, parent: &str, child: &str, at: [f64; 3], axis: [f64; 3]) {
        let ([x, y, z], [a, b, c]) = (self.turned(at), self.turned(axis));
        self.text += &format!(
            "<joint name=\"{child}_joint\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
             <origin xyz=\"{x} {y} {z}\"/><axis xyz=\"{a} {b} {c}\"/><limit lower=\"-2\" upper=\"2\" effort=\"9\" velocity=\"9\"/></joint>\n"
        );
    }

    /// Converts a vector from the body's axes to the root's.
    fn turned(&self, v: [f64; 3]) -> [f64; 3] {
        (self.turn * Vector3::from(v)).into()
    }
}

/// The robot's text; `name` maps the style's name of a link to its actual name.
fn urdf(style: &Style, build: &Build<'_>, name: &dyn Fn(&str) -> String) -> String {
    let mut w = Writer { text: "<robot name=\"r\">\n".to_owned(), turn: build.root_from_body };
    let [pelvis, trunk, neck, head] = style.trunk.map(name);
    let ball = |radius: f64| format!("<sphere radius=\"{radius}\"/>");
    w.link(&pelvis, Some((&ball(0.1), [0.0, 0.0, 0.05])));
    w.link(&trunk, Some((&ball(0.15), [0.0, 0.0, 0.25])));
    w.joint(&pelvis, &trunk, [0.0, 0.0, 0.1], [0.0, 0.0, 1.0]);
    for (side, sign) in style.sides.into_iter().zip([1.0, -1.0]) {
        let own = |pattern: &str| name(&pattern.replace("{}", side));
        for (joints, names, root) in [(&LEG[..], style.leg, &pelvis), (build.arm, style.arm, &trunk)] {
            if root == &pelvis && !build.legs {
                continue;
            }
            let mut parent = root.clone();
            for (i, ((at, axis), pattern)) in joints.iter().zip(names.split(' ')).enumerate() {
                let link = own(pattern);
                // a solid along the bone below the joint, and on hands and feet
                let shape = match i {
                    3 if i + 1 == joints.len() => Some((ball(0.05), [0.0, 0.0, -0.25])),
                    3 => Some((ball(0.04), [0.0, 0.0, -0.12])),
                    5 => Some((ball(0.04), [0.03, 0.0, -0.04])),
                    _ => None,
                };
                w.link(&link, shape.as_ref().map(|(shape, at)| (shape.as_str(), *at)));
                w.joint(&parent, &link, [at[0], at[1] * sign, at[2]], axis.map(f64::from));
                parent = link;
            }
            if build.fingers && root == &trunk {
                for finger in 0..3 {
                    let mut knuckle = parent.clone();
                    for bone in 0..2 {
                        let link = own(&format!("{}{finger}_{bone}", style.finger));
                        w.link(&link, Some((&ball(0.01), [0.0; 3])));
                        w.joint(&knuckle, &link, [0.02 * f64::from(finger), 0.0, -0.05], [0.0, 1.0, 0.0]);
                        knuckle = link;
                    }
                }
            }
        }
    }
    if build.head {
        w.link(&neck, None);
        w.joint(&trunk, &neck, [0.0, 0.0, 0.45], [0.0, 0.0, 1.0]);
        w.link(&head, Some((&ball(0.1), [0.02, 0.0, 0.12])));
        w.joint(&neck, &head, [0.0, 0.0, 0.03], [0.0, 1.0, 0.0]);
    }
    w.text + "</robot>"
}

fn load(text: &str) -> Humanoid {
    Humanoid::from_urdf(text, "style.urdf", &|_| Err(std::io::ErrorKind::NotFound.into())).unwrap()
}

/// Positions of the robot's markers by construction, in the body's axes.
fn expected(landmark: Landmark) -> Point3<f64> {
    use Landmark as L;
    let sided = |left: bool, y: f64, z: f64| Point3::new(0.0, if left { y } else { -y }, z);
    match landmark {
        L::Pelvis => Point3::origin(),
        L::Thorax => Point3::new(0.0, 0.0, 0.55),
        L::HeadTop => Point3::new(0.0, 0.0, 0.80),
        L::LeftHip | L::RightHip => sided(landmark == L::LeftHip, 0.09, 0.0),
        L::LeftKnee | L::RightKnee => sided(landmark == L::LeftKnee, 0.09, -0.4),
        L::LeftAnkle | L::RightAnkle => sided(landmark == L::LeftAnkle, 0.09, -0.78),
        L::LeftShoulder | L::RightShoulder => sided(landmark == L::LeftShoulder, 0.18, 0.5),
        L::LeftElbow | L::RightElbow => sided(landmark == L::LeftElbow, 0.18, 0.22),
        L::LeftWrist | L::RightWrist => sided(landmark == L::LeftWrist, 0.18, -0.02),
    }
}

/// Checks every marker to 5 mm, and the body's axes. Landmarks placed by proportions may be off by 6 cm, the variation
/// between people.
fn check(what: &str, body: &Humanoid, build: &Build<'_>, placed_by_proportions: &[Landmark]) {
    let markers = body.markers(&body.link_frames(&body.zero_pose()));
    for landmark in LANDMARKS {
        let name = landmark.name();
        let place = markers[landmark as usize].unwrap_or_else(|| panic!("{what}: no {name}; {:?}", body.notes));
        let in_body = build.root_from_body.inverse() * place;
        let off = (in_body - expected(landmark)).norm();
        let most = if placed_by_proportions.contains(&landmark) { 0.06 } else { 0.005 };
        assert!(off < most, "{what}: {name} at {in_body}, {off:.3} m off; {:?}", body.notes);
    }
    let angle = body.root_from_body().angle_to(&build.root_from_body);
    assert!(angle < 1e-6, "{what}: axes {angle} rad off");
}

/// X forward and Z up; Z forward and Y up (SMPL, Blender); X forward and Y up (Gepetto); Y forward and Z up.
fn axes() -> [UnitQuaternion<f64>; 4] {
    let columns = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
        [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
        [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]],
    ];
    columns.map(|[x, y]| from_axes(Vector3::from(x), Vector3::from(y)))
}

#[test]
fn markers_and_axes_are_found_by_the_names_of_many_robots() {
    for style in &STYLES {
        for root_from_body in axes() {
            let build = Build { root_from_body, ..Build::whole() };
            check(style.finger, &load(&urdf(style, &build, &str::to_owned)), &build, &[]);
        }
    }
}

#[test]
fn fingers_are_not_taken_for_wrists() {
    for style in &STYLES {
        let build = Build { fingers: true, ..Build::whole() };
        check(style.finger, &load(&urdf(style, &build, &str::to_owned)), &build, &[]);
    }
}

#[test]
fn a_missing_head_and_missing_wrists_are_placed_by_human_proportions() {
    let trunk = [Landmark::Thorax, Landmark::HeadTop];
    let wrists = [Landmark::LeftWrist, Landmark::RightWrist];
    for style in &STYLES {
        let headless = Build { head: false, ..Build::whole() };
        check(style.trunk[3], &load(&urdf(style, &headless, &str::to_owned)), &headless, &trunk);
    }
    let armless = Build { arm: &ARM[..4], ..Build::whole() };
    check("no wrists", &load(&urdf(&STYLES[0], &armless, &str::to_owned)), &armless, &wrists);
}

fn numbered(name: &str) -> String {
    let sum = name.bytes().fold(7_u64, |sum, b| sum.wrapping_mul(31).wrapping_add(u64::from(b)));
    format!("part_{sum}")
}

#[test]
fn limbs_are_found_by_shape_if_names_are_uninformative() {
    let style = &STYLES[0];
    // the first joint of a finger may be one of the wrist's
    let unknown = [Landmark::Thorax, Landmark::HeadTop, Landmark::LeftWrist, Landmark::RightWrist];
    for (build, what) in [
        (Build::whole(), "Z up"),
        (Build { root_from_body: axes()[1], ..Build::whole() }, "Y up"),
        (Build { fingers: true, ..Build::whole() }, "with fingers"),
    ] {
        let body = load(&urdf(style, &build, &numbered));
        check(what, &body, &build, &unknown);
        assert!(body.notes.iter().any(|note| note.contains("proposed from shape")), "{:?}", body.notes);
    }
}

#[test]
fn a_marker_in_the_file_overrides_one_proposal() {
    let text = urdf(&STYLES[3], &Build::whole(), &str::to_owned);
    let marker = "<link name=\"marker_head_top\"/><joint name=\"m\" type=\"fixed\"><parent link=\"head\"/>\
                  <child link=\"marker_head_top\"/><origin xyz=\"0 0 0.5\"/></joint></robot>";
    let (plain, own) = (load(&text), load(&text.replace("</robot>", marker)));
    let places = |body: &Humanoid| body.markers(&body.link_frames(&body.zero_pose())).map(Option::unwrap);
    for ((before, after), landmark) in places(&plain).into_iter().zip(places(&own)).zip(LANDMARKS) {
        let expected = if landmark == Landmark::HeadTop { Point3::new(0.0, 0.0, 1.08) } else { before };
        assert!((after - expected).norm() < 1e-12, "{}: {after}", landmark.name());
    }
    let note = own.notes.join("; ");
    assert!(note.contains("left_knee on `l_lower_leg`") && note.contains("marker_NAME overrides one"), "{note}");
    assert!(!note.contains("head_top"), "{note}");
}

/// Links arm_pitch to elbow_yaw: the elbow was taken for a part beyond the arm, and sat on the shoulder.
#[test]
fn an_elbow_below_links_called_arm_is_found() {
    let names = ["arm_pitch", "arm_roll", "arm_yaw", "elbow_pitch", "elbow_yaw"];
    let rename = |name: &str| {
        let old = STYLES[0]
            .arm
            .split(' ')
            .position(|pattern| pattern.split_once("{}").is_some_and(|(_, rest)| name.ends_with(rest)));
        match (old, name.split_once('_')) {
            (Some(index), Some((side, _))) => format!("{side}_{}_link", names.get(index).copied().unwrap_or("arm_end")),
            _ => name.to_owned(),
        }
    };
    let build = Build::whole();
    check("arm names", &load(&urdf(&STYLES[0], &build, &rename)), &build, &[]);
}

/// Checks a robot with these joints below two of its shoulder, each a distance down and an axis.
fn check_arm(below: &[(f64, [u8; 3])], name: &dyn Fn(&str) -> String, by_proportions: &[Landmark]) {
    let mut arm = ARM[..2].to_vec();
    arm.extend(below.iter().map(|&(down, axis)| ([0.0, 0.0, -down], axis)));
    let names = "{}_shoulder_1 {}_shoulder_2 {}_shoulder_3 {}_elbow {}_wrist_1 {}_wrist_2 {}_wrist_3";
    let (style, build) = (Style { arm: names, ..STYLES[0] }, Build { arm: &arm, ..Build::whole() });
    check("arm", &load(&urdf(&style, &build, name)), &build, by_proportions);
}

const X: [u8; 3] = [1, 0, 0];
const Y: [u8; 3] = [0, 1, 0];
const Z: [u8; 3] = [0, 0, 1];
const HEAD: [Landmark; 2] = [Landmark::Thorax, Landmark::HeadTop];

/// Hinges that bend a wrist were at the joint above that turns the forearm.
#[test]
fn a_turning_forearm_is_no_wrist() {
    let together = [(0.12, Z), (0.16, Y), (0.04, Z), (0.2, X), (0.0, Y)];
    check_arm(&together, &str::to_owned, &[]);
    let apart = [(0.12, Z), (0.16, Y), (0.16, Z), (0.08, Y), (0.08, X)];
    check_arm(&apart, &str::to_owned, &[]);
    let halfway = [(0.12, Z), (0.16, Y), (0.13, Z), (0.11, X), (0.0, Y)];
    check_arm(&halfway, &numbered, &HEAD);
}

/// The first joint of a finger bends, but is too far from the elbow.
#[test]
fn a_finger_is_no_wrist() {
    check_arm(&[(0.12, Z), (0.16, Y), (0.24, Z), (0.1, Y)], &numbered, &HEAD);
}

/// An arm that ends with its elbow, and one whose forearm turns in the middle of the chain.
#[test]
fn a_turning_bone_is_no_elbow() {
    let unknown = [HEAD[0], HEAD[1], Landmark::LeftWrist, Landmark::RightWrist];
    check_arm(&[(0.18, Z), (0.1, Y)], &numbered, &unknown);
    check_arm(&[(0.12, Z), (0.16, Y), (0.02, Z), (0.22, Y), (0.1, Y)], &numbered, &HEAD);
    let both_named = |name: &str| name.replace("shoulder_3", "elbow_turn");
    check_arm(&[(0.12, Z), (0.16, Y), (0.24, Z), (0.0, Y)], &both_named, &[]);
}

/// A robot on a column: its arms were taken for legs.
#[test]
fn arms_are_never_taken_for_legs() {
    for style in &STYLES {
        let body = load(&urdf(style, &Build { legs: false, ..Build::whole() }, &str::to_owned));
        assert!(body.markers[Landmark::LeftKnee as usize].is_none(), "{}: {:?}", style.finger, body.notes);
    }
}

/// Digit's knee is beside its hip, and R2's lower leg above its ankle.
#[test]
fn a_knee_beside_the_hip_is_none() {
    let names = ["hip_1", "hip_2", "knee", "shin", "toe_pitch", "toe_roll"];
    let rename = |name: &str| {
        let side = name.split('_').next().unwrap_or_default();
        let old = STYLES[0].leg.split(' ').position(|pattern| pattern.replace("{}", side) == name);
        old.map_or(name.to_owned(), |index| format!("{side}_{}", names[index]))
    };
    let build = Build::whole();
    check("knee", &load(&urdf(&STYLES[0], &build, &rename)), &build, &[]);
}

/// The trunk of a dog is level, and its forelegs were arms.
#[test]
fn a_robot_dog_is_no_human() {
    let mut text = "<robot name=\"dog\"><link name=\"base\"/>".to_owned();
    for (leg, x, y) in [("LF", 0.3, 0.1), ("RF", 0.3, -0.1), ("LH", -0.3, 0.1), ("RH", -0.3, -0.1)] {
        let mut parent = "base".to_owned();
        for (part, at) in
            [("HIP", [x, y, 0.0]), ("THIGH", [0.0; 3]), ("SHANK", [0.0, 0.0, -0.3]), ("FOOT", [0.0, 0.0, -0.3])]
        {
            let [x, y, z] = at;
            text += &format!(
                "<link name=\"{leg}_{part}\"/><joint name=\"{leg}_{part}_joint\" type=\"continuous\"><parent link=\"{parent}\"/>\
                 <child link=\"{leg}_{part}\"/><origin xyz=\"{x} {y} {z}\"/><axis xyz=\"0 1 0\"/></joint>"
            );
            parent = format!("{leg}_{part}");
        }
    }
    let body = load(&(text + "</robot>"));
    assert!(body.markers.iter().all(Option::is_none), "{:?}", body.notes);
    assert!(body.notes.join("; ").contains("no markers are proposed: the trunk would not be above the legs"));
}

/// An ant of four equal legs in a plane was a person that lay on the ground.
#[test]
fn four_equal_limbs_are_no_human() {
    let mut w = Writer { text: "<robot name=\"ant\">".to_owned(), turn: UnitQuaternion::identity() };
    w.link("body", None);
    for (leg, x, y) in [("a", 0.1, 0.1), ("b", -0.1, 0.1), ("c", 0.1, -0.1), ("d", -0.1, -0.1)] {
        let [upper, lower] = [1, 2].map(|number| format!("{leg}{number}"));
        w.link(&upper, None);
        w.joint("body", &upper, [x, y, 0.0], [0.0, 0.0, 1.0]);
        w.link(&lower, Some(("<sphere radius=\"0.02\"/>", [x, y, 0.0])));
        w.joint(&upper, &lower, [x, y, 0.0], [-y, x, 0.0]);
    }
    let notes = load(&(w.text + "</robot>")).notes.join("; ");
    assert!(notes.contains("four equal limbs at one height: an animal or a machine"), "{notes}");
}

#[test]
fn a_robot_arm_is_not_a_humanoid() {
    let joints = (0..6).map(|i| {
        format!(
            "<joint name=\"j{i}\" type=\"revolute\"><parent link=\"l{i}\"/><child link=\"l{}\"/><origin xyz=\"0 0 0.2\"/>\
             <axis xyz=\"0 1 0\"/></joint>",
            i + 1
        )
    });
    let links = (0..7).map(|i| format!("<link name=\"l{i}\"/>"));
    let body = load(&format!("<robot name=\"r\">{}</robot>", links.chain(joints).collect::<String>()));
    assert!(body.markers.iter().all(Option::is_none));
    assert!(!body.notes.iter().any(|note| note.contains("marker")), "{:?}", body.notes);
}
