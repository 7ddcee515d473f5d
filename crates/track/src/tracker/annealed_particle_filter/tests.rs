//! The annealed particle filter on energies with a known minimum.

use nalgebra::DVector;

use super::*;
use crate::motion_model::{Diffusion, DiffusionSettings};
use skiagraph_core::body::{Humanoid, Prediction, ProposalScales, ROOT_STEP};

/// A quadratic energy whose minimum moves linearly with the frame: half the squared step in units of `width`.
struct Parabola {
    body: Humanoid,
    velocity: Vec<f64>,
    width: f64,
    bottom: Pose,
    rejects: bool,
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
        if self.rejects { f64::INFINITY } else { self.energy_unrejected(pose, step) }
    }

    fn energy_unrejected(&self, pose: &Pose, step: &mut Vec<f64>) -> f64 {
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

/// A filter on a minimum that moves by `speed` per frame in every component.
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
    let parabola = Parabola { body, velocity, width: 0.05, bottom, rejects: false };
    let mut filter = AnnealedParticleFilter::new(settings, model, parabola, 11).unwrap();
    filter.start(&standing(filter.model.body()));
    filter
}

fn observation(frame: usize) -> Observation {
    Observation { frame, time_s: 0.0, silhouettes: Vec::new(), moment: None, keypoints: None }
}

/// Root mean square over all components of the step from the truth, over the last 10 of 20 frames.
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
    // The static baseline would be off by 0.1 to 0.2 in every component.
    for kernel in [Kernel::Geometric, Kernel::Min { factor: 1.0 }, Kernel::Shrink { h: 0.5 }] {
        let error = error(with(kernel));
        assert!(error < 0.02, "{kernel:?}: {error}");
    }
}

#[test]
fn partitioned_search_follows_a_moving_minimum_and_needs_one_layer_per_part() {
    let partitioned = |layers| {
        let filter = filter(FilterSettings { layers, ..FilterSettings::default() }, Prediction::None);
        let partition = Partition::of_body(filter.model.body());
        filter.with_partition(partition)
    };
    let found = error(partitioned(10).unwrap());
    // the static baseline would be off by 0.1 to 0.2 in every component
    assert!(found < 0.05, "{found}");
    assert_eq!(partitioned(4).err().map(|e| e.key), Some("layers"));
    let shrinking =
        filter(FilterSettings { kernel: Kernel::Shrink { h: 0.5 }, ..FilterSettings::default() }, Prediction::None);
    let partition = Partition::of_body(shrinking.model.body());
    assert_eq!(shrinking.with_partition(partition).err().map(|e| e.key), Some("kernel"));
}

#[test]
fn predicting_the_velocity_removes_the_lag() {
    let fast = |prediction| error(moving_at(0.06, FilterSettings::default(), prediction));
    let (without, with) = (fast(Prediction::None), fast(Prediction::ConstantVelocity));
    assert!(with < 0.5 * without, "{with} against {without}");
}

#[test]
fn annealing_beats_a_plain_particle_filter_with_equal_evaluations() {
    let plain = error(filter(FilterSettings::particle_filter(1000), Prediction::None));
    let annealed = error(filter(FilterSettings::default(), Prediction::None));
    assert!(annealed < plain, "{annealed} against {plain}");
}

#[test]
fn every_layer_keeps_its_survival_rate_and_reports_it() {
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
fn results_are_bit_identical_for_any_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let settings = FilterSettings { particles: 64, kernel: Kernel::Shrink { h: 0.5 }, ..Default::default() };
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
fn the_best_particle_has_the_lowest_energy_even_with_equal_weights() {
    for survival_rate in [0.5, 1.0] {
        let best = Estimator::Best;
        let settings = FilterSettings { particles: 30, estimator: best, survival_rate, ..Default::default() };
        let mut filter = filter(settings, Prediction::None);
        let estimate = filter.track(&observation(0)).unwrap();
        assert!(filter.particles.contains(&estimate.pose));
        assert_eq!(estimate.energy, estimate.layers.last().map(|layer| layer.energy_min));
    }
}

#[test]
fn a_missing_start_and_one_of_a_different_body_are_rejected() {
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
fn tracking_fails_if_every_pose_is_invalid() {
    let mut filter = filter(FilterSettings { particles: 10, ..Default::default() }, Prediction::None);
    filter.likelihood.width = f64::NAN;
    assert!(matches!(filter.track(&observation(2)), Err(TrackError::NoValidParticle { frame: 2 })));
}

#[test]
fn with_zero_proposal_width_all_particles_stay_at_the_start_and_layers_are_degenerate() {
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

#[test]
fn unrejected_energies_are_used_if_every_particle_is_rejected() {
    let settings = FilterSettings { particles: 40, layers: 3, ..FilterSettings::default() };
    let mut plain = filter(settings, Prediction::None);
    let mut strict = filter(settings, Prediction::None);
    strict.likelihood.rejects = true;
    for frame in 0..3 {
        let [strict, plain] = [strict.track(&observation(frame)).unwrap(), plain.track(&observation(frame)).unwrap()];
        assert_eq!((strict.pose, strict.energy), (plain.pose, plain.energy));
    }
}
