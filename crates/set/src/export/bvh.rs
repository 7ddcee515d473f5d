//! BVH: the actor's links as rotating joints, centimetres, Y up.
//!
//! BVH has no rest rotations. The rest pose is the zero pose, in which the axes of every joint are those of the world.
//! A joint's rotation is that of its link since the zero pose, relative to its parent's.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::folder::{Folder, unique_file_names};
use crate::{BenchmarkSet, SetError};
use skiagraph_core::body::{Humanoid, JointKind, LANDMARKS, Landmark, LinkFrames};

const README: &str = "\
actor.bvh   every link of the actor as a joint (end sites are the middle of the last link's geometry); centimetres, degrees;
            Y is up, the body faces +Z at rest, its left is +X: x = the set's y, y = its z, z = its x. Rotations are in the
            order Zrotation Xrotation Yrotation, each about the axes that the one before has turned. The rest pose is the
            zero pose of the robot. Joints without any freedom are kept, with rotations of 0. Characters of names other than
            letters, digits, - _ and . are _; a name that is then empty or taken ends in _link and the link's number. HumanEva's markers are joints
            marker_NAME at the ends of the links that carry them, which never turn.";

/// Length of the end sites of markers, which are points, metres.
const MARKER_END_M: f64 = 0.01;
/// Length of the end sites of links with geometry at their origin, metres.
const SHORT_END_M: f64 = 0.05;

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    let truth = &set.truth.ground_truth;
    let slides = |kind: &JointKind| matches!(kind, JointKind::Prismatic { .. } | JointKind::Floating { .. });
    if let Some(joint) = truth.actor.joints.iter().find(|joint| slides(&joint.kind)) {
        let detail =
            format!("joint {:?} of the actor slides, but joints of a BVH file only rotate; use npz", joint.name);
        return Err(SetError::malformed("bvh", detail));
    }
    folder.readme(&set.blind, README)?;
    let frames = truth.frames.iter().map(|frame| &frame.link_frames);
    // Y up, by a cyclic permutation, which keeps right-handedness
    let y_up = Matrix3::from_rows(&[Vector3::y().transpose(), Vector3::z().transpose(), Vector3::x().transpose()]);
    folder.write("actor.bvh", bvh_text(&truth.actor, truth.frames_per_second, frames, y_up).as_bytes())
}

/// A motion of a body as the text of a BVH file, centimetres: `frames` has the frames of its links, and `file_from_set`
/// turns the set's axes, Z up, into the file's.
pub fn bvh_text<'a>(
    body: &Humanoid,
    frames_per_second: f64,
    frames: impl ExactSizeIterator<Item = &'a LinkFrames>,
    file_from_set: Matrix3<f64>,
) -> String {
    let skeleton = BvhSkeleton::new(body, file_from_set);
    let mut text = String::from("HIERARCHY\n");
    skeleton.push(&mut text, 0, 0);
    let (count, period) = (frames.len(), 1.0 / frames_per_second);
    text += &format!("MOTION\nFrames: {count}\nFrame Time: {period:.9}\n");
    for link_frames in frames {
        skeleton.push_frame(&mut text, link_frames);
    }
    text
}

struct BvhSkeleton<'a> {
    actor: &'a Humanoid,
    file_from_set: Matrix3<f64>,
    /// The joints' names, by link.
    names: Vec<String>,
    rest: LinkFrames,
    children: Vec<Vec<usize>>,
    /// Links in depth-first order.
    order: Vec<usize>,
    /// Name, link and position of the markers, from the link's origin at rest in the set's axes, metres.
    markers: Vec<(String, usize, Vector3<f64>)>,
}

impl<'a> BvhSkeleton<'a> {
    fn new(actor: &'a Humanoid, file_from_set: Matrix3<f64>) -> Self {
        let mut children = vec![Vec::new(); actor.links.len()];
        for link in 1..actor.links.len() {
            children[actor.joints[link - 1].parent].push(link);
        }
        let (mut order, mut open) = (Vec::new(), vec![0]);
        while let Some(link) = open.pop() {
            order.push(link);
            open.extend(children[link].iter().rev());
        }
        let rest = actor.link_frames(&actor.zero_pose());
        // a marker is left out if a link has its name
        let names = unique_file_names(actor.links.iter().map(|link| &link.name), "link");
        let marker = |(index, landmark): (usize, &Landmark)| {
            let at = actor.markers[index]?;
            let name = format!("marker_{}", landmark.name());
            (!names.contains(&name)).then(|| (name, at.link, rest[at.link].rotation * at.point_in_link.coords))
        };
        let markers = LANDMARKS.iter().enumerate().filter_map(marker).collect();
        Self { actor, file_from_set, names, rest, children, order, markers }
    }

    fn markers_of(&self, link: usize) -> impl Iterator<Item = &(String, usize, Vector3<f64>)> {
        self.markers.iter().filter(move |(_, carrier, _)| *carrier == link)
    }

    /// Offset of a link's origin from its parent's, at rest, metres.
    fn offset(&self, link: usize) -> Vector3<f64> {
        let place = |link: usize| self.rest[link].translation.vector;
        match link.checked_sub(1) {
            None => Vector3::zeros(),
            Some(joint) => place(link) - place(self.actor.joints[joint].parent),
        }
    }

    fn push(&self, text: &mut String, link: usize, depth: usize) {
        let indent = "\t".repeat(depth);
        let name = &self.names[link];
        let (kind, channels) = match link {
            0 => ("ROOT", "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"),
            _ => ("JOINT", "3 Zrotation Xrotation Yrotation"),
        };
        let offset = |v: Vector3<f64>| {
            let v = self.file_from_set * v * 100.0;
            format!("{:.6} {:.6} {:.6}", v.x, v.y, v.z)
        };
        writeln!(text, "{indent}{kind} {name}\n{indent}{{").ok();
        writeln!(text, "{indent}\tOFFSET {}\n{indent}\tCHANNELS {channels}", offset(self.offset(link))).ok();
        for (name, _, at) in self.markers_of(link) {
            writeln!(text, "{indent}\tJOINT {name}\n{indent}\t{{\n{indent}\t\tOFFSET {}", offset(*at)).ok();
            writeln!(text, "{indent}\t\tCHANNELS 3 Zrotation Xrotation Yrotation").ok();
            let end = Vector3::z() * MARKER_END_M;
            writeln!(text, "{indent}\t\tEnd Site\n{indent}\t\t{{\n{indent}\t\t\tOFFSET {}", offset(end)).ok();
            writeln!(text, "{indent}\t\t}}\n{indent}\t}}").ok();
        }
        for child in &self.children[link] {
            self.push(text, *child, depth + 1);
        }
        if self.children[link].is_empty() {
            let middle = self.actor.links[link].solids.iter().find_map(|solid| solid.middle());
            let end = middle.map(|middle| middle.coords).filter(|middle| middle.norm() > 1e-3);
            let end = self.rest[link].rotation * end.unwrap_or(Vector3::z() * SHORT_END_M);
            writeln!(text, "{indent}\tEnd Site\n{indent}\t{{\n{indent}\t\tOFFSET {}\n{indent}\t}}", offset(end)).ok();
        }
        writeln!(text, "{indent}}}").ok();
    }

    fn push_frame(&self, text: &mut String, frames: &LinkFrames) {
        let root = self.file_from_set * frames[0].translation.vector * 100.0;
        write!(text, "{:.6} {:.6} {:.6}", root.x, root.y, root.z).ok();
        let turned = |link: usize| frames[link].rotation * self.rest[link].rotation.inverse();
        for link in &self.order {
            let local = match link.checked_sub(1) {
                None => turned(0),
                Some(joint) => turned(self.actor.joints[joint].parent).inverse() * turned(*link),
            };
            let [z, x, y] = euler_zxy(&local, &self.file_from_set);
            write!(text, " {z:.6} {x:.6} {y:.6}").ok();
            self.markers_of(*link).for_each(|_| text.push_str(" 0 0 0"));
        }
        text.push('\n');
    }
}

/// Intrinsic rotations about Z, X and Y, degrees, in the axes of the file.
fn euler_zxy(rotation: &UnitQuaternion<f64>, file_from_set: &Matrix3<f64>) -> [f64; 3] {
    let turned: Rotation3<f64> = rotation.to_rotation_matrix();
    let r = file_from_set * turned.matrix() * file_from_set.transpose();
    let x = r[(2, 1)].clamp(-1.0, 1.0);
    let [z, y] = if x.abs() < 1.0 - 1e-12 {
        [libm::atan2(-r[(0, 1)], r[(1, 1)]), libm::atan2(-r[(2, 0)], r[(2, 2)])]
    } else {
        // gimbal lock: the first and the last rotation have the same axis, and the first gets all of it
        [libm::atan2(r[(1, 0)], r[(0, 0)]), 0.0]
    };
    [z, libm::asin(x), y].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn euler_angles_turn_back_into_the_rotation() {
        let about = |axis: Vector3<f64>, degrees: f64| {
            UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_unchecked(axis), degrees.to_radians())
        };
        for (a, b, c) in [(0.3, -0.7, 2.9), (-2.0, 1.1, 0.4), (0.5, std::f64::consts::FRAC_PI_2, 0.0)] {
            let rotation = UnitQuaternion::from_euler_angles(a, b, c);
            let [z, x, y] = euler_zxy(&rotation, &Matrix3::identity());
            let back = about(Vector3::z(), z) * about(Vector3::x(), x) * about(Vector3::y(), y);
            assert!(rotation.angle_to(&back) < 1e-7, "{a} {b} {c}: {}", rotation.angle_to(&back));
        }
    }
}
