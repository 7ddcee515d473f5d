//! Fits a body to given marker positions: another body's markers, or a subject's.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::continuity::{Waypoint, follow};
use super::spine::equal_shares;
use crate::body::inverse_kinematics::{AngleGoal, Goals, PointGoal, Solution, Solver};
use crate::body::{Humanoid, Landmark, Markers, Pose, from_axes};

/// Weights for what markers do not determine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Weight of one radian from the start pose's angles, as a marker distance in metres. It determines what markers do
    /// not (the twist of a straight arm or a head) and hardly affects the rest.
    pub stay_m_per_rad: f64,
    /// The same for the change from the previous frame, in sequences; [`super::retarget`] uses it at 120 frames a
    /// second and scales it with the square root of the rate, as for a random walk.
    pub continuity_m_per_rad: f64,
    /// Largest number of solver steps per frame.
    pub max_iterations: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { stay_m_per_rad: 0.003, continuity_m_per_rad: 0.03, max_iterations: 60 }
    }
}

/// A pose fitted to markers.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The pose, inside the joint limits.
    pub pose: Pose,
    /// Root mean square distance over the markers that both sides have, metres; 0 without any.
    pub residual_rms_m: f64,
    /// Steps of the solver.
    pub iterations: usize,
    /// Distance per marker, metres, in the order of [`crate::body::LANDMARKS`]; `None` where either side lacks it.
    pub per_marker: [Option<f64>; 15],
}

/// The pose of `humanoid` whose markers come nearest to `targets` in least squares, within the joint limits. Angles that
/// markers do not determine stay at `start`'s; `start`, a pose of this humanoid, may be far away.
pub fn fit_to_markers(humanoid: &Humanoid, targets: &Markers, start: &Pose, options: &FitOptions) -> Fit {
    let mut solver = Solver::new(humanoid);
    let goals = marker_goals(humanoid, targets, priors(humanoid, start, options));
    let solution = solve_from_afar(&mut solver, humanoid, &goals, targets, start, options.max_iterations);
    measured(humanoid, targets, solution)
}

/// [`fit_to_markers`] for every frame of a sequence, each starting from the previous frame and held near it.
pub fn fit_motion_to_markers(humanoid: &Humanoid, targets: &[Markers], start: &Pose, options: &FitOptions) -> Vec<Fit> {
    let priors = priors(humanoid, start, options);
    let goals: Vec<Goals> = targets.iter().map(|markers| marker_goals(humanoid, markers, priors.clone())).collect();
    let waypoints = goals.iter().zip(targets).map(|(goals, markers)| Waypoint { goals, markers, most: f64::INFINITY });
    let solutions = follow(&mut Solver::new(humanoid), humanoid, waypoints, start, options);
    targets.iter().zip(solutions).map(|(markers, solution)| measured(humanoid, markers, solution)).collect()
}

/// Goals that hold every angle at its value in a pose.
pub(super) fn stay(pose: &Pose, metres_per_unit: f64) -> Vec<AngleGoal> {
    pose.joint_angles.iter().map(|&target| AngleGoal { target, metres_per_unit }).collect()
}

/// Priors: angles stay at a pose's values, and the joints of the spine share its bend.
pub(super) fn priors(humanoid: &Humanoid, pose: &Pose, options: &FitOptions) -> Goals {
    let angles = stay(pose, options.stay_m_per_rad);
    Goals { angles, differences: equal_shares(humanoid), ..Goals::default() }
}

/// Goals for every marker that both sides have, in addition to `priors`.
pub(super) fn marker_goals(humanoid: &Humanoid, targets: &Markers, priors: Goals) -> Goals {
    let points = humanoid
        .markers
        .iter()
        .zip(targets)
        .filter_map(|(on, target)| Some(PointGoal { on: (*on)?, target: (*target)?, weight: 1.0 }));
    Goals { points: points.collect(), ..priors }
}

/// The best of several starts: the pose given, and the body set upright on the trunk's markers with its joints at the start's
/// angles, half-way to the middle of their ranges, and at the middle.
pub(super) fn solve_from_afar(
    solver: &mut Solver<'_>,
    humanoid: &Humanoid,
    goals: &Goals,
    targets: &Markers,
    start: &Pose,
    max_iterations: usize,
) -> Solution {
    let mut best = solver.solve(goals, start, max_iterations);
    for share in [0.0, 0.5, 1.0] {
        let mut pose = start.clone();
        for (angle, limits) in pose.joint_angles.iter_mut().zip(&humanoid.degrees_of_freedom) {
            let middle = 0.5 * (limits.lower + limits.upper);
            if middle.is_finite() {
                *angle += share * (middle - *angle);
            }
        }
        if let Some(world_from_root) = root_on_trunk(humanoid, targets) {
            pose.world_from_root = world_from_root;
        }
        let solution = solver.solve(goals, &pose, max_iterations);
        let iterations = best.iterations + solution.iterations;
        if solution.cost < best.cost {
            best = solution;
        }
        best.iterations = iterations;
    }
    best
}

/// The root's frame when the zero pose's trunk (hips and thorax) is aligned with the targets'.
fn root_on_trunk(humanoid: &Humanoid, targets: &Markers) -> Option<Isometry3<f64>> {
    let own = trunk_frame(&humanoid.markers(&humanoid.link_frames(&humanoid.zero_pose())))?;
    Some(trunk_frame(targets)? * own.inverse())
}

/// At the middle of the hips, Y towards the left hip, Z as nearly towards the thorax as that allows.
fn trunk_frame(markers: &Markers) -> Option<Isometry3<f64>> {
    let place = |landmark: Landmark| markers[landmark as usize];
    let (left, right, thorax) = (place(Landmark::LeftHip)?, place(Landmark::RightHip)?, place(Landmark::Thorax)?);
    let middle = nalgebra::center(&left, &right);
    let y = (left - right).try_normalize(1e-6)?;
    let x: Vector3<f64> = y.cross(&(thorax - middle)).try_normalize(1e-6)?;
    let rotation: UnitQuaternion<f64> = from_axes(x, y);
    Some(Isometry3::from_parts(middle.coords.into(), rotation))
}

fn measured(humanoid: &Humanoid, targets: &Markers, solution: Solution) -> Fit {
    let per_marker = marker_distances(humanoid, targets, &solution.pose);
    let squares: Vec<f64> = per_marker.iter().flatten().map(|d| d * d).collect();
    let residual_rms_m = libm::sqrt(squares.iter().sum::<f64>() / squares.len().max(1) as f64);
    Fit { pose: solution.pose, residual_rms_m, iterations: solution.iterations, per_marker }
}

/// Distance of every marker from its target, metres.
pub(super) fn marker_distances(humanoid: &Humanoid, targets: &Markers, pose: &Pose) -> [Option<f64>; 15] {
    let markers = humanoid.markers(&humanoid.link_frames(pose));
    std::array::from_fn(|i| Some((markers[i]? - targets[i]?).norm()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A pose well inside the limits, somewhere on the ground plane, facing anywhere.
    fn random_pose(humanoid: &Humanoid, seed: u64) -> Pose {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut within = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let mut pose = humanoid.zero_pose();
        let place = Vector3::new(within(-3.0, 3.0), within(-3.0, 3.0), 0.9);
        pose.world_from_root = Isometry3::new(place, Vector3::new(0.0, 0.0, within(-3.1, 3.1)));
        for (angle, limits) in pose.joint_angles.iter_mut().zip(&humanoid.degrees_of_freedom) {
            *angle = within(0.6 * limits.lower, 0.6 * limits.upper);
        }
        pose
    }

    #[test]
    fn markers_of_a_far_pose_are_met_to_a_tenth_of_a_millimetre() {
        let body = shipped("tracker25").unwrap();
        for seed in 0..40 {
            let targets = body.markers(&body.link_frames(&random_pose(&body, seed)));
            let fit = fit_to_markers(&body, &targets, &body.zero_pose(), &FitOptions::default());
            assert!(fit.residual_rms_m < 1e-3, "pose {seed}: {} m after {}", fit.residual_rms_m, fit.iterations);
        }
    }

    #[test]
    fn a_sequence_of_markers_is_followed_and_a_missing_marker_is_left_out() {
        let body = shipped("tracker25").unwrap();
        let (from, to) = (random_pose(&body, 1), random_pose(&body, 2));
        let mut step = vec![0.0; body.step_len()];
        body.difference(&from, &to, &mut step);
        let targets: Vec<Markers> = (0..30)
            .map(|i| {
                let part: Vec<f64> = step.iter().map(|s| s * f64::from(i) / 60.0).collect();
                let mut markers = body.markers(&body.link_frames(&body.step(&from, &part)));
                markers[Landmark::LeftWrist as usize] = None;
                markers
            })
            .collect();
        let fits = fit_motion_to_markers(&body, &targets, &from, &FitOptions::default());
        for (frame, fit) in fits.iter().enumerate() {
            assert!(fit.residual_rms_m < 1e-3, "frame {frame}: {} m", fit.residual_rms_m);
            assert!(fit.per_marker[Landmark::LeftWrist as usize].is_none());
        }
    }

    #[test]
    fn a_knee_that_is_asked_to_bend_forward_stays_at_its_limit() {
        let body = shipped("tracker25").unwrap();
        let knee = body.find_degree_of_freedom("left_knee_flexion").unwrap();
        let mut broken = body.zero_pose();
        broken.joint_angles[knee] = -0.5;
        let targets = body.markers(&body.link_frames(&broken));
        let fit = fit_to_markers(&body, &targets, &body.zero_pose(), &FitOptions::default());
        assert!(fit.pose.joint_angles[knee].abs() < 1e-9, "{}", fit.pose.joint_angles[knee]);
        assert!(fit.residual_rms_m > 0.01 && fit.residual_rms_m < 0.06, "{}", fit.residual_rms_m);
    }

    #[test]
    fn absurd_markers_give_a_finite_pose_inside_the_limits() {
        let body = shipped("tracker25").unwrap();
        let place = |i: usize| Some(nalgebra::Point3::new(1e6 * i as f64, -1e5, 1e7));
        for targets in [[None; 15], std::array::from_fn(place), [Some(nalgebra::Point3::origin()); 15]] {
            let fit = fit_to_markers(&body, &targets, &body.zero_pose(), &FitOptions::default());
            let angles = fit.pose.joint_angles.iter().zip(&body.degrees_of_freedom);
            assert!(angles.into_iter().all(|(a, l)| *a >= l.lower && *a <= l.upper));
            assert!(fit.pose.world_from_root.translation.vector.iter().all(|v| v.is_finite()));
        }
    }
}
