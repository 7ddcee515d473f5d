//! What a learned model leaves unexplained: how far motion that was not seen lies from it.

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use super::super::gpdm_graph::{GpdmGraph, GraphSegment};
use super::super::pose_chart::{PlanarRoot, PlanarStep, PoseChart, ROOT_DIMENSIONS};
use super::footing::Footing;
use crate::body::Humanoid;
use crate::rng::normal;

/// Frames nearer in time than this are no new motion, seconds.
const APART_S: f64 = 0.25;

/// Variances never fall below this, in squares of the chart's units.
const LEAST_VARIANCE: f64 = 1e-18;

/// The root's velocities, which end an observation vector: they have noise of their own, no offset.
const VELOCITIES: usize = 3;

/// How much of the covariance between different numbers of a pose is taken away: a few hundred training frames,
/// neighbours much alike, do not tell 22 x 22 of them well (`[Ledoit 2004]` shrinks likewise, towards a multiple of
/// the identity).
const SHRINKAGE: f64 = 0.1;

/// What a particle's pose has beside the map's mean: an offset that wanders and is drawn back to zero.
///
/// A cycle that was not seen lies off the latent manifold by more than the map's variance at the training latents says:
/// the training frames lie on it by construction. How far is measured in the training itself, by leaving time out: each
/// frame is compared with the most similar one of another moment. The offset `r_t = a r_{t-1} + sqrt(1 - a^2) L e` (an
/// Ornstein-Uhlenbeck process sampled once a frame, `e` standard normal) has the covariance `L L^T` of these
/// differences: hips and knees that differ together keep the feet below the body.
#[derive(Clone, Debug)]
pub(super) struct PoseResidual {
    /// `L`, lower triangular, a row a number of the pose (D - 3); empty where particles keep to the manifold.
    factor: Vec<Vec<f64>>,
    /// `a`.
    keep: f64,
}

impl PoseResidual {
    /// With the covariance of motion that was not seen, its deviations scaled by `scale`; `correlation_s` is the time
    /// after which an offset is 1/e as great.
    pub(super) fn new(unseen: &Unseen, scale: f64, correlation_s: f64, frames_per_second: f64) -> Self {
        let factor = if scale > 0.0 { factor_of(&unseen.covariance_of_pose(), scale) } else { Vec::new() };
        Self { factor, keep: libm::exp(-1.0 / (correlation_s * frames_per_second)) }
    }

    /// Deviations of what is added in one frame.
    pub(super) fn increments(&self) -> impl Iterator<Item = f64> + '_ {
        self.factor.iter().map(|row| self.fresh() * row.iter().map(|l| l * l).sum::<f64>().sqrt())
    }

    /// The offset that makes an observation vector of a mean.
    pub(super) fn between(&self, mean: &[f64], observation: &[f64]) -> Vec<f64> {
        self.factor.iter().zip(observation.iter().zip(mean)).map(|(_, (o, m))| o - m).collect()
    }

    /// The offset one frame on.
    pub(super) fn next(&self, offset: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
        let drawn: Vec<f64> = offset.iter().map(|_| self.fresh() * normal(rng)).collect();
        let added = |row: &Vec<f64>| row.iter().zip(&drawn).map(|(l, e)| l * e).sum::<f64>();
        offset.iter().zip(&self.factor).map(|(r, row)| self.keep * r + added(row)).collect()
    }

    fn fresh(&self) -> f64 {
        (1.0 - self.keep * self.keep).sqrt()
    }
}

/// The Cholesky factor of a covariance, shrunk towards its diagonal, its deviations scaled.
fn factor_of(covariance: &DMatrix<f64>, scale: f64) -> Vec<Vec<f64>> {
    let n = covariance.nrows();
    let shrunk = DMatrix::from_fn(n, n, |i, j| {
        let value = scale * scale * covariance[(i, j)];
        // a number that never differed must not make the matrix singular
        if i == j { value.max(LEAST_VARIANCE) } else { (1.0 - SHRINKAGE) * value }
    });
    let diagonal = || DMatrix::from_diagonal(&shrunk.diagonal().map(f64::sqrt));
    let factor = shrunk.clone().cholesky().map_or_else(diagonal, |cholesky| cholesky.l());
    (0..n).map(|i| (0..=i).map(|j| factor[(i, j)]).collect()).collect()
}

/// The mean with the offset added.
pub(super) fn offset_by(mut mean: Vec<f64>, offset: &[f64]) -> Vec<f64> {
    mean.iter_mut().zip(offset).for_each(|(m, r)| *m += r);
    mean
}

/// How far motion that was not seen lies from what was: mean products of the differences (D x D) between the
/// observation vectors of every training frame and of the most similar one of another moment. Zero where there is no
/// other moment.
#[derive(Clone, Debug)]
pub(super) struct Unseen(DMatrix<f64>);

impl Unseen {
    /// Measured on the training of `graph`. Where `footing` is given, the height compared is not the root's but that of
    /// the lower foot.
    pub(super) fn measure(body: &Humanoid, graph: &GpdmGraph, footing: Option<&Footing>) -> Self {
        let height = graph.chart.dimensions().saturating_sub(VELOCITIES + 1);
        let of_row = |s: &GraphSegment, row: usize| {
            let mut observation = s.gpdm.observation(row);
            if let Some(footing) = footing {
                let pose = graph.chart.place(&observation, &PlanarRoot { x: 0.0, y: 0.0, yaw: 0.0 });
                observation[height] = footing.feet(body, &pose).lower_height() / graph.chart.height_unit();
            }
            let (motion, frame) = s.source_of(row);
            (motion, frame, observation)
        };
        let rows = graph.segments.iter().flat_map(|s| (0..s.rotations.len()).map(move |row| (s, row)));
        let frames: Vec<(usize, usize, Vec<f64>)> = rows.map(|(s, row)| of_row(s, row)).collect();
        let apart = (APART_S * graph.frames_per_second) as usize;
        let compared = graph.chart.dimensions().saturating_sub(ROOT_DIMENSIONS);
        let distance =
            |a: &[f64], b: &[f64]| a.iter().zip(b).take(compared).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let mut products = DMatrix::zeros(graph.chart.dimensions(), graph.chart.dimensions());
        let mut count = 0.0;
        for (motion, frame, here) in &frames {
            let others = frames.iter().filter(|(m, f, _)| m != motion || f.abs_diff(*frame) > apart);
            let nearest = others.min_by(|a, b| distance(here, &a.2).total_cmp(&distance(here, &b.2)));
            if let Some((.., there)) = nearest {
                let apart = DVector::from_iterator(here.len(), here.iter().zip(there).map(|(a, b)| a - b));
                products.ger(1.0, &apart, &apart, 1.0);
                count += 1.0;
            }
        }
        Self(products / f64::max(count, 1.0))
    }

    /// Of the numbers of a pose, its height last.
    fn covariance_of_pose(&self) -> DMatrix<f64> {
        let numbers = self.0.nrows().saturating_sub(VELOCITIES);
        self.0.view((0, 0), (numbers, numbers)).into_owned()
    }

    /// Of the root's steps: metres and radians a frame.
    pub(super) fn step(&self, chart: &PoseChart) -> PlanarStep {
        chart.planar_step(self.0.diagonal().map(f64::sqrt).as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Purpose, stream};

    #[test]
    fn an_offset_forgets_and_keeps_its_planted_deviation() {
        let residual = PoseResidual { factor: vec![vec![0.2], vec![0.0, 0.05]], keep: libm::exp(-1.0 / 15.0) };
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
        let residual = PoseResidual { factor: vec![vec![0.1], vec![0.0, 0.1]], keep: 0.9 };
        let offset = residual.between(&[1.0, 2.0, 5.0, 5.0, 5.0], &[1.5, 1.0, 9.0, 9.0, 9.0]);
        assert_eq!(offset_by(vec![1.0, 2.0, 5.0, 5.0, 5.0], &offset), [1.5, 1.0, 5.0, 5.0, 5.0]);
        let none = PoseResidual { factor: Vec::new(), keep: 0.9 };
        assert!(none.between(&[1.0], &[2.0]).is_empty());
    }
}
