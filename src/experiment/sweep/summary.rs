//! What a sweep found: every setting over its seeds.

use serde::Serialize;
use serde_json::{Map, Value};

use super::cell::REPORTS;
use super::plan::PlannedSweep;
use super::plan_file::SweepCell;
use super::record::{CellRecord, Status, SweepResults};
use super::run::in_words;
use crate::evaluation::{Interval, Metric, ValueRange, find_metric, mean, mean_interval};
use crate::experiment::ExperimentError;

/// All settings of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepSummary {
    /// `skiagraph.sweep_summary/1`.
    pub schema: &'static str,
    /// The sweep's name.
    pub name: String,
    /// The metric that settings are compared by.
    pub objective: String,
    /// The names of the axes.
    pub axes: Vec<String>,
    /// The seeds.
    pub seeds: Vec<u64>,
    /// Number of cells.
    pub cells: usize,
    /// Cells without a result.
    pub missing: usize,
    /// The settings, in the order of the plan.
    pub settings: Vec<SettingSummary>,
}

/// One setting over its seeds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SettingSummary {
    /// Its number in the plan.
    pub setting: usize,
    /// Axes and values.
    pub axes: Map<String, Value>,
    /// The same in words.
    pub words: String,
    /// The objective, one value a seed; `None` where there is none.
    pub values: Vec<Option<f64>>,
    /// Its mean over the seeds that have it.
    pub mean: Option<f64>,
    /// 95 % interval of the mean; `None` below three seeds and where all are equal.
    pub ci95: Option<Interval>,
    /// Likelihood evaluations of a frame.
    pub evaluations_per_frame: Option<f64>,
    /// Processor milliseconds of tracking a frame: this differs from run to run.
    pub processor_ms_per_frame: Option<f64>,
    /// Mean of the objective for a tracker that never moves.
    pub frozen: Option<f64>,
    /// Seeds whose tracker lost the body.
    pub diverged: usize,
    /// Its cells.
    pub cells: Vec<CellSummary>,
}

/// One cell of a setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellSummary {
    /// Its place in the plan.
    pub index: usize,
    /// Its id.
    pub cell: String,
    /// Its seed.
    pub seed: u64,
    /// What became of it; `None` without a result.
    pub status: Option<Status>,
    /// Why it failed.
    pub error: Option<String>,
    /// Whether it left a report.
    pub report: bool,
}

impl SweepSummary {
    /// Of all results that are there.
    ///
    /// # Errors
    /// [`ExperimentError`] where the plan cannot be read.
    pub fn new(sweep: &PlannedSweep) -> Result<Self, ExperimentError> {
        let cells = sweep.cells()?;
        let plan = &sweep.plan;
        let metric = find_metric(&plan.objective);
        let mut summary = Self {
            schema: "skiagraph.sweep_summary/1",
            name: plan.name.clone(),
            objective: plan.objective.clone(),
            axes: plan.axes.clone(),
            seeds: plan.seeds.clone(),
            cells: cells.len(),
            missing: 0,
            settings: Vec::with_capacity(plan.settings),
        };
        let reports = sweep.root.join(REPORTS);
        let has_reports = reports.is_dir();
        let mut begun: Vec<(SweepCell, Option<CellRecord>)> = Vec::new();
        SweepResults::new(sweep).for_each(&cells, |cell, record| {
            summary.missing += usize::from(record.is_none());
            if begun.first().is_some_and(|(first, _)| first.setting != cell.setting) {
                summary.settings.push(setting(&begun, metric, &plan.objective));
                begun.clear();
            }
            begun.push((cell.clone(), record));
            Ok(())
        })?;
        if !begun.is_empty() {
            summary.settings.push(setting(&begun, metric, &plan.objective));
        }
        if has_reports {
            for cell in summary.settings.iter_mut().flat_map(|setting| &mut setting.cells) {
                cell.report = reports.join(&cell.cell).join(crate::experiment::REPORT_FILE).is_file();
            }
        }
        Ok(summary)
    }

    /// The metric that settings are compared by.
    pub fn metric(&self) -> Option<&'static Metric> {
        find_metric(&self.objective)
    }

    /// Settings that were measured, the best first.
    pub fn ranked(&self) -> Vec<&SettingSummary> {
        let mut ranked: Vec<&SettingSummary> = self.settings.iter().filter(|setting| setting.mean.is_some()).collect();
        let is_worse = |a: f64, b: f64| self.metric().is_some_and(|metric| metric.is_worse(a, b));
        ranked.sort_by(|a, b| {
            let (a, b) = (a.mean.unwrap_or_default(), b.mean.unwrap_or_default());
            if is_worse(a, b) {
                std::cmp::Ordering::Greater
            } else if is_worse(b, a) {
                std::cmp::Ordering::Less
            } else {
                std::cmp::Ordering::Equal
            }
        });
        ranked
    }
}

fn setting(cells: &[(SweepCell, Option<CellRecord>)], metric: Option<&Metric>, objective: &str) -> SettingSummary {
    let records = || cells.iter().filter_map(|(_, record)| record.as_ref());
    let measured = || records().filter(|record| record.status != Status::Failed);
    let values: Vec<Option<f64>> = cells
        .iter()
        .map(|(_, record)| record.as_ref().and_then(|record| record.metrics.get(objective).copied()))
        .collect();
    let present: Vec<f64> = values.iter().flatten().copied().collect();
    let range = metric.map_or(ValueRange::Any, Metric::value_range);
    let per_frame = |of: &dyn Fn(&CellRecord) -> f64| {
        let all: Vec<f64> = measured().filter(|r| r.frames > 0).map(|r| of(r) / r.frames as f64).collect();
        mean(&all)
    };
    let frozen: Vec<f64> = measured().filter_map(|record| record.frozen).collect();
    let first = cells.first().map(|(cell, _)| cell);
    SettingSummary {
        setting: first.map_or(0, |cell| cell.setting),
        axes: first.map(|cell| cell.axes.clone()).unwrap_or_default(),
        words: first.map(in_words).unwrap_or_default(),
        mean: mean(&present),
        ci95: mean_interval(&[present], range).map(|(interval, _)| interval),
        values,
        evaluations_per_frame: per_frame(&|record| record.likelihood_evaluations as f64),
        processor_ms_per_frame: per_frame(&|record| 1e3 * record.env.track_processor_s),
        frozen: mean(&frozen),
        diverged: records().filter(|record| record.status == Status::Diverged).count(),
        cells: cells
            .iter()
            .map(|(cell, record)| CellSummary {
                index: cell.index,
                cell: cell.cell.clone(),
                seed: cell.seed,
                status: record.as_ref().map(|record| record.status),
                error: record.as_ref().and_then(|record| record.error.clone()),
                report: false,
            })
            .collect(),
    }
}
