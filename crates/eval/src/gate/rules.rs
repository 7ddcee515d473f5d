//! The rules of a gate.

use serde::{Deserialize, Serialize};

use super::Margin;
use crate::IntervalUnit;

/// A gate refuses fewer seeds, draws or clips than these.
pub const FEWEST_SEEDS: usize = 5;

/// The rules of a gate: the content of `gate.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GateRules {
    /// Least number of seeds per set, draws per clip, or clips, of run and baseline; at least [`FEWEST_SEEDS`].
    #[serde(default = "fewest")]
    pub seeds: usize,
    /// Unit of the intervals; by default the first of seeds, draws and clips of which there are enough.
    #[serde(default)]
    pub unit: Option<IntervalUnit>,
    /// Metrics with their margins; at least one.
    #[serde(default, rename = "budget")]
    pub budgets: Vec<MetricMargin>,
    /// Metrics whose values must not change at all, seed by seed.
    #[serde(default)]
    pub exact: Vec<String>,
    /// Whether the metrics of the truth (`truth_...`) must not change at all.
    #[serde(default = "yes")]
    pub exact_truth: bool,
    /// By how much the coverage may fall: errors leave out markers without an estimate.
    #[serde(default = "coverage")]
    pub coverage: Margin,
    /// Whether more lost tracks fail the gate.
    #[serde(default = "yes")]
    pub lost_tracks: bool,
    /// Whether the run may have seeds other than the baseline's.
    #[serde(default)]
    pub other_seeds: bool,
}

/// One metric with its margin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MetricMargin {
    /// [`crate::Metric::name`].
    pub metric: String,
    /// How much it may worsen.
    pub margin: Margin,
    /// Only this clip; by default all clips together.
    #[serde(default)]
    pub clip: Option<String>,
}

fn fewest() -> usize {
    FEWEST_SEEDS
}

fn yes() -> bool {
    true
}

fn coverage() -> Margin {
    Margin::from_number(0.01)
}

impl GateRules {
    /// One metric over all clips, and defaults for everything else.
    pub fn from_metric(metric: &str, margin: Margin) -> Self {
        Self {
            seeds: FEWEST_SEEDS,
            unit: None,
            budgets: vec![MetricMargin { metric: metric.to_owned(), margin, clip: None }],
            exact: Vec::new(),
            exact_truth: true,
            coverage: coverage(),
            lost_tracks: true,
            other_seeds: false,
        }
    }
}
