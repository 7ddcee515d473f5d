//! Ground truth from motion recordings, and the observations that simulated cameras make of it, with calibrated errors.
//!
//! ```text
//! recording --mocap--> Clip --retarget--> Motion of a Humanoid --editing--> scene --observing--> Observation
//! ```
//!
//! [`mocap`] reads recordings, [`retarget`](mod@retarget) transfers them to a body, [`editing`] joins, repeats and
//! varies them. A [`scene::GroundTruth`] holds the true state of every frame. [`observing`] renders the tracker's input
//! from it: exact, corrupted along calibrated axes, or segmented from simulated images.
//!
//! Trackers do not depend on this crate, so they cannot access the truth.
//!
//! ```
//! use skiagraph_core::body::{Motion, shipped};
//! use skiagraph_core::camera::{CameraRig, RingParameters};
//! use skiagraph_truth::observing::observe;
//! use skiagraph_truth::scene::GroundTruth;
//!
//! let body = shipped("tracker25")?;
//! let mut pose = body.zero_pose();
//! pose.world_from_root.translation.z = 0.95;
//! let ring = RingParameters { count: 2, radius: 3.5, image_size: [80, 60], ..RingParameters::default() };
//! let rig = CameraRig::ring(&ring)?;
//! let motion = Motion { frames_per_second: 30.0, poses: vec![pose; 2] };
//! let truth = GroundTruth::from_motion(body, &motion, &rig)?;
//! let seen = observe(&truth, &rig);
//! assert!(seen[0].silhouettes[0].count() > 0 && truth.frames[0].markers.iter().all(Option::is_some));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::todo,
        clippy::unimplemented,
        clippy::dbg_macro,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]
// For the application: scenarios describe to users how motions are edited.
#[doc(hidden)]
pub mod editing;
pub mod mocap;
pub mod observing;
pub mod retarget;
pub mod scene;
#[cfg(test)]
#[path = "../../test_support/bodies.rs"]
pub mod test_bodies;
#[cfg(test)]
#[path = "../../test_support/cameras.rs"]
pub mod test_cameras;
#[cfg(test)]
#[path = "../../test_support/data.rs"]
mod test_data;
