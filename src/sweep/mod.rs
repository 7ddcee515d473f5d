//! Sweeps: many settings of one scenario, each with several seeds, on one machine or many.
//!
//! A [`Draft`] turns a sweep file into cells; frozen in a folder it is a [`PlannedSweep`]. Every cell is identified by
//! a hash of everything that its result depends on, and writes one result file atomically. Cells may therefore be run
//! by any process, repeatedly, in any order, and be killed at any time: [`run_sweep`] runs all, [`run_some`] those of a
//! part. [`sweep_status`], [`gather()`] and the [`page`] read these files only.
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

mod by_axis;
mod cell;
mod choice;
mod collection;
mod definition;
mod file;
mod identity;
mod ignored;
pub mod page;
mod parts;
mod plan;
mod plan_file;
mod results;
mod run;
mod setting_reader;
mod settings;
mod splits;
mod summary;
mod tables;
mod workers;

pub use by_axis::{AxisMeans, ByAxis, MeanOfTracker, Separation, ValueMeans, Verdict};
pub use cell::{CellDone, CellOptions, run_cell};
pub use choice::{Choice, cheapest_within, difference, pareto_front};
pub use collection::{Collected, CollectionOptions, make_sets};
pub use definition::{Expansion, Sweep, SweepTag};
pub use file::{AxisValue, SweepAxis, SweepFile};
pub use identity::InputFile;
pub use parts::{part_of, to_ranges};
pub use plan::{Draft, Planned, PlannedSweep};
pub use plan_file::{BaseRecord, PlanRecord, SweepCell};
pub use results::{CellRecord, Environment, Status};
pub use run::{Ran, RunOptions, run_some, run_sweep};
pub use splits::Splits;
pub use summary::{CellSummary, SettingSummary, SweepSummary};
pub use tables::{RUNS_LINES, RUNS_TABLE, SweepStatus, TIMING_TABLE, gather, sweep_status};
