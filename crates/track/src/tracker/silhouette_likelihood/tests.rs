//! Checks energies across comparison strategies, against hand-computed values and by symmetry.

use nalgebra::{Isometry3, Translation3, Vector3};

use super::*;
use crate::tracker::rectification::Rectification;
use crate::tracker::{ContourTerm, SilhouetteTerm, fixture};
use skiagraph_core::body::{Solid, draw_silhouette};
use skiagraph_core::camera::{Distortion, FieldOfView, Pinhole, RigMoment};
use skiagraph_core::raster::{Mask, Overlap};

fn body() -> Humanoid {
    Humanoid::tracker25().unwrap()
}

/// Upright above the world's origin, with arms and knees slightly bent.
fn standing() -> Pose {
    let body = body();
    let mut pose = body.zero_pose();
    pose.world_from_root.translation = Translation3::new(0.0, 0.0, 0.93);
    for (angle, dof) in pose.joint_angles.iter_mut().zip(&body.degrees_of_freedom) {
        *angle = (dof.lower + 0.4).clamp(dof.lower.max(-0.3), dof.upper.min(0.3));
    }
    pose
}

fn moved(by: [f64; 3]) -> Pose {
    let mut pose = standing();
    pose.world_from_root.translation.vector += Vector3::from(by);
    pose
}

fn camera(eye: [f64; 3], target: [f64; 3]) -> Camera {
    let view = FieldOfView::Vertical(2.0 * libm::atan(60.0 / 130.0));
    Camera::look_at(&format!("at {eye:?}"), eye.into(), target.into(), Vector3::z(), view, 160, 120).unwrap()
}

fn rig() -> CameraRig {
    let at = |x, y| camera([x, y, 1.4], [0.0, 0.0, 0.9]);
    CameraRig { cameras: vec![at(3.0, 0.0), at(0.0, 3.0), at(-2.0, -2.0)] }
}

#[test]
fn images_prepared_for_another_body_give_the_same_energies() {
    let other = skiagraph_core::body::shipped("tracker40").unwrap();
    let mut pose = other.zero_pose();
    pose.world_from_root.translation = Translation3::new(0.0, 0.05, 0.93);
    let (moved_m, turned_rad) = ([0.02, 0.0, 0.0], [0.01, 0.0, 0.02]);
    let correction = CameraCorrection { camera: String::new(), about_m: [0.0; 3], moved_m, turned_rad };
    for settings in every_setting().map(|settings| SilhouetteSettings { limb_side_weight: 0.3, ..settings }) {
        let corrected = || {
            let likelihood = SilhouetteLikelihood::new(other.clone(), &rig(), settings).unwrap();
            likelihood.with_corrected_cameras(std::slice::from_ref(&correction))
        };
        let (mut second, mut alone) = (corrected(), corrected());
        let mut first = SilhouetteLikelihood::new(body(), &rig(), settings).unwrap();
        for (frame, by) in [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]].into_iter().enumerate() {
            let observation = fixture::seen(&body(), &moved(by), &rig(), frame);
            first.prepare(&observation).unwrap();
            second.prepare_from(&mut first, &observation).unwrap();
            alone.prepare(&observation).unwrap();
            let energies =
                [&second, &alone].map(|likelihood| likelihood.energy_unrejected(&pose, &mut likelihood.scratch()));
            assert!(energies[0] > 0.0 && energies[0] == energies[1], "{energies:?}");
        }
    }
}

fn looking_away() -> Camera {
    camera([3.0, 0.0, 1.4], [9.0, 0.0, 1.4])
}

fn seen(body: &Humanoid, pose: &Pose, rig: &CameraRig) -> Observation {
    fixture::seen(body, pose, rig, 0)
}

fn energy(body: &Humanoid, rig: &CameraRig, settings: SilhouetteSettings, truth: &Pose, pose: &Pose) -> f64 {
    let mut likelihood = SilhouetteLikelihood::new(body.clone(), rig, settings).unwrap();
    likelihood.prepare(&seen(body, truth, rig)).unwrap();
    likelihood.energy(pose, &mut likelihood.scratch())
}

fn every_setting() -> impl Iterator<Item = SilhouetteSettings> {
    let terms = [SilhouetteTerm::Bidirectional, SilhouetteTerm::Overlap];
    terms.into_iter().flat_map(|silhouette| {
        let contours = [(ContourTerm::OneSided, 0.0), (ContourTerm::OneSided, 0.5), (ContourTerm::TwoSided, 0.5)];
        contours.map(|(contour, contour_weight)| SilhouetteSettings {
            silhouette,
            contour,
            contour_weight,
            ..Default::default()
        })
    })
}

#[test]
fn energy_is_zero_at_the_true_pose_and_grows_with_distance() {
    for settings in every_setting() {
        let at = |x| energy(&body(), &rig(), settings, &standing(), &moved([x, 0.0, 0.0]));
        assert_eq!(at(0.0), 0.0);
        let energies = [0.02, 0.1, 0.4].map(at);
        assert!(energies[0] > 0.0 && energies[0] < energies[1] && energies[1] < energies[2], "{energies:?}");
    }
}

#[test]
fn masks_are_doubted_only_beside_another_image() {
    let rig = fixture::ring(2, 3.5, [160, 120]);
    let pose = standing();
    let whole = fixture::seen(&body(), &pose, &rig, 0);
    let mut lacking = whole.clone();
    let mask = &whole.silhouettes[0];
    lacking.silhouettes[0] = Mask::from_fn(160, 120, |x, y| mask.get(x, y) && y > 60);
    let mut likelihood = SilhouetteLikelihood::new(body(), &rig, SilhouetteSettings::default()).unwrap().with_descent();
    likelihood.prepare(&lacking).unwrap();
    assert!(!likelihood.believe(), "nothing was learned yet");
    likelihood.start(&pose);
    assert!(likelihood.believe());
    likelihood.prepare(&lacking).unwrap();
    assert!(likelihood.believe(), "it remembers");
    // the other image is missing
    let camera_from_world = rig.cameras.iter().map(|camera| camera.camera_from_world).collect();
    let moment = Some(RigMoment { camera_from_world, exposed_s: vec![Some(0.0), None] });
    let alone = Observation { moment, ..lacking.clone() };
    likelihood.prepare(&alone).unwrap();
    assert!(!likelihood.believe(), "one camera is not contradicted");
    likelihood.prepare(&whole).unwrap();
    likelihood.start(&pose);
    assert!(!likelihood.believe(), "a new start forgets");
}

#[test]
fn area_terms_match_their_formulas() {
    let overlap = Overlap { both: 30, only_model: 10, only_observed: 20 };
    assert_eq!(SilhouetteTerm::Overlap.value(&overlap, MaskTrust::FULL), Some(0.5));
    assert_eq!(SilhouetteTerm::Bidirectional.value(&overlap, MaskTrust::FULL), Some(0.5 * (0.25 + 0.4)));
    let missed = Overlap { both: 0, only_model: 0, only_observed: 20 };
    assert_eq!(SilhouetteTerm::Overlap.value(&missed, MaskTrust::FULL), Some(1.0));
    assert_eq!(SilhouetteTerm::Bidirectional.value(&missed, MaskTrust::FULL), Some(1.0));
    assert_eq!(SilhouetteTerm::Overlap.value(&Overlap::default(), MaskTrust::FULL), None);
    // of a mask that is believed by half, half of what it lacks counts
    let doubted = MaskTrust { lacking: 0.5, extra: 1.0 };
    assert_eq!(SilhouetteTerm::Overlap.value(&overlap, doubted), Some(25.0 / 55.0));
    assert_eq!(SilhouetteTerm::Bidirectional.value(&overlap, doubted), Some(0.5 * (5.0 / 35.0 + 0.4)));
}

#[test]
fn the_weight_of_the_contour_is_linear() {
    let at = |contour_weight| {
        let settings = SilhouetteSettings { contour_weight, ..Default::default() };
        energy(&body(), &rig(), settings, &standing(), &moved([0.1, 0.05, 0.0]))
    };
    assert!((at(1.0) - at(0.0) - 2.0 * (at(0.5) - at(0.0))).abs() < 1e-12);
}

#[test]
fn limb_sides_add_their_weight_and_attract_a_limb_to_its_contour() {
    let at = |limb_side_weight, x| {
        let settings = SilhouetteSettings { limb_side_weight, ..Default::default() };
        energy(&body(), &rig(), settings, &standing(), &moved([x, 0.0, 0.0]))
    };
    let sides = |x: f64| at(1.0, x) - at(0.0, x);
    assert!((at(2.0, 0.1) - at(0.0, 0.1) - 2.0 * sides(0.1)).abs() < 1e-12);
    let costs = [0.0, 0.02, 0.1, 0.4].map(sides);
    assert!(costs.windows(2).all(|c| c[0] < c[1]) && costs[3] <= 1.0, "{costs:?}");
}

#[test]
fn the_sampled_term_replaces_the_area_term_and_is_one_sided() {
    let at = |contour_weight, x| {
        let settings = SilhouetteSettings { silhouette: SilhouetteTerm::Sampled, contour_weight, ..Default::default() };
        energy(&body(), &rig(), settings, &standing(), &moved([x, 0.0, 0.0]))
    };
    let costs = [0.0, 0.02, 0.1, 0.4].map(|x| at(0.0, x));
    assert!(costs[0] < 0.02, "{costs:?}: samples in pixels that the outline cuts");
    assert!(costs.windows(2).all(|c| c[0] < c[1]) && costs[3] <= 1.0, "{costs:?}");
    // the contour term keeps its weight
    let by_area = |weight| {
        let settings = SilhouetteSettings { contour_weight: weight, ..Default::default() };
        energy(&body(), &rig(), settings, &standing(), &moved([0.1, 0.0, 0.0]))
    };
    assert!((at(0.5, 0.1) - at(0.0, 0.1) - (by_area(0.5) - by_area(0.0))).abs() < 1e-12);
    // a body of thinner limbs inside the silhouette costs nothing, unlike with the area terms
    let mut thin = body();
    for solid in thin.links.iter_mut().flat_map(|link| &mut link.solids) {
        if let Solid::TaperedCapsule(capsule) = solid {
            (capsule.radius_a, capsule.radius_b) = (0.7 * capsule.radius_a, 0.7 * capsule.radius_b);
        }
    }
    let settings = |silhouette| SilhouetteSettings { silhouette, contour_weight: 0.0, ..Default::default() };
    let inside = |term| {
        let mut likelihood = SilhouetteLikelihood::new(thin.clone(), &rig(), settings(term)).unwrap();
        likelihood.prepare(&seen(&body(), &standing(), &rig())).unwrap();
        likelihood.energy(&standing(), &mut likelihood.scratch())
    };
    assert!(inside(SilhouetteTerm::Sampled) < 0.002, "{}", inside(SilhouetteTerm::Sampled));
    assert!(inside(SilhouetteTerm::Overlap) > 0.1);
}

#[test]
fn capsule_and_mask_strategies_agree() {
    let settings = SilhouetteSettings::default();
    let mut likelihoods = [ComparisonStrategy::Capsules, ComparisonStrategy::Masks].map(|strategy| {
        let mut likelihood = SilhouetteLikelihood::new(body(), &rig(), settings).unwrap();
        likelihood.strategy = strategy;
        likelihood.prepare(&seen(&body(), &standing(), &rig())).unwrap();
        likelihood
    });
    for by in [[0.0, 0.0, 0.0], [0.05, 0.02, 0.0], [0.0, 0.3, 0.1], [2.0, 0.0, 0.0]] {
        let [fast, slow] =
            likelihoods.each_mut().map(|likelihood| likelihood.energy(&moved(by), &mut likelihood.scratch()));
        // The capsule strategy rounds distances to 16 bits.
        assert!((fast - slow).abs() < 1e-5, "{by:?}: {fast} against {slow}");
    }
}

#[test]
fn the_two_sided_contour_term_is_symmetric() {
    let settings = SilhouetteSettings { contour: ContourTerm::TwoSided, contour_weight: 1.0, ..Default::default() };
    let (here, there) = (standing(), moved([0.1, 0.2, 0.0]));
    let forth = energy(&body(), &rig(), settings, &here, &there);
    let back = energy(&body(), &rig(), settings, &there, &here);
    assert!((forth - back).abs() < 1e-12, "{forth} against {back}");
}

#[test]
fn a_limb_drawn_into_the_torso_costs_the_two_sided_contour_more() {
    let (mut truth, hidden) = (standing(), standing());
    let body = body();
    let abduction = body.find_degree_of_freedom("left_shoulder_abduction").unwrap();
    truth.joint_angles[abduction] = 1.4;
    let contour_of = |contour| {
        let with = SilhouetteSettings { contour, contour_weight: 1.0, ..Default::default() };
        let without = SilhouetteSettings { contour_weight: 0.0, ..with };
        energy(&body, &rig(), with, &truth, &hidden) - energy(&body, &rig(), without, &truth, &hidden)
    };
    assert!(contour_of(ContourTerm::TwoSided) > contour_of(ContourTerm::OneSided));
}

#[test]
fn a_view_without_either_silhouette_is_left_out_and_the_energy_is_zero_without_any_other() {
    let (mut more, pose) = (rig(), moved([0.1, 0.0, 0.0]));
    more.cameras.push(looking_away());
    let settings = SilhouetteSettings::default();
    let without = energy(&body(), &rig(), settings, &standing(), &pose);
    let with = energy(&body(), &more, settings, &standing(), &pose);
    assert!((with - without).abs() < 1e-12);
    let nothing = CameraRig { cameras: vec![looking_away()] };
    assert_eq!(energy(&body(), &nothing, settings, &standing(), &pose), 0.0);
}

#[test]
fn a_pose_out_of_view_has_the_highest_energy() {
    let hidden = moved([0.0, 0.0, 50.0]);
    for settings in every_setting() {
        let worst = 1.0 + settings.contour_weight;
        assert_eq!(energy(&body(), &rig(), settings, &standing(), &hidden), worst);
    }
}

#[test]
fn a_pose_with_nan_is_invalid() {
    let energy = |pose: &Pose| energy(&body(), &rig(), SilhouetteSettings::default(), &standing(), pose);
    assert!(energy(&moved([f64::NAN, 0.0, 0.0])).is_nan());
    let mut pose = standing();
    pose.joint_angles[3] = f64::INFINITY;
    assert!(energy(&pose).is_nan());
}

#[test]
fn solids_other_than_capsules_are_compared() {
    let mut boxed = body();
    boxed.links[0].solids.push(Solid::Box { link_from_box: Isometry3::identity(), half_extents: [0.3, 0.3, 0.1] });
    let settings = SilhouetteSettings::default();
    assert_eq!(energy(&boxed, &rig(), settings, &standing(), &standing()), 0.0);
    let mut likelihood = SilhouetteLikelihood::new(body(), &rig(), settings).unwrap();
    likelihood.prepare(&seen(&boxed, &standing(), &rig())).unwrap();
    assert!(likelihood.energy(&standing(), &mut likelihood.scratch()) > 0.05);
}

/// A camera of 640 x 480 pixels behind a strong lens.
fn bent(k1: f64) -> CameraRig {
    let mut camera = camera([3.0, 0.0, 1.4], [0.0, 0.6, 0.9]);
    camera.pinhole =
        Pinhole { focal: [520.0; 2], principal_point: [320.0, 240.0], width: 640, height: 480, near: 0.05 };
    camera.distortion = Distortion { k1, k2: 0.1, ..Distortion::default() };
    CameraRig { cameras: vec![camera] }
}

#[test]
fn lens_distortion_is_removed_from_observations() {
    for k1 in [-0.3, 0.3] {
        let rig = bent(k1);
        let camera = &rig.cameras[0];
        let mask = &seen(&body(), &standing(), &rig).silhouettes[0];
        let rectified = Rectification::new(camera).unwrap().rectify(mask);
        let mut direct = Mask::new(640, 480);
        let ideal = Camera { distortion: Distortion::default(), ..camera.clone() };
        draw_silhouette(&body(), &body().link_frames(&standing()), &ideal, &mut direct);
        let iou = skiagraph_core::raster::overlap(&rectified, &direct).iou();
        let unmoved = skiagraph_core::raster::overlap(mask, &direct).iou();
        assert!(iou > 0.98 && unmoved < 0.9, "k1 = {k1}: {iou} rectified, {unmoved} as seen");
        let at = |by| energy(&body(), &rig, SilhouetteSettings::default(), &standing(), &moved(by));
        assert!(at([0.0; 3]) < 0.03 && at([0.0; 3]) < 0.5 * at([0.0, 0.02, 0.0]));
    }
}

#[test]
fn an_observation_that_does_not_match_the_cameras_is_rejected() {
    let mut likelihood = SilhouetteLikelihood::new(body(), &rig(), SilhouetteSettings::default()).unwrap();
    let mut refusal = |silhouettes| {
        let observation = Observation { frame: 3, time_s: 0.0, silhouettes, moment: None, keypoints: None };
        likelihood.prepare(&observation).unwrap_err().to_string()
    };
    let message = refusal(vec![Mask::new(160, 120)]);
    assert!(message.contains("frame 3") && message.contains("expected 3 silhouettes"), "{message}");
    let message = refusal(vec![Mask::new(160, 120), Mask::new(160, 120), Mask::new(320, 240)]);
    assert!(message.contains("160 x 120 pixels, its mask 320 x 240"), "{message}");
}

#[test]
fn a_rig_without_cameras_is_rejected() {
    let refused = SilhouetteLikelihood::new(body(), &CameraRig::default(), SilhouetteSettings::default()).unwrap_err();
    assert_eq!(refused.key, "cameras");
}
