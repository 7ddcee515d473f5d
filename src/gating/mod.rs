//! Gates: runs against baselines, and the seeds that a decision needs.

mod baseline;
mod gate;
mod more_seeds;
mod seed_advice;
pub(crate) mod seed_plan;

pub use baseline::{BASELINES, Baseline, Listed, Saved};
pub use gate::{GATE_FILE, check_metric, gate_run, read_rules};
pub use more_seeds::{add_missing_seeds, add_seeds};
pub use seed_plan::{NeededSeeds, SeedPlan, SeedPower, plan_seeds};
