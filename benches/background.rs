//! Background subtraction and simulated images, 640x480, on one thread: `cargo bench --bench background`. Targets: a
//! frozen mixture of three components in 0.7 ms per colour image, 60 simulated images per second.

use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_core::camera::{CameraRig, RingParameters};
use skiagraph_truth::observing::{
    BackgroundMixture, BackgroundSettings, Image, ImageSettings, Risk, SceneCamera, Segmenter,
};
use skiagraph_truth::scene::GroundTruth;

fn main() {
    if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(1).build_global() {
        eprintln!("times are for several threads: {error}");
    }
    divan::main();
}

struct TestScene {
    truth: GroundTruth,
    rig: CameraRig,
}

fn stage() -> TestScene {
    let body = Humanoid::tracker25().expect("a shipped body");
    let mut pose = body.zero_pose();
    pose.world_from_root.translation.z = 0.93;
    let rig = CameraRig::ring(&RingParameters { count: 1, ..RingParameters::default() }).expect("a valid ring");
    let motion = Motion { frames_per_second: 60.0, poses: vec![pose; 10] };
    TestScene { truth: GroundTruth::from_motion(body, &motion, &rig).expect("a valid scene"), rig }
}

/// Three periods of background, and frames.
fn images(stage: &TestScene, settings: &ImageSettings) -> (Vec<Vec<Image>>, Vec<Image>) {
    let camera = SceneCamera::new(&stage.truth, &stage.rig, settings, 1);
    let period = |period| (0..20).map(|number| camera.background(0, period, number)).collect();
    ((0..3).map(period).collect(), (0..10).flat_map(|frame| camera.images(frame)).collect())
}

#[divan::bench(args = ["colour", "grey"])]
fn frozen_classification(bencher: divan::Bencher<'_, '_>, kind: &str) {
    let (background, frames) = images(&stage(), &ImageSettings { grey: kind == "grey", ..ImageSettings::default() });
    let model = BackgroundMixture::learn(background.iter(), Risk::default()).expect("frames");
    let mut next = frames.iter().cycle();
    bencher.bench_local(|| model.foreground(next.next().expect("a cycle")).expect("one size"));
}

#[divan::bench]
fn silhouette_with_shadow_rule_and_cleaning(bencher: divan::Bencher<'_, '_>) {
    let (background, frames) = images(&stage(), &ImageSettings::default());
    let segmenter = Segmenter::learn(background.iter(), &BackgroundSettings::default()).expect("frames");
    let mut next = frames.iter().cycle();
    bencher.bench_local(|| segmenter.silhouette(next.next().expect("a cycle")).expect("one size"));
}

#[divan::bench]
fn image_of_the_scene(bencher: divan::Bencher<'_, '_>) {
    let stage = stage();
    let camera = SceneCamera::new(&stage.truth, &stage.rig, &ImageSettings::default(), 1);
    let mut next = (0..10).cycle();
    bencher.bench_local(|| camera.images(next.next().expect("a cycle")));
}
