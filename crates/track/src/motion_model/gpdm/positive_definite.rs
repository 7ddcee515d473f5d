//! Cholesky factor of a kernel matrix, with the operations required by a Gaussian process.
//!
//! The inverse `L^-1` of the factor is computed while the matrix is factored, by the same row operations: blocks of a
//! few dozen columns, with products of large matrices between them, which are fast on modern processors. Everything
//! else is computed by products with `L^-1`.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::prelude::ReborrowMut;
use faer::{Accum, Mat, MatRef, Par};

use skiagraph_core::simd::{Dispatched, add_scaled, dispatch, dot};

/// Number of columns factored at once.
const BLOCK: usize = 32;

/// Number of rows of `L^-1` multiplied at once.
const PANEL: usize = 48;

/// A symmetric positive definite matrix `K = L L^T`, and memory to factor others of its size.
#[derive(Debug)]
pub(super) struct PositiveDefinite {
    /// `L^-1`, zero above the diagonal. During factorisation: final in the completed blocks; below them, the unit
    /// matrix after the row operations so far.
    inverse_factor: Mat<f64>,
    log_determinant: f64,
    /// The remaining matrix during factorisation, lower triangle, to the right and below the completed blocks.
    left: Mat<f64>,
    /// A block column of `L` below its diagonal block.
    panel: Mat<f64>,
    /// A block row of `L^-1` to the left of its diagonal block.
    rows: Mat<f64>,
}

/// Shares of the mean diagonal that are added, one after another, until the factorisation succeeds.
const JITTERS: [f64; 8] = [0.0, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4];

impl PositiveDefinite {
    /// The unit matrix, with memory for matrices of `n` rows.
    pub(super) fn identity(n: usize) -> Self {
        Self {
            inverse_factor: Mat::identity(n, n),
            log_determinant: 0.0,
            left: Mat::zeros(n, n),
            panel: Mat::zeros(n, BLOCK),
            rows: Mat::zeros(BLOCK, n),
        }
    }

    /// Factors `matrix`, of which the lower triangle is read, with `ridge` added to its diagonal; `None` if it is not
    /// positive definite even with a jitter of 1e-4 of its mean diagonal.
    pub(super) fn factor(matrix: MatRef<'_, f64>, ridge: f64) -> Option<Self> {
        let mut factor = Self::identity(matrix.nrows());
        factor.factor_in_place(matrix, ridge).then_some(factor)
    }

    /// As [`Self::factor`], reusing this object's memory for a matrix of the same size; returns whether it succeeded.
    pub(super) fn factor_in_place(&mut self, matrix: MatRef<'_, f64>, ridge: f64) -> bool {
        let n = matrix.nrows();
        let mean_diagonal = ridge + (0..n).map(|i| matrix[(i, i)]).sum::<f64>() / n.max(1) as f64;
        mean_diagonal.is_finite()
            && JITTERS.iter().any(|jitter| {
                self.left.copy_from_triangular_lower(matrix);
                (0..n).for_each(|i| self.left[(i, i)] += ridge + jitter * mean_diagonal);
                self.inverse_factor.fill(0.0);
                self.log_determinant = 0.0;
                self.eliminate_all()
            })
    }

    /// The same without the memory for factoring further matrices.
    pub(super) fn without_workspace(self) -> Self {
        Self { left: Mat::new(), panel: Mat::new(), rows: Mat::new(), ..self }
    }

    /// `ln |K|`.
    pub(super) fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Writes the lower triangle of `weight K^-1`, with zeros above the diagonal.
    pub(super) fn inverse_lower(&self, weight: f64, inverse: &mut Mat<f64>) {
        inverse.fill(0.0);
        for (first, end) in blocks(self.inverse_factor.nrows(), PANEL) {
            let rows = self.inverse_factor.get(first..end, ..end);
            triangular_matmul(
                inverse.get_mut(..end, ..end),
                BlockStructure::TriangularLower,
                Accum::Add,
                rows.transpose(),
                BlockStructure::Rectangular,
                rows,
                BlockStructure::Rectangular,
                weight,
                Par::Seq,
            );
        }
    }

    /// Writes `L^-1 B`: columns whose squares sum to `b^T K^-1 b`.
    pub(super) fn whiten(&self, right: MatRef<'_, f64>, white: &mut Mat<f64>) {
        for (first, end) in blocks(right.nrows(), PANEL) {
            let rows = self.inverse_factor.get(first..end, ..end);
            matmul(white.get_mut(first..end, ..), Accum::Replace, rows, right.get(..end, ..), 1.0, Par::Seq);
        }
    }

    /// Writes `L^-T W`: for whitened columns `W = L^-1 B` the solution `K^-1 B`.
    pub(super) fn solve_whitened(&self, white: MatRef<'_, f64>, solution: &mut Mat<f64>) {
        solution.fill(0.0);
        for (first, end) in blocks(white.nrows(), PANEL) {
            let rows = self.inverse_factor.get(first..end, ..end).transpose();
            matmul(solution.get_mut(..end, ..), Accum::Add, rows, white.get(first..end, ..), 1.0, Par::Seq);
        }
    }

    /// `K^-1 B`.
    pub(super) fn solve(&self, right: MatRef<'_, f64>) -> Mat<f64> {
        let (mut white, mut solution) =
            (Mat::zeros(right.nrows(), right.ncols()), Mat::zeros(right.nrows(), right.ncols()));
        self.whiten(right, &mut white);
        self.solve_whitened(white.as_ref(), &mut solution);
        solution
    }

    /// `b^T K^-1 b` of every column `b`.
    pub(super) fn quadratic_forms(&self, columns: MatRef<'_, f64>) -> Vec<f64> {
        let mut white = Mat::zeros(columns.nrows(), columns.ncols());
        self.whiten(columns, &mut white);
        squares_of_columns(&white).collect()
    }

    fn eliminate_all(&mut self) -> bool {
        let request = llt::factor::cholesky_in_place_scratch::<f64>(BLOCK, Par::Seq, Default::default());
        let mut memory = MemBuffer::new(request);
        blocks(self.left.nrows(), BLOCK).all(|(first, end)| self.eliminate(first, end, MemStack::new(&mut memory)))
            && self.log_determinant.is_finite()
    }

    /// Eliminates the columns `first .. end`; returns `false` if a pivot is not positive.
    ///
    /// Invariant, before and after every block, with `k` columns done: `left` from `(k, k)` on is the Schur complement
    /// of the done columns in `K`; the first `k` rows of `inverse_factor` are those of `L^-1`; its rows below are the
    /// row operations done so far, applied to the unit matrix. For a block `A` of the complement with `A = L_A L_A^T`
    /// and `B` below it, the panel of the factor is `P = B L_A^-T`, the next complement `C - P P^T`, and the same row
    /// operations turn the unit matrix into the next rows of `L^-1`.
    fn eliminate(&mut self, first: usize, end: usize, stack: &mut MemStack) -> bool {
        let (n, size) = (self.left.nrows(), end - first);
        let block = self.left.get_mut(first..end, first..end);
        if llt::factor::cholesky_in_place(block, Default::default(), Par::Seq, stack, Default::default()).is_err() {
            return false;
        }
        let block = self.left.get(first..end, first..end);
        self.log_determinant += 2.0 * (0..size).map(|i| block[(i, i)].ln()).sum::<f64>();
        let block_inverse = inverse_of_lower(block);
        // rows of `L^-1`: their values after elimination, times `L_A^-1`; stored in `rows` first, because a product
        // cannot overwrite its own factor
        let mut rows = self.rows.get_mut(..size, ..first);
        matmul(
            rows.rb_mut(),
            Accum::Replace,
            &block_inverse,
            self.inverse_factor.get(first..end, ..first),
            1.0,
            Par::Seq,
        );
        self.inverse_factor.get_mut(first..end, ..first).copy_from(&rows);
        self.inverse_factor.get_mut(first..end, first..end).copy_from(&block_inverse);
        if end == n {
            return true;
        }
        // `P = B L_A^-T`
        let mut panel = self.panel.get_mut(..n - end, ..size);
        let below = self.left.get(end.., first..end);
        matmul(panel.rb_mut(), Accum::Replace, below, block_inverse.transpose(), 1.0, Par::Seq);
        let panel = self.panel.get(..n - end, ..size);
        // `C - P P^T`: its lower triangle, because only that is read again
        triangular_matmul(
            self.left.get_mut(end.., end..),
            BlockStructure::TriangularLower,
            Accum::Add,
            panel,
            BlockStructure::Rectangular,
            panel.transpose(),
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
        // the row operations on the unit matrix: rows below lose `P` times the rows just finished
        let (above, below) = self.inverse_factor.split_at_row_mut(end);
        let done = above.as_ref().get(first..end, ..end);
        matmul(below.get_mut(.., ..end), Accum::Add, panel, done, -1.0, Par::Seq);
        true
    }
}

pub(super) fn squares_of_columns(columns: &Mat<f64>) -> impl Iterator<Item = f64> + '_ {
    (0..columns.ncols()).map(|j| dot(columns.col_as_slice(j), columns.col_as_slice(j)))
}

/// Start and end of every block of at most `size`.
fn blocks(n: usize, size: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).step_by(size).map(move |first| (first, (first + size).min(n)))
}

/// The inverse of a small lower triangular matrix, zero above the diagonal.
fn inverse_of_lower(lower: MatRef<'_, f64>) -> Mat<f64> {
    let lower = lower.to_owned();
    let mut inverse = Mat::identity(lower.nrows(), lower.nrows());
    dispatch(ForwardSubstitution { lower: &lower, columns: &mut inverse });
    inverse
}

struct ForwardSubstitution<'a> {
    lower: &'a Mat<f64>,
    /// The unit matrix, overwritten with the inverse.
    columns: &'a mut Mat<f64>,
}

impl Dispatched for ForwardSubstitution<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let n = self.lower.nrows();
        for j in 0..n {
            let column = self.columns.col_as_slice_mut(j);
            for i in j..n {
                let of_lower = &self.lower.col_as_slice(i)[i..];
                let value = column[i] / of_lower[0];
                column[i] = value;
                add_scaled(&mut column[i + 1..], -value, &of_lower[1..]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use faer::linalg::solvers::DenseSolveCore;

    use super::*;

    /// A kernel matrix of points on a line, with a ridge.
    fn example(n: usize) -> Mat<f64> {
        Mat::from_fn(n, n, |i, j| (-0.02 * (i as f64 - j as f64).powi(2)).exp() + if i == j { 0.05 } else { 0.0 })
    }

    fn greatest_difference(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
        let pairs = (0..a.ncols()).flat_map(|j| (0..a.nrows()).map(move |i| (i, j)));
        pairs.map(|(i, j)| (a[(i, j)] - b[(i, j)]).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn inverse_solution_and_quadratic_forms_agree_with_another_decomposition_for_any_number_of_blocks() {
        for n in [1, 2, 7, BLOCK, BLOCK + 1, PANEL + 5, 2 * PANEL, 3 * BLOCK + 1] {
            let matrix = example(n);
            let expected = matrix.partial_piv_lu().inverse();
            let factor = PositiveDefinite::factor(matrix.as_ref(), 0.0).unwrap();
            let mut inverse = Mat::from_fn(n, n, |_, _| f64::NAN);
            factor.inverse_lower(1.0, &mut inverse);
            for j in 0..n {
                assert!((0..j).all(|i| inverse[(i, j)] == 0.0));
                (0..j).for_each(|i| inverse[(i, j)] = inverse[(j, i)]);
            }
            assert!(greatest_difference(&inverse, &expected) < 1e-11, "{n}");
            let right = Mat::from_fn(n, 3, |i, j| ((i * (j + 1)) as f64 * 0.7).sin());
            let solution = factor.solve(right.as_ref());
            assert!(greatest_difference(&solution, &(&expected * &right)) < 1e-11, "{n}");
            for (j, form) in factor.quadratic_forms(right.as_ref()).iter().enumerate() {
                let by_hand: f64 = (0..n).map(|i| right[(i, j)] * solution[(i, j)]).sum();
                assert!((form - by_hand).abs() < 1e-11, "{n}");
            }
        }
    }

    #[test]
    fn a_ridge_is_equivalent_to_a_larger_diagonal() {
        let matrix = example(60);
        let ridged = Mat::from_fn(60, 60, |i, j| matrix[(i, j)] + if i == j { 0.25 } else { 0.0 });
        let (a, b) = (PositiveDefinite::factor(matrix.as_ref(), 0.25), PositiveDefinite::factor(ridged.as_ref(), 0.0));
        assert_eq!(a.unwrap().log_determinant(), b.unwrap().log_determinant());
    }

    #[test]
    fn a_singular_matrix_is_factored_with_jitter_and_an_indefinite_one_is_refused() {
        let factor = |n: usize, value: &dyn Fn(usize, usize) -> f64| {
            PositiveDefinite::factor(Mat::from_fn(n, n, value).as_ref(), 0.0)
        };
        for n in [2, BLOCK + 2] {
            assert!(factor(n, &|_, _| 1.0).is_some());
            assert!(factor(n, &|i, j| if i == j { 1.0 } else { 3.0 }).is_none());
            assert!(factor(n, &|_, _| f64::NAN).is_none());
            // finite on the diagonal, but not in an entry read only by the second block
            let hidden = |i: usize, j: usize| match (i == j, i.max(j) + 1 == n) {
                (true, _) => 1.0,
                (false, true) => f64::NAN,
                (false, false) => 0.0,
            };
            assert!(factor(n, &hidden).is_none());
        }
    }
}
