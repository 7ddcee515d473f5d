//! Inverse kinematics of one frame: weighted non-linear least squares with joint limits.
//!
//! Levenberg-Marquardt (`[Marquardt 1963]`) on the normal equations, with joint limits enforced by projection: a
//! degree of freedom at its limit whose gradient points outward is frozen for the step (`[Bertsekas 1982]`), all
//! others move and are clamped. Every accepted step lowers the cost, and the number of steps is bounded, so the result
//! is always finite.
//!
//! Sums are plain loops in a fixed order, and the Cholesky factorisation is implemented here: nalgebra selects kernels
//! of matrix products by processor, so the ground truth would differ between machines.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::{Humanoid, LinkFrames, LinkPoint, Pose, rotation_from_vector, rotation_vector};

/// Goal: a point of the body at a position.
#[derive(Clone, Copy, Debug)]
pub struct PointGoal {
    pub on: LinkPoint,
    pub target: Point3<f64>,
    /// Factor on the distance in metres.
    pub weight: f64,
}

/// Goal: an orientation of a link.
#[derive(Clone, Copy, Debug)]
pub struct OrientationGoal {
    pub link: usize,
    pub world_from_link: UnitQuaternion<f64>,
    /// Weight of one radian, as a distance in metres.
    pub metres_per_radian: f64,
}

/// Goal: a value of a degree of freedom.
#[derive(Clone, Copy, Debug, Default)]
pub struct AngleGoal {
    pub target: f64,
    /// Weight of one radian (or metre), as a distance in metres.
    pub metres_per_unit: f64,
}

impl AngleGoal {
    /// One goal equivalent to both.
    #[doc(hidden)]
    pub fn and(self, other: Self) -> Self {
        let (a, b) = (self.metres_per_unit * self.metres_per_unit, other.metres_per_unit * other.metres_per_unit);
        if a + b == 0.0 {
            return self;
        }
        Self { target: (a * self.target + b * other.target) / (a + b), metres_per_unit: libm::sqrt(a + b) }
    }
}

/// Goal: two degrees of freedom are equal (`sign` 1) or opposite (-1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DifferenceGoal {
    pub of: [usize; 2],
    pub sign: f64,
    /// Weight of one radian (or metre) of difference, as a distance in metres.
    pub metres_per_unit: f64,
}

impl DifferenceGoal {
    fn residual(&self, pose: &Pose) -> f64 {
        self.sign * pose.joint_angles[self.of[1]] - pose.joint_angles[self.of[0]]
    }
}

/// All goals of a pose.
#[derive(Clone, Debug, Default)]
pub struct Goals {
    pub points: Vec<PointGoal>,
    pub orientations: Vec<OrientationGoal>,
    /// One per degree of freedom.
    pub angles: Vec<AngleGoal>,
    pub differences: Vec<DifferenceGoal>,
}

/// The best pose found.
#[derive(Clone, Debug)]
pub struct PoseSolution {
    pub pose: Pose,
    /// Sum of squares, m^2.
    pub cost: f64,
    pub iterations: usize,
}

/// Solves poses of one humanoid; its buffers are reused between frames.
pub struct Solver<'a> {
    humanoid: &'a Humanoid,
    frames: LinkFrames,
    /// Lower triangle of the normal matrix, row by row, full rows of `size`.
    normal: Vec<f64>,
    gradient: Vec<f64>,
    factor: Vec<f64>,
    step: Vec<f64>,
    frozen: Vec<bool>,
    columns: Vec<(usize, Vector3<f64>)>,
}

/// A step below this, in radians or metres, ends the search.
const SMALLEST_STEP: f64 = 1e-7;
/// A relative gain below this ends the search.
const SMALLEST_GAIN: f64 = 1e-9;
const FIRST_DAMPING: f64 = 1e-6;
const GREATEST_DAMPING: f64 = 1e6;

impl<'a> Solver<'a> {
    #[doc(hidden)]
    pub fn new(humanoid: &'a Humanoid) -> Self {
        let size = 6 + humanoid.degrees_of_freedom.len();
        Self {
            humanoid,
            frames: LinkFrames::default(),
            normal: vec![0.0; size * size],
            gradient: vec![0.0; size],
            factor: vec![0.0; size * size],
            step: vec![0.0; size],
            frozen: vec![false; size],
            columns: Vec::with_capacity(size),
        }
    }

    /// The pose near `start` that best meets the goals, in at most `max_iterations` steps.
    #[doc(hidden)]
    pub fn solve(&mut self, goals: &Goals, start: &Pose, max_iterations: usize) -> PoseSolution {
        let mut pose = start.clone();
        clamp(self.humanoid, &mut pose);
        let mut cost = self.cost(goals, &pose);
        let mut damping = FIRST_DAMPING;
        let mut iterations = 0;
        while iterations < max_iterations {
            iterations += 1;
            self.linearise(goals, &pose);
            self.freeze(&pose);
            let Some((better, new_cost)) = self.descend(goals, &pose, cost, &mut damping) else { break };
            let gain = (cost - new_cost) / cost;
            (pose, cost) = (better, new_cost);
            let longest = self.step.iter().fold(0.0_f64, |longest, s| longest.max(s.abs()));
            if longest < SMALLEST_STEP || gain < SMALLEST_GAIN {
                break;
            }
        }
        PoseSolution { pose, cost, iterations }
    }

    /// Raises the damping until a step lowers the cost; `None` if no step does.
    fn descend(&mut self, goals: &Goals, pose: &Pose, cost: f64, damping: &mut f64) -> Option<(Pose, f64)> {
        while *damping <= GREATEST_DAMPING {
            if self.factorise(*damping) {
                self.substitute();
                let trial = self.moved(pose);
                let trial_cost = self.cost(goals, &trial);
                if trial_cost < cost {
                    *damping = (*damping * 0.1).max(1e-12);
                    return Some((trial, trial_cost));
                }
            }
            *damping *= 10.0;
        }
        None
    }

    /// Residual sum of squares of a pose, m^2.
    #[doc(hidden)]
    pub fn cost(&mut self, goals: &Goals, pose: &Pose) -> f64 {
        self.humanoid.link_frames_into(pose, &mut self.frames);
        let square = |v: f64| v * v;
        let mut sum = 0.0;
        for goal in &goals.points {
            sum += square(goal.weight) * point_residual(goal, &self.frames).norm_squared();
        }
        for goal in &goals.orientations {
            sum += square(goal.metres_per_radian) * orientation_residual(goal, &self.frames).norm_squared();
        }
        for (goal, angle) in goals.angles.iter().zip(pose.joint_angles.iter()) {
            sum += square(goal.metres_per_unit * (goal.target - angle));
        }
        for goal in &goals.differences {
            sum += square(goal.metres_per_unit * goal.residual(pose));
        }
        sum
    }

    /// Normal equations at `pose`: `normal = J^T J`, `gradient = J^T residual`, both weighted.
    fn linearise(&mut self, goals: &Goals, pose: &Pose) {
        self.humanoid.link_frames_into(pose, &mut self.frames);
        self.normal.fill(0.0);
        self.gradient.fill(0.0);
        for goal in &goals.points {
            let point = self.frames[goal.on.link] * goal.on.point_in_link;
            let residual = point_residual(goal, &self.frames);
            self.humanoid.point_columns(pose, &self.frames, goal.on.link, &point, &mut self.columns);
            self.accumulate(&residual, goal.weight * goal.weight);
        }
        for goal in &goals.orientations {
            let residual = orientation_residual(goal, &self.frames);
            self.humanoid.angular_columns(pose, &self.frames, goal.link, &mut self.columns);
            self.accumulate(&residual, goal.metres_per_radian * goal.metres_per_radian);
        }
        let size = self.gradient.len();
        for (i, (goal, angle)) in goals.angles.iter().zip(pose.joint_angles.iter()).enumerate() {
            let square = goal.metres_per_unit * goal.metres_per_unit;
            self.normal[(6 + i) * size + 6 + i] += square;
            self.gradient[6 + i] += square * (goal.target - angle);
        }
        for goal in &goals.differences {
            let square = goal.metres_per_unit * goal.metres_per_unit;
            let [a, b] = goal.of.map(|dof| 6 + dof);
            self.normal[a * size + a] += square;
            self.normal[b * size + b] += square;
            self.normal[a.max(b) * size + a.min(b)] -= goal.sign * square;
            self.gradient[a] += square * goal.residual(pose);
            self.gradient[b] -= goal.sign * square * goal.residual(pose);
        }
    }

    fn accumulate(&mut self, residual: &Vector3<f64>, square: f64) {
        let size = self.gradient.len();
        for (row, a) in &self.columns {
            self.gradient[*row] += square * a.dot(residual);
            for (column, b) in &self.columns {
                if column <= row {
                    self.normal[row * size + column] += square * a.dot(b);
                }
            }
        }
    }

    /// Marks the degrees of freedom that are at a limit and whose gradient points beyond it.
    fn freeze(&mut self, pose: &Pose) {
        for (i, limits) in self.humanoid.degrees_of_freedom.iter().enumerate() {
            let (angle, pull) = (pose.joint_angles[i], self.gradient[6 + i]);
            self.frozen[6 + i] = (angle <= limits.lower && pull < 0.0) || (angle >= limits.upper && pull > 0.0);
        }
    }

    /// Cholesky factorisation of the damped normal matrix, with frozen rows and columns replaced by the identity's.
    fn factorise(&mut self, damping: f64) -> bool {
        let size = self.gradient.len();
        for row in 0..size {
            for column in 0..=row {
                let mut sum = match (self.frozen[row] || self.frozen[column], row == column) {
                    (true, on_diagonal) => f64::from(u8::from(on_diagonal)),
                    (false, false) => self.normal[row * size + column],
                    (false, true) => self.normal[row * size + row] * (1.0 + damping) + damping,
                };
                for k in 0..column {
                    sum -= self.factor[row * size + k] * self.factor[column * size + k];
                }
                if row == column {
                    if sum.is_nan() || sum <= 0.0 {
                        return false;
                    }
                    self.factor[row * size + row] = libm::sqrt(sum);
                } else {
                    self.factor[row * size + column] = sum / self.factor[column * size + column];
                }
            }
        }
        true
    }

    /// Solves for the step with the current factor.
    fn substitute(&mut self) {
        let size = self.gradient.len();
        for row in 0..size {
            let mut sum = if self.frozen[row] { 0.0 } else { self.gradient[row] };
            for k in 0..row {
                sum -= self.factor[row * size + k] * self.step[k];
            }
            self.step[row] = sum / self.factor[row * size + row];
        }
        for row in (0..size).rev() {
            let mut sum = self.step[row];
            for k in row + 1..size {
                sum -= self.factor[k * size + row] * self.step[k];
            }
            self.step[row] = sum / self.factor[row * size + row];
        }
    }

    /// The pose after the step: the root translates in the world and rotates in its own frame.
    fn moved(&self, pose: &Pose) -> Pose {
        let mut trial = pose.clone();
        trial.world_from_root.translation.vector += Vector3::from_column_slice(&self.step[0..3]);
        trial.world_from_root.rotation *= rotation_from_vector(&Vector3::from_column_slice(&self.step[3..6]));
        trial.world_from_root.rotation.renormalize();
        for (angle, step) in trial.joint_angles.iter_mut().zip(&self.step[6..]) {
            *angle += step;
        }
        clamp(self.humanoid, &mut trial);
        trial
    }
}

fn point_residual(goal: &PointGoal, frames: &LinkFrames) -> Vector3<f64> {
    goal.target - frames[goal.on.link] * goal.on.point_in_link
}

/// Rotation vector, in the world, from the link's orientation to the goal.
fn orientation_residual(goal: &OrientationGoal, frames: &LinkFrames) -> Vector3<f64> {
    rotation_vector(&(goal.world_from_link * frames[goal.link].rotation.inverse()))
}

fn clamp(humanoid: &Humanoid, pose: &mut Pose) {
    for (angle, limits) in pose.joint_angles.iter_mut().zip(&humanoid.degrees_of_freedom) {
        *angle = angle.max(limits.lower).min(limits.upper);
    }
}
