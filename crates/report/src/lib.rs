//! Pictures, plots and self-contained HTML pages.
//!
//! [`render`] turns a [`ReportInput`] into a self-contained page, which [`SetPage`] uses for a set, and
//! [`difference_page()`] shows how runs or methods differ. Parts can be used separately: [`overlay`] draws skeletons
//! through a camera, [`contact_sheet()`] puts views and frames into one picture, [`plots`] makes SVG.
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

mod base64;
mod body_sheet;
mod cell;
mod comparison;
mod contact_sheet;
mod difference_page;
mod difference_rows;
mod difference_text;
#[doc(hidden)]
pub mod displayed;
mod drawing;
mod error_map;
mod figure_file;
mod figure_files;
mod figures;
#[cfg(test)]
mod fixture;
mod gate_text;
mod grading;
mod heat_map;
#[doc(hidden)]
pub mod html;
mod input;
mod lettering;
mod metric_groups;
#[doc(hidden)]
pub mod overlay;
mod page;
mod playback;
#[doc(hidden)]
pub mod plots;
mod round_ticks;
mod set_page;
#[cfg(test)]
#[path = "../../test_support/figure.rs"]
pub mod test_figure;

// For the application, whose pages these are: users see the pages.
#[doc(hidden)]
pub use self::{
    body_sheet::BodySheet,
    cell::{CELL_HEIGHT, CELL_WIDTH},
    comparison::{ComparedMethod, error_plot, partial_share},
    contact_sheet::contact_sheet,
    difference_page::difference_page,
    difference_text::{comparison_markdown, comparison_text},
    figure_file::FigureFile,
    figure_files::{comparison_figures, run_figures},
    figures::ResponsiveSvg,
    gate_text::GateReport,
    grading::{Grade, GradeRow, PreferredPose, Verdict, is_lost, verdict},
    heat_map::heat_map,
    input::{
        FactGroup, FootStances, ReportError, ReportInput, ReportRun, Sheet, SheetFrame, Shown, describe_bodies,
        frames_to_show, typical_run, worst_frames,
    },
    metric_groups::aliases,
    page::render,
    playback::{PackedView, Playback, PlaybackBudget, PlaybackPlan},
    set_page::{KeypointMark, SetKeypointMarks, SetPage},
};

/// The mark of all pages and pictures written by skiagraph, by which it recognises its own files.
pub(crate) const GENERATOR: &str = concat!("skiagraph ", env!("CARGO_PKG_VERSION"));
