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

use super::{Ladder, PlannedSweep, Suite, SuiteResults};
use crate::artefacts::{LADDER_PAGE, SUITE_PAGE};
use crate::common::ExperimentError;

/// The page of a ladder or a suite with its name in the folder; `None` for any other sweep.
///
/// # Errors
/// [`ExperimentError`] if the plan cannot be read or the page cannot be drawn.
pub fn own_page(
    sweep: &PlannedSweep,
    input: &SweepPageInput,
) -> Result<Option<(&'static str, String)>, ExperimentError> {
    let definition = sweep.definition()?.sweep;
    if Suite::is_whole(&definition) {
        return Ok(Some((SUITE_PAGE, suite_page(&SuiteResults::new(sweep)?, input)?)));
    }
    if definition.ladder_axes().is_none() {
        return Ok(None);
    }
    let ladder = Ladder::new(sweep)?;
    // a list of settings of other keys has no curve
    if ladder.curves.is_empty() { Ok(None) } else { Ok(Some((LADDER_PAGE, ladder_page(&ladder, input)?))) }
}
