//! What a gate answers, and why it may refuse to.

use serde::Serialize;

use super::MarginError;
use super::more_seeds::MoreSeeds;
use crate::comparison::{Difference, IntervalUnit};
use crate::interval_words::WITHOUT_SEEDS;
use crate::{Interval, Unit};

/// What a gate says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GateVerdict {
    /// Not worse than the baseline by more than the margin.
    Pass,
    /// Cannot be said with these seeds.
    Inconclusive,
    /// Worse by more than the margin.
    Fail,
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
    /// What the intervals run over.
    pub unit: IntervalUnit,
    /// What they run over and what they cannot speak of, in words.
    pub scope: String,
    /// In the order in which they were asked for.
    pub checks: Vec<Check>,
    /// What a user should know.
    pub notes: Vec<String>,
}

/// What a check is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CheckKind {
    /// A metric against its margin.
    Budget,
    /// Values that must not change.
    Exact,
    /// The share of markers with an estimate.
    Coverage,
    /// Runs that lost the body.
    LostTracks,
}

/// One check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// The metric's name, or `lost_tracks`.
    pub metric: String,
    /// In which clip; `None` for all together.
    pub clip: Option<String>,
    /// What it is about.
    pub kind: CheckKind,
    /// What it says.
    pub verdict: GateVerdict,
    /// Unit of the values.
    pub unit: Unit,
    /// Run minus baseline.
    pub difference: Option<Difference>,
    /// By how much the metric is worse, whichever way that is; its 95 % interval.
    pub worse_by: Option<f64>,
    /// 95 % interval of it.
    pub worse_by_ci95: Option<Interval>,
    /// By how much it may be worse.
    pub margin: Option<f64>,
    /// What would decide it, if it is inconclusive.
    pub more_seeds: Option<MoreSeeds>,
    /// The reason in words, where numbers do not say it.
    pub reason: Option<String>,
}

impl Check {
    /// Of all clips together, without numbers.
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

/// Why a run cannot be held against a baseline.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GateRefusal {
    /// Too few seeds.
    #[error(
        "{which} has {found} seed(s) of `{clip}`, a gate needs {needed} or more; run it with --seeds {needed}, or, if the \
         tracker draws no random numbers, measure it on {needed} draws of the observation's noise or {needed} clips \
         (docs/ci.md)"
    )]
    Seeds {
        /// The run or the baseline.
        which: &'static str,
        /// The clip.
        clip: String,
        /// Seeds found.
        found: usize,
        /// Seeds needed.
        needed: usize,
    },
    /// All runs are copies.
    #[error(
        "all runs of a set are the same to the bit, in run and baseline: the tracker draws no random numbers, copies are \
         one observation, and a gate needs {needed}; {WITHOUT_SEEDS}"
    )]
    Copies {
        /// Units needed.
        needed: usize,
    },
    /// Too few of the unit that was asked for.
    #[error(
        "a gate over {unit} needs {needed} or more that run and baseline have in common and that differ{}; add them to \
         both, or choose another unit",
        if *unit == IntervalUnit::Draws { ", of every clip" } else { "" }
    )]
    Units {
        /// The unit.
        unit: IntervalUnit,
        /// Units needed.
        needed: usize,
    },
    /// Clips are not the same.
    #[error("the baseline has the clip(s) {baseline}, the run {run}; measure the run on all of them")]
    Clips {
        /// Of the baseline.
        baseline: String,
        /// Of the run.
        run: String,
    },
    /// The sets are not the same.
    #[error(
        "`{clip}` is another set than the baseline's ({what}); measure the run on the baseline's set, or save a new \
         baseline"
    )]
    Set {
        /// The clip.
        clip: String,
        /// The difference.
        what: String,
    },
    /// Other seeds, unasked.
    #[error(
        "`{clip}`: the baseline has seeds {baseline}, the run {run}; run the baseline's seeds (they are paired), or \
         accept others with --other-seeds"
    )]
    SeedPolicy {
        /// The clip.
        clip: String,
        /// Of the baseline.
        baseline: String,
        /// Of the run.
        run: String,
    },
    /// A metric was measured in another way.
    #[error(
        "{metric} in `{clip}` was measured by another protocol than the baseline's: `{baseline}`, now `{run}`; save a \
         new baseline"
    )]
    Protocol {
        /// The metric.
        metric: String,
        /// The clip.
        clip: String,
        /// Of the baseline.
        baseline: String,
        /// Of the run.
        run: String,
    },
    /// A rule names what is not there.
    #[error("{0}")]
    Rule(String),
    /// A margin does not fit its metric.
    #[error(transparent)]
    Margin(#[from] MarginError),
}
