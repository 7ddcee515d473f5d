//! Cholesky factor of a kernel matrix, with what a Gaussian process asks of it.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, MatRef, Par};

/// The lower Cholesky factor of a symmetric positive definite matrix.
#[derive(Debug)]
pub(super) struct PositiveDefinite {
    lower: Mat<f64>,
}

/// Shares of the mean diagonal that are added, one after another, until the factorisation succeeds.
const JITTERS: [f64; 8] = [0.0, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4];

impl PositiveDefinite {
    /// Factors a matrix of which the lower triangle is read; `None` where it is not positive definite even with a
    /// jitter of 1e-4 of its mean diagonal.
    pub(super) fn factor(matrix: MatRef<'_, f64>) -> Option<Self> {
        let n = matrix.nrows();
        let mean_diagonal = (0..n).map(|i| matrix[(i, i)]).sum::<f64>() / n.max(1) as f64;
        if !mean_diagonal.is_finite() {
            return None;
        }
        let request = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
        let mut memory = MemBuffer::new(request);
        JITTERS.iter().find_map(|jitter| {
            let mut lower = matrix.to_owned();
            for i in 0..n {
                lower[(i, i)] += jitter * mean_diagonal;
            }
            let stack = MemStack::new(&mut memory);
            llt::factor::cholesky_in_place(lower.as_mut(), Default::default(), Par::Seq, stack, Default::default())
                .ok()?;
            (0..n).all(|i| lower[(i, i)].is_finite()).then_some(Self { lower })
        })
    }

    /// `ln |K|`.
    pub(super) fn log_determinant(&self) -> f64 {
        2.0 * (0..self.lower.nrows()).map(|i| self.lower[(i, i)].ln()).sum::<f64>()
    }

    /// The lower triangle of `K^-1`; what stands above the diagonal is unspecified.
    pub(super) fn inverse_lower(&self) -> Mat<f64> {
        let n = self.lower.nrows();
        let mut inverse = Mat::zeros(n, n);
        let mut memory = MemBuffer::new(llt::inverse::inverse_scratch::<f64>(n, Par::Seq));
        llt::inverse::inverse(inverse.as_mut(), self.lower.as_ref(), Par::Seq, MemStack::new(&mut memory));
        inverse
    }

    /// `K^-1 B`.
    pub(super) fn solve(&self, right: MatRef<'_, f64>) -> Mat<f64> {
        let mut solution = right.to_owned();
        solve_lower_triangular_in_place(self.lower.as_ref(), solution.as_mut(), Par::Seq);
        solve_upper_triangular_in_place(self.lower.transpose(), solution.as_mut(), Par::Seq);
        solution
    }

    /// `|L^-1 b|^2 = b^T K^-1 b` of every column `b`.
    pub(super) fn quadratic_forms(&self, mut columns: Mat<f64>) -> Vec<f64> {
        solve_lower_triangular_in_place(self.lower.as_ref(), columns.as_mut(), Par::Seq);
        (0..columns.ncols()).map(|j| columns.col(j).iter().map(|x| x * x).sum()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Mat<f64> {
        Mat::from_fn(3, 3, |i, j| [[4.0, 2.0, 0.6], [2.0, 3.0, 0.4], [0.6, 0.4, 2.0]][i][j])
    }

    #[test]
    fn inverse_solution_and_quadratic_form_agree_with_the_matrix() {
        let matrix = example();
        let factor = PositiveDefinite::factor(matrix.as_ref()).unwrap();
        let mut inverse = factor.inverse_lower();
        for i in 0..3 {
            for j in i + 1..3 {
                inverse[(i, j)] = inverse[(j, i)];
            }
        }
        let identity = &matrix * &inverse;
        let right = Mat::from_fn(3, 2, |i, j| (i + 2 * j) as f64 - 1.0);
        let solution = factor.solve(right.as_ref());
        for i in 0..3 {
            for j in 0..3 {
                assert!((identity[(i, j)] - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
        let back = &matrix * &solution;
        assert!((0..3).all(|i| (0..2).all(|j| (back[(i, j)] - right[(i, j)]).abs() < 1e-13)));
        let forms = factor.quadratic_forms(right.clone());
        for (j, form) in forms.iter().enumerate() {
            let expected: f64 = (0..3).map(|i| right[(i, j)] * solution[(i, j)]).sum();
            assert!((form - expected).abs() < 1e-13);
        }
    }

    #[test]
    fn log_determinant_is_that_of_the_expansion_by_hand() {
        let by_hand: f64 = 4.0 * (3.0 * 2.0 - 0.16) - 2.0 * (2.0 * 2.0 - 0.4 * 0.6) + 0.6 * (2.0 * 0.4 - 3.0 * 0.6);
        let factor = PositiveDefinite::factor(example().as_ref()).unwrap();
        assert!((factor.log_determinant() - by_hand.ln()).abs() < 1e-13);
    }

    #[test]
    fn a_singular_matrix_is_factored_with_jitter_and_an_indefinite_one_refused() {
        assert!(PositiveDefinite::factor(Mat::from_fn(2, 2, |_, _| 1.0).as_ref()).is_some());
        assert!(PositiveDefinite::factor(Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 3.0 }).as_ref()).is_none());
        assert!(PositiveDefinite::factor(Mat::from_fn(2, 2, |_, _| f64::NAN).as_ref()).is_none());
    }
}
