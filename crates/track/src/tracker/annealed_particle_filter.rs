//! The annealed particle filter: Algorithm 1 of `[Skinned APF]`.

use rand::RngExt;
use rayon::prelude::*;
use smallvec::SmallVec;

use super::annealing::{Selection, heaviest, select, systematic};
use super::refinement::{FINAL_WIDTH, Refined, lowest};
use super::{
    Estimate, Estimator, FilterSettings, Kernel, LayerRecord, Likelihood, Partition, Refinement, TrackError, Tracker,
};
use crate::motion_model::{MotionModel, SettingError};
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_core::observation::Observation;
use skiagraph_core::rng::{Purpose, normal, stream};

const BATCH: usize = 8;
/// Ratio of energies below which a pose is another one, not the same found again.
const CLEARLY_LESS: f64 = 0.98;

/// Tracks a body by annealing a set of particles on each frame's energy (`[Deutscher 2000]`; `[Skinned APF]`, Algorithm
/// 1).
///
/// | `[Skinned APF]` | here |
/// |---|---|
/// | x_t^i | a particle: a [`MotionModel::State`] |
/// | p(x_t given x_{t-1}) | [`MotionModel::propagate`], its noise P_0 included |
/// | E(y_t, x_t) | [`Likelihood::energies`] |
/// | N, M, alpha_m | [`FilterSettings`]: `particles`, `layers`, `survival_rate` |
/// | lambda_m, w^i | [`select`] |
/// | P_0, P_m = alpha_m P_{m-1} | squares of [`MotionModel::deviations`], times `survival_rate` per layer |
/// | the estimate of section 6.1 | [`Estimator`] over the weights of layer M |
///
/// Choices that the paper leaves open: alpha scales the variance; the estimate is computed before the last resampling;
/// particles are not perturbed after it, because the next frame's propagation does so. With one layer this is the plain
/// particle filter of section 6.1. Particles are processed in parallel; random streams are keyed by (seed, purpose,
/// frame, layer, particle) and sums are sequential, so the results are bit-identical for any number of threads.
#[derive(Debug)]
pub struct AnnealedParticleFilter<M: MotionModel, L: Likelihood> {
    settings: FilterSettings,
    seed: u64,
    model: M,
    likelihood: L,
    start: Option<Pose>,
    particles: Vec<M::State>,
    /// The last two estimates, oldest first.
    past: Vec<Pose>,
    refinement: Option<Refinement>,
    /// Body parts that are searched in sequence; `None` to search all components at once.
    partition: Option<Partition>,
}

impl<M: MotionModel, L: Likelihood> AnnealedParticleFilter<M, L> {
    /// A filter with the given random seed.
    ///
    /// # Errors
    /// [`SettingError`] if a setting is out of its range.
    pub fn new(settings: FilterSettings, model: M, likelihood: L, seed: u64) -> Result<Self, SettingError> {
        settings.validate()?;
        Ok(Self {
            settings,
            seed,
            model,
            likelihood,
            start: None,
            particles: Vec::new(),
            past: Vec::new(),
            refinement: None,
            partition: None,
        })
    }

    /// Searches one body part after another, in consecutive layers. The particles of a new frame start from those of
    /// the previous one, without the model's prediction.
    ///
    /// # Errors
    /// [`SettingError`] if there are fewer layers than parts, or if the kernel cannot perturb parts separately.
    pub fn with_partition(self, partition: Partition) -> Result<Self, SettingError> {
        let parts = partition.count();
        if self.settings.layers < parts {
            return Err(SettingError::new("layers", format!("at least {parts}, one per part"), self.settings.layers));
        }
        if matches!(self.settings.kernel, Kernel::Shrink { .. }) {
            let expected = "`geometric` or `min` with partitioned sampling";
            return Err(SettingError::new("kernel", expected, "shrink"));
        }
        Ok(Self { partition: Some(partition), ..self })
    }

    /// Refines the estimates after the last layer.
    ///
    /// # Errors
    /// [`SettingError`] if the likelihood or the motion model does not support descent.
    pub fn with_refinement(self, refinement: Refinement) -> Result<Self, SettingError> {
        let lacking = match (self.likelihood.descends(), self.model.descends()) {
            (true, true) => return Ok(Self { refinement: Some(refinement), ..self }),
            (false, _) => "likelihood",
            (true, false) => "motion model",
        };
        Err(SettingError::new("refinement", format!("a {lacking} that supports descent"), "one that does not"))
    }

    /// Algorithm 1, step 1: particles for this frame, from the start pose or the previous frame.
    fn initialise(&self, frame: u64) -> Result<Vec<M::State>, TrackError> {
        let start = self.start.as_ref().ok_or(TrackError::NotStarted { frame: frame as usize })?;
        let (expected, found) = (self.model.body().degrees_of_freedom.len(), start.joint_angles.len());
        if expected != found {
            return Err(TrackError::StartMismatch { expected, found });
        }
        if self.particles.is_empty() {
            let draw = |i| {
                self.model.sample_initial(
                    start,
                    i,
                    self.settings.particles,
                    &mut stream(self.seed, Purpose::Initialisation, frame, 0, i as u64),
                )
            };
            return Ok((0..self.settings.particles).into_par_iter().map(draw).collect());
        }
        if let Some(partition) = &self.partition {
            let FilterSettings { layers, survival_rate, .. } = self.settings;
            let deviations = partition.deviations(self.model.deviations(), 0, layers, survival_rate);
            return Ok(self.perturb(&self.particles, &LayerNoise { deviations, shrinkage: None }, frame, 0));
        }
        let count = self.particles.len() as u64;
        let mut rngs: Vec<_> = (0..count).map(|i| stream(self.seed, Purpose::Perturbation, frame, 0, i)).collect();
        Ok(self.model.propagate_all(&self.particles, &self.past, &mut rngs))
    }

    /// Algorithm 1, step 2: the energy of every particle. If all particles are rejected, falls back to unrejected
    /// energies.
    fn energies(&self, particles: &[M::State]) -> Vec<f64> {
        let mut energies = vec![0.0; particles.len()];
        particles.par_chunks(BATCH).zip(energies.par_chunks_mut(BATCH)).for_each_init(
            || self.likelihood.scratch(),
            |scratch, (batch, energies)| {
                let poses: SmallVec<[&Pose; BATCH]> = batch.iter().map(|state| self.model.pose(state)).collect();
                self.likelihood.energies(&poses, energies, scratch);
            },
        );
        if energies.iter().any(|energy| energy.is_finite()) {
            return energies;
        }
        let energy =
            |scratch: &mut L::Scratch, state| self.likelihood.energy_unrejected(self.model.pose(state), scratch);
        particles.par_iter().map_init(|| self.likelihood.scratch(), energy).collect()
    }

    /// Algorithm 1, step 5: resamples the particles; their number stays the same.
    fn resample(&self, particles: &[M::State], weights: &[f64], frame: u64, layer: u64) -> Vec<M::State> {
        let offset = stream(self.seed, Purpose::Resampling, frame, layer, 0).random();
        systematic(weights, offset).into_iter().map(|ancestor| particles[ancestor].clone()).collect()
    }

    /// Algorithm 1, step 6: adds noise to the survivors.
    fn perturb(&self, survivors: &[M::State], spread: &LayerNoise<M::State>, frame: u64, layer: u64) -> Vec<M::State> {
        let nudge = |(i, state): (usize, &M::State)| {
            let mut rng = stream(self.seed, Purpose::Perturbation, frame, layer, i as u64);
            let noise = spread.deviations.iter().map(|d| d * normal(&mut rng));
            match &spread.shrinkage {
                None => self.model.step(state, &noise.collect::<Vec<f64>>()),
                Some(Shrinkage { about, mean, keep }) => {
                    let mut step = vec![0.0; mean.len()];
                    self.model.difference(about, state, &mut step);
                    for ((s, m), n) in step.iter_mut().zip(mean).zip(noise) {
                        *s = keep * *s + (1.0 - keep) * m + n;
                    }
                    self.model.step(about, &step)
                }
            }
        };
        survivors.par_iter().enumerate().map(nudge).collect()
    }

    /// The layer's noise by the kernel, from `[Skinned APF]`'s `P_m` (`geometric` holds its square roots) and the
    /// weighted particles.
    fn spread(&self, particles: &[M::State], weights: &[f64], geometric: &[f64]) -> LayerNoise<M::State> {
        match self.settings.kernel {
            Kernel::Geometric => LayerNoise { deviations: geometric.to_vec(), shrinkage: None },
            Kernel::Min { factor } => {
                let own = self.moments(particles, weights).deviations;
                let deviations = geometric.iter().zip(&own).map(|(g, o)| g.min(factor * o)).collect();
                LayerNoise { deviations, shrinkage: None }
            }
            Kernel::Shrink { h } => {
                let ParticleMoments { about, mean, deviations } = self.moments(particles, weights);
                let deviations = deviations.iter().map(|o| h * o).collect();
                LayerNoise { deviations, shrinkage: Some(Shrinkage { about, mean, keep: (1.0 - h * h).sqrt() }) }
            }
        }
    }

    /// Weighted mean and deviations of the particles, as steps from the heaviest one.
    fn moments(&self, particles: &[M::State], weights: &[f64]) -> ParticleMoments<M::State> {
        let about = particles[heaviest(weights)].clone();
        let dimensions = self.model.deviations().len();
        let (mut step, mut mean, mut square) = (vec![0.0; dimensions], vec![0.0; dimensions], vec![0.0; dimensions]);
        for (state, weight) in particles.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
            self.model.difference(&about, state, &mut step);
            for ((m, q), s) in mean.iter_mut().zip(&mut square).zip(&step) {
                *m += weight * s;
                *q += weight * s * s;
            }
        }
        let deviations = square.iter().zip(&mean).map(|(q, m)| (q - m * m).max(0.0).sqrt()).collect();
        ParticleMoments { about, mean, deviations }
    }

    fn estimate(&self, particles: &[M::State], weights: &[f64], best: &M::State) -> Option<Pose> {
        match self.settings.estimator {
            Estimator::Best => Some(self.model.pose(best).clone()),
            Estimator::WeightedMean => {
                self.model.body().mean_pose(particles.iter().map(|state| self.model.pose(state)), weights)
            }
        }
    }

    /// Descends from the last estimate and from the pose that continues the motion, if refinement is enabled and the
    /// model's states can represent these poses. Needs no particles of this frame.
    fn descend_first(&self) -> Option<Refined<M::State>> {
        let (refinement, anchor) = (self.refinement.as_ref()?, self.past.last().or(self.start.as_ref())?);
        let any = self.particles.first()?;
        let continued = self.continued();
        let given = [Some(anchor), continued.as_ref()].into_iter().flatten();
        let starts: Vec<M::State> = given.filter_map(|pose| self.model.with_pose(any, pose)).collect();
        Some(refinement.descend(&self.model, &self.likelihood, anchor, &starts))
    }

    /// The estimate of a frame that needs no particles, because the outline of what was found first agrees.
    fn without_search(&mut self, frame: usize, first: &Refined<M::State>) -> Option<Estimate> {
        let (refinement, (state, energy)) = (self.refinement.as_mut()?, first.found.as_ref()?);
        let pose = self.model.pose(state).clone();
        let agreement = self.likelihood.agreement(&pose, FINAL_WIDTH, &mut self.likelihood.scratch())?;
        let step_m = self.past.last().map_or(f64::INFINITY, |last| step_m(self.model.body(), last, &pose));
        if self.past.len() < 2 || !refinement.is_sure(frame, agreement, *energy, self.likelihood.views(), step_m) {
            return None;
        }
        refinement.weigh(agreement);
        self.particles.fill(state.clone());
        let (energy, evaluations) = (Some(*energy), first.evaluations);
        Some(Estimate { energy, evaluations, ..Estimate::without_search(frame, pose) })
    }

    /// Refines the estimate, if enabled, and lets a share of the particles continue from it. The descents start from
    /// this frame's estimate and from the particle of lowest energy, after those of [`Self::descend_first`].
    fn refine(&mut self, estimate: &mut Estimate, best: &M::State, first: Option<Refined<M::State>>) {
        let (Some(refinement), Some(energy)) = (&self.refinement, estimate.energy) else { return };
        let Some(anchor) = self.past.last().or(self.start.as_ref()) else { return };
        // without particles of an earlier frame, nothing was descended yet
        let given = [Some(anchor).filter(|_| first.is_none()), Some(&estimate.pose)].into_iter().flatten();
        let given = given.filter_map(|pose| self.model.with_pose(best, pose));
        let starts: Vec<M::State> = given.chain([best.clone()]).collect();
        let (found, before) = first.map_or((None, 0), |first| (first.found, first.evaluations));
        let least_before = found.as_ref().map(|(_, energy)| *energy);
        let frame = estimate.frame;
        let refined = refinement.refine(&self.model, &self.likelihood, frame, anchor, found, &starts, energy);
        estimate.evaluations += before + refined.evaluations;
        if let Some((state, energy)) = refined.found {
            for particle in refinement.moved(self.particles.len()) {
                self.particles[particle] = state.clone();
            }
            estimate.pose = self.model.pose(&state).clone();
            estimate.energy = Some(energy);
        }
        // several descents into one minimum end a few pixels apart
        let clearly_less = |before: f64| estimate.energy.is_some_and(|energy| energy < CLEARLY_LESS * before);
        estimate.by_search = least_before.is_some_and(clearly_less);
        if self.model.with_pose(best, &estimate.pose).is_none() {
            return;
        }
        // with a narrow weight: what a wide one counts as support may belong to another limb
        let agreement = self.likelihood.agreement(&estimate.pose, FINAL_WIDTH, &mut self.likelihood.scratch());
        if let (Some(refinement), Some(agreement)) = (&mut self.refinement, agreement) {
            refinement.weigh(agreement);
        }
    }

    /// The pose that continues the motion of the last two estimates; `None` before there are two.
    fn continued(&self) -> Option<Pose> {
        let [before, last] = self.past.as_slice() else { return None };
        let body = self.model.body();
        let mut step = vec![0.0; body.step_len()];
        body.difference(before, last, &mut step);
        let mut pose = body.step(last, &step);
        body.clamp_to_limits(&mut pose);
        Some(pose)
    }

    /// The estimate with the energy of whole masks, remembered for later frames.
    fn finished(&mut self, mut estimate: Estimate) -> Estimate {
        if self.likelihood.believe() {
            let energy = self.likelihood.energy_unrejected(&estimate.pose, &mut self.likelihood.scratch());
            estimate.energy = Some(energy);
            estimate.evaluations += 1;
        }
        self.likelihood.learn(&estimate.pose);
        self.remember(&estimate.pose, estimate.energy);
        estimate
    }

    fn remember(&mut self, estimate: &Pose, energy: Option<f64>) {
        if self.past.len() == 2 {
            self.past.remove(0);
        }
        self.past.push(estimate.clone());
        if let Some(refinement) = &mut self.refinement {
            refinement.remember(estimate, energy);
        }
    }
}

impl<M: MotionModel, L: Likelihood> Tracker for AnnealedParticleFilter<M, L> {
    fn name(&self) -> &str {
        if self.settings.layers == 1 { "particle_filter" } else { "annealed_particle_filter" }
    }

    fn start(&mut self, start: &Pose) {
        self.start = Some(start.clone());
        self.particles.clear();
        self.past.clear();
        if let Some(refinement) = &mut self.refinement {
            refinement.start(start);
        }
    }

    fn track(&mut self, observation: &Observation) -> Result<Estimate, TrackError> {
        let FilterSettings { particles: count, layers, survival_rate, .. } = self.settings;
        let frame = observation.frame;
        self.likelihood.prepare(observation)?;
        let first = self.descend_first();
        if let Some(estimate) = first.as_ref().and_then(|first| self.without_search(frame, first)) {
            return Ok(self.finished(estimate));
        }
        let mut particles = self.initialise(frame as u64)?;
        if let Some(start) = self.start.as_ref().filter(|_| self.particles.is_empty()) {
            self.likelihood.start(start);
        }
        // deviations of the noise if nothing is known of the particles: they shrink by the same factor in every layer
        let mut geometric = self.model.deviations().to_vec();
        let mut records = Vec::with_capacity(layers);
        for layer in 1..layers as u64 {
            let energies = self.energies(&particles);
            let selection = select(&energies, survival_rate).ok_or(TrackError::NoValidParticle { frame })?;
            records.push(record(&energies, &selection));
            match &self.partition {
                // the variance of the noise shrinks as that of the particles: by the share that survives
                None => geometric.iter_mut().for_each(|deviation| *deviation *= survival_rate.sqrt()),
                Some(partition) => {
                    geometric = partition.deviations(self.model.deviations(), layer as usize, layers, survival_rate);
                }
            }
            let spread = self.spread(&particles, &selection.weights, &geometric);
            let survivors = self.resample(&particles, &selection.weights, frame as u64, layer);
            particles = self.perturb(&survivors, &spread, frame as u64, layer);
        }
        let energies = self.energies(&particles);
        let selection = select(&energies, survival_rate).ok_or(TrackError::NoValidParticle { frame })?;
        records.push(record(&energies, &selection));
        // the last layer is weighted, but not perturbed: the estimate is of particles that were compared with the
        // images
        let best = lowest(particles.iter().zip(energies.iter().copied()).collect());
        let best = best.map(|(state, _)| state.clone()).ok_or(TrackError::NoValidParticle { frame })?;
        let pose = self.estimate(&particles, &selection.weights, &best).ok_or(TrackError::NoValidParticle { frame })?;
        let occupancy = self.model.occupancy(&particles, &selection.weights);
        // a mean of poses may lie outside the limits that reject particles, and still needs an energy
        let energy = self.likelihood.energy_unrejected(&pose, &mut self.likelihood.scratch());
        self.particles = self.resample(&particles, &selection.weights, frame as u64, layers as u64);
        let mut estimate = Estimate {
            frame,
            pose,
            energy: Some(energy),
            layers: records,
            by_search: false,
            evaluations: (count * layers + 1) as u64,
            occupancy,
        };
        self.refine(&mut estimate, &best, first);
        Ok(self.finished(estimate))
    }
}

/// The longest way of a joint from one pose to another, metres.
fn step_m(body: &Humanoid, from: &Pose, to: &Pose) -> f64 {
    let (from, to) = (body.link_frames(from), body.link_frames(to));
    let steps = from.0.iter().zip(&to.0).map(|(a, b)| (b.translation.vector - a.translation.vector).norm());
    steps.fold(0.0, f64::max)
}

struct LayerNoise<S> {
    deviations: Vec<f64>,
    shrinkage: Option<Shrinkage<S>>,
}

/// Moves particles towards their mean before noise is added.
struct Shrinkage<S> {
    about: S,
    mean: Vec<f64>,
    keep: f64,
}

/// First two moments of weighted particles, as steps from `about`.
struct ParticleMoments<S> {
    about: S,
    mean: Vec<f64>,
    deviations: Vec<f64>,
}

fn record(energies: &[f64], selection: &Selection) -> LayerRecord {
    let valid = || energies.iter().copied().filter(|e| e.is_finite());
    let count = valid().count() as f64;
    let mean = valid().sum::<f64>() / count;
    let variance = valid().map(|e| (e - mean) * (e - mean)).sum::<f64>() / count;
    LayerRecord {
        lambda: selection.lambda,
        effective_sample_size: selection.effective_sample_size,
        energy_min: valid().fold(f64::INFINITY, f64::min),
        energy_mean: mean,
        energy_std: variance.sqrt(),
        degenerate: selection.degenerate,
    }
}

#[cfg(test)]
mod tests;
