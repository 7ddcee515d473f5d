//! Bends a motion along a path.
//!
//! The root's smoothed trajectory on the ground, without the sway of single steps, is mapped to the curve by arc
//! length, and every frame is rotated by the difference of their headings. Frames without travel keep their position.

use nalgebra::{Isometry3, UnitQuaternion, Vector2, Vector3};

use super::EditError;
use super::curve::{Curve, unwrap};
use skiagraph_core::body::{Humanoid, Motion, Pose};
use skiagraph_core::contact::{ContactRule, FOOT_NAMES, GroundContacts, Pace};

/// Largest turn of the body about a foot in stance, radians: 45 degrees, the range of hip rotation to either side
/// (`[Norkin 2009]`).
pub const GREATEST_TURN_IN_A_STANCE: f64 = core::f64::consts::FRAC_PI_4;

/// Least distance travelled, metres.
const MIN_TRAVEL: f64 = 0.5;

/// Standard deviation of the window that removes the sway of steps from the root's trajectory, seconds.
const SMOOTHING_S: f64 = 0.35;

/// Least speed at which the trajectory has a heading, m/s.
const MIN_SPEED: f64 = 0.15;

/// Bends a continuous `motion` along the path through `waypoints` (on the ground, metres), starting at the first; a
/// longer motion continues straight after the last. Stances are determined at the recording's speed, given by `pace`.
///
/// # Errors
/// [`EditError`] for invalid waypoints, a motion that stays in place, and a path or recording that turns by more than
/// [`GREATEST_TURN_IN_A_STANCE`] during a stance.
pub fn along_path(
    body: &Humanoid,
    motion: &Motion,
    waypoints: &[[f64; 2]],
    pace: Pace<'_>,
) -> Result<Motion, EditError> {
    let curve = Curve::through(waypoints)?;
    let trajectory = Trajectory::from_motion(motion);
    let travelled_m = trajectory.lengths.last().copied().unwrap_or(0.0);
    if travelled_m < MIN_TRAVEL {
        return Err(EditError::Path(format!(
            "a path requires a motion that travels at least {MIN_TRAVEL} m; this one travels {travelled_m:.2} m"
        )));
    }
    let turns: Vec<f64> =
        trajectory.lengths.iter().zip(&trajectory.headings).map(|(l, heading)| curve.at(*l).1 - heading).collect();
    check_turns(body, motion, pace, &turns, |frame| curve.at(trajectory.lengths[frame]))?;
    let bent = |(frame, pose): (usize, &Pose)| {
        let (there, _) = curve.at(trajectory.lengths[frame]);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turns[frame]);
        let root = pose.world_from_root.translation.vector;
        let sway = turn * Vector3::new(root.x - trajectory.points[frame].x, root.y - trajectory.points[frame].y, 0.0);
        let place = Vector3::new(there.x + sway.x, there.y + sway.y, root.z);
        let world_from_root = Isometry3::from_parts(place.into(), turn * pose.world_from_root.rotation);
        Pose { world_from_root, joint_angles: pose.joint_angles.clone() }
    };
    let poses = motion.poses.iter().enumerate().map(bent).collect();
    Ok(Motion { frames_per_second: motion.frames_per_second, poses }.made_continuous(body))
}

/// Rejects turns that a foot in stance cannot follow.
fn check_turns(
    body: &Humanoid,
    motion: &Motion,
    pace: Pace<'_>,
    turns: &[f64],
    path: impl Fn(usize) -> (Vector2<f64>, f64),
) -> Result<(), EditError> {
    let contacts = GroundContacts::from_motion_at_pace(body, motion, &ContactRule::default(), pace)?;
    for (foot, track) in FOOT_NAMES.into_iter().zip(&contacts.feet) {
        for stance in track.stances() {
            let turned = total_turn(turns[stance.clone()].iter().copied());
            if turned <= GREATEST_TURN_IN_A_STANCE {
                continue;
            }
            let of_path = total_turn(stance.clone().map(|frame| path(frame).1));
            let (from_s, to_s) =
                (stance.start as f64 / motion.frames_per_second, (stance.end - 1) as f64 / motion.frames_per_second);
            let (turn_deg, limit_deg) = (turned.to_degrees(), GREATEST_TURN_IN_A_STANCE.to_degrees());
            if of_path < GREATEST_TURN_IN_A_STANCE.min(0.5 * turned) {
                return Err(EditError::Path(format!(
                    "the recording itself turns, reverses or stands from {from_s:.2} s to {to_s:.2} s: relative to the \
                     path it turns by {turn_deg:.0} degrees during the stance of the {foot} (the path by {:.0}), \
                     expected at most {limit_deg:.0} degrees; use another part of it (`first_frame`, `last_frame`), or \
                     join the parts before and after (`motion.then`)",
                    of_path.to_degrees()
                )));
            }
            let (middle, _) = path(stance.start + stance.len() / 2);
            return Err(EditError::Path(format!(
                "the path turns faster than feet can follow: by {turn_deg:.0} degrees at ({:.2}, {:.2}) m during the \
                 stance of the {foot} from {from_s:.2} s to {to_s:.2} s, expected at most {limit_deg:.0} degrees; \
                 widen the curve there",
                middle.x, middle.y
            )));
        }
    }
    Ok(())
}

/// Sum of the absolute differences between consecutive headings, radians.
fn total_turn(headings: impl Iterator<Item = f64>) -> f64 {
    let mut last = None;
    headings.map(|heading| (heading - last.replace(heading).unwrap_or(heading)).abs()).sum()
}

/// The root's smoothed trajectory on the ground.
struct Trajectory {
    points: Vec<Vector2<f64>>,
    /// Arc length from the first frame.
    lengths: Vec<f64>,
    /// Heading, unwrapped; in slow frames that of the last faster frame, or of the first one at the start.
    headings: Vec<f64>,
}

impl Trajectory {
    fn from_motion(motion: &Motion) -> Self {
        let roots: Vec<Vector2<f64>> = motion.poses.iter().map(|p| p.world_from_root.translation.vector.xy()).collect();
        let points = smoothed(&roots, SMOOTHING_S * motion.frames_per_second);
        let mut lengths = vec![0.0; points.len()];
        for index in 1..points.len() {
            lengths[index] = lengths[index - 1] + (points[index] - points[index - 1]).norm();
        }
        let headings = headings(&points, motion);
        Self { points, lengths, headings }
    }
}

/// Gaussian smoothing; points are reflected through the ends, which stay fixed.
fn smoothed(points: &[Vector2<f64>], deviation: f64) -> Vec<Vector2<f64>> {
    let reach = libm::ceil(3.0 * deviation) as isize;
    let weights: Vec<f64> =
        (-reach..=reach).map(|k| libm::exp(-0.5 * (k as f64 / deviation) * (k as f64 / deviation))).collect();
    let total: f64 = weights.iter().sum();
    let last = points.len().cast_signed() - 1;
    let at = |index: isize| -> Vector2<f64> {
        let inside = |index: isize| points[index.clamp(0, last).unsigned_abs()];
        match index {
            i if i < 0 => 2.0 * points[0] - inside(-i),
            i if i > last => 2.0 * inside(last) - inside(2 * last - i),
            i => inside(i),
        }
    };
    let of = |frame: isize| {
        let sum: Vector2<f64> = (-reach..=reach).zip(&weights).map(|(k, weight)| at(frame + k) * *weight).sum();
        sum / total
    };
    (0..=last).map(of).collect()
}

fn headings(points: &[Vector2<f64>], motion: &Motion) -> Vec<f64> {
    let rate = motion.frames_per_second;
    let speed = |frame: usize| {
        let (before, after) = (frame.saturating_sub(1), (frame + 1).min(points.len() - 1));
        (points[after] - points[before]) * (rate / (after - before).max(1) as f64)
    };
    let known: Vec<Option<f64>> =
        (0..points.len()).map(speed).map(|v| (v.norm() > MIN_SPEED).then(|| libm::atan2(v.y, v.x))).collect();
    let first = known.iter().flatten().next().copied();
    let mut last = first.or_else(|| motion.poses.first()?.heading()).unwrap_or(0.0);
    let mut headings: Vec<f64> = known
        .iter()
        .map(|known| {
            last = known.unwrap_or(last);
            last
        })
        .collect();
    unwrap(&mut headings);
    headings
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;
    use skiagraph_core::body::shipped;

    /// The actor glides along x at a constant speed, on the ground or above it.
    fn glide(speed: f64, height: f64, seconds: f64) -> (Humanoid, Motion) {
        let body = shipped("actor").unwrap();
        let links: Vec<usize> = (0..body.links.len()).collect();
        let lowest = body.lowest_point(&body.link_frames(&body.zero_pose()), &links).unwrap().z;
        let pose = |frame: usize| Pose {
            world_from_root: Isometry3::translation(speed * frame as f64 / 60.0, 0.3, height - lowest),
            ..body.zero_pose()
        };
        let poses = (0..(60.0 * seconds) as usize).map(pose).collect();
        (body, Motion { frames_per_second: 60.0, poses })
    }

    #[test]
    fn a_straight_path_with_the_same_heading_only_translates() {
        let (body, motion) = glide(1.0, 0.1, 3.0);
        let led = along_path(&body, &motion, &[[1.0, 1.0], [9.0, 1.0]], Pace::default()).unwrap();
        for (was, is) in motion.poses.iter().zip(&led.poses) {
            let moved = is.world_from_root.translation.vector - was.world_from_root.translation.vector;
            assert!((moved - Vector3::new(1.0, 0.7, 0.0)).norm() < 1e-9, "{moved}");
            assert!(is.world_from_root.rotation.angle() < 1e-9);
        }
    }

    #[test]
    fn a_bent_path_is_followed_at_the_motions_speed_facing_along_it() {
        let (body, motion) = glide(1.2, 0.5, 6.0);
        let led =
            along_path(&body, &motion, &[[0.0, 0.0], [2.0, 0.0], [4.0, 2.0], [4.0, 4.0]], Pace::default()).unwrap();
        let places: Vec<_> = led.poses.iter().map(|p| p.world_from_root.translation.vector).collect();
        for pair in places.windows(2) {
            assert!(((pair[1] - pair[0]).norm() * 60.0 - 1.2).abs() < 0.03, "{}", (pair[1] - pair[0]).norm() * 60.0);
        }
        for (frame, pair) in places.windows(3).enumerate() {
            let along = (pair[2] - pair[0]).normalize();
            let [x, y, _] = led.poses[frame + 1].forward().unwrap();
            assert!(along.x * x + along.y * y > 0.995);
        }
        assert!((led.poses.last().unwrap().heading().unwrap() - core::f64::consts::FRAC_PI_2).abs() < 0.1);
    }

    #[test]
    fn a_corner_within_a_stance_is_refused_with_its_position() {
        let (body, mut motion) = glide(0.2, 0.0, 8.0);
        // slow enough to be in stance throughout
        motion.frames_per_second = 60.0;
        let error =
            along_path(&body, &motion, &[[0.0, 0.0], [0.5, 0.0], [0.5, 0.6]], Pace::default()).unwrap_err().to_string();
        assert!(error.contains("turns faster than feet can follow") && error.contains("at most 45 degrees"), "{error}");
    }

    /// A straight line cannot be widened, so the message must not blame the path.
    #[test]
    fn a_recording_that_reverses_on_a_straight_path_is_reported_as_the_cause() {
        let (body, mut motion) = glide(0.2, 0.0, 8.0);
        for frame in 240..480 {
            let back = motion.poses[479 - frame].clone();
            motion.poses[frame] = back;
        }
        let error = along_path(&body, &motion, &[[0.0, 0.0], [9.0, 0.0]], Pace::default()).unwrap_err();
        let message = error.to_string();
        assert!(message.starts_with("the recording itself turns") && message.contains("`motion.then`"), "{message}");
        let seconds: Vec<f64> = message.split(' ').filter_map(|word| word.parse().ok()).take(2).collect();
        assert!(seconds[0] <= 4.0 && seconds[1] >= 4.0 && message.contains("(the path by 0)"), "{message}");
    }

    #[test]
    fn a_motion_that_stays_in_place_is_refused() {
        let (body, motion) = glide(0.01, 0.0, 2.0);
        let error = along_path(&body, &motion, &[[0.0, 0.0], [5.0, 0.0]], Pace::default()).unwrap_err().to_string();
        assert!(error.contains("travels 0.02 m"), "{error}");
    }
}
