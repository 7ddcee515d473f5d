//! The three text files of bodytrack's own body, from what trackers are given: shape and initial pose are fitted to the
//! tracker's body in its start pose, and the deviations are what the spread of frame-to-frame changes does to that fit.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Point3, UnitQuaternion};

use super::bodytrack_thickness::CylinderThickness;
use crate::body::inverse_kinematics::{AngleGoal, Goals, PointGoal, PoseSolution, Solver};
use crate::body::{Humanoid, LANDMARKS, Landmark, Pose, Prediction, ProposalScales, from_axes};
use crate::bodytrack_body::{BODYTRACK_NUMBERS, BodytrackBody, BodytrackShape, POSITION, ROOT, numbers_of};
use crate::{BlindSet, SetError, Start, Training};

/// Weight of one radian from the resting pose, as a distance in metres: it decides only what markers do not.
const REST: f64 = 0.001;
const MOST_STEPS: usize = 300;
/// Number 17 of a left arm that hangs, and of arms stretched backwards and forwards; number 23, of the right arm, has
/// the opposite sign.
const ARMS: [f64; 3] = [-0.5 * PI, 0.0, -PI];
/// Numbers of the thorax, held at 0: markers leave open how pelvis and thorax share a bend, and the torso's cylinder
/// follows the pelvis.
const THORAX: [usize; 2] = [26, 27];
const SHOULDERS: [usize; 2] = [17, 23];
/// Farthest position from the start, mm.
const FARTHEST: f64 = 100_000.0;

/// The three texts, and the greatest distance of a marker from the start pose's, metres.
pub(super) struct BodytrackStart {
    pub(super) shape: String,
    pub(super) initial_pose: String,
    pub(super) pose_parameters: String,
    pub(super) farthest_m: f64,
}

impl BodytrackStart {
    /// # Errors
    /// [`SetError::Malformed`] if the tracker's body lacks one of HumanEva's markers.
    pub(super) fn of(set: &BlindSet) -> Result<Self, SetError> {
        let Start { body, pose, .. } = &set.start;
        let places = places(body, pose).map_err(|landmark| {
            let name = landmark.name();
            let detail = format!("its body is made of all of HumanEva's markers; start/body.json lacks {name}");
            SetError::malformed("bodytrack", detail)
        })?;
        let mut theirs = BodytrackBody::new(BodytrackShape::of_markers(&places));
        let fitted = fitted_from_rest(&theirs, &places).pose;
        let thickness = CylinderThickness::new(body, pose, &places);
        theirs.shape.cylinders = thickness.apart(thickness.cylinders(&theirs, &fitted));
        let found = theirs.humanoid.markers(&theirs.humanoid.link_frames(&fitted));
        let apart = found.iter().zip(&places).filter_map(|(found, place)| Some((found.as_ref()? - place).norm()));
        let deviations = deviations(set, &theirs, &fitted);
        Ok(Self {
            shape: theirs.shape.text(),
            initial_pose: line(&numbers_of(&fitted)),
            pose_parameters: [deviations].iter().chain(&limits(&theirs.humanoid, &fitted)).map(line).collect(),
            farthest_m: apart.fold(0.0, f64::max),
        })
    }
}

fn line(numbers: &[f64; BODYTRACK_NUMBERS]) -> String {
    numbers.map(|number| format!("{number:.6}")).join(" ") + "\n"
}

/// The markers of a pose.
///
/// # Errors
/// The marker that the body lacks.
fn places(body: &Humanoid, pose: &Pose) -> Result<[Point3<f64>; LANDMARKS.len()], Landmark> {
    let markers = body.markers(&body.link_frames(pose));
    match LANDMARKS.into_iter().find(|landmark| markers[*landmark as usize].is_none()) {
        Some(landmark) => Err(landmark),
        None => Ok(markers.map(Option::unwrap_or_default)),
    }
}

/// Goals at these places, and near the angles of a pose where the places leave them open.
fn goals(theirs: &Humanoid, places: &[Point3<f64>], near: &Pose) -> Goals {
    let on = theirs.markers.iter().zip(places);
    let points = on.filter_map(|(on, target)| Some(PointGoal { on: (*on)?, target: *target, weight: 1.0 }));
    let angle = |target: &f64| AngleGoal { target: *target, metres_per_unit: REST };
    Goals { points: points.collect(), angles: near.joint_angles.iter().map(angle).collect(), ..Goals::default() }
}

/// The best fit from several poses of the arms, with the trunk as the markers have it.
fn fitted_from_rest(theirs: &BodytrackBody, places: &[Point3<f64>; LANDMARKS.len()]) -> PoseSolution {
    let [left, right] = [Landmark::LeftHip, Landmark::RightHip].map(|hip| places[hip as usize]);
    let hips = nalgebra::center(&left, &right);
    let (y, up) = (left - right, places[Landmark::Thorax as usize] - hips);
    let x = y.cross(&up).try_normalize(1e-9);
    let rotation = x.map_or_else(UnitQuaternion::identity, |x| from_axes(x, y.normalize()));
    let mut held = theirs.humanoid.clone();
    for number in THORAX {
        let angle = &mut held.degrees_of_freedom[number - ROOT];
        (angle.lower, angle.upper) = (0.0, 0.0);
    }
    let mut solver = Solver::new(&held);
    let mut fit = |arms: f64| {
        let mut rest = theirs.humanoid.zero_pose();
        rest.world_from_root = Isometry3::from_parts(hips.coords.into(), rotation);
        SHOULDERS.iter().zip([arms, -arms]).for_each(|(number, angle)| rest.joint_angles[number - ROOT] = angle);
        solver.solve(&goals(&theirs.humanoid, places, &rest), &rest, MOST_STEPS)
    };
    let first = fit(ARMS[0]);
    ARMS[1..].iter().map(|arms| fit(*arms)).fold(first, |best, next| if next.cost < best.cost { next } else { best })
}

/// Standard deviations of the numbers from frame to frame: root of the sum of squares of their changes, each by the
/// spread of one number of the tracker's body.
fn deviations(set: &BlindSet, theirs: &BodytrackBody, fitted: &Pose) -> [f64; BODYTRACK_NUMBERS] {
    let Start { body, pose, training, .. } = &set.start;
    let scales = match training {
        Training::Motions(training) => ProposalScales::from_motions(body, &training.motions, Prediction::None)
            .unwrap_or_else(|_| ProposalScales::for_human(body, set.frames_per_second)),
        Training::Spread(spread) => ProposalScales::from_root_mean_squares(&spread.change),
    };
    let mut solver = Solver::new(&theirs.humanoid);
    let from = numbers_of(fitted);
    let mut squares = [0.0; BODYTRACK_NUMBERS];
    for (index, scale) in scales.in_step_order().into_iter().enumerate() {
        let mut step = vec![0.0; body.step_len()];
        step.iter_mut().skip(index).take(1).for_each(|number| *number = scale);
        let Ok(places) = places(body, &body.step(pose, &step)) else { continue };
        let to = numbers_of(&solver.solve(&goals(&theirs.humanoid, &places, fitted), fitted, MOST_STEPS).pose);
        for (number, square) in squares.iter_mut().enumerate() {
            let change = to[number] - from[number];
            let change = if POSITION.contains(&number) { change } else { change - TAU * (change / TAU).round() };
            *square += change * change;
        }
    }
    let [position, angle] = [1000.0 * ProposalScales::ROOT_TRANSLATION_FLOOR_M, ProposalScales::JOINT_FLOOR_RAD];
    std::array::from_fn(|number| squares[number].sqrt().max(if POSITION.contains(&number) { position } else { angle }))
}

/// The least and the greatest numbers, which bodytrack reads but does not use: a full turn either way, one way for
/// knees and elbows, and the surroundings.
fn limits(theirs: &Humanoid, fitted: &Pose) -> [[f64; BODYTRACK_NUMBERS]; 2] {
    let numbers = numbers_of(fitted);
    let limit = |sign: f64| {
        let angles = theirs.degrees_of_freedom.iter().map(|angle| if sign < 0.0 { angle.lower } else { angle.upper });
        let root = [sign * PI; 3].into_iter().chain(numbers[POSITION].iter().map(|place| place + sign * FARTHEST));
        let mut limit = [0.0; BODYTRACK_NUMBERS];
        limit.iter_mut().zip(root.chain(angles)).for_each(|(number, found)| *number = found);
        limit
    };
    [limit(-1.0), limit(1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;
    use crate::fixture::small_set;
    use crate::test_bodies::{person, walk};

    fn start(body: Humanoid, pose: Pose) -> (BodytrackStart, [Point3<f64>; LANDMARKS.len()]) {
        let mut set = small_set(2).unwrap().blind;
        let places = places(&body, &pose).unwrap();
        let training = Training::none(&body);
        set.start = Start { body, pose, training, calibrate: false };
        (BodytrackStart::of(&set).unwrap(), places)
    }

    fn numbers(text: &str) -> Vec<f64> {
        text.split_whitespace().map(|number| number.parse().unwrap()).collect()
    }

    /// The files are read as `evaluate` reads them.
    #[test]
    fn the_initial_pose_has_the_joints_of_the_start_pose() {
        let standing = |name: &str| {
            let body = shipped(name).unwrap();
            let mut pose = body.standing_pose();
            pose.world_from_root = Isometry3::new([1.0, -2.0, 0.9].into(), [0.1, 0.2, 2.5].into());
            let bent = |i: usize| 0.3 * f64::from(i as u32 * 7).sin();
            pose.joint_angles.iter_mut().enumerate().for_each(|(i, angle)| *angle = bent(i));
            body.clamp_to_limits(&mut pose);
            (body, pose)
        };
        let walking = (person(), walk(9).poses[5].clone());
        for (body, pose) in [walking, standing("tracker25"), standing("tracker40"), standing("actor")] {
            let name = body.name.clone();
            let (start, places) = start(body, pose);
            let theirs = BodytrackBody::from_text(&start.shape).unwrap();
            let initial: [f64; BODYTRACK_NUMBERS] = numbers(&start.initial_pose).try_into().unwrap();
            assert!(THORAX.iter().all(|number| initial[*number] == 0.0), "{name}");
            for (found, place) in theirs.markers(&initial).iter().zip(&places) {
                let apart = (found.unwrap() - place).norm();
                assert!(apart < start.farthest_m + 1e-5, "{name}: {apart}");
            }
            assert!(start.farthest_m < 0.025, "{name}: {} m", start.farthest_m);
            let parameters = numbers(&start.pose_parameters);
            let (deviations, limits) = parameters.split_at(BODYTRACK_NUMBERS);
            let (least, greatest) = limits.split_at(BODYTRACK_NUMBERS);
            assert!(deviations.iter().all(|deviation| *deviation > 0.0) && greatest.len() == BODYTRACK_NUMBERS);
            for ((number, least), greatest) in initial.iter().zip(least).zip(greatest) {
                assert!(least <= number && number <= greatest, "{name}: {least} {number} {greatest}");
            }
        }
    }

    /// Capsules of known radii, at a tenth and nine tenths of their length.
    #[test]
    fn cylinders_are_as_thick_as_the_body() {
        let (start, _) = start(person(), person().zero_pose());
        let theirs = BodytrackBody::from_text(&start.shape).unwrap();
        let radii = |cylinder: usize| [theirs.shape.cylinders[cylinder][0], theirs.shape.cylinders[cylinder][1]];
        let near = |found: [f64; 2], expected: [f64; 2]| {
            assert!((0..2).all(|i| (found[i] - expected[i]).abs() < 5e-4), "{found:?}, expected {expected:?}");
        };
        near(radii(5), [0.049, 0.041]);
        near(radii(7), [0.049, 0.041]);
        assert!(theirs.shape.cylinders[5][2..].iter().all(|factor| (factor - 1.0).abs() < 1e-3));
    }

    #[test]
    fn a_body_without_a_marker_is_refused_by_its_name() {
        let mut set = small_set(2).unwrap().blind;
        set.start.body.markers[Landmark::HeadTop as usize] = None;
        let message = BodytrackStart::of(&set).err().unwrap().to_string();
        assert!(message.contains("start/body.json lacks head_top"), "{message}");
    }
}
