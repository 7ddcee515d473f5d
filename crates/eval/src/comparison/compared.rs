//! The result of a comparison of runs.

use std::collections::BTreeMap;

use serde::Serialize;

use super::difference::Difference;
use super::interval_unit::IntervalUnit;
use super::rate::{Rate, RateDifference};
use crate::{Direction, Unit};

/// Several sides compared with the first: the output of `skiagraph compare --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RunComparison {
    /// `skiagraph.compare/1`.
    pub schema: String,
    /// The side that all others are compared with.
    pub base: SideFacts,
    /// The others in the given order.
    pub others: Vec<AgainstBase>,
}

/// Facts about a side.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SideFacts {
    /// Its name given by the user.
    pub name: String,
    /// Its trackers.
    pub trackers: Vec<String>,
    /// Description of draws of the noise and seeds of every clip.
    pub seeds: BTreeMap<String, String>,
    /// Runs, clip x draw x seed.
    pub runs: usize,
    /// Hints of its runs about estimates that may have been misread, each with its clip.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub misread: Vec<String>,
}

/// One side compared with the base.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AgainstBase {
    /// The side.
    #[serde(flatten)]
    pub side: SideFacts,
    /// Clips that both sides have.
    pub clips: Vec<String>,
    /// Unit of the intervals.
    pub unit: IntervalUnit,
    /// Description of what the intervals cover and do not cover.
    pub scope: String,
    /// Whether the units are paired: seeds by the number of those in common ([`super::should_pair`]), draws on the same
    /// sets, clips by name.
    pub paired: bool,
    /// Omitted data, with the reason.
    pub skipped: Vec<String>,
    /// Metric by metric, in the order of [`crate::METRICS`].
    pub metrics: Vec<ComparedMetric>,
    /// Marker by marker, in the order of [`skiagraph_core::body::LANDMARKS`].
    pub joints: Vec<JointDifference>,
    /// Runs that lost the body.
    pub lost_tracks: LostTracks,
}

/// One metric of two sides.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ComparedMetric {
    /// [`crate::Metric::name`].
    pub metric: String,
    /// Metrics with the same value in every run, which are not shown separately.
    pub also: Vec<String>,
    /// Unit of all values except p.
    pub unit: Unit,
    /// Direction of improvement.
    pub direction: Direction,
    /// Over all common clips.
    #[serde(flatten)]
    pub difference: Difference,
    /// The p value adjusted for the number of metrics ([`super::holm`]).
    pub p_holm: Option<f64>,
    /// The conclusion.
    pub finding: Finding,
    /// Clip by clip.
    pub per_clip: BTreeMap<String, Difference>,
    /// Mean coverage of the runs of base and other: errors are only about markers with an estimate.
    pub coverage: [Option<f64>; 2],
    /// Runs without a value, left out with their pairs.
    pub skipped: Vec<String>,
    /// Joint set, alignment, mask rule and frames, of the first clip.
    pub protocol: String,
}

/// Conclusion from a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// The other side is better.
    Better,
    /// The other side is worse.
    Worse,
    /// They differ in a metric without a direction of improvement.
    Differs,
    /// Equal in every run.
    Same,
    /// No difference is shown.
    NotShown,
    /// Too few runs: for an interval, or to show a difference that is the same in all of them.
    TooFew,
}

/// The error of one marker.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointDifference {
    /// [`skiagraph_core::body::Landmark::name`].
    pub joint: String,
    /// Mean error, millimetres, over all common clips.
    #[serde(flatten)]
    pub difference: Difference,
}

/// Runs that lost the body: runs with lost frames, and runs that could not be measured at all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LostTracks {
    /// Of the base.
    pub base: Option<Rate>,
    /// Of the other side.
    pub other: Option<Rate>,
    /// Other minus base.
    pub difference: Option<RateDifference>,
}

/// Why sides cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NotComparable(pub(super) String);
