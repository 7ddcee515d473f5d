//! Errors of a tracker against the truth: one file per metric, one list of them ([`METRICS`]).
//!
//! [`evaluate`] takes a [`Sequence`] (positions, and what else is known) and gives an [`Evaluation`]; [`summarise`]
//! takes several, one per clip and seed, and gives a [`Summary`] with 95 % intervals. Any estimates can be measured:
//! marker positions suffice, and a metric without its input is absent, with a note of what it needs. A frame without an
//! estimate is lost: it is left out of means, and coverage is reported with every error.
//!
//! ```
//! use nalgebra::{Point3, Vector3};
//! use skiagraph_eval::{Sequence, evaluate};
//! let truth = vec![[Some(Point3::new(0.0, 0.0, 1.0)); 15]; 20];
//! let off_by_5_cm = vec![[Some(Point3::new(0.05, 0.0, 1.0)); 15]; 20];
//! let evaluation = evaluate(&Sequence::from_markers(60.0, &truth, &off_by_5_cm))?;
//! assert!((evaluation.metrics["humaneva_mm"].mean - 50.0).abs() < 1e-9);
//! # Ok::<(), skiagraph_eval::EvaluationError>(())
//! ```

#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::todo,
        clippy::unimplemented,
        clippy::dbg_macro,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]

mod balance;
mod boundary;
mod breakdown;
mod breakdown_summary;
mod comparison;
#[cfg(test)]
mod conformance;
mod contact_f1;
#[cfg(test)]
mod contact_fixture;
mod coverage;
mod crps;
mod derivatives;
mod ellipsoids;
mod energy_gap;
mod evaluate;
mod foot_skate;
mod gate;
mod global_mpjpe;
mod ground_gap;
mod humaneva;
mod humaneva_official;
mod interval;
mod interval_words;
mod lag;
mod limb_swaps;
mod limbs_exchanged;
mod lost_limb;
mod marker_list;
mod metric;
mod misreading;
mod mpjae;
mod mpjpe;
mod orientation;
mod pck;
mod pck_3dpw;
mod penetration;
mod per_frame;
mod procrustes;
mod protocol;
mod registry;
mod reprojection;
mod seed_run;
mod segmentation;
mod sequence;
mod silhouette;
mod statistics;
mod student;
mod summary;
#[cfg(test)]
#[path = "../../test_support/figure.rs"]
pub mod test_figure;
mod track_loss;

pub use breakdown::BreakdownGroup;
pub use breakdown_summary::BreakdownSummary;
pub use comparison::{
    AgainstBase, ClipValues, ComparedMetric, Difference, DifferenceRule, Finding, IntervalUnit, JointDifference,
    LostTracks, MeasuredClip, MeasuredMetric, MeasuredRuns, MergeError, NotComparable, Rate, RateDifference,
    RunComparison, SideFacts, changed_settings, compare_runs, difference, holm, lost_tracks, seeds_in_words,
    should_pair, shown_once,
};
pub use evaluate::{Evaluation, JointError, MetricValue, evaluate};
pub use gate::{
    Check, CheckKind, FEWEST_SEEDS, GateOutcome, GateRefusal, GateRules, GateVerdict, Margin, MarginError,
    MetricMargin, MoreSeeds, gate, seeds_to_decide,
};
pub use interval::{FEWEST_RUNS, Interval, IntervalRule, ValueRange, mean_interval};
pub use lost_limb::{LOST_LIMB_MM, LostStretch};
pub use marker_list::{MarkerList, PackedMarkers};
use metric::change;
pub use metric::{Direction, Measurement, Metric, Unit};
pub use misreading::{
    AxisOrder, Correction, GivenPositions, Misreading, MisreadingCase, MisreadingKind, find_misreading,
    marker_of_other_side, with_sides_exchanged,
};
pub use pck::{CurvePoint, PCK_THRESHOLD_MM};
pub use per_frame::write_per_frame;
pub use procrustes::Similarity;
#[doc(hidden)]
pub use registry::MAIN_METRICS;
pub use registry::{METRICS, find_metric};
pub use reprojection::PerCameraError;
pub use seed_run::SeedRun;
pub use segmentation::{BOUNDARY_TOLERANCE_PX, MaskQuality, SegmentationQuality, SilhouetteOutline};
pub use sequence::{
    ContactMeasures, ContactPair, Energies, EvaluationError, PARTS, PartRotations, RootRotations, Sequence, Views,
};
pub use silhouette::intersection_over_union;
pub use statistics::{FrameSpread, mean, quantile};
pub use summary::{JointSummary, LostStretchOfRun, MetricSummary, RunKey, Summary, summarise};
pub use track_loss::{LOSS_FRAMES, LOSS_THRESHOLD_MM};

#[cfg(test)]
use skiagraph_core::rng;
use skiagraph_core::{body, camera, contact, dynamics, raster};
