//! Plots as SVG: lines with bands, bars, and paths through a plane.
//!
//! Colours are CSS variables with a fallback, so a plot in a page follows the page's light or dark theme
//! ([`css_variables`]) and a plot in its own file contains its theme ([`Svg::standalone`]).

mod bars;
mod lines;
mod paths;
mod scatter;
mod spans;
mod style;

pub use bars::{Bar, BarGroup, BarPlot};
pub use lines::{Line, LinePlot};
pub use paths::{Path, PathPanel, PathPlot};
pub use scatter::{ScatterGroup, ScatterPlot, ScatterPoint};
pub use spans::{SpanPlot, SpanRow};
pub use style::{Colour, Stroke, Svg, css_variables};

/// Size of a plot in CSS pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
}
