//! Reads the results of a sweep into its summary.

use std::path::PathBuf;

use super::ignored::remarks;
use super::plan::PlannedSweep;
use super::plan_file::{SweepCell, describe_axes};
use super::results::{CellRecord, Status, SweepResults};
use super::summary::{CellSummary, SettingSummary, SweepSummary};
use crate::artefacts::REPORTS;
use crate::common::ExperimentError;
use crate::measure::REPORT_FILE;
use skiagraph_core::parallel;
use skiagraph_eval::{ValueRange, mean};

/// Whether an axis is a setting that several programs share, which the overrides name one by one.
fn is_shared(cells: &[SweepCell], axis: &str) -> bool {
    let ending = format!(".program.settings.{}", axis.strip_prefix("settings.").unwrap_or(axis));
    let is_its = |assignment: &String| assignment.split('=').next().is_some_and(|key| key.ends_with(&ending));
    cells.iter().any(|cell| cell.axes.contains_key(axis) && cell.overrides.iter().any(is_its))
}

impl SweepSummary {
    /// Summarises all existing results.
    pub fn new(sweep: &PlannedSweep) -> Result<Self, ExperimentError> {
        let (plan, cells) = (&sweep.plan, sweep.cells()?);
        let mut summary = Self {
            schema: "skiagraph.sweep_summary/1",
            name: plan.name.clone(),
            objective: plan.objective.clone(),
            axes: plan.axes.clone(),
            seeds: plan.seeds.clone(),
            cells: cells.len(),
            missing: 0,
            remarks: Vec::new(),
            settings: Vec::new(),
        };
        let reader = SettingReader {
            results: SweepResults::new(sweep),
            objective: &plan.objective,
            range: summary.range(),
            reports: Some(sweep.root.join(REPORTS)).filter(|reports| reports.is_dir()),
        };
        let of_settings: Vec<&[SweepCell]> = cells.chunk_by(|a, b| a.setting == b.setting).collect();
        let read = |at: usize| reader.read(of_settings[at]).labelled(&plan.axes);
        summary.settings = parallel::map(of_settings.len(), read);
        summary.missing = summary.all_cells().filter(|(_, cell)| cell.status.is_none()).count();
        summary.remarks = remarks(&summary, |axis| sweep.is_of_program(axis) || is_shared(&cells, axis));
        Ok(summary)
    }
}

struct SettingReader<'a> {
    results: SweepResults<'a>,
    objective: &'a str,
    range: ValueRange,
    reports: Option<PathBuf>,
}

impl SettingReader<'_> {
    fn read(&self, cells: &[SweepCell]) -> SettingSummary {
        let records: Vec<Option<CellRecord>> = cells.iter().map(|cell| self.results.get(&cell.cell)).collect();
        let measured = || records.iter().flatten().filter(|record| record.status != Status::Failed);
        let per_frame = |of: fn(&CellRecord) -> f64| {
            // the cost of an external program is not measured
            let with_frames = measured().filter(|record| record.frames > 0 && record.estimates.is_none());
            mean(&with_frames.map(|record| of(record) / record.frames as f64).collect::<Vec<f64>>())
        };
        let metric =
            |name: &str| -> Vec<f64> { measured().filter_map(|record| record.metrics.get(name).copied()).collect() };
        let axes = cells.first().map(|cell| cell.axes.clone()).unwrap_or_default();
        let setting = SettingSummary {
            setting: cells.first().map_or(0, |cell| cell.setting),
            words: describe_axes(&axes),
            axes,
            evaluations_per_frame: per_frame(|record| record.likelihood_evaluations as f64),
            processor_ms_per_frame: per_frame(|record| 1e3 * record.env.track_processor_s),
            frozen: mean(&measured().filter_map(|record| record.frozen).collect::<Vec<f64>>()),
            diverged: records.iter().flatten().filter(|record| record.status == Status::Diverged).count(),
            coverage: metric("coverage").into_iter().reduce(f64::min),
            lost_frames: metric("lost_frames").into_iter().reduce(f64::max),
            cells: cells.iter().zip(&records).map(|(cell, record)| self.cell(cell, record.as_ref())).collect(),
            ..SettingSummary::default()
        };
        let value = |record: &Option<CellRecord>| record.as_ref()?.metrics.get(self.objective).copied();
        setting.with_values(records.iter().map(value).collect(), self.range)
    }

    fn cell(&self, cell: &SweepCell, record: Option<&CellRecord>) -> CellSummary {
        let has_report = |reports: &PathBuf| reports.join(cell.report_folder()).join(REPORT_FILE).is_file();
        CellSummary {
            index: cell.index,
            cell: cell.cell.clone(),
            seed: cell.seed,
            status: record.map(|record| record.status),
            error: record.and_then(|record| record.error.clone()),
            report: self.reports.as_ref().is_some_and(has_report),
            report_folder: cell.report_folder().to_owned(),
            estimates: record.and_then(|record| record.estimates.clone()),
            set: cell.set.clone(),
            env: record.map(|record| record.env.clone()).unwrap_or_default(),
            coverage: record.and_then(|record| record.metrics.get("coverage").copied()),
        }
    }
}
