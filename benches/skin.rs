//! Deforming and rendering skins: `cargo bench --bench skin`. One thread; energies are per particle and view.

use divan::{Bencher, counter::ItemsCount};
use nalgebra::Isometry3;
use skiagraph_core::body::{Humanoid, Pose, SilhouettePainter, shipped, shipped_skin};
use skiagraph_core::camera::{CameraRig, RingParameters};
use skiagraph_core::observation::Observation;
use skiagraph_core::raster::Mask;
use skiagraph_track::tracker::{Likelihood, SilhouetteLikelihood, SilhouetteSettings};
use skiagraph_truth::retarget::with_skin;

fn main() {
    divan::main();
}

const SKINS: [&str; 2] = ["person_coarse", "person"];

fn body(skin: &str) -> Humanoid {
    let robot = if skin == "person_coarse" { "tracker25" } else { "actor" };
    let mesh = shipped_skin(skin).expect("is shipped");
    with_skin(&shipped(robot).expect("is shipped"), &mesh).expect("fits the body")
}

fn standing(body: &Humanoid) -> Pose {
    Pose { world_from_root: Isometry3::translation(0.0, 0.0, 0.93), ..body.zero_pose() }
}

fn rig() -> CameraRig {
    CameraRig::ring(&RingParameters::default()).expect("a ring")
}

#[divan::bench(args = SKINS)]
fn blend(bencher: Bencher<'_, '_>, skin: &str) {
    let body = body(skin);
    let frames = body.link_frames(&standing(&body));
    let skin = body.skin.expect("has one");
    let mut vertices = Vec::new();
    bencher.counter(ItemsCount::new(skin.vertices().len())).bench_local(|| skin.deform_into(&frames, &mut vertices));
}

#[divan::bench(args = SKINS)]
fn silhouette_640x480(bencher: Bencher<'_, '_>, skin: &str) {
    let body = body(skin);
    let frames = body.link_frames(&standing(&body));
    let camera = &rig().cameras[0];
    let mut painter = SilhouettePainter::new(camera);
    let mut mask = Mask::new(640, 480);
    bencher.counter(ItemsCount::new(1_usize)).bench_local(|| {
        mask.clear();
        painter.paint(&body, &frames, &mut mask);
    });
}

#[divan::bench(args = SKINS)]
fn energy_640x480(bencher: Bencher<'_, '_>, skin: &str) {
    let (body, rig) = (body(skin), rig());
    let pose = standing(&body);
    let frames = body.link_frames(&pose);
    let silhouettes = rig.cameras.iter().map(|camera| SilhouettePainter::new(camera).silhouette(&body, &frames));
    let seen = Observation { frame: 0, time_s: 0.0, silhouettes: silhouettes.collect(), moment: None, keypoints: None };
    let mut likelihood = SilhouetteLikelihood::new(body, &rig, SilhouetteSettings::default()).expect("valid settings");
    likelihood.prepare(&seen).expect("fits the body");
    let mut scratch = likelihood.scratch();
    bencher.counter(ItemsCount::new(rig.cameras.len())).bench_local(|| likelihood.energy(&pose, &mut scratch));
}
