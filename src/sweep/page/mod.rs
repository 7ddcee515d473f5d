//! The page of a sweep: recommended settings, error against cost, effects of the axes; also as Markdown, figures and a
//! picture.

mod analysis;
mod figures;
mod heat;
mod html;
mod input;
mod markdown;
mod picture;
mod shown;

pub use analysis::{Choice, CostMeasure, Effect, cheapest_within, difference, effects, pareto_front};
pub use figures::sweep_figures;
pub use html::sweep_page;
pub use input::{SweepPageInput, ask};
pub use markdown::sweep_markdown;
pub use picture::sweep_picture;
