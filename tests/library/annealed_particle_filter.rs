//! Tracking from silhouettes alone: a synthetic walk of 1.5 seconds, seen by four small cameras.

use nalgebra::Point3;
use skiagraph_core::body::{Humanoid, Motion, Pose, draw_silhouette};
use skiagraph_core::body::{Prediction, ProposalScales};
use skiagraph_core::camera::{CameraRig, RingParameters};
use skiagraph_core::observation::Observation;
use skiagraph_core::raster::Mask;
use skiagraph_track::motion_model::{Diffusion, DiffusionSettings};
use skiagraph_track::tracker::{
    AnnealedParticleFilter, FilterSettings, Frozen, SilhouetteLikelihood, SilhouetteSettings, Tracker,
};

const FRAMES: usize = 45;
const FRAMES_PER_SECOND: f64 = 30.0;

/// A walk along the x axis at 1 m/s, one stride a second.
fn walk(body: &Humanoid) -> Motion {
    let pose = |frame: usize| {
        let time = frame as f64 / FRAMES_PER_SECOND;
        let mut pose = body.zero_pose();
        pose.world_from_root.translation.vector = nalgebra::Vector3::new(time - 0.75, 0.1, 0.92);
        let mut set = |name: &str, angle: f64| {
            let dof = body.find_degree_of_freedom(name).expect("a joint of tracker25");
            pose.joint_angles[dof] = angle;
        };
        for (side, phase) in [("left", 0.0), ("right", std::f64::consts::PI)] {
            let swing = (std::f64::consts::TAU * time + phase).sin();
            set(&format!("{side}_hip_flexion"), 0.1 + 0.4 * swing);
            set(&format!("{side}_knee_flexion"), 0.5 - 0.4 * swing);
            set(&format!("{side}_shoulder_flexion"), -0.35 * swing);
            set(&format!("{side}_shoulder_abduction"), 0.15);
            set(&format!("{side}_elbow_flexion"), 0.5);
        }
        pose
    };
    Motion { frames_per_second: FRAMES_PER_SECOND, poses: (0..FRAMES).map(pose).collect() }
}

fn ring() -> CameraRig {
    let ring = RingParameters {
        count: 4,
        radius: 3.5,
        height: 1.6,
        look_at: Point3::new(0.0, 0.0, 0.95),
        first_azimuth: 0.8,
        field_of_view: 1.05,
        image_size: [160, 120],
        near: 0.05,
    };
    CameraRig::ring(&ring).expect("a valid ring")
}

fn observed(body: &Humanoid, pose: &Pose, rig: &CameraRig, frame: usize) -> Observation {
    let silhouettes = rig.cameras.iter().map(|camera| {
        let mut mask = Mask::new(camera.pinhole.width, camera.pinhole.height);
        draw_silhouette(body, &body.link_frames(pose), camera, &mut mask);
        mask
    });
    Observation {
        frame,
        time_s: frame as f64 / FRAMES_PER_SECOND,
        silhouettes: silhouettes.collect(),
        moment: None,
        keypoints: None,
    }
}

/// Mean distance of the fifteen markers, millimetres.
fn distance_mm(body: &Humanoid, a: &Pose, b: &Pose) -> f64 {
    let (a, b) = (body.markers(&body.link_frames(a)), body.markers(&body.link_frames(b)));
    let distances: Vec<f64> = a.iter().zip(&b).filter_map(|(a, b)| Some((a.as_ref()? - b.as_ref()?).norm())).collect();
    1000.0 * distances.iter().sum::<f64>() / distances.len() as f64
}

/// Mean error over the sequence, millimetres.
fn error_mm(tracker: &mut dyn Tracker, body: &Humanoid) -> f64 {
    let (truth, rig) = (walk(body), ring());
    tracker.start(&truth.poses[0]);
    let mut sum = 0.0;
    for (frame, pose) in truth.poses.iter().enumerate() {
        let estimate = tracker.track(&observed(body, pose, &rig, frame)).expect("every frame has particles");
        assert_eq!(estimate.frame, frame);
        sum += distance_mm(body, &estimate.pose, pose);
    }
    sum / truth.poses.len() as f64
}

fn filter(body: &Humanoid, rig: &CameraRig) -> AnnealedParticleFilter<Diffusion, SilhouetteLikelihood> {
    let scales = ProposalScales::from_motions(body, &[walk(body)], Prediction::None).expect("a walk of many frames");
    let model = Diffusion::new(body.clone(), &scales, &DiffusionSettings::default()).expect("valid scales");
    let likelihood =
        SilhouetteLikelihood::new(body.clone(), rig, SilhouetteSettings::default()).expect("valid settings");
    AnnealedParticleFilter::new(FilterSettings::default(), model, likelihood, 5).expect("valid settings")
}

#[test]
fn a_walk_is_tracked_far_better_than_by_a_frozen_pose() {
    let body = Humanoid::tracker25().expect("tracker25 loads");
    let tracked = error_mm(&mut filter(&body, &ring()), &body);
    let frozen = error_mm(&mut Frozen::default(), &body);
    assert!(tracked < 35.0, "{tracked} mm");
    assert!(frozen > 10.0 * tracked, "{tracked} mm against {frozen} mm");
}

#[test]
fn a_person_outside_every_image_is_no_reason_to_fail() {
    let body = Humanoid::tracker25().expect("tracker25 loads");
    let rig = ring();
    let mut filter = filter(&body, &rig);
    let mut outside = body.zero_pose();
    outside.world_from_root.translation.vector = nalgebra::Vector3::new(0.0, 0.0, 60.0);
    filter.start(&outside);
    for frame in 0..3 {
        let estimate =
            filter.track(&observed(&body, &outside, &rig, frame)).expect("poses outside every image are valid");
        assert_eq!(estimate.energy, Some(0.0));
        assert!(estimate.layers.iter().all(|layer| layer.degenerate));
        assert!(distance_mm(&body, &estimate.pose, &outside) < 1000.0);
    }
}
