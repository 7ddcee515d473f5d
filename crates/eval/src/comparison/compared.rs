//! What a comparison of runs says.

use std::collections::BTreeMap;

use serde::Serialize;

use super::difference::Difference;
use super::interval_unit::IntervalUnit;
use super::rate::{Rate, RateDifference};
use crate::{Direction, Unit};

/// Several sides against the first: what `skiagraph compare --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RunComparison {
    /// `skiagraph.compare/1`.
    pub schema: String,
    /// The side that all others are compared with.
    pub base: SideFacts,
    /// The others, in the order in which they were given.
    pub others: Vec<AgainstBase>,
}

/// What a side is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SideFacts {
    /// As the user calls it.
    pub name: String,
    /// Its trackers.
    pub trackers: Vec<String>,
    /// Draws of the noise and seeds of every clip, in words.
    pub seeds: BTreeMap<String, String>,
    /// Runs, clip x draw x seed.
    pub runs: usize,
    /// What its runs say of estimates that may have been misread; each with its clip.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub misread: Vec<String>,
}

/// One side against the base.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AgainstBase {
    /// The side.
    #[serde(flatten)]
    pub side: SideFacts,
    /// Clips that both have.
    pub clips: Vec<String>,
    /// What the intervals run over.
    pub unit: IntervalUnit,
    /// What they run over and what they cannot speak of, in words.
    pub scope: String,
    /// Whether the units are paired: seeds by the number of those in common ([`super::should_pair`]), draws on the same
    /// sets, clips by name.
    pub paired: bool,
    /// What was left out, and why.
    pub skipped: Vec<String>,
    /// Metric by metric, in the order of [`crate::METRICS`].
    pub metrics: Vec<ComparedMetric>,
    /// Marker by marker, in the order of [`crate::body::LANDMARKS`].
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
    /// Metrics with the same value in every run, which are not shown again.
    pub also: Vec<String>,
    /// Unit of all values but p.
    pub unit: Unit,
    /// Which way it is better.
    pub direction: Direction,
    /// Over all common clips.
    #[serde(flatten)]
    pub difference: Difference,
    /// The p value adjusted for the number of metrics ([`super::holm`]).
    pub p_holm: Option<f64>,
    /// What can be said.
    pub finding: Finding,
    /// Clip by clip.
    pub per_clip: BTreeMap<String, Difference>,
    /// Mean coverage of the runs of base and other: errors speak of the rest of the markers only.
    pub coverage: [Option<f64>; 2],
    /// Runs without a value, left out with their pairs.
    pub skipped: Vec<String>,
    /// Joint set, alignment, mask rule and frames, of the first clip.
    pub protocol: String,
}

/// What can be said of a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// The other side is better.
    Better,
    /// The other side is worse.
    Worse,
    /// They differ in a metric that is neither better nor worse.
    Differs,
    /// Equal in every run.
    Same,
    /// No difference is shown.
    NotShown,
    /// Too few runs to say.
    TooFew,
}

/// The error of one marker.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointDifference {
    /// [`crate::body::Landmark::name`].
    pub joint: String,
    /// Mean error, millimetres, over all common clips.
    #[serde(flatten)]
    pub difference: Difference,
}

/// Runs that lost the body: runs with a frame that counts as lost, and runs that could not be measured at all.
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
#[non_exhaustive]
pub enum NotComparable {
    /// They have no clip in common.
    #[error("`{base}` and `{other}` have no clip in common: {base_clips} and {other_clips}")]
    NoClip {
        /// Name of the base.
        base: String,
        /// Name of the other side.
        other: String,
        /// Clips of the base.
        base_clips: String,
        /// Clips of the other side.
        other_clips: String,
    },
    /// A clip was measured on two sets.
    #[error(
        "`{clip}` is another set in `{other}` than in `{base}` ({what}); measure both on one set, or compare them \
         unpaired with --across-sets"
    )]
    Sets {
        /// The clip.
        clip: String,
        /// Name of the base.
        base: String,
        /// Name of the other side.
        other: String,
        /// The difference, in words.
        what: String,
    },
    /// Nothing was measured on both sides in the same way.
    #[error("`{base}` and `{other}` have no metric in common that was measured by the same protocol")]
    NoMetric {
        /// Name of the base.
        base: String,
        /// Name of the other side.
        other: String,
    },
}
