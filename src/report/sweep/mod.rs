//! The page of a sweep: error against cost, what matters, what to choose.

mod analysis;
mod figure_files;
mod figures;
mod heat;
mod input;
mod markdown;
mod page;
mod picture;
mod shown;

pub use analysis::{Choice, CostMeasure, Effect, cheapest_within, difference, effects, pareto_front};
pub use figure_files::sweep_figures;
pub use input::{EverySetting, SweepCellState, SweepPageInput, SweepPoint};
pub use markdown::sweep_markdown;
pub use page::sweep_page;
pub use picture::sweep_picture;
