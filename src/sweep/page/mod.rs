//! The page of a sweep: recommended settings, error against cost, effects of the axes; also as Markdown, figures and a
//! picture.

mod analysis;
mod figures;
mod heat;
mod html;
mod input;
mod ladder_page;
mod markdown;
mod picture;
mod shown;
mod suite_page;

pub use analysis::{Choice, CostMeasure, Effect, cheapest_within, difference, effects, pareto_front};
pub use figures::sweep_figures;
pub use html::sweep_page;
pub use input::{SweepPageInput, ask};
pub use ladder_page::ladder_page;
pub use markdown::sweep_markdown;
pub use picture::sweep_picture;
pub use suite_page::suite_page;
