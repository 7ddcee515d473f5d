//! A frame with refinement and its parts, compared with a frame without: 640 x 480, four views, a person who fills half
//! the image's height. `cargo bench --bench refinement`; on one thread with `RAYON_NUM_THREADS=1`.

mod scene;

use divan::Bencher;
use scene::{filter, filter_of, ring, seen, standing, tracker25};
use skiagraph_core::body::ProposalScales;
use skiagraph_core::body::{shipped, shipped_skin};
use skiagraph_track::motion_model::{Diffusion, DiffusionSettings, MotionModel};
use skiagraph_track::tracker::{
    CALIBRATION_FRAMES, CalibrationTask, Likelihood, Refinement, RefinementSettings, SilhouetteLikelihood,
    SilhouetteSettings, Tracker, calibrate,
};
use skiagraph_truth::retarget::with_skin;

const SIZE: [u32; 2] = [640, 480];

fn main() {
    divan::main();
}

fn likelihood() -> SilhouetteLikelihood {
    SilhouetteLikelihood::new(tracker25(), &ring(SIZE), SilhouetteSettings::default()).expect("valid settings")
}

fn model() -> Diffusion {
    let body = tracker25();
    let scales = ProposalScales::for_human(&body, 60.0);
    Diffusion::new(body, &scales, &DiffusionSettings::default()).expect("valid scales")
}

/// One frame repeatedly: every frame starts from the particles of the previous one.
fn frames(bencher: Bencher<'_, '_>, particles: usize, refined: bool) {
    let body = tracker25();
    let observation = seen(&body, &ring(SIZE));
    let likelihood = if refined { likelihood().with_descent() } else { likelihood() };
    let mut filter = filter_of(particles, &body, likelihood);
    if refined {
        // limbs are searched in every frame; searching in every second one costs half the difference
        let settings = RefinementSettings { limb_every: 1, ..RefinementSettings::default() };
        let refinement = Refinement::new(settings, &body, Vec::new(), 1).expect("valid settings");
        filter = filter.with_refinement(refinement).expect("silhouettes support descent");
    }
    bencher.bench_local(|| filter.track(divan::black_box(&observation)));
}

/// The default: a frame with the body of 40 angles, of capsules or with a skin, limbs in every second frame.
#[divan::bench(sample_count = 60, args = [false, true])]
fn frame_of_the_default(bencher: Bencher<'_, '_>, skin: bool) {
    let mut body = shipped("tracker40").expect("a shipped body");
    if skin {
        body = with_skin(&body, &shipped_skin("person_coarse").expect("a shipped skin")).expect("fits the body");
    }
    let observation = seen(&body, &ring(SIZE));
    let likelihood = SilhouetteLikelihood::new(body.clone(), &ring(SIZE), SilhouetteSettings::default());
    let refinement = Refinement::new(RefinementSettings::default(), &body, Vec::new(), 1).expect("valid settings");
    let filter = filter_of(60, &body, likelihood.expect("valid settings").with_descent());
    let mut filter = filter.with_refinement(refinement).expect("silhouettes support descent");
    bencher.bench_local(|| filter.track(divan::black_box(&observation)));
}

/// Done once per run: twenty frames of four views.
#[divan::bench(sample_count = 3)]
fn calibration_of_the_body(bencher: Bencher<'_, '_>) {
    let body = tracker25();
    let seen: Vec<_> = (0..CALIBRATION_FRAMES).map(|_| (seen(&body, &ring(SIZE)), standing(&body))).collect();
    let settings = SilhouetteSettings::default();
    let task = CalibrationTask { what: true.into(), has_known_stature: false, has_known_start: true };
    bencher.bench_local(|| calibrate(&body, &ring(SIZE), settings, task, &seen[0].1, divan::black_box(&seen)));
}

#[divan::bench(sample_count = 30)]
fn frame_of_the_paper_200(bencher: Bencher<'_, '_>) {
    let (observation, mut filter) = (seen(&tracker25(), &ring(SIZE)), filter(&tracker25(), likelihood()));
    bencher.bench_local(|| filter.track(divan::black_box(&observation)));
}

#[divan::bench(sample_count = 30)]
fn frame_without_refinement_60(bencher: Bencher<'_, '_>) {
    frames(bencher, 60, false);
}

#[divan::bench(sample_count = 30)]
fn frame_refined_60_with_limbs(bencher: Bencher<'_, '_>) {
    frames(bencher, 60, true);
}

#[divan::bench(sample_count = 60)]
fn prepare(bencher: Bencher<'_, '_>) {
    let (mut likelihood, observation) = (likelihood(), seen(&tracker25(), &ring(SIZE)));
    bencher.bench_local(|| likelihood.prepare(divan::black_box(&observation)));
}

#[divan::bench(sample_count = 60)]
fn prepare_for_descent(bencher: Bencher<'_, '_>) {
    let (mut likelihood, observation) = (likelihood().with_descent(), seen(&tracker25(), &ring(SIZE)));
    bencher.bench_local(|| likelihood.prepare(divan::black_box(&observation)));
}

#[divan::bench(sample_count = 200)]
fn energy(bencher: Bencher<'_, '_>) {
    let (body, mut likelihood) = (tracker25(), likelihood());
    likelihood.prepare(&seen(&body, &ring(SIZE))).expect("an observation of this rig");
    let (pose, mut scratch) = (standing(&body), likelihood.scratch());
    bencher.bench_local(|| likelihood.energy(divan::black_box(&pose), &mut scratch));
}

#[divan::bench(sample_count = 200)]
fn step_of_descent(bencher: Bencher<'_, '_>) {
    let (body, model, mut likelihood) = (tracker25(), model(), likelihood().with_descent());
    likelihood.prepare(&seen(&body, &ring(SIZE))).expect("an observation of this rig");
    let step: Vec<f64> = (0..body.step_len()).map(|i| if i % 2 == 0 { 0.02 } else { -0.02 }).collect();
    let (pose, mut scratch) = (body.step(&standing(&body), &step), likelihood.scratch());
    bencher.bench_local(|| {
        let evidence = likelihood.linearise(divan::black_box(&pose), 4.0, &mut scratch)?;
        model.descend(&pose, &pose, evidence)
    });
}
