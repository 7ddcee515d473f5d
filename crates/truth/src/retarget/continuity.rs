//! Poses of all frames of a subject, continuous in time.
//!
//! Frames are solved in order, each starting from the previous one and held near it, in a forward and a backward pass.
//! Where both passes agree, their mean has no lag. Where they differ, one pass is in a local minimum at the joint
//! limits, which it leaves by a jump; the other pass often avoids it. For each such stretch the pass with the lower
//! cost is used; at its ends both agree, so there is no jump. A step in which the body would rotate faster than the
//! recording is solved again with a higher continuity weight.

use std::ops::Range;

use super::anatomy::SubjectFrame;
use super::calibration::SegmentCalibration;
use super::goals::{FitOptions, hold_angles, marker_distances, marker_goals, priors, solve_from_several_starts};
use super::turning::largest_rotation;
use skiagraph_core::body::inverse_kinematics::{Goals, PoseSolution, Solver};
use skiagraph_core::body::{Humanoid, Markers, Pose};

/// Passes agree if all differences are below this, radians or metres.
const AGREEMENT: f64 = 0.02;

/// Landmark distance, metres, above which a pass may be in a wrong local minimum.
const SUSPICIOUS_DISTANCE: f64 = 0.1;

/// Factor on the continuity weight per attempt for a step that rotates too fast, and the number of attempts.
const WEIGHT_INCREASE: f64 = 3.0;
const ATTEMPTS: usize = 3;

/// The goals of one frame of a pass.
pub(super) struct Waypoint<'a> {
    pub(super) goals: &'a Goals,
    pub(super) markers: &'a Markers,
    /// Largest allowed rotation of a link in the step into the frame, radians.
    pub(super) max_turn: f64,
}

/// The pose of every frame. `posed` has poses of some frames in order, used as starts; `turns` is the largest allowed
/// rotation of a link in the step into each frame, radians.
pub(super) fn pose_all(
    humanoid: &Humanoid,
    subject: &[SubjectFrame],
    calibration: &SegmentCalibration,
    posed: &[(usize, Pose)],
    turns: &[f64],
    options: &FitOptions,
) -> Vec<Pose> {
    let priors = priors(humanoid, &humanoid.zero_pose(), options);
    let goals: Vec<Goals> = subject
        .iter()
        .map(|frame| Goals {
            orientations: calibration.goals(frame),
            ..marker_goals(humanoid, &frame.markers, priors.clone())
        })
        .collect();
    let start = |end: Option<&(usize, Pose)>| end.map_or_else(|| humanoid.zero_pose(), |(_, pose)| pose.clone());
    let mut solver = Solver::new(humanoid);
    let waypoint =
        |frame: usize, max_turn: f64| Waypoint { goals: &goals[frame], markers: &subject[frame].markers, max_turn };
    let forward_waypoints = (0..goals.len()).map(|frame| waypoint(frame, turns[frame]));
    let backward_waypoints =
        (0..goals.len()).rev().map(|frame| waypoint(frame, turns.get(frame + 1).copied().unwrap_or(0.0)));
    let poses =
        |solutions: Vec<PoseSolution>| solutions.into_iter().map(|solution| solution.pose).collect::<Vec<Pose>>();
    let forward = poses(solve_sequence(&mut solver, humanoid, forward_waypoints, &start(posed.first()), options));
    let mut backward = poses(solve_sequence(&mut solver, humanoid, backward_waypoints, &start(posed.last()), options));
    backward.reverse();
    merge(&mut solver, humanoid, &goals, forward, &backward)
}

/// Solves frames in order, each starting from the previous one and held near it. If a landmark stays far from its goal,
/// all starts are tried again, and a much better solution is used. A step that rotates a link too far is repeated with
/// a higher weight.
pub(super) fn solve_sequence<'a>(
    solver: &mut Solver<'_>,
    humanoid: &Humanoid,
    frames: impl Iterator<Item = Waypoint<'a>>,
    start: &Pose,
    options: &FitOptions,
) -> Vec<PoseSolution> {
    let mut solutions: Vec<PoseSolution> = Vec::new();
    for Waypoint { goals, markers, max_turn } in frames {
        let Some(previous) = solutions.last() else {
            solutions.push(solve_from_several_starts(solver, humanoid, goals, markers, start, options.max_iterations));
            continue;
        };
        let mut step = |metres_per_radian: f64| {
            let mut held = goals.clone();
            let before = hold_angles(&previous.pose, metres_per_radian);
            held.angles = held.angles.into_iter().zip(before).map(|(rest, before)| rest.and(before)).collect();
            solver.solve(&held, &previous.pose, options.max_iterations)
        };
        let mut hold = options.continuity_m_per_rad;
        let mut solution = step(hold);
        if max_turn.is_finite() {
            let before = humanoid.link_frames(&previous.pose);
            let is_too_fast =
                |pose: &Pose| largest_rotation(humanoid, &before, &humanoid.link_frames(pose)).1 > max_turn;
            for _ in 0..ATTEMPTS {
                if !is_too_fast(&solution.pose) {
                    break;
                }
                hold *= WEIGHT_INCREASE;
                solution = step(hold);
            }
        }
        let distances = marker_distances(humanoid, markers, &solution.pose);
        if distances.iter().flatten().any(|distance| *distance > SUSPICIOUS_DISTANCE) {
            let restarted = solve_from_several_starts(solver, humanoid, goals, markers, start, options.max_iterations);
            if restarted.cost < 0.5 * solver.cost(goals, &solution.pose) {
                solution = restarted;
            }
        }
        solutions.push(solution);
    }
    solutions
}

/// The mean of both passes where they agree; for each stretch where they differ, the better pass.
fn merge(
    solver: &mut Solver<'_>,
    humanoid: &Humanoid,
    goals: &[Goals],
    mut forward: Vec<Pose>,
    backward: &[Pose],
) -> Vec<Pose> {
    let mut step = vec![0.0; humanoid.step_len()];
    let mut differs = Vec::with_capacity(forward.len());
    for (ahead, back) in forward.iter_mut().zip(backward) {
        humanoid.difference(ahead, back, &mut step);
        differs.push(step.iter().any(|s| s.abs() > AGREEMENT));
        if differs.last() == Some(&false) {
            step.iter_mut().for_each(|s| *s *= 0.5);
            *ahead = humanoid.step(ahead, &step);
        }
    }
    for stretch in stretches(&differs) {
        let mut cost = |poses: &[Pose]| stretch.clone().map(|i| solver.cost(&goals[i], &poses[i])).sum::<f64>();
        if cost(backward) < cost(&forward) {
            forward[stretch.clone()].clone_from_slice(&backward[stretch]);
        }
    }
    forward
}

/// The runs of `true`, as index ranges.
fn stretches(flags: &[bool]) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for (index, _) in flags.iter().enumerate().filter(|(_, flag)| **flag) {
        match found.last_mut() {
            Some(stretch) if stretch.end == index => stretch.end += 1,
            _ => found.push(index..index + 1),
        }
    }
    found
}
