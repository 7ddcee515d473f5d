//! Trackers: pose estimation from observations, without access to the ground truth.
//!
//! This crate depends on `skiagraph-core` alone, so a tracker cannot name the ground truth, motion capture or benchmark
//! sets. `tests/conventions/layering.rs` checks the manifest.
//!
//! ```
//! use skiagraph_core::body::shipped;
//! use skiagraph_core::observation::Observation;
//! use skiagraph_track::tracker::{Frozen, Tracker};
//! let body = shipped("tracker25")?;
//! let mut tracker = Frozen::default();
//! tracker.start(&body.zero_pose());
//! let nothing = Observation { frame: 0, time_s: 0.0, silhouettes: Vec::new(), moment: None, keypoints: None };
//! let estimate = tracker.track(&nothing)?;
//! assert_eq!(estimate.pose, body.zero_pose());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! See `examples/own_tracker.rs` for a custom tracker.

mod annealed_particle_filter;
mod annealing;
mod calibration;
mod combined_likelihood;
mod descent;
mod estimate;
#[cfg(test)]
mod fixture;
mod frozen;
mod information;
mod keypoint_likelihood;
mod keypoints;
mod likelihood;
mod limbs;
mod mask_trust;
mod observed_camera;
mod observed_view;
mod partition;
mod placed_body;
mod plausibility;
mod rectification;
mod refinement;
mod settings;
mod silhouette_likelihood;

pub use annealed_particle_filter::AnnealedParticleFilter;
pub use estimate::{Estimate, LayerRecord, TrackError};
pub use frozen::Frozen;
pub use likelihood::Likelihood;
pub use settings::{FilterSettings, SilhouetteSettings};
pub use silhouette_likelihood::SilhouetteLikelihood;

// Parts of the filter for the application, tests and studies.
#[doc(hidden)]
pub use self::{
    annealing::{Selection, select, systematic},
    calibration::{
        BodyCalibration, CALIBRATION_FRAMES, CALIBRATION_SPACING_S, CalibrationError, CalibrationReport,
        CalibrationTask, CalibrationVerdict, CameraCorrection, MIN_CALIBRATION_FRAMES, calibrate,
    },
    combined_likelihood::{CombinedLikelihood, CombinedScratch},
    information::{InformedBody, OutlineNoise, covariance, filtered, mean_length},
    keypoint_likelihood::{KeypointEvidenceSettings, KeypointLikelihood},
    keypoints::{KeypointTracker, KeypointTrackerSettings},
    partition::Partition,
    plausibility::PlausibilitySettings,
    refinement::{DescentSteps, Refinement, RefinementSettings, descend},
    settings::{ContourTerm, Estimator, Kernel, SilhouetteTerm},
    silhouette_likelihood::LikelihoodScratch,
};

use skiagraph_core::body::Pose;
use skiagraph_core::observation::Observation;

/// Tracks a body through observations. A tracker processes one sequence, once.
pub trait Tracker: Send {
    /// Short name, as on the command line.
    fn name(&self) -> &str;

    /// Sets the pose in the first frame.
    fn start(&mut self, start: &Pose);

    /// Estimates the pose for the next observation. Frames arrive in order; the first one is the frame of the start
    /// pose.
    ///
    /// # Errors
    /// [`TrackError`] if the observation does not match the tracker's cameras or no valid particle is left.
    fn track(&mut self, observation: &Observation) -> Result<Estimate, TrackError>;

    /// Improves the estimates of all frames after the last one, with what was seen later. Trackers that do not look
    /// back do nothing.
    fn look_back(&mut self, _estimates: &mut [Estimate]) {}
}
