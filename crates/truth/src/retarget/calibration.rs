//! Constant rotations between the frames of recorded joints and of the body's links, one per segment.
//!
//! Formats choose the axes of joints freely, but a joint rotates with its segment, so one constant rotation per segment
//! suffices. It is averaged over poses fitted to positions only. Positions do not determine the twist of a head or hand
//! about its longitudinal axis: the average assumes that, over the clip, the subject looks ahead and does not twist its
//! hands. Feet are assumed flat when they are lowest.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::anatomy::{BodySegment, SEGMENTS, SubjectFrame};
use skiagraph_core::body::inverse_kinematics::OrientationGoal;
use skiagraph_core::body::{Humanoid, Landmark, LinkPoint, Pose, from_axes, rotation_from_vector, rotation_vector};

/// Share of the frames, those with ankle and ball of the foot lowest, in which the foot is assumed flat on the ground.
const FLAT_SHARE: f64 = 0.1;

/// Slopes from the ankle to the ball of a foot that may be flat, sines: from 50 degrees down to 10 degrees up.
const FLAT_SLOPES: std::ops::RangeInclusive<f64> = -0.77..=0.17;

/// A foot of a single pose that is tilted by less than this may be flat, radians: files differ in how high the ankle
/// is above the ball.
const MAY_BE_FLAT: f64 = 0.2;

/// Weight of one radian of a segment's orientation relative to landmark distances, metres.
fn metres_per_radian(segment: BodySegment) -> f64 {
    match segment {
        BodySegment::Pelvis | BodySegment::Thorax => 0.05,
        BodySegment::Head => 0.1,
        BodySegment::LeftHand | BodySegment::RightHand => 0.03,
        BodySegment::LeftFoot | BodySegment::RightFoot => 0.1,
        BodySegment::LeftToes | BodySegment::RightToes => 0.05,
    }
}

/// A marker this close to its link's origin is at the start of the link, as the ankle of a foot or the wrist of a hand,
/// metres.
const NEAR_LINK_ORIGIN: f64 = 0.1;

/// The link of a segment: by name, or by its marker.
fn link_of(humanoid: &Humanoid, segment: BodySegment) -> Option<usize> {
    let carrier = |landmark: Landmark| humanoid.markers[landmark as usize].map(|m| m.link);
    let end = |name: &str, landmark: Landmark| {
        let begins = |m: &LinkPoint| m.point_in_link.coords.norm() < NEAR_LINK_ORIGIN;
        let found = || humanoid.markers[landmark as usize].filter(begins).map(|m| m.link);
        humanoid.find_link(name).or_else(found)
    };
    match segment {
        BodySegment::Pelvis => carrier(Landmark::Pelvis),
        BodySegment::Thorax => carrier(Landmark::Thorax).filter(|link| Some(*link) != carrier(Landmark::Pelvis)),
        BodySegment::Head => carrier(Landmark::HeadTop),
        BodySegment::LeftHand => end("left_hand", Landmark::LeftWrist),
        BodySegment::RightHand => end("right_hand", Landmark::RightWrist),
        BodySegment::LeftFoot => end("left_foot", Landmark::LeftAnkle),
        BodySegment::RightFoot => end("right_foot", Landmark::RightAnkle),
        BodySegment::LeftToes => humanoid.find_link("left_toes"),
        BodySegment::RightToes => humanoid.find_link("right_toes"),
    }
}

/// A body segment that follows a joint of the recording.
#[derive(Clone, Copy, Debug)]
struct Follower {
    /// Index into [`SEGMENTS`].
    segment: usize,
    link: usize,
    joint_from_link: UnitQuaternion<f64>,
}

/// The segments whose orientation a recording contains, with their constant rotations.
#[derive(Clone, Debug)]
pub(super) struct SegmentCalibration(Vec<Follower>);

impl SegmentCalibration {
    /// Calibrates from poses fitted to positions only, for some frames of the subject.
    pub(super) fn new(humanoid: &Humanoid, subject: &[SubjectFrame], posed: &[(usize, Pose)]) -> Self {
        let rest = humanoid.body_from_links();
        let follow = |(segment, part): (usize, &BodySegment)| {
            let link = link_of(humanoid, *part)?;
            let side = usize::from(matches!(part, BodySegment::RightFoot | BodySegment::RightToes));
            let joint_from_link = match part {
                BodySegment::LeftFoot | BodySegment::RightFoot | BodySegment::LeftToes | BodySegment::RightToes => {
                    let flat = flat_foot(humanoid, subject, segment, side, &rest[link]);
                    if flat.is_empty() {
                        mean_rotation(&posed_offsets(humanoid, subject, posed, segment, link))
                    } else {
                        mean_rotation(&flat)
                    }
                }
                _ => mean_rotation(&posed_offsets(humanoid, subject, posed, segment, link)),
            }?;
            Some(Follower { segment, link, joint_from_link })
        };
        Self(SEGMENTS.iter().enumerate().filter_map(follow).collect())
    }

    /// Orientation goals of the segments at one frame.
    pub(super) fn goals(&self, frame: &SubjectFrame) -> Vec<OrientationGoal> {
        let goal = |follower: &Follower| {
            Some(OrientationGoal {
                link: follower.link,
                world_from_link: frame.rotations[follower.segment]? * follower.joint_from_link,
                metres_per_radian: metres_per_radian(SEGMENTS[follower.segment]),
            })
        };
        self.0.iter().filter_map(goal).collect()
    }
}

/// `joint_from_link` in every posed frame.
fn posed_offsets(
    humanoid: &Humanoid,
    subject: &[SubjectFrame],
    posed: &[(usize, Pose)],
    segment: usize,
    link: usize,
) -> Vec<UnitQuaternion<f64>> {
    let offset = |(frame, pose): &(usize, Pose)| {
        Some(subject[*frame].rotations[segment]?.inverse() * humanoid.link_frames(pose)[link].rotation)
    };
    posed.iter().filter_map(offset).collect()
}

/// `joint_from_foot` in frames with a flat foot, assumed oriented as at the body's zero pose (`rest`): X horizontal
/// along the foot, Z up; none if no low foot can be flat. In a single pose, the way from ankle to ball of a foot that
/// is clearly tilted is that of the body's own foot.
fn flat_foot(
    humanoid: &Humanoid,
    subject: &[SubjectFrame],
    segment: usize,
    side: usize,
    rest: &UnitQuaternion<f64>,
) -> Vec<UnitQuaternion<f64>> {
    let ankle = [Landmark::LeftAnkle, Landmark::RightAnkle][side] as usize;
    let own = own_slope(humanoid, side);
    let is_still = subject.windows(2).all(|pair| pair[0].markers == pair[1].markers);
    let mut feet: Vec<(f64, Option<UnitQuaternion<f64>>)> = subject
        .iter()
        .filter_map(|frame| {
            let (ankle, ball) = (frame.markers[ankle]?, frame.toes[side]?);
            let mut foot = heading(&ankle, &ball)?;
            let slope = slope(&ankle, &ball);
            // of one pose nothing tells which foot is flat
            let tilt = if is_still { own? - slope } else { 0.0 };
            if tilt.abs() > MAY_BE_FLAT {
                foot *= UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt);
            }
            // a body in the air or lying has no flat foot, however low
            let is_known = is_still || FLAT_SLOPES.contains(&libm::sin(slope));
            let offset = frame.rotations[segment]?.inverse() * foot * rest;
            Some((ankle.z + ball.z, is_known.then_some(offset)))
        })
        .collect();
    feet.sort_by(|a, b| a.0.total_cmp(&b.0));
    let count = ((feet.len() as f64 * FLAT_SHARE) as usize).max(1);
    feet.into_iter().take(count).filter_map(|(_, offset)| offset).collect()
}

/// Slope of a body's own foot at its zero pose, where it is flat; `None` without toes.
fn own_slope(humanoid: &Humanoid, side: usize) -> Option<f64> {
    let frames = humanoid.link_frames(&humanoid.standing_pose());
    let toes = humanoid.find_link(["left_toes", "right_toes"][side])?;
    let ankle = humanoid.markers(&frames)[[Landmark::LeftAnkle, Landmark::RightAnkle][side] as usize]?;
    Some(slope(&ankle, &Point3::from(frames[toes].translation.vector)))
}

/// Angle from the horizontal up to the way from one position to another, radians.
fn slope(from: &Point3<f64>, to: &Point3<f64>) -> f64 {
    libm::asin(((to.z - from.z) / (to - from).norm().max(1e-9)).clamp(-1.0, 1.0))
}

/// Upright frame whose X is the horizontal direction from one position to another; `None` if one is above the other.
fn heading(from: &Point3<f64>, to: &Point3<f64>) -> Option<UnitQuaternion<f64>> {
    let ahead = Vector3::new(to.x - from.x, to.y - from.y, 0.0).try_normalize(1e-6)?;
    Some(from_axes(ahead, Vector3::z().cross(&ahead)))
}

/// The rotation with the least sum of squared angles to the given ones (`[Moakher 2002]`), by fixed-point iteration.
fn mean_rotation(rotations: &[UnitQuaternion<f64>]) -> Option<UnitQuaternion<f64>> {
    let mut mean = *rotations.get(rotations.len() / 2)?;
    for _ in 0..20 {
        let sum: Vector3<f64> = rotations.iter().map(|r| rotation_vector(&(mean.inverse() * r))).sum();
        mean *= rotation_from_vector(&(sum / rotations.len() as f64));
    }
    Some(mean)
}
