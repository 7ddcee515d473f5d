//! Errors by camera over several runs.

use serde::{Deserialize, Serialize};

use super::reprojection::PerCameraError;
use super::seed_run::{SeedRun, mean_over_clips};

/// One camera over all runs: means over clips of each clip's mean over seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PerCameraSummary {
    /// Its name.
    pub camera: String,
    /// Mean 2-D error, pixels.
    pub error_px: Option<f64>,
    /// Mean overlap of silhouettes.
    pub overlap: Option<f64>,
    /// Mean agreement of outlines.
    pub boundary_f: Option<f64>,
    /// Share of the actor's markers that it sees.
    pub visible: Option<f64>,
}

/// All cameras over all runs, in the order in which they are met.
pub(super) fn summarise_cameras(runs: &[SeedRun<'_>]) -> Vec<PerCameraSummary> {
    let mut names: Vec<&str> = Vec::new();
    for camera in runs.iter().flat_map(|run| &run.evaluation.per_camera) {
        if !names.contains(&camera.camera.as_str()) {
            names.push(&camera.camera);
        }
    }
    let mean = |name: &str, value: fn(&PerCameraError) -> Option<f64>| {
        mean_over_clips(runs, |run| value(run.evaluation.per_camera.iter().find(|camera| camera.camera == name)?))
    };
    let summary = |name: &str| PerCameraSummary {
        camera: name.to_owned(),
        error_px: mean(name, |camera| camera.error_px),
        overlap: mean(name, |camera| camera.overlap),
        boundary_f: mean(name, |camera| camera.boundary_f),
        visible: mean(name, |camera| camera.visible),
    };
    names.into_iter().map(summary).collect()
}
