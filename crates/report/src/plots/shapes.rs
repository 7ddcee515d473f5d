//! The shapes of plots, such as lines, areas, dots and text, and their SVG.

use std::fmt::Write;

use super::colour::hex;
use super::{Colour, Size, Stroke, css_rules, css_variables};
use crate::{GENERATOR, ReportError};

/// Shapes in drawing order; CSS pixels from the top left.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PlotDrawing {
    pub(crate) shapes: Vec<Shape>,
    /// Position of the horizontal axis, so that a page's script can mark a frame: left, right, top and bottom of the
    /// plot, and the values at the ends of the axis.
    pub(super) axis: Option<[f64; 6]>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    Line {
        points: Vec<[f64; 2]>,
        stroke: Stroke,
        width: f64,
    },
    /// A filled polygon.
    Area {
        corners: Vec<[f64; 2]>,
        colour: Colour,
        opacity: f64,
    },
    Rectangle {
        corner: [f64; 2],
        size: [f64; 2],
        colour: Colour,
    },
    Dot {
        centre: [f64; 2],
        radius: f64,
        colour: Colour,
    },
    Text {
        words: String,
        at: [f64; 2],
        pixels: f64,
        colour: Colour,
        side: TextSide,
    },
}

/// Horizontal anchor of a text; vertically it is always centred.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TextSide {
    Start,
    Middle,
    End,
}

impl PlotDrawing {
    pub(super) fn line(&mut self, points: Vec<[f64; 2]>, stroke: Stroke, width: f64) {
        if points.len() > 1 {
            self.shapes.push(Shape::Line { points, stroke, width });
        }
    }

    pub(super) fn area(&mut self, corners: Vec<[f64; 2]>, colour: Colour, opacity: f64) {
        self.shapes.push(Shape::Area { corners, colour, opacity });
    }

    /// A rectangle between two opposite corners.
    pub(super) fn rectangle(&mut self, [one, other]: [[f64; 2]; 2], colour: Colour) {
        let corner = [one[0].min(other[0]), one[1].min(other[1])];
        let size = [(one[0] - other[0]).abs(), (one[1] - other[1]).abs()];
        self.shapes.push(Shape::Rectangle { corner, size, colour });
    }

    pub(super) fn dot(&mut self, centre: [f64; 2], radius: f64, colour: Colour) {
        self.shapes.push(Shape::Dot { centre, radius, colour });
    }

    /// Text with a font size in pixels, vertically centred at `at`.
    pub(super) fn text(&mut self, words: &str, at: [f64; 2], pixels: f64, colour: Colour, side: TextSide) {
        self.shapes.push(Shape::Text { words: words.to_owned(), at, pixels, colour, side });
    }

    /// Draws SVG in the colours for a light background; `label` is the alternative text.
    pub(super) fn svg(&self, Size { width, height }: Size, label: &str) -> Result<Svg, ReportError> {
        if !(160..=10_000).contains(&width) || !(120..=10_000).contains(&height) {
            return Err(ReportError::Size { width, height });
        }
        let axis = self.axis.map(|axis| format!(" data-axis=\"{}\"", numbers(&axis, " "))).unwrap_or_default();
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\"{axis} \
             stroke-linejoin=\"round\" font-family=\"system-ui, sans-serif\">\n",
            escaped(label)
        );
        for shape in &self.shapes {
            shape.write_svg(&mut text).map_err(|error| ReportError::Plot(error.to_string()))?;
        }
        text.push_str("</svg>\n");
        Ok(Svg(text))
    }
}

impl Shape {
    fn write_svg(&self, text: &mut String) -> std::fmt::Result {
        match self {
            Self::Line { points, stroke, width } => {
                let colour = hex(stroke.colour.on_light());
                let dashes = if stroke.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
                writeln!(
                    text,
                    "<polyline fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"{dashes} points=\"{}\"/>",
                    places(points)
                )
            }
            Self::Area { corners, colour, opacity } => {
                let (colour, corners) = (hex(colour.on_light()), places(corners));
                writeln!(text, "<polygon fill=\"{colour}\" fill-opacity=\"{opacity}\" points=\"{corners}\"/>")
            }
            Self::Rectangle { corner: [x, y], size: [width, height], colour } => {
                let [x, y, width, height] = [x, y, width, height].map(|value| rounded(*value));
                let colour = hex(colour.on_light());
                writeln!(text, "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{colour}\"/>")
            }
            Self::Dot { centre: [x, y], radius, colour } => {
                let (x, y, colour) = (rounded(*x), rounded(*y), hex(colour.on_light()));
                writeln!(text, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{colour}\"/>")
            }
            Self::Text { words, at: [x, y], pixels, colour, side } => {
                let (x, y, words, colour) = (rounded(*x), rounded(*y), escaped(words), hex(colour.on_light()));
                let anchor = match side {
                    TextSide::Start => "start",
                    TextSide::Middle => "middle",
                    TextSide::End => "end",
                };
                writeln!(
                    text,
                    "<text x=\"{x}\" y=\"{y}\" dy=\".35em\" text-anchor=\"{anchor}\" font-size=\"{pixels}\" \
                     fill=\"{colour}\">{words}</text>"
                )
            }
        }
    }
}

/// Rounds to a tenth of a pixel, without a negative zero.
fn rounded(value: f64) -> f64 {
    (10.0 * value).round() / 10.0 + 0.0
}

fn numbers(values: &[f64], between: &str) -> String {
    values.iter().map(|value| rounded(*value).to_string()).collect::<Vec<_>>().join(between)
}

fn places(points: &[[f64; 2]]) -> String {
    points.iter().map(|point| numbers(point, ",")).collect::<Vec<_>>().join(" ")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A finished plot for a page.
#[derive(Clone, Debug, PartialEq)]
pub struct Svg(pub String);

impl Svg {
    /// The plot for a separate file, in the colours for white paper, without a style sheet.
    pub(crate) fn for_paper(&self) -> String {
        self.0.replacen('>', &format!("><metadata>{GENERATOR}</metadata>"), 1)
    }

    /// The plot for a separate file that follows the reader's light or dark theme.
    pub fn standalone(&self) -> String {
        let (light, dark, rules) = (css_variables(false), css_variables(true), css_rules());
        let style = format!("<style>svg{{{light}}}@media (prefers-color-scheme:dark){{svg{{{dark}}}}}{rules}</style>");
        self.0.replacen('>', &format!("><metadata>{GENERATOR}</metadata>{style}"), 1)
    }
}
