//! The body of PARSEC's bodytrack: ten tapered cylinders, moved by 31 numbers. Its files are in
//! millimetres and radians; everything here is in metres.
//!
//! Numbers 0 to 2 turn the torso about its x, y and z, and 3 to 5 are the position of the pelvis. The others are angles
//! of joints about their x, y or z: 6 to 9 left hip and knee, 10 to 13 right ones, 14 to 19 left clavicle, shoulder and
//! elbow, 20 to 25 right ones, 26 and 27 thorax, 28 to 30 head. The torso turns by `Rz Rx Ry`; a joint by the inverse
//! of that product, which is the chain of hinges y, x, z with opposite signs.

use nalgebra::{DVector, Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::body::{
    DegreeOfFreedom, Drive, Humanoid, Joint, JointKind, LANDMARKS, Landmark, Link, LinkPoint, Markers, Pose,
    rotation_about,
};
use crate::input::excerpt;

/// Numbers of a pose.
pub const BODYTRACK_NUMBERS: usize = 31;
/// Numbers of a pose that are not angles of joints: they are the first ones.
pub(super) const ROOT: usize = 6;
/// Numbers of a pose that are positions.
pub(super) const POSITION: std::ops::Range<usize> = 3..6;

/// Number of cylinders.
pub(super) const CYLINDERS: usize = 10;
const LENGTHS: usize = 18;
/// Greatest radius, scale or length in a file; longer ones are of no person.
const GREATEST: f64 = 1e6;

/// Indices of lengths. Those of the right side are [`RIGHT`] greater.
const TORSO: usize = 0;
const HIP: usize = 1;
const THIGH: usize = 2;
const SHANK: usize = 3;
const CLAVICLE: usize = 9;
const UPPER_ARM: usize = 10;
const FOREARM: usize = 11;
const RIGHT: usize = 4;
const HEAD: usize = 17;
/// Lengths that are not used, and those that a body may have as zero.
const UNUSED: [usize; 4] = [4, 8, 12, 16];
const MAY_BE_ZERO: [usize; 4] = [HIP, HIP + RIGHT, CLAVICLE, CLAVICLE + RIGHT];

/// Ends of the ten cylinders: torso, left and right leg, left and right arm, head. The torso starts at the pelvis.
pub(super) const SEGMENTS: [[Landmark; 2]; CYLINDERS] = {
    use Landmark as L;
    [
        [L::Pelvis, L::Thorax],
        [L::LeftHip, L::LeftKnee],
        [L::LeftKnee, L::LeftAnkle],
        [L::RightHip, L::RightKnee],
        [L::RightKnee, L::RightAnkle],
        [L::LeftShoulder, L::LeftElbow],
        [L::LeftElbow, L::LeftWrist],
        [L::RightShoulder, L::RightElbow],
        [L::RightElbow, L::RightWrist],
        [L::Thorax, L::HeadTop],
    ]
};

/// The distances between markers that are lengths: index, ends.
const DISTANCES: [(usize, [Landmark; 2]); 11] = {
    use Landmark as L;
    [
        (THIGH, SEGMENTS[1]),
        (SHANK, SEGMENTS[2]),
        (THIGH + RIGHT, SEGMENTS[3]),
        (SHANK + RIGHT, SEGMENTS[4]),
        (CLAVICLE, [L::Thorax, L::LeftShoulder]),
        (UPPER_ARM, SEGMENTS[5]),
        (FOREARM, SEGMENTS[6]),
        (CLAVICLE + RIGHT, [L::Thorax, L::RightShoulder]),
        (UPPER_ARM + RIGHT, SEGMENTS[7]),
        (FOREARM + RIGHT, SEGMENTS[8]),
        (HEAD, SEGMENTS[9]),
    ]
};

/// Limits of angles that are not a full turn either way, degrees: knees and elbows bend one way.
const BENDS: [(usize, [f64; 2]); 4] =
    [(9, [-160.0, 10.0]), (13, [-160.0, 10.0]), (19, [-160.0, 10.0]), (25, [-10.0, 160.0])];

/// `BodyShapeParameters.txt`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BodytrackShape {
    /// Of every cylinder: radius at its start and at its end, metres; factors along its x and y.
    pub(super) cylinders: [[f64; 4]; CYLINDERS],
    /// Metres; 4, 8, 12 and 16 are not used.
    pub(super) lengths: [f64; LENGTHS],
}

impl BodytrackShape {
    /// A body with these markers, all of which are there, and no thickness yet.
    pub(super) fn of_markers(markers: &[Point3<f64>; LANDMARKS.len()]) -> Self {
        let between = |[from, to]: [Landmark; 2]| (markers[to as usize] - markers[from as usize]).norm();
        let mut lengths = [0.0; LENGTHS];
        DISTANCES.iter().for_each(|(index, ends)| lengths[*index] = between(*ends));
        lengths[HIP] = 0.5 * between([Landmark::LeftHip, Landmark::RightHip]);
        lengths[HIP + RIGHT] = lengths[HIP];
        let hips = nalgebra::center(&markers[Landmark::LeftHip as usize], &markers[Landmark::RightHip as usize]);
        lengths[TORSO] = (markers[Landmark::Thorax as usize] - hips).norm();
        Self { cylinders: [[0.0, 0.0, 1.0, 1.0]; CYLINDERS], lengths }
    }

    /// The text of the file.
    pub(super) fn text(&self) -> String {
        let cylinder =
            |[start, end, x, y]: &[f64; 4]| format!("{:.3} {:.3} {x:.5} {y:.5}\n", 1000.0 * start, 1000.0 * end);
        let length = |length: &f64| format!("{:.3}\n", 1000.0 * length);
        self.cylinders.iter().map(cylinder).chain(self.lengths.iter().map(length)).collect()
    }

    fn from_text(text: &str) -> Result<Self, String> {
        const COUNT: usize = 4 * CYLINDERS + LENGTHS;
        let count = text.split_whitespace().count();
        let of_count =
            || format!("expected {COUNT} numbers (4 of each of 10 cylinders, and 18 lengths), found {count}");
        if count != COUNT {
            return Err(of_count());
        }
        let mut found = Vec::with_capacity(COUNT);
        for (line, row) in (1..).zip(text.lines()) {
            for field in row.split_whitespace() {
                let size = number(field).and_then(|number| possible(found.len(), number));
                found.push(size.map_err(|detail| format!("line {line}: {detail}"))?);
            }
        }
        let (cylinders, lengths) = found.split_at_checked(4 * CYLINDERS).ok_or_else(of_count)?;
        let mut shape = Self { cylinders: [[0.0; 4]; CYLINDERS], lengths: [0.0; LENGTHS] };
        for (cylinder, [start, end, x, y]) in shape.cylinders.iter_mut().zip(cylinders.as_chunks::<4>().0) {
            *cylinder = [0.001 * start, 0.001 * end, *x, *y];
        }
        shape.lengths.iter_mut().zip(lengths).for_each(|(length, found)| *length = 0.001 * found);
        Ok(shape)
    }
}

/// A number of a file.
fn number(field: &str) -> Result<f64, String> {
    let number = field.parse::<f64>().ok().filter(|number| number.abs() <= GREATEST);
    number.ok_or_else(|| format!("expected a number of at most {GREATEST}, found {:?}", excerpt(field)))
}

/// The number at a place of the file, if a body can have it.
fn possible(place: usize, number: f64) -> Result<f64, String> {
    let length = place.checked_sub(4 * CYLINDERS);
    let what = if length.is_some() { "length" } else { "radius or factor of a cylinder" };
    match length {
        Some(length) if UNUSED.contains(&length) => Ok(number),
        Some(length) if MAY_BE_ZERO.contains(&length) && number >= 0.0 => Ok(number),
        Some(length) if MAY_BE_ZERO.contains(&length) => {
            Err(format!("expected a {what} of at least 0, found {number}"))
        }
        _ if number > 0.0 => Ok(number),
        _ => Err(format!("expected a {what} greater than 0, found {number}")),
    }
}

/// The body of a `BodyShapeParameters.txt`.
#[derive(Clone, Debug)]
pub struct BodytrackBody {
    pub(super) shape: BodytrackShape,
    /// Its joints; degree of freedom i is number 6 + i of a pose.
    pub(super) humanoid: Humanoid,
}

impl BodytrackBody {
    /// The body that a `BodyShapeParameters.txt` describes.
    ///
    /// # Errors
    /// A message with what was expected and what was found.
    pub fn from_text(text: &str) -> Result<Self, String> {
        BodytrackShape::from_text(text).map(Self::new)
    }

    pub(super) fn new(shape: BodytrackShape) -> Self {
        let humanoid = humanoid(&shape);
        Self { shape, humanoid }
    }

    /// The link that carries a cylinder: that of its start, but the head's moves in the thorax.
    pub(super) fn link(&self, cylinder: usize) -> Option<usize> {
        let [start, end] = SEGMENTS[cylinder];
        self.humanoid.markers[if start == Landmark::Thorax { end } else { start } as usize].map(|on| on.link)
    }

    /// Positions of HumanEva's markers, all of which it has, in a pose of a `poses.txt`: world, metres. Pelvis and
    /// thorax are the ends of the torso, the top of the head is the end of its cylinder.
    pub fn markers(&self, numbers: &[f64; BODYTRACK_NUMBERS]) -> Markers {
        self.humanoid.markers(&self.humanoid.link_frames(&pose_of(numbers)))
    }
}

/// The pose of these numbers.
pub(super) fn pose_of(numbers: &[f64; BODYTRACK_NUMBERS]) -> Pose {
    let [x, y, z, right, left, up, ..] = *numbers;
    let rotation = about([0.0, 0.0, 1.0], z) * about([1.0, 0.0, 0.0], x) * about([0.0, 1.0, 0.0], y);
    let place = Translation3::new(0.001 * right, 0.001 * left, 0.001 * up);
    Pose {
        world_from_root: Isometry3::from_parts(place, rotation),
        joint_angles: DVector::from_column_slice(&numbers[ROOT..]),
    }
}

/// The numbers of a pose.
pub(super) fn numbers_of(pose: &Pose) -> [f64; BODYTRACK_NUMBERS] {
    let turn = pose.world_from_root.rotation.to_rotation_matrix();
    let at = |row: usize, column: usize| turn[(row, column)];
    let angles =
        [libm::asin(at(2, 1).clamp(-1.0, 1.0)), libm::atan2(-at(2, 0), at(2, 2)), libm::atan2(-at(0, 1), at(1, 1))];
    let place = pose.world_from_root.translation.vector * 1000.0;
    let mut numbers = [0.0; BODYTRACK_NUMBERS];
    let all = angles.iter().chain(place.iter()).chain(pose.joint_angles.iter());
    numbers.iter_mut().zip(all).for_each(|(number, found)| *number = *found);
    numbers
}

fn about(axis: [f64; 3], angle: f64) -> UnitQuaternion<f64> {
    rotation_about(&Unit::new_unchecked(Vector3::from(axis)), angle)
}

/// A fixed rotation about an axis by quarter turns.
fn quarters(axis: [f64; 3], quarters: f64) -> UnitQuaternion<f64> {
    about(axis, quarters * std::f64::consts::FRAC_PI_2)
}

fn along_z(metres: f64) -> Isometry3<f64> {
    Isometry3::translation(0.0, 0.0, metres)
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// Both sides of the body: index of the first number of leg and arm, offset of lengths, quarter turns from the thorax
/// to the clavicle, and the direction of the hip along the pelvis' y.
const SIDES: [(usize, usize, usize, f64, f64); 2] = [(6, 14, 0, -1.0, 1.0), (10, 20, RIGHT, 1.0, -1.0)];

fn humanoid(shape: &BodytrackShape) -> Humanoid {
    let lengths = &shape.lengths;
    let mut tree = HingeTree::new();
    let thorax = tree.joint(0, along_z(0.0) * quarters(X, 2.0), &[(Y, 26), (Z, 27)]);
    let neck = along_z(-lengths[TORSO]);
    for (side, (leg, arm, right, turn, sign)) in SIDES.into_iter().enumerate() {
        let of_side = |markers: [Landmark; 2]| markers[side];
        let length = |index: usize| lengths[index + right];
        let hip = quarters(Y, 2.0) * Translation3::new(0.0, sign * length(HIP), 0.0);
        let thigh = tree.joint(0, hip, &[(Y, leg + 1), (X, leg), (Z, leg + 2)]);
        let shank = tree.joint(thigh, along_z(length(THIGH)), &[(Y, leg + 3)]);
        tree.mark(of_side([Landmark::LeftHip, Landmark::RightHip]), thigh, 0.0);
        tree.mark(of_side([Landmark::LeftKnee, Landmark::RightKnee]), shank, 0.0);
        tree.mark(of_side([Landmark::LeftAnkle, Landmark::RightAnkle]), shank, length(SHANK));
        let clavicle = tree.joint(thorax, neck * quarters(X, turn), &[(Y, arm + 1), (X, arm)]);
        let shoulder = along_z(-length(CLAVICLE)) * (quarters(X, -1.0) * quarters(Z, 2.0) * quarters(Y, -1.0));
        let upper_arm = tree.joint(clavicle, shoulder, &[(Y, arm + 3), (X, arm + 2), (Z, arm + 4)]);
        let forearm = tree.joint(upper_arm, along_z(-length(UPPER_ARM)), &[(Y, arm + 5)]);
        tree.mark(of_side([Landmark::LeftShoulder, Landmark::RightShoulder]), upper_arm, 0.0);
        tree.mark(of_side([Landmark::LeftElbow, Landmark::RightElbow]), forearm, 0.0);
        tree.mark(of_side([Landmark::LeftWrist, Landmark::RightWrist]), forearm, -length(FOREARM));
    }
    let head = tree.joint(thorax, neck * quarters(X, 2.0), &[(Y, 29), (X, 28), (Z, 30)]);
    tree.mark(Landmark::Pelvis, 0, 0.0);
    tree.mark(Landmark::Thorax, thorax, -lengths[TORSO]);
    tree.mark(Landmark::HeadTop, head, lengths[HEAD]);
    tree.0
}

/// A body without geometry, while it is built.
struct HingeTree(Humanoid);

impl HingeTree {
    fn new() -> Self {
        let limited = |index: usize| {
            let bend = BENDS.iter().find(|(number, _)| *number == index);
            let [lower, upper] = bend.map_or([-180.0, 180.0], |(_, limits)| *limits).map(f64::to_radians);
            DegreeOfFreedom {
                name: format!("number{index}"),
                lower,
                upper,
                max_velocity: f64::INFINITY,
                max_effort: f64::INFINITY,
            }
        };
        Self(Humanoid {
            name: "bodytrack".to_owned(),
            links: vec![link("link0".to_owned())],
            joints: Vec::new(),
            degrees_of_freedom: (ROOT..BODYTRACK_NUMBERS).map(limited).collect(),
            markers: [None; LANDMARKS.len()],
            skin: None,
            notes: Vec::new(),
        })
    }

    /// Adds the hinges of a joint, each with its axis and its number of a pose, and returns the link that they move.
    fn joint(&mut self, parent: usize, parent_from_joint: Isometry3<f64>, hinges: &[([f64; 3], usize)]) -> usize {
        let mut at = (parent, parent_from_joint);
        for (axis, number) in hinges {
            let drive = Drive { degree_of_freedom: number - ROOT, multiplier: -1.0, offset: 0.0 };
            let kind = JointKind::Revolute { axis: Unit::new_unchecked(Vector3::from(*axis)), drive };
            let (parent, parent_from_joint) = at;
            self.0.joints.push(Joint { name: format!("joint{number}"), parent, parent_from_joint, kind });
            at = (self.0.links.len(), Isometry3::identity());
            self.0.links.push(link(format!("link{number}")));
        }
        at.0
    }

    /// Puts a marker on a link's z axis.
    fn mark(&mut self, landmark: Landmark, link: usize, z: f64) {
        self.0.markers[landmark as usize] = Some(LinkPoint { link, point_in_link: Point3::new(0.0, 0.0, z) });
    }
}

fn link(name: String) -> Link {
    Link { name, solids: Vec::new(), inertia: None }
}
