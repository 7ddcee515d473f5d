//! Sweeps: many settings of one scenario, each with several seeds, on one machine or many.
//!
//! A [`Draft`] turns a sweep file into cells; frozen in a folder it is a [`PlannedSweep`]. Every cell is known by a
//! hash of all that its result depends on, and leaves one file, whole or not at all. So it does not matter who runs a
//! cell, how often, in which order, and who is killed meanwhile: [`run_sweep`] on this machine, [`run_cell`] for an
//! engine such as Slurm. [`sweep_status`] and [`gather()`] look at files alone.
//!
//! ```no_run
//! use skiagraph::experiment::sweep::{Draft, PlannedSweep, SweepSummary};
//! use skiagraph::scenario::SweepFile;
//! let file = SweepFile::open("scenarios/sweeps/particles-layers.toml".as_ref())?;
//! Draft::new(&file, None)?.freeze("sweeps/particles-layers".as_ref(), false)?;
//! let sweep = PlannedSweep::open("sweeps/particles-layers".as_ref())?;
//! for setting in SweepSummary::new(&sweep)?.ranked() {
//!     println!("{}: {:?}", setting.words, setting.mean);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cell;
mod command;
mod constraints;
mod estimate;
mod gather;
mod identity;
mod index_ranges;
mod page;
mod plan;
mod plan_file;
mod processor_time;
mod record;
mod run;
mod script;
mod settings;
mod shard;
mod shared;
mod status;
mod submit;
mod summary;

pub use cell::{CellDone, CellOptions, run_cell};
pub use estimate::{SweepCost, sweep_cost};
pub use gather::{Gathered, RUNS_LINES, RUNS_TABLE, TIMING_TABLE, gather};
pub use identity::InputFile;
pub use index_ranges::to_ranges;
pub use page::{ask, page_input};
pub(super) use plan::metric_named_like;
pub use plan::{Draft, Planned, PlannedSweep};
pub use plan_file::{BaseRecord, CELLS_FILE, PLAN_FILE, PlanRecord, SweepCell};
pub use record::{CellRecord, Environment, Status};
pub use run::{Best, Ran, RunOptions, RunProgress, SweepWatch, in_words, run_some, run_sweep};
pub(super) use script::quoted;
pub use shard::shard;
pub use status::{SweepStatus, sweep_status};
pub use submit::{Submission, SubmitOptions, submit};
pub use summary::{CellSummary, SettingSummary, SweepSummary};
