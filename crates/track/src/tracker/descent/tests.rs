//! Checks derivatives against finite differences and outlines against rendered masks, and recovers displaced poses.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::*;
use crate::motion_model::{Diffusion, DiffusionSettings, MotionModel};
use crate::tracker::fixture;
use crate::tracker::{Likelihood, SilhouetteLikelihood, SilhouetteSettings};
use skiagraph_core::body::{Link, Pose, ProposalScales, Solid, draw_silhouette};
use skiagraph_core::camera::{CameraRig, Distortion};
use skiagraph_core::observation::Observation;
use skiagraph_core::raster::{DistanceMap, TaperedCapsule, contour};

fn ring(count: u32, image_size: [u32; 2]) -> CameraRig {
    fixture::ring(count, 3.5, image_size)
}

/// Striding, with the arms away from the trunk: all limbs are visible, and no angle is at a limit.
fn standing(body: &Humanoid) -> Pose {
    let mut pose = body.zero_pose();
    pose.world_from_root = Isometry3::new(Vector3::new(0.05, -0.1, 0.93), Vector3::z() * 0.4);
    for (side, sign) in [("left", 1.0), ("right", -1.0)] {
        let legs = [("hip_flexion", 0.2 + 0.3 * sign), ("hip_abduction", 0.1), ("knee_flexion", 0.5 - 0.3 * sign)];
        let arms = [("shoulder_flexion", -0.3 * sign), ("shoulder_abduction", 0.6), ("elbow_flexion", 0.8)];
        for (name, angle) in legs.into_iter().chain(arms) {
            if let Some(number) = body.find_degree_of_freedom(&format!("{side}_{name}")) {
                pose.joint_angles[number] = angle;
            }
        }
    }
    pose
}

fn seen(body: &Humanoid, pose: &Pose, rig: &CameraRig) -> Observation {
    fixture::seen(body, pose, rig, 0)
}

fn diffusion(body: &Humanoid) -> Diffusion {
    Diffusion::new(body.clone(), &ProposalScales::for_human(body, 60.0), &DiffusionSettings::default()).unwrap()
}

fn likelihood(body: &Humanoid, rig: &CameraRig, seen: &Observation) -> SilhouetteLikelihood {
    let likelihood = SilhouetteLikelihood::new(body.clone(), rig, SilhouetteSettings::default());
    let mut likelihood = likelihood.unwrap().with_descent();
    likelihood.prepare(seen).unwrap();
    likelihood
}

/// The pose after `steps` descent steps of decreasing width from `pose`.
fn descended(likelihood: &SilhouetteLikelihood, body: &Humanoid, pose: &Pose, steps: usize) -> Pose {
    let (model, mut scratch, mut now) = (diffusion(body), likelihood.scratch(), pose.clone());
    for step in 0..steps {
        let width = 8.0 * (1.5_f64 / 8.0).powf(step as f64 / (steps - 1) as f64);
        let evidence = likelihood.linearise(&now, width, &mut scratch).unwrap();
        now = model.descend(&now, pose, evidence).unwrap();
    }
    now
}

fn apart_mm(body: &Humanoid, a: &Pose, b: &Pose) -> f64 {
    fixture::apart_mm((body, a), (body, b))
}

/// `pose` with every component of a step displaced by `by`, with mixed signs.
fn off(body: &Humanoid, pose: &Pose, by: f64) -> Pose {
    let sign = |i: usize| if i.is_multiple_of(3) { -1.0 } else { 1.0 };
    let step: Vec<f64> = (0..body.step_len()).map(|i| by * sign(i) * if i < 3 { 0.3 } else { 1.0 }).collect();
    body.step(pose, &step)
}

/// tracker25 with most capsules replaced by boxes, cylinders and meshes.
fn of_other_solids() -> Humanoid {
    let mut body = Humanoid::tracker25().unwrap();
    let solids: Vec<&mut Solid> = body.links.iter_mut().flat_map(|link: &mut Link| &mut link.solids).collect();
    for (index, solid) in solids.into_iter().enumerate() {
        let Solid::TaperedCapsule(TaperedCapsule { a, b, radius_a, radius_b }) = solid.clone() else { continue };
        let (along, radius) = (b - a, 0.5 * (radius_a + radius_b));
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along).unwrap_or_else(UnitQuaternion::identity);
        let frame = Isometry3::from_parts(nalgebra::center(&a, &b).coords.into(), turn);
        let half = 0.5 * along.norm() + 0.5 * radius;
        *solid = match index % 4 {
            0 => continue,
            1 => Solid::Box { link_from_box: frame, half_extents: [radius, 0.8 * radius, half] },
            2 => Solid::Cylinder { link_from_cylinder: frame, radius, half_length: half },
            _ => octahedron(&frame, [1.3 * radius, radius, 1.2 * half]),
        };
    }
    body
}

/// A closed mesh of eight triangles.
fn octahedron(frame: &Isometry3<f64>, half: [f64; 3]) -> Solid {
    let tip = |axis: usize, sign: f64| {
        let mut p = Point3::origin();
        p[axis] = sign * half[axis];
        frame * p
    };
    let vertices = (0..3).flat_map(|axis| [tip(axis, 1.0), tip(axis, -1.0)]).collect();
    // tips: +x, -x, +y, -y, +z, -z
    let triangles = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    Solid::Mesh { vertices, triangles }
}

/// The samples of one camera that lie on the drawn contour.
fn samples(body: &Humanoid, pose: &Pose, camera: &Camera) -> (Vec<OutlineSample>, Mask) {
    let frames = body.link_frames(pose);
    let mut drawn = Mask::new(camera.pinhole.width, camera.pinhole.height);
    draw_silhouette(body, &frames, camera, &mut drawn);
    let (outline, spacing, mut samples) = (BodyOutline::new(body), SAMPLE_SPACING[1] * length_px(camera), Vec::new());
    outline.sample(body, &frames, camera, spacing, Some(&drawn), &mut samples);
    (samples, drawn)
}

#[test]
fn samples_cover_the_drawn_contour_for_all_solids() {
    for body in [Humanoid::tracker25().unwrap(), skiagraph_core::body::shipped("actor").unwrap(), of_other_solids()] {
        for camera in &ring(3, [640, 480]).cameras {
            let (samples, drawn) = samples(&body, &standing(&body), camera);
            let edge = contour(&drawn);
            let map = DistanceMap::new(&edge);
            let off_edge = |s: &&OutlineSample| map.distance(s.pixel[0] as u32, s.pixel[1] as u32) > 2.0;
            let strays = samples.iter().filter(off_edge).count();
            // A sample may border on a gap between its solid and another one.
            assert!(strays * 100 <= samples.len(), "{}: {strays} of {} samples", body.name, samples.len());
            let near = |(x, y): (u32, u32)| {
                let far = |s: &OutlineSample| (s.pixel[0] - f64::from(x) - 0.5).hypot(s.pixel[1] - f64::from(y) - 0.5);
                samples.iter().map(far).fold(f64::INFINITY, f64::min) < SAMPLE_SPACING[1] * length_px(camera) + 1.5
            };
            let missed = edge.pixels().filter(|pixel| !near(*pixel)).count() as u64;
            assert!(missed * 50 <= edge.count(), "{}: {missed} of {} contour pixels", body.name, edge.count());
        }
    }
}

#[test]
fn normals_of_samples_point_out_of_the_silhouette() {
    for body in [Humanoid::tracker25().unwrap(), of_other_solids()] {
        let camera = &ring(3, [640, 480]).cameras[1];
        let (samples, drawn) = samples(&body, &standing(&body), camera);
        let inward = |s: &&OutlineSample| {
            let [u, v] = [0, 1].map(|i| s.pixel[i] - 1.5 * s.normal[i]);
            drawn.get(u as u32, v as u32)
        };
        // thin tips are exceptions
        assert!(samples.iter().filter(inward).count() * 100 >= 97 * samples.len(), "{}", body.name);
    }
}

#[test]
fn residual_derivatives_agree_with_finite_differences_for_every_component_of_a_step() {
    let body = Humanoid::tracker25().unwrap();
    let pose = standing(&body);
    let frames = body.link_frames(&pose);
    for camera in &ring(2, [320, 240]).cameras {
        let length = length_px(camera);
        for sample in samples(&body, &pose, camera).0.iter().step_by(37) {
            let gradient = [0.8, -0.6];
            let residual = observed::OutlineResidual { value: 2.5, gradient, outline: 1.0 };
            let mut equations = Accumulator::new(body.links.len(), Point3::new(0.3, 0.2, 0.1));
            equations.add(camera, sample, residual, length, 1e9, 1.0);
            let equations = equations.finish(&body, &frames);
            let point_in_link = frames[sample.link].inverse() * (camera.camera_from_world.inverse() * sample.point);
            let pixel = |pose: &Pose| {
                let point = body.link_frames(pose)[sample.link] * point_in_link;
                camera.project(&point).unwrap()
            };
            let h = 1e-5;
            for number in 0..body.step_len() {
                let moved = |by: f64| {
                    let mut step = vec![0.0; body.step_len()];
                    step[number] = by;
                    pixel(&body.step(&pose, &step))
                };
                let along = (moved(h) - moved(-h)) / (2.0 * h);
                let slope = (gradient[0] * along.x + gradient[1] * along.y) / length;
                let found = equations.gradient[number];
                assert!((found - 2.5 * slope).abs() < 1e-6 * (1.0 + slope.abs()), "{number}: {found} {slope}");
                let square = equations.matrix[(number, number)];
                assert!((square - slope * slope).abs() < 1e-5 * (1.0 + square), "{number}: {square} {slope}");
            }
            assert!((equations.cost - 6.25).abs() < 1e-12 && equations.residuals == 1);
            assert!((&equations.matrix - equations.matrix.transpose()).abs().max() < 1e-9 * equations.matrix.norm());
        }
    }
}

#[test]
fn dense_residuals_weigh_as_much_as_sparse_ones_so_that_a_prior_does_too() {
    let body = Humanoid::tracker25().unwrap();
    let (truth, rig) = (standing(&body), ring(4, [640, 480]));
    let likelihood = likelihood(&body, &rig, &seen(&body, &truth, &rig));
    let [dense, sparse] =
        [NARROW - 1e-9, NARROW].map(|width| likelihood.linearise(&truth, width, &mut likelihood.scratch()).unwrap());
    assert!(dense.residuals as f64 > 1.7 * sparse.residuals as f64, "{} {}", dense.residuals, sparse.residuals);
    assert!((dense.weight / sparse.weight - 1.0).abs() < 0.1, "{} {}", dense.weight, sparse.weight);
    let trace = dense.matrix.trace() / sparse.matrix.trace();
    assert!((trace - 1.0).abs() < 0.1, "{trace}");
}

#[test]
fn a_pose_displaced_by_a_tenth_of_a_radian_is_recovered_for_all_solids() {
    for (body, within_mm) in [(Humanoid::tracker25().unwrap(), 4.0), (of_other_solids(), 6.0)] {
        let (truth, rig) = (standing(&body), ring(4, [320, 240]));
        let likelihood = likelihood(&body, &rig, &seen(&body, &truth, &rig));
        for by in [0.05, -0.05, 0.1] {
            let start = off(&body, &truth, by);
            // 0.1 rad displaces markers by 110 mm: the first steps are short, and shorter for solids other than
            // capsules
            let found = descended(&likelihood, &body, &start, 16);
            let (before, after) = (apart_mm(&body, &truth, &start), apart_mm(&body, &truth, &found));
            assert!(before > 8.0 * within_mm && after < within_mm, "{}, {by}: {before:.1} to {after:.1} mm", body.name);
        }
    }
}

#[test]
fn a_pose_is_recovered_through_barrel_and_pincushion_lenses() {
    let body = Humanoid::tracker25().unwrap();
    let truth = standing(&body);
    for k1 in [-0.25, 0.25] {
        let mut rig = ring(4, [320, 240]);
        rig.cameras.iter_mut().for_each(|camera| camera.distortion = Distortion { k1, ..Distortion::default() });
        let likelihood = likelihood(&body, &rig, &seen(&body, &truth, &rig));
        let found = descended(&likelihood, &body, &off(&body, &truth, 0.08), 8);
        let error = apart_mm(&body, &truth, &found);
        assert!(error < 6.0, "k1 = {k1}: {error:.1} mm");
    }
}

#[test]
fn a_body_cropped_by_the_image_is_not_pulled_to_its_edge() {
    let body = Humanoid::tracker25().unwrap();
    let truth = standing(&body);
    let mut rig = ring(4, [320, 240]);
    // Longer focal lengths: head and shanks are outside every image.
    rig.cameras.iter_mut().for_each(|camera| camera.pinhole.focal = camera.pinhole.focal.map(|f| 2.2 * f));
    let observation = seen(&body, &truth, &rig);
    let cut = |mask: &Mask| mask.runs(0).count() > 0 && mask.runs(mask.height() - 1).count() > 0;
    assert!(observation.silhouettes.iter().all(cut), "the test cuts the body above and below");
    let likelihood = likelihood(&body, &rig, &observation);
    let found = descended(&likelihood, &body, &truth, 6);
    let error = apart_mm(&body, &truth, &found);
    assert!(error < 5.0, "the true pose stays within {error:.1} mm");
}

#[test]
fn empty_and_full_masks_leave_the_pose_unchanged() {
    let body = Humanoid::tracker25().unwrap();
    let (pose, rig) = (standing(&body), ring(2, [160, 120]));
    for full in [false, true] {
        let mask = || Mask::from_fn(160, 120, |_, _| full);
        let silhouettes = vec![mask(), mask()];
        let blank = Observation { frame: 0, time_s: 0.0, silhouettes, moment: None, keypoints: None };
        let likelihood = likelihood(&body, &rig, &blank);
        let evidence = likelihood.linearise(&pose, 3.0, &mut likelihood.scratch()).unwrap();
        assert_eq!((evidence.residuals, evidence.cost), (0, 0.0));
        assert_eq!(descended(&likelihood, &body, &pose, 4), pose);
    }
}

#[test]
fn a_blank_view_does_not_affect_the_others() {
    let body = Humanoid::tracker25().unwrap();
    let (truth, rig) = (standing(&body), ring(4, [320, 240]));
    let mut observation = seen(&body, &truth, &rig);
    observation.silhouettes[2].clear();
    let likelihood = likelihood(&body, &rig, &observation);
    let found = descended(&likelihood, &body, &off(&body, &truth, 0.05), 8);
    assert!(apart_mm(&body, &truth, &found) < 4.0);
}

#[test]
fn pinholes_and_specks_in_the_masks_hardly_change_the_pose() {
    let body = Humanoid::tracker25().unwrap();
    let (truth, rig) = (standing(&body), ring(4, [320, 240]));
    let mut observation = seen(&body, &truth, &rig);
    for mask in &mut observation.silhouettes {
        let spoilt: Vec<(u32, u32)> = (0..320).flat_map(|x| (0..240).map(move |y| (x, y))).collect();
        for (x, y) in spoilt.into_iter().filter(|(x, y)| (x * 31 + y * 17) % 97 == 0) {
            mask.set(x, y, !mask.get(x, y));
        }
    }
    let likelihood = likelihood(&body, &rig, &observation);
    let found = descended(&likelihood, &body, &off(&body, &truth, 0.05), 8);
    let error = apart_mm(&body, &truth, &found);
    assert!(error < 6.0, "{error:.1} mm");
}

#[test]
fn a_single_solid_is_aligned() {
    let ball = Solid::TaperedCapsule(TaperedCapsule {
        a: Point3::new(0.0, 0.0, -0.3),
        b: Point3::new(0.0, 0.0, 0.4),
        radius_a: 0.2,
        radius_b: 0.1,
    });
    let body = Humanoid {
        name: "one".into(),
        links: vec![Link { name: "one".into(), solids: vec![ball], inertia: None }],
        joints: Vec::new(),
        degrees_of_freedom: Vec::new(),
        markers: [None; 15],
        skin: None,
        notes: Vec::new(),
    };
    let mut truth = body.zero_pose();
    truth.world_from_root.translation.z = 1.0;
    let rig = ring(3, [320, 240]);
    let likelihood = likelihood(&body, &rig, &seen(&body, &truth, &rig));
    let found = descended(&likelihood, &body, &off(&body, &truth, 0.1), 8);
    let tip = |pose: &Pose| pose.world_from_root * Point3::new(0.0, 0.0, 0.4);
    assert!((tip(&found) - tip(&truth)).norm() < 0.004, "{}", (tip(&found) - tip(&truth)).norm());
}

#[test]
fn a_body_out_of_sight_and_one_behind_the_camera_have_no_residuals() {
    let body = Humanoid::tracker25().unwrap();
    let rig = ring(2, [160, 120]);
    let likelihood = likelihood(&body, &rig, &seen(&body, &standing(&body), &rig));
    for at in [[0.0, 0.0, 50.0], [100.0, 70.0, 0.0], [2.5, 2.5, 1.6]] {
        let mut pose = standing(&body);
        pose.world_from_root.translation.vector = at.into();
        let evidence = likelihood.linearise(&pose, 8.0, &mut likelihood.scratch()).unwrap();
        assert!(evidence.matrix.iter().chain(&evidence.gradient).all(|number| number.is_finite()), "{at:?}");
        let next = diffusion(&body).descend(&pose, &pose, evidence).unwrap();
        assert!(next.joint_angles.iter().all(|angle| angle.is_finite()));
    }
    let mut lost = standing(&body);
    lost.world_from_root.translation.x = f64::NAN;
    assert!(likelihood.linearise(&lost, 8.0, &mut likelihood.scratch()).is_none());
}

#[test]
fn angles_at_their_limit_and_angles_with_an_empty_range_do_not_move() {
    let mut body = Humanoid::tracker25().unwrap();
    let elbow = body.find_degree_of_freedom("left_elbow_flexion").unwrap();
    let knee = body.find_degree_of_freedom("right_knee_flexion").unwrap();
    let (truth, rig) = (standing(&body), ring(4, [320, 240]));
    let observation = seen(&body, &truth, &rig);
    let mut start = off(&body, &truth, 0.05);
    (body.degrees_of_freedom[elbow].lower, body.degrees_of_freedom[elbow].upper) = (0.1, 0.1);
    body.degrees_of_freedom[knee].upper = truth.joint_angles[knee] - 0.1;
    body.clamp_to_limits(&mut start);
    let likelihood = likelihood(&body, &rig, &observation);
    let found = descended(&likelihood, &body, &start, 8);
    assert_eq!(found.joint_angles[elbow], 0.1);
    assert_eq!(found.joint_angles[knee], body.degrees_of_freedom[knee].upper, "it is pushed to its limit and held");
    let other = body.find_degree_of_freedom("left_knee_flexion").unwrap();
    assert!((found.joint_angles[other] - truth.joint_angles[other]).abs() < 0.05, "the others go where they belong");
}

#[test]
fn reused_scratch_gives_bit_identical_results() {
    let body = Humanoid::tracker25().unwrap();
    let (truth, rig) = (standing(&body), ring(3, [160, 120]));
    let likelihood = likelihood(&body, &rig, &seen(&body, &truth, &rig));
    let mut used = likelihood.scratch();
    for by in [0.3, -0.2, 0.05] {
        let pose = off(&body, &truth, by);
        let fresh = likelihood.linearise(&pose, 3.0, &mut likelihood.scratch());
        assert_eq!(likelihood.linearise(&pose, 3.0, &mut used), fresh);
    }
}
