//! Lifts swinging feet: in retargeted and planted recordings they scrape over the ground where the real foot clears
//! it, and a simulated foot that scrapes stumbles.

use nalgebra::{Point3, Vector3};

use skiagraph_core::body::inverse_kinematics::{AngleGoal, Goals, PointGoal, Solver};
use skiagraph_core::body::{Humanoid, LinkFrames, LinkPoint, Motion, Pose};
use skiagraph_core::contact::{ContactTrack, GroundContacts};
use skiagraph_core::parallel;

/// Ground clearance of a swinging foot: between the least toe clearance of healthy gait, 13 mm on average (`[Winter
/// 1992]`), and its height in mid-swing, metres.
const CLEARANCE: f64 = 0.02;
/// Time from lift-off to full clearance, and from there to touch-down, seconds.
const RAMP_S: f64 = 0.08;
/// A link is held in position and orientation by its origin and points this far along its axes, metres.
const HOLD: f64 = 0.1;
/// Weight of feet relative to the root.
const FOOT_WEIGHT: f64 = 30.0;
/// Weight of one radian of an angle's change, metres.
const ANGLE_WEIGHT: f64 = 0.1;
const MAX_ITERATIONS: usize = 10;

/// The motion with scraping swing feet lifted; everything else stays near its recorded position.
pub(super) fn cleared(body: &Humanoid, motion: &Motion, frames: &[LinkFrames], contacts: &GroundContacts) -> Motion {
    let lifts = [0, 1].map(|foot| lifts(&contacts.feet[foot], motion.frames_per_second));
    let poses = parallel::map(motion.poses.len(), |frame| {
        let pose = &motion.poses[frame];
        let lift = [lifts[0][frame], lifts[1][frame]];
        if lift == [0.0; 2] {
            return pose.clone();
        }
        let feet = [0, 1].map(|foot| (contacts.feet[foot].links.as_slice(), lift[foot]));
        lifted(body, pose, &frames[frame], feet)
    });
    Motion { frames_per_second: motion.frames_per_second, poses }.made_continuous(body)
}

/// Lift of a foot in each frame, metres.
fn lifts(track: &ContactTrack, frames_per_second: f64) -> Vec<f64> {
    let stands = |frame: usize| track.frames[frame].in_contact;
    let count = |frames: &mut dyn Iterator<Item = usize>| -> Vec<usize> {
        let away = |away: &mut usize, frame: usize| {
            *away = if stands(frame) { 0 } else { away.saturating_add(1) };
            Some(*away)
        };
        frames.scan(usize::MAX, away).collect()
    };
    let frames = track.frames.len();
    let (since, until) = (count(&mut (0..frames)), count(&mut (0..frames).rev()));
    let wanted = |away: usize| CLEARANCE * (away as f64 / (RAMP_S * frames_per_second)).min(1.0);
    let away = since.into_iter().zip(until.into_iter().rev()).map(|(since, until)| since.min(until));
    track.frames.iter().zip(away).map(|(contact, away)| (wanted(away) - contact.gap_m.max(0.0)).max(0.0)).collect()
}

fn lifted(body: &Humanoid, pose: &Pose, frames: &LinkFrames, feet: [(&[usize], f64); 2]) -> Pose {
    let mut points = hold(frames, 0, 1.0, 0.0);
    for (links, lift) in feet {
        points.extend(links.iter().flat_map(|&link| hold(frames, link, FOOT_WEIGHT, lift)));
    }
    let stay = |&target: &f64| AngleGoal { target, metres_per_unit: ANGLE_WEIGHT };
    let angles = pose.joint_angles.iter().map(stay).collect();
    Solver::new(body).solve(&Goals { points, angles, ..Goals::default() }, pose, MAX_ITERATIONS).pose
}

/// Goals that hold a link at its position plus a lift.
fn hold(frames: &LinkFrames, link: usize, weight: f64, lift: f64) -> Vec<PointGoal> {
    let places = [Vector3::zeros(), Vector3::x() * HOLD, Vector3::y() * HOLD];
    let goal = |place: Vector3<f64>| {
        let point_in_link = Point3::from(place);
        let target = frames[link] * point_in_link + Vector3::z() * lift;
        PointGoal { on: LinkPoint { link, point_in_link }, target, weight }
    };
    places.into_iter().map(goal).collect()
}
