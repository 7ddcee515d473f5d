//! All frames of a subject posed, each near its neighbours.
//!
//! Frames are solved in order, each from the one before and held near it, once forward and once backward in time. Where
//! both ways agree, the middle of the two has the lag of neither. Where they do not, one of them has run into a corner of the
//! joint limits that it must leave by a leap; from the other side the same stretch is often entered by the right door. For each
//! such stretch the way that meets the goals better is taken; at its ends both agree, so nothing leaps.

use std::ops::Range;

use super::anatomy::SubjectFrame;
use super::calibration::Calibration;
use super::fit::{FitOptions, marker_distances, marker_goals, solve_from_afar, stay};
use super::solver::{Goals, Solution, Solver};
use crate::body::{Humanoid, Markers, Pose};

/// Poses whose numbers all lie this near are the same pose, radians or metres.
const AGREEMENT: f64 = 0.02;

/// A landmark this far off, metres, raises the suspicion that the way has gone astray.
const ASTRAY: f64 = 0.1;

/// The pose of every frame. `posed` holds poses of some frames, in order, to start from.
pub(super) fn pose_all(
    humanoid: &Humanoid,
    subject: &[SubjectFrame],
    calibration: &Calibration,
    posed: &[(usize, Pose)],
    options: &FitOptions,
) -> Vec<Pose> {
    let rest = stay(&humanoid.zero_pose(), options.stay_m_per_rad);
    let goals: Vec<Goals> = subject
        .iter()
        .map(|frame| Goals {
            orientations: calibration.goals(frame),
            ..marker_goals(humanoid, &frame.markers, rest.clone())
        })
        .collect();
    let start = |end: Option<&(usize, Pose)>| end.map_or_else(|| humanoid.zero_pose(), |(_, pose)| pose.clone());
    let mut solver = Solver::new(humanoid);
    let frames = || goals.iter().zip(subject.iter().map(|frame| &frame.markers));
    let poses = |solutions: Vec<Solution>| solutions.into_iter().map(|solution| solution.pose).collect::<Vec<Pose>>();
    let forward = poses(follow(&mut solver, humanoid, frames(), &start(posed.first()), options));
    let mut backward = poses(follow(&mut solver, humanoid, frames().rev(), &start(posed.last()), options));
    backward.reverse();
    merge(&mut solver, humanoid, &goals, forward, &backward)
}

/// Solves frame after frame, each from the one before and held near it. Where a landmark stays far off, all starts are tried
/// anew, and one that meets the goals much better is taken.
pub(super) fn follow<'a>(
    solver: &mut Solver<'_>,
    humanoid: &Humanoid,
    frames: impl Iterator<Item = (&'a Goals, &'a Markers)>,
    start: &Pose,
    options: &FitOptions,
) -> Vec<Solution> {
    let mut solutions: Vec<Solution> = Vec::new();
    for (goals, markers) in frames {
        let Some(previous) = solutions.last() else {
            solutions.push(solve_from_afar(solver, humanoid, goals, markers, start, options.max_iterations));
            continue;
        };
        let mut held = goals.clone();
        let before = stay(&previous.pose, options.continuity_m_per_rad);
        held.angles = held.angles.into_iter().zip(before).map(|(rest, before)| rest.and(before)).collect();
        let mut solution = solver.solve(&held, &previous.pose, options.max_iterations);
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
