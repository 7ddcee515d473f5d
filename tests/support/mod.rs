//! Code shared by several integration tests.
#![allow(dead_code, unused_imports, reason = "each test binary uses its own part")]

use std::path::PathBuf;
use std::process::Command;

use skiagraph_core::body::{Markers, shipped};
use skiagraph_truth::retarget::{FitOptions, Retargeted, SegmentLengths, fit_motion_to_markers, fit_shape};

#[path = "../../crates/test_support/data.rs"]
mod data;

pub(crate) use data::{path as test_data, skip};

/// A Python with NumPy: `$SKIAGRAPH_TEST_PYTHON`, otherwise `python3`. Without NumPy it reports this with [`skip`] and
/// returns `None`.
pub(crate) fn python_with_numpy() -> Option<PathBuf> {
    let python = std::env::var_os("SKIAGRAPH_TEST_PYTHON").map_or_else(|| PathBuf::from("python3"), PathBuf::from);
    let has_numpy = Command::new(&python).args(["-c", "import numpy"]).output().is_ok_and(|o| o.status.success());
    if !has_numpy {
        skip(&format!("{} has no NumPy (run pip install numpy, or set SKIAGRAPH_TEST_PYTHON)", python.display()));
    }
    has_numpy.then_some(python)
}

/// Distance between the markers of a motion and of `tracker25` scaled and fitted to it: mean over frames of the root
/// mean square, metres.
pub(crate) fn refit_to_the_trackers_body_m(truth: &Retargeted) -> f64 {
    let template = shipped("tracker25").unwrap();
    let tracker = template.reshaped(&fit_shape(&template, &SegmentLengths::from_body(&truth.humanoid)));
    let markers: Vec<Markers> =
        truth.motion.poses.iter().map(|pose| truth.humanoid.markers(&truth.humanoid.link_frames(pose))).collect();
    let fits = fit_motion_to_markers(&tracker, &markers, &tracker.zero_pose(), &FitOptions::default());
    let mean = fits.iter().map(|fit| fit.residual_rms_m).sum::<f64>() / fits.len() as f64;
    println!("tracker25 scaled to the actor: {:.1} mm RMS", 1000.0 * mean);
    mean
}
