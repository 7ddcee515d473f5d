//! A frame with refinement, and calibration: 640 x 480, four views, a person who fills half the image's height.
//! `cargo bench --bench refinement`; on one thread with `RAYON_NUM_THREADS=1`.

mod scene;

use divan::Bencher;
use scene::{filter, ring, seen, standing, tracker25};
use skiagraph_core::body::{shipped, shipped_skin};
use skiagraph_track::tracker::{
    CALIBRATION_FRAMES, CalibrationTask, Refinement, RefinementSettings, SilhouetteLikelihood, SilhouetteSettings,
    Tracker, calibrate,
};
use skiagraph_truth::retarget::with_skin;

const SIZE: [u32; 2] = [640, 480];

fn main() {
    divan::main();
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
    let filter = filter(60, &body, likelihood.expect("valid settings").with_descent());
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
