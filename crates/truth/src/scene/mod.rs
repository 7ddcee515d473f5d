//! The truth: exact [`GroundTruth`] for every frame, from an actor, a motion and a rig.
//!
//! ```
//! use skiagraph_core::body::{Motion, shipped};
//! use skiagraph_core::camera::{CameraRig, RingParameters};
//! use skiagraph_truth::observing::observe;
//! use skiagraph_truth::scene::GroundTruth;
//! let body = shipped("tracker25")?;
//! let mut pose = body.zero_pose();
//! pose.world_from_root.translation.vector.z = 0.95;
//! let motion = Motion { frames_per_second: 60.0, poses: vec![pose; 2] };
//! let ring = RingParameters { count: 2, radius: 3.5, image_size: [80, 60], ..RingParameters::default() };
//! let rig = CameraRig::ring(&ring)?;
//! let truth = GroundTruth::from_motion(body, &motion, &rig)?;
//! let seen = observe(&truth, &rig);
//! assert_eq!((seen.len(), seen[0].silhouettes.len()), (2, 2));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod clock;
mod seen;
mod shot;
mod sight;
mod truth;

pub use truth::{GroundTruth, SceneError, TruthFrame};

// Times between frames and sight lines, for the other crates and tests.
#[doc(hidden)]
pub use self::{
    clock::{SceneClock, SceneFigure},
    shot::{Shot, ShotPoint},
    sight::{Occluders, Sight, SightLines},
    truth::Distractor,
};
