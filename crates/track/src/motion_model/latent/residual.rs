//! The residual of a learned model: the distance of unseen motion from it.

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use super::super::gpdm_graph::{GpdmGraph, GraphSegment};
use super::super::pose_chart::{PlanarRoot, PlanarStep, PoseChart, ROOT_DIMENSIONS};
use super::footing::Footing;
use skiagraph_core::body::Humanoid;
use skiagraph_core::rng::normal;

/// Frames nearer in time than this are not unseen motion, seconds.
const APART_S: f64 = 0.25;

/// Least variance, in squared units of the chart.
const LEAST_VARIANCE: f64 = 1e-18;

/// The root's velocities at the end of an observation vector: they have separate noise and no offset.
const VELOCITIES: usize = 3;

/// Share of the covariances between different numbers of a pose that is removed: a few hundred training frames, with
/// similar neighbours, do not determine 22 x 22 of them well (`[Ledoit 2004]` shrinks likewise, towards a multiple of
/// the identity).
const SHRINKAGE: f64 = 0.1;

/// The difference between a particle's pose and the map's mean: a random offset that decays to zero.
///
/// An unseen cycle is farther from the latent manifold than the map's variance at the training latents indicates,
/// because the training frames are on it by construction. The distance is measured on the training data by leaving
/// time out: each frame is compared with the most similar one of another moment. The offset
/// `r_t = a r_{t-1} + sqrt(1 - a^2) L e` (an Ornstein-Uhlenbeck process sampled once per frame, `e` standard normal)
/// has the covariance `L L^T` of these differences: hips and knees vary together so that the feet stay below the body.
#[derive(Clone, Debug)]
pub(super) struct PoseResidual {
    /// `L`, lower triangular, one row per number of the pose (D - 3); empty if particles stay on the manifold.
    factor: Vec<Vec<f64>>,
    /// `a`.
    keep: f64,
}

impl PoseResidual {
    /// With a covariance of unseen motion, its standard deviations multiplied by `scale`; `correlation_s` is the time
    /// in which an offset decays to 1/e.
    pub(super) fn new(covariance: &DMatrix<f64>, scale: f64, correlation_s: f64, frames_per_second: f64) -> Self {
        let factor = if scale > 0.0 { factor_of(covariance, scale) } else { Vec::new() };
        Self { factor, keep: libm::exp(-1.0 / (correlation_s * frames_per_second)) }
    }

    /// Standard deviations of the noise added in one frame.
    pub(super) fn increments(&self) -> impl Iterator<Item = f64> + '_ {
        self.factor.iter().map(|row| self.innovation() * row.iter().map(|l| l * l).sum::<f64>().sqrt())
    }

    pub(super) fn between(&self, mean: &[f64], observation: &[f64]) -> Vec<f64> {
        self.factor.iter().zip(observation.iter().zip(mean)).map(|(_, (o, m))| o - m).collect()
    }

    pub(super) fn next(&self, offset: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
        let drawn: Vec<f64> = offset.iter().map(|_| normal(rng)).collect();
        self.moved(&self.expected(offset), &drawn)
    }

    /// The mean of the offset one frame later.
    pub(super) fn expected(&self, offset: &[f64]) -> Vec<f64> {
        offset.iter().map(|r| self.keep * r).collect()
    }

    /// A mean plus noise of these standard normal numbers.
    pub(super) fn moved(&self, mean: &[f64], numbers: &[f64]) -> Vec<f64> {
        let scaled: Vec<f64> = numbers.iter().map(|e| self.innovation() * e).collect();
        let added = |row: &Vec<f64>| row.iter().zip(&scaled).map(|(l, e)| l * e).sum::<f64>();
        mean.iter().zip(&self.factor).map(|(r, row)| r + added(row)).collect()
    }

    /// The numbers that lead from a mean to an offset, the inverse of [`Self::moved`]; `None` if there are none.
    pub(super) fn numbers(&self, mean: &[f64], offset: &[f64]) -> Option<Vec<f64>> {
        let mut numbers: Vec<f64> = Vec::with_capacity(offset.len());
        for ((row, r), mean) in self.factor.iter().zip(offset).zip(mean) {
            let (diagonal, before) = row.split_last()?;
            let known: f64 = before.iter().zip(&numbers).map(|(l, e)| l * self.innovation() * e).sum();
            numbers.push((r - mean - known) / (self.innovation() * diagonal));
        }
        Some(numbers)
    }

    fn innovation(&self) -> f64 {
        (1.0 - self.keep * self.keep).sqrt()
    }
}

/// The Cholesky factor of a covariance after shrinkage towards its diagonal and scaling of its standard deviations.
fn factor_of(covariance: &DMatrix<f64>, scale: f64) -> Vec<Vec<f64>> {
    let n = covariance.nrows();
    let shrunk = DMatrix::from_fn(n, n, |i, j| {
        let value = scale * scale * covariance[(i, j)];
        // a number that never varied must not make the matrix singular
        if i == j { value.max(LEAST_VARIANCE) } else { (1.0 - SHRINKAGE) * value }
    });
    let diagonal = || DMatrix::from_diagonal(&shrunk.diagonal().map(f64::sqrt));
    let factor = shrunk.clone().cholesky().map_or_else(diagonal, |cholesky| cholesky.l());
    (0..n).map(|i| (0..=i).map(|j| factor[(i, j)]).collect()).collect()
}

pub(super) fn offset_by(mut mean: Vec<f64>, offset: &[f64]) -> Vec<f64> {
    mean.iter_mut().zip(offset).for_each(|(m, r)| *m += r);
    mean
}

/// Distance of unseen motion from training motion: mean products of the differences (D x D) between the observation
/// vectors of every training frame and of the most similar one of another moment. Zero if there is no other moment.
#[derive(Clone, Debug)]
pub(super) struct Unseen {
    all: DMatrix<f64>,
    by_motion: Vec<DMatrix<f64>>,
}

struct TrainingFrame {
    motion: usize,
    frame: usize,
    observation: Vec<f64>,
}

impl Unseen {
    /// Measured on the training data of `graph`. With `footing`, the compared height is that of the lower foot instead
    /// of the root's.
    pub(super) fn measure(body: &Humanoid, graph: &GpdmGraph, footing: Option<&Footing>) -> Self {
        let frames = training_frames(body, graph, footing);
        let apart = (APART_S * graph.frames_per_second) as usize;
        let compared = graph.chart.dimensions().saturating_sub(ROOT_DIMENSIONS);
        let distance =
            |a: &[f64], b: &[f64]| a.iter().zip(b).take(compared).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let motions = frames.iter().map(|frame| frame.motion + 1).max().unwrap_or(0);
        let mut by_motion = vec![MeanProducts::new(graph.chart.dimensions()); motions];
        let mut all = MeanProducts::new(graph.chart.dimensions());
        for TrainingFrame { motion, frame, observation } in &frames {
            let others = frames.iter().filter(|other| other.motion != *motion || other.frame.abs_diff(*frame) > apart);
            let far = |other: &TrainingFrame| distance(observation, &other.observation);
            let nearest = others.min_by(|a, b| far(a).total_cmp(&far(b)));
            if let Some(there) = nearest {
                let difference = observation.iter().zip(&there.observation).map(|(a, b)| a - b);
                let difference = DVector::from_iterator(observation.len(), difference);
                all.add(&difference);
                by_motion[*motion].add(&difference);
            }
        }
        Self { all: all.mean(), by_motion: by_motion.into_iter().map(MeanProducts::mean).collect() }
    }

    /// Covariance of the numbers of a pose, its height last, over all training data.
    pub(super) fn covariance_of_pose(&self) -> DMatrix<f64> {
        without_velocities(&self.all)
    }

    /// The same for the recording from which a segment was learned; for all training data if there were several.
    ///
    /// A cyclic pose is not informative about gestures that never repeat: with pooled covariances, particles at rest
    /// were held to the mean so firmly that none came near another model when the actor began to move.
    pub(super) fn covariance_of_segment(&self, segment: &GraphSegment) -> DMatrix<f64> {
        let own = self.by_motion.get(segment.range.motion).filter(|_| segment.gpdm.layout().lengths.len() == 1);
        without_velocities(own.unwrap_or(&self.all))
    }

    /// Deviations of the root's steps: metres and radians per frame.
    pub(super) fn step(&self, chart: &PoseChart) -> PlanarStep {
        chart.planar_step(self.all.diagonal().map(f64::sqrt).as_slice())
    }
}

/// Every training frame; with `footing`, its height is that of the lower foot.
fn training_frames(body: &Humanoid, graph: &GpdmGraph, footing: Option<&Footing>) -> Vec<TrainingFrame> {
    let height = graph.chart.dimensions().saturating_sub(VELOCITIES + 1);
    let of_row = |s: &GraphSegment, row: usize| {
        let mut observation = s.gpdm.observation(row);
        if let Some(footing) = footing {
            let pose = graph.chart.place(&observation, &PlanarRoot { x: 0.0, y: 0.0, yaw: 0.0 });
            observation[height] = footing.feet(body, &pose).lower_height() / graph.chart.height_unit();
        }
        let (motion, frame) = s.source_of(row);
        TrainingFrame { motion, frame, observation }
    };
    let rows = graph.segments.iter().flat_map(|s| (0..s.rotations.len()).map(move |row| (s, row)));
    rows.map(|(s, row)| of_row(s, row)).collect()
}

#[derive(Clone)]
struct MeanProducts {
    sum: DMatrix<f64>,
    count: f64,
}

impl MeanProducts {
    fn new(dimensions: usize) -> Self {
        Self { sum: DMatrix::zeros(dimensions, dimensions), count: 0.0 }
    }

    fn add(&mut self, difference: &DVector<f64>) {
        self.sum.ger(1.0, difference, difference, 1.0);
        self.count += 1.0;
    }

    fn mean(self) -> DMatrix<f64> {
        self.sum / f64::max(self.count, 1.0)
    }
}

fn without_velocities(products: &DMatrix<f64>) -> DMatrix<f64> {
    let numbers = products.nrows().saturating_sub(VELOCITIES);
    products.view((0, 0), (numbers, numbers)).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::rng::{Purpose, stream};

    #[test]
    fn an_offset_decays_and_keeps_its_given_deviation() {
        let residual = PoseResidual { factor: vec![vec![0.2], vec![0.0, 0.05]], keep: libm::exp(-1.0 / 15.0) };
        let mut rng = stream(1, Purpose::MotionModel, 0, 0, 0);
        let (mut offset, mut squares) = (vec![3.0, 0.0], [0.0; 2]);
        for frame in 0..20_300 {
            offset = residual.next(&offset, &mut rng);
            if frame >= 300 {
                squares.iter_mut().zip(&offset).for_each(|(s, r)| *s += r * r / 20_000.0);
            }
        }
        // some 20000 / 30 independent draws: the standard error of a standard deviation is 2.7 %
        for (square, planted) in squares.iter().zip([0.2, 0.05]) {
            assert!((square.sqrt() / planted - 1.0).abs() < 0.11, "{} for {planted}", square.sqrt());
        }
    }

    #[test]
    fn an_offset_leads_from_a_mean_to_an_observation_and_leaves_velocities_unchanged() {
        let residual = PoseResidual { factor: vec![vec![0.1], vec![0.0, 0.1]], keep: 0.9 };
        let offset = residual.between(&[1.0, 2.0, 5.0, 5.0, 5.0], &[1.5, 1.0, 9.0, 9.0, 9.0]);
        assert_eq!(offset_by(vec![1.0, 2.0, 5.0, 5.0, 5.0], &offset), [1.5, 1.0, 5.0, 5.0, 5.0]);
        let none = PoseResidual { factor: Vec::new(), keep: 0.9 };
        assert!(none.between(&[1.0], &[2.0]).is_empty());
    }
}
