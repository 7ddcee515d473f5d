//! One frame of the annealed particle filter, with and without energies: 200 particles x 5 layers x 4 views of a person
//! who fills half the image's height. `cargo bench --bench annealed_particle_filter`
//!
//! `bookkeeping` is a frame with a likelihood of negligible cost: the filter's own share of `frame` on one thread
//! (`RAYON_NUM_THREADS=1`).

mod scene;

use divan::Bencher;
use scene::{filter, ring, seen, tracker25};
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_core::observation::Observation;
use skiagraph_track::tracker::{Likelihood, SilhouetteLikelihood, SilhouetteSettings, TrackError, Tracker};

fn main() {
    divan::main();
}

/// A likelihood of negligible cost that differs between particles.
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

/// One frame repeatedly: every frame starts from the particles of the previous one.
fn bench_frames<L: Likelihood>(
    bencher: Bencher<'_, '_>,
    likelihood: impl Fn(&Humanoid) -> L,
    observation: &Observation,
) {
    let body = tracker25();
    let mut filter = filter(200, &body, likelihood(&body));
    bencher.bench_local(|| filter.track(divan::black_box(observation)));
}

#[divan::bench(args = [[640, 480], [160, 120]], sample_count = 20)]
fn frame(bencher: Bencher<'_, '_>, size: [u32; 2]) {
    let body = tracker25();
    let rig = ring(size);
    let observation = seen(&body, &rig);
    let settings = SilhouetteSettings::default();
    let likelihood = |body: &Humanoid| SilhouetteLikelihood::new(body.clone(), &rig, settings).expect("valid settings");
    bench_frames(bencher, likelihood, &observation);
}

#[divan::bench(sample_count = 50)]
fn bookkeeping(bencher: Bencher<'_, '_>) {
    let nothing = Observation { frame: 0, time_s: 0.0, silhouettes: Vec::new(), moment: None, keypoints: None };
    bench_frames(bencher, |_| Height, &nothing);
}
