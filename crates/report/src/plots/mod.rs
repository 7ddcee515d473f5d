//! Plots: lines with bands, bars and points.
//!
//! A plot is a list of shapes, which is drawn as SVG or as a part of a picture. SVG uses the colours for a light
//! background. A page's rules ([`css_rules`]) replace each colour by a CSS variable, so that the plot follows the
//! page's light or dark theme ([`css_variables`]); a plot in a separate file contains both ([`Svg::standalone`]).

mod axes;
mod bars;
mod colour;
mod lines;
mod scatter;
mod shapes;
mod spans;

pub use bars::{Bar, BarGroup, BarPlot};
pub(super) use colour::hex;
pub use colour::{Colour, Stroke, css_rules, css_variables};
pub use lines::{Line, LinePlot};
pub use scatter::{ScatterGroup, ScatterPlot, ScatterPoint};
pub use shapes::Svg;
pub use spans::{SpanPlot, SpanRow};

/// Size of a plot in CSS pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    pub width: u32,
    pub height: u32,
}
