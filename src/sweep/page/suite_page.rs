//! The page of a suite: failures first, then every condition with intervals over clips, then all runs.

use serde::Serialize;

use super::input::SweepPageInput;
use crate::evaluation::{Direction, Metric};
use crate::report::ReportError;
use crate::report::displayed::{between, number, symbol};
use crate::report::html::render_page;
use crate::sweep::coverage;
use crate::sweep::suite::{StratumValue, SuiteResults, SuiteRun};

const TEMPLATE: &str = include_str!("suite.html");

#[derive(Serialize)]
struct SuitePage<'a> {
    title: &'a str,
    description: &'a str,
    objective: &'a str,
    unit: &'static str,
    lower_is_better: bool,
    trackers: &'a [String],
    cells: usize,
    incomplete: usize,
    remarks: &'a [String],
    failures: Vec<RunRow<'a>>,
    strata: Vec<StratumRow<'a>>,
    runs: Vec<RunRow<'a>>,
    facts: &'a [(String, String)],
}

#[derive(Serialize)]
struct StratumRow<'a> {
    name: &'a str,
    values: Vec<ValueCell>,
}

#[derive(Serialize)]
struct ValueCell {
    mean: String,
    note: String,
}

#[derive(Serialize)]
struct RunRow<'a> {
    state: &'a str,
    tracker: &'a str,
    conditions: &'a str,
    seed: u64,
    value: String,
    error: &'a str,
    report: Option<&'a str>,
}

impl StratumValue {
    /// The mean as text.
    pub(crate) fn mean_text(&self, metric: &Metric) -> String {
        self.mean.map_or("-".to_owned(), |mean| number(mean, metric.unit))
    }

    /// The interval over clips, or how many clips there are, and what went wrong.
    pub(crate) fn note(&self, metric: &Metric) -> String {
        let clips = if self.clips == 1 { "1 clip".to_owned() } else { format!("{} clips", self.clips) };
        let mut words = vec![match self.ci95 {
            Some(ends) => format!("{} over {clips}", between(ends.low, ends.high, metric.unit)),
            None => clips,
        }];
        words.extend((self.lost > 0).then(|| format!("{} lost", self.lost)));
        words.extend((self.missing > 0).then(|| format!("{} missing", self.missing)));
        words.extend(coverage::note(self.coverage));
        words.join(", ")
    }
}

/// The page of a suite: self-contained HTML.
///
/// # Errors
/// [`ReportError`] if the template fails.
pub fn suite_page(results: &SuiteResults, input: &SweepPageInput) -> Result<String, ReportError> {
    let metric = input.objective;
    let value = |value: &StratumValue| ValueCell { mean: value.mean_text(metric), note: value.note(metric) };
    let stratum = results
        .strata
        .iter()
        .map(|stratum| StratumRow { name: &stratum.name, values: stratum.values.iter().map(value).collect() });
    let page = SuitePage {
        title: &results.name,
        description: &input.description,
        objective: metric.title,
        unit: symbol(metric.unit),
        lower_is_better: metric.direction != Direction::HigherIsBetter,
        trackers: &results.trackers,
        cells: results.cells,
        incomplete: results.incomplete,
        remarks: &results.remarks,
        failures: results.failures().map(|run| row(run, metric)).collect(),
        strata: stratum.collect(),
        runs: results.runs.iter().map(|run| row(run, metric)).collect(),
        facts: &input.facts,
    };
    render_page(TEMPLATE, &page)
}

fn row<'a>(run: &'a SuiteRun, metric: &Metric) -> RunRow<'a> {
    RunRow {
        state: run.state,
        tracker: &run.tracker,
        conditions: &run.conditions,
        seed: run.seed,
        value: run.value.map_or("-".to_owned(), |value| number(value, metric.unit)),
        error: run.error.as_deref().unwrap_or_default(),
        report: run.report.as_deref(),
    }
}
