//! What the page of a sweep shows.

use crate::evaluation::{Interval, Metric};

/// A sweep's results.
#[derive(Clone, Debug)]
pub struct SweepPageInput {
    /// The sweep's name.
    pub title: String,
    /// Its description.
    pub description: String,
    /// The metric that settings are compared by.
    pub objective: &'static Metric,
    /// The seeds.
    pub seeds: Vec<u64>,
    /// Names of the axes.
    pub axes: Vec<String>,
    /// All settings, in the order of the plan.
    pub settings: Vec<SweepPoint>,
    /// What `settings` are means of; `None` where nothing was averaged over.
    pub every: Option<EverySetting>,
    /// By how much a setting may be worse than the best, in the objective's unit.
    pub within: f64,
    /// Facts: what was run, with what.
    pub facts: Vec<(String, String)>,
}

/// All settings before some axes were averaged over, to see how much those matter.
#[derive(Clone, Debug)]
pub struct EverySetting {
    /// The axes that were averaged over.
    pub over: Vec<String>,
    /// Names of all axes.
    pub axes: Vec<String>,
    /// The settings, in the order of the plan.
    pub settings: Vec<SweepPoint>,
}

impl SweepPageInput {
    /// Axes and settings, nothing averaged.
    pub(super) fn unaveraged(&self) -> (&[String], &[SweepPoint]) {
        match &self.every {
            Some(every) => (&every.axes, &every.settings),
            None => (&self.axes, &self.settings),
        }
    }

    /// What was averaged over, in words; empty for nothing.
    pub(super) fn averages(&self) -> String {
        let over = self.every.as_ref().map(|every| every.over.join(", "));
        over.map_or_else(String::new, |over| format!("Every setting is the mean over all values of {over}."))
    }
}

/// One setting over its seeds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SweepPoint {
    /// Axes and values in words.
    pub words: String,
    /// Value of every axis as a table shows it; empty where the setting lacks the axis.
    pub labels: Vec<String>,
    /// Value of every axis that is a number.
    pub numbers: Vec<Option<f64>>,
    /// The objective of the seeds that have it.
    pub values: Vec<f64>,
    /// Its mean.
    pub mean: Option<f64>,
    /// 95 % interval of the mean.
    pub interval: Option<Interval>,
    /// Likelihood evaluations of a frame.
    pub evaluations: Option<f64>,
    /// Processor milliseconds of a frame.
    pub processor_ms: Option<f64>,
    /// The objective of a tracker that never moves.
    pub frozen: Option<f64>,
    /// Its cells.
    pub cells: Vec<SweepCellState>,
}

/// What became of one cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SweepCellState {
    /// Its index.
    pub index: usize,
    /// Its seed.
    pub seed: u64,
    /// `ok`, `diverged`, `failed` or `missing`.
    pub state: &'static str,
    /// Why it failed.
    pub error: Option<String>,
    /// Its report, relative to the page.
    pub report: Option<String>,
}

impl SweepPoint {
    /// How many of its seeds lost the body.
    pub fn diverged(&self) -> usize {
        self.cells.iter().filter(|cell| cell.state == "diverged").count()
    }
}
