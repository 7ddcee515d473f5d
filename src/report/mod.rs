//! Pictures, plots and self-contained HTML pages.
//!
//! [`render`] turns a [`ReportInput`] into a self-contained page, [`comparison_page`] compares methods,
//! [`difference_page()`] shows how runs differ, and [`model_page()`] shows what a motion model has learned. Its parts
//! can be used separately: [`overlay`] draws skeletons through a camera, [`contact_sheet()`] puts views and frames into
//! one picture, [`plots`] makes SVG.
//!
//! ```
//! use skiagraph::body::shipped;
//! use skiagraph::report::overlay::link_bones;
//! let body = shipped("tracker25")?;
//! let bones = link_bones(&body, &body.link_frames(&body.zero_pose()));
//! assert!(!bones.is_empty(), "to be drawn through a camera");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod animation;
mod base64;
mod body_sheet;
mod bound_chart;
pub(crate) mod cell;
mod chart_page;
mod comparison;
mod comparison_picture;
mod contact_chart;
mod contact_sheet;
mod difference_page;
mod difference_rows;
mod difference_sentence;
mod difference_text;
pub(crate) mod displayed;
pub(crate) mod drawing;
mod error_map;
mod explain_page;
mod figure_file;
mod figure_files;
mod figures;
#[cfg(test)]
mod fixture;
mod gate_text;
mod grading;
mod history_page;
pub(crate) mod html;
mod input;
mod landscape;
pub(crate) mod lettering;
mod metric_groups;
mod model_distances;
mod model_figures;
mod model_input;
mod model_page;
mod motion_strip;
mod overlaid_runs;
pub mod overlay;
mod page;
mod page_tables;
mod placement_picture;
mod playback;
pub mod plots;
pub(crate) mod round_ticks;
mod set_page;
mod summary_picture;
mod verdict;

pub use animation::write_animation;
pub use body_sheet::BodySheet;
pub use bound_chart::{BoundChart, BoundCourse};
pub use cell::{CELL_HEIGHT, CELL_WIDTH};
pub use comparison::{ComparedMethod, ComparisonInput, comparison_page, error_plot};
pub(crate) use comparison::{WHOLE_COVERAGE, partial_share};
pub use comparison_picture::comparison_picture;
pub use contact_chart::{ContactChart, FootCourse};
pub use contact_sheet::contact_sheet;
pub use difference_page::difference_page;
pub use difference_text::{comparison_markdown, comparison_text};
pub use explain_page::{ExplainPage, ExplainedPart, WorstOnPage};
pub use figure_file::FigureFile;
pub use figure_files::{comparison_figures, run_figures};
pub use gate_text::GateReport;
pub use grading::{Criterion, Grade};
pub use history_page::{BaselineVersion, VersionValue, history_page};
pub(crate) use input::describe_bodies;
pub use input::{
    FactGroup, FootStances, ReportError, ReportInput, ReportRun, Sheet, SheetFrame, Shown, frames_to_show, typical_run,
    worst_frames,
};
pub use landscape::LandscapePlot;
pub use metric_groups::aliases;
pub use model_distances::{CandidateFrame, FrameDistances};
pub use model_input::{LatentPath, ModelPageInput, OneModel, OtherModel};
pub use model_page::model_page;
pub use motion_strip::MotionStrip;
pub use overlaid_runs::{MOST_OVERLAID, OverlaidEstimate, OverlaidMoment, OverlaidRuns, overlaid_runs_page};
pub use page::render;
pub use placement_picture::{PlacedCamera, PlacementPicture};
pub use playback::{PackedView, Playback, PlaybackPlan};
pub use set_page::{KeypointMark, LayerPicture, SetKeypointMarks, SetLayers, SetMap, SetPage};
pub use summary_picture::{SummaryPicture, summary_picture};
pub use verdict::{Verdict, verdict};

/// The mark of all pages and pictures written by skiagraph, by which it recognises its own files.
pub(crate) const GENERATOR: &str = concat!("skiagraph ", env!("CARGO_PKG_VERSION"));
