//! Poses for the silhouette and plausibility benchmarks: jittered around the standing pose.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_core::rng::{Purpose, stream};

pub(crate) fn jittered(body: &Humanoid, index: u64) -> Pose {
    let mut random = stream(index, Purpose::Perturbation, 0, 0, 0);
    let mut deviate = |reach: f64| random.random_range(-reach..reach);
    let mut pose = body.zero_pose();
    pose.joint_angles.iter_mut().for_each(|angle| *angle = deviate(0.3));
    let place = Vector3::new(deviate(0.1), deviate(0.1), 0.93 + deviate(0.05));
    let turn = UnitQuaternion::from_euler_angles(deviate(0.2), deviate(0.2), deviate(0.5));
    pose.world_from_root = Isometry3::from_parts(Translation3::from(place), turn);
    pose
}
