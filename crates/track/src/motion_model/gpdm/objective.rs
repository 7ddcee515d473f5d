//! The loss minimised by learning, and its gradient.
//!
//! ```text
//! L = D/2 ln|K_X| + 1/2 tr(K_X^-1 X W^2 X^T) - N ln|W|
//!   + balance [ d/2 ln|K_Z| + 1/2 tr(K_Z^-1 V V^T) + 1/2 |z_1|^2 (+ 1/2 |z_2 - z_1|^2, second order) ]
//!   + sum ln beta + sum ln alpha + 1/2 kappa^-2 tr W^2
//! ```
//! (negative logarithms of `[GPDM graph]` Eqs. 3 and 4 with Wang's priors, without constants). `balance` = 1 is the
//! plain GPDM, `D/d` the balanced one.

use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::{Accum, Mat, MatRef, Par, Scale};

use super::kernel::{DynamicsKernel, MapKernel};
use super::layout::{DynamicsOrder, SequenceLayout};
use super::positive_definite::PositiveDefinite;
use super::radial::{RadialGradient, radial_gradient, radial_lower, symmetric_times};

/// Variance of the prior on the scales `W`, kappa^2.
pub(super) const SCALE_PRIOR_VARIANCE: f64 = 1e6;

/// All learned parameters except `W`.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// Latents, N x d, one row per frame.
    pub latents: Mat<f64>,
    pub map: MapKernel,
    pub dynamics: DynamicsKernel,
}

impl Parameters {
    /// Number of kernel parameters after the latents in a packed vector.
    pub const KERNEL_PARAMETERS: usize = 6;

    /// Latents column by column, then `ln beta2, ln beta3, ln alpha1, ln alpha2, ln alpha3, ln alpha4`.
    pub fn pack(&self) -> Vec<f64> {
        let mut theta: Vec<f64> = (0..self.latents.ncols()).flat_map(|c| self.latents.col(c).iter().copied()).collect();
        let (map, dynamics) = (&self.map, &self.dynamics);
        theta.extend(
            [
                map.inverse_width,
                map.noise_precision,
                dynamics.amplitude,
                dynamics.inverse_width,
                dynamics.linear,
                dynamics.noise_precision,
            ]
            .map(f64::ln),
        );
        theta
    }

    /// The inverse of [`Self::pack`] for `d` latent dimensions.
    pub fn unpack(theta: &[f64], d: usize) -> Self {
        let (latents, logarithms) = theta.split_at(theta.len() - Self::KERNEL_PARAMETERS);
        let frames = latents.len() / d;
        let value = |i: usize| logarithms[i].exp();
        Self {
            latents: Mat::from_fn(frames, d, |i, c| latents[c * frames + i]),
            map: MapKernel { inverse_width: value(0), noise_precision: value(1) },
            dynamics: DynamicsKernel {
                amplitude: value(2),
                inverse_width: value(3),
                linear: value(4),
                noise_precision: value(5),
            },
        }
    }
}

/// The negative log posterior of a GPDM for fixed scales `W`.
pub struct Objective<'a> {
    layout: &'a SequenceLayout,
    predicted: Vec<usize>,
    /// `X W`.
    scaled: Mat<f64>,
    scales: &'a [f64],
    balance: f64,
    map_workspace: Workspace,
    dynamics_workspace: Workspace,
}

/// Matrices needed by every evaluation. Allocating their memory each time would cost as much as half of the
/// arithmetic.
struct Workspace {
    radial: Mat<f64>,
    covariance: Mat<f64>,
    factor: PositiveDefinite,
    /// `L^-1 Y`.
    white: Mat<f64>,
    /// `K^-1 Y`.
    solution: Mat<f64>,
    /// Derivative by the entries of `K`: `weight/2 (D K^-1 - K^-1 Y Y^T K^-1)`, lower triangle.
    by_kernel: Mat<f64>,
}

impl Workspace {
    fn new(rows: usize, columns: usize) -> Self {
        let square = || Mat::zeros(rows, rows);
        Self {
            radial: square(),
            covariance: square(),
            factor: PositiveDefinite::identity(rows),
            white: Mat::zeros(rows, columns),
            solution: Mat::zeros(rows, columns),
            by_kernel: square(),
        }
    }
}

/// A loss term's value, with gradients by its inputs and by the logarithms of its kernel's parameters.
struct LossTerm<const K: usize> {
    value: f64,
    inputs: Mat<f64>,
    logarithms: [f64; K],
}

impl<'a> Objective<'a> {
    /// The objective for centred observations `X` (N x D), scales `W` (D) and the weight of the dynamics.
    pub fn new(observations: MatRef<'_, f64>, scales: &'a [f64], layout: &'a SequenceLayout, balance: f64) -> Self {
        let scaled = Mat::from_fn(observations.nrows(), observations.ncols(), |i, j| observations[(i, j)] * scales[j]);
        let predicted = layout.predicted();
        let map_workspace = Workspace::new(scaled.nrows(), scaled.ncols());
        // allocated when the number of latent dimensions is known
        let dynamics_workspace = Workspace::new(0, 0);
        Self { layout, predicted, scaled, scales, balance, map_workspace, dynamics_workspace }
    }

    /// The loss at packed parameters, with its gradient written to `gradient`; infinite if a kernel is singular.
    pub fn value_and_gradient(&mut self, theta: &[f64], latent_dimensions: usize, gradient: &mut [f64]) -> f64 {
        let parameters = Parameters::unpack(theta, latent_dimensions);
        let Some((map, dynamics, targets)) = self.terms(&parameters) else {
            gradient.fill(0.0);
            return f64::INFINITY;
        };
        let mut latents = map.inputs;
        self.layout.scatter(&self.predicted, dynamics.inputs.as_ref(), targets.as_ref(), &mut latents);
        let start = self.start_prior(&parameters.latents, &mut latents);
        for (target, value) in gradient.iter_mut().zip((0..latents.ncols()).flat_map(|c| latents.col(c).iter())) {
            *target = *value;
        }
        let logarithms = map.logarithms.into_iter().chain(dynamics.logarithms);
        let kernels = theta.len() - Parameters::KERNEL_PARAMETERS;
        for (target, value) in gradient[kernels..].iter_mut().zip(logarithms) {
            *target = value + 1.0;
        }
        let frames = self.scaled.nrows() as f64;
        let scales: f64 = self.scales.iter().map(|w| 0.5 * w * w / SCALE_PRIOR_VARIANCE - frames * w.ln()).sum();
        map.value + dynamics.value + start + scales + theta[kernels..].iter().sum::<f64>()
    }

    fn terms(&mut self, parameters: &Parameters) -> Option<(LossTerm<2>, LossTerm<4>, Mat<f64>)> {
        let latents = parameters.latents.as_ref();
        let map = map_term(&parameters.latents, &parameters.map, self.scaled.as_ref(), &mut self.map_workspace)?;
        let inputs = self.layout.inputs(latents, &self.predicted);
        let targets = self.layout.targets(latents, &self.predicted);
        let workspace = &mut self.dynamics_workspace;
        if workspace.white.ncols() != targets.ncols() {
            *workspace = Workspace::new(targets.nrows(), targets.ncols());
        }
        let (dynamics, by_targets) =
            dynamics_term(&inputs, &parameters.dynamics, targets.as_ref(), self.balance, workspace)?;
        Some((map, dynamics, by_targets))
    }

    /// The prior on the first latents of every sequence.
    fn start_prior(&self, z: &Mat<f64>, gradient: &mut Mat<f64>) -> f64 {
        let mut value = 0.0;
        for start in self.layout.starts() {
            for c in 0..z.ncols() {
                let first = z[(start, c)];
                value += 0.5 * self.balance * first * first;
                gradient[(start, c)] += self.balance * first;
                if self.layout.order == DynamicsOrder::Second {
                    let step = z[(start + 1, c)] - first;
                    value += 0.5 * self.balance * step * step;
                    gradient[(start + 1, c)] += self.balance * step;
                    gradient[(start, c)] -= self.balance * step;
                }
            }
        }
        value
    }
}

/// `D/2 ln|K_X| + 1/2 tr(K_X^-1 Y Y^T)` for `Y = X W`.
fn map_term(
    z: &Mat<f64>,
    kernel: &MapKernel,
    scaled: MatRef<'_, f64>,
    workspace: &mut Workspace,
) -> Option<LossTerm<2>> {
    radial_lower(1.0, kernel.inverse_width, z, &mut workspace.radial);
    workspace.covariance.copy_from_triangular_lower(&workspace.radial);
    let (value, by_precision) = workspace.gaussian(kernel.noise_precision, scaled, 1.0)?;
    let RadialGradient { inputs, width, .. } =
        radial_gradient(&workspace.by_kernel, &workspace.radial, kernel.inverse_width, z);
    Some(LossTerm { value, inputs, logarithms: [width, by_precision] })
}

/// `balance (d/2 ln|K_Z| + 1/2 tr(K_Z^-1 V V^T))`, and its gradient by the targets `V`.
fn dynamics_term(
    u: &Mat<f64>,
    kernel: &DynamicsKernel,
    targets: MatRef<'_, f64>,
    balance: f64,
    workspace: &mut Workspace,
) -> Option<(LossTerm<4>, Mat<f64>)> {
    radial_lower(kernel.amplitude, kernel.inverse_width, u, &mut workspace.radial);
    workspace.covariance.copy_from_triangular_lower(&workspace.radial);
    add_square(&mut workspace.covariance, kernel.linear, u.as_ref());
    let (value, by_precision) = workspace.gaussian(kernel.noise_precision, targets, balance)?;
    let hu = symmetric_times(&workspace.by_kernel, u);
    let by_linear = kernel.linear * inner_product(u.as_ref(), hu.as_ref());
    let mut by_radial = radial_gradient(&workspace.by_kernel, &workspace.radial, kernel.inverse_width, u);
    by_radial.inputs += Scale(2.0 * kernel.linear) * &hu;
    let logarithms = [by_radial.amplitude, by_radial.width, by_linear, by_precision];
    Some((LossTerm { value, inputs: by_radial.inputs, logarithms }, Scale(balance) * &workspace.solution))
}

impl Workspace {
    /// `weight (D/2 ln|K| + 1/2 tr(K^-1 Y Y^T))` and its derivative by the logarithm of the noise precision, for the
    /// noise-free covariances in the workspace (lower triangle) and the columns `Y`. Leaves the solution and the
    /// derivative by the kernel in the workspace.
    fn gaussian(&mut self, noise_precision: f64, y: MatRef<'_, f64>, weight: f64) -> Option<(f64, f64)> {
        let dimensions = y.ncols() as f64;
        if !self.factor.factor_in_place(self.covariance.as_ref(), 1.0 / noise_precision) {
            return None;
        }
        self.factor.whiten(y, &mut self.white);
        let square = inner_product(self.white.as_ref(), self.white.as_ref());
        self.factor.solve_whitened(self.white.as_ref(), &mut self.solution);
        self.factor.inverse_lower(0.5 * weight * dimensions, &mut self.by_kernel);
        add_square(&mut self.by_kernel, -0.5 * weight, self.solution.as_ref());
        let trace: f64 = (0..y.nrows()).map(|i| self.by_kernel[(i, i)]).sum();
        let value = 0.5 * weight * (dimensions * self.factor.log_determinant() + square);
        Some((value, -trace / noise_precision))
    }
}

/// Adds `weight A A^T` to the lower triangle.
fn add_square(matrix: &mut Mat<f64>, weight: f64, a: MatRef<'_, f64>) {
    triangular_matmul(
        matrix.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Add,
        a,
        BlockStructure::Rectangular,
        a.transpose(),
        BlockStructure::Rectangular,
        weight,
        Par::Seq,
    );
}

fn inner_product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> f64 {
    (0..a.ncols()).map(|c| a.col(c).iter().zip(b.col(c).iter()).map(|(x, y)| x * y).sum::<f64>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(i: usize, j: usize) -> f64 {
        ((i as f64) * 0.37 + 1.3 * j as f64).sin() + 0.1 * ((i * (j + 2)) as f64 * 0.11).cos()
    }

    fn example(frames: usize) -> Parameters {
        Parameters {
            latents: Mat::from_fn(frames, 3, |i, c| 0.8 * wave(i, c) - 0.05 * c as f64),
            map: MapKernel { inverse_width: 1.3, noise_precision: 40.0 },
            dynamics: DynamicsKernel { amplitude: 0.3, inverse_width: 0.7, linear: 0.8, noise_precision: 25.0 },
        }
    }

    #[test]
    fn gradients_equal_central_differences_for_every_kind_of_dynamics() {
        let observations = Mat::from_fn(20, 5, |i, j| wave(i, j + 3));
        let scales = [0.9, 1.1, 0.7, 1.4, 1.0];
        for order in [DynamicsOrder::First, DynamicsOrder::Second] {
            for delta in [false, true] {
                for balance in [1.0, 13.0] {
                    for lengths in [vec![20], vec![9, 11]] {
                        let layout = SequenceLayout { order, delta, lengths };
                        let mut objective = Objective::new(observations.as_ref(), &scales, &layout, balance);
                        let worst = worst_gradient_error(&mut objective, &example(20).pack());
                        assert!(worst < 1e-6, "{layout:?} balance {balance}: relative error {worst:e}");
                    }
                }
            }
        }
    }

    fn worst_gradient_error(objective: &mut Objective<'_>, theta: &[f64]) -> f64 {
        let mut gradient = vec![0.0; theta.len()];
        let mut ignored = gradient.clone();
        objective.value_and_gradient(theta, 3, &mut gradient);
        let scale = gradient.iter().map(|g| g.abs()).fold(0.0, f64::max);
        (0..theta.len())
            .map(|k| {
                let h = 1e-5;
                let mut at = |delta: f64| {
                    let mut moved = theta.to_vec();
                    moved[k] += delta;
                    objective.value_and_gradient(&moved, 3, &mut ignored)
                };
                // fourth-order central difference
                let numeric = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                (numeric - gradient[k]).abs() / gradient[k].abs().max(1e-3 * scale)
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn loss_and_gradient_match_numpy() {
        // from benches/reference/gpdm_numpy.py
        for (frames, loss, norm) in [(60, -5616.353228347, 1531.684810127), (150, -16247.204891036, 4103.284616998)] {
            let observations = Mat::from_fn(frames, 60, |i, j| {
                let (i, j) = (i as f64, j as f64);
                let phase = i * std::f64::consts::TAU / 65.0;
                let swing = (1.0 + 0.2 * (i * 0.013 + j).sin()) * (phase + 0.7 * j).sin() * (0.1 + 0.005 * j);
                swing + 0.05 * (2.0 * phase + 0.3 * j).cos()
            });
            let theta = Parameters {
                latents: Mat::from_fn(frames, 3, |i, c| ((i as f64) * 0.0967 + c as f64 * 1.6).sin() * 1.4),
                map: MapKernel { inverse_width: 1.0, noise_precision: 50.0 },
                dynamics: DynamicsKernel { amplitude: 0.1, inverse_width: 1.0, linear: 0.9, noise_precision: 50.0 },
            }
            .pack();
            let layout = SequenceLayout { order: DynamicsOrder::First, delta: false, lengths: vec![frames] };
            let mut gradient = vec![0.0; theta.len()];
            let mut objective = Objective::new(observations.as_ref(), &[1.0; 60], &layout, 1.0);
            let value = objective.value_and_gradient(&theta, 3, &mut gradient);
            let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            assert!((value - loss).abs() < 1e-8 && (length - norm).abs() < 1e-8, "{value} {length}");
        }
    }

    #[test]
    fn the_loss_equals_its_formula_written_with_dense_matrices() {
        let (n, parameters) = (6, example(6));
        let observations = Mat::from_fn(n, 2, wave);
        let scales = [0.5, 2.0];
        let layout = SequenceLayout { order: DynamicsOrder::First, delta: false, lengths: vec![n] };
        let theta = parameters.pack();
        let mut gradient = vec![0.0; theta.len()];
        let value =
            Objective::new(observations.as_ref(), &scales, &layout, 2.0).value_and_gradient(&theta, 3, &mut gradient);
        let z = &parameters.latents;
        let squared = |a: usize, b: usize| (0..3).map(|c| (z[(a, c)] - z[(b, c)]).powi(2)).sum::<f64>();
        let dot = |a: usize, b: usize| (0..3).map(|c| z[(a, c)] * z[(b, c)]).sum::<f64>();
        let unit = |a: usize, b: usize| f64::from(u8::from(a == b));
        let kx = Mat::from_fn(n, n, |a, b| (-0.65 * squared(a, b)).exp() + unit(a, b) / 40.0);
        let kz = Mat::from_fn(n - 1, n - 1, |a, b| {
            0.3 * (-0.35 * squared(a, b)).exp() + 0.8 * dot(a, b) + unit(a, b) / 25.0
        });
        let xw = Mat::from_fn(n, 2, |i, j| observations[(i, j)] * scales[j]);
        let v = Mat::from_fn(n - 1, 3, |i, c| z[(i + 1, c)]);
        let expected = gaussian(&kx, &xw) + 2.0 * gaussian(&kz, &v) + 2.0 * 0.5 * dot(0, 0)
            - n as f64 * (0.5_f64.ln() + 2.0_f64.ln())
            + 0.5e-6 * (0.25 + 4.0)
            + [1.3, 40.0, 0.3, 0.7, 0.8, 25.0_f64].iter().map(|p| p.ln()).sum::<f64>();
        assert!((value - expected).abs() < 1e-10 * expected.abs(), "{value} against {expected}");
    }

    /// `D/2 ln|K| + 1/2 tr(K^-1 Y Y^T)` by an eigendecomposition, independent of Cholesky.
    fn gaussian(k: &Mat<f64>, y: &Mat<f64>) -> f64 {
        let n = k.nrows();
        let eigen = nalgebra::SymmetricEigen::new(nalgebra::DMatrix::from_fn(n, n, |a, b| k[(a, b)]));
        (0..n)
            .map(|i| {
                let (value, axis) = (eigen.eigenvalues[i], eigen.eigenvectors.column(i));
                let projected = |j: usize| (0..n).map(|a| axis[a] * y[(a, j)]).sum::<f64>();
                let square: f64 = (0..y.ncols()).map(|j| projected(j).powi(2)).sum();
                0.5 * y.ncols() as f64 * value.ln() + 0.5 * square / value
            })
            .sum()
    }
}
