//! Errors by groups of markers and by camera, over several runs.

use serde::{Deserialize, Serialize};

use super::PerCameraError;
use super::breakdown::BreakdownGroup;
use super::interval::{Interval, ValueRange, mean_interval};
use super::seed_run::{SeedRun, by_clip, mean_over_clips};
use super::student::mean_of_means;

/// A group over all runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BreakdownSummary {
    /// As [`BreakdownGroup::by`].
    pub by: String,
    /// The group.
    pub group: String,
    /// Mean distance over clips of each clip's mean over seeds, millimetres.
    pub mean_mm: f64,
    /// 95 % interval of `mean_mm`.
    pub ci95: Option<Interval>,
    /// As [`BreakdownGroup::same_marker_mm`], over clips of each clip's mean over seeds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub same_marker_mm: Option<f64>,
    /// 95 % interval of `same_marker_mm`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub same_marker_ci95: Option<Interval>,
    /// Share of the markers, mean over clips and seeds.
    pub share: f64,
}

/// All groups over all runs, in order of first occurrence.
pub(super) fn summarise_groups(runs: &[SeedRun<'_>]) -> Vec<BreakdownSummary> {
    let mut names: Vec<(&str, &str)> = Vec::new();
    for group in runs.iter().flat_map(|run| &run.evaluation.breakdown) {
        let name = (group.by.as_str(), group.group.as_str());
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.into_iter().filter_map(|(by, group)| summarise_group(runs, by, group)).collect()
}

fn summarise_group(runs: &[SeedRun<'_>], by: &str, group: &str) -> Option<BreakdownSummary> {
    let find = |run: &SeedRun<'_>| -> Option<BreakdownGroup> {
        run.evaluation.breakdown.iter().find(|g| (g.by.as_str(), g.group.as_str()) == (by, group)).cloned()
    };
    let per_run: Vec<Option<f64>> = runs.iter().map(|run| Some(find(run)?.mean_mm)).collect();
    let clips = by_clip(runs, &per_run);
    let differences: Vec<Option<f64>> = runs.iter().map(|run| find(run)?.same_marker_mm).collect();
    let differences = by_clip(runs, &differences);
    Some(BreakdownSummary {
        by: by.to_owned(),
        group: group.to_owned(),
        mean_mm: mean_of_means(&clips)?,
        ci95: mean_interval(&clips, ValueRange::NonNegative).map(|(ends, _)| ends),
        same_marker_mm: mean_of_means(&differences),
        same_marker_ci95: mean_interval(&differences, ValueRange::Any).map(|(ends, _)| ends),
        share: mean_over_clips(runs, |run| Some(find(run)?.share))?,
    })
}

/// All cameras over all runs, in order of first occurrence.
pub(super) fn summarise_cameras(runs: &[SeedRun<'_>]) -> Vec<PerCameraError> {
    let mut names: Vec<&str> = Vec::new();
    for camera in runs.iter().flat_map(|run| &run.evaluation.per_camera) {
        if !names.contains(&camera.camera.as_str()) {
            names.push(&camera.camera);
        }
    }
    let mean = |name: &str, value: fn(&PerCameraError) -> Option<f64>| {
        mean_over_clips(runs, |run| value(run.evaluation.per_camera.iter().find(|camera| camera.camera == name)?))
    };
    let summary = |name: &str| PerCameraError {
        camera: name.to_owned(),
        error_px: mean(name, |camera| camera.error_px),
        overlap: mean(name, |camera| camera.overlap),
        boundary_f: mean(name, |camera| camera.boundary_f),
        visible: mean(name, |camera| camera.visible),
        over_time: Vec::new(),
    };
    names.into_iter().map(summary).collect()
}
