//! Plots as SVG: lines with bands, bars, and paths through a plane.
//!
//! A plot is drawn in the colours of light paper. A page's rules ([`css_rules`]) replace each by a CSS variable, so
//! that the plot follows the page's light or dark theme ([`css_variables`]); a plot in its own file contains both
//! ([`Svg::standalone`]).

mod axis;
mod bars;
mod heat_plot;
mod lines;
mod paths;
mod scatter;
mod short_number;
mod spans;
mod style;

pub(crate) use axis::log_ticks;
pub use bars::{Bar, BarGroup, BarPlot};
pub use heat_plot::{HeatCell, HeatPlot};
pub use lines::{Line, LinePlot};
pub use paths::{Path, PathPanel, PathPlot};
pub use scatter::{ScatterGroup, ScatterPlot, ScatterPoint};
pub use spans::{SpanPlot, SpanRow};
pub use style::{Colour, Stroke, Svg, css_rules, css_variables};

/// Size of a plot in CSS pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
}
