//! All frames of a subject posed, each near its neighbours.
//!
//! Frames are solved in order, each from the one before and held near it, once forward and once backward in time. Where
//! both ways agree, the middle of the two has the lag of neither. Where they do not, one of them has run into a corner of the
//! joint limits that it must leave by a leap; from the other side the same stretch is often entered by the right door. For each
//! such stretch the way that meets the goals better is taken; at its ends both agree, so nothing leaps. A step in which the body
//! would turn faster than anything recorded is held more firmly.

use std::ops::Range;

use super::anatomy::SubjectFrame;
use super::calibration::Calibration;
use super::goals::{FitOptions, marker_distances, marker_goals, priors, solve_from_afar, stay};
use super::turning::greatest_turn;
use crate::body::inverse_kinematics::{Goals, Solution, Solver};
use crate::body::{Humanoid, Markers, Pose};

/// Poses whose numbers all lie this near are the same pose, radians or metres.
const AGREEMENT: f64 = 0.02;

/// A landmark this far off, metres, raises the suspicion that the way has gone astray.
const ASTRAY: f64 = 0.1;

/// How much more firmly a step that turns too fast is held at each attempt, and how many attempts there are.
const FIRMER: f64 = 3.0;
const ATTEMPTS: usize = 3;

/// What one frame of a way asks for.
pub(super) struct Waypoint<'a> {
    pub(super) goals: &'a Goals,
    pub(super) markers: &'a Markers,
    /// The angle by which no link should turn on the step into the frame, radians.
    pub(super) most: f64,
}

/// The pose of every frame. `posed` holds poses of some frames, in order, to start from; `turns` what no link should turn on the
/// step into each frame, radians.
pub(super) fn pose_all(
    humanoid: &Humanoid,
    subject: &[SubjectFrame],
    calibration: &Calibration,
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
    let poses = |solutions: Vec<Solution>| solutions.into_iter().map(|solution| solution.pose).collect::<Vec<Pose>>();
    let forward = poses(follow(&mut solver, humanoid, ahead, &start(posed.first()), options));
    let mut backward = poses(follow(&mut solver, humanoid, back, &start(posed.last()), options));
    backward.reverse();
    merge(&mut solver, humanoid, &goals, forward, &backward)
}

/// Solves frame after frame, each from the one before and held near it. Where a landmark stays far off, all starts are tried
/// anew, and one that meets the goals much better is taken. A step that turns a link too far is taken again, held more firmly.
pub(super) fn follow<'a>(
    solver: &mut Solver<'_>,
    humanoid: &Humanoid,
    frames: impl Iterator<Item = Waypoint<'a>>,
    start: &Pose,
    options: &FitOptions,
) -> Vec<Solution> {
    let mut solutions: Vec<Solution> = Vec::new();
    for Waypoint { goals, markers, most } in frames {
        let Some(previous) = solutions.last() else {
            solutions.push(solve_from_afar(solver, humanoid, goals, markers, start, options.max_iterations));
            continue;
        };
        let mut step = |metres_per_radian: f64| {
            let mut held = goals.clone();
            let before = stay(&previous.pose, metres_per_radian);
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

/// The middle of both ways where they agree, the better one of each stretch where they do not.
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
