//! Skiagraph generates exact ground truth for evaluating markerless human motion trackers, and measures trackers
//! against it.
//!
//! ```text
//! recording --mocap--> Clip --retarget--> Motion of a Humanoid --scene--> GroundTruth
//!                                                                             |
//!                           CameraRig --observation--> Observation (silhouettes of one frame)
//!                                                                             |
//!                                     Tracker (sees no truth) --> Estimate --evaluation--> errors --report--> HTML
//! ```
//!
//! At the root are the functions that programs need, which do what the commands do:
//!
//! | what | with |
//! |---|---|
//! | make a set from a scenario | [`ScenarioFile`], [`render`](fn@render) |
//! | open a set: its blind side, and its truth | [`BenchmarkSet`], [`BlindSet`], [`TruthSet`] |
//! | run a tracker on it: one of yours, or a built-in one | [`Tracker`], [`TrackerSettings`], [`track`](fn@track) |
//! | measure its estimates against the truth | [`Tracked`], [`measure`](fn@measure), [`Measured`] |
//! | compare two measured runs | [`compare`](fn@compare), [`RunComparison`] |
//!
//! ```
//! use skiagraph::{ScenarioFile, TrackerSettings, measure, render, track};
//!
//! let scenario = ScenarioFile::open("scenarios/smoke/matched.toml".as_ref(), &[])?;
//! let (set, _notes) = render(&scenario, None)?;
//! let tracked = track(&set.blind, &TrackerSettings::named("frozen")?, &[0])?;
//! let measured = measure(&set, &tracked)?;
//! println!("{:.1} mm", measured.summary.metrics["humaneva_mm"].mean);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Programs that make scenes, trackers and metrics of their own use the crates below this one:
//!
//! | crate | what it has |
//! |---|---|
//! | [`skiagraph_core`] | bodies ([`Humanoid`](skiagraph_core::body::Humanoid), from URDF), cameras, silhouettes, contacts, forces |
//! | [`skiagraph_physics`] | planted feet, simulation |
//! | [`skiagraph_truth`] | recordings, their retargeting, [`GroundTruth`](skiagraph_truth::scene::GroundTruth), observations |
//! | [`skiagraph_track`] | motion models, the filter, likelihoods: depends on `skiagraph-core` alone, and cannot name the truth |
//! | [`skiagraph_set`] | a set on disk: observations and truth apart |
//! | [`skiagraph_eval`] | [`METRICS`](skiagraph_eval::METRICS), and a [`Summary`](skiagraph_eval::Summary) with intervals over seeds |
//!
//! # Conventions
//!
//! Metres, radians and seconds; millimetres and degrees appear only in names that say so. The world is right-handed
//! with Z up and the ground at z = 0. Cameras look along +Z with x right and y down; pixel (0, 0) is the outer corner
//! of the top-left pixel. `a_from_b` names a transform, `p_in_a` a point. The same inputs and seed give the same bits
//! on any number of threads.
//!
//! # Example
//!
//! A body raises an arm before two cameras. A filter follows the silhouettes and is measured against the truth.
//!
//! ```
//! use nalgebra::Vector3;
//! use skiagraph_core::body::{Motion, ProposalScales, shipped};
//! use skiagraph_core::camera::{CameraRig, RingParameters};
//! use skiagraph_eval::{Sequence, evaluate};
//! use skiagraph_track::motion_model::{Diffusion, DiffusionSettings};
//! use skiagraph_track::tracker::{AnnealedParticleFilter, FilterSettings, Tracker};
//! use skiagraph_track::tracker::{SilhouetteLikelihood, SilhouetteSettings};
//! use skiagraph_truth::observing::observe;
//! use skiagraph_truth::scene::GroundTruth;
//!
//! // the motion
//! let body = shipped("tracker25")?;
//! let shoulder = body.find_degree_of_freedom("left_shoulder_abduction").ok_or("no such joint")?;
//! let mut pose = body.zero_pose();
//! pose.world_from_root.translation.vector = Vector3::new(0.0, 0.0, 0.95);
//! let raised = |frame: usize| {
//!     let mut pose = pose.clone();
//!     pose.joint_angles[shoulder] = 0.05 * frame as f64;
//!     pose
//! };
//! let motion = Motion { frames_per_second: 30.0, poses: (0..6).map(raised).collect() };
//!
//! // what two cameras see of it
//! let ring = RingParameters { count: 2, radius: 3.5, image_size: [80, 60], ..RingParameters::default() };
//! let rig = CameraRig::ring(&ring)?;
//! let truth = GroundTruth::from_motion(body.clone(), &motion, &rig)?;
//! let observations = observe(&truth, &rig);
//!
//! // a tracker, which is told the start pose
//! let scales = ProposalScales::for_human(&body, motion.frames_per_second);
//! let model = Diffusion::new(body.clone(), &scales, &DiffusionSettings::default())?;
//! let likelihood = SilhouetteLikelihood::new(body.clone(), &rig, SilhouetteSettings::default())?;
//! let settings = FilterSettings { particles: 40, layers: 3, ..FilterSettings::default() };
//! let mut filter = AnnealedParticleFilter::new(settings, model, likelihood, 1)?;
//! filter.start(&motion.poses[0]);
//! let estimates = observations.iter().map(|seen| filter.track(seen)).collect::<Result<Vec<_>, _>>()?;
//!
//! // its error
//! let markers = |pose: &_| body.markers(&body.link_frames(pose));
//! let true_markers: Vec<_> = motion.poses.iter().map(markers).collect();
//! let estimated: Vec<_> = estimates.iter().map(|estimate| markers(&estimate.pose)).collect();
//! let measured = evaluate(&Sequence::from_markers(motion.frames_per_second, &true_markers, &estimated))?;
//! let error = measured.metrics["humaneva_mm"].mean;
//! assert!(error < 100.0, "{error} mm");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `examples/` shows how to make a set, how to track it with a tracker of your own, and how to measure the result.
//!
//! # What is not promised
//!
//! Versions 0.x may change names and signatures. Items hidden from this documentation are not part of the interface:
//! they are public for the program, other crates of the workspace and tests. Truth (kinematics, projection,
//! silhouettes) has the same bits on every machine; learned models only on one type of CPU.

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

mod interface;

// The program's own rooms, public for its tests and benches. Users have the functions below, and the commands.
#[doc(hidden)]
pub mod artefacts;
#[doc(hidden)]
pub mod bound;
#[doc(hidden)]
pub mod checking;
#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod common;
#[doc(hidden)]
pub mod conformance;
#[doc(hidden)]
pub mod explain;
#[doc(hidden)]
pub mod export;
#[doc(hidden)]
pub mod external;
#[doc(hidden)]
pub mod faults;
#[doc(hidden)]
pub mod gating;
#[doc(hidden)]
pub mod import;
#[doc(hidden)]
pub mod inspect;
#[doc(hidden)]
pub mod measure;
#[doc(hidden)]
pub mod prepare;
#[doc(hidden)]
pub mod rendering;
#[doc(hidden)]
pub mod runs;
#[doc(hidden)]
pub mod scenario;
#[doc(hidden)]
pub mod segmentation;
#[doc(hidden)]
pub mod sweep;
#[cfg(test)]
#[path = "../crates/test_support/bodies.rs"]
pub mod test_bodies;
#[cfg(test)]
#[path = "../crates/test_support/cameras.rs"]
pub mod test_cameras;
#[cfg(test)]
#[path = "../crates/test_support/figure.rs"]
pub mod test_figure;
#[doc(hidden)]
pub mod tracking;
#[doc(hidden)]
pub mod train;
#[doc(hidden)]
pub mod twin;

#[doc(inline)]
pub use artefacts::Destination;
#[doc(inline)]
pub use common::ExperimentError;
pub use interface::{Measured, RunSide, TrackerSource, compare, measure, render, track};
#[doc(inline)]
pub use measure::Tracked;
#[doc(inline)]
pub use scenario::{ScenarioError, ScenarioFile, TrackerSettings};

pub use skiagraph_eval::RunComparison;
pub use skiagraph_set::{BenchmarkSet, BlindSet, TruthSet};
pub use skiagraph_track::tracker::Tracker;

/// The linear algebra of poses, frames and points in this interface.
pub use nalgebra;
