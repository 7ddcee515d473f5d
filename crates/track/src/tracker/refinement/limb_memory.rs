//! Where a lost limb is looked for first: poses that the body had before, its own and those of its other side.

use nalgebra::{Point3, Vector3};

use crate::body::{Humanoid, LANDMARKS, Landmark, LinkFrames, LinkPoint, Pose, ROOT_STEP};

/// Most poses that are kept.
const KEPT: usize = 64;
/// How far two mirrored twists may differ, as a share of their size: bodies are symmetric, files are rounded.
const SAME_TWIST: f64 = 0.1;

/// Twists that differ by less, as a share of their size, are about one axis.
const SAME_AXIS: f64 = 1e-6;

/// Poses of a filter so far, spread evenly over its frames: the start, then every `stride`-th estimate. The stride
/// doubles whenever there would be more than [`KEPT`].
#[derive(Debug)]
pub(super) struct PoseMemory {
    poses: Vec<Pose>,
    seen: usize,
    stride: usize,
}

impl PoseMemory {
    /// The memory of a filter that was just started.
    pub(super) fn new(start: &Pose) -> Self {
        Self { poses: vec![start.clone()], seen: 1, stride: 1 }
    }

    /// Keeps the next estimate, if it is its turn.
    pub(super) fn remember(&mut self, estimate: &Pose) {
        if self.seen.is_multiple_of(self.stride) {
            self.poses.push(estimate.clone());
        }
        self.seen += 1;
        if self.poses.len() > KEPT {
            let mut index = 0;
            self.poses.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.stride *= 2;
        }
    }

    /// The poses, oldest first; never none.
    pub(super) fn poses(&self) -> &[Pose] {
        &self.poses
    }
}

/// Which joint angle of the other side moves its limb as an angle moves this side's, seen in a mirror.
#[derive(Debug)]
pub(super) struct MirroredAngles(Vec<Option<MirroredAngle>>);

#[derive(Clone, Copy, Debug)]
struct MirroredAngle {
    number: usize,
    /// 1 or -1: whether equal or opposite angles are mirror images.
    sign: f64,
}

impl MirroredAngles {
    /// Found by how the angles move the ends of the limbs of the body at its zero pose, not by their names. Angles of a
    /// body that is not symmetric have no counterpart.
    pub(super) fn of_body(body: &Humanoid) -> Self {
        let frames = body.link_frames(&body.zero_pose());
        let mut counterparts = vec![None; body.degrees_of_freedom.len()];
        for ends in LEFT_AND_RIGHT_ENDS {
            let [Some(left), Some(right)] = ends.map(|end| landmark_point(body, end)) else { continue };
            let [left, mut right] = [left, right].map(|end| twists(body, &frames, &end));
            for (number, twist) in &left {
                let Some((other, sign)) = counterpart(twist, &right) else { continue };
                right.retain(|(taken, _)| *taken != other);
                counterparts[*number] = Some(MirroredAngle { number: other, sign });
                counterparts[other] = Some(MirroredAngle { number: *number, sign });
            }
        }
        Self(counterparts)
    }

    /// Angle `number` of the mirror image of a pose; of the pose itself where the angle has no counterpart.
    pub(super) fn angle(&self, pose: &Pose, number: usize) -> f64 {
        match self.0[number] {
            Some(MirroredAngle { number, sign }) => sign * pose.joint_angles[number],
            None => pose.joint_angles[number],
        }
    }
}

/// The ends of the arms and of the legs, left and right.
pub(super) const LEFT_AND_RIGHT_ENDS: [[Landmark; 2]; 2] =
    [[Landmark::LeftWrist, Landmark::RightWrist], [Landmark::LeftAnkle, Landmark::RightAnkle]];

/// Where a landmark is on a body; `None` where it has none.
pub(super) fn landmark_point(body: &Humanoid, landmark: Landmark) -> Option<LinkPoint> {
    let index = LANDMARKS.iter().position(|l| *l == landmark)?;
    body.markers[index]
}

/// How a unit of an angle moves the end of a limb: velocity and turn.
type Twist = [Vector3<f64>; 2];

/// The twist of every angle that moves a point, about that point.
fn twists(body: &Humanoid, frames: &LinkFrames, end: &LinkPoint) -> Vec<(usize, Twist)> {
    let about: Point3<f64> = frames[end.link] * end.point_in_link;
    let mut twists = Vec::new();
    body.step_twists(frames, end.link, &about, &mut twists);
    twists.into_iter().filter_map(|(index, twist)| Some((index.checked_sub(ROOT_STEP)?, twist))).collect()
}

/// The one of `others` that is the mirror image of `twist` in the plane y = 0, with its sign.
fn counterpart([velocity, turn]: &Twist, others: &[(usize, Twist)]) -> Option<(usize, f64)> {
    let velocity = Vector3::new(velocity.x, -velocity.y, velocity.z);
    // an axis of rotation is a pseudovector
    let turn = Vector3::new(-turn.x, turn.y, -turn.z);
    let size = (velocity.norm_squared() + turn.norm_squared()).sqrt();
    let apart =
        |[v, w]: &Twist, sign: f64| ((sign * velocity - v).norm_squared() + (sign * turn - w).norm_squared()).sqrt();
    let signed = others.iter().flat_map(|(number, other)| [1.0, -1.0].map(|sign| (*number, sign, apart(other, sign))));
    let signed: Vec<(usize, f64, f64)> = signed.collect();
    let least = signed.iter().map(|(_, _, distance)| *distance).fold(f64::INFINITY, f64::min);
    // a straight arm turns alike about its shoulder and its forearm: these are paired in their order from the end
    let first = signed.iter().find(|(_, _, distance)| *distance <= least + SAME_AXIS * size)?;
    (first.2 <= SAME_TWIST * size).then_some((first.0, first.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;
    use crate::tracker::fixture::March;

    #[test]
    fn the_memory_spans_all_frames_evenly_and_stays_small() {
        let body = shipped("tracker25").unwrap();
        let at = |frame: usize| {
            let mut pose = body.zero_pose();
            pose.world_from_root.translation.vector.x = frame as f64;
            pose
        };
        let mut memory = PoseMemory::new(&at(0));
        for frame in 1..1000 {
            memory.remember(&at(frame));
            assert!(memory.poses().len() <= KEPT);
        }
        let frames: Vec<f64> = memory.poses().iter().map(|pose| pose.world_from_root.translation.x).collect();
        assert_eq!(frames[..3], [0.0, 16.0, 32.0]);
        assert!(frames.windows(2).all(|pair| pair[1] - pair[0] == 16.0) && *frames.last().unwrap() > 980.0);
    }

    /// Mirrored by angles and mirrored by where the joints are: two roads to one pose.
    #[test]
    fn a_pose_in_the_mirror_has_its_joints_on_the_other_side_on_every_body_that_ships() {
        for robot in ["tracker25", "tracker40", "actor"] {
            let body = shipped(robot).unwrap();
            let mut pose =
                March { cycle: 60, advance: 0.0, hip: 0.2, knee: 0.6, abduction: 0.3, elbow: 0.7 }.pose(&body, 10);
            for side in ["left", "right"] {
                let number = body.find_degree_of_freedom(&format!("{side}_shoulder_rotation")).unwrap();
                pose.joint_angles[number] = if side == "left" { 0.4 } else { -0.1 };
            }
            let mirror = MirroredAngles::of_body(&body);
            let mut mirrored = pose.clone();
            for number in 0..body.degrees_of_freedom.len() {
                mirrored.joint_angles[number] = mirror.angle(&pose, number);
            }
            let [of, image] = [&pose, &mirrored].map(|pose| body.markers(&body.link_frames(pose)));
            let at = |landmark| LANDMARKS.iter().position(|l| *l == landmark).unwrap();
            for [left, right] in [
                [Landmark::LeftWrist, Landmark::RightWrist],
                [Landmark::LeftElbow, Landmark::RightElbow],
                [Landmark::LeftKnee, Landmark::RightKnee],
                [Landmark::LeftAnkle, Landmark::RightAnkle],
            ] {
                for (here, there) in [(left, right), (right, left)] {
                    let (here, there) = (of[at(here)].unwrap(), image[at(there)].unwrap());
                    let expected = Point3::new(here.x, -here.y, here.z);
                    assert!((there - expected).norm() < 1e-3, "{robot}: {there}, expected {expected}");
                }
            }
        }
    }

    #[test]
    fn angles_of_a_limb_that_has_no_like_on_the_other_side_are_left_as_they_are() {
        let mut body = shipped("tracker25").unwrap();
        let marker = LANDMARKS.iter().position(|l| *l == Landmark::RightWrist).unwrap();
        body.markers[marker] = None;
        let mirror = MirroredAngles::of_body(&body);
        let mut pose = body.zero_pose();
        let elbow = body.find_degree_of_freedom("left_elbow_flexion").unwrap();
        pose.joint_angles[elbow] = 0.5;
        assert_eq!(mirror.angle(&pose, elbow), 0.5);
    }
}
