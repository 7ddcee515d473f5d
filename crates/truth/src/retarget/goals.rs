//! Goals of pose fitting: marker positions, and priors for angles that markers do not determine; and the solver's start
//! poses.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::spine::equal_shares;
use skiagraph_core::body::inverse_kinematics::{AngleGoal, Goals, PointGoal, PoseSolution, Solver};
use skiagraph_core::body::{Humanoid, Landmark, Markers, Pose, from_axes};

/// Weights of priors on angles, and the iteration limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Weight of one radian from the start pose's angles, as a marker distance in metres. It determines angles that
    /// markers do not (the twist of a straight arm or a head) and hardly affects the others.
    pub stay_m_per_rad: f64,
    /// Weight of one radian from the previous frame, in sequences. [`super::retarget`] takes it as the value at 120
    /// frames per second and scales it with the square root of the rate, as for a random walk.
    pub continuity_m_per_rad: f64,
    /// Maximum number of solver iterations per frame.
    pub max_iterations: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { stay_m_per_rad: 0.003, continuity_m_per_rad: 0.03, max_iterations: 60 }
    }
}

/// Goals that hold every angle at its value in `pose`.
pub(super) fn hold_angles(pose: &Pose, metres_per_unit: f64) -> Vec<AngleGoal> {
    pose.joint_angles.iter().map(|&target| AngleGoal { target, metres_per_unit }).collect()
}

/// Priors: angles stay at the values in `pose`, and the joints of the spine share its bend equally.
pub(super) fn priors(humanoid: &Humanoid, pose: &Pose, options: &FitOptions) -> Goals {
    let angles = hold_angles(pose, options.stay_m_per_rad);
    Goals { angles, differences: equal_shares(humanoid), ..Goals::default() }
}

/// Goals for every marker present on both sides, in addition to `priors`.
pub(super) fn marker_goals(humanoid: &Humanoid, targets: &Markers, priors: Goals) -> Goals {
    let points = humanoid
        .markers
        .iter()
        .zip(targets)
        .filter_map(|(on, target)| Some(PointGoal { on: (*on)?, target: (*target)?, weight: 1.0 }));
    Goals { points: points.collect(), ..priors }
}

/// The best solution from several starts: the given pose, and the body aligned to the trunk's markers with its joints
/// at the start's angles, half-way to the centres of their ranges, and at the centres.
pub(super) fn solve_from_several_starts(
    solver: &mut Solver<'_>,
    humanoid: &Humanoid,
    goals: &Goals,
    targets: &Markers,
    start: &Pose,
    max_iterations: usize,
) -> PoseSolution {
    let mut best = solver.solve(goals, start, max_iterations);
    for share in [0.0, 0.5, 1.0] {
        let mut pose = start.clone();
        for (angle, limits) in pose.joint_angles.iter_mut().zip(&humanoid.degrees_of_freedom) {
            let middle = 0.5 * (limits.lower + limits.upper);
            if middle.is_finite() {
                *angle += share * (middle - *angle);
            }
        }
        if let Some(world_from_root) = root_aligned_to_trunk(humanoid, targets) {
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

/// The root's frame that aligns the zero pose's trunk (hips and thorax) with that of the targets.
fn root_aligned_to_trunk(humanoid: &Humanoid, targets: &Markers) -> Option<Isometry3<f64>> {
    let own = trunk_frame(&humanoid.markers(&humanoid.link_frames(&humanoid.zero_pose())))?;
    Some(trunk_frame(targets)? * own.inverse())
}

/// Frame at the midpoint of the hips, with Y towards the left hip and Z as close to the thorax's direction as possible.
fn trunk_frame(markers: &Markers) -> Option<Isometry3<f64>> {
    let place = |landmark: Landmark| markers[landmark as usize];
    let (left, right, thorax) = (place(Landmark::LeftHip)?, place(Landmark::RightHip)?, place(Landmark::Thorax)?);
    let middle = nalgebra::center(&left, &right);
    let y = (left - right).try_normalize(1e-6)?;
    let x: Vector3<f64> = y.cross(&(thorax - middle)).try_normalize(1e-6)?;
    let rotation: UnitQuaternion<f64> = from_axes(x, y);
    Some(Isometry3::from_parts(middle.coords.into(), rotation))
}

/// Distance of every marker from its target, metres.
pub(super) fn marker_distances(humanoid: &Humanoid, targets: &Markers, pose: &Pose) -> [Option<f64>; 15] {
    let markers = humanoid.markers(&humanoid.link_frames(pose));
    std::array::from_fn(|i| Some((markers[i]? - targets[i]?).norm()))
}
