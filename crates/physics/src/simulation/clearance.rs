//! Lifts swinging feet: in retargeted and planted recordings they scrape over the ground where the real foot clears
//! it, and a simulated foot that scrapes stumbles.

use nalgebra::Vector3;

use crate::planting::placing::hold;
use skiagraph_core::body::inverse_kinematics::{AngleGoal, Goals, Solver};
use skiagraph_core::body::{Humanoid, LinkFrames, Motion, Pose};
use skiagraph_core::contact::{ContactTrack, GroundContacts};
use skiagraph_core::parallel;

/// Ground clearance of a swinging foot: between the least toe clearance of healthy gait, 13 mm on average (`[Winter
/// 1992]`), and its height in mid-swing, metres.
const CLEARANCE: f64 = 0.02;
/// Time from lift-off to full clearance, and from there to touch-down, seconds.
const RAMP_S: f64 = 0.08;
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
    let mut points = hold(frames, 0, 1.0, &Vector3::zeros()).to_vec();
    for (links, lift) in feet {
        let lift = Vector3::z() * lift;
        points.extend(links.iter().flat_map(|&link| hold(frames, link, FOOT_WEIGHT, &lift)));
    }
    let stay = |&target: &f64| AngleGoal { target, metres_per_unit: ANGLE_WEIGHT };
    let angles = pose.joint_angles.iter().map(stay).collect();
    Solver::new(body).solve(&Goals { points, angles, ..Goals::default() }, pose, MAX_ITERATIONS).pose
}
