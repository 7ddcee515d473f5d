//! What an observation says of a small step of a pose, and the step that follows from it.

use nalgebra::{DMatrix, DVector};

/// A quadratic in a step `s` of a pose ([`crate::body::Humanoid::step`]): `cost + 2 s.gradient + s.(matrix s)`, the weighted
/// squares of residuals linearised at the pose.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalEquations {
    /// Sum of weighted outer products of the residuals' derivatives, symmetric, one row and column per number of a step.
    pub matrix: DMatrix<f64>,
    /// Sum of weighted residuals times their derivatives.
    pub gradient: DVector<f64>,
    /// Sum of weighted squares of residuals.
    pub cost: f64,
    /// Sum of the weights.
    pub weight: f64,
    /// Number of residuals.
    pub residuals: usize,
}

/// Share of the diagonal that is added to it (Levenberg and Marquardt's damping).
const DAMPING: f64 = 0.01;

impl NormalEquations {
    /// Adds `precision_i (s_i - towards_i)^2` to the quadratic: a pull of every number towards a step.
    pub(super) fn pull(&mut self, towards: &[f64], precision: &[f64]) {
        for (i, (step, precision)) in towards.iter().zip(precision).enumerate() {
            self.matrix[(i, i)] += precision;
            self.gradient[i] -= precision * step;
        }
    }

    /// The damped step to the lowest point, with the numbers that `is_held` says kept at zero. `None` where the matrix is singular
    /// or not finite.
    fn solved(&self, is_held: &[bool]) -> Option<DVector<f64>> {
        let mut matrix = self.matrix.clone();
        let mut gradient = self.gradient.clone();
        for (i, held) in is_held.iter().enumerate() {
            matrix[(i, i)] *= 1.0 + DAMPING;
            if *held {
                matrix.row_mut(i).fill(0.0);
                matrix.column_mut(i).fill(0.0);
                (matrix[(i, i)], gradient[i]) = (1.0, 0.0);
            }
        }
        let step = matrix.cholesky()?.solve(&-gradient);
        step.iter().all(|s| s.is_finite()).then_some(step)
    }

    /// The damped step to the lowest point within bounds: number `i` of the step may go from `room[i][0]` to `room[i][1]`
    /// (zero lies between them). Numbers that would leave through a bound at which they already are held, and the others solved
    /// anew; what then leaves its bounds is cut off. `None` where the matrix is singular or not finite.
    pub(super) fn step_within(&self, room: &[[f64; 2]]) -> Option<DVector<f64>> {
        const AT_BOUND: f64 = 1e-9;
        let mut is_held = vec![false; room.len()];
        loop {
            let mut step = self.solved(&is_held)?;
            let mut held_more = false;
            for (i, [lower, upper]) in room.iter().enumerate() {
                let pushes = (step[i] < 0.0 && *lower > -AT_BOUND) || (step[i] > 0.0 && *upper < AT_BOUND);
                if pushes && !is_held[i] {
                    is_held[i] = true;
                    held_more = true;
                }
            }
            if !held_more {
                for (s, [lower, upper]) in step.iter_mut().zip(room) {
                    *s = s.clamp(lower.min(0.0), upper.max(0.0));
                }
                return Some(step);
            }
        }
    }
}
