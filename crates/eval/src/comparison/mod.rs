//! Differences between two trackers or two versions of one, over seeds, draws of the noise or clips.
//!
//! [`compare_runs`] takes the runs of two sides ([`MeasuredRuns`]) and returns the [`Difference`] of every metric with
//! its 95 % interval. p values are adjusted for the number of metrics ([`holm`]). Lost tracks are compared as a
//! separate [`Rate`].
//!
//! ```
//! use skiagraph_eval::{ClipValues, IntervalUnit, difference};
//! let seeds = |values: [f64; 5]| values.into_iter().enumerate().map(|(seed, v)| (seed as u64, v)).collect();
//! let clip = ClipValues { base: seeds([30.0, 31.0, 29.0, 32.0, 30.0]), other: seeds([33.0, 34.5, 32.0, 34.0, 33.5]) };
//! let found = difference(&[clip], true, IntervalUnit::Seeds).unwrap();
//! assert!((found.difference - 3.0).abs() < 1e-12 && found.ci95.unwrap().low > 2.0);
//! ```

mod changed_settings;
mod compare;
mod compared;
mod difference;
mod interval_unit;
mod judge;
mod matched_runs;
mod measured_runs;
mod rate;
mod scope;

pub use changed_settings::changed_settings;
pub(crate) use compare::set_difference;
pub use compare::{compare_runs, lost_tracks, shown_once};
pub use compared::{
    AgainstBase, ComparedMetric, Finding, JointDifference, LostTracks, NotComparable, RunComparison, SideFacts,
};
pub use difference::{ClipValues, Difference, DifferenceRule, difference, should_pair};
pub use interval_unit::IntervalUnit;
pub use judge::holm;
pub(crate) use matched_runs::MatchedRuns;
#[cfg(test)]
pub(crate) use measured_runs::fixture;
pub use measured_runs::{MeasuredClip, MeasuredMetric, MeasuredRuns, MergeError, describe_seeds};
pub use rate::{Rate, RateDifference};
