//! One frame of the annealed particle filter, and the part of it that is not energies: 200 particles x 5 layers x 4 views of
//! a person who fills half the image's height. `cargo bench --bench annealed_particle_filter`
//!
//! On one thread (`RAYON_NUM_THREADS=1`) the time of `frame` over that of `bookkeeping` says how much the filter itself
//! costs; `bookkeeping` is a frame with a likelihood that costs nothing.

use divan::Bencher;
use nalgebra::Point3;
use skiagraph::body::{Humanoid, Pose, draw_silhouette};
use skiagraph::camera::{CameraRig, RingParameters};
use skiagraph::motion_model::{Diffusion, DiffusionSettings, ProposalScales};
use skiagraph::observation::Observation;
use skiagraph::raster::Mask;
use skiagraph::tracker::{
    AnnealedParticleFilter, FilterSettings, Likelihood, SilhouetteLikelihood, SilhouetteSettings, TrackError, Tracker,
};

fn main() {
    divan::main();
}

const SETTINGS: FilterSettings = FilterSettings {
    particles: 200,
    layers: 5,
    survival_rate: 0.5,
    kernel: skiagraph::tracker::Kernel::Geometric,
    estimator: skiagraph::tracker::Estimator::WeightedMean,
};

/// Costs nothing and yet differs from particle to particle.
struct Height;

impl Likelihood for Height {
    type Scratch = ();

    fn scratch(&self) {}

    fn prepare(&mut self, _: &Observation) -> Result<(), TrackError> {
        Ok(())
    }

    fn energy(&self, pose: &Pose, (): &mut ()) -> f64 {
        pose.world_from_root.translation.z
    }
}

fn standing(body: &Humanoid) -> Pose {
    let mut pose = body.zero_pose();
    pose.world_from_root.translation.z = 0.93;
    body.clamp_to_limits(&mut pose);
    pose
}

fn ring([width, height]: [u32; 2]) -> CameraRig {
    let ring = RingParameters {
        count: 4,
        radius: 4.5,
        height: 1.6,
        look_at: Point3::new(0.0, 0.0, 0.95),
        first_azimuth: 0.8,
        field_of_view: 1.05,
        image_size: [width, height],
        near: 0.05,
    };
    CameraRig::ring(&ring).expect("a sound ring")
}

fn seen(body: &Humanoid, rig: &CameraRig) -> Observation {
    let silhouettes = rig.cameras.iter().map(|camera| {
        let mut mask = Mask::new(camera.pinhole.width, camera.pinhole.height);
        draw_silhouette(body, &body.link_frames(&standing(body)), camera, &mut mask);
        mask
    });
    Observation { frame: 0, time_s: 0.0, silhouettes: silhouettes.collect() }
}

fn filter<L: Likelihood>(body: &Humanoid, likelihood: L) -> AnnealedParticleFilter<Diffusion, L> {
    let scales = ProposalScales::for_human(body, 60.0);
    let model = Diffusion::new(body.clone(), &scales, &DiffusionSettings::default()).expect("sound scales");
    let mut filter = AnnealedParticleFilter::new(SETTINGS, model, likelihood, 1).expect("sound settings");
    filter.start(&standing(body));
    filter
}

/// One frame again and again: every frame starts from the particles that the last one left.
fn bench_frames<L: Likelihood>(
    bencher: Bencher<'_, '_>,
    likelihood: impl Fn(&Humanoid) -> L,
    observation: &Observation,
) {
    let body = Humanoid::tracker25().expect("tracker25 loads");
    let mut filter = filter(&body, likelihood(&body));
    bencher.bench_local(|| filter.track(divan::black_box(observation)));
}

#[divan::bench(args = [[640, 480], [160, 120]], sample_count = 20)]
fn frame(bencher: Bencher<'_, '_>, size: [u32; 2]) {
    let body = Humanoid::tracker25().expect("tracker25 loads");
    let rig = ring(size);
    let observation = seen(&body, &rig);
    let settings = SilhouetteSettings::default();
    let likelihood = |body: &Humanoid| SilhouetteLikelihood::new(body.clone(), &rig, settings).expect("sound settings");
    bench_frames(bencher, likelihood, &observation);
}

#[divan::bench(sample_count = 50)]
fn bookkeeping(bencher: Bencher<'_, '_>) {
    let nothing = Observation { frame: 0, time_s: 0.0, silhouettes: Vec::new() };
    bench_frames(bencher, |_| Height, &nothing);
}
