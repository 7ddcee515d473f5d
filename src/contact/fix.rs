//! A motion settled on the ground: standing feet planted, nothing under it, the rest moved as little as that takes.

use std::fmt;

use nalgebra::{Point3, Vector3};

use super::foot_paths::{planted, planted_in_recorded_stances};
use super::ground_contacts::{Clip, link_frames};
use super::{ContactError, ContactRule, ContactTrack, GroundContacts, GroundQuality};
use crate::body::retarget::{AngleGoal, Goals, OrientationGoal, PointGoal, Solver};
use crate::body::{Humanoid, LinkFrames, LinkPoint, Motion, Pose};
use crate::parallel;

/// Greatest change of any angle from the recorded motion, radians (metres where prismatic).
const GREATEST_CHANGE: f64 = 0.35;
/// Weight of feet on their paths against that of the root where it was.
const FOOT_WEIGHT: f64 = 30.0;
const ROOT_WEIGHT: f64 = 1.0;
/// What a radian by which the root is turned amounts to, metres: the head is that far from it, and all that hangs on the root is
/// swung when it tilts.
const UPRIGHT: f64 = 0.7;
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
    /// How it stands, in stances told anew of the settled motion.
    pub after: GroundQuality,
    /// The same in the stances of the motion as it was.
    pub after_in_old_stances: GroundQuality,
    /// By how much the whole motion was raised first, mm; 0 for a motion that was not underground.
    pub raised_mm: f64,
    /// Mean distance by which joints were moved beyond that, over all joints and frames, mm.
    pub moved_mm: f64,
    /// Greatest distance by which a joint was moved beyond that.
    pub moved_most: MostMoved,
    /// Greatest change of each degree of freedom, radians (metres where prismatic), in the body's order; at most 0.35.
    pub angle_changes: Vec<f64>,
}

/// What was moved most.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MostMoved {
    /// How far, mm.
    pub mm: f64,
    /// Which link.
    pub link: String,
    /// In which frame.
    pub frame: usize,
}

impl fmt::Display for FixReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.raised_mm > 0.0 {
            write!(f, "the motion was underground and is raised by {:.0} mm as a whole; ", self.raised_mm)?;
        }
        let greatest = self.angle_changes.iter().copied().fold(0.0, f64::max);
        let MostMoved { mm, link, frame } = &self.moved_most;
        write!(
            f,
            "before: {}; fixed: {}; joints moved by {:.1} mm on average, {mm:.1} mm at most ({link}, frame {frame} from 0), angles by {:.1} \
             degrees at most",
            self.before,
            self.after,
            self.moved_mm,
            greatest.to_degrees()
        )
    }
}

/// Settles a motion on the ground z = 0: feet that stand by `rule`, now or once settled, are planted, nothing sinks; every frame is a
/// least squares problem with the body's joint limits, in which feet follow their planted paths with the orientation that they
/// have, and the root and all angles stay near where they were. No angle changes by more than 0.35 rad. A motion whose standing
/// feet are underground, further than contact begins above it, is first raised as a whole.
///
/// # Errors
/// As [`GroundContacts::of_motion`].
pub fn fix(body: &Humanoid, motion: &Motion, rule: &ContactRule) -> Result<Fixed, ContactError> {
    settle(body, motion, rule, planted)
}

/// As [`fix`], with feet held in the stances of the recording alone: what skates about them is a matter of the simulation that
/// follows, and feet that are held longer swing faster.
pub(super) fn fix_in_recorded_stances(
    body: &Humanoid,
    motion: &Motion,
    rule: &ContactRule,
) -> Result<Fixed, ContactError> {
    settle(body, motion, rule, planted_in_recorded_stances)
}

fn settle(
    body: &Humanoid,
    motion: &Motion,
    rule: &ContactRule,
    path: fn(&Clip<'_>, &ContactTrack) -> Vec<Vector3<f64>>,
) -> Result<Fixed, ContactError> {
    let before = GroundContacts::of_motion(body, motion, rule)?;
    let depth = depth_of_feet(&before);
    let raised_m = if depth > rule.enter_gap_m { depth } else { 0.0 };
    let old = raised(motion, raised_m);
    let old_frames = link_frames(body, &old)?;
    let contacts = GroundContacts::of_frames(body, body, &old_frames, motion.frames_per_second, rule)?;
    let feet = contacts.feet.each_ref().map(|foot| foot.links.clone());
    let clip = Clip { surface: body, frames: &old_frames, frames_per_second: motion.frames_per_second, rule };
    let paths = contacts.feet.each_ref().map(|foot| path(&clip, foot));
    let poses = parallel::map(old_frames.len(), |frame| {
        let shifts = [paths[0][frame], paths[1][frame]];
        place(&bounded(body, &old.poses[frame]), &old.poses[frame], &old_frames[frame], &feet, shifts)
    });
    let settled = Motion { poses, ..old.clone() }.made_continuous(body);
    let report = report(body, [&old, &settled], [&before, &contacts], raised_m, rule)?;
    Ok(Fixed { motion: settled, report })
}

/// Median depth of standing feet under the ground, or of the lower foot where none ever stands, metres; negative above.
fn depth_of_feet(contacts: &GroundContacts) -> f64 {
    let [left, right] = &contacts.feet;
    let pairs = left.frames.iter().zip(&right.frames);
    let mut depths: Vec<f64> =
        pairs.clone().flat_map(|(a, b)| [a, b]).filter(|foot| foot.in_contact).map(|foot| -foot.gap_m).collect();
    if depths.is_empty() {
        depths = pairs.map(|(a, b)| -a.gap_m.min(b.gap_m)).collect();
    }
    depths.sort_by(f64::total_cmp);
    depths[depths.len() / 2]
}

fn raised(motion: &Motion, by_m: f64) -> Motion {
    let mut raised = motion.clone();
    raised.poses.iter_mut().for_each(|pose| pose.world_from_root.translation.z += by_m);
    raised
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
fn place(body: &Humanoid, pose: &Pose, frames: &LinkFrames, feet: &[Vec<usize>; 2], shifts: [Vector3<f64>; 2]) -> Pose {
    let mut points = vec![stay_at(frames, 0, Vector3::zeros(), ROOT_WEIGHT, &Vector3::zeros())];
    let upright = OrientationGoal { link: 0, world_from_link: frames[0].rotation, metres_per_radian: UPRIGHT };
    for (links, shift) in feet.iter().zip(&shifts) {
        points.extend(links.iter().flat_map(|&link| hold(frames, link, FOOT_WEIGHT, shift)));
    }
    let stay = |&target: &f64| AngleGoal { target, metres_per_unit: ANGLE_WEIGHT };
    let angles = pose.joint_angles.iter().map(stay).collect();
    Solver::new(body)
        .solve(&Goals { points, orientations: vec![upright], angles, ..Goals::default() }, pose, MAX_ITERATIONS)
        .pose
}

/// Goals that hold a link where it is, but for a shift.
fn hold(frames: &LinkFrames, link: usize, weight: f64, shift: &Vector3<f64>) -> Vec<PointGoal> {
    let places = [Vector3::zeros(), Vector3::x() * HOLD, Vector3::y() * HOLD];
    places.into_iter().map(|place| stay_at(frames, link, place, weight, shift)).collect()
}

/// A goal that holds a point of a link where it is, but for a shift.
fn stay_at(frames: &LinkFrames, link: usize, place: Vector3<f64>, weight: f64, shift: &Vector3<f64>) -> PointGoal {
    let point_in_link = Point3::from(place);
    PointGoal { on: LinkPoint { link, point_in_link }, target: frames[link] * point_in_link + shift, weight }
}

/// `contacts` are those of the motion as it was, and once raised.
fn report(
    body: &Humanoid,
    [old, settled]: [&Motion; 2],
    [before, on_ground]: [&GroundContacts; 2],
    raised_m: f64,
    rule: &ContactRule,
) -> Result<FixReport, ContactError> {
    let mut after = GroundContacts::of_motion(body, settled, rule)?;
    let own = GroundQuality::of(&after);
    for (foot, as_was) in after.feet.iter_mut().zip(&on_ground.feet) {
        foot.frames.iter_mut().zip(&as_was.frames).for_each(|(frame, as_was)| frame.in_contact = as_was.in_contact);
    }
    let (mut sum, mut count, mut most) = (0.0, 0_usize, MostMoved::default());
    let pairs = link_frames(body, old)?.into_iter().zip(link_frames(body, settled)?);
    for (frame, (old, new)) in pairs.enumerate() {
        for (link, (a, b)) in old.0.iter().zip(&new.0).enumerate() {
            let mm = 1000.0 * (a.translation.vector - b.translation.vector).norm();
            (sum, count) = (sum + mm, count + 1);
            if mm > most.mm {
                most = MostMoved { mm, link: body.links[link].name.clone(), frame };
            }
        }
    }
    let mut angle_changes = vec![0.0_f64; body.degrees_of_freedom.len()];
    for (old, new) in old.poses.iter().zip(&settled.poses) {
        for (change, (a, b)) in angle_changes.iter_mut().zip(old.joint_angles.iter().zip(&new.joint_angles)) {
            *change = change.max((a - b).abs());
        }
    }
    Ok(FixReport {
        before: GroundQuality::of(before),
        after: own,
        after_in_old_stances: GroundQuality::of(&after),
        raised_mm: 1000.0 * raised_m,
        moved_mm: sum / count.max(1) as f64,
        moved_most: most,
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
        assert!(fixed.report.moved_most.mm < 1e-3, "{}", fixed.report);
    }

    #[test]
    fn a_motion_that_is_underground_is_raised_as_a_whole_and_that_is_said() {
        let (body, motion) = statue(0.0, -0.4);
        let fixed = fix(&body, &motion, &ContactRule::default()).unwrap();
        assert!((fixed.report.raised_mm - 400.0).abs() < 1e-6, "{}", fixed.report);
        assert!((fixed.report.before.penetration_mm - 400.0).abs() < 1e-6 && fixed.report.after.penetration_mm < 0.5);
        assert!(fixed.report.moved_most.mm < 1e-3, "raised, not bent: {}", fixed.report);
        assert!(fixed.report.to_string().starts_with("the motion was underground and is raised by 400 mm as a whole"));
        // what sinks by millimetres is bent, not raised
        let (_, shallow) = statue(0.0, -0.015);
        assert_eq!(fix(&body, &shallow, &ContactRule::default()).unwrap().report.raised_mm, 0.0);
    }

    #[test]
    fn a_motion_that_never_comes_near_the_ground_is_left_alone() {
        let (body, motion) = statue(0.3, 1.0);
        let fixed = fix(&body, &motion, &ContactRule::default()).unwrap();
        assert_eq!((fixed.report.after.standing, fixed.report.raised_mm), (0.0, 0.0));
        assert!(fixed.report.moved_most.mm < 1e-3 && fixed.report.to_string().contains("no foot ever stands"));
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
