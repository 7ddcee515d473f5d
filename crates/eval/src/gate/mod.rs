//! The regression gate: whether a run is worse than a baseline by more than a margin.
//!
//! [`gate`] gives one of three answers to every budget: the 95 % interval of the worsening lies below the margin
//! (pass), above it (fail), or contains it (inconclusive, with the number of seeds that would decide it). The unit is
//! the run, never the frame: a test over correlated frames finds a difference between equal trackers 85 % of the time.

mod decide;
mod equivalence;
mod margin;
mod more_seeds;
mod outcome;
mod rules;
mod sample_size;
mod sides;

pub use decide::gate;
pub use equivalence::equivalence;
pub use margin::{Margin, MarginError};
pub use more_seeds::MoreSeeds;
pub use outcome::{Check, CheckKind, GateOutcome, GateRefusal, GateVerdict};
pub use rules::{FEWEST_SEEDS, GateRules, MetricMargin};
pub use sample_size::{PlanRefusal, PlannedTest, SamplePlan};
