//! Deforming and drawing skins: `cargo bench --bench skin`. One thread; unit of energies: one particle x one view.

use divan::{Bencher, counter::ItemsCount};
use nalgebra::{Isometry3, Point3};
use skiagraph::body::{Humanoid, Pose, SilhouettePainter, shipped, shipped_skin};
use skiagraph::camera::{CameraRig, RingParameters};
use skiagraph::observation::Observation;
use skiagraph::raster::Mask;
use skiagraph::retarget::with_skin;
use skiagraph::tracker::{Likelihood, SilhouetteLikelihood, SilhouetteSettings};

fn main() {
    divan::main();
}

const SKINS: [&str; 2] = ["person_coarse", "person"];

fn body(skin: &str) -> Humanoid {
    let robot = if skin == "person" { "actor" } else { "tracker25" };
    with_skin(&shipped(robot).expect("ships"), &shipped_skin(skin).expect("ships")).expect("fits")
}

fn standing(body: &Humanoid) -> Pose {
    Pose { world_from_root: Isometry3::translation(0.0, 0.0, 0.93), ..body.zero_pose() }
}

fn rig() -> CameraRig {
    CameraRig::ring(&RingParameters {
        count: 4,
        radius: 4.5,
        height: 1.6,
        look_at: Point3::new(0.0, 0.0, 0.95),
        first_azimuth: 0.7,
        field_of_view: 1.05,
        image_size: [640, 480],
        near: 0.05,
    })
    .expect("a ring")
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
    let seen = Observation { frame: 0, time_s: 0.0, silhouettes: silhouettes.collect() };
    let mut likelihood = SilhouetteLikelihood::new(body, &rig, SilhouetteSettings::default()).expect("sound");
    likelihood.prepare(&seen).expect("fits");
    let mut scratch = likelihood.scratch();
    bencher.counter(ItemsCount::new(rig.cameras.len())).bench_local(|| likelihood.energy(&pose, &mut scratch));
}
