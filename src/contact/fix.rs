//! A motion settled on the ground: standing feet planted, nothing under it, the rest moved as little as that takes.

use std::fmt;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::foot_paths::offsets;
use super::ground_contacts::link_frames;
use super::{ContactError, ContactRule, GroundContacts, GroundQuality};
use crate::body::retarget::{AngleGoal, Goals, PointGoal, Solver};
use crate::body::{Humanoid, LinkFrames, LinkPoint, Motion, Pose};

/// How often contact is told anew and the feet are planted again.
const ROUNDS: usize = 4;
/// Greatest change of any angle from the recorded motion, radians (metres where prismatic).
const GREATEST_CHANGE: f64 = 0.35;
/// Weight of feet on their paths against that of the root where it was.
const FOOT_WEIGHT: f64 = 30.0;
const ROOT_WEIGHT: f64 = 1.0;
/// What a radian away from the angle before amounts to, metres.
const ANGLE_WEIGHT: f64 = 0.1;
/// A link is held in place and orientation by its origin and points this far along its axes, metres.
const HOLD: f64 = 0.1;
const MAX_ITERATIONS: usize = 20;

/// A settled motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Fixed {
    /// The motion.
    pub motion: Motion,
    /// What that changed.
    pub report: FixReport,
}

/// What settling changed.
#[derive(Clone, Debug, PartialEq)]
pub struct FixReport {
    /// How the motion stood.
    pub before: GroundQuality,
    /// How it stands.
    pub after: GroundQuality,
    /// Mean distance by which joints were moved, over all joints and frames, mm.
    pub moved_mm: f64,
    /// Greatest distance by which a joint was moved, mm.
    pub moved_most_mm: f64,
    /// Greatest change of each degree of freedom, radians (metres where prismatic), in the body's order; at most 0.35.
    pub angle_changes: Vec<f64>,
}

impl fmt::Display for FixReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let greatest = self.angle_changes.iter().copied().fold(0.0, f64::max);
        write!(
            f,
            "before: {}; fixed: {}; joints moved by {:.1} mm on average, {:.1} mm at most, angles by {:.1} degrees at most",
            self.before,
            self.after,
            self.moved_mm,
            self.moved_most_mm,
            greatest.to_degrees()
        )
    }
}

/// Settles a motion on the ground z = 0: feet that stand by `rule` are planted, nothing sinks; every frame is a
/// least squares problem with the body's joint limits, in which feet follow their planted paths with the orientation that they
/// have, and the root and all angles stay near where they were. No angle changes by more than 0.35 rad.
///
/// # Errors
/// As [`GroundContacts::of_motion`].
pub fn fix(body: &Humanoid, motion: &Motion, rule: &ContactRule) -> Result<Fixed, ContactError> {
    let before = GroundContacts::of_motion(body, motion, rule)?;
    let mut settled = motion.clone();
    for _ in 0..ROUNDS {
        let frames = link_frames(body, &settled)?;
        let contacts = GroundContacts::of_frames(body, body, &frames, motion.frames_per_second, rule)?;
        let paths = [0, 1].map(|foot| offsets(&contacts.feet[foot], &frames));
        let feet = [0, 1].map(|foot| contacts.feet[foot].links.as_slice());
        settled.poses = (0..frames.len())
            .into_par_iter()
            .map(|frame| {
                let shifts = [paths[0][frame], paths[1][frame]];
                place(&bounded(body, &motion.poses[frame]), &settled.poses[frame], &frames[frame], feet, shifts)
            })
            .collect();
    }
    let settled = settled.made_continuous(body);
    let after = GroundContacts::of_motion(body, &settled, rule)?;
    let report = report(body, motion, &settled, [&before, &after])?;
    Ok(Fixed { motion: settled, report })
}

/// The body without flesh, its limits narrowed to what may be changed of `pose`.
fn bounded(body: &Humanoid, pose: &Pose) -> Humanoid {
    let mut bounded = Humanoid { markers: body.markers, notes: Vec::new(), ..body.clone() };
    bounded.links.iter_mut().for_each(|link| link.flesh.clear());
    for (limits, angle) in bounded.degrees_of_freedom.iter_mut().zip(pose.joint_angles.iter()) {
        let angle = angle.max(limits.lower).min(limits.upper);
        limits.lower = limits.lower.max(angle - GREATEST_CHANGE);
        limits.upper = limits.upper.min(angle + GREATEST_CHANGE);
    }
    bounded
}

/// The pose nearest `pose` whose feet are shifted.
fn place(body: &Humanoid, pose: &Pose, frames: &LinkFrames, feet: [&[usize]; 2], shifts: [Vector3<f64>; 2]) -> Pose {
    let mut points = hold(frames, 0, ROOT_WEIGHT, &Vector3::zeros());
    for (links, shift) in feet.into_iter().zip(&shifts) {
        points.extend(links.iter().flat_map(|&link| hold(frames, link, FOOT_WEIGHT, shift)));
    }
    let stay = |&target: &f64| AngleGoal { target, metres_per_unit: ANGLE_WEIGHT };
    let angles = pose.joint_angles.iter().map(stay).collect();
    Solver::new(body).solve(&Goals { points, orientations: Vec::new(), angles }, pose, MAX_ITERATIONS).pose
}

/// Goals that hold a link where it is, but for a shift.
fn hold(frames: &LinkFrames, link: usize, weight: f64, shift: &Vector3<f64>) -> Vec<PointGoal> {
    let places = [Vector3::zeros(), Vector3::x() * HOLD, Vector3::y() * HOLD];
    let goal = |place: Vector3<f64>| {
        let point_in_link = Point3::from(place);
        PointGoal { on: LinkPoint { link, point_in_link }, target: frames[link] * point_in_link + shift, weight }
    };
    places.into_iter().map(goal).collect()
}

fn report(
    body: &Humanoid,
    motion: &Motion,
    settled: &Motion,
    [before, after]: [&GroundContacts; 2],
) -> Result<FixReport, ContactError> {
    let (mut sum, mut most, mut count) = (0.0, 0.0_f64, 0_usize);
    for (old, new) in link_frames(body, motion)?.iter().zip(&link_frames(body, settled)?) {
        for (a, b) in old.0.iter().zip(&new.0) {
            let moved = 1000.0 * (a.translation.vector - b.translation.vector).norm();
            (sum, most, count) = (sum + moved, most.max(moved), count + 1);
        }
    }
    let mut angle_changes = vec![0.0_f64; body.degrees_of_freedom.len()];
    for (old, new) in motion.poses.iter().zip(&settled.poses) {
        for (change, (a, b)) in angle_changes.iter_mut().zip(old.joint_angles.iter().zip(&new.joint_angles)) {
            *change = change.max((a - b).abs());
        }
    }
    Ok(FixReport {
        before: GroundQuality::of(before),
        after: GroundQuality::of(after),
        moved_mm: sum / count.max(1) as f64,
        moved_most_mm: most,
        angle_changes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;
    use nalgebra::Isometry3;

    /// The actor stands with bent knees and is carried along, too high.
    fn statue(speed: f64, height: f64) -> (Humanoid, Motion) {
        let body = shipped("actor").unwrap();
        let mut pose = body.zero_pose();
        for side in ["left", "right"] {
            for (joint, angle) in [("hip_flexion", 0.3), ("knee_flexion", 0.6), ("ankle_dorsiflexion", 0.3)] {
                pose.joint_angles[body.find_degree_of_freedom(&format!("{side}_{joint}")).unwrap()] = angle;
            }
        }
        let links: Vec<usize> = (0..body.links.len()).collect();
        let lowest = body.lowest_point(&body.link_frames(&pose), &links).unwrap().z;
        let at = |frame: usize| {
            let place = Isometry3::translation(speed * frame as f64 / 60.0, 0.0, height - lowest);
            Pose { world_from_root: place, ..pose.clone() }
        };
        let motion = Motion { frames_per_second: 60.0, poses: (0..40).map(at).collect() };
        (body, motion)
    }

    #[test]
    fn a_statue_that_slides_and_floats_is_planted() {
        let (body, motion) = statue(0.05, 0.012);
        let fixed = fix(&body, &motion, &ContactRule::default()).unwrap();
        let (before, after) = (fixed.report.before, fixed.report.after);
        assert!((before.skate_mm_per_s - 50.0).abs() < 1e-6 && (before.float_mm - 12.0).abs() < 1e-6, "{before:?}");
        assert!(after.skate_mm_per_s < 1.0 && after.float_mm < 0.5 && after.penetration_mm < 0.5, "{after:?}");
        assert!(fixed.report.moved_mm < 15.0 && fixed.report.moved_mm > 1.0, "{}", fixed.report);
        assert!(fixed.report.angle_changes.iter().all(|c| *c <= GREATEST_CHANGE + 1e-12));
    }

    #[test]
    fn what_stands_already_is_left_alone() {
        let (body, motion) = statue(0.0, 0.0);
        let fixed = fix(&body, &motion, &ContactRule::default()).unwrap();
        assert!(fixed.report.moved_most_mm < 1e-3, "{}", fixed.report);
    }

    #[test]
    fn the_same_bits_come_from_any_number_of_threads() {
        let (body, motion) = statue(0.05, 0.012);
        let with_threads = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| fix(&body, &motion, &ContactRule::default()).unwrap())
        };
        assert_eq!(with_threads(1), with_threads(3));
    }
}
