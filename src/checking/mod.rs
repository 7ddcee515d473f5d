//! Checks of a scenario before any work: its files, its scene, and what a run will cost.

mod check;
mod cost;

pub use check::{CheckReport, check, unusable_files};
pub use cost::RunCost;
