//! How deep a body is in the ground and in itself, fast enough for every particle of a tracker.

use std::ops::Range;

use nalgebra::{Isometry3, Vector3};

use super::SelfCollision;
use super::capsule_distance::Axis;
use super::self_collision::bounding_ball;
use super::solid_distance::solid_distance;
use crate::body::{Flesh, Humanoid, LinkFrames};

/// The solids of a body, laid out for looking at many poses.
///
/// The pairs are those of [`SelfCollision::pairs`]. Balls around links are compared first, then balls around their solids, then the
/// axes of tapered capsules as if they were as thick everywhere as at their thickest; only what all of these let through is
/// measured: in closed form where both solids are tapered capsules, by parry elsewhere.
#[derive(Clone, Debug)]
pub struct Interpenetration {
    parts: Vec<Part>,
    solids: Vec<Solid>,
    pairs: Vec<Pair>,
}

/// The solids of one link.
#[derive(Clone, Debug)]
struct Part {
    link: usize,
    solids: Range<usize>,
    ball: Ball,
}

/// One solid, in its link.
#[derive(Clone, Debug)]
struct Solid {
    flesh: Flesh,
    /// Of tapered capsules.
    axis: Option<Axis>,
    ball: Ball,
    thickest: f64,
}

/// Two parts that must not touch.
#[derive(Clone, Debug)]
struct Pair {
    parts: [usize; 2],
    /// Squared sum of the radii around them.
    reach_squared: f64,
}

#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: Vector3<f64>,
    radius: f64,
}

/// How deep a body is in the ground z = 0 and in itself, each beyond a tolerance, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Depths {
    /// Of the deepest point under the ground.
    pub ground_m: f64,
    /// Of the deepest pair of solids.
    pub own_m: f64,
    /// Sum over all pairs of solids.
    pub own_sum_m: f64,
}

/// Memory of one thread for [`Interpenetration::depths`].
#[derive(Clone, Debug, Default)]
pub struct InterpenetrationScratch {
    /// Where the axes of tapered capsules are; of no meaning for other solids.
    axes: Vec<Axis>,
    /// Centres of the balls around solids and around parts.
    centres: Vec<Vector3<f64>>,
    part_centres: Vec<Vector3<f64>>,
}

impl Interpenetration {
    /// Of a body.
    pub fn new(body: &Humanoid) -> Self {
        let (mut parts, mut solids) = (Vec::new(), Vec::<Solid>::new());
        for (link, flesh) in body.links.iter().map(|link| &link.flesh).enumerate() {
            let first = solids.len();
            solids.extend(flesh.iter().filter_map(Solid::new));
            if let Some(ball) = Ball::around(&solids[first..]) {
                parts.push(Part { link, solids: first..solids.len(), ball });
            }
        }
        let part = |link: usize| parts.iter().position(|part| part.link == link);
        let pair = |&[a, b]: &[usize; 2]| {
            let [a, b] = [part(a)?, part(b)?];
            let reach = parts[a].ball.radius + parts[b].ball.radius;
            Some(Pair { parts: [a, b], reach_squared: reach * reach })
        };
        let pairs = SelfCollision::new(body).pairs().iter().filter_map(pair).collect();
        Self { parts, solids, pairs }
    }

    /// How deep the body is in the ground and in itself when its links are at `frames`, beyond `tolerance_m` metres.
    pub fn depths(&self, frames: &LinkFrames, tolerance_m: f64, scratch: &mut InterpenetrationScratch) -> Depths {
        let ground = self.place(frames, scratch) - tolerance_m;
        let mut depths = Depths { ground_m: ground.max(0.0), ..Depths::default() };
        for pair in &self.pairs {
            let [a, b] = pair.parts;
            if (scratch.part_centres[a] - scratch.part_centres[b]).norm_squared() < pair.reach_squared {
                self.add_pair(pair, frames, tolerance_m, scratch, &mut depths);
            }
        }
        depths
    }

    /// Adds the depths of the solids of two parts.
    fn add_pair(
        &self,
        pair: &Pair,
        frames: &LinkFrames,
        tolerance_m: f64,
        scratch: &InterpenetrationScratch,
        depths: &mut Depths,
    ) {
        let [a, b] = pair.parts.map(|part| &self.parts[part]);
        for i in a.solids.clone() {
            for j in b.solids.clone() {
                let (first, second) = (&self.solids[i], &self.solids[j]);
                let reach = first.ball.radius + second.ball.radius - tolerance_m;
                if (scratch.centres[i] - scratch.centres[j]).norm_squared() >= reach * reach || reach < 0.0 {
                    continue;
                }
                let distance = match (&first.axis, &second.axis) {
                    (Some(_), Some(_)) => {
                        let reach = first.thickest + second.thickest - tolerance_m;
                        let (first, second) = (&scratch.axes[i], &scratch.axes[j]);
                        if reach < 0.0 || first.squared_distance_of_axes(second) >= reach * reach {
                            continue;
                        }
                        first.distance(second)
                    }
                    _ => {
                        let first_from_second: Isometry3<f64> = frames[a.link].inverse() * frames[b.link];
                        solid_distance(&first.flesh, &second.flesh, &first_from_second)
                    }
                };
                let depth = (-distance - tolerance_m).max(0.0);
                depths.own_m = depths.own_m.max(depth);
                depths.own_sum_m += depth;
            }
        }
    }

    /// Puts every solid into the world; how deep the deepest is under the ground, negative above.
    fn place(&self, frames: &LinkFrames, scratch: &mut InterpenetrationScratch) -> f64 {
        scratch.axes.clear();
        scratch.centres.clear();
        scratch.part_centres.clear();
        let mut deepest = f64::NEG_INFINITY;
        for part in &self.parts {
            let frame = &frames[part.link];
            let (rotation, origin) = (frame.rotation.to_rotation_matrix(), frame.translation.vector);
            for solid in &self.solids[part.solids.clone()] {
                let (axis, centre, depth) = match &solid.axis {
                    Some(axis) => {
                        let (start, along) = (rotation * axis.start + origin, rotation * axis.along);
                        // the ball around a tapered capsule has its centre half-way
                        let end_z = start.z + axis.length * along.z;
                        let depth = (axis.radius - start.z).max(axis.end_radius() - end_z);
                        (Axis { start, along, ..*axis }, start + along * (0.5 * axis.length), depth)
                    }
                    None => {
                        let lowest = solid.flesh.lowest_point(frame).map_or(f64::INFINITY, |point| point.z);
                        (Axis::default(), rotation * solid.ball.centre + origin, -lowest)
                    }
                };
                scratch.axes.push(axis);
                scratch.centres.push(centre);
                deepest = deepest.max(depth);
            }
            let centre = match part.solids.len() {
                1 => scratch.centres[part.solids.start],
                _ => rotation * part.ball.centre + origin,
            };
            scratch.part_centres.push(centre);
        }
        deepest
    }
}

impl Solid {
    /// `None` of an empty mesh.
    fn new(flesh: &Flesh) -> Option<Self> {
        let axis = match flesh {
            Flesh::TaperedCapsule(capsule) => Some(Axis::of(capsule)),
            _ => None,
        };
        let thickest = axis.map_or(0.0, |axis| axis.radius.max(axis.end_radius()));
        let ball = match &axis {
            Some(axis) => {
                let half = 0.5 * axis.length;
                Ball { centre: axis.start + axis.along * half, radius: half + thickest }
            }
            None => {
                let (centre, radius) = bounding_ball(flesh)?;
                Ball { centre: centre.coords, radius }
            }
        };
        Some(Self { flesh: flesh.clone(), axis, ball, thickest })
    }
}

impl Ball {
    /// A ball that holds the solids; `None` of none.
    fn around(solids: &[Solid]) -> Option<Self> {
        let corner = |side: f64| solids.iter().map(move |solid| solid.ball.centre.add_scalar(side * solid.ball.radius));
        let low = corner(-1.0).reduce(|a, b| a.inf(&b))?;
        let high = corner(1.0).reduce(|a, b| a.sup(&b))?;
        let centre = 0.5 * (low + high);
        let reach = |solid: &Solid| (solid.ball.centre - centre).norm() + solid.ball.radius;
        Some(Self { centre, radius: solids.iter().map(reach).fold(0.0, f64::max) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Pose, shipped};
    use crate::contact::GroundContacts;
    use crate::raster::TaperedCapsule;
    use nalgebra::{Point3, UnitQuaternion};

    fn crumpled(body: &Humanoid, index: u64) -> Pose {
        // anything that looks like chance will do here
        let mut step = 0.0;
        let mut between = |low: f64, high: f64| {
            step += 78.233;
            low + (high - low) * (libm::sin(index as f64 * 12.9898 + step) * 43_758.545).rem_euclid(1.0)
        };
        let mut pose = body.zero_pose();
        for (angle, limits) in pose.joint_angles.iter_mut().zip(&body.degrees_of_freedom) {
            *angle = between(limits.lower.max(-2.0), limits.upper.min(2.0));
        }
        let turn = UnitQuaternion::from_euler_angles(0.4, between(-0.5, 0.5), 1.0);
        let place = Vector3::new(3.0, -2.0, between(0.3, 1.2));
        pose.world_from_root = Isometry3::from_parts(place.into(), turn);
        pose
    }

    fn with_boxes(mut body: Humanoid) -> Humanoid {
        for name in ["left_forearm", "right_shank"] {
            let link = body.find_link(name).unwrap();
            let half_extents = [0.04, 0.05, 0.12];
            body.links[link].flesh =
                vec![Flesh::Box { link_from_box: Isometry3::translation(0.0, 0.0, -0.12), half_extents }];
        }
        body
    }

    /// Depth of the ground by the surface's lowest point, and of all pairs of links one by one.
    #[test]
    fn every_depth_is_that_of_the_slow_road() {
        let actor = shipped("actor").unwrap();
        let mut collided = 0;
        for body in [shipped("tracker25").unwrap(), with_boxes(actor.clone()), actor] {
            let fast = Interpenetration::new(&body);
            let slow = SelfCollision::new(&body);
            let all: Vec<usize> = (0..body.links.len()).collect();
            let mut scratch = InterpenetrationScratch::default();
            for index in 0..200 {
                let frames = body.link_frames(&crumpled(&body, index));
                let found = fast.depths(&frames, 0.0, &mut scratch);
                let ground = (-body.lowest_point(&frames, &all).unwrap().z).max(0.0);
                let own = slow.deepest_m(&frames);
                assert!((found.ground_m - ground).abs() < 1e-9, "{} {index}: {found:?} {ground}", body.name);
                assert!((found.own_m - own).abs() < 1e-6, "{} {index}: {found:?} {own}", body.name);
                assert!(found.own_sum_m >= found.own_m);
                let tolerant = fast.depths(&frames, 0.02, &mut scratch);
                assert!((tolerant.own_m - (found.own_m - 0.02).max(0.0)).abs() < 1e-12);
                assert!((tolerant.ground_m - (found.ground_m - 0.02).max(0.0)).abs() < 1e-12);
                collided += u32::from(own > 0.01);
            }
        }
        assert!(collided > 100, "too few collisions to tell: {collided}");
    }

    /// Sixteen plain capsules: parry has those. It is asked for the distance of the axes, from which the radii are taken.
    #[test]
    fn capsules_are_as_deep_as_parry_says_within_a_tenth_of_a_millimetre() {
        let mut body = shipped("tracker25").unwrap();
        for flesh in body.links.iter_mut().flat_map(|link| &mut link.flesh) {
            if let Flesh::TaperedCapsule(c) = flesh {
                *c = TaperedCapsule { radius_b: c.radius_a, ..*c };
            }
        }
        let fast = Interpenetration::new(&body);
        let pairs = SelfCollision::new(&body);
        let mut deep = 0;
        for index in 0..1000 {
            let frames = body.link_frames(&crumpled(&body, index));
            let found = fast.depths(&frames, 0.0, &mut InterpenetrationScratch::default());
            let mut deepest = 0.0_f64;
            for [first, second] in pairs.pairs() {
                for a in &body.links[*first].flesh {
                    for b in &body.links[*second].flesh {
                        deepest = deepest.max(-by_parry([a, b], [&frames[*first], &frames[*second]]));
                    }
                }
            }
            assert!((found.own_m - deepest).abs() < 1e-4, "{index}: {found:?}, parry {deepest}");
            deep += u32::from(deepest > 0.01);
        }
        assert!(deep > 100, "too few collisions to tell: {deep}");
    }

    fn by_parry(solids: [&Flesh; 2], frames: [&Isometry3<f64>; 2]) -> f64 {
        use parry3d::math::{Pose, Vector};
        use parry3d::shape::Segment;
        let [(a, r), (b, s)] = [0, 1].map(|i| {
            let Flesh::TaperedCapsule(c) = solids[i] else { panic!("a capsule") };
            let point = |p: Point3<f64>| Vector::new(p.x as f32, p.y as f32, p.z as f32);
            (Segment::new(point(frames[i] * c.a), point(frames[i] * c.b)), c.radius_a)
        });
        let apart = parry3d::query::distance(&Pose::IDENTITY, &a, &Pose::IDENTITY, &b).unwrap();
        f64::from(apart.distance) - r - s
    }

    #[test]
    fn a_body_of_no_flesh_touches_nothing() {
        let mut body = shipped("tracker25").unwrap();
        let frames = body.link_frames(&body.zero_pose());
        body.links.iter_mut().for_each(|link| link.flesh.clear());
        let found = Interpenetration::new(&body).depths(&frames, 0.0, &mut InterpenetrationScratch::default());
        assert_eq!(found, Depths::default());
        assert!(GroundContacts::of_frames(&body, &body, &[frames], 60.0, &Default::default()).is_err());
    }
}
