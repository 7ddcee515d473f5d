//! Starting points for recovering a lost limb: earlier estimates of the body and their mirror images.

use nalgebra::{Point3, Vector3};

use skiagraph_core::body::{Humanoid, LANDMARKS, Landmark, LinkFrames, LinkPoint, Pose, ROOT_STEP};

const CAPACITY: usize = 64;
/// Tolerance between mirrored twists, as a share of their size: bodies are symmetric up to rounding in their files.
const TWIST_TOLERANCE: f64 = 0.1;

/// Tolerance below which two twists have the same axis, as a share of their size.
const AXIS_TOLERANCE: f64 = 1e-6;

/// Earlier estimates of a filter, evenly spaced over its frames: the start, then every `stride`-th estimate. The stride
/// doubles when more than [`CAPACITY`] poses would be kept.
#[derive(Debug)]
pub(super) struct PoseMemory {
    poses: Vec<Pose>,
    seen: usize,
    stride: usize,
}

impl PoseMemory {
    pub(super) fn new(start: &Pose) -> Self {
        Self { poses: vec![start.clone()], seen: 1, stride: 1 }
    }

    /// Stores the estimate if it falls on the stride.
    pub(super) fn remember(&mut self, estimate: &Pose) {
        if self.seen.is_multiple_of(self.stride) {
            self.poses.push(estimate.clone());
        }
        self.seen += 1;
        if self.poses.len() > CAPACITY {
            let mut index = 0;
            self.poses.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.stride *= 2;
        }
    }

    /// The poses, oldest first; never empty.
    pub(super) fn poses(&self) -> &[Pose] {
        &self.poses
    }
}

/// For each joint angle, the angle on the other side that moves its limb as the mirror image.
#[derive(Debug)]
pub(super) struct MirroredAngles(Vec<Option<MirroredAngle>>);

#[derive(Clone, Copy, Debug)]
struct MirroredAngle {
    number: usize,
    /// 1 or -1: whether equal or opposite angles are mirror images.
    sign: f64,
}

impl MirroredAngles {
    /// Found from how the angles move the ends of the limbs in the zero pose, not from their names. Angles of an
    /// asymmetric body have no counterpart.
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

    /// Angle `number` of the mirror image of a pose, or of the pose itself if the angle has no counterpart.
    pub(super) fn angle(&self, pose: &Pose, number: usize) -> f64 {
        match self.0[number] {
            Some(MirroredAngle { number, sign }) => sign * pose.joint_angles[number],
            None => pose.joint_angles[number],
        }
    }
}

/// The ends of the arms and legs, left and right.
pub(super) const LEFT_AND_RIGHT_ENDS: [[Landmark; 2]; 2] =
    [[Landmark::LeftWrist, Landmark::RightWrist], [Landmark::LeftAnkle, Landmark::RightAnkle]];

pub(super) fn landmark_point(body: &Humanoid, landmark: Landmark) -> Option<LinkPoint> {
    let index = LANDMARKS.iter().position(|l| *l == landmark)?;
    body.markers[index]
}

/// Velocity and rotation of a limb's end per unit of an angle.
type Twist = [Vector3<f64>; 2];

/// The twist of every angle that moves a point, about that point.
fn twists(body: &Humanoid, frames: &LinkFrames, end: &LinkPoint) -> Vec<(usize, Twist)> {
    let about: Point3<f64> = frames[end.link] * end.point_in_link;
    let mut twists = Vec::new();
    body.step_twists(frames, end.link, &about, &mut twists);
    twists.into_iter().filter_map(|(index, twist)| Some((index.checked_sub(ROOT_STEP)?, twist))).collect()
}

/// The one of `others` that is the mirror image of `twist` in the plane y = 0, and its sign.
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
    // the shoulder and the forearm of a straight arm rotate about the same axis: such angles are paired in order from
    // the end
    let first = signed.iter().find(|(_, _, distance)| *distance <= least + AXIS_TOLERANCE * size)?;
    (first.2 <= TWIST_TOLERANCE * size).then_some((first.0, first.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::fixture::March;
    use skiagraph_core::body::shipped;

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
            assert!(memory.poses().len() <= CAPACITY);
        }
        let frames: Vec<f64> = memory.poses().iter().map(|pose| pose.world_from_root.translation.x).collect();
        assert_eq!(frames[..3], [0.0, 16.0, 32.0]);
        assert!(frames.windows(2).all(|pair| pair[1] - pair[0] == 16.0) && *frames.last().unwrap() > 980.0);
    }

    /// Compares mirroring by angles with mirroring of joint positions.
    #[test]
    fn mirrored_poses_have_mirrored_joint_positions_for_all_shipped_bodies() {
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
            for [left, right] in [
                [Landmark::LeftWrist, Landmark::RightWrist],
                [Landmark::LeftElbow, Landmark::RightElbow],
                [Landmark::LeftKnee, Landmark::RightKnee],
                [Landmark::LeftAnkle, Landmark::RightAnkle],
            ] {
                for (here, there) in [(left, right), (right, left)] {
                    let (here, there) = (of[here as usize].unwrap(), image[there as usize].unwrap());
                    let expected = Point3::new(here.x, -here.y, here.z);
                    assert!((there - expected).norm() < 1e-3, "{robot}: {there}, expected {expected}");
                }
            }
        }
    }

    #[test]
    fn angles_without_a_mirrored_limb_are_unchanged() {
        let mut body = shipped("tracker25").unwrap();
        body.markers[Landmark::RightWrist as usize] = None;
        let mirror = MirroredAngles::of_body(&body);
        let mut pose = body.zero_pose();
        let elbow = body.find_degree_of_freedom("left_elbow_flexion").unwrap();
        pose.joint_angles[elbow] = 0.5;
        assert_eq!(mirror.angle(&pose, elbow), 0.5);
    }
}
