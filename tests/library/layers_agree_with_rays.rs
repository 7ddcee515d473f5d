//! Every layer of 100 random views agrees with rays cast one by one, by code that shares nothing with the renderer:
//! kinematics with matrices, skins blended vertex by vertex, solids as signed distances that a ray approaches step by
//! step, skins as triangle meshes of parry, lenses inverted by Newton's method on OpenCV's formula.
//!
//! The shipped robots and skins take random poses, in some views among props; cameras are far, near, or look past the
//! body, half of them with lens distortion.

use crate::ray_scene::{Hit, PlainCamera, RayScene};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use skiagraph_core::body::{Humanoid, LANDMARKS, Motion, Pose, Prop, Solid, shipped, shipped_skin};
use skiagraph_core::camera::{Camera, CameraRig, Distortion, FieldOfView};
use skiagraph_core::raster::TaperedCapsule;
use skiagraph_core::rng::{Purpose, stream};
use skiagraph_truth::observing::{TruthImageObserver, TruthImages, WantedTruthImages};
use skiagraph_truth::retarget::with_skin;
use skiagraph_truth::scene::{GroundTruth, Occluders, Sight};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;
/// One of this many pixels is compared.
const STEP: usize = 3;

/// A pixel lies on an edge if rays this far from its centre, pixels, meet another surface.
const EDGE_PX: f64 = 0.05;

fn bodies() -> Vec<Humanoid> {
    let dressed = |robot: &str, skin: &str| with_skin(&shipped(robot).unwrap(), &shipped_skin(skin).unwrap()).unwrap();
    let plain = ["actor", "tracker25", "tracker40"].map(|robot| shipped(robot).unwrap());
    plain.into_iter().chain([dressed("actor", "person"), dressed("actor", "person_coarse")]).collect()
}

/// Two poses, the second one frame later; angles are within the limits, or within a radian if there are none.
fn poses(body: &Humanoid, random: &mut ChaCha8Rng) -> Motion {
    let mut pose = body.zero_pose();
    for (angle, freedom) in pose.joint_angles.iter_mut().zip(&body.degrees_of_freedom) {
        let (low, high) = (freedom.lower.max(-1.0), freedom.upper.min(1.2).max(freedom.lower.max(-1.0)));
        *angle = 0.8 * (low + (high - low) * random.random::<f64>());
    }
    let turned = |random: &mut ChaCha8Rng, limit: f64| {
        UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| random.random_range(-limit..limit)))
    };
    let place = Translation3::new(random.random_range(-1.0..1.0), random.random_range(-1.0..1.0), 1.0);
    pose.world_from_root = Isometry3::from_parts(place, turned(random, 1.0));
    let mut next: Pose = pose.clone();
    next.joint_angles.iter_mut().for_each(|angle| *angle += random.random_range(-0.12..0.12));
    let step = Translation3::new(0.03, random.random_range(-0.02..0.02), 0.01);
    next.world_from_root = Isometry3::from_parts(place * step, turned(random, 0.06) * pose.world_from_root.rotation);
    Motion { frames_per_second: 30.0, poses: vec![pose, next] }
}

/// A third of the cameras are far, a third near, and a third look past the body.
fn camera(index: u64, body: &Point3<f64>, random: &mut ChaCha8Rng) -> Camera {
    let azimuth = random.random_range(0.0..std::f64::consts::TAU);
    let distance = if index % 3 == 1 { random.random_range(0.9..1.4) } else { random.random_range(2.0..6.0) };
    let away = Vector3::new(azimuth.cos(), azimuth.sin(), random.random_range(-0.3..0.6)) * distance;
    let past = if index % 3 == 2 { 0.28 * distance } else { 0.1 };
    let target = body + Vector3::from_fn(|_, _| random.random_range(-past..past));
    let view = FieldOfView::Vertical(random.random_range(0.5..1.0));
    let mut camera = Camera::look_at("c", body + away, target, Vector3::z(), view, WIDTH, HEIGHT).unwrap();
    camera.pinhole.focal[1] *= 1.03;
    camera.pinhole.principal_point = [0.52 * f64::from(WIDTH), 0.49 * f64::from(HEIGHT)];
    if index % 2 == 1 {
        let mut symmetric = |limit: f64| random.random_range(-limit..limit);
        camera.distortion = Distortion::from_coefficients([
            symmetric(0.2),
            symmetric(0.05),
            symmetric(0.004),
            symmetric(0.004),
            symmetric(0.01),
        ]);
    }
    camera
}

/// In every fourth view, a solid between body and camera.
fn props(index: u64, body: &Point3<f64>, camera: &Camera, random: &mut ChaCha8Rng) -> Vec<Prop> {
    if !index.is_multiple_of(4) {
        return Vec::new();
    }
    let beside = Vector3::from_fn(|_, _| random.random_range(-0.3..0.3));
    let place = Translation3::from(body.coords.lerp(&camera.centre().coords, 0.4) + beside);
    let frame = Isometry3::from_parts(place, UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.9, -0.3)));
    let solid = match index / 4 % 3 {
        0 => Solid::Box { link_from_box: frame, half_extents: [0.15, 0.1, 0.2] },
        1 => Solid::Cylinder { link_from_cylinder: frame, radius: 0.12, half_length: 0.25 },
        _ => {
            let ends = [-0.2, 0.2].map(|z| frame * Point3::new(0.0, 0.0, z));
            Solid::TaperedCapsule(TaperedCapsule { a: ends[0], b: ends[1], radius_a: 0.1, radius_b: 0.15 })
        }
    };
    vec![Prop { name: "occluder".into(), solid }]
}

/// Counts of comparisons and differences.
#[derive(Debug, Default)]
struct Tally {
    pixels: usize,
    shown: usize,
    /// Pixels away from edges at which renderer and ray see different parts.
    other_part: usize,
    on_edges: usize,
    worst_depth_m: f64,
    worst_normal_deg: f64,
    worst_flow_px: f64,
    flows: usize,
    coverages: usize,
    other_coverage: usize,
    flags: usize,
    other_flags: usize,
    by_sight: [usize; 4],
}

impl Tally {
    fn compare(&mut self, layers: &TruthImages, scene: &RayScene<'_>, camera: &PlainCamera) {
        for (y, x) in (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (y, x))).step_by(STEP) {
            let (index, at) = ((y * WIDTH + x) as usize, [f64::from(x) + 0.5, f64::from(y) + 0.5]);
            let hit = scene.cast_pixel(camera, at);
            self.pixels += 1;
            if hit.is_none() && layers.depth.part[index] == 0 {
                continue;
            }
            self.shown += 1;
            let around = [[EDGE_PX, 0.0], [-EDGE_PX, 0.0], [0.0, EDGE_PX], [0.0, -EDGE_PX]];
            let around = around.map(|[dx, dy]| scene.cast_pixel(camera, [at[0] + dx, at[1] + dy]));
            let smooth = around.iter().all(|near| is_of_one_surface(hit.as_ref(), near.as_ref()));
            if !smooth {
                self.on_edges += 1;
                continue;
            }
            let is_drawn = |(part, _): &&(usize, Point3<f64>)| *part as u32 + 1 == layers.depth.part[index];
            let same = hit.as_ref().and_then(|hit| Some((hit, hit.parts.iter().find(is_drawn)?)));
            let Some((hit, (_, next))) = same else {
                self.other_part += 1;
                continue;
            };
            self.surface(layers, index, hit);
            if let Some([u, v]) = camera.project(next) {
                let [du, dv] = layers.flow[index].map(f64::from);
                let off = ((u - at[0] - du).powi(2) + (v - at[1] - dv).powi(2)).sqrt();
                assert!(!off.is_nan(), "no flow at {x}, {y}");
                self.worst_flow_px = self.worst_flow_px.max(off);
                self.flows += 1;
            }
        }
    }

    fn surface(&mut self, layers: &TruthImages, index: usize, hit: &Hit) {
        let off = (f64::from(layers.depth.depth[index]) - hit.depth).abs();
        self.worst_depth_m = self.worst_depth_m.max(off);
        let found = Vector3::from(layers.normals[index]).cast::<f64>();
        assert!((found.norm() - 1.0).abs() < 1e-6);
        // from sine and cosine, because a cosine alone is inexact for small angles
        let angle = found.cross(&hit.normal).norm().atan2(found.dot(&hit.normal)).to_degrees();
        self.worst_normal_deg = self.worst_normal_deg.max(angle);
    }

    /// Compares the coverage of some pixels with the share of sixteen rays.
    fn coverage(&mut self, layers: &TruthImages, scene: &RayScene<'_>, camera: &PlainCamera) {
        let partly = |index: &usize| layers.coverage[*index] > 0.0 && layers.coverage[*index] < 1.0;
        for index in (0..layers.coverage.len()).filter(partly).step_by(23) {
            let (x, y) = ((index as u32 % WIDTH) as f64, (index as u32 / WIDTH) as f64);
            let of_sample = |i: u32| [x + (f64::from(i % 4) + 0.5) / 4.0, y + (f64::from(i / 4) + 0.5) / 4.0];
            let hits = (0..16).filter(|i| scene.cast_pixel(camera, of_sample(*i)).is_some()).count();
            self.coverages += 1;
            self.other_coverage += usize::from((layers.coverage[index] * 16.0 - hits as f32).abs() > 0.5);
        }
    }

    fn sights(&mut self, truth: &GroundTruth, camera: &Camera, scene: &RayScene<'_>, plain: &PlainCamera) {
        let (actor, frame) = (&truth.actor, &truth.frames[0]);
        let occluders = Occluders::new(actor, &frame.link_frames, &truth.props);
        let lines = occluders.seen_by(camera);
        let mut compare = |point: &Point3<f64>, own: &[usize]| {
            let (found, expected) = (lines.to(point, own), scene.sight(plain, point, own));
            self.flags += 1;
            self.other_flags += usize::from(found as usize != expected);
            self.by_sight[expected] += 1;
            found
        };
        for (joint, point) in frame.joint_positions.iter().enumerate() {
            compare(point, &[actor.joints[joint].parent, joint + 1]);
        }
        for marker in 0..LANDMARKS.len() {
            let (Some(point), Some(own)) = (&frame.markers[marker], actor.markers[marker]) else { continue };
            let found = compare(point, &[own.link]);
            assert_eq!(frame.visible[0][marker], found == Sight::InView);
            assert_eq!(frame.in_view[0][marker], found != Sight::OutOfView);
        }
    }
}

/// Whether two rays meet the same surface without an edge between them.
fn is_of_one_surface(a: Option<&Hit>, b: Option<&Hit>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => a.surfaces.iter().any(|s| b.surfaces.contains(s)) && a.normal.dot(&b.normal) > 0.98,
        _ => false,
    }
}

#[test]
fn every_layer_of_a_hundred_random_views_agrees_with_rays() {
    let (bodies, wanted) =
        (bodies(), WantedTruthImages { depth: true, normals: true, flow: true, coverage: true, colour: None });
    let mut tally = Tally::default();
    for index in 0..100 {
        let mut random = stream(index, Purpose::Corruption, 15, 0, 0);
        let body = &bodies[index as usize % bodies.len()];
        let motion = poses(body, &mut random);
        let middle = Point3::from(motion.poses[0].world_from_root.translation.vector);
        let camera = camera(index, &middle, &mut random);
        let props = props(index, &middle, &camera, &mut random);
        let rig = CameraRig { cameras: vec![camera.clone()] };
        let truth = GroundTruth::among(body.clone(), &motion, &rig, props.clone(), Vec::new()).unwrap();
        let layers = TruthImageObserver::new(&truth, &rig, 0, wanted).look(0).unwrap();
        let scene = RayScene::new(body, &motion.poses, &props);
        let plain = PlainCamera::new(&camera);
        tally.compare(&layers, &scene, &plain);
        tally.coverage(&layers, &scene, &plain);
        tally.sights(&truth, &camera, &scene, &plain);
    }
    println!("{tally:#?}");
    assert!(tally.shown > 10_000 && tally.flows > 5_000 && tally.coverages > 500 && tally.flags > 4_000);
    assert!(tally.on_edges * 4 < tally.shown, "too many pixels lie on edges");
    assert!(tally.by_sight.iter().all(|count| *count > 50), "some kind of sight hardly occurs");
    assert!(tally.other_part * 2000 <= tally.shown);
    assert!(tally.other_coverage * 100 <= tally.coverages);
    assert!(tally.worst_depth_m < 1e-3);
    assert!(tally.worst_normal_deg < 0.5);
    assert!(tally.worst_flow_px < 0.1);
    assert!(tally.other_flags * 1000 <= tally.flags);
}
