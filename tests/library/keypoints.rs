//! Keypoints of bodies with and without a skin.

use nalgebra::{Point3, Vector3};
use skiagraph_core::body::{Keypoint, KeypointLayout, Motion, shipped, shipped_skin};
use skiagraph_core::camera::{Camera, CameraRig, FieldOfView, TimedRig};
use skiagraph_truth::observing::{Corruption, KeypointDetector, KeypointSettings};
use skiagraph_truth::retarget::with_skin;
use skiagraph_truth::scene::{GroundTruth, Sight};

/// One camera in front of a body at the origin, and one behind it.
fn front_and_back() -> CameraRig {
    let camera = |name: &str, x: f64| {
        let (eye, target) = (Point3::new(x, 0.3, 1.2), Point3::new(0.0, 0.0, 1.0));
        Camera::look_at(name, eye, target, Vector3::z(), FieldOfView::Vertical(0.9), 320, 240).unwrap()
    };
    CameraRig { cameras: vec![camera("front", 3.7), camera("back", -3.5)] }
}

#[test]
fn faces_are_seen_from_in_front_only_and_feet_have_their_shape_on_solids_and_skins() {
    let (bare, rig) = (shipped("actor").unwrap(), front_and_back());
    let skinned = ["person", "woman"].map(|name| with_skin(&bare, &shipped_skin(name).unwrap()).unwrap());
    for body in [bare].into_iter().chain(skinned) {
        let mut pose = body.zero_pose();
        pose.world_from_root.translation.z = 0.95;
        let motion = Motion { frames_per_second: 60.0, poses: vec![pose] };
        let truth = GroundTruth::from_motion(body, &motion, &rig).unwrap();
        let exact = KeypointSettings::exact(KeypointLayout::Halpe26);
        let seen =
            KeypointDetector::new(&truth, &TimedRig::from(&rig), exact, Corruption::default(), 4.into()).detect();
        let points = KeypointLayout::Halpe26.keypoints().len();
        let at = |point: Keypoint| Point3::from(seen.places[point as usize]);
        for face in [Keypoint::Nose, Keypoint::LeftEye, Keypoint::RightEye] {
            let sights = [0, 1].map(|camera| seen.views[camera * points + face as usize].sight);
            assert_eq!(sights, [Sight::InView, Sight::SelfOccluded], "{face:?} {}", truth.actor.skin.is_some());
            assert!(at(face).x > at(Keypoint::LeftEar).x + 0.04, "{} {}", at(face), at(Keypoint::LeftEar));
        }
        let (heel, big, small) = (at(Keypoint::LeftHeel), at(Keypoint::LeftBigToe), at(Keypoint::LeftSmallToe));
        assert!(big.x - heel.x > 0.18 && small.y > big.y + 0.03 && small.x > heel.x + 0.1, "{heel} {big} {small}");
        assert!(heel.x < at(Keypoint::LeftAnkle).x && heel.z < 0.1 + big.z, "{heel} {big}");
    }
}
