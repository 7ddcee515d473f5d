//! How far a sweep is, by its result files alone.

use serde::Serialize;

use super::index_ranges::to_ranges;
use super::plan::PlannedSweep;
use super::record::{Status, SweepResults};
use crate::experiment::ExperimentError;

/// How far a sweep is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepStatus {
    /// `skiagraph.sweep_status/1`.
    pub schema: &'static str,
    /// The sweep's name.
    pub name: String,
    /// Number of cells.
    pub cells: usize,
    /// Cells with a result.
    pub done: usize,
    /// Those of them whose tracker lost the body.
    pub diverged: usize,
    /// Those of them that cannot be run.
    pub failed: usize,
    /// Indices of cells that cannot be run: `3,7-8`.
    pub failed_cells: String,
    /// Indices of cells without a result: `3,7-8`.
    pub missing: String,
}

/// How far a sweep is. Nothing but the presence of result files counts: no clock, no engine.
///
/// # Errors
/// [`ExperimentError`] where the plan cannot be read.
pub fn sweep_status(sweep: &PlannedSweep) -> Result<SweepStatus, ExperimentError> {
    let cells = sweep.cells()?;
    let statuses = SweepResults::new(sweep).statuses(&cells);
    let indices = |wanted: Option<Status>| {
        let found = statuses.iter().enumerate().filter(|(_, status)| **status == wanted);
        found.map(|(index, _)| index).collect::<Vec<usize>>()
    };
    let (missing, failed) = (indices(None), indices(Some(Status::Failed)));
    Ok(SweepStatus {
        schema: "skiagraph.sweep_status/1",
        name: sweep.plan.name.clone(),
        cells: cells.len(),
        done: cells.len() - missing.len(),
        diverged: indices(Some(Status::Diverged)).len(),
        failed: failed.len(),
        failed_cells: to_ranges(&failed),
        missing: to_ranges(&missing),
    })
}
