//! The annealed particle filter: S2's Algorithm 1.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::annealing::{Selection, select};
use super::resampling::systematic;
use super::{
    Estimate, Estimator, FilterSettings, Kernel, LayerRecord, Likelihood, ModelOccupancy, SettingError, TrackError,
    Tracker,
};
use crate::body::Pose;
use crate::motion_model::MotionModel;
use crate::observation::Observation;
use crate::rng::{Purpose, stream};

/// Follows a body by annealing a cloud of particles on each frame's energy (Deutscher et al. 2000; S2, Algorithm 1).
///
/// | S2 | here |
/// |---|---|
/// | x_t^i | a particle: a [`MotionModel::State`] |
/// | p(x_t given x_{t-1}) | [`MotionModel::propagate`], its noise P_0 included |
/// | E(y_t, x_t) | [`Likelihood::energy`] |
/// | N, M, alpha_m | [`FilterSettings`]: `particles`, `layers`, `survival_rate` |
/// | lambda_m, w^i | [`select`] |
/// | P_0, P_m = alpha_m P_{m-1} | squares of [`MotionModel::deviations`], times `survival_rate` per layer |
/// | the estimate of section 6.1 | [`Estimator`] over the weights of layer M |
///
/// Where the paper is silent: alpha acts on the variance; the estimate is made before the last resampling; after that
/// resampling particles are not perturbed, since the next frame's propagation does it. With one layer this is the plain
/// particle filter of section 6.1. Particles are worked on in parallel; random streams are keyed by (seed, purpose,
/// frame, layer, particle) and sums run in order, so the bits do not depend on the number of threads.
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
}

impl<M: MotionModel, L: Likelihood> AnnealedParticleFilter<M, L> {
    /// A filter of the given random seed.
    ///
    /// # Errors
    /// [`SettingError`] where a setting is out of its range.
    pub fn new(settings: FilterSettings, model: M, likelihood: L, seed: u64) -> Result<Self, SettingError> {
        settings.validate()?;
        Ok(Self { settings, seed, model, likelihood, start: None, particles: Vec::new(), past: Vec::new() })
    }

    /// Step 1: particles for this frame, from the start pose or the frame before.
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
        let count = self.particles.len() as u64;
        let mut rngs: Vec<_> = (0..count).map(|i| stream(self.seed, Purpose::Perturbation, frame, 0, i)).collect();
        Ok(self.model.propagate_all(&self.particles, &self.past, &mut rngs))
    }

    /// Step 2: the energy of every particle.
    fn energies(&self, particles: &[M::State]) -> Vec<f64> {
        let energy = |scratch: &mut L::Scratch, state| self.likelihood.energy(self.model.pose(state), scratch);
        particles.par_iter().map_init(|| self.likelihood.scratch(), energy).collect()
    }

    /// Step 5: survivors, as many as before.
    fn resample(&self, particles: &[M::State], weights: &[f64], frame: u64, layer: u64) -> Vec<M::State> {
        let offset = stream(self.seed, Purpose::Resampling, frame, layer, 0).random();
        systematic(weights, offset).into_iter().map(|ancestor| particles[ancestor].clone()).collect()
    }

    /// Step 6: spreads the survivors.
    fn perturb(&self, survivors: &[M::State], spread: &Spread<M::State>, frame: u64, layer: u64) -> Vec<M::State> {
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

    /// What the kernel makes of S2's `P_m` (`geometric` holds its roots) and of the weighted particles.
    fn spread(&self, particles: &[M::State], weights: &[f64], geometric: &[f64]) -> Spread<M::State> {
        match self.settings.kernel {
            Kernel::Geometric => Spread { deviations: geometric.to_vec(), shrinkage: None },
            Kernel::Min { factor } => {
                let own = self.moments(particles, weights).deviations;
                let deviations = geometric.iter().zip(&own).map(|(g, o)| g.min(factor * o)).collect();
                Spread { deviations, shrinkage: None }
            }
            Kernel::Shrink { h } => {
                let Moments { about, mean, deviations } = self.moments(particles, weights);
                let deviations = deviations.iter().map(|o| h * o).collect();
                Spread { deviations, shrinkage: Some(Shrinkage { about, mean, keep: (1.0 - h * h).sqrt() }) }
            }
        }
    }

    /// Weighted mean and deviations of the particles, as steps from the heaviest.
    fn moments(&self, particles: &[M::State], weights: &[f64]) -> Moments<M::State> {
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
        Moments { about, mean, deviations }
    }

    /// The answer of the last layer's weighted particles.
    fn estimate(&self, particles: &[M::State], weights: &[f64]) -> Option<Pose> {
        let best = || particles.get(heaviest(weights)).map(|state| self.model.pose(state).clone());
        match self.settings.estimator {
            Estimator::Best => best(),
            Estimator::WeightedMean => {
                self.model.body().mean_pose(particles.iter().map(|state| self.model.pose(state)), weights)
            }
        }
    }

    /// How the weighted particles are spread over the motion model's latent spaces; empty where there are none.
    fn occupancy(&self, particles: &[M::State], weights: &[f64]) -> Vec<ModelOccupancy> {
        let models = self.model.models();
        let mut occupancy = vec![ModelOccupancy::default(); models];
        for (state, weight) in particles.iter().zip(weights) {
            if let Some(model) = occupancy.get_mut(self.model.occupied(state)) {
                model.particles += 1;
                model.weight += weight;
                model.recovered += u32::from(self.model.was_recovered(state));
            }
        }
        occupancy
    }

    fn remember(&mut self, estimate: &Pose) {
        if self.past.len() == 2 {
            self.past.remove(0);
        }
        self.past.push(estimate.clone());
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
    }

    fn track(&mut self, observation: &Observation) -> Result<Estimate, TrackError> {
        let FilterSettings { particles: count, layers, survival_rate, .. } = self.settings;
        let frame = observation.frame;
        self.likelihood.prepare(observation)?;
        let mut particles = self.initialise(frame as u64)?;
        let mut geometric = self.model.deviations().to_vec();
        let mut records = Vec::with_capacity(layers);
        for layer in 1..layers as u64 {
            let energies = self.energies(&particles);
            let selection = select(&energies, survival_rate).ok_or(TrackError::NoValidParticle { frame })?;
            records.push(record(&energies, &selection));
            geometric.iter_mut().for_each(|deviation| *deviation *= survival_rate.sqrt());
            let spread = self.spread(&particles, &selection.weights, &geometric);
            let survivors = self.resample(&particles, &selection.weights, frame as u64, layer);
            particles = self.perturb(&survivors, &spread, frame as u64, layer);
        }
        let energies = self.energies(&particles);
        let selection = select(&energies, survival_rate).ok_or(TrackError::NoValidParticle { frame })?;
        records.push(record(&energies, &selection));
        let pose = self.estimate(&particles, &selection.weights).ok_or(TrackError::NoValidParticle { frame })?;
        let occupancy = self.occupancy(&particles, &selection.weights);
        self.particles = self.resample(&particles, &selection.weights, frame as u64, layers as u64);
        self.remember(&pose);
        let energy = Some(self.likelihood.energy(&pose, &mut self.likelihood.scratch()));
        Ok(Estimate { frame, pose, energy, layers: records, evaluations: (count * layers + 1) as u64, occupancy })
    }
}

/// The noise of one layer.
struct Spread<S> {
    deviations: Vec<f64>,
    shrinkage: Option<Shrinkage<S>>,
}

/// Draws particles towards their mean before the noise is added.
struct Shrinkage<S> {
    about: S,
    mean: Vec<f64>,
    keep: f64,
}

/// First two moments of weighted particles, as steps from `about`.
struct Moments<S> {
    about: S,
    mean: Vec<f64>,
    deviations: Vec<f64>,
}

fn heaviest(weights: &[f64]) -> usize {
    weights.iter().enumerate().fold(0, |best, (i, w)| if *w > weights[best] { i } else { best })
}

fn normal(rng: &mut rand_chacha::ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
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
mod tests {
    use nalgebra::DVector;

    use super::*;
    use crate::body::{Humanoid, ROOT_STEP};
    use crate::motion_model::{Diffusion, DiffusionSettings, Prediction, ProposalScales};

    /// Energy of a parabola whose bottom moves steadily with the frame: half the squared step in units of `width`.
    struct Parabola {
        body: Humanoid,
        velocity: Vec<f64>,
        width: f64,
        bottom: Pose,
    }

    impl Parabola {
        fn bottom_at(&self, frame: usize) -> Pose {
            let step: Vec<f64> = self.velocity.iter().map(|v| v * frame as f64).collect();
            self.body.step(&standing(&self.body), &step)
        }
    }

    impl Likelihood for Parabola {
        type Scratch = Vec<f64>;

        fn scratch(&self) -> Vec<f64> {
            vec![0.0; self.body.step_len()]
        }

        fn prepare(&mut self, observation: &Observation) -> Result<(), TrackError> {
            self.bottom = self.bottom_at(observation.frame);
            Ok(())
        }

        fn energy(&self, pose: &Pose, step: &mut Vec<f64>) -> f64 {
            self.body.difference(&self.bottom, pose, step);
            0.5 * step.iter().map(|s| s * s).sum::<f64>() / (self.width * self.width)
        }
    }

    fn standing(body: &Humanoid) -> Pose {
        let mut pose = body.zero_pose();
        for (angle, dof) in pose.joint_angles.iter_mut().zip(&body.degrees_of_freedom) {
            *angle = 0.5 * (dof.lower + dof.upper);
        }
        pose
    }

    fn filter(settings: FilterSettings, prediction: Prediction) -> AnnealedParticleFilter<Diffusion, Parabola> {
        moving_at(0.01, settings, prediction)
    }

    /// A filter of a minimum whose every number moves by `speed` a frame.
    fn moving_at(
        speed: f64,
        settings: FilterSettings,
        prediction: Prediction,
    ) -> AnnealedParticleFilter<Diffusion, Parabola> {
        let body = Humanoid::tracker25().unwrap();
        let joints = DVector::from_element(body.degrees_of_freedom.len(), 0.03);
        let scales = ProposalScales { root_translation_m: [0.03; 3], root_rotation_rad: [0.03; 3], joints };
        let model = Diffusion::new(body.clone(), &scales, &DiffusionSettings { prediction, scale: 1.0 }).unwrap();
        let velocity = (0..body.step_len()).map(|i| if i % 2 == 0 { speed } else { -speed }).collect();
        let bottom = standing(&body);
        let mut filter =
            AnnealedParticleFilter::new(settings, model, Parabola { body, velocity, width: 0.05, bottom }, 11).unwrap();
        filter.start(&standing(filter.model.body()));
        filter
    }

    fn observation(frame: usize) -> Observation {
        Observation { frame, time_s: 0.0, silhouettes: Vec::new() }
    }

    /// Root mean square of all numbers of the step from the truth, over the last of 20 frames.
    fn error(mut filter: AnnealedParticleFilter<Diffusion, Parabola>) -> f64 {
        let mut squares = Vec::new();
        for frame in 0..20 {
            let estimate = filter.track(&observation(frame)).unwrap();
            let mut step = filter.likelihood.scratch();
            filter.model.difference(&filter.likelihood.bottom, &estimate.pose, &mut step);
            squares.push(step.iter().map(|s| s * s).sum::<f64>() / step.len() as f64);
        }
        let late = &squares[10..];
        (late.iter().sum::<f64>() / late.len() as f64).sqrt()
    }

    #[test]
    fn it_follows_a_moving_minimum_with_every_kernel() {
        let with = |kernel| filter(FilterSettings { kernel, ..FilterSettings::default() }, Prediction::None);
        // Frozen would be off by 0.1 to 0.2 in every number.
        for kernel in [Kernel::Geometric, Kernel::Min { factor: 1.0 }, Kernel::Shrink { h: 0.5 }] {
            let error = error(with(kernel));
            assert!(error < 0.02, "{kernel:?}: {error}");
        }
    }

    #[test]
    fn predicting_the_velocity_takes_off_the_lag() {
        let fast = |prediction| error(moving_at(0.06, FilterSettings::default(), prediction));
        let (without, with) = (fast(Prediction::None), fast(Prediction::ConstantVelocity));
        assert!(with < 0.5 * without, "{with} against {without}");
    }

    #[test]
    fn annealing_beats_a_plain_particle_filter_of_as_many_evaluations() {
        let plain = error(filter(FilterSettings::particle_filter(1000), Prediction::None));
        let annealed = error(filter(FilterSettings::default(), Prediction::None));
        assert!(annealed < plain, "{annealed} against {plain}");
    }

    #[test]
    fn every_layer_keeps_its_survival_rate_and_says_so() {
        let mut filter = filter(FilterSettings { survival_rate: 0.4, ..FilterSettings::default() }, Prediction::None);
        let estimate = filter.track(&observation(0)).unwrap();
        assert_eq!(estimate.layers.len(), 5);
        assert_eq!(estimate.evaluations, 1001);
        for layer in &estimate.layers {
            assert!(!layer.degenerate && layer.lambda > 0.0);
            assert!((layer.effective_sample_size - 80.0).abs() < 0.02, "{layer:?}");
            assert!(layer.energy_min < layer.energy_mean && layer.energy_std > 0.0);
        }
        assert!(estimate.layers[4].energy_mean < estimate.layers[0].energy_mean);
    }

    #[test]
    fn the_bits_do_not_depend_on_the_number_of_threads() {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let settings =
                    FilterSettings { particles: 64, kernel: Kernel::Shrink { h: 0.5 }, ..Default::default() };
                let mut filter = filter(settings, Prediction::ConstantVelocity);
                let bits = |estimate: Estimate| {
                    let mut numbers = vec![estimate.energy.unwrap(), estimate.pose.world_from_root.rotation.w];
                    numbers.extend(estimate.pose.world_from_root.translation.vector.iter());
                    numbers.extend(estimate.pose.joint_angles.iter());
                    numbers.extend(estimate.layers.iter().map(|layer| layer.lambda));
                    numbers.into_iter().map(f64::to_bits).collect::<Vec<u64>>()
                };
                (0..4).map(|frame| bits(filter.track(&observation(frame)).unwrap())).collect::<Vec<_>>()
            })
        };
        let one = run(1);
        assert_eq!(one, run(2));
        assert_eq!(one, run(8));
    }

    #[test]
    fn another_seed_gives_another_estimate_and_the_same_seed_the_same() {
        let run = |seed| {
            let mut filter = filter(FilterSettings { particles: 20, ..Default::default() }, Prediction::None);
            filter.seed = seed;
            filter.track(&observation(0)).unwrap().pose
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }

    #[test]
    fn no_particle_and_no_estimate_leaves_the_joint_limits() {
        let mut filter = filter(FilterSettings { particles: 50, ..Default::default() }, Prediction::None);
        let body = filter.model.body().clone();
        let mut at_limits = standing(&body);
        for (angle, dof) in at_limits.joint_angles.iter_mut().zip(&body.degrees_of_freedom) {
            *angle = dof.upper;
        }
        filter.start(&at_limits);
        for frame in 0..3 {
            let estimate = filter.track(&observation(frame)).unwrap();
            for pose in filter.particles.iter().chain([&estimate.pose]) {
                for (angle, dof) in pose.joint_angles.iter().zip(&body.degrees_of_freedom) {
                    assert!((dof.lower - 1e-12..=dof.upper + 1e-12).contains(angle), "{}: {angle}", dof.name);
                }
            }
        }
    }

    #[test]
    fn the_best_particle_is_one_of_the_particles() {
        let settings = FilterSettings { particles: 30, estimator: Estimator::Best, ..Default::default() };
        let mut filter = filter(settings, Prediction::None);
        let estimate = filter.track(&observation(0)).unwrap();
        assert!(filter.particles.contains(&estimate.pose));
        assert_eq!(estimate.energy, estimate.layers.last().map(|layer| layer.energy_min));
    }

    #[test]
    fn a_missing_start_or_one_of_another_body_is_refused() {
        let mut filter = filter(FilterSettings::default(), Prediction::None);
        let mut start = standing(filter.model.body());
        start.joint_angles = DVector::zeros(3);
        filter.start(&start);
        let found = filter.track(&observation(0));
        assert!(matches!(found, Err(TrackError::StartMismatch { expected: 19, found: 3 })), "{found:?}");
        filter.start = None;
        assert!(matches!(filter.track(&observation(4)), Err(TrackError::NotStarted { frame: 4 })));
    }

    #[test]
    fn poses_that_cannot_be_are_an_error_only_when_there_is_no_other() {
        let mut filter = filter(FilterSettings { particles: 10, ..Default::default() }, Prediction::None);
        filter.likelihood.width = f64::NAN;
        assert!(matches!(filter.track(&observation(2)), Err(TrackError::NoValidParticle { frame: 2 })));
    }

    #[test]
    fn with_no_width_of_proposal_every_particle_is_the_start_and_the_layers_are_flagged() {
        let mut filter = filter(FilterSettings { particles: 10, ..Default::default() }, Prediction::None);
        let body = filter.model.body().clone();
        let scales = ProposalScales {
            root_translation_m: [0.0; 3],
            root_rotation_rad: [0.0; 3],
            joints: DVector::zeros(body.step_len() - ROOT_STEP),
        };
        filter.model = Diffusion::new(body, &scales, &DiffusionSettings::default()).unwrap();
        let estimate = filter.track(&observation(5)).unwrap();
        assert!(estimate.layers.iter().all(|layer| layer.degenerate && layer.lambda == 0.0));
    }
}
