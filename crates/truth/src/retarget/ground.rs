//! Estimates the ground plane from the soles of flat feet.

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

use super::Ground;
use skiagraph_core::body::{Humanoid, Landmark, LinkFrames, Motion};

/// Share of the soles of flat feet below the estimated ground.
const BELOW_GROUND_SHARE: f64 = 0.2;
/// Cosine of the largest tilt of a flat foot: 15 degrees.
const MIN_FLAT_COSINE: f64 = 0.966;
/// The ground's slope is estimated only if soles are spread wider than this, metres.
const MIN_SPREAD: f64 = 0.3;
/// A steeper slope, metres per metre, is not a tilt of the recording but stairs, or a body that never stands.
const MAX_SLOPE: f64 = 0.05;

/// The plane `z = height + slope . ((x, y) - centre)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    centre: [f64; 2],
    slope: [f64; 2],
    height: f64,
}

/// Height of the lowest point of the feet's solids in every pose, metres; empty if the feet have none.
pub(super) fn foot_heights(humanoid: &Humanoid, motion: &Motion) -> Vec<f64> {
    let feet = humanoid.foot_links().concat();
    let mut frames = LinkFrames::default();
    let heights = motion.poses.iter().filter_map(|pose| {
        humanoid.link_frames_into(pose, &mut frames);
        humanoid.lowest_point(&frames, &feet).map(|point| point.z)
    });
    heights.collect()
}

/// The correction that placed a motion on the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Grounding {
    /// Upward shift, metres.
    pub(super) raised: f64,
    /// Angle of the rotation that levelled the ground, radians.
    pub(super) levelled: f64,
}

/// Least shift that is noted, metres.
const MIN_NOTED_SHIFT: f64 = 0.01;

impl Grounding {
    /// A note if the motion was shifted by a centimetre or more.
    pub(super) fn note(&self) -> Option<String> {
        let direction = if self.raised > 0.0 { "raised" } else { "lowered" };
        (self.raised.abs() >= MIN_NOTED_SHIFT).then(|| {
            let shift_mm = 1000.0 * self.raised.abs();
            format!("the motion was {direction} by {shift_mm:.0} mm so that standing feet touch the ground")
        })
    }
}

/// Moves a motion so that its ground is at z = 0, and levels ground that is found by soles if they show a tilt.
pub(super) fn stand_on_ground(humanoid: &Humanoid, motion: &mut Motion, ground: Ground) -> Grounding {
    let ground = match ground {
        Ground::Recorded => None,
        Ground::Feet => Plane::beneath(&soles(humanoid, motion)),
        Ground::BelowAnkles(height) => {
            let height = height - ankle_above_sole(humanoid);
            Some(Plane { centre: [0.0; 2], slope: [0.0; 2], height })
        }
    };
    let Some(ground) = ground else { return Grounding::default() };
    let [a, b] = ground.slope;
    let is_trusted = a * a + b * b < MAX_SLOPE * MAX_SLOPE;
    let normal = if is_trusted { Vector3::new(-a, -b, 1.0) } else { Vector3::z() };
    let turn = UnitQuaternion::rotation_between(&normal, &Vector3::z()).unwrap_or_default();
    let pivot = Vector3::new(ground.centre[0], ground.centre[1], ground.height);
    let there = Vector3::new(pivot.x, pivot.y, 0.0);
    for pose in &mut motion.poses {
        let root = &mut pose.world_from_root;
        root.translation.vector = there + turn * (root.translation.vector - pivot);
        root.rotation = turn * root.rotation;
    }
    Grounding { raised: -ground.height, levelled: turn.angle() }
}

/// Whether a motion is one pose that is held; solutions of equal frames still approach each other.
fn is_still(motion: &Motion) -> bool {
    let Some(first) = motion.poses.first() else { return true };
    motion.poses.iter().all(|pose| {
        let moved = (pose.world_from_root.translation.vector - first.world_from_root.translation.vector).norm();
        moved < 0.005 && (&pose.joint_angles - &first.joint_angles).amax() < 0.02
    })
}

/// Height of the ankles above the soles of the standing body, metres.
fn ankle_above_sole(humanoid: &Humanoid) -> f64 {
    let frames = humanoid.link_frames(&humanoid.standing_pose());
    let ankle = humanoid.markers(&frames)[Landmark::LeftAnkle as usize].map_or(0.0, |ankle| ankle.z);
    humanoid.lowest_point(&frames, &humanoid.foot_links().concat()).map_or(0.0, |sole| ankle - sole.z)
}

/// Lowest point of every flat foot of every pose; of all feet if none is ever flat.
fn soles(humanoid: &Humanoid, motion: &Motion) -> Vec<Point3<f64>> {
    let feet = humanoid.foot_links();
    let rest = humanoid.body_from_links();
    let mut frames = LinkFrames::default();
    let (mut flat, mut all) = (Vec::new(), Vec::new());
    for pose in &motion.poses {
        humanoid.link_frames_into(pose, &mut frames);
        for foot in &feet {
            let up = |link: usize| frames[link].rotation * (rest[link].inverse() * Vector3::z());
            let upright = foot.first().map_or(0.0, |&link| up(link).z);
            let Some(lowest) = humanoid.lowest_point(&frames, foot) else { continue };
            all.push(lowest);
            if upright > MIN_FLAT_COSINE {
                flat.push(lowest);
            }
        }
    }
    // of one pose the lowest point touches the ground, and two points are no slope
    if is_still(motion) {
        return all.into_iter().min_by(|a, b| a.z.total_cmp(&b.z)).into_iter().collect();
    }
    if flat.is_empty() { all } else { flat }
}

impl Plane {
    /// The plane with a fixed share of the points below it: quantile regression (`[Koenker 1978]`) by iteratively
    /// reweighted least squares, with a penalty on the slope that dominates if the points are spread less than
    /// [`MIN_SPREAD`]. `None` without points.
    fn beneath(points: &[Point3<f64>]) -> Option<Self> {
        let first = super::quantile(points.iter().map(|p| p.z).collect(), BELOW_GROUND_SHARE)?;
        let centre = points.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords) / points.len() as f64;
        let mut plane = Self { centre: [centre.x, centre.y], slope: [0.0; 2], height: first };
        for _ in 0..100 {
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for point in points {
                let row = Vector3::new(point.x - centre.x, point.y - centre.y, 1.0);
                let above = point.z - plane.height - plane.slope[0] * row.x - plane.slope[1] * row.y;
                let share = if above > 0.0 { BELOW_GROUND_SHARE } else { 1.0 - BELOW_GROUND_SHARE };
                let weight = share / above.abs().max(1e-4);
                normal += row * row.transpose() * weight;
                right += row * (weight * point.z);
            }
            for (axis, slope) in plane.slope.iter().enumerate() {
                let rise = (slope * MIN_SPREAD).abs().max(1e-4);
                normal[(axis, axis)] += points.len() as f64 * 0.5 * MIN_SPREAD * MIN_SPREAD / rise;
            }
            let solution = normal.try_inverse()? * right;
            plane = Self { slope: [solution.x, solution.y], height: solution.z, ..plane };
        }
        Some(plane)
    }
}

/// Shifts a motion horizontally so that the centre of the bounding box of the root's path is at the origin. Returns the
/// shift, metres.
pub(super) fn centre_path(motion: &mut Motion) -> Vector3<f64> {
    let places = || motion.poses.iter().map(|pose| pose.world_from_root.translation.vector);
    let Some(first) = places().next() else { return Vector3::zeros() };
    let (low, high) = places().fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    let mut shift = -(low + high) * 0.5;
    shift.z = 0.0;
    for pose in &mut motion.poses {
        pose.world_from_root.translation.vector += shift;
    }
    shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_on_a_tilted_floor_gives_the_tilt() {
        // Soles on z = 0.4 + 0.02 x, half of them in the air.
        let points: Vec<Point3<f64>> = (0..200)
            .map(|i| {
                let (x, y) = (0.02 * f64::from(i), 0.5 * libm::sin(f64::from(i)));
                let lift = if i % 2 == 0 { 0.0 } else { 0.05 * libm::fabs(libm::sin(0.7 * f64::from(i))) };
                Point3::new(x, y, 0.4 + 0.02 * x + lift)
            })
            .collect();
        let plane = Plane::beneath(&points).unwrap();
        assert!((plane.slope[0] - 0.02).abs() < 2e-3, "{plane:?}");
        assert!((plane.height - (0.4 + 0.02 * plane.centre[0])).abs() < 2e-3, "{plane:?}");
    }

    #[test]
    fn a_body_on_the_spot_gives_the_height_but_hardly_a_tilt() {
        let points: Vec<Point3<f64>> =
            [-0.1, 0.1].into_iter().map(|x| Point3::new(x, 0.0, 0.3 + 0.04 * x)).cycle().take(50).collect();
        let plane = Plane::beneath(&points).unwrap();
        assert!(plane.slope[0].abs() < 0.008, "{plane:?}");
        assert!((plane.height - 0.3).abs() < 5e-3);
    }
}
