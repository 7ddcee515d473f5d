//! One frame of planting: the pose nearest to the recorded one with held links at their targets.

use nalgebra::{Point3, Vector3};

use skiagraph_core::body::inverse_kinematics::{AngleGoal, Goals, OrientationGoal, PointGoal, Solver};
use skiagraph_core::body::{Humanoid, LinkFrames, LinkPoint, Pose};

/// Greatest change of any angle from the recorded motion, radians (metres if prismatic).
pub(super) const GREATEST_CHANGE: f64 = 0.35;
/// Weight of held links relative to that of the root's recorded position.
const HELD_WEIGHT: f64 = 30.0;
const ROOT_WEIGHT: f64 = 1.0;
/// Weight of one radian of the root's rotation, metres: the distance of the head, which swings with the root.
const UPRIGHT: f64 = 0.7;
/// Weight of one radian of an angle's change, metres.
const ANGLE_WEIGHT: f64 = 0.1;
/// Position and orientation of a link are held at its origin and at points at this distance along its axes, metres.
const ARM: f64 = 0.1;
const MAX_ITERATIONS: usize = 20;

/// A recorded frame to be changed.
pub(super) struct Recorded<'a> {
    pub(super) body: &'a Humanoid,
    pub(super) pose: &'a Pose,
    pub(super) frames: &'a LinkFrames,
}

/// A link held at a shifted position.
pub(super) struct Held<'a> {
    pub(super) link: usize,
    pub(super) by: Hold,
    /// The link frames before the shift.
    pub(super) frames: &'a LinkFrames,
    /// Shift, world, metres.
    pub(super) shift: Vector3<f64>,
    /// Relative weight, 0 to 1.
    pub(super) firmness: f64,
}

/// The held part of a link's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Hold {
    /// Position and orientation.
    Whole,
    /// A point in its frame, metres; rotation about it is free.
    Point(Point3<f64>),
}

impl Recorded<'_> {
    /// The pose that holds these links, near the recorded one in its root and its angles; no angle changes by more
    /// than [`GREATEST_CHANGE`]. The search begins at `start`.
    pub(super) fn placed<'a>(&self, held: impl Iterator<Item = Held<'a>>, start: &Pose) -> Pose {
        let mut points = vec![stay_at(self.frames, 0, Vector3::zeros(), ROOT_WEIGHT, &Vector3::zeros())];
        points.extend(held.flat_map(|held| held.goals()));
        let upright = OrientationGoal { link: 0, world_from_link: self.frames[0].rotation, metres_per_radian: UPRIGHT };
        let stay = |&target: &f64| AngleGoal { target, metres_per_unit: ANGLE_WEIGHT };
        let angles = self.pose.joint_angles.iter().map(stay).collect();
        let goals = Goals { points, orientations: vec![upright], angles, ..Goals::default() };
        Solver::new(&bounded(self.body, self.pose)).solve(&goals, start, MAX_ITERATIONS).pose
    }
}

impl Held<'_> {
    fn goals(&self) -> Vec<PointGoal> {
        let weight = HELD_WEIGHT * self.firmness;
        match self.by {
            Hold::Whole => hold(self.frames, self.link, weight, &self.shift).to_vec(),
            Hold::Point(point) => vec![stay_at(self.frames, self.link, point.coords, weight, &self.shift)],
        }
    }
}

/// Goals that hold a link at its position plus a shift.
pub(crate) fn hold(frames: &LinkFrames, link: usize, weight: f64, shift: &Vector3<f64>) -> [PointGoal; 3] {
    let places = [Vector3::zeros(), Vector3::x() * ARM, Vector3::y() * ARM];
    places.map(|place| stay_at(frames, link, place, weight, shift))
}

/// A goal that holds a point of a link at its position plus a shift.
fn stay_at(frames: &LinkFrames, link: usize, place: Vector3<f64>, weight: f64, shift: &Vector3<f64>) -> PointGoal {
    let point_in_link = Point3::from(place);
    PointGoal { on: LinkPoint { link, point_in_link }, target: frames[link] * point_in_link + shift, weight }
}

/// The body without geometry, with limits narrowed to the allowed change of `pose`.
fn bounded(body: &Humanoid, pose: &Pose) -> Humanoid {
    let mut bounded = Humanoid { markers: body.markers, notes: Vec::new(), ..body.clone() };
    bounded.links.iter_mut().for_each(|link| link.solids.clear());
    for (limits, angle) in bounded.degrees_of_freedom.iter_mut().zip(pose.joint_angles.iter()) {
        let angle = angle.max(limits.lower).min(limits.upper);
        limits.lower = limits.lower.max(angle - GREATEST_CHANGE);
        limits.upper = limits.upper.min(angle + GREATEST_CHANGE);
    }
    bounded
}
