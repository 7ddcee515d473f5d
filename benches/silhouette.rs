//! Energy terms of a pose: kinematics, silhouette and comparison with an observed mask, in particle-views per second on
//! one thread. `cargo bench --bench silhouette`
//!
//! tracker25 (18 tapered capsules), 256 poses jittered around the standing pose, four cameras on a ring of 4.5 m, the
//! figure 265 pixels tall at 640x480.

#[path = "scene/jittered.rs"]
mod jittered;

use divan::Bencher;
use divan::counter::ItemsCount;
use jittered::jittered;
use skiagraph_core::body::{Humanoid, LinkFrames, Pose, capsules_in_camera};
use skiagraph_core::camera::{Camera, CameraRig, RingParameters};
use skiagraph_core::raster::{CapsulePainter, Mask, SilhouetteComparer, SilhouetteScratch, TaperedCapsule};

fn main() {
    divan::main();
}

const POSES: u64 = 256;
const VIEWS: u32 = 4;
const SIZES: [[u32; 2]; 2] = [[640, 480], [160, 120]];

fn rig(image_size: [u32; 2]) -> CameraRig {
    let ring =
        RingParameters { count: VIEWS, height: 1.0, field_of_view: 0.88, image_size, ..RingParameters::default() };
    CameraRig::ring(&ring).expect("a valid ring")
}

struct Workload {
    body: Humanoid,
    rig: CameraRig,
    poses: Vec<Pose>,
    comparers: Vec<SilhouetteComparer>,
}

impl Workload {
    fn new(image_size: [u32; 2], contour_tau: Option<f64>) -> Self {
        let body = Humanoid::tracker25().expect("a shipped body");
        let rig = rig(image_size);
        let poses = (0..POSES).map(|index| jittered(&body, index)).collect();
        let mut capsules = Vec::new();
        let frames = body.link_frames(&jittered(&body, POSES));
        let mut comparer = |camera: &Camera| {
            let mut observed = Mask::new(image_size[0], image_size[1]);
            capsules_in_camera(&body, &frames, camera, &mut capsules);
            CapsulePainter::new(&camera.pinhole).paint(&capsules, &mut observed);
            SilhouetteComparer::new(&camera.pinhole, &observed, contour_tau)
        };
        let comparers = rig.cameras.iter().map(&mut comparer).collect();
        Self { body, rig, poses, comparers }
    }

    /// All poses in all views; the result depends on every computation.
    fn run(&self, frames: &mut LinkFrames, capsules: &mut Vec<TaperedCapsule>, scratch: &mut SilhouetteScratch) -> f64 {
        let mut sum = 0.0;
        for pose in &self.poses {
            self.body.link_frames_into(pose, frames);
            for (camera, comparer) in self.rig.cameras.iter().zip(&self.comparers) {
                capsules_in_camera(&self.body, frames, camera, capsules);
                let comparison = comparer.compare(scratch, capsules);
                sum += comparison.overlap.iou() + comparison.contour.unwrap_or(0.0);
            }
        }
        sum
    }
}

fn bench(bencher: Bencher<'_, '_>, image_size: [u32; 2], contour_tau: Option<f64>) {
    let workload = Workload::new(image_size, contour_tau);
    let (mut frames, mut capsules, mut scratch) = (LinkFrames::default(), Vec::new(), SilhouetteScratch::default());
    bencher
        .counter(ItemsCount::new(POSES * u64::from(VIEWS)))
        .bench_local(|| workload.run(&mut frames, &mut capsules, &mut scratch));
}

/// Exact bidirectional overlap.
#[divan::bench(args = SIZES)]
fn overlap(bencher: Bencher<'_, '_>, image_size: [u32; 2]) {
    bench(bencher, image_size, None);
}

/// Overlap and contour distance.
#[divan::bench(args = SIZES)]
fn overlap_and_contour(bencher: Bencher<'_, '_>, image_size: [u32; 2]) {
    bench(bencher, image_size, Some(f64::from(image_size[1]) / 24.0));
}

/// Preparation of a frame: the comparer of one view with its distance map.
#[divan::bench(args = SIZES)]
fn prepare_one_view(bencher: Bencher<'_, '_>, image_size: [u32; 2]) {
    let workload = Workload::new(image_size, None);
    let camera = &workload.rig.cameras[0];
    let mut observed = Mask::new(image_size[0], image_size[1]);
    let mut capsules = Vec::new();
    let frames = workload.body.link_frames(&workload.poses[0]);
    capsules_in_camera(&workload.body, &frames, camera, &mut capsules);
    CapsulePainter::new(&camera.pinhole).paint(&capsules, &mut observed);
    bencher.bench_local(|| SilhouetteComparer::new(&camera.pinhole, &observed, Some(f64::from(image_size[1]) / 24.0)));
}

/// Kinematics only, for comparison.
#[divan::bench]
fn kinematics(bencher: Bencher<'_, '_>) {
    let workload = Workload::new(SIZES[1], None);
    let (mut frames, mut capsules) = (LinkFrames::default(), Vec::new());
    bencher.counter(ItemsCount::new(POSES * u64::from(VIEWS))).bench_local(|| {
        for pose in &workload.poses {
            workload.body.link_frames_into(pose, &mut frames);
            for camera in &workload.rig.cameras {
                capsules_in_camera(&workload.body, &frames, camera, &mut capsules);
                divan::black_box(&capsules);
            }
        }
    });
}
