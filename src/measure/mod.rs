//! Measures estimates against the truth of a set, and writes the results.
//!
//! [`Tracked`] are estimates, of this program or read from files of others; [`Measures`] compares them with the truth;
//! [`RunResults`] are the files of a measured run.

mod body_contacts;
mod energies;
pub(crate) mod footage;
pub(crate) mod hints;
pub(crate) mod measuring;
mod missing_values;
mod part_rotations;
mod per_frame;
pub(crate) mod playback;
pub(crate) mod poses_file;
pub(crate) mod reference;
pub(crate) mod results;
pub(crate) mod search_file;
pub(crate) mod tracked;

pub use hints::Hint;
pub use measuring::{Measures, SeedMeasures};
pub use poses_file::{PIPELINES, Pipeline, PosesDeclared, ReadAs, UNITS_OF_LENGTH};
pub use results::{CONTACT_SHEET_FILE, LeftOutOverlap, PER_FRAME_FILE, REPORT_FILE, RUN_FILE, RunRecord, RunResults};
pub use search_file::SearchRecord;
pub use tracked::{TrackRecord, Tracked};
