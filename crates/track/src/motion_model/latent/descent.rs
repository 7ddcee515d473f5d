//! Descent of a particle on an observation, with the model as prior.
//!
//! A particle of the next frame is a function of independent standard normal numbers `e`, one for every coordinate of
//! its latent point, every number of its offset and every direction of its root:
//!
//! - latent point `mu + sigma e`, the dynamics' mean and deviation (`[GPDM graph]` Eq. 5);
//! - offset `a r + sqrt(1 - a^2) L e`, where `r` was the offset of the previous frame;
//! - root as predicted by its feet and the model's velocities, moved by its own noise times `e`.
//!
//! So the negative logarithm of the prior is `|e|^2 / 2` for any model, and one damped Gauss-Newton step in `e` of
//! `cost(pose(e)) + PRIOR |e|^2` is a step towards the most probable pose. Without the prior, a single silhouette
//! would also fit poses that the model considers impossible.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::super::NormalEquations;
use super::super::pose_chart::PlanarRoot;
use super::model::{Expected, LatentModel, LatentParticle};

/// Cost of one squared standard deviation of the prior, in squared lengths of an outline's residuals: neighbouring
/// residuals are correlated, so that some tens of them count as one. Chosen among 1, 4 and 16 on takes that are not
/// reported (`results/monocular-notes.md`).
const PRIOR: f64 = 4.0;
/// Finite-difference step for derivatives of poses, standard deviations: above round-off, below curvature.
const DIFFERENCE: f64 = 1e-4;
/// Greatest length of one step, standard deviations.
const FARTHEST: f64 = 2.0;
/// Numbers of the root.
const ROOT: usize = 3;

impl LatentModel {
    /// The particle moved one step towards the most probable one; `None` in the first frame, which has no prediction,
    /// and if the equations are singular.
    pub(super) fn descended(&self, state: &LatentParticle, evidence: &NormalEquations) -> Option<LatentParticle> {
        let expected = state.expected.as_deref()?;
        let numbers = self.numbers(state, expected)?;
        let jacobian = self.jacobian(state, expected, &numbers);
        let count = numbers.len();
        let mut reduced = NormalEquations {
            matrix: jacobian.tr_mul(&(&evidence.matrix * &jacobian)),
            gradient: jacobian.tr_mul(&evidence.gradient),
            ..evidence.clone()
        };
        let home: Vec<f64> = numbers.iter().map(|e| -e).collect();
        reduced.pull(&home, &vec![PRIOR; count]);
        let step = reduced.step_within(&vec![[-FARTHEST, FARTHEST]; count])?;
        let moved: Vec<f64> = numbers.iter().zip(step.iter()).map(|(e, s)| e + s).collect();
        Some(self.at(state, expected, &moved))
    }

    /// The particle for these numbers.
    fn at(&self, state: &LatentParticle, expected: &Expected, numbers: &[f64]) -> LatentParticle {
        let latent = &numbers[..expected.latent.len()];
        let latent: Vec<f64> = expected.latent.iter().zip(latent).map(|(z, e)| z + expected.deviation * e).collect();
        let mut there = state.clone();
        there.mean = self.observation(state.segment, &latent);
        there.latent = latent;
        self.on_mean(there, expected, numbers)
    }

    /// The particle for these numbers, with its latent point and the map's mean already set.
    fn on_mean(&self, mut state: LatentParticle, expected: &Expected, numbers: &[f64]) -> LatentParticle {
        let (offset, root) = numbers[expected.latent.len()..].split_at(expected.offset.len());
        state.offset = self.residuals[state.segment].moved(&expected.offset, offset);
        let stand = self.stand(&state.mean, &state.offset);
        let (place, pose) = self.roots.next(&expected.before, &expected.place, &stand, [root[0], root[1], root[2]]);
        state.moving.rotations = self.graph.chart.rotations_of(&state.mean);
        state.pose = self.with_given_root(pose, state.frame);
        state.place = place;
        state
    }

    /// The numbers that produce a particle. The root's are found by one Newton step, because it is nearly linear in
    /// them.
    fn numbers(&self, state: &LatentParticle, expected: &Expected) -> Option<Vec<f64>> {
        let latent = state.latent.iter().zip(&expected.latent).map(|(z, mean)| (z - mean) / expected.deviation);
        let mut numbers: Vec<f64> = latent.collect();
        numbers.extend(self.residuals[state.segment].numbers(&expected.offset, &state.offset)?);
        let first = numbers.len();
        numbers.extend([0.0; ROOT]);
        let root = |numbers: &[f64]| self.on_mean(state.clone(), expected, numbers).place.root;
        let still = root(&numbers);
        let apart = |other: &PlanarRoot| {
            let step = still.step_to(other);
            Vector3::new(step.forward, step.left, step.turn)
        };
        let mut columns = Matrix3::zeros();
        for axis in 0..ROOT {
            numbers[first + axis] = 1.0;
            columns.set_column(axis, &apart(&root(&numbers)));
            numbers[first + axis] = 0.0;
        }
        let found = columns.lu().solve(&apart(&state.place.root))?;
        numbers[first..].copy_from_slice(found.as_slice());
        numbers.iter().all(|number| number.is_finite()).then_some(numbers)
    }

    /// Derivative of a step of the pose by the numbers: one column per number.
    fn jacobian(&self, state: &LatentParticle, expected: &Expected, numbers: &[f64]) -> DMatrix<f64> {
        let here = self.on_mean(state.clone(), expected, numbers);
        let mut step = vec![0.0; self.body.step_len()];
        let columns: Vec<DVector<f64>> = (0..numbers.len())
            .map(|number| {
                let mut numbers = numbers.to_vec();
                numbers[number] += DIFFERENCE;
                // Offset and root do not change the map's mean, whose evaluation is the slow part.
                let there = if number < expected.latent.len() {
                    self.at(state, expected, &numbers)
                } else {
                    self.on_mean(state.clone(), expected, &numbers)
                };
                self.body.difference(&here.pose, &there.pose, &mut step);
                DVector::from_iterator(step.len(), step.iter().map(|s| s / DIFFERENCE))
            })
            .collect();
        DMatrix::from_columns(&columns)
    }
}
