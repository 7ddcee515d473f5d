//! Time of the keypoints of 256 frames of eight cameras, with all errors, on one core: 0.256 s are 10,000 frames in
//! 10 s.

use divan::{Bencher, black_box};
use nalgebra::Point3;
use skiagraph_core::body::{KeypointLayout, Motion, shipped, shipped_skin};
use skiagraph_core::camera::{CameraRig, RingParameters, TimedRig};
use skiagraph_truth::observing::{Corruption, KeypointDetector, KeypointSettings};
use skiagraph_truth::retarget::with_skin;
use skiagraph_truth::scene::GroundTruth;

const FRAMES: usize = 256;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap_or_default();
    divan::main();
}

fn scene(what: &str) -> Option<(GroundTruth, CameraRig)> {
    let bare = shipped("actor").ok()?;
    let actor = if what == "solids" { bare } else { with_skin(&bare, &shipped_skin(what).ok()?).ok()? };
    let ring = RingParameters {
        count: 8,
        radius: 4.5,
        height: 1.2,
        look_at: Point3::new(0.0, 0.0, 1.0),
        first_azimuth: 0.0,
        field_of_view: 0.75,
        image_size: [640, 480],
        near: 0.05,
    };
    let rig = CameraRig::ring(&ring).ok()?;
    let mut pose = actor.zero_pose();
    pose.world_from_root.translation.z = 0.95;
    let motion = Motion { frames_per_second: 60.0, poses: vec![pose; FRAMES] };
    Some((GroundTruth::from_motion(actor, &motion, &rig).ok()?, rig))
}

#[divan::bench(args = ["solids", "person_coarse", "person"], sample_count = 3, sample_size = 1)]
fn frames_256_of_eight_cameras(bencher: Bencher<'_, '_>, what: &str) {
    let Some((truth, rig)) = scene(what) else { return };
    let settings = KeypointSettings {
        slow_percent: 1.0,
        white_percent: 0.2,
        gross: 0.02,
        missing: 0.02,
        inversion: 0.01,
        bias_mm: 14.0,
        confidence_noise: 0.3,
        ..KeypointSettings::exact(KeypointLayout::Halpe26)
    };
    let rig = TimedRig::from(&rig);
    let detector = KeypointDetector::new(&truth, &rig, settings, Corruption::default(), 1.into());
    bencher.bench_local(|| black_box(detector.detect()));
}
