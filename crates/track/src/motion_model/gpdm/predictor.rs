//! A Gaussian process conditioned on its data: means and explained variances at many points.

use std::sync::Arc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::positive_definite::{PositiveDefinite, squares_of_columns};

/// Number of points processed at once: their covariances with the training points stay in the processor's cache, and
/// memory is allocated once.
const BATCH: usize = 64;

/// `K^-1 Y` and the factor of `K`.
#[derive(Clone, Debug)]
pub(super) struct Predictor {
    /// One row per training point.
    weights: Mat<f64>,
    factor: Arc<PositiveDefinite>,
}

impl Predictor {
    /// From the factor of the training points' covariance and their values `Y`, one row per point.
    pub(super) fn new(factor: PositiveDefinite, values: MatRef<'_, f64>) -> Self {
        Self { weights: factor.solve(values), factor: factor.without_workspace().into() }
    }

    /// Means, one row per point. `cross` writes the covariances of all training points (rows) with the given points
    /// (columns).
    pub(super) fn mean(&self, points: MatRef<'_, f64>, cross: impl Fn(MatRef<'_, f64>, &mut Mat<f64>)) -> Mat<f64> {
        self.in_batches(points, cross, |_| ())
    }

    /// As [`Self::mean`], with the variance of each point explained by the training points: `k^T K^-1 k`.
    pub(super) fn mean_and_explained(
        &self,
        points: MatRef<'_, f64>,
        cross: impl Fn(MatRef<'_, f64>, &mut Mat<f64>),
    ) -> (Mat<f64>, Vec<f64>) {
        let (mut explained, mut white) = (Vec::with_capacity(points.nrows()), Mat::new());
        let mean = self.in_batches(points, cross, |cross| {
            if white.ncols() != cross.ncols() {
                white = Mat::zeros(cross.nrows(), cross.ncols());
            }
            self.factor.whiten(cross.as_ref(), &mut white);
            explained.extend(squares_of_columns(&white));
        });
        (mean, explained)
    }

    /// Means; `also` is called with the covariances of every batch.
    fn in_batches(
        &self,
        points: MatRef<'_, f64>,
        cross: impl Fn(MatRef<'_, f64>, &mut Mat<f64>),
        mut also: impl FnMut(&Mat<f64>),
    ) -> Mat<f64> {
        let mut mean = Mat::zeros(points.nrows(), self.weights.ncols());
        let mut covariances = Mat::new();
        for first in (0..points.nrows()).step_by(BATCH) {
            let count = BATCH.min(points.nrows() - first);
            if covariances.ncols() != count {
                covariances = Mat::zeros(self.weights.nrows(), count);
            }
            cross(points.subrows(first, count), &mut covariances);
            let rows = mean.subrows_mut(first, count);
            matmul(rows, Accum::Replace, covariances.transpose(), &self.weights, 1.0, Par::Seq);
            also(&covariances);
        }
        mean
    }
}
