//! Test input: a ring of cameras, a march, and the silhouettes and keypoints of a body.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use skiagraph_core::body::{
    Humanoid, KeypointLayout, KeypointPlace, Pose, Skin, draw_silhouette, shipped, shipped_skin,
};
use skiagraph_core::camera::{Camera, CameraRig, RingParameters};
use skiagraph_core::observation::{FoundKeypoint, FrameKeypoints, Observation};
use skiagraph_core::raster::Mask;

/// Cameras around the origin at `radius` metres, looking at a standing body.
pub(super) fn ring(count: u32, radius: f64, image_size: [u32; 2]) -> CameraRig {
    CameraRig::ring(&RingParameters { count, radius, image_size, ..RingParameters::default() }).unwrap()
}

/// The tracker's body in the skin of a person.
pub(super) fn skinned() -> Humanoid {
    let body = shipped("tracker25").unwrap();
    let bind = body.link_frames(&body.zero_pose());
    let skin = Skin::bound(&shipped_skin("person_coarse").unwrap(), &body, &bind).unwrap();
    Humanoid { skin: Some(skin.into()), ..body }
}

pub(super) fn seen(body: &Humanoid, pose: &Pose, rig: &CameraRig, frame: usize) -> Observation {
    let silhouettes = rig.cameras.iter().map(|camera| {
        let mut mask = Mask::new(camera.pinhole.width, camera.pinhole.height);
        draw_silhouette(body, &body.link_frames(pose), camera, &mut mask);
        mask
    });
    Observation { frame, time_s: 0.0, silhouettes: silhouettes.collect(), moment: None, keypoints: None }
}

pub(super) fn seen_keypoints(
    body: &Humanoid,
    layout: KeypointLayout,
    pose: &Pose,
    rig: &CameraRig,
    frame: usize,
) -> Observation {
    let frames = body.link_frames(pose);
    let places: Vec<_> = body.keypoint_places(layout).into_iter().map(Option::unwrap).collect();
    let view = |camera: &Camera| {
        let found = |place: &KeypointPlace| {
            let pixel = camera.project(&(frames[place.point.link] * place.point.point_in_link))?.into();
            Some(FoundKeypoint { pixel, confidence: 1.0 })
        };
        places.iter().map(found).collect()
    };
    let keypoints = Some(FrameKeypoints { layout, views: rig.cameras.iter().map(view).collect() });
    Observation { frame, time_s: 0.0, silhouettes: Vec::new(), moment: None, keypoints }
}

/// Mean marker distance between two posed bodies, millimetres.
pub(super) fn apart_mm((a, pose_a): (&Humanoid, &Pose), (b, pose_b): (&Humanoid, &Pose)) -> f64 {
    let (a, b) = (a.markers(&a.link_frames(pose_a)), b.markers(&b.link_frames(pose_b)));
    let all: Vec<f64> = a.iter().zip(&b).filter_map(|(a, b)| Some((a.as_ref()? - b.as_ref()?).norm())).collect();
    1000.0 * all.iter().sum::<f64>() / all.len() as f64
}

/// A march with swinging arms: the angles around which hips, knees, shoulders and elbows swing or stay, radians.
pub(super) struct March {
    pub(super) cycle: usize,
    /// Displacement of the root per frame, metres.
    pub(super) advance: f64,
    pub(super) hip: f64,
    pub(super) knee: f64,
    pub(super) abduction: f64,
    pub(super) elbow: f64,
}

impl March {
    /// Upright, with the soles on the ground, as skins are modelled.
    pub(super) fn standing(body: &Humanoid) -> Pose {
        let mut pose = body.zero_pose();
        pose.world_from_root.translation.vector.z = 0.93;
        pose
    }

    pub(super) fn pose(&self, body: &Humanoid, frame: usize) -> Pose {
        let mut pose = body.zero_pose();
        pose.world_from_root.translation.vector = Vector3::new(self.advance * frame as f64, 0.0, 0.93);
        let swing = libm::sin(frame as f64 / self.cycle as f64 * TAU);
        for (side, sign) in [("left", 1.0), ("right", -1.0)] {
            let legs =
                [("hip_flexion", self.hip + 0.5 * sign * swing), ("knee_flexion", self.knee - 0.4 * sign * swing)];
            let arms = [
                ("shoulder_flexion", -0.5 * sign * swing),
                ("shoulder_abduction", self.abduction),
                ("elbow_flexion", self.elbow),
            ];
            for (name, angle) in legs.into_iter().chain(arms) {
                pose.joint_angles[body.find_degree_of_freedom(&format!("{side}_{name}")).unwrap()] = angle;
            }
        }
        pose
    }
}
