//! One loss with its gradient, one training, and 1000 predictions of a GPDM with D = 60 observed and d = 3 latent
//! dimensions, on one thread; and reading a model file. `cargo bench --bench gpdm`
//!
//! `benches/reference/gpdm_numpy.py` times the same losses and predictions in NumPy and SciPy.

use std::path::Path;

use faer::Mat;
use skiagraph::train::{LearnedFrom, LearnedModel, MODEL_SCHEMA, ModelFacts, RobotFacts};
use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_track::motion_model::gpdm::{
    DynamicsKernel, DynamicsOrder, MapKernel, Objective, Parameters, SequenceLayout, TrainingOptions, train,
};
use skiagraph_track::motion_model::gpdm_graph::{GpdmGraph, GraphSettings};

fn main() {
    divan::main();
}

const DIMENSIONS: usize = 60;

/// A motion of slowly drifting cycles of 65 frames, like a walk at 60 Hz.
fn motion(frames: usize) -> Mat<f64> {
    Mat::from_fn(frames, DIMENSIONS, |i, j| {
        let phase = i as f64 * std::f64::consts::TAU / 65.0;
        let drift = 1.0 + 0.2 * (i as f64 * 0.013 + j as f64).sin();
        drift * (phase + 0.7 * j as f64).sin() * (0.1 + 0.005 * j as f64) + 0.05 * (2.0 * phase + 0.3 * j as f64).cos()
    })
}

#[divan::bench(args = [60, 150, 480])]
fn loss_and_gradient(bencher: divan::Bencher<'_, '_>, frames: usize) {
    let observations = motion(frames);
    let scales = vec![1.0; DIMENSIONS];
    let layout = SequenceLayout { order: DynamicsOrder::First, delta: false, lengths: vec![frames] };
    let mut objective = Objective::new(observations.as_ref(), &scales, &layout, 1.0);
    let theta = Parameters {
        latents: Mat::from_fn(frames, 3, |i, c| ((i as f64) * 0.0967 + c as f64 * 1.6).sin() * 1.4),
        map: MapKernel { inverse_width: 1.0, noise_precision: 50.0 },
        dynamics: DynamicsKernel { amplitude: 0.1, inverse_width: 1.0, linear: 0.9, noise_precision: 50.0 },
    }
    .pack();
    let mut gradient = vec![0.0; theta.len()];
    bencher.bench_local(move || objective.value_and_gradient(divan::black_box(&theta), 3, &mut gradient));
}

#[divan::bench(args = [150, 480], sample_count = 3, sample_size = 1)]
fn training(bencher: divan::Bencher<'_, '_>, frames: usize) {
    let observations = motion(frames);
    bencher.bench_local(|| train(observations.as_ref(), &[frames], &TrainingOptions::default()));
}

#[divan::bench(args = [60, 150, 480], sample_count = 20)]
fn predict_1000_particles_mean_and_variance(bencher: divan::Bencher<'_, '_>, frames: usize) {
    let options = TrainingOptions { rounds: 1, iterations: 5, ..TrainingOptions::default() };
    let Ok(model) = train(motion(frames).as_ref(), &[frames], &options) else { return };
    let particles = Mat::from_fn(1000, 3, |i, c| ((i * (c + 2)) as f64 * 0.37).sin());
    bencher.bench_local(|| model.map_moments(divan::black_box(particles.as_ref())));
}

/// A body whose joints all swing, differently in every cycle of 65 frames.
fn swinging(body: &Humanoid, frames: usize) -> Motion {
    let pose = |t: usize| {
        let mut pose = body.zero_pose();
        let drift = |i: usize| 1.0 + 0.4 * (0.013 * t as f64 + i as f64).sin();
        let phase = t as f64 * std::f64::consts::TAU / 65.0;
        let angles = pose.joint_angles.iter_mut().enumerate();
        angles.for_each(|(i, angle)| *angle = 0.25 * drift(i) * (phase + 0.7 * i as f64).sin());
        pose
    };
    Motion { frames_per_second: 60.0, poses: (0..frames).map(pose).collect() }
}

/// Table 1 of `[GPDM graph]` for all clips: all segments grown, all candidates found.
#[divan::bench(args = [480], sample_count = 3, sample_size = 1)]
fn training_a_whole_graph(bencher: divan::Bencher<'_, '_>, frames: usize) {
    let Ok(body) = Humanoid::tracker25() else { return };
    let motion = [swinging(&body, frames)];
    bencher.bench_local(|| GpdmGraph::learn(&body, &motion, &GraphSettings::default()));
}

/// A file with one model of `frames` frames of tracker25.
fn model_file(frames: usize) -> Option<Vec<u8>> {
    let body = Humanoid::tracker25().ok()?;
    let pose = |t: usize| {
        let mut pose = body.zero_pose();
        let angles = pose.joint_angles.iter_mut().enumerate();
        angles.for_each(|(i, angle)| *angle = 0.2 * (0.1 * t as f64 + i as f64).sin() + 0.1 * (0.017 * t as f64).sin());
        pose
    };
    let motion = Motion { frames_per_second: 60.0, poses: (0..frames).map(pose).collect() };
    let training = TrainingOptions { rounds: 1, iterations: 5, ..TrainingOptions::default() };
    let settings = GraphSettings { single: true, training, ..GraphSettings::default() };
    let graph = GpdmGraph::learn(&body, &[motion], &settings).ok()?;
    let from = LearnedFrom {
        clip: "swing".to_owned(),
        sha256: None,
        first_frame: None,
        last_frame: None,
        frames,
        poses_sha256: String::new(),
    };
    let facts = ModelFacts {
        schema: MODEL_SCHEMA.to_owned(),
        program: "bench".to_owned(),
        whole: true,
        robot: RobotFacts::from_body(&body),
        frames_per_second: 60.0,
        learned_from: vec![from],
        settings,
    };
    LearnedModel { facts, body, graph, fingerprints: vec![None] }.to_bytes().ok()
}

#[divan::bench(args = [150, 480], sample_count = 20)]
fn read_a_model_file(bencher: divan::Bencher<'_, '_>, frames: usize) {
    let Some(bytes) = model_file(frames) else { return };
    bencher.bench_local(|| LearnedModel::from_bytes(Path::new("swing.model"), divan::black_box(&bytes)));
}
