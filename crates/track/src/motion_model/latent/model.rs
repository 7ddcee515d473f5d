//! The latent motion model and its particles.

use std::sync::Arc;

use faer::Mat;
use nalgebra::{DMatrix, Isometry3, UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::super::gpdm_graph::{Candidate, GpdmGraph};
use super::super::pose_chart::{PlanarRoot, PlanarStep};
use super::super::{ModelOccupancy, MotionModel, NormalEquations, SettingError};
use super::footing::Footing;
use super::initialisation::{Seed, seed_of, seeds};
use super::residual::{PoseResidual, Unseen, offset_by};
use super::root::{RootDynamics, RootPlace, Stand};
use super::settings::{LatentSettings, RootMotion};
use super::transition::{Jumps, PoseRate, jump, training_means};
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_core::rng::normal;

/// Latents farther than this many length scales of the map from every training latent are brought back. In that region
/// the map falls back to the mean pose and the linear part of the dynamics may diverge: the model has no information
/// there.
const GREATEST_LENGTHS: f64 = 2.0;

/// Number of particles moved in one matrix product. Incomplete batches are filled up: products of other shapes may add
/// in another order, and a particle's bits must not depend on batch contents.
const BATCH: usize = 128;

/// A GPDM graph that moves particles: the latent particles of `[GPDM graph]`.
#[derive(Clone, Debug)]
pub struct LatentModel {
    pub(super) body: Humanoid,
    pub(super) graph: Arc<GpdmGraph>,
    settings: LatentSettings,
    jumps: Jumps,
    /// For every segment, the map's mean at every training latent, one row per frame.
    training_means: Vec<Mat<f64>>,
    /// For every segment, the spread of the latents per coordinate.
    spreads: Vec<f64>,
    pub(super) roots: RootDynamics,
    /// For every segment.
    pub(super) residuals: Vec<PoseResidual>,
    /// The true root of every frame, if it is deliberately given (to separate articulated from global error).
    given_roots: Option<Arc<Vec<Isometry3<f64>>>>,
    deviations: Vec<f64>,
    /// Whether particles remember their prediction, so that they can descend.
    descends: bool,
}

/// One particle: a point in one model's latent space, and the body's position on the ground.
#[derive(Clone, Debug)]
pub struct LatentParticle {
    /// Index of the model, `k` in `[GPDM graph]`.
    pub segment: usize,
    /// `z_t`, d values.
    pub latent: Vec<f64>,
    /// `z_{t-1}`.
    before: Vec<f64>,
    /// The map's mean at the latent point, an observation vector.
    pub(super) mean: Vec<f64>,
    /// Difference of the particle's observation vector from that mean.
    pub(super) offset: Vec<f64>,
    pub(super) place: RootPlace,
    pub(super) frame: usize,
    /// The pose at the map's mean, and its rate of change.
    pub(super) moving: PoseRate,
    pub(super) pose: Pose,
    /// Whether the particle had left the training region in this frame and was brought back.
    pub recovered: bool,
    /// Its prediction before its noise was drawn; `None` in the first frame.
    pub(super) expected: Option<Arc<Expected>>,
}

/// Prediction of a model for a particle before its noise is drawn.
#[derive(Clone, Debug)]
pub(super) struct Expected {
    pub(super) latent: Vec<f64>,
    /// Standard deviation of each of its coordinates.
    pub(super) deviation: f64,
    pub(super) offset: Vec<f64>,
    /// Pose and position one frame before.
    pub(super) before: Pose,
    pub(super) place: RootPlace,
}

/// Starting point of a particle in a frame, after its inter-transition.
struct TransitionSource {
    segment: usize,
    latent: Vec<f64>,
    before: Vec<f64>,
    offset: Vec<f64>,
    /// The pose at the map's mean.
    rotations: Vec<UnitQuaternion<f64>>,
}

/// A particle during the propagation of a frame.
struct PendingParticle<'a> {
    index: usize,
    state: &'a LatentParticle,
    departure: TransitionSource,
    rng: &'a mut ChaCha8Rng,
}

impl LatentModel {
    /// A model that moves `body` with particles of `graph`, which must have been learned from motions of this body.
    ///
    /// # Errors
    /// [`SettingError`] if a setting is out of range or the body is a different one.
    pub fn new(body: Humanoid, graph: Arc<GpdmGraph>, settings: LatentSettings) -> Result<Self, SettingError> {
        settings.validate()?;
        let (known, found) = (graph.chart.angles(), body.degrees_of_freedom.len());
        if known != found {
            let expected = format!("a model of a body with {found} degrees of freedom, as the tracker's");
            return Err(SettingError::new("model", expected, format!("one of a body with {known}")));
        }
        let spreads: Vec<f64> = graph.segments.iter().map(|s| s.gpdm.latent_spread()).collect();
        let footing = match settings.root_motion {
            RootMotion::Model => None,
            RootMotion::Planted => Footing::learn(&body, &graph),
        };
        let unseen = Unseen::measure(&body, &graph, footing.as_ref());
        let residual = |covariance: &DMatrix<f64>| {
            PoseResidual::new(covariance, settings.residual_scale, settings.residual_s, graph.frames_per_second)
        };
        let residuals = graph.segments.iter().map(|s| residual(&unseen.covariance_of_segment(s))).collect();
        let roots = RootDynamics::learn(footing, &graph, &unseen, &settings);
        let dimensions = graph.segments.first().map_or(0, |s| s.gpdm.latents().ncols());
        let spread = spreads.iter().sum::<f64>() / spreads.len().max(1) as f64;
        let mut deviations = vec![settings.noise_floor * spread; dimensions];
        deviations.extend(residual(&unseen.covariance_of_pose()).increments());
        deviations.extend(roots.deviations());
        let training_means = training_means(&graph);
        let jumps = Jumps::new(&graph, &training_means);
        Ok(Self {
            body,
            graph,
            settings,
            jumps,
            training_means,
            spreads,
            roots,
            residuals,
            given_roots: None,
            deviations,
            descends: false,
        })
    }

    /// The same, with the true root of every frame given.
    pub fn with_given_roots(mut self, roots: Vec<Isometry3<f64>>) -> Self {
        self.given_roots = Some(Arc::new(roots));
        self
    }

    /// The same, with particles that can descend on an observation: each remembers its prediction.
    pub fn with_descent(self) -> Self {
        Self { descends: true, ..self }
    }

    /// Distance of the start pose from the nearest training pose, rad^2 per anatomical joint.
    pub fn start_distance(&self, start: &Pose) -> f64 {
        let rotations = self.graph.chart.rotations(start);
        self.graph.nearest(&rotations).map_or(f64::INFINITY, |(.., d)| d / rotations.len().max(1) as f64)
    }

    fn training_latent(&self, at: Candidate) -> Vec<f64> {
        self.graph.segments[at.segment].gpdm.latents().row(at.row).iter().copied().collect()
    }

    /// The previous training frame, or the same one if it is the first of its motion.
    fn frame_before(&self, at: Candidate) -> Candidate {
        let first = self.graph.segments[at.segment].sequence_of(at.row).start;
        Candidate { row: at.row.saturating_sub(1).max(first), ..at }
    }

    fn nearest_row(&self, segment: usize, latent: &[f64]) -> usize {
        let z = self.graph.segments[segment].gpdm.latents();
        let squared = |i: usize| latent.iter().enumerate().map(|(c, x)| (z[(i, c)] - x).powi(2)).sum::<f64>();
        (0..z.nrows()).map(|i| (i, squared(i))).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
    }

    /// The inter-transition of `[GPDM graph]`: the particle's starting point, in its own model or in the one it jumps
    /// to. Its pose is kept: the difference between the means of the two models becomes an offset, which then decays.
    fn depart(&self, state: &LatentParticle, seen: Option<&[Vector3<f64>]>, rng: &mut ChaCha8Rng) -> TransitionSource {
        let at = (state.segment, self.nearest_row(state.segment, &state.latent));
        match jump(&self.graph, &self.jumps, &self.settings, at, (&self.compared(state), seen), rng) {
            None => TransitionSource {
                segment: state.segment,
                latent: state.latent.clone(),
                before: state.before.clone(),
                offset: state.offset.clone(),
                rotations: state.moving.rotations.clone(),
            },
            Some(at) => self.depart_from(at, state),
        }
    }

    /// Angular velocities of the joints between the last two estimates, rad/s.
    fn seen_velocities(&self, past: &[Pose]) -> Option<Vec<Vector3<f64>>> {
        let [before, now] = past.last_chunk()?;
        let [before, now] = [before, now].map(|pose| self.graph.chart.rotations(pose));
        Some(PoseRate::between(&before, now, self.graph.frames_per_second).velocities)
    }

    /// Quantities compared by jumps: the particle's own pose, which an offset may have moved far from the map's mean,
    /// and the velocity of that mean. Offsets are drawn in every frame, so their differences are not velocities.
    fn compared(&self, state: &LatentParticle) -> PoseRate {
        let velocities = state.moving.velocities.clone();
        PoseRate { rotations: self.graph.chart.rotations(&state.pose), velocities }
    }

    /// A departure from a training frame in the pose of `state`.
    fn depart_from(&self, at: Candidate, state: &LatentParticle) -> TransitionSource {
        let before = self.frame_before(at);
        let mean: Vec<f64> = self.training_means[at.segment].row(at.row).iter().copied().collect();
        let observation = offset_by(state.mean.clone(), &state.offset);
        TransitionSource {
            segment: at.segment,
            latent: self.training_latent(at),
            before: self.training_latent(before),
            offset: self.offset_to(at.segment, &mean, &observation, &state.pose),
            rotations: self.jumps.frame(at).rotations.clone(),
        }
    }

    /// The offset from a mean to the observation vector of `pose`.
    fn offset_to(&self, segment: usize, mean: &[f64], observation: &[f64], pose: &Pose) -> Vec<f64> {
        let mut offset = self.residuals[segment].between(mean, observation);
        let height = self.roots.height_offset(&self.body, &self.graph.chart, mean, pose);
        if let (Some(last), Some(height)) = (offset.last_mut(), height) {
            *last = height;
        }
        offset
    }

    /// Intra-transition and mapping of `[GPDM graph]` for particles of one model: the next latent points, drawn from
    /// its dynamics, and their poses. Computed in one matrix product, which is many times faster than one by one.
    fn advance(&self, pending: &mut [PendingParticle<'_>]) -> Vec<(usize, LatentParticle)> {
        let Some(segment) = pending.first().map(|first| first.departure.segment) else { return Vec::new() };
        let gpdm = &self.graph.segments[segment].gpdm;
        let (d, lag) = (gpdm.latents().ncols(), gpdm.layout().order.lag());
        // The last row is repeated up to the size of a batch: products of one size have the same bits, whoever shares
        // the batch.
        let last = pending.len() - 1;
        let input = |i: usize, c: usize| {
            let from: &TransitionSource = &pending[i.min(last)].departure;
            if c < d { from.latent[c] } else { from.before[c - d] }
        };
        let moments = gpdm.dynamics_moments(Mat::from_fn(BATCH, d * lag, input).as_ref());
        let means: Vec<(Vec<f64>, f64)> = (0..pending.len())
            .map(|i| {
                let mean = (0..d).map(|c| moments.mean[(i, c)]).collect();
                // near training points a GPDM is too sure of itself, and all particles would go the same way
                (mean, moments.variance[i].sqrt().max(self.settings.noise_floor * self.spreads[segment]))
            })
            .collect();
        let draw = |(source, (mean, deviation)): (&mut PendingParticle<'_>, &(Vec<f64>, f64))| {
            self.draw(segment, mean, *deviation, source.rng)
        };
        let drawn: Vec<(Vec<f64>, bool)> = pending.iter_mut().zip(&means).map(draw).collect();
        let observations = gpdm.map_mean(Mat::from_fn(BATCH, d, |i, c| drawn[i.min(last)].0[c]).as_ref());
        let noise = |rng: &mut ChaCha8Rng| [(); 3].map(|()| normal(rng));
        type Arriving<'a, 'b> = ((&'a mut PendingParticle<'b>, (Vec<f64>, f64)), (Vec<f64>, bool));
        let arrive = |(i, ((source, expected), (latent, recovered))): (usize, Arriving<'_, '_>)| {
            let mean: Vec<f64> = observations.row(i).iter().copied().collect();
            let rotations = self.graph.chart.rotations_of(&mean);
            let moving = PoseRate::between(&source.departure.rotations, rotations, self.graph.frames_per_second);
            let offset = self.residuals[segment].next(&source.departure.offset, source.rng);
            let frame = source.state.frame + 1;
            let LatentParticle { pose, place, .. } = source.state;
            let expected = self.descends.then(|| {
                Arc::new(Expected {
                    latent: expected.0,
                    deviation: expected.1,
                    offset: self.residuals[segment].expected(&source.departure.offset),
                    before: pose.clone(),
                    place: place.clone(),
                })
            });
            // the root is not in latent space: it is integrated from the steps that the mean says, and stood on its
            // feet
            let (place, pose) = self.roots.next(pose, place, &self.stand(&mean, &offset), noise(source.rng));
            let pose = self.with_given_root(pose, frame);
            let before = std::mem::take(&mut source.departure.latent);
            let particle = LatentParticle {
                segment,
                latent,
                before,
                mean,
                offset,
                place,
                frame,
                moving,
                pose,
                recovered,
                expected,
            };
            (source.index, particle)
        };
        pending.iter_mut().zip(means).zip(drawn).enumerate().map(arrive).collect()
    }

    /// A latent point drawn about the dynamics' mean, and whether it had to be brought back to the training latents.
    fn draw(&self, segment: usize, mean: &[f64], deviation: f64, rng: &mut ChaCha8Rng) -> (Vec<f64>, bool) {
        let next: Vec<f64> = mean.iter().map(|m| m + deviation * normal(rng)).collect();
        // Far from all training points the map returns to its mean, a pose that nobody took: such a draw is put back.
        let row = self.nearest_row(segment, &next);
        let nearest = self.training_latent(Candidate { segment, row });
        let squared: f64 = next.iter().zip(&nearest).map(|(a, b)| (a - b) * (a - b)).sum();
        let lengths = squared * self.graph.segments[segment].gpdm.map_kernel().inverse_width;
        if lengths <= GREATEST_LENGTHS * GREATEST_LENGTHS { (next, false) } else { (nearest, true) }
    }

    /// The mean observation vector at a latent point (`[GPDM graph]` Eq. 6).
    pub(super) fn observation(&self, segment: usize, latent: &[f64]) -> Vec<f64> {
        let point = Mat::from_fn(1, latent.len(), |_, c| latent[c]);
        self.graph.segments[segment].gpdm.map_mean(point.as_ref()).row(0).iter().copied().collect()
    }

    pub(super) fn stand<'a>(&'a self, mean: &'a [f64], offset: &'a [f64]) -> Stand<'a> {
        Stand { body: &self.body, chart: &self.graph.chart, mean, offset }
    }

    pub(super) fn with_given_root(&self, mut pose: Pose, frame: usize) -> Pose {
        if let Some(given) = self.given_roots.as_ref().and_then(|roots| roots.get(frame)) {
            pose.world_from_root = *given;
        }
        pose
    }

    fn first_particle(
        &self,
        seeds: &[Seed],
        start: &Pose,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> LatentParticle {
        let at = seed_of(seeds, index, count).map_or(Candidate { segment: 0, row: 0 }, |seed| seed.at);
        let before = self.training_latent(self.frame_before(at));
        let jitter = self.settings.start_jitter * self.spreads[at.segment];
        let latent: Vec<f64> = self.training_latent(at).iter().map(|z| z + jitter * normal(rng)).collect();
        let root = PlanarRoot::from_pose(start);
        let mean = self.observation(at.segment, &latent);
        let rotations = self.graph.chart.rotations_of(&mean);
        let moving = PoseRate { velocities: vec![Default::default(); rotations.len()], rotations };
        let standing = self.graph.chart.observe_pose(start, &PlanarStep { forward: 0.0, left: 0.0, turn: 0.0 });
        let offset = self.offset_to(at.segment, &mean, &standing, start);
        let pose = self.with_given_root(self.roots.stand(&self.stand(&mean, &offset), &root), 0);
        let (segment, place) = (at.segment, self.roots.place(&self.body, root, &pose));
        let (recovered, expected) = (false, None);
        LatentParticle { segment, latent, before, mean, offset, place, frame: 0, moving, pose, recovered, expected }
    }
}

impl MotionModel for LatentModel {
    type State = LatentParticle;

    fn body(&self) -> &Humanoid {
        &self.body
    }

    fn sample_initial(&self, start: &Pose, particle: usize, particles: usize, rng: &mut ChaCha8Rng) -> LatentParticle {
        let seeds = seeds(&self.graph, &self.graph.chart.rotations(start), self.settings.initialisation);
        self.first_particle(&seeds, start, particle, particles, rng)
    }

    fn propagate(&self, state: &LatentParticle, past: &[Pose], rng: &mut ChaCha8Rng) -> LatentParticle {
        let mut moved = self.propagate_all(std::slice::from_ref(state), past, std::slice::from_mut(rng));
        moved.pop().unwrap_or_else(|| state.clone())
    }

    fn propagate_all(&self, states: &[LatentParticle], past: &[Pose], rngs: &mut [ChaCha8Rng]) -> Vec<LatentParticle> {
        let seen = self.seen_velocities(past);
        let mut pending: Vec<PendingParticle<'_>> = states
            .par_iter()
            .zip(rngs.par_iter_mut())
            .enumerate()
            .map(|(index, (state, rng))| {
                let departure = self.depart(state, seen.as_deref(), rng);
                PendingParticle { index, state, departure, rng }
            })
            .collect();
        pending.sort_by_key(|source| source.departure.segment);
        // batches of a fixed size, so that the bits do not depend on the number of threads
        let batches: Vec<&mut [PendingParticle<'_>]> = pending
            .chunk_by_mut(|a, b| a.departure.segment == b.departure.segment)
            .flat_map(|of_one_model| of_one_model.chunks_mut(BATCH))
            .collect();
        let mut moved: Vec<(usize, LatentParticle)> =
            batches.into_par_iter().flat_map_iter(|batch| self.advance(batch)).collect();
        moved.sort_by_key(|(index, _)| *index);
        moved.into_iter().map(|(_, particle)| particle).collect()
    }

    fn pose<'a>(&self, state: &'a LatentParticle) -> &'a Pose {
        &state.pose
    }

    fn deviations(&self) -> &[f64] {
        &self.deviations
    }

    fn step(&self, state: &LatentParticle, step: &[f64]) -> LatentParticle {
        let (latent, rest) = step.split_at(state.latent.len());
        let (offset, root) = rest.split_at(rest.len() - 3);
        let latent: Vec<f64> = state.latent.iter().zip(latent).map(|(z, s)| z + s).collect();
        let offset = offset_by(state.offset.clone(), offset);
        let step = PlanarStep { forward: root[0], left: root[1], turn: root[2] };
        let mean = self.observation(state.segment, &latent);
        let rotations = self.graph.chart.rotations_of(&mean);
        let (root, pose) = self.roots.stepped(&state.pose, &state.place.root, &self.stand(&mean, &offset), &step);
        let pose = self.with_given_root(pose, state.frame);
        let moving = PoseRate { rotations, velocities: state.moving.velocities.clone() };
        let place = RootPlace { root, ..state.place.clone() };
        LatentParticle { latent, mean, offset, place, pose, moving, ..state.clone() }
    }

    fn difference(&self, from: &LatentParticle, to: &LatentParticle, step: &mut [f64]) {
        let (latent, rest) = step.split_at_mut(from.latent.len());
        let (offset, root) = rest.split_at_mut(rest.len() - 3);
        offset.iter_mut().zip(from.offset.iter().zip(&to.offset)).for_each(|(s, (a, b))| *s = b - a);
        // points of two models have no difference
        let same = from.segment == to.segment;
        for (s, (a, b)) in latent.iter_mut().zip(from.latent.iter().zip(&to.latent)) {
            *s = if same { b - a } else { 0.0 };
        }
        let still = PlanarStep { forward: 0.0, left: 0.0, turn: 0.0 };
        let (carried, _) = self.roots.stepped(&from.pose, &from.place.root, &self.stand(&to.mean, &to.offset), &still);
        let apart = carried.step_to(&to.place.root);
        root.copy_from_slice(&[apart.forward, apart.left, apart.turn]);
    }

    fn descends(&self) -> bool {
        self.descends
    }

    fn descend(&self, state: &LatentParticle, _anchor: &Pose, evidence: NormalEquations) -> Option<LatentParticle> {
        self.descended(state, &evidence)
    }

    fn occupancy(&self, states: &[LatentParticle], weights: &[f64]) -> Vec<ModelOccupancy> {
        let mut occupancy = vec![ModelOccupancy::default(); self.graph.segments.len()];
        for (state, weight) in states.iter().zip(weights) {
            let model = &mut occupancy[state.segment];
            model.particles += 1;
            model.weight += weight;
            model.recovered += u32::from(state.recovered);
        }
        occupancy
    }
}

#[cfg(test)]
mod tests;
