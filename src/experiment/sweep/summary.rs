//! What a sweep found: every setting over its seeds.

use std::collections::HashMap;

use serde::Serialize;
use serde_json::{Map, Value};

use super::cell::REPORTS;
use super::plan::PlannedSweep;
use super::plan_file::SweepCell;
use super::record::{CellRecord, Status, SweepResults};
use super::run::{axes_in_words, in_words, without};
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

    /// The same with settings that differ in these axes alone made one. Its value for a seed is the mean over them, and
    /// missing where one of them is, so that its interval is again one over seeds.
    pub fn averaged_over(&self, over: &[String]) -> Self {
        if over.is_empty() {
            return self.clone();
        }
        let mut groups: Vec<(Map<String, Value>, Vec<&SettingSummary>)> = Vec::new();
        let mut places: HashMap<String, usize> = HashMap::new();
        for setting in &self.settings {
            let axes = without(&setting.axes, over);
            let place = *places.entry(axes_in_words(&axes)).or_insert(groups.len());
            match groups.get_mut(place) {
                Some((_, members)) => members.push(setting),
                None => groups.push((axes, vec![setting])),
            }
        }
        let range = self.metric().map_or(ValueRange::Any, Metric::value_range);
        Self {
            axes: self.axes.iter().filter(|axis| !over.contains(axis)).cloned().collect(),
            settings: groups.into_iter().map(|(axes, members)| together(axes, &members, range)).collect(),
            ..self.clone()
        }
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

/// Settings as one.
fn together(axes: Map<String, Value>, members: &[&SettingSummary], range: ValueRange) -> SettingSummary {
    let seeds = members.iter().map(|member| member.values.len()).max().unwrap_or(0);
    let of_seed = |seed: usize| -> Option<f64> {
        let values = members.iter().map(|member| member.values.get(seed).copied().flatten());
        mean(&values.collect::<Option<Vec<f64>>>()?)
    };
    let values: Vec<Option<f64>> = (0..seeds).map(of_seed).collect();
    let present: Vec<f64> = values.iter().flatten().copied().collect();
    let over_members = |of: fn(&SettingSummary) -> Option<f64>| -> Option<f64> {
        mean(&members.iter().filter_map(|member| of(member)).collect::<Vec<f64>>())
    };
    SettingSummary {
        setting: members.first().map_or(0, |member| member.setting),
        words: axes_in_words(&axes),
        axes,
        mean: mean(&present),
        ci95: mean_interval(&[present], range).map(|(interval, _)| interval),
        values,
        evaluations_per_frame: over_members(|member| member.evaluations_per_frame),
        processor_ms_per_frame: over_members(|member| member.processor_ms_per_frame),
        frozen: over_members(|member| member.frozen),
        diverged: members.iter().map(|member| member.diverged).sum(),
        cells: members.iter().flat_map(|member| member.cells.iter().cloned()).collect(),
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

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(clip: &str, particles: u64, values: &[Option<f64>]) -> SettingSummary {
        let mut axes = Map::new();
        axes.insert("clip".to_owned(), clip.into());
        axes.insert("particles".to_owned(), particles.into());
        SettingSummary {
            setting: 0,
            words: axes_in_words(&axes),
            axes,
            values: values.to_vec(),
            mean: None,
            ci95: None,
            evaluations_per_frame: Some(10.0 * particles as f64),
            processor_ms_per_frame: None,
            frozen: None,
            diverged: 1,
            cells: Vec::new(),
        }
    }

    #[test]
    fn settings_that_differ_in_the_clip_alone_become_one_with_an_interval_over_seeds() {
        let summary = SweepSummary {
            schema: "skiagraph.sweep_summary/1",
            name: "a".to_owned(),
            objective: "humaneva_mm".to_owned(),
            axes: vec!["clip".to_owned(), "particles".to_owned()],
            seeds: vec![0, 1, 2],
            cells: 12,
            missing: 1,
            settings: vec![
                setting("walk", 5, &[Some(30.0), Some(32.0), Some(34.0)]),
                setting("walk", 9, &[Some(10.0), Some(12.0), None]),
                setting("run", 5, &[Some(50.0), Some(56.0), Some(60.0)]),
                setting("run", 9, &[Some(20.0), Some(22.0), Some(24.0)]),
            ],
        };
        let one = summary.averaged_over(&["clip".to_owned()]);
        assert_eq!(one.axes, ["particles"]);
        assert_eq!(one.settings.iter().map(|s| s.words.as_str()).collect::<Vec<_>>(), ["particles=5", "particles=9"]);
        assert_eq!(one.settings[0].values, [Some(40.0), Some(44.0), Some(47.0)]);
        assert_eq!((one.settings[0].diverged, one.settings[0].evaluations_per_frame), (2, Some(50.0)));
        let expected = mean_interval(&[vec![40.0, 44.0, 47.0]], ValueRange::NonNegative).unwrap().0;
        assert_eq!(one.settings[0].ci95, Some(expected));
        // a clip without a result would make the others look better or worse than they are
        assert_eq!(one.settings[1].values, [Some(15.0), Some(17.0), None]);
        assert_eq!(summary.averaged_over(&[]), summary);
    }
}
