//! Runs on disk: made from scenarios and sets, measured, read again, and compared with each other.
//!
//! [`run()`] renders, tracks and measures a scenario; [`render()`](crate::rendering::render()), [`track_set`] and
//! [`evaluate_run`] do these steps separately, with a benchmark set on disk, and give the same numbers.
//!
//! ```no_run
//! use skiagraph::artefacts::Destination;
//! use skiagraph::common::NoProgress;
//! use skiagraph::runs::run;
//! use skiagraph::scenario::ScenarioFile;
//! let walk = ScenarioFile::built_in(&["tracker.annealed_particle_filter.particles=50".to_owned()])?;
//! let done = run(&walk, None, Destination { path: "runs/walk".as_ref(), force: false }, &NoProgress)?;
//! println!("{:.1} mm", done.record.summary.metrics["humaneva_mm"].mean);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod comparison;
mod figure_files;
mod leave_one_out;
pub(crate) mod reading;
pub(crate) mod run;
mod run_place;
pub(crate) mod set_of_run;
pub(crate) mod set_tracking;
mod stored;

pub use comparison::{COMPARISON_FILE, COMPARISON_PAGE, Compared, MethodComparison, MethodRecord, compare};
pub use figure_files::{stored_figures, write_figures};
pub use reading::{ComparedSide, SidesToCompare, compare_sides, read_runs};
pub use run::{EvaluateOptions, Evaluated, RunOutcome, evaluate_run, run};
pub use run_place::RunPlace;
pub use set_of_run::MoreOf;
pub use set_tracking::{TrackOptions, check_program, track_set, track_set_with_program};
pub use stored::{has_methods, runs_of_one_set};
