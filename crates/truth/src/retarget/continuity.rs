//! All frames of a subject posed, each near its neighbours.
//!
//! Frames are solved in order, each starting from the previous one and held near it, once forward and once backward in
//! time. If both passes agree, their mean has no lag. If they do not, one pass is caught in a local minimum at the
//! joint limits, which it leaves by a jump; the other pass often avoids that local minimum. For each such stretch the
//! pass with the lower cost is used; at its ends both agree, so there is no jump. A step in which the body would turn
//! faster than anything recorded is held more firmly.

use std::ops::Range;

use super::anatomy::SubjectFrame;
use super::calibration::SegmentCalibration;
use super::goals::{FitOptions, hold_angles, marker_distances, marker_goals, priors, solve_from_afar};
use super::turning::greatest_turn;
use crate::body::inverse_kinematics::{Goals, PoseSolution, Solver};
use crate::body::{Humanoid, Markers, Pose};

/// Poses with all differences below this are equal, radians or metres.
const AGREEMENT: f64 = 0.02;

/// Landmark distance, metres, above which a pass may be in a wrong local minimum.
const ASTRAY: f64 = 0.1;

/// Factor on the weight of a step that turns too fast at each attempt, and the number of attempts.
const FIRMER: f64 = 3.0;
const ATTEMPTS: usize = 3;

/// The goals of one frame of a pass.
pub(super) struct Waypoint<'a> {
    pub(super) goals: &'a Goals,
    pub(super) markers: &'a Markers,
    /// Largest rotation of a link on the step into the frame, radians.
    pub(super) most: f64,
}

/// The pose of every frame. `posed` holds poses of some frames, in order, to start from; `turns` the largest rotation
/// of a link on the step into each frame, radians.
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
    let waypoint = |frame: usize, most: f64| Waypoint { goals: &goals[frame], markers: &subject[frame].markers, most };
    let ahead = (0..goals.len()).map(|frame| waypoint(frame, turns[frame]));
    let back = (0..goals.len()).rev().map(|frame| waypoint(frame, turns.get(frame + 1).copied().unwrap_or(0.0)));
    let poses =
        |solutions: Vec<PoseSolution>| solutions.into_iter().map(|solution| solution.pose).collect::<Vec<Pose>>();
    let forward = poses(solve_sequence(&mut solver, humanoid, ahead, &start(posed.first()), options));
    let mut backward = poses(solve_sequence(&mut solver, humanoid, back, &start(posed.last()), options));
    backward.reverse();
    merge(&mut solver, humanoid, &goals, forward, &backward)
}

/// Solves frame after frame, each from the previous one and held near it. If a landmark stays far off, all starts are
/// tried again, and a much better one is used. A step that turns a link too far is repeated with a higher weight.
pub(super) fn solve_sequence<'a>(
    solver: &mut Solver<'_>,
    humanoid: &Humanoid,
    frames: impl Iterator<Item = Waypoint<'a>>,
    start: &Pose,
    options: &FitOptions,
) -> Vec<PoseSolution> {
    let mut solutions: Vec<PoseSolution> = Vec::new();
    for Waypoint { goals, markers, most } in frames {
        let Some(previous) = solutions.last() else {
            solutions.push(solve_from_afar(solver, humanoid, goals, markers, start, options.max_iterations));
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
        if most.is_finite() {
            let before = humanoid.link_frames(&previous.pose);
            let is_too_fast = |pose: &Pose| greatest_turn(humanoid, &before, &humanoid.link_frames(pose)).1 > most;
            for _ in 0..ATTEMPTS {
                if !is_too_fast(&solution.pose) {
                    break;
                }
                hold *= FIRMER;
                solution = step(hold);
            }
        }
        let distances = marker_distances(humanoid, markers, &solution.pose);
        if distances.iter().flatten().any(|distance| *distance > ASTRAY) {
            let anew = solve_from_afar(solver, humanoid, goals, markers, start, options.max_iterations);
            if anew.cost < 0.5 * solver.cost(goals, &solution.pose) {
                solution = anew;
            }
        }
        solutions.push(solution);
    }
    solutions
}

/// The mean of both passes where they agree, the better one for each stretch where they do not.
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

/// The runs of `true`.
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
