//! Errors in the tracker's cameras and start pose.

use nalgebra::{Isometry3, Translation3, Vector3};

use super::{Corruption, Draw, draws};
use skiagraph_core::body::{Humanoid, Pose, rotation_from_vector};
use skiagraph_core::camera::{Camera, CameraRig, Distortion};
use skiagraph_core::rng::{KeyedSeed, normal};

/// Least focal length given to a tracker, as a share of the true one.
const MIN_FOCAL: f64 = 0.1;

/// The cameras given to a tracker: the true ones with errors along the axes `calibration_mm`, `calibration_deg`,
/// `calibration_px` and `lens_ignored`.
pub fn tracker_rig(rig: &CameraRig, corruption: &Corruption, seed: impl Into<KeyedSeed>) -> CameraRig {
    let seed = seed.into();
    if !corruption.changes_cameras() {
        return rig.clone();
    }
    let erroneous =
        rig.cameras.iter().enumerate().map(|(index, camera)| erroneous_camera(camera, corruption, seed, index));
    CameraRig { cameras: erroneous.collect() }
}

fn erroneous_camera(camera: &Camera, corruption: &Corruption, seed: KeyedSeed, index: usize) -> Camera {
    // all numbers are always drawn, so that a level changes only the magnitude
    let mut random = draws(seed, 0, Draw::Camera, index);
    let mut vector = || Vector3::from_fn(|_, _| normal(&mut random));
    let (shift, turn, focal) = (vector(), vector(), vector().x);
    let mut erroneous = camera.clone();
    if corruption.calibration_mm != 0.0 || corruption.calibration_deg != 0.0 {
        let centre = camera.centre().coords + shift * (1e-3 * corruption.calibration_mm);
        let turned = rotation_from_vector(&(turn * corruption.calibration_deg.to_radians()));
        let rotation = turned * camera.camera_from_world.rotation;
        erroneous.camera_from_world = Isometry3::from_parts(Translation3::from(-(rotation * centre)), rotation);
    }
    for focal_length in &mut erroneous.pinhole.focal {
        *focal_length = (*focal_length + corruption.calibration_px * focal).max(MIN_FOCAL * *focal_length);
    }
    let known = 1.0 - corruption.lens_ignored;
    erroneous.distortion = Distortion::from_coefficients(camera.distortion.coefficients().map(|c| c * known));
    erroneous
}

/// The start pose given to a tracker: the true one with errors along the axes `start_mm` and `start_deg`.
pub fn tracker_start(body: &Humanoid, start: &Pose, corruption: &Corruption, seed: impl Into<KeyedSeed>) -> Pose {
    let mut erroneous = start.clone();
    let mut random = draws(seed.into(), 0, Draw::Start, 0);
    let mut vector = || Vector3::from_fn(|_, _| normal(&mut random));
    let (shift, turn) = (vector(), vector());
    erroneous.world_from_root.translation.vector += shift * (1e-3 * corruption.start_mm);
    if corruption.start_deg != 0.0 {
        let deviation = corruption.start_deg.to_radians();
        erroneous.world_from_root.rotation *= rotation_from_vector(&(turn * deviation));
        for angle in erroneous.joint_angles.iter_mut() {
            *angle += deviation * normal(&mut random);
        }
        body.clamp_to_limits(&mut erroneous);
    }
    erroneous
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_cameras::rig;
    use skiagraph_core::body::shipped;

    #[test]
    fn camera_errors_have_the_given_deviations() {
        let corruption =
            Corruption { calibration_mm: 20.0, calibration_deg: 0.5, calibration_px: 6.0, ..Corruption::default() };
        let (mut shift, mut turn, mut focal) = (0.0, 0.0, 0.0);
        for seed in 0..400 {
            for (erroneous, camera) in tracker_rig(&rig(), &corruption, seed).cameras.iter().zip(&rig().cameras) {
                shift += (erroneous.centre() - camera.centre()).norm_squared() / 3.0;
                turn += erroneous.camera_from_world.rotation.angle_to(&camera.camera_from_world.rotation).powi(2) / 3.0;
                focal += (erroneous.pinhole.focal[0] - camera.pinhole.focal[0]).powi(2);
                assert_eq!(erroneous.distortion, camera.distortion);
                assert!(erroneous.validate().is_ok());
            }
        }
        let deviation = |sum: f64| (sum / 1200.0).sqrt();
        assert!((deviation(shift) * 1e3 - 20.0).abs() < 1.0, "{}", deviation(shift));
        assert!((deviation(turn).to_degrees() - 0.5).abs() < 0.025, "{}", deviation(turn));
        assert!((deviation(focal) - 6.0).abs() < 0.5, "{}", deviation(focal));
    }

    #[test]
    fn an_ignored_lens_becomes_an_ideal_one() {
        let half = tracker_rig(&rig(), &Corruption { lens_ignored: 0.5, ..Corruption::default() }, 1);
        assert_eq!(half.cameras[1].distortion.k1, 0.5 * rig().cameras[1].distortion.k1);
        let none = tracker_rig(&rig(), &Corruption { lens_ignored: 1.0, ..Corruption::default() }, 1);
        assert!(none.cameras[1].distortion.is_none());
        assert_eq!(half.cameras[1].camera_from_world, rig().cameras[1].camera_from_world);
    }

    #[test]
    fn zero_strength_gives_the_truth_and_start_poses_keep_the_limits() {
        let body = shipped("tracker25").unwrap();
        let start = body.zero_pose();
        assert_eq!(tracker_rig(&rig(), &Corruption::default(), 4), rig());
        assert_eq!(tracker_start(&body, &start, &Corruption::default(), 4), start);
        let off =
            tracker_start(&body, &start, &Corruption { start_mm: 50.0, start_deg: 20.0, ..Corruption::default() }, 4);
        let mut clamped = off.clone();
        body.clamp_to_limits(&mut clamped);
        assert_eq!(off, clamped);
        assert_ne!(off.joint_angles, start.joint_angles);
        let shift = off.world_from_root.translation.vector.norm();
        assert!((0.01..0.3).contains(&shift), "{shift}");
    }
}
