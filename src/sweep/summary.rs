//! The results of a sweep: every setting over its seeds.

use std::collections::HashMap;

use serde::Serialize;
use serde_json::{Map, Value};

use super::plan_file::{describe_axes, table_text, without};
use super::results::{Environment, Status};
use crate::artefacts::REPORTS;
use crate::measure::REPORT_FILE;
use skiagraph_eval::{Direction, FEWEST_RUNS, Interval, Metric, ValueRange, find_metric, mean, mean_interval};

/// The axis of the trackers of a scenario with methods.
pub(super) const METHOD: &str = "method";

/// All settings of a sweep.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SweepSummary {
    /// `skiagraph.sweep_summary/1`.
    pub schema: &'static str,
    pub name: String,
    /// Metric to compare settings by.
    pub objective: String,
    pub axes: Vec<String>,
    pub seeds: Vec<u64>,
    pub cells: usize,
    /// Cells without a result.
    pub missing: usize,
    /// Remarks on external programs whose estimates do not depend on their settings or seeds.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub remarks: Vec<String>,
    /// The settings, in the order of the plan.
    pub settings: Vec<SettingSummary>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SettingSummary {
    /// Its number in the plan.
    pub setting: usize,
    pub axes: Map<String, Value>,
    /// Axes and values as text.
    pub words: String,
    /// Value of every axis of the sweep, as text for a table; empty if the setting lacks the axis.
    #[serde(skip)]
    pub labels: Vec<String>,
    /// The objective, one value per seed; `None` without a value.
    pub values: Vec<Option<f64>>,
    /// Its mean over the seeds with a value.
    pub mean: Option<f64>,
    /// 95 % interval of the mean; `None` below three seeds and if all values are equal.
    pub ci95: Option<Interval>,
    pub evaluations_per_frame: Option<f64>,
    /// Processor time of tracking per frame, ms; differs from run to run.
    pub processor_ms_per_frame: Option<f64>,
    /// Mean of the objective for a tracker that never moves.
    pub frozen: Option<f64>,
    /// Number of seeds that are graded lost.
    pub diverged: usize,
    /// Least share of the markers that have an estimate, of all cells; absent without a value.
    pub coverage: Option<f64>,
    /// Greatest share of frames without an estimate, of all cells; absent without a value.
    pub lost_frames: Option<f64>,
    pub cells: Vec<CellSummary>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CellSummary {
    /// Its place in the plan.
    pub index: usize,
    pub cell: String,
    pub seed: u64,
    /// Its outcome; `None` without a result.
    pub status: Option<Status>,
    pub error: Option<String>,
    pub report: bool,
    /// The folder of its report below `reports`.
    #[serde(skip)]
    pub report_folder: String,
    /// First digits of the SHA-256 of a program's estimates.
    #[serde(skip)]
    pub estimates: Option<String>,
    #[serde(skip)]
    pub set: String,
    #[serde(skip)]
    pub env: Environment,
    /// Share of the markers that have an estimate.
    #[serde(skip)]
    pub coverage: Option<f64>,
}

impl SweepSummary {
    pub fn all_cells(&self) -> impl Iterator<Item = (&SettingSummary, &CellSummary)> {
        self.settings.iter().flat_map(|setting| setting.cells.iter().map(move |cell| (setting, cell)))
    }

    /// Merges settings that differ only in these axes. The value of a merged setting for a seed is the mean over the
    /// merged ones, and missing if one of them is missing, so that its interval is again an interval over seeds.
    pub fn averaged_over(&self, over: &[String]) -> Self {
        if over.is_empty() {
            return self.clone();
        }
        let mut groups: Vec<(Map<String, Value>, Vec<&SettingSummary>)> = Vec::new();
        let mut places: HashMap<String, usize> = HashMap::new();
        for setting in &self.settings {
            let axes = without(&setting.axes, over);
            let place = *places.entry(describe_axes(&axes)).or_insert(groups.len());
            match groups.get_mut(place) {
                Some((_, members)) => members.push(setting),
                None => groups.push((axes, vec![setting])),
            }
        }
        let axes: Vec<String> = self.axes.iter().filter(|axis| !over.contains(axis)).cloned().collect();
        let one = |(of_one, members): (_, Vec<_>)| merge_settings(of_one, &members, self.range()).labelled(&axes);
        Self { settings: groups.into_iter().map(one).collect(), axes, ..self.clone() }
    }

    /// Whether there are enough seeds for a 95 % interval; otherwise results are given with their range over seeds.
    pub(crate) fn has_intervals(&self) -> bool {
        self.seeds.len() >= FEWEST_RUNS
    }

    /// Metric to compare settings by.
    pub fn metric(&self) -> Option<&'static Metric> {
        find_metric(&self.objective)
    }

    pub(super) fn range(&self) -> ValueRange {
        self.metric().map_or(ValueRange::Any, Metric::value_range)
    }

    /// Settings that are judged ([`SettingSummary::is_judged`]), best first.
    pub fn ranked(&self) -> Vec<&SettingSummary> {
        let rank = |mean: f64| self.metric().map_or(mean, |metric| badness(mean, metric));
        let mut known: Vec<&SettingSummary> = self.settings.iter().filter(|setting| setting.is_judged()).collect();
        known.sort_by(|a, b| {
            let of = |setting: &SettingSummary| setting.mean.map_or(f64::INFINITY, rank);
            of(a).total_cmp(&of(b)).then(a.setting.cmp(&b.setting))
        });
        known
    }

    /// The trackers: the values of the axis of trackers, or the only one.
    pub(super) fn trackers(&self, only: &str) -> Vec<String> {
        let mut trackers: Vec<String> = Vec::new();
        for method in self.settings.iter().filter_map(|setting| setting.axes.get(METHOD)) {
            let name = table_text(method);
            if !trackers.contains(&name) {
                trackers.push(name);
            }
        }
        if trackers.is_empty() { vec![only.to_owned()] } else { trackers }
    }
}

/// The value with its sign changed if necessary, so that lower is better.
pub(super) fn badness(value: f64, metric: &Metric) -> f64 {
    if metric.direction == Direction::HigherIsBetter { -value } else { value }
}

impl SettingSummary {
    /// The values of the objective, over the seeds that have one.
    pub fn present(&self) -> Vec<f64> {
        self.values.iter().flatten().copied().collect()
    }

    /// Minimum and maximum over seeds, for results with too few seeds for an interval; `None` below two seeds.
    pub(crate) fn range_over_seeds(&self) -> Option<[f64; 2]> {
        let values = self.present();
        let ends = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)]);
        (values.len() > 1).then_some(ends)
    }

    /// The ends of the 95 % interval, or with too few seeds the range over seeds.
    pub(crate) fn interval_or_range(&self, has_intervals: bool) -> Option<[f64; 2]> {
        if has_intervals { self.ci95.map(|interval| [interval.low, interval.high]) } else { self.range_over_seeds() }
    }

    pub(super) fn with_values(self, values: Vec<Option<f64>>, range: ValueRange) -> Self {
        let with = Self { values, ..self };
        let present = with.present();
        let ci95 = mean_interval(std::slice::from_ref(&present), range).map(|(interval, _)| interval);
        Self { mean: mean(&present), ci95, ..with }
    }

    pub(super) fn labelled(self, axes: &[String]) -> Self {
        let label = |axis: &String| self.axes.get(axis).map(table_text).unwrap_or_default();
        Self { labels: axes.iter().map(label).collect(), ..self }
    }
}

impl SettingSummary {
    /// Whether it may be compared with others: it has a value, no cell failed, and no frame is without an estimate.
    /// Errors do not count what a tracker leaves out.
    pub fn is_judged(&self) -> bool {
        let fails = |cell: &CellSummary| cell.status == Some(Status::Failed);
        self.mean.is_some() && self.lost_frames.is_none_or(|lost| lost == 0.0) && !self.cells.iter().any(fails)
    }

    /// Whether it is a setting of this tracker; in a sweep of one tracker, every setting is.
    pub(super) fn is_of(&self, tracker: &str) -> bool {
        self.axes.get(METHOD).is_none_or(|method| table_text(method) == tracker)
    }
}

impl CellSummary {
    /// Its outcome: `ok`, `diverged`, `failed` or `missing`.
    pub fn state(&self) -> &'static str {
        self.status.map_or("missing", Status::name)
    }

    /// Its report, relative to the sweep's folder.
    pub fn report_file(&self) -> Option<String> {
        self.report.then(|| format!("{REPORTS}/{}/{REPORT_FILE}", self.report_folder))
    }
}

fn merge_settings(axes: Map<String, Value>, members: &[&SettingSummary], range: ValueRange) -> SettingSummary {
    let seeds = members.iter().map(|member| member.values.len()).max().unwrap_or(0);
    let of_seed = |seed: usize| -> Option<f64> {
        let values = members.iter().map(|member| member.values.get(seed).copied().flatten());
        mean(&values.collect::<Option<Vec<f64>>>()?)
    };
    let over_members = |of: fn(&SettingSummary) -> Option<f64>| -> Option<f64> {
        mean(&members.iter().filter_map(|member| of(member)).collect::<Vec<f64>>())
    };
    let one = SettingSummary {
        setting: members.first().map_or(0, |member| member.setting),
        words: describe_axes(&axes),
        axes,
        evaluations_per_frame: over_members(|member| member.evaluations_per_frame),
        processor_ms_per_frame: over_members(|member| member.processor_ms_per_frame),
        frozen: over_members(|member| member.frozen),
        diverged: members.iter().map(|member| member.diverged).sum(),
        coverage: members.iter().filter_map(|member| member.coverage).reduce(f64::min),
        lost_frames: members.iter().filter_map(|member| member.lost_frames).reduce(f64::max),
        cells: members.iter().flat_map(|member| member.cells.iter().cloned()).collect(),
        ..SettingSummary::default()
    };
    one.with_values((0..seeds).map(of_seed).collect(), range)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(clip: &str, particles: u64, values: &[Option<f64>]) -> SettingSummary {
        let mut axes = Map::new();
        axes.insert("clip".to_owned(), clip.into());
        axes.insert("particles".to_owned(), particles.into());
        SettingSummary {
            words: describe_axes(&axes),
            axes,
            values: values.to_vec(),
            evaluations_per_frame: Some(10.0 * particles as f64),
            diverged: 1,
            ..SettingSummary::default()
        }
    }

    #[test]
    fn settings_that_differ_only_in_the_clip_are_merged_with_an_interval_over_seeds() {
        let summary = SweepSummary {
            objective: "humaneva_mm".to_owned(),
            axes: vec!["clip".to_owned(), "particles".to_owned()],
            seeds: vec![0, 1, 2],
            settings: vec![
                setting("walk", 5, &[Some(30.0), Some(32.0), Some(34.0)]),
                setting("walk", 9, &[Some(10.0), Some(12.0), None]),
                setting("run", 5, &[Some(50.0), Some(56.0), Some(60.0)]),
                setting("run", 9, &[Some(20.0), Some(22.0), Some(24.0)]),
            ],
            ..SweepSummary::default()
        };
        let one = summary.averaged_over(&["clip".to_owned()]);
        assert_eq!(one.axes, ["particles"]);
        assert_eq!(one.settings[1].labels, ["9"]);
        assert_eq!(one.settings.iter().map(|s| s.words.as_str()).collect::<Vec<_>>(), ["particles=5", "particles=9"]);
        assert_eq!(one.settings[0].values, [Some(40.0), Some(44.0), Some(47.0)]);
        assert_eq!((one.settings[0].diverged, one.settings[0].evaluations_per_frame), (2, Some(50.0)));
        let expected = mean_interval(&[vec![40.0, 44.0, 47.0]], ValueRange::NonNegative).unwrap().0;
        assert_eq!(one.settings[0].ci95, Some(expected));
        // the mean over the other clips would be biased
        assert_eq!(one.settings[1].values, [Some(15.0), Some(17.0), None]);
        assert_eq!(summary.averaged_over(&[]), summary);
    }
}
