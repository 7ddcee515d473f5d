//! Trackers of human motion from silhouettes, and the motion models that guide them.
//!
//! A [`tracker::Tracker`] takes cameras, its own body model, a start pose and [`Observation`]s, and estimates a pose
//! for every frame. [`motion_model`] predicts how a pose changes between frames, by diffusion or with a learned model.
//!
//! **Blindfold.** This crate depends on `skiagraph-core` only. Ground truth is in `skiagraph-truth` and its files are
//! read by `skiagraph-set`, so a tracker that names either crate does not compile.
//!
//! ```compile_fail
//! use skiagraph_truth::scene::GroundTruth;
//! ```
//!
//! ```
//! use skiagraph_core::body::{ProposalScales, shipped};
//! use skiagraph_core::camera::{CameraRig, RingParameters};
//! use skiagraph_core::observation::Observation;
//! use skiagraph_core::raster::Mask;
//! use skiagraph_track::motion_model::{Diffusion, DiffusionSettings};
//! use skiagraph_track::tracker::{AnnealedParticleFilter, FilterSettings, SilhouetteLikelihood};
//! use skiagraph_track::tracker::{SilhouetteSettings, Tracker};
//!
//! let body = shipped("tracker25")?;
//! let ring = RingParameters { count: 2, radius: 3.5, image_size: [80, 60], ..RingParameters::default() };
//! let rig = CameraRig::ring(&ring)?;
//! let model = Diffusion::new(body.clone(), &ProposalScales::for_human(&body, 30.0), &DiffusionSettings::default())?;
//! let likelihood = SilhouetteLikelihood::new(body.clone(), &rig, SilhouetteSettings::default())?;
//! let settings = FilterSettings { particles: 20, layers: 2, ..FilterSettings::default() };
//! let mut filter = AnnealedParticleFilter::new(settings, model, likelihood, 1)?;
//! filter.start(&body.zero_pose());
//! let silhouettes = vec![Mask::new(80, 60); 2];
//! let estimate = filter.track(&Observation { frame: 0, time_s: 0.0, silhouettes, moment: None, keypoints: None })?;
//! assert_eq!(estimate.pose.joint_angles.len(), body.degrees_of_freedom.len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Observation`]: skiagraph_core::observation::Observation

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
pub mod motion_model;
pub mod tracker;
