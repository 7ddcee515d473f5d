//! Recomputes the poses of the tracker's body nearest to the truth.

use crate::body::{Humanoid, Markers, Motion};
use crate::retarget::{FitOptions, fit_motion_to_markers};
use crate::scene::GroundTruth;

/// Tolerance of poses, metres and radians: the termination tolerance of the fit.
pub(super) const TOLERANCE: f64 = 1e-6;

/// The motion of a body whose markers are nearest to the actor's, found by the same fit as when the set was made.
pub(super) fn nearest_motion(body: &Humanoid, truth: &GroundTruth) -> Motion {
    let markers: Vec<Markers> = truth.frames.iter().map(|frame| frame.markers).collect();
    let fits = fit_motion_to_markers(body, &markers, &body.zero_pose(), &FitOptions::default());
    let poses = fits.into_iter().map(|fit| fit.pose).collect();
    Motion { frames_per_second: truth.frames_per_second, poses }.made_continuous(body)
}
