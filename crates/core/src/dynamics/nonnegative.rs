//! Non-negative least squares.

use nalgebra::{DMatrix, DVector};

/// The `x >= 0` that minimises `|a x - b|`, by the active set method of `[Lawson 1974]`, chapter 23. Every round lets
/// one number become positive; it stops after at most three times as many rounds as there are numbers, with the best
/// solution so far.
pub(super) fn nonnegative_least_squares(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let unknowns = a.ncols();
    let mut x = DVector::zeros(unknowns);
    let mut positive = vec![false; unknowns];
    let tolerance = 1e-10 * a.amax().max(1e-300) * b.amax();
    for _ in 0..3 * unknowns {
        let gradient = a.tr_mul(&(b - a * &x));
        let steepest = (0..unknowns).filter(|&i| !positive[i]).max_by(|&i, &j| gradient[i].total_cmp(&gradient[j]));
        let Some(next) = steepest.filter(|&i| gradient[i] > tolerance) else { break };
        positive[next] = true;
        while let Some(solved) = solve(a, b, &positive) {
            let too_far = |&i: &usize| positive[i] && solved[i] <= 0.0;
            let share = |i: usize| x[i] / (x[i] - solved[i]);
            let nearest = (0..unknowns).filter(too_far).map(|i| (i, share(i))).min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((blocking, share)) = nearest else {
                x = solved;
                break;
            };
            x += (solved - &x) * share.clamp(0.0, 1.0);
            positive[blocking] = false;
            x[blocking] = 0.0;
            for (positive, x) in positive.iter_mut().zip(x.iter_mut()).filter(|(_, x)| **x <= 1e-14) {
                (*positive, *x) = (false, 0.0);
            }
        }
    }
    x
}

/// Least squares with all but the `positive` numbers zero; `None` if none is positive.
fn solve(a: &DMatrix<f64>, b: &DVector<f64>, positive: &[bool]) -> Option<DVector<f64>> {
    let columns: Vec<usize> = (0..positive.len()).filter(|&i| positive[i]).collect();
    let part = a.select_columns(&columns);
    // slight damping keeps the solution bounded for dependent columns
    let mut normal = part.tr_mul(&part);
    let ridge = 1e-12 * normal.diagonal().amax();
    (0..columns.len()).for_each(|i| normal[(i, i)] += ridge);
    let solution = normal.cholesky()?.solve(&part.tr_mul(b));
    let mut x = DVector::zeros(positive.len());
    columns.iter().zip(&solution).for_each(|(&column, value)| x[column] = *value);
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The Karush-Kuhn-Tucker conditions: nothing negative, no slope towards larger values, none at all for
        /// positive values.
        #[test]
        fn no_step_improves_the_solution(numbers in proptest::collection::vec(-1.0_f64..1.0, 6 * 10 + 6)) {
            let a = DMatrix::from_row_slice(6, 10, &numbers[..60]);
            let b = DVector::from_row_slice(&numbers[60..]);
            let x = nonnegative_least_squares(&a, &b);
            let gradient = a.tr_mul(&(&b - &a * &x));
            for i in 0..10 {
                prop_assert!(x[i] >= 0.0 && gradient[i] < 1e-6, "{i}: {} {}", x[i], gradient[i]);
                prop_assert!(x[i] == 0.0 || gradient[i].abs() < 1e-6, "{i}: {} {}", x[i], gradient[i]);
            }
        }
    }
}
