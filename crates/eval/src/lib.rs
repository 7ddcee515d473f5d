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
mod derivatives;
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
mod keypoint_residual;
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
mod over_time;
mod part_recall;
mod pck;
mod pck_3dpw;
mod penetration;
mod per_frame;
mod procrustes;
mod protocol;
mod reference;
mod registry;
mod reprojection;
mod seed_run;
mod segmentation;
mod sequence;
mod silhouette;
mod statistics;
mod student;
mod summary;
// test support, shared with the application, names this crate as that does
#[cfg(test)]
extern crate self as skiagraph_eval;
#[cfg(test)]
#[path = "../../test_support/figure.rs"]
pub mod test_figure;
mod track_loss;

pub use comparison::{AgainstBase, ComparedMetric, Difference, Finding, NotComparable, RunComparison, SideFacts};
pub use evaluate::{Evaluation, MetricValue, evaluate};
pub use interval::Interval;
use metric::change;
pub use metric::{Direction, Metric, Unit};
pub use registry::METRICS;
pub use seed_run::SeedRun;
pub use sequence::{EvaluationError, Sequence};
pub use summary::{MetricSummary, Summary, summarise};

// Parts of metrics, comparisons, gates and hints, for the application, tests and studies: users see them in results.
#[doc(hidden)]
pub use self::{
    breakdown::BreakdownGroup,
    breakdown_summary::BreakdownSummary,
    comparison::{
        ClipValues, DifferenceRule, IntervalUnit, JointDifference, LostTracks, MeasuredClip, MeasuredMetric,
        MeasuredRuns, MergeError, Rate, RateDifference, changed_settings, compare_runs, describe_seeds, difference,
        holm, lost_tracks, should_pair, shown_once,
    },
    evaluate::JointError,
    gate::{
        Check, CheckKind, FEWEST_SEEDS, GateOutcome, GateRefusal, GateRules, GateVerdict, Margin, MarginError,
        MetricMargin, MoreSeeds, PlanRefusal, PlannedTest, SamplePlan, equivalence, gate,
    },
    interval::{FEWEST_RUNS, IntervalRule, ValueRange, mean_interval},
    lost_limb::LostStretch,
    marker_list::{MarkerList, PackedMarkers},
    metric::Measurement,
    misreading::{
        AxisOrder, Correction, FileTime, Misreading, MisreadingCase, MisreadingKind, Reading, Root, Turn,
        find_misreading, marker_of_other_side, with_sides_exchanged,
    },
    part_recall::{PartRecall, is_part_sampled},
    pck::CurvePoint,
    per_frame::write_per_frame,
    procrustes::Similarity,
    reference::{AgainstReference, MarkerAgainstReference},
    registry::{MAIN_METRICS, find_metric, gone_metric},
    reprojection::PerCameraError,
    segmentation::{BOUNDARY_TOLERANCE_PX, MaskQuality, SegmentationQuality, SilhouetteOutline},
    sequence::{ContactMeasures, ContactPair, Energies, PARTS, PartRotations, RootRotations, Views},
    silhouette::intersection_over_union,
    statistics::{FrameSpread, mean, quantile},
    summary::{JointSummary, LostStretchOfRun, RunKey},
    track_loss::LOSS_THRESHOLD_MM,
};
use track_loss::LOSS_FRAMES;
