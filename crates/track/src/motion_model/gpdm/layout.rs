//! Order of the dynamics and boundaries of sequences of latent points.

use faer::{Mat, MatRef};

/// Number of past latent points on which the next one depends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DynamicsOrder {
    /// `z_t` from `z_{t-1}`, as assumed by `[GPDM graph]`.
    First,
    /// `z_t` from `z_{t-1}` and `z_{t-2}`, as in Wang's own code.
    Second,
}

impl DynamicsOrder {
    /// Number of past points.
    pub fn lag(self) -> usize {
        match self {
            Self::First => 1,
            Self::Second => 2,
        }
    }
}

/// The rows of the latent matrix that form sequences, and the quantity predicted by the dynamics in each.
///
/// Inputs `u_t = [z_{t-1}; z_{t-2}]` and targets `v_t = z_t` (or `z_t - z_{t-1}`) never cross the start of a sequence.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SequenceLayout {
    pub order: DynamicsOrder,
    /// Whether the dynamics predicts the step `z_t - z_{t-1}` instead of `z_t`.
    pub delta: bool,
    /// Lengths of the sequences, in frames; each at least `order.lag() + 1`.
    pub lengths: Vec<usize>,
}

impl SequenceLayout {
    pub fn frames(&self) -> usize {
        self.lengths.iter().sum()
    }

    /// First row of every sequence.
    pub fn starts(&self) -> impl Iterator<Item = usize> + '_ {
        self.lengths.iter().scan(0, |next, length| {
            let start = *next;
            *next += length;
            Some(start)
        })
    }

    /// Rows `t` that are predicted by the dynamics.
    pub(super) fn predicted(&self) -> Vec<usize> {
        let lag = self.order.lag();
        self.starts().zip(&self.lengths).flat_map(|(start, length)| start + lag..start + length).collect()
    }

    /// Inputs `U`, one row per predicted frame: `z_{t-1}` then, for the second order, `z_{t-2}`.
    pub(super) fn inputs(&self, latents: MatRef<'_, f64>, predicted: &[usize]) -> Mat<f64> {
        let d = latents.ncols();
        Mat::from_fn(predicted.len(), d * self.order.lag(), |row, column| {
            latents[(predicted[row] - 1 - column / d, column % d)]
        })
    }

    /// Targets `V`, one row per predicted frame.
    pub(super) fn targets(&self, latents: MatRef<'_, f64>, predicted: &[usize]) -> Mat<f64> {
        Mat::from_fn(predicted.len(), latents.ncols(), |row, column| {
            let t = predicted[row];
            latents[(t, column)] - if self.delta { latents[(t - 1, column)] } else { 0.0 }
        })
    }

    /// Adds the gradients with respect to inputs and targets to those with respect to the latents.
    pub(super) fn scatter(
        &self,
        predicted: &[usize],
        input_gradient: MatRef<'_, f64>,
        target_gradient: MatRef<'_, f64>,
        latent_gradient: &mut Mat<f64>,
    ) {
        let d = target_gradient.ncols();
        for (row, &t) in predicted.iter().enumerate() {
            for column in 0..input_gradient.ncols() {
                latent_gradient[(t - 1 - column / d, column % d)] += input_gradient[(row, column)];
            }
            for column in 0..d {
                latent_gradient[(t, column)] += target_gradient[(row, column)];
                if self.delta {
                    latent_gradient[(t - 1, column)] -= target_gradient[(row, column)];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_and_targets_never_cross_the_start_of_a_sequence() {
        let latents = Mat::from_fn(7, 1, |i, _| i as f64);
        let layout = SequenceLayout { order: DynamicsOrder::Second, delta: true, lengths: vec![4, 3] };
        let predicted = layout.predicted();
        assert_eq!(predicted, vec![2, 3, 6]);
        let inputs = layout.inputs(latents.as_ref(), &predicted);
        assert_eq!([inputs[(0, 0)], inputs[(0, 1)], inputs[(2, 0)], inputs[(2, 1)]], [1.0, 0.0, 5.0, 4.0]);
        let targets = layout.targets(latents.as_ref(), &predicted);
        assert!((0..3).all(|row| targets[(row, 0)] == 1.0));
    }
}
