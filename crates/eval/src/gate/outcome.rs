//! The gate's outcome, and the reasons why it may refuse.

use serde::Serialize;

use super::MarginError;
use super::more_seeds::MoreSeeds;
use crate::comparison::{Difference, IntervalUnit};
use crate::{Interval, Unit};

/// Verdict of a gate or of one check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GateVerdict {
    /// Not worse than the baseline by more than the margin.
    Pass,
    /// Undecidable with these seeds.
    Inconclusive,
    /// Worse by more than the margin.
    Fail,
}

impl GateVerdict {
    /// `PASS`, `FAIL` or `INCONCLUSIVE`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "PASS",
            Self::Fail => "FAIL",
            Self::Inconclusive => "INCONCLUSIVE",
        }
    }
}

/// A gate with all its checks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GateOutcome {
    /// `skiagraph.gate_outcome/1`.
    pub schema: String,
    /// The worst of all checks.
    pub verdict: GateVerdict,
    /// Runs whose error is mostly explained by how their estimate was read.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub misread: Vec<String>,
    /// The unit of the intervals.
    pub unit: IntervalUnit,
    /// Describes what the intervals cover and do not cover.
    pub scope: String,
    /// In the requested order.
    pub checks: Vec<Check>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// The subject of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CheckKind {
    /// A metric against its margin.
    Budget,
    /// Values that must not change.
    Exact,
    /// The share of markers that have an estimate.
    Coverage,
    /// Runs that lost the body.
    LostTracks,
}

/// One check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// The metric's name, or `lost_tracks`.
    pub metric: String,
    /// The clip; `None` for all clips together.
    pub clip: Option<String>,
    /// The subject.
    pub kind: CheckKind,
    /// The verdict.
    pub verdict: GateVerdict,
    /// Unit of the values.
    pub unit: Unit,
    /// Run minus baseline.
    pub difference: Option<Difference>,
    /// By how much the metric is worse, whether lower or higher is better.
    pub worse_by: Option<f64>,
    /// 95 % interval of `worse_by`.
    pub worse_by_ci95: Option<Interval>,
    /// By how much the metric may be worse.
    pub margin: Option<f64>,
    /// Number of seeds that would decide an inconclusive check.
    pub more_seeds: Option<MoreSeeds>,
    /// The reason, if the numbers do not show it.
    pub reason: Option<String>,
}

impl Check {
    /// A check of all clips together, without numbers.
    pub(super) fn new(metric: &str, kind: CheckKind, unit: Unit, verdict: GateVerdict) -> Self {
        Self {
            metric: metric.to_owned(),
            clip: None,
            kind,
            verdict,
            unit,
            difference: None,
            worse_by: None,
            worse_by_ci95: None,
            margin: None,
            more_seeds: None,
            reason: None,
        }
    }
}

/// Why a run cannot be compared with a baseline.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GateRefusal {
    /// They have too few seeds in common, other sets or other protocols, or a rule does not fit them.
    #[error("{0}")]
    Refused(String),
    /// A margin does not fit its metric.
    #[error(transparent)]
    Margin(#[from] MarginError),
}
