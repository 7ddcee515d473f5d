//! What a learned model leaves unexplained: how far motion that was not seen lies from it.

use rand_chacha::ChaCha8Rng;

use super::super::gpdm_graph::GpdmGraph;
use super::super::pose_chart::ROOT_DIMENSIONS;
use super::model::normal;

/// Frames nearer in time than this are no new motion, seconds.
const APART_S: f64 = 0.25;

/// The root's velocities, which end an observation vector: they have noise of their own, no offset.
const VELOCITIES: usize = 3;

/// What a particle's pose has beside the map's mean: an offset that wanders and is drawn back to zero.
///
/// A cycle that was not seen lies off the latent manifold by more than the map's variance at the training latents says: the
/// training frames lie on it by construction. How far is measured in the training itself, by leaving time out: each frame
/// is compared with the most similar one of another moment. The offset `r_t = a r_{t-1} + sqrt(1 - a^2) s e` (an
/// Ornstein-Uhlenbeck process sampled once a frame, `e` standard normal) has that deviation `s` in every dimension.
#[derive(Clone, Debug)]
pub(super) struct Residual {
    /// Stationary deviations `s`, one a number of the pose (D - 3); empty where particles keep to the manifold.
    deviations: Vec<f64>,
    /// `a`.
    keep: f64,
}

impl Residual {
    /// Measured on the training of `graph`, the deviations scaled by `scale`; `correlation_s` is the time after which an
    /// offset is 1/e as great.
    pub(super) fn learn(graph: &GpdmGraph, scale: f64, correlation_s: f64) -> Self {
        let deviations = match scale > 0.0 {
            true => unseen_deviations(graph).into_iter().map(|s| s * scale).collect(),
            false => Vec::new(),
        };
        Self { deviations, keep: libm::exp(-1.0 / (correlation_s * graph.frames_per_second)) }
    }

    /// Deviations of what is added in one frame.
    pub(super) fn increments(&self) -> impl Iterator<Item = f64> + '_ {
        self.deviations.iter().map(|s| self.fresh() * s)
    }

    /// The offset that makes an observation vector of a mean.
    pub(super) fn between(&self, mean: &[f64], observation: &[f64]) -> Vec<f64> {
        self.deviations.iter().zip(observation.iter().zip(mean)).map(|(_, (o, m))| o - m).collect()
    }

    /// The offset one frame on.
    pub(super) fn next(&self, offset: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
        offset.iter().zip(self.increments()).map(|(r, s)| self.keep * r + s * normal(rng)).collect()
    }

    fn fresh(&self) -> f64 {
        (1.0 - self.keep * self.keep).sqrt()
    }
}

/// The mean with the offset added.
pub(super) fn offset_by(mut mean: Vec<f64>, offset: &[f64]) -> Vec<f64> {
    mean.iter_mut().zip(offset).for_each(|(m, r)| *m += r);
    mean
}

/// Root mean square difference, per number of a pose, between every training frame and the most similar one of another moment.
/// Zero where there is no other moment.
fn unseen_deviations(graph: &GpdmGraph) -> Vec<f64> {
    let frames: Vec<(usize, usize, Vec<f64>)> = graph
        .segments
        .iter()
        .flat_map(|s| {
            let rows = 0..s.rotations.len();
            rows.map(|row| (s.range.motion, s.range.first + row, s.gpdm.observation(row)))
        })
        .collect();
    let apart = (APART_S * graph.frames_per_second) as usize;
    let compared = graph.chart.dimensions().saturating_sub(ROOT_DIMENSIONS);
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).take(compared).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let mut squares = vec![0.0; graph.chart.dimensions().saturating_sub(VELOCITIES)];
    let mut count = 0.0;
    for (motion, frame, here) in &frames {
        let others = frames.iter().filter(|(m, f, _)| m != motion || f.abs_diff(*frame) > apart);
        let nearest = others.min_by(|a, b| distance(here, &a.2).total_cmp(&distance(here, &b.2)));
        if let Some((.., there)) = nearest {
            squares.iter_mut().zip(here.iter().zip(there)).for_each(|(s, (a, b))| *s += (a - b) * (a - b));
            count += 1.0;
        }
    }
    squares.into_iter().map(|s| (s / f64::max(count, 1.0)).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Purpose, stream};

    #[test]
    fn an_offset_forgets_and_keeps_its_planted_deviation() {
        let residual = Residual { deviations: vec![0.2, 0.05], keep: libm::exp(-1.0 / 15.0) };
        let mut rng = stream(1, Purpose::MotionModel, 0, 0, 0);
        let (mut offset, mut squares) = (vec![3.0, 0.0], [0.0; 2]);
        for frame in 0..20_300 {
            offset = residual.next(&offset, &mut rng);
            if frame >= 300 {
                squares.iter_mut().zip(&offset).for_each(|(s, r)| *s += r * r / 20_000.0);
            }
        }
        // some 20000 / 30 independent draws: the deviation of a deviation is 2.7 %
        for (square, planted) in squares.iter().zip([0.2, 0.05]) {
            assert!((square.sqrt() / planted - 1.0).abs() < 0.11, "{} for {planted}", square.sqrt());
        }
    }

    #[test]
    fn an_offset_leads_from_a_mean_to_an_observation_and_leaves_velocities_alone() {
        let residual = Residual { deviations: vec![0.1; 2], keep: 0.9 };
        let offset = residual.between(&[1.0, 2.0, 5.0, 5.0, 5.0], &[1.5, 1.0, 9.0, 9.0, 9.0]);
        assert_eq!(offset_by(vec![1.0, 2.0, 5.0, 5.0, 5.0], &offset), [1.5, 1.0, 5.0, 5.0, 5.0]);
        let none = Residual { deviations: Vec::new(), keep: 0.9 };
        assert!(none.between(&[1.0], &[2.0]).is_empty());
    }
}
