//! The latent motion model and its particles.

use std::sync::Arc;

use faer::Mat;
use nalgebra::Isometry3;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::super::gpdm_graph::{Candidate, GpdmGraph};
use super::super::pose_chart::{PlanarRoot, PlanarStep};
use super::super::{MotionModel, MotionModelError};
use super::initialisation::{Seed, seed_of, seeds};
use super::settings::LatentSettings;
use super::transition::{Destination, Moving, destinations, jump};
use crate::body::{Humanoid, Pose};

/// Latents farther out than this many training radii are brought back: far from all training the radial kernel is zero
/// and the linear part of the dynamics may explode.
const GREATEST_RADII: f64 = 3.0;

/// Most particles that are moved in one product of matrices.
const BATCH: usize = 128;

/// Root noise never falls below these: metres and radians a frame at 60 Hz.
const ROOT_NOISE_FLOOR: PlanarStep =
    PlanarStep { forward: 0.002, left: 0.002, turn: 0.3 * std::f64::consts::PI / 180.0 };

/// A GPDM graph that moves particles: S1's latent particles.
#[derive(Clone, Debug)]
pub struct LatentModel {
    body: Humanoid,
    graph: Arc<GpdmGraph>,
    settings: LatentSettings,
    destinations: Vec<Destination>,
    /// Per segment: greatest norm of a training latent, and spread per coordinate.
    extents: Vec<(f64, f64)>,
    root_noise: PlanarStep,
    /// The true root of every frame, where it is given away on purpose (to tell articulated from global error).
    given_roots: Option<Arc<Vec<Isometry3<f64>>>>,
    deviations: Vec<f64>,
}

/// One particle: a point in one model's latent space, and where the body stands.
#[derive(Clone, Debug)]
pub struct LatentParticle {
    /// Index of the model, S1's `k`.
    pub segment: usize,
    /// `z_t`, d values.
    pub latent: Vec<f64>,
    /// `z_{t-1}`.
    before: Vec<f64>,
    root: PlanarRoot,
    frame: usize,
    moving: Moving,
    pose: Pose,
    /// Whether the particle had left the training region in this frame and was brought back.
    pub recovered: bool,
}

/// Where a particle starts from in a frame, after its inter-transition.
struct Departure {
    segment: usize,
    latent: Vec<f64>,
    before: Vec<f64>,
}

/// A particle on its way through a frame.
struct Journey<'a> {
    index: usize,
    state: &'a LatentParticle,
    departure: Departure,
    rng: &'a mut ChaCha8Rng,
}

impl LatentModel {
    /// Particles of `graph` that move `body`, the body whose motions the graph was learned from.
    ///
    /// # Errors
    /// [`MotionModelError::Setting`] where a setting is out of its range or the body is another.
    pub fn new(body: Humanoid, graph: Arc<GpdmGraph>, settings: LatentSettings) -> Result<Self, MotionModelError> {
        settings.validate()?;
        let (known, found) = (graph.chart.angles(), body.degrees_of_freedom.len());
        if known != found {
            return Err(MotionModelError::Setting {
                key: "model",
                expected: format!("a model of a body with {found} degrees of freedom, as the tracker's"),
                found: format!("one of a body with {known}"),
            });
        }
        let extents: Vec<(f64, f64)> = graph
            .segments
            .iter()
            .map(|s| {
                let z = s.gpdm.latents();
                let norm = |i: usize| (0..z.ncols()).map(|c| z[(i, c)] * z[(i, c)]).sum::<f64>().sqrt();
                ((0..z.nrows()).map(norm).fold(0.0, f64::max), s.gpdm.latent_spread())
            })
            .collect();
        let root_noise = root_noise(&graph);
        let dimensions = graph.segments.first().map_or(0, |s| s.gpdm.latents().ncols());
        let spread = extents.iter().map(|e| e.1).sum::<f64>() / extents.len().max(1) as f64;
        let mut deviations = vec![settings.noise_floor * spread; dimensions];
        deviations.extend([root_noise.forward, root_noise.left, root_noise.turn]);
        let destinations = destinations(&graph);
        Ok(Self { body, graph, settings, destinations, extents, root_noise, given_roots: None, deviations })
    }

    /// The same, with the true root of every frame given away.
    pub fn with_given_roots(mut self, roots: Vec<Isometry3<f64>>) -> Self {
        self.given_roots = Some(Arc::new(roots));
        self
    }

    /// How far the start pose is from the nearest training pose, rad^2 per anatomical joint.
    pub fn start_distance(&self, start: &Pose) -> f64 {
        let rotations = self.graph.chart.rotations(start);
        self.graph.nearest(&rotations).map_or(f64::INFINITY, |(.., d)| d / rotations.len().max(1) as f64)
    }

    fn training_latent(&self, at: Candidate) -> Vec<f64> {
        self.graph.segments[at.segment].gpdm.latents().row(at.row).iter().copied().collect()
    }

    fn nearest_row(&self, segment: usize, latent: &[f64]) -> usize {
        let z = self.graph.segments[segment].gpdm.latents();
        let squared = |i: usize| latent.iter().enumerate().map(|(c, x)| (z[(i, c)] - x).powi(2)).sum::<f64>();
        (0..z.nrows()).map(|i| (i, squared(i))).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
    }

    /// S1's inter-transition: where the particle leaves from, in its own model or in the one it jumps to.
    fn depart(&self, state: &LatentParticle, rng: &mut ChaCha8Rng) -> Departure {
        let at = (state.segment, self.nearest_row(state.segment, &state.latent));
        match jump(&self.graph, &self.destinations, &self.settings.transition, at, &state.moving, rng) {
            None => Departure { segment: state.segment, latent: state.latent.clone(), before: state.before.clone() },
            Some(at) => {
                let before = Candidate { row: at.row.saturating_sub(1), ..at };
                Departure {
                    segment: at.segment,
                    latent: self.training_latent(at),
                    before: self.training_latent(before),
                }
            }
        }
    }

    /// S1's intra-transition and mapping for particles of one model: the next latent points, drawn from its dynamics, and the
    /// poses there. All in one product of matrices, which is many times faster than one by one.
    fn advance(&self, journeys: &mut [Journey<'_>]) -> Vec<(usize, LatentParticle)> {
        let Some(segment) = journeys.first().map(|j| j.departure.segment) else { return Vec::new() };
        let gpdm = &self.graph.segments[segment].gpdm;
        let (d, lag) = (gpdm.latents().ncols(), gpdm.layout().order.lag());
        let input = |i: usize, c: usize| {
            let from: &Departure = &journeys[i].departure;
            if c < d { from.latent[c] } else { from.before[c - d] }
        };
        let moments = gpdm.dynamics_moments(Mat::from_fn(journeys.len(), d * lag, input).as_ref());
        let drawn: Vec<(Vec<f64>, bool)> = journeys
            .iter_mut()
            .enumerate()
            .map(|(i, journey)| {
                let mean = (0..d).map(|c| moments.mean[(i, c)]);
                self.draw(segment, mean, moments.variance[i].sqrt(), journey.rng)
            })
            .collect();
        let observations = gpdm.map_mean(Mat::from_fn(drawn.len(), d, |i, c| drawn[i].0[c]).as_ref());
        let arrive = |(i, (journey, (latent, recovered))): (usize, (&mut Journey<'_>, (Vec<f64>, bool)))| {
            let observation: Vec<f64> = observations.row(i).iter().copied().collect();
            let root = self.root_after(&journey.state.root, &self.graph.chart.planar_step(&observation), journey.rng);
            let frame = journey.state.frame + 1;
            let pose = self.pose_at(&observation, &root, frame);
            let rotations = self.graph.chart.rotations(&pose);
            let moving = Moving::between(&journey.state.moving.rotations, rotations, self.graph.frames_per_second);
            let before = std::mem::take(&mut journey.departure.latent);
            (journey.index, LatentParticle { segment, latent, before, root, frame, moving, pose, recovered })
        };
        journeys.iter_mut().zip(drawn).enumerate().map(arrive).collect()
    }

    /// A latent point about the dynamics' mean, and whether it had to be brought back to the training latents.
    fn draw(
        &self,
        segment: usize,
        mean: impl Iterator<Item = f64>,
        deviation: f64,
        rng: &mut ChaCha8Rng,
    ) -> (Vec<f64>, bool) {
        let (radius, spread) = self.extents[segment];
        let deviation = deviation.max(self.settings.noise_floor * spread);
        let next: Vec<f64> = mean.map(|m| m + deviation * normal(rng)).collect();
        let norm = next.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm <= GREATEST_RADII * radius {
            return (next, false);
        }
        let row = self.nearest_row(segment, &next);
        (self.training_latent(Candidate { segment, row }), true)
    }

    /// The mean observation vector at a latent point (S1 Eq. 6).
    fn observation(&self, segment: usize, latent: &[f64]) -> Vec<f64> {
        let point = Mat::from_fn(1, latent.len(), |_, c| latent[c]);
        self.graph.segments[segment].gpdm.map_mean(point.as_ref()).row(0).iter().copied().collect()
    }

    fn pose_at(&self, observation: &[f64], root: &PlanarRoot, frame: usize) -> Pose {
        let mut pose = self.graph.chart.place(observation, root);
        if let Some(given) = self.given_roots.as_ref().and_then(|roots| roots.get(frame)) {
            pose.world_from_root = *given;
        }
        self.body.clamp_to_limits(&mut pose);
        pose
    }

    fn root_after(&self, root: &PlanarRoot, step: &PlanarStep, rng: &mut ChaCha8Rng) -> PlanarRoot {
        let noise = &self.root_noise;
        root.after(&PlanarStep {
            forward: step.forward + noise.forward * normal(rng),
            left: step.left + noise.left * normal(rng),
            turn: step.turn + noise.turn * normal(rng),
        })
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
        let before = self.training_latent(Candidate { row: at.row.saturating_sub(1), ..at });
        let jitter = self.settings.start_jitter * self.extents[at.segment].1;
        let latent: Vec<f64> = self.training_latent(at).iter().map(|z| z + jitter * normal(rng)).collect();
        let root = PlanarRoot::of(start);
        let pose = self.pose_at(&self.observation(at.segment, &latent), &root, 0);
        let rotations = self.graph.chart.rotations(&pose);
        let moving = Moving { velocities: vec![Default::default(); rotations.len()], rotations };
        LatentParticle { segment: at.segment, latent, before, root, frame: 0, moving, pose, recovered: false }
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

    fn propagate_all(&self, states: &[LatentParticle], _past: &[Pose], rngs: &mut [ChaCha8Rng]) -> Vec<LatentParticle> {
        let mut journeys: Vec<Journey<'_>> = states
            .par_iter()
            .zip(rngs.par_iter_mut())
            .enumerate()
            .map(|(index, (state, rng))| Journey { index, state, departure: self.depart(state, rng), rng })
            .collect();
        journeys.sort_by_key(|journey| journey.departure.segment);
        // batches of a fixed size, so that the bits do not depend on the number of threads
        let batches: Vec<&mut [Journey<'_>]> = journeys
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
        let (latent, root) = step.split_at(state.latent.len());
        let latent: Vec<f64> = state.latent.iter().zip(latent).map(|(z, s)| z + s).collect();
        let root = state.root.after(&PlanarStep { forward: root[0], left: root[1], turn: root[2] });
        let pose = self.pose_at(&self.observation(state.segment, &latent), &root, state.frame);
        let rotations = self.graph.chart.rotations(&pose);
        let moving = Moving { rotations, velocities: state.moving.velocities.clone() };
        LatentParticle { latent, root, pose, moving, ..state.clone() }
    }

    fn difference(&self, from: &LatentParticle, to: &LatentParticle, step: &mut [f64]) {
        let (latent, root) = step.split_at_mut(from.latent.len());
        // points of two models have no difference
        let same = from.segment == to.segment;
        for (s, (a, b)) in latent.iter_mut().zip(from.latent.iter().zip(&to.latent)) {
            *s = if same { b - a } else { 0.0 };
        }
        let apart = from.root.step_to(&to.root);
        root.copy_from_slice(&[apart.forward, apart.left, apart.turn]);
    }

    fn occupied(&self, state: &LatentParticle) -> usize {
        state.segment
    }

    fn models(&self) -> usize {
        self.graph.segments.len()
    }

    fn was_recovered(&self, state: &LatentParticle) -> bool {
        state.recovered
    }
}

/// Standard deviation of what the models do not explain of the root's steps in training, with floors.
fn root_noise(graph: &GpdmGraph) -> PlanarStep {
    let (mut squares, mut count) = ([0.0; 3], 0.0);
    for segment in &graph.segments {
        let mapped = segment.gpdm.map_mean(segment.gpdm.latents());
        for t in 0..mapped.nrows() {
            let model = graph.chart.planar_step(&mapped.row(t).iter().copied().collect::<Vec<_>>());
            let truth = graph.chart.planar_step(&segment.gpdm.observation(t));
            let residuals = [model.forward - truth.forward, model.left - truth.left, model.turn - truth.turn];
            squares.iter_mut().zip(residuals).for_each(|(s, r)| *s += r * r);
            count += 1.0;
        }
    }
    let [forward, left, turn] = squares.map(|s| (s / f64::max(count, 1.0)).sqrt());
    PlanarStep {
        forward: forward.max(ROOT_NOISE_FLOOR.forward),
        left: left.max(ROOT_NOISE_FLOOR.left),
        turn: turn.max(ROOT_NOISE_FLOOR.turn),
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::super::gpdm_graph::GraphSettings;
    use super::super::super::pose_chart::distance;
    use super::super::settings::InterTransition;
    use super::*;
    use crate::body::{Motion, rotation_about};
    use crate::rng::{Purpose, stream};

    /// A gait of 40 frames a cycle whose stride grows from cycle to cycle.
    fn gait(body: &Humanoid, frames: usize) -> Motion {
        let poses = (0..frames)
            .map(|t| {
                let (phase, growth) = (t as f64 * std::f64::consts::TAU / 40.0, 1.0 + t as f64 * 0.01);
                let mut pose = body.zero_pose();
                for (i, angle) in pose.joint_angles.iter_mut().enumerate() {
                    let dof = &body.degrees_of_freedom[i];
                    let middle = 0.5 * (dof.lower + dof.upper);
                    *angle = middle + 0.15 * growth * (phase + 0.8 * i as f64).sin();
                }
                let heading = rotation_about(&Vector3::z_axis(), 0.3);
                pose.world_from_root = Isometry3::from_parts(
                    Vector3::new(0.02 * t as f64, 0.006 * t as f64, 0.95 + 0.02 * (2.0 * phase).cos()).into(),
                    heading,
                );
                pose
            })
            .collect();
        Motion { frames_per_second: 60.0, poses }
    }

    fn learned() -> (Humanoid, Motion, Arc<GpdmGraph>) {
        let body = Humanoid::tracker25().unwrap();
        let motion = gait(&body, 90);
        let settings = GraphSettings { threshold_per_joint: 1e-4, ..GraphSettings::default() };
        let graph = GpdmGraph::learn(&body, std::slice::from_ref(&motion), &settings, |_, _| {}).unwrap();
        (body, motion, Arc::new(graph))
    }

    fn follow(model: &LatentModel, motion: &Motion, seed: u64) -> Vec<LatentParticle> {
        let mut rng = stream(seed, Purpose::MotionModel, 0, 0, 0);
        let mut particles = vec![model.sample_initial(&motion.poses[0], 0, 1, &mut rng)];
        for _ in 1..motion.poses.len() {
            let next = model.propagate(&particles[particles.len() - 1], &[], &mut rng);
            particles.push(next);
        }
        particles
    }

    #[test]
    fn a_particle_follows_the_recording_through_all_models_by_natural_edges() {
        let (body, motion, graph) = learned();
        assert!(graph.segments.len() >= 2, "one model would show nothing");
        let settings = LatentSettings { noise_floor: 0.0, start_jitter: 0.0, ..LatentSettings::default() };
        let model = LatentModel::new(body, graph.clone(), settings).unwrap();
        let particles = follow(&model, &motion, 1);
        let visited: std::collections::BTreeSet<usize> = particles.iter().map(|p| p.segment).collect();
        assert_eq!(visited.len(), graph.segments.len(), "visited {visited:?}");
        let poses = particles.iter().map(|p| graph.chart.rotations(&p.pose));
        let apart = poses.zip(&motion.poses).map(|(r, pose)| distance(&r, &graph.chart.rotations(pose)));
        let mean = apart.sum::<f64>() / motion.poses.len() as f64;
        assert!(mean < 0.3, "mean distance {mean} rad^2 over nine joints");
    }

    #[test]
    fn the_root_walks_as_in_training_from_wherever_it_starts() {
        let (body, motion, graph) = learned();
        let settings = LatentSettings { noise_floor: 0.0, start_jitter: 0.0, ..LatentSettings::default() };
        let model = LatentModel::new(body, graph, settings).unwrap();
        let mut elsewhere = motion.clone();
        let shift = Isometry3::new(Vector3::new(3.0, -2.0, 0.0), Vector3::z() * 1.2);
        elsewhere.poses.iter_mut().for_each(|pose| pose.world_from_root = shift * pose.world_from_root);
        let particles = follow(&model, &elsewhere, 2);
        let (last, truth) = (&particles[60].pose.world_from_root, &elsewhere.poses[60].world_from_root);
        let error = (last.translation.vector - truth.translation.vector).norm();
        assert!(error < 0.15, "{error} m after a walk of 1.25 m");
    }

    #[test]
    fn a_switching_model_leaves_at_its_constant_rate() {
        let (body, motion, graph) = learned();
        let transition = InterTransition::Switching { probability: 0.2 };
        let settings = LatentSettings { transition, ..LatentSettings::default() };
        let model = LatentModel::new(body, graph, settings).unwrap();
        let (mut left, mut total) = (0, 0);
        for seed in 0..20 {
            for pair in follow(&model, &motion, seed).windows(2) {
                left += u32::from(pair[0].segment != pair[1].segment);
                total += 1;
            }
        }
        let rate = f64::from(left) / f64::from(total);
        assert!((rate - 0.2).abs() < 4.0 * (0.2_f64 * 0.8 / f64::from(total)).sqrt(), "{rate} over {total} frames");
    }

    #[test]
    fn difference_is_the_inverse_of_step() {
        let (body, motion, graph) = learned();
        let model = LatentModel::new(body, graph, LatentSettings::default()).unwrap();
        let particle = model.sample_initial(&motion.poses[5], 0, 1, &mut stream(3, Purpose::MotionModel, 0, 0, 0));
        let step: Vec<f64> = (0..model.deviations().len()).map(|i| 0.01 * (i as f64 - 2.0)).collect();
        let mut found = vec![0.0; step.len()];
        model.difference(&particle, &model.step(&particle, &step), &mut found);
        assert!(step.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }

    #[test]
    fn a_model_of_another_body_is_refused() {
        let (_, _, graph) = learned();
        let error = LatentModel::new(Humanoid::actor().unwrap(), graph, LatentSettings::default()).unwrap_err();
        assert!(error.to_string().contains("degrees of freedom"), "{error}");
    }
}
