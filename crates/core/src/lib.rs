//! Bodies, cameras, exact silhouettes and contacts: the geometry that makers of ground truth and trackers share.
//!
//! A [`body::Humanoid`] is read from URDF and posed; a [`camera::Camera`] projects it; [`raster`] draws it into a
//! [`raster::Mask`]. [`contact`] and [`dynamics`] say what a motion touches and which forces it needs. An
//! [`observation::Observation`] is all that a tracker is given of a frame. There is no ground truth in this crate: a
//! tracker may use all of it.
//!
//! | module | what it does |
//! |---|---|
//! | [`body`] | humanoids from URDF, kinematics and inverse kinematics, skins, people drawn from a population |
//! | [`camera`] | pinholes with lenses, rigs, how rigs move and take images, camera files of other tools |
//! | [`raster`] | bit-packed masks, exact silhouettes of solids and meshes, overlap, contours, distances |
//! | [`contact`] | gaps to the ground and to props, stances, slips, self-collision |
//! | [`dynamics`] | the forces that a motion needs |
//! | [`observation`] | what a tracker is given of a frame |
//!
//! ```
//! use nalgebra::{Point3, Vector3};
//! use skiagraph_core::body::{draw_silhouette, shipped};
//! use skiagraph_core::camera::{Camera, FieldOfView};
//! use skiagraph_core::raster::Mask;
//!
//! let body = shipped("tracker25")?;
//! let mut pose = body.zero_pose();
//! pose.world_from_root.translation.z = 0.95;
//! let (eye, target) = (Point3::new(3.5, 0.0, 1.2), Point3::new(0.0, 0.0, 0.95));
//! let camera = Camera::look_at("front", eye, target, Vector3::z(), FieldOfView::Vertical(0.9), 160, 120)?;
//! let mut mask = Mask::new(160, 120);
//! draw_silhouette(&body, &body.link_frames(&pose), &camera, &mut mask);
//! assert!(mask.count() > 500, "{} pixels of the body", mask.count());
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
pub mod body;
pub mod camera;
pub mod contact;
pub mod dynamics;
pub mod observation;
pub mod raster;

// What the other crates share: files, arrays, random streams, and work on all cores. No interface for users.
#[doc(hidden)]
pub mod input;
#[doc(hidden)]
pub mod npz;
#[doc(hidden)]
pub mod parallel;
#[doc(hidden)]
pub mod rng;
#[doc(hidden)]
pub mod simd;
// test support, shared by the crates, names this one as the others do
#[cfg(test)]
extern crate self as skiagraph_core;
#[cfg(test)]
#[path = "../../test_support/bodies.rs"]
pub mod test_bodies;
#[cfg(test)]
#[path = "../../test_support/data.rs"]
mod test_data;

/// The linear algebra of poses, frames and points in this interface.
pub use nalgebra;
