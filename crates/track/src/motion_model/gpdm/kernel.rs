//! The two covariance functions of a GPDM.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::radial::radial;

/// `k_X(z, z') = exp(-beta2/2 |z - z'|^2) + delta / beta3`: latent point to pose. Its amplitude is 1, absorbed by `W`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MapKernel {
    /// Inverse squared length scale, beta2.
    pub inverse_width: f64,
    /// Precision of the observation noise, beta3.
    pub noise_precision: f64,
}

/// `k_Z(u, u') = alpha1 exp(-alpha2/2 |u - u'|^2) + alpha3 u.u' + delta / alpha4`: latent point to next latent point.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DynamicsKernel {
    /// Amplitude of the radial part, alpha1.
    pub amplitude: f64,
    /// Inverse squared length scale of the radial part, alpha2.
    pub inverse_width: f64,
    /// Amplitude of the linear part, alpha3.
    pub linear: f64,
    /// Precision of the process noise, alpha4.
    pub noise_precision: f64,
}

impl MapKernel {
    /// Prior variance of a noise-free value, `k_X(z, z)` without the noise.
    pub const VARIANCE: f64 = 1.0;

    /// Writes noise-free cross covariances: entry `(i, j)` for row `i` of `a` and row `j` of `b`.
    pub(super) fn cross(&self, a: &Mat<f64>, b: MatRef<'_, f64>, values: &mut Mat<f64>) {
        radial(1.0, self.inverse_width, a, b, values);
    }
}

impl DynamicsKernel {
    /// Prior variance of a noise-free step from `u`.
    pub(super) fn variance(&self, squared_norm: f64) -> f64 {
        self.amplitude + self.linear * squared_norm
    }

    /// Writes noise-free cross covariances: entry `(i, j)` for row `i` of `a` and row `j` of `b`.
    pub(super) fn cross(&self, a: &Mat<f64>, b: MatRef<'_, f64>, values: &mut Mat<f64>) {
        radial(self.amplitude, self.inverse_width, a, b, values);
        matmul(values.as_mut(), Accum::Add, a, b.transpose(), self.linear, Par::Seq);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kernels_equal_their_formulas() {
        let a = Mat::from_fn(2, 3, |i, j| 0.3 * i as f64 - 0.2 * j as f64);
        let b = Mat::from_fn(4, 3, |i, j| 0.1 * (i * j) as f64 + 0.05);
        let (mut map, mut dynamics) = (Mat::zeros(2, 4), Mat::zeros(2, 4));
        MapKernel { inverse_width: 1.7, noise_precision: 10.0 }.cross(&a, b.as_ref(), &mut map);
        let kernel = DynamicsKernel { amplitude: 0.4, inverse_width: 0.9, linear: 0.6, noise_precision: 5.0 };
        kernel.cross(&a, b.as_ref(), &mut dynamics);
        for i in 0..2 {
            for j in 0..4 {
                let squared: f64 = (0..3).map(|c| (a[(i, c)] - b[(j, c)]).powi(2)).sum();
                let dot: f64 = (0..3).map(|c| a[(i, c)] * b[(j, c)]).sum();
                assert!((map[(i, j)] - (-0.85 * squared).exp()).abs() < 1e-15);
                assert!((dynamics[(i, j)] - (0.4 * (-0.45 * squared).exp() + 0.6 * dot)).abs() < 1e-15);
            }
        }
    }
}
