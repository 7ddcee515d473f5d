//! The information of an observation about a small step of a pose, and the resulting step.

use nalgebra::{DMatrix, DVector};

/// A quadratic in a step `s` of a pose ([`skiagraph_core::body::Humanoid::step`]):
/// `cost + 2 s.gradient + s.(matrix s)`, the weighted squares of residuals linearised at the pose.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalEquations {
    /// Sum of weighted outer products of the residuals' derivatives, symmetric, one row and column per number of a
    /// step.
    pub matrix: DMatrix<f64>,
    /// Sum of weighted residuals times their derivatives.
    pub gradient: DVector<f64>,
    /// Sum of weighted squares of residuals.
    pub cost: f64,
    /// Sum of the weights.
    pub weight: f64,
    /// Number of residuals.
    pub residuals: usize,
    /// Factor, >= 1, on the weight of a motion model's prior in a descent: greater if the observation is less
    /// informative.
    pub prior_weight: f64,
}

/// Share of the diagonal that is added to it (Levenberg-Marquardt damping).
const DAMPING: f64 = 0.01;

impl NormalEquations {
    pub(crate) fn with_prior(self, factor: f64) -> Self {
        Self { prior_weight: self.prior_weight * factor, ..self }
    }

    /// The sum of two independent observations of a pose. The weight of the prior is that of the more informative one.
    pub(crate) fn with(self, other: Self) -> Self {
        Self {
            matrix: self.matrix + other.matrix,
            gradient: self.gradient + other.gradient,
            cost: self.cost + other.cost,
            weight: self.weight + other.weight,
            residuals: self.residuals + other.residuals,
            prior_weight: self.prior_weight.min(other.prior_weight),
        }
    }

    /// Adds `precision_i (s_i - towards_i)^2` to the quadratic: pulls every number towards a step.
    pub(super) fn pull(&mut self, towards: &[f64], precision: &[f64]) {
        for (i, (step, precision)) in towards.iter().zip(precision).enumerate() {
            self.matrix[(i, i)] += precision;
            self.gradient[i] -= precision * step;
        }
    }

    /// The damped step to the minimum, with the numbers marked in `is_held` kept at zero. `None` if the matrix is
    /// singular or not finite.
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

    /// The damped step to the minimum within bounds: number `i` of the step must be between `room[i][0]` and
    /// `room[i][1]` (zero is between them). A number that is at a bound and would leave through it is held,
    /// and the others are solved again; the result is then clamped to the bounds. `None` if the matrix is singular or
    /// not finite.
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Normal equations of random residuals, more of them than numbers.
    fn random(numbers: usize, seed: u64) -> NormalEquations {
        let mut state = seed | 1;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1_u64 << 23) as f64 - 1.0
        };
        let rows = DMatrix::from_fn(2 * numbers, numbers, |_, _| next());
        let residuals = DVector::from_fn(2 * numbers, |_, _| next());
        NormalEquations {
            matrix: rows.tr_mul(&rows),
            gradient: rows.tr_mul(&residuals),
            cost: residuals.norm_squared(),
            weight: 2.0 * numbers as f64,
            residuals: 2 * numbers,
            prior_weight: 1.0,
        }
    }

    fn damped(equations: &NormalEquations) -> DMatrix<f64> {
        let mut matrix = equations.matrix.clone();
        (0..matrix.nrows()).for_each(|i| matrix[(i, i)] *= 1.0 + DAMPING);
        matrix
    }

    proptest! {
        #[test]
        fn free_numbers_solve_the_damped_equations_and_held_ones_are_pushed_against_their_bound(
            numbers in 1..9_usize, seed in any::<u64>(), bounds in any::<u16>(),
        ) {
            let equations = random(numbers, seed);
            let sides = [f64::NEG_INFINITY, f64::INFINITY];
            let room: Vec<[f64; 2]> = (0..numbers)
                .map(|i| [0, 1].map(|side| if bounds >> (2 * i % 16 + side) & 1 == 1 { 0.0 } else { sides[side] }))
                .collect();
            let step = equations.step_within(&room).unwrap();
            let slope = damped(&equations) * &step + &equations.gradient;
            for (i, [lower, upper]) in room.iter().enumerate() {
                prop_assert!(step[i] >= *lower && step[i] <= *upper);
                prop_assert!(slope[i].abs() < 1e-8 || (step[i] == 0.0 && (*lower == 0.0 || *upper == 0.0)));
            }
            let free = equations.step_within(&vec![sides; numbers]).unwrap();
            prop_assert!((damped(&equations) * free + &equations.gradient).norm() < 1e-8);
        }
    }

    #[test]
    fn a_pull_alone_leads_to_its_target_except_for_damping() {
        let mut equations = random(3, 5);
        equations.matrix.fill(0.0);
        equations.gradient.fill(0.0);
        equations.pull(&[0.1, -0.2, 0.0], &[4.0, 2.0, 1.0]);
        let step = equations.step_within(&[[-1.0, 1.0]; 3]).unwrap() * (1.0 + DAMPING);
        assert!((step - DVector::from_vec(vec![0.1, -0.2, 0.0])).norm() < 1e-12);
        assert_eq!(equations.step_within(&[[-0.05, 0.05]; 3]).unwrap().as_slice(), [0.05, -0.05, 0.0]);
    }

    #[test]
    fn singular_and_infinite_equations_give_no_step() {
        let spoils: [fn(&mut NormalEquations); 4] = [
            |equations| equations.matrix.fill(0.0),
            |equations| equations.matrix[(1, 1)] = f64::NAN,
            |equations| equations.gradient[2] = f64::NAN,
            |equations| equations.gradient[2] = f64::INFINITY,
        ];
        for spoil in spoils {
            let mut equations = random(3, 5);
            spoil(&mut equations);
            assert_eq!(equations.step_within(&[[-1.0, 1.0]; 3]), None);
        }
    }
}
