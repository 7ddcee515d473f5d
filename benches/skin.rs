//! Deforming and rendering skins: `cargo bench --bench skin`. One thread; energies are per particle and view.
//!
//! Besides the shipped skins, one of 7,000 triangles is used: `person` with its longest edges split.

use std::collections::{BTreeMap, BTreeSet};

use divan::{Bencher, counter::ItemsCount};
use nalgebra::{Isometry3, Point3};
use skiagraph_core::body::{Humanoid, Pose, SilhouettePainter, SkinMesh, shipped, shipped_skin};
use skiagraph_core::camera::{CameraRig, RingParameters};
use skiagraph_core::observation::Observation;
use skiagraph_core::raster::Mask;
use skiagraph_track::tracker::{Likelihood, SilhouetteLikelihood, SilhouetteSettings};
use skiagraph_truth::retarget::with_skin;

fn main() {
    divan::main();
}

const SKINS: [&str; 3] = ["person_coarse", "person", "person_7000"];

fn body(skin: &str) -> Humanoid {
    let robot = if skin == "person_coarse" { "tracker25" } else { "actor" };
    let mesh = match skin {
        "person_7000" => refined(shipped_skin("person").expect("is shipped"), 7000),
        name => shipped_skin(name).expect("is shipped"),
    };
    with_skin(&shipped(robot).expect("is shipped"), &mesh).expect("fits the body")
}

/// The same surface with at least this many triangles, by repeatedly splitting the longest edges.
fn refined(mut mesh: SkinMesh, triangles: usize) -> SkinMesh {
    while mesh.triangles.len() < triangles {
        let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| [a.min(b), a.max(b)]);
        let edges: BTreeSet<[u32; 2]> = mesh.triangles.iter().flat_map(sides).collect();
        let length = |e: &[u32; 2]| (mesh.vertices[e[0] as usize] - mesh.vertices[e[1] as usize]).norm();
        let mut edges: Vec<[u32; 2]> = edges.into_iter().collect();
        edges.sort_by(|a, b| length(b).total_cmp(&length(a)));
        // a fifth of the missing triangles, so that no split edge stays among the longest
        let wanted = ((triangles - mesh.triangles.len()) / 5).max(1);
        for edge in edges.into_iter().take(wanted) {
            split_edge(&mut mesh, edge);
        }
    }
    mesh
}

fn split_edge(mesh: &mut SkinMesh, [a, b]: [u32; 2]) {
    let middle = mesh.vertices.len() as u32;
    mesh.vertices.push(nalgebra::center(&mesh.vertices[a as usize], &mesh.vertices[b as usize]));
    for shares in mesh.weights.iter_mut().flat_map(BTreeMap::values_mut) {
        let of_ends = shares.iter().filter(|(vertex, _)| [a, b].contains(vertex)).map(|(_, share)| 0.5 * share);
        let share: f64 = of_ends.sum();
        if share > 0.0 {
            shares.push((middle, share));
        }
    }
    let beside = |t: &&mut [u32; 3]| t.contains(&a) && t.contains(&b);
    let with = |t: [u32; 3], from: u32| t.map(|corner| if corner == from { middle } else { corner });
    let mut halves = Vec::new();
    for triangle in mesh.triangles.iter_mut().filter(beside) {
        halves.push(with(*triangle, a));
        *triangle = with(*triangle, b);
    }
    mesh.triangles.extend(halves);
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
    let seen = Observation { frame: 0, time_s: 0.0, silhouettes: silhouettes.collect(), moment: None, keypoints: None };
    let mut likelihood = SilhouetteLikelihood::new(body, &rig, SilhouetteSettings::default()).expect("valid settings");
    likelihood.prepare(&seen).expect("fits the body");
    let mut scratch = likelihood.scratch();
    bencher.counter(ItemsCount::new(rig.cameras.len())).bench_local(|| likelihood.energy(&pose, &mut scratch));
}
