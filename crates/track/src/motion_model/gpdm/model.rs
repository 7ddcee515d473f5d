//! A learned GPDM and its predictions.

use faer::{Mat, MatRef};

use super::kernel::{DynamicsKernel, MapKernel};
use super::layout::SequenceLayout;
use super::objective::Parameters;
use super::positive_definite::PositiveDefinite;
use super::predictor::Predictor;

/// A learned Gaussian process dynamical model. Rows of every matrix argument and result are points.
#[derive(Clone, Debug)]
pub struct Gpdm {
    pub(super) mean: Vec<f64>,
    pub(super) centred: Mat<f64>,
    pub(super) scales: Vec<f64>,
    pub(super) latents: Mat<f64>,
    pub(super) map: MapKernel,
    pub(super) dynamics: DynamicsKernel,
    pub(super) layout: SequenceLayout,
    predictors: Predictors,
}

/// Precomputed quantities that make prediction fast.
#[derive(Clone, Debug)]
struct Predictors {
    inputs: Mat<f64>,
    map: Predictor,
    dynamics: Predictor,
}

/// Means (one row per point) and one isotropic variance per point.
#[derive(Clone, Debug)]
pub struct Moments {
    /// Means, one row per point.
    pub mean: Mat<f64>,
    /// Variance of every coordinate of the point, without noise; never negative.
    pub variance: Vec<f64>,
}

impl PartialEq for Gpdm {
    /// Models are equal if they were learned to the same bits; derived quantities are not compared.
    fn eq(&self, other: &Self) -> bool {
        self.mean == other.mean
            && self.centred == other.centred
            && self.scales == other.scales
            && self.latents == other.latents
            && self.map == other.map
            && self.dynamics == other.dynamics
            && self.layout == other.layout
    }
}

impl Gpdm {
    /// Assembles a model from learned parameters; `None` if a kernel matrix is singular.
    pub(super) fn assemble(
        mean: Vec<f64>,
        centred: Mat<f64>,
        scales: Vec<f64>,
        parameters: Parameters,
        layout: SequenceLayout,
    ) -> Option<Self> {
        let Parameters { latents, map, dynamics } = parameters;
        let predicted = layout.predicted();
        let inputs = layout.inputs(latents.as_ref(), &predicted);
        let targets = layout.targets(latents.as_ref(), &predicted);
        let factor = |points: &Mat<f64>, precision: f64, cross: &dyn Fn(&mut Mat<f64>)| {
            let mut covariance = Mat::zeros(points.nrows(), points.nrows());
            cross(&mut covariance);
            PositiveDefinite::factor(covariance.as_ref(), 1.0 / precision)
        };
        let of_map = |values: &mut Mat<f64>| map.cross(&latents, latents.as_ref(), values);
        let map_factor = factor(&latents, map.noise_precision, &of_map)?;
        let of_dynamics = |values: &mut Mat<f64>| dynamics.cross(&inputs, inputs.as_ref(), values);
        let dynamics_factor = factor(&inputs, dynamics.noise_precision, &of_dynamics)?;
        let predictors = Predictors {
            map: Predictor::new(map_factor, centred.as_ref()),
            dynamics: Predictor::new(dynamics_factor, targets.as_ref()),
            inputs,
        };
        Some(Self { mean, centred, scales, latents, map, dynamics, layout, predictors })
    }

    /// Learned latents Z, N x d, one row per training frame.
    pub fn latents(&self) -> MatRef<'_, f64> {
        self.latents.as_ref()
    }

    /// Row `i` of the training observations, D values.
    pub fn observation(&self, i: usize) -> Vec<f64> {
        self.mean.iter().enumerate().map(|(j, mean)| mean + self.centred[(i, j)]).collect()
    }

    /// Scales W of the observation's dimensions, D values.
    pub fn scales(&self) -> &[f64] {
        &self.scales
    }

    pub fn map_kernel(&self) -> &MapKernel {
        &self.map
    }

    pub fn dynamics_kernel(&self) -> &DynamicsKernel {
        &self.dynamics
    }

    /// Order of the dynamics and lengths of the learned sequences.
    pub fn layout(&self) -> &SequenceLayout {
        &self.layout
    }

    /// Mean observations at latent points (P x d): P x D (`[GPDM graph]` Eq. 2 and 6).
    pub fn map_mean(&self, latents: MatRef<'_, f64>) -> Mat<f64> {
        self.with_mean(self.predictors.map.mean(latents, |points, cross| self.map.cross(&self.latents, points, cross)))
    }

    /// As [`Self::map_mean`] with the variance of a dimension of unit scale: divide by `scales[d]^2` for dimension
    /// `d`.
    pub fn map_moments(&self, latents: MatRef<'_, f64>) -> Moments {
        let cross = |points: MatRef<'_, f64>, cross: &mut Mat<f64>| self.map.cross(&self.latents, points, cross);
        let (mean, explained) = self.predictors.map.mean_and_explained(latents, cross);
        let variance = explained.into_iter().map(|e| (MapKernel::VARIANCE - e).max(0.0)).collect();
        Moments { mean: self.with_mean(mean), variance }
    }

    fn with_mean(&self, mut observations: Mat<f64>) -> Mat<f64> {
        for (j, mean) in self.mean.iter().enumerate() {
            observations.col_as_slice_mut(j).iter_mut().for_each(|value| *value += mean);
        }
        observations
    }

    /// Mean next latents after dynamics inputs (P x d, or P x 2d `[z_{t-1}; z_{t-2}]` for the second order).
    pub fn dynamics_mean(&self, inputs: MatRef<'_, f64>) -> Mat<f64> {
        let Predictors { inputs: known, dynamics, .. } = &self.predictors;
        self.with_last(inputs, dynamics.mean(inputs, |points, cross| self.dynamics.cross(known, points, cross)))
    }

    /// As [`Self::dynamics_mean`] with the isotropic predictive variance, including process noise.
    pub fn dynamics_moments(&self, inputs: MatRef<'_, f64>) -> Moments {
        let Predictors { inputs: known, dynamics, .. } = &self.predictors;
        let cross = |points: MatRef<'_, f64>, cross: &mut Mat<f64>| self.dynamics.cross(known, points, cross);
        let (mean, explained) = dynamics.mean_and_explained(inputs, cross);
        let variance = explained
            .into_iter()
            .enumerate()
            .map(|(i, explained)| {
                let squared: f64 = (0..inputs.ncols()).map(|c| inputs[(i, c)] * inputs[(i, c)]).sum();
                (self.dynamics.variance(squared) - explained).max(0.0) + 1.0 / self.dynamics.noise_precision
            })
            .collect();
        Moments { mean: self.with_last(inputs, mean), variance }
    }

    /// Converts predicted steps to the resulting points.
    fn with_last(&self, inputs: MatRef<'_, f64>, mut next: Mat<f64>) -> Mat<f64> {
        if self.layout.delta {
            for c in 0..next.ncols() {
                next.col_mut(c).iter_mut().zip(inputs.col(c).iter()).for_each(|(value, last)| *value += last);
            }
        }
        next
    }

    /// The mean prediction sequence: the dynamics' mean iterated from the first learned latents of sequence
    /// `sequence`, with the length of that sequence (`[GPDM graph]` Eq. 10).
    pub fn simulate(&self, sequence: usize) -> Option<Mat<f64>> {
        let (d, lag) = (self.latents.ncols(), self.layout.order.lag());
        let start = self.layout.starts().nth(sequence)?;
        let length = *self.layout.lengths.get(sequence)?;
        let mut path = Mat::zeros(length, d);
        for t in 0..length {
            let next = if t < lag {
                self.latents.subrows(start + t, 1).to_owned()
            } else {
                let input = Mat::from_fn(1, d * lag, |_, c| path[(t - 1 - c / d, c % d)]);
                self.dynamics_mean(input.as_ref())
            };
            path.row_mut(t).copy_from(next.row(0));
        }
        Some(path)
    }

    /// Root mean square distance of the learned latents from their mean, per coordinate: the unit of process noise.
    pub fn latent_spread(&self) -> f64 {
        let (n, d) = (self.latents.nrows() as f64, self.latents.ncols());
        let variance: f64 = (0..d)
            .map(|c| {
                let mean = self.latents.col(c).iter().sum::<f64>() / n;
                self.latents.col(c).iter().map(|z| (z - mean) * (z - mean)).sum::<f64>() / n
            })
            .sum();
        (variance / d as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::super::train::{TrainingOptions, train};
    use super::*;

    fn model(options: &TrainingOptions) -> Gpdm {
        let x = Mat::from_fn(45, 6, |i, j| {
            let phase = i as f64 * std::f64::consts::TAU / 30.0;
            (phase + 0.9 * j as f64).sin() * (0.3 + 0.05 * j as f64) + 0.1 * (2.0 * phase + 0.5 * j as f64).sin()
        });
        train(x.as_ref(), &[45], options).unwrap()
    }

    #[test]
    fn the_mean_prediction_of_a_cycle_stays_on_the_cycle() {
        let options = TrainingOptions { balance: None, ..TrainingOptions::default() };
        let model = model(&options);
        let simulated = model.map_mean(model.simulate(0).unwrap().as_ref());
        let worst = (0..45)
            .map(|i| {
                let truth = model.observation(i);
                (0..6).map(|j| (simulated[(i, j)] - truth[j]).powi(2)).sum::<f64>().sqrt()
            })
            .fold(0.0, f64::max);
        assert!(worst < 0.15, "worst distance {worst} of a motion with amplitude 0.3");
    }

    #[test]
    fn variance_is_small_at_the_training_latents_and_the_prior_far_away() {
        let model = model(&TrainingOptions::default());
        let near = model.map_moments(model.latents());
        assert!(near.variance.iter().all(|v| *v < 0.1));
        let far = model.map_moments(Mat::from_fn(1, 3, |_, _| 1e3).as_ref());
        assert!((far.variance[0] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn predictions_equal_the_textbook_formula_with_an_explicit_inverse() {
        let model = model(&TrainingOptions { rounds: 1, ..TrainingOptions::default() });
        let point = Mat::from_fn(1, 3, |_, c| 0.2 * c as f64 - 0.1);
        let z = model.latents();
        let kernel = |a: MatRef<'_, f64>, i: usize, b: MatRef<'_, f64>, j: usize| {
            let squared: f64 = (0..3).map(|c| (a[(i, c)] - b[(j, c)]).powi(2)).sum();
            (-0.5 * model.map.inverse_width * squared).exp()
        };
        let n = z.nrows();
        let k =
            Mat::from_fn(n, n, |i, j| kernel(z, i, z, j) + if i == j { 1.0 / model.map.noise_precision } else { 0.0 });
        use faer::linalg::solvers::DenseSolveCore;
        let inverse = k.partial_piv_lu().inverse();
        let cross = Mat::from_fn(1, n, |_, j| kernel(point.as_ref(), 0, z, j));
        let weights = &cross * &inverse;
        let moments = model.map_moments(point.as_ref());
        for j in 0..6 {
            let expected: f64 = model.mean[j] + (0..n).map(|i| weights[(0, i)] * model.centred[(i, j)]).sum::<f64>();
            assert!((moments.mean[(0, j)] - expected).abs() < 1e-9);
        }
        let explained: f64 = (0..n).map(|i| weights[(0, i)] * cross[(0, i)]).sum();
        assert!((moments.variance[0] - (1.0 - explained)).abs() < 1e-9);
    }
}
