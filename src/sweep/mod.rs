//! Sweeps: many settings of one scenario, each with several seeds, on one machine or many.
//!
//! A [`Draft`] turns a sweep file into cells; frozen in a folder it is a [`PlannedSweep`]. Every cell is known by a
//! hash of all that its result depends on, and leaves one file, whole or not at all. So it does not matter who runs a
//! cell, how often, in which order, and who is killed meanwhile: [`run_sweep`] on this machine, [`run_cell`] for an
//! engine such as Slurm. [`sweep_status`] and [`gather()`] look at files alone, and so does the [`page`].
//!
//! ```no_run
//! use skiagraph::sweep::{Draft, PlannedSweep, SweepFile, SweepSummary};
//! let file = SweepFile::open("scenarios/sweeps/particles-layers.toml".as_ref())?;
//! Draft::new(&file, None)?.freeze("sweeps/particles-layers".as_ref(), false)?;
//! let sweep = PlannedSweep::open("sweeps/particles-layers".as_ref())?;
//! for setting in SweepSummary::new(&sweep)?.ranked() {
//!     println!("{}: {:?}", setting.words, setting.mean);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cell;
mod constraints;
mod definition;
mod estimate;
mod file;
mod identity;
pub mod page;
mod plan;
mod plan_file;
mod results;
mod run;
mod settings;
mod shards;
mod slurm;
mod summary;
mod tables;

pub use cell::{CellDone, CellOptions, run_cell};
pub use definition::{Expansion, Sweep, SweepBudget, SweepTag};
pub use estimate::{SweepCost, sweep_cost};
pub use file::{AxisValue, SweepAxis, SweepFile};
pub use identity::InputFile;
pub use plan::{Draft, Planned, PlannedSweep};
pub use plan_file::{BaseRecord, CELLS_FILE, PLAN_FILE, PlanRecord, SweepCell};
pub use results::{CellRecord, Environment, Status};
pub use run::{Ran, RunOptions, run_some, run_sweep};
pub use shards::{shard, to_ranges};
pub use slurm::{Submission, SubmitOptions, submit};
pub use summary::{CellSummary, SettingSummary, SweepSummary};
pub use tables::{RUNS_LINES, RUNS_TABLE, SweepStatus, TIMING_TABLE, gather, sweep_status};
