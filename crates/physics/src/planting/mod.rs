//! Plants the feet of a motion: standing feet are fixed, nothing is below the ground, and the rest changes as little
//! as possible.

pub(crate) mod foot_paths;
mod lifts;
mod out_of_ground;
pub(crate) mod placing;
mod report;

use nalgebra::Vector3;

use foot_paths::planted;
use out_of_ground::{LinkLifts, lift_whole_body};
use placing::{Held, Hold, Recorded};
use report::report;
pub use report::{MostMoved, PlantingReport};
use skiagraph_core::body::{Humanoid, JointKind, Landmark, LinkFrames, LinkPoint, Motion, Pose};
use skiagraph_core::contact::{
    ContactError, ContactRule, ContactTrack, GroundContacts, GroundTrackInput, Pace, link_frames,
};
use skiagraph_core::parallel;

/// Greatest number of passes that lift sinking links further.
const PASSES: usize = 3;

/// A motion with planted feet.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PlantedMotion {
    /// The motion.
    pub motion: Motion,
    /// The changes.
    pub report: PlantingReport,
}

/// Plants the feet of a motion on the ground z = 0: feet that stand by `rule`, before or after the change, are
/// planted, and nothing sinks. Every frame is a least-squares problem with the body's joint limits, in which feet
/// follow their planted paths with their orientations, and the root and all angles stay near their recorded values. No
/// angle changes by more than 0.35 rad. A motion whose standing feet are deeper underground than the gap at which
/// contact begins is first raised as a whole. Feet of legs with fewer than six degrees of freedom (without an ankle)
/// follow their paths with the ankle's position only.
///
/// Other sinking parts (hands, knees or the back) are lifted by the joints, from 0.2 s before to 0.2 s after the lift
/// is needed; if the joints are not enough, the whole body including the feet is lifted just as smoothly. This is the
/// last step, so no part of the body is ever below the ground by more than rounding (a test requires 0.1 mm).
///
/// # Errors
/// As [`GroundContacts::from_motion`].
pub fn plant_feet(body: &Humanoid, motion: &Motion, rule: &ContactRule) -> Result<PlantedMotion, ContactError> {
    plant_feet_at_pace(body, motion, rule, Pace::default())
}

/// As [`plant_feet`], with stances found at the speed of the recording, which the motion plays back at `pace`: feet of
/// a walk in slow motion swing as they did in the recording.
pub fn plant_feet_at_pace(
    body: &Humanoid,
    motion: &Motion,
    rule: &ContactRule,
    pace: Pace<'_>,
) -> Result<PlantedMotion, ContactError> {
    plant_on_paths(body, motion, rule, pace, planted)
}

/// As [`plant_feet_at_pace`], with feet on the paths of this function.
pub(super) fn plant_on_paths(
    body: &Humanoid,
    motion: &Motion,
    rule: &ContactRule,
    pace: Pace<'_>,
    path: fn(&GroundTrackInput<'_>, &ContactTrack) -> Vec<Vector3<f64>>,
) -> Result<PlantedMotion, ContactError> {
    let before = GroundContacts::from_motion_at_pace(body, motion, rule, pace)?;
    let depth = depth_of_feet(&before);
    let raised_m = if depth > rule.enter_gap_m { depth } else { 0.0 };
    let old = raised(motion, raised_m);
    let frames = link_frames(body, &old)?;
    let frames_per_second = motion.frames_per_second;
    let clip = GroundTrackInput { body, frames: &frames, frames_per_second, rule, pace };
    let contacts = GroundContacts::from_track_input(&clip)?;
    let paths = contacts.feet.each_ref().map(|foot| path(&clip, foot));
    let mut planted_motion = FeetOnPaths { body, old: &old, frames: &frames, feet: feet(body), paths }.solve();
    let lifts = lift_whole_body(body, &mut planted_motion);
    let after = GroundContacts::from_motion_at_pace(body, &planted_motion, rule, pace)?;
    let report = report(body, [&old, &planted_motion], [&before, &contacts, &after], raised_m, &lifts)?;
    Ok(PlantedMotion { motion: planted_motion, report })
}

struct FeetOnPaths<'a> {
    body: &'a Humanoid,
    old: &'a Motion,
    frames: &'a [LinkFrames],
    feet: [PlantedFoot; 2],
    paths: [Vec<Vector3<f64>>; 2],
}

struct PlantedFoot {
    links: Vec<usize>,
    by: Hold,
}

impl FeetOnPaths<'_> {
    /// The motion with its feet on their paths and sinking parts lifted out of the ground as far as the joints allow.
    fn solve(&self) -> Motion {
        let mut lifts = LinkLifts::new(self.body, self.frames.len());
        let planted = self.motion(parallel::map(self.frames.len(), |frame| {
            self.recorded(frame).placed(self.held_feet(frame, &lifts), &self.old.poses[frame])
        }));
        let mut lifted = planted.clone();
        for _ in 0..PASSES {
            if !lifts.raise(self.body, &lifted) {
                break;
            }
            let pose = |frame: usize| self.lifted(frame, &planted.poses[frame], &lifts);
            lifted = self.motion(parallel::map(self.frames.len(), pose));
        }
        lifted
    }

    /// A frame with its links lifted from their positions after planting.
    fn lifted(&self, frame: usize, planted: &Pose, lifts: &LinkLifts) -> Pose {
        if !lifts.any(frame) {
            return planted.clone();
        }
        let frames = self.body.link_frames(planted);
        let is_foot = |link: usize| self.feet.iter().any(|foot| foot.links.contains(&link));
        let sinks = |&link: &usize| !is_foot(link) && lifts.firmness(link, frame) > 0.0;
        let held = |link: usize| Held {
            link,
            by: Hold::Whole,
            frames: &frames,
            shift: lifts.shift(link, frame),
            firmness: lifts.firmness(link, frame),
        };
        let links = (0..self.body.links.len()).filter(sinks).map(held);
        self.recorded(frame).placed(self.held_feet(frame, lifts).chain(links), planted)
    }

    fn recorded(&self, frame: usize) -> Recorded<'_> {
        Recorded { body: self.body, pose: &self.old.poses[frame], frames: &self.frames[frame] }
    }

    /// The feet on their paths, lifted where they still sink.
    fn held_feet(&self, frame: usize, lifts: &LinkLifts) -> impl Iterator<Item = Held<'_>> {
        self.feet.iter().zip(&self.paths).flat_map(move |(foot, path)| {
            let lift = foot.links.iter().map(|&link| lifts.shift(link, frame)).fold(Vector3::zeros(), |a, b| a.sup(&b));
            let (frames, shift) = (&self.frames[frame], path[frame] + lift);
            foot.links.iter().map(move |&link| Held { link, by: foot.by, frames, shift, firmness: 1.0 })
        })
    }

    fn motion(&self, poses: Vec<Pose>) -> Motion {
        Motion { frames_per_second: self.old.frames_per_second, poses }.made_continuous(self.body)
    }
}

/// The feet of a body. In a leg that cannot control both position and orientation of its foot (without an ankle), only
/// the ankle is held.
fn feet(body: &Humanoid) -> [PlantedFoot; 2] {
    let ankles = [Landmark::LeftAnkle, Landmark::RightAnkle].map(|ankle| body.markers[ankle as usize]);
    let mut links = body.foot_links().into_iter();
    ankles.map(|ankle| {
        let links = links.next().unwrap_or_default();
        match ankle {
            Some(LinkPoint { link, point_in_link }) if freedom_above(body, link) < 6 => {
                PlantedFoot { links: vec![link], by: Hold::Point(point_in_link) }
            }
            _ => PlantedFoot { links, by: Hold::Whole },
        }
    })
}

/// Number of degrees of freedom between the root and a link.
fn freedom_above(body: &Humanoid, mut link: usize) -> usize {
    let mut found = 0;
    while let Some(parent) = body.parent(link) {
        found += match &body.joints[link - 1].kind {
            JointKind::Fixed => 0,
            JointKind::Revolute { .. } | JointKind::Prismatic { .. } => 1,
            JointKind::Spherical { .. } => 3,
            JointKind::Floating { .. } => 6,
        };
        link = parent;
    }
    found
}

/// Median depth of standing feet under the ground, or of the lower foot if none ever stands, metres; negative above.
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

#[cfg(test)]
mod tests {
    use super::placing::GREATEST_CHANGE;
    use super::*;
    use crate::test_bodies::standing_bent;

    /// The actor stands with bent knees and is translated above the ground.
    fn statue(speed: f64, height: f64) -> (Humanoid, Motion) {
        let (body, mut motion) = standing_bent(40, 0.3);
        for (frame, pose) in motion.poses.iter_mut().enumerate() {
            pose.world_from_root.translation.x = speed * frame as f64 / 60.0;
            pose.world_from_root.translation.z += height;
        }
        (body, motion)
    }

    #[test]
    fn a_sliding_and_floating_statue_is_planted() {
        let (body, motion) = statue(0.05, 0.012);
        let fixed = plant_feet(&body, &motion, &ContactRule::default()).unwrap();
        let (before, after) = (fixed.report.before, fixed.report.after);
        assert!((before.skate_mm_per_s - 50.0).abs() < 1e-6 && (before.float_mm - 12.0).abs() < 1e-6, "{before:?}");
        assert!(after.skate_mm_per_s < 1.0 && after.float_mm < 0.5 && after.penetration_mm < 0.5, "{after:?}");
        assert!(fixed.report.moved_mm < 15.0 && fixed.report.moved_mm > 1.0, "{}", fixed.report);
        assert!(fixed.report.angle_changes.iter().all(|c| *c <= GREATEST_CHANGE + 1e-12));
    }

    #[test]
    fn a_standing_motion_is_unchanged() {
        let (body, motion) = statue(0.0, 0.0);
        let fixed = plant_feet(&body, &motion, &ContactRule::default()).unwrap();
        assert!(fixed.report.moved_most.mm < 1e-3, "{}", fixed.report);
    }

    #[test]
    fn an_underground_motion_is_raised_as_a_whole_and_this_is_reported() {
        let (body, motion) = statue(0.0, -0.4);
        let fixed = plant_feet(&body, &motion, &ContactRule::default()).unwrap();
        assert!((fixed.report.raised_mm - 400.0).abs() < 1e-6, "{}", fixed.report);
        assert!((fixed.report.before.penetration_mm - 400.0).abs() < 1e-6 && fixed.report.after.penetration_mm < 0.5);
        assert!(fixed.report.moved_most.mm < 1e-3, "raised, not bent: {}", fixed.report);
        assert!(fixed.report.to_string().starts_with("the motion was underground and is raised by 400 mm as a whole"));
        // parts that sink by millimetres are bent, not raised
        let (_, shallow) = statue(0.0, -0.015);
        assert_eq!(plant_feet(&body, &shallow, &ContactRule::default()).unwrap().report.raised_mm, 0.0);
    }

    #[test]
    fn a_motion_that_never_comes_near_the_ground_is_unchanged() {
        let (body, motion) = statue(0.3, 1.0);
        let fixed = plant_feet(&body, &motion, &ContactRule::default()).unwrap();
        assert_eq!((fixed.report.after.standing, fixed.report.raised_mm), (0.0, 0.0));
        assert!(fixed.report.after.skate_mm_per_s.is_sign_positive(), "0, not -0");
        assert!(fixed.report.moved_most.mm < 1e-3 && fixed.report.to_string().contains("no foot ever stands"));
    }

    #[test]
    fn results_are_bit_identical_with_any_number_of_threads() {
        let (body, motion) = statue(0.05, 0.012);
        let with_threads = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| plant_feet(&body, &motion, &ContactRule::default()).unwrap())
        };
        assert_eq!(with_threads(1), with_threads(3));
    }
}
