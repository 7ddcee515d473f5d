//! Fits a body to marker positions of another body or a subject.

use super::continuity::{Waypoint, solve_sequence};
use super::goals::{FitOptions, marker_distances, marker_goals, priors, solve_from_several_starts};
use skiagraph_core::body::inverse_kinematics::{Goals, PoseSolution, Solver};
use skiagraph_core::body::{Humanoid, Markers, Pose};

/// A pose fitted to markers.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The pose, inside the joint limits.
    pub pose: Pose,
    /// Root mean square distance over the markers present on both sides, metres; 0 without any.
    pub residual_rms_m: f64,
    /// Number of solver iterations.
    pub iterations: usize,
    /// Distance per marker, metres, in the order of [`skiagraph_core::body::LANDMARKS`]; `None` if missing on either
    /// side.
    pub per_marker: [Option<f64>; 15],
}

/// The pose of `humanoid` whose markers fit `targets` best in least squares, within the joint limits. Angles not
/// determined by markers stay at those of `start`, a pose of this humanoid that may be far away.
pub fn fit_to_markers(humanoid: &Humanoid, targets: &Markers, start: &Pose, options: &FitOptions) -> Fit {
    let mut solver = Solver::new(humanoid);
    let goals = marker_goals(humanoid, targets, priors(humanoid, start, options));
    let solution = solve_from_several_starts(&mut solver, humanoid, &goals, targets, start, options.max_iterations);
    measured(humanoid, targets, solution)
}

/// [`fit_to_markers`] for every frame of a sequence, each starting from the previous frame and held near it.
pub fn fit_motion_to_markers(humanoid: &Humanoid, targets: &[Markers], start: &Pose, options: &FitOptions) -> Vec<Fit> {
    let priors = priors(humanoid, start, options);
    let goals: Vec<Goals> = targets.iter().map(|markers| marker_goals(humanoid, markers, priors.clone())).collect();
    let waypoints =
        goals.iter().zip(targets).map(|(goals, markers)| Waypoint { goals, markers, max_turn: f64::INFINITY });
    let solutions = solve_sequence(&mut Solver::new(humanoid), humanoid, waypoints, start, options);
    targets.iter().zip(solutions).map(|(markers, solution)| measured(humanoid, markers, solution)).collect()
}

fn measured(humanoid: &Humanoid, targets: &Markers, solution: PoseSolution) -> Fit {
    let per_marker = marker_distances(humanoid, targets, &solution.pose);
    let squares: Vec<f64> = per_marker.iter().flatten().map(|d| d * d).collect();
    let residual_rms_m = libm::sqrt(squares.iter().sum::<f64>() / squares.len().max(1) as f64);
    Fit { pose: solution.pose, residual_rms_m, iterations: solution.iterations, per_marker }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Vector3};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use skiagraph_core::body::{Landmark, shipped};

    /// A pose well inside the limits, at a random position and heading.
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
    fn markers_of_a_distant_pose_are_met_to_a_millimetre() {
        let body = shipped("tracker25").unwrap();
        for seed in 0..40 {
            let targets = body.markers(&body.link_frames(&random_pose(&body, seed)));
            let fit = fit_to_markers(&body, &targets, &body.zero_pose(), &FitOptions::default());
            assert!(fit.residual_rms_m < 1e-3, "pose {seed}: {} m after {}", fit.residual_rms_m, fit.iterations);
        }
    }

    #[test]
    fn a_sequence_of_markers_is_followed_without_a_missing_marker() {
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
    fn a_hyperextended_knee_stays_at_its_limit() {
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
