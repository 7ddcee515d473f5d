//! Instruction counts of the hottest paths; they do not depend on the machine's load. `cargo bench --bench
//! instructions` (needs valgrind and gungraun-runner, see CONTRIBUTING.md).

#![allow(missing_docs, reason = "what the macros of gungraun make has none")]

mod scene;

use std::hint::black_box;

use faer::Mat;
use gungraun::{library_benchmark, library_benchmark_group, main};
use scene::{filter, ring, seen, standing, tracker25};
use skiagraph::body::Pose;
use skiagraph::motion_model::Diffusion;
use skiagraph::motion_model::gpdm::{
    DynamicsKernel, DynamicsOrder, MapKernel, Objective, Parameters, SequenceLayout, TrainingOptions, train,
};
use skiagraph::observation::Observation;
use skiagraph::tracker::{
    AnnealedParticleFilter, Likelihood, PlausibilitySettings, SilhouetteLikelihood, SilhouetteSettings, Tracker,
};

const LARGE: [u32; 2] = [640, 480];
const SMALL: [u32; 2] = [160, 120];

fn prepared(size: [u32; 2]) -> (SilhouetteLikelihood, Observation) {
    let body = tracker25();
    let rig = ring(size);
    let observation = seen(&body, &rig);
    let mut likelihood = SilhouetteLikelihood::new(body, &rig, SilhouetteSettings::default()).expect("sound settings");
    likelihood.prepare(&observation).expect("an observation of this rig");
    (likelihood, observation)
}

/// A likelihood and 64 poses around the observed one.
fn poses(size: [u32; 2]) -> (SilhouetteLikelihood, Vec<Pose>) {
    let body = tracker25();
    let pose = |index: usize| {
        let mut pose = standing(&body);
        let angles = pose.joint_angles.iter_mut().enumerate();
        angles.for_each(|(i, angle)| *angle += 0.2 * ((index * (i + 3)) as f64 * 0.7).sin());
        pose
    };
    (prepared(size).0, (0..64).map(pose).collect())
}

/// The same with the plausibility term and its solids prepared.
fn plausible_poses(size: [u32; 2]) -> (SilhouetteLikelihood, Vec<Pose>) {
    let (silhouettes, poses) = poses(size);
    (silhouettes.with_plausibility(PlausibilitySettings::default()).expect("sound settings"), poses)
}

// Kinematics and the energy of 64 poses in four views, contour term included.
#[library_benchmark]
#[bench::at_640x480(args = (LARGE), setup = poses)]
#[bench::at_160x120(args = (SMALL), setup = poses)]
fn silhouette_energies_of_64_poses((likelihood, poses): (SilhouetteLikelihood, Vec<Pose>)) -> f64 {
    let mut scratch = likelihood.scratch();
    black_box(&poses).iter().map(|pose| likelihood.energy(pose, &mut scratch)).sum()
}

// The same, and penetration depths with the ground and the body itself.
#[library_benchmark]
#[bench::at_160x120(args = (SMALL), setup = plausible_poses)]
fn plausible_energies_of_64_poses((likelihood, poses): (SilhouetteLikelihood, Vec<Pose>)) -> f64 {
    let mut scratch = likelihood.scratch();
    black_box(&poses).iter().map(|pose| likelihood.energy(pose, &mut scratch)).sum()
}

type Filter = (AnnealedParticleFilter<Diffusion, SilhouetteLikelihood>, Observation);

fn starting(size: [u32; 2]) -> Filter {
    // other threads are not counted
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().ok();
    let (likelihood, observation) = prepared(size);
    (filter(&tracker25(), likelihood), observation)
}

fn starting_plausible(size: [u32; 2]) -> Filter {
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().ok();
    let (silhouettes, observation) = prepared(size);
    let likelihood = silhouettes.with_plausibility(PlausibilitySettings::default()).expect("sound settings");
    (filter(&tracker25(), likelihood), observation)
}

// One frame: 200 particles, five layers, four views.
#[library_benchmark]
#[bench::at_160x120(args = (SMALL), setup = starting)]
fn annealed_frame((mut filter, observation): Filter) -> Option<f64> {
    filter.track(black_box(&observation)).ok().and_then(|estimate| estimate.energy)
}

// The same with the plausibility term.
#[library_benchmark]
#[bench::at_160x120(args = (SMALL), setup = starting_plausible)]
fn plausible_frame((mut filter, observation): Filter) -> Option<f64> {
    filter.track(black_box(&observation)).ok().and_then(|estimate| estimate.energy)
}

fn motion(frames: usize) -> Mat<f64> {
    Mat::from_fn(frames, 60, |i, j| {
        let phase = i as f64 * std::f64::consts::TAU / 65.0;
        (phase + 0.7 * j as f64).sin() * (0.1 + 0.005 * j as f64) + 0.05 * (2.0 * phase + 0.3 * j as f64).cos()
    })
}

fn learning(frames: usize) -> (Mat<f64>, Vec<f64>) {
    let parameters = Parameters {
        latents: Mat::from_fn(frames, 3, |i, c| ((i as f64) * 0.0967 + c as f64 * 1.6).sin() * 1.4),
        map: MapKernel { inverse_width: 1.0, noise_precision: 50.0 },
        dynamics: DynamicsKernel { amplitude: 0.1, inverse_width: 1.0, linear: 0.9, noise_precision: 50.0 },
    };
    (motion(frames), parameters.pack())
}

// Loss and gradient of a GPDM, D = 60, d = 3.
#[library_benchmark]
#[bench::of_150_frames(args = (150), setup = learning)]
#[bench::of_480_frames(args = (480), setup = learning)]
fn gpdm_loss_and_gradient((observations, theta): (Mat<f64>, Vec<f64>)) -> f64 {
    let lengths = vec![observations.nrows()];
    let layout = SequenceLayout { order: DynamicsOrder::First, delta: false, lengths };
    let scales = vec![1.0; observations.ncols()];
    let mut objective = Objective::new(observations.as_ref(), &scales, &layout, 1.0);
    let mut gradient = vec![0.0; theta.len()];
    objective.value_and_gradient(black_box(&theta), 3, &mut gradient)
}

fn model(frames: usize) -> skiagraph::motion_model::gpdm::Gpdm {
    let options = TrainingOptions { rounds: 1, iterations: 1, ..TrainingOptions::default() };
    train(motion(frames).as_ref(), &[frames], &options).expect("a motion that moves")
}

// Mean and variance of the poses of 1000 particles.
#[library_benchmark]
#[bench::of_480_frames(args = (480), setup = model)]
fn gpdm_prediction_of_1000_particles(model: skiagraph::motion_model::gpdm::Gpdm) -> f64 {
    let particles = Mat::from_fn(1000, 3, |i, c| ((i * (c + 2)) as f64 * 0.37).sin());
    model.map_moments(black_box(particles.as_ref())).variance.iter().sum()
}

library_benchmark_group!(
    name = paths;
    benchmarks = silhouette_energies_of_64_poses, plausible_energies_of_64_poses, annealed_frame, plausible_frame, gpdm_loss_and_gradient,
        gpdm_prediction_of_1000_particles
);

main!(library_benchmark_groups = paths);
