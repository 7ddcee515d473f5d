//! Checks energies and descents against hand-computed values, finite differences and known poses.

use super::*;
use crate::motion_model::{Diffusion, DiffusionSettings};
use crate::tracker::fixture::{March, apart_mm, ring, seen, seen_keypoints};
use crate::tracker::{
    AnnealedParticleFilter, CombinedLikelihood, FilterSettings, Refinement, RefinementSettings, SilhouetteLikelihood,
    SilhouetteSettings, Tracker,
};
use skiagraph_core::body::{ProposalScales, shipped};
use skiagraph_core::camera::Distortion;

const MARCH: March = March { cycle: 20, advance: 0.03, hip: 0.1, knee: 0.6, abduction: 0.3, elbow: 0.5 };
const LAYOUT: KeypointLayout = KeypointLayout::Halpe26;

fn rig() -> CameraRig {
    let mut rig = ring(3, 4.0, [320, 240]);
    rig.cameras[1].distortion = Distortion { k1: -0.1, k2: 0.02, p1: 0.001, p2: -0.001, k3: 0.0 };
    rig
}

fn likelihood(body: &Humanoid, observation: &Observation) -> KeypointLikelihood {
    let settings = KeypointEvidenceSettings { deviation_px: 3.0, ..KeypointEvidenceSettings::default() };
    let mut likelihood = KeypointLikelihood::new(body.clone(), &rig(), LAYOUT, settings).unwrap();
    likelihood.prepare(observation).unwrap();
    likelihood
}

#[test]
fn the_energy_is_zero_at_the_seen_pose_and_weighs_offsets_by_confidence_up_to_one_each() {
    let body = shipped("tracker25").unwrap();
    let pose = MARCH.pose(&body, 3);
    let mut observation = seen_keypoints(&body, LAYOUT, &pose, &rig(), 0);
    let energy =
        |observation: &Observation| likelihood(&body, observation).energy(&pose, &mut KeypointScratch::default());
    assert!(energy(&observation) < 1e-12);
    let keypoints = observation.keypoints.as_mut().unwrap();
    keypoints.views.iter_mut().for_each(|view| view.truncate(26));
    for view in &mut keypoints.views {
        view.iter_mut().for_each(|found| *found = None);
    }
    let shown = |index: usize, camera: usize, aside: f64, confidence| {
        let place = body.keypoint_places(LAYOUT)[index].unwrap().point;
        let place = body.link_frames(&pose)[place.link] * place.point_in_link;
        let pixel = rig().cameras[camera].project(&place).unwrap();
        Some(skiagraph_core::observation::FoundKeypoint { pixel: [pixel.x + aside, pixel.y], confidence })
    };
    let wrist = 9;
    keypoints.views[0][wrist] = shown(wrist, 0, 12.0, 1.0);
    assert!((energy(&observation) - 0.5).abs() < 1e-9, "half the width of 4 deviations of 3 px is half the error");
    let views = &mut observation.keypoints.as_mut().unwrap().views;
    views[0][wrist] = shown(wrist, 0, 1e9, 0.25);
    views[2][13] = shown(13, 2, 0.0, 0.75);
    assert!((energy(&observation) - 0.25).abs() < 1e-9);
    observation.keypoints.as_mut().unwrap().views[0][wrist] = shown(wrist, 0, 1e9, 0.05);
    assert!(energy(&observation) < 1e-12, "below the least confidence");
}

#[test]
fn the_gradient_of_the_equations_is_that_of_the_squared_offsets() {
    let body = shipped("tracker25").unwrap();
    let (seen_at, pose) = (MARCH.pose(&body, 3), MARCH.pose(&body, 4));
    let likelihood = likelihood(&body, &seen_keypoints(&body, LAYOUT, &seen_at, &rig(), 0));
    let equations = |pose: &Pose| likelihood.linearise(pose, 1e6, &mut KeypointScratch::default()).unwrap();
    let here = equations(&pose);
    assert_eq!(here.residuals, 2 * 3 * 26);
    for number in 0..body.step_len() {
        let cost = |size: f64| {
            let mut step = vec![0.0; body.step_len()];
            step[number] = size;
            equations(&body.step(&pose, &step)).cost
        };
        let slope = (cost(1e-5) - cost(-1e-5)) / 2e-5;
        let expected = 2.0 * here.gradient[number];
        assert!((slope - expected).abs() < 1e-4 * (1.0 + expected.abs()), "{number}: {slope} {expected}");
    }
}

/// Mean error over a march, millimetres, with exact keypoints, silhouettes, or both.
fn march_mm(source: impl Fn(SilhouetteLikelihood, KeypointLikelihood) -> CombinedLikelihood) -> f64 {
    let (body, rig) = (shipped("tracker25").unwrap(), rig());
    let silhouettes = SilhouetteLikelihood::new(body.clone(), &rig, SilhouetteSettings::default()).unwrap();
    let settings = KeypointEvidenceSettings { deviation_px: 1.0, ..KeypointEvidenceSettings::default() };
    let keypoints = KeypointLikelihood::new(body.clone(), &rig, LAYOUT, settings).unwrap();
    let scales = ProposalScales::for_human(&body, 30.0);
    let model = Diffusion::new(body.clone(), &scales, &DiffusionSettings::default()).unwrap();
    let filter = FilterSettings { particles: 20, layers: 2, ..FilterSettings::default() };
    let refinement = Refinement::new(RefinementSettings::default(), &body, Vec::new(), 1).unwrap();
    let likelihood = source(silhouettes.with_descent(), keypoints);
    let filter = AnnealedParticleFilter::new(filter, model, likelihood, 1).unwrap();
    let mut filter = filter.with_refinement(refinement).unwrap();
    filter.start(&MARCH.pose(&body, 0));
    let mut sum = 0.0;
    for frame in 0..8 {
        let pose = MARCH.pose(&body, frame);
        let silhouettes = seen(&body, &pose, &rig, frame).silhouettes;
        let observation = Observation { silhouettes, ..seen_keypoints(&body, LAYOUT, &pose, &rig, frame) };
        sum += apart_mm((&body, &filter.track(&observation).unwrap().pose), (&body, &pose)) / 8.0;
    }
    sum
}

#[test]
fn exact_keypoints_are_followed_alone_and_improve_silhouettes() {
    let keypoints = march_mm(|_, keypoints| CombinedLikelihood::Keypoints(keypoints));
    let silhouettes = march_mm(|silhouettes, _| CombinedLikelihood::Silhouettes(silhouettes));
    let both = march_mm(CombinedLikelihood::Both);
    assert!(keypoints < 1.0, "{keypoints} {silhouettes} {both}");
    assert!(both < silhouettes && silhouettes < 20.0, "{keypoints} {silhouettes} {both}");
}

#[test]
fn the_offset_of_a_detectors_definition_is_learned_on_the_link() {
    let body = shipped("tracker25").unwrap();
    let mut detector = body.clone();
    let hip = skiagraph_core::body::Landmark::LeftHip as usize;
    let moved = Vector3::new(0.02, 0.03, -0.01);
    detector.markers[hip].as_mut().unwrap().point_in_link += moved;
    let mut likelihood = KeypointLikelihood::new(body.clone(), &rig(), LAYOUT, Default::default()).unwrap();
    let before = likelihood.points.clone();
    for frame in 0..600 {
        let pose = MARCH.pose(&body, frame % 20);
        likelihood.prepare(&seen_keypoints(&detector, LAYOUT, &pose, &rig(), frame)).unwrap();
        likelihood.learn_offsets(&pose);
    }
    let learned = |index: usize| likelihood.points[index].unwrap().point_in_link - before[index].unwrap().point_in_link;
    assert!((learned(11) - moved).norm() < 0.003, "{}", learned(11));
    assert!(learned(13).norm() < 1e-6);
    let mut one_view = seen_keypoints(&detector, LAYOUT, &MARCH.pose(&body, 0), &rig(), 0);
    one_view.keypoints.as_mut().unwrap().views[1..].iter_mut().flatten().for_each(|found| *found = None);
    likelihood.prepare(&one_view).unwrap();
    let points = likelihood.points.clone();
    likelihood.learn_offsets(&MARCH.pose(&body, 5));
    assert_eq!(likelihood.points, points);
}

#[test]
fn observations_without_keypoints_are_refused() {
    let body = shipped("tracker25").unwrap();
    let pose = MARCH.pose(&body, 0);
    let settings = KeypointEvidenceSettings::default();
    let mut likelihood = KeypointLikelihood::new(body.clone(), &rig(), KeypointLayout::Coco17, settings).unwrap();
    let refused = likelihood.prepare(&seen_keypoints(&body, LAYOUT, &pose, &rig(), 0)).unwrap_err().to_string();
    assert!(refused.contains("halpe26 in 3 views, expected coco17 in 3"), "{refused}");
    let refused = likelihood.prepare(&seen(&body, &pose, &rig(), 0)).unwrap_err().to_string();
    assert!(refused.contains("it has no keypoints"), "{refused}");
}
