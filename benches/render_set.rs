//! Time to render one camera-frame of a benchmark set at 640x480, including its files.

use std::sync::{Mutex, PoisonError};

use divan::{Bencher, black_box};
use nalgebra::{Isometry3, Point3, Vector3};
use skiagraph_core::body::{Motion, shipped, shipped_skin};
use skiagraph_core::camera::{Camera, CameraRig, Distortion, FieldOfView, TimedRig};
use skiagraph_core::rng::ObservationKey;
use skiagraph_set::{BenchmarkSet, SetDrawing, SetParts, Start, Training, TruthFacts, TruthImage};
use skiagraph_truth::observing::Observer;
use skiagraph_truth::retarget::with_skin;
use skiagraph_truth::scene::GroundTruth;
use tempfile::TempDir;

/// Enough for several hundred files: with fewer, what every set has beside its images matters.
const FRAMES: usize = 50;
const CAMERAS: usize = 4;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap_or_default();
    divan::main();
    WRITTEN.lock().unwrap_or_else(PoisonError::into_inner).clear();
}

/// The sets that were written. They are removed at the end, because ext4 creates files slowly for seconds after others
/// were removed.
static WRITTEN: Mutex<Vec<TempDir>> = Mutex::new(Vec::new());

fn keep(folder: TempDir) {
    WRITTEN.lock().unwrap_or_else(PoisonError::into_inner).push(folder);
}

struct RenderedScene {
    rig: CameraRig,
    truth: GroundTruth,
    start: Start,
}

/// The shipped actor amid four cameras at 4.5 m, with a lens or a skin if `what` names them.
fn stage(what: &str) -> Option<RenderedScene> {
    let distortion = if what.contains("lens") { lens() } else { Distortion::default() };
    let bare = shipped("actor").ok()?;
    let actor = if what.contains("skin") {
        with_skin(&bare, &shipped_skin("person").ok()?).ok()?.with_masses_of_skin()
    } else {
        bare
    };
    let cameras = (0..CAMERAS).map(|i| {
        let angle = std::f64::consts::TAU * i as f64 / CAMERAS as f64;
        let eye = Point3::new(4.5 * angle.cos(), 4.5 * angle.sin(), 1.2);
        let (target, view) = (Point3::new(0.0, 0.0, 1.0), FieldOfView::Vertical(0.75));
        let camera = Camera::look_at(&format!("c{i}"), eye, target, Vector3::z(), view, 640, 480).ok()?;
        Some(Camera { distortion, ..camera })
    });
    let rig = CameraRig { cameras: cameras.collect::<Option<_>>()? };
    let poses = (0..FRAMES).map(|frame| {
        let mut pose = actor.zero_pose();
        pose.world_from_root = Isometry3::translation(0.01 * frame as f64, 0.0, 1.0);
        pose
    });
    let motion = Motion { frames_per_second: 60.0, poses: poses.collect() };
    let truth = GroundTruth::from_motion(actor.clone(), &motion, &rig).ok()?;
    let training = Training::none(&actor);
    Some(RenderedScene {
        rig,
        truth,
        start: Start {
            body: actor,
            pose: motion.poses[0].clone(),
            training,
            calibrate: false.into(),
            has_known_stature: false,
        },
    })
}

impl RenderedScene {
    fn with_parts<T>(&self, make: impl FnOnce(&SetParts<'_>, &Observer<'_>) -> T) -> T {
        let parts = SetParts {
            name: "bench",
            rig: &TimedRig::from(&self.rig),
            start: &self.start,
            ground_truth: &self.truth,
            refitted: None,
            facts: &TruthFacts::default(),
            recordings: &[],
            observation: None,
            key: ObservationKey::default(),
        };
        make(&parts, &Observer::new(&self.truth, &self.rig))
    }

    fn set(&self) -> Option<BenchmarkSet> {
        self.with_parts(|parts, observer| BenchmarkSet::assemble(parts, |frame| observer.observe(frame)).ok())
    }
}

fn lens() -> Distortion {
    Distortion { k1: -0.1, k2: 0.02, ..Distortion::default() }
}

fn camera_frames() -> divan::counter::ItemsCount {
    divan::counter::ItemsCount::new(FRAMES * CAMERAS)
}

/// Silhouettes only, without files. Items are camera-frames, here and below.
#[divan::bench(args = ["ideal", "lens", "skin", "skin and lens"])]
fn observe(bencher: Bencher<'_, '_>, what: &str) {
    let Some(stage) = stage(what) else { return };
    let observer = Observer::new(&stage.truth, &stage.rig);
    bencher.counter(camera_frames()).bench(|| (0..FRAMES).map(|frame| observer.observe(frame)).collect::<Vec<_>>());
}

/// A set in memory: silhouettes, PNG files, the truth and every SHA-256.
#[divan::bench(args = ["solids", "skin"])]
fn assemble(bencher: Bencher<'_, '_>, what: &str) {
    let Some(stage) = stage(what) else { return };
    bencher.counter(camera_frames()).bench(|| black_box(stage.set()));
}

/// A set rendered to disk frame by frame, with hashes, journal and synchronisation, as by `skiagraph render` after
/// preparing the scene.
#[divan::bench(
    args = ["masks", "masks through a lens", "depth, parts", "colour", "all layers"],
    sample_count = 5
)]
fn stream(bencher: Bencher<'_, '_>, what: &str) {
    let Some(stage) = stage(what) else { return };
    let all = [
        TruthImage::Depth,
        TruthImage::Parts,
        TruthImage::Normals,
        TruthImage::Flow,
        TruthImage::Coverage,
        TruthImage::Colour,
    ];
    let truth_images = match what {
        "depth, parts" => &all[..2],
        "colour" => &all[5..],
        "all layers" => &all[..],
        _ => &[],
    };
    bencher.counter(camera_frames()).with_inputs(|| tempfile::tempdir().ok()).bench_local_values(|directory| {
        let directory = directory?;
        let (folder, journal) = (directory.path().join("set"), directory.path().join("journal"));
        std::fs::create_dir(&folder).ok()?;
        stage.with_parts(|parts, observer| {
            let drawing = SetDrawing { truth_images, journal: Some(&journal), ..SetDrawing::default() };
            BenchmarkSet::draw_into(&folder, parts, &drawing, |frame| observer.observe(frame)).ok()
        })?;
        keep(directory);
        Some(())
    });
}
