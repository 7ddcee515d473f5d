//! The shapes of plots, such as lines, areas, dots and text, as SVG.

use super::colour::hex;
use super::{Colour, Size, Stroke, css_rules, css_variables};
use crate::{GENERATOR, ReportError};

/// Shapes in drawing order, in the colours for a light background; CSS pixels from the top left.
#[derive(Default)]
pub(super) struct PlotDrawing {
    pub(super) shapes: String,
    /// Position of the horizontal axis, so that a page's script can mark a frame: left, right, top and bottom of the
    /// plot, and the values at the ends of the axis.
    pub(super) axis: Option<[f64; 6]>,
}

/// Horizontal anchor of a text; vertically it is always centred.
#[derive(Clone, Copy)]
pub(super) enum TextSide {
    Start,
    Middle,
    End,
}

impl PlotDrawing {
    pub(super) fn line(&mut self, points: Vec<[f64; 2]>, stroke: Stroke, width: f64) {
        if points.len() > 1 {
            let (colour, points) = (hex(stroke.colour.on_light()), places(&points));
            let dashes = if stroke.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
            self.shapes += &format!(
                "<polyline fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"{dashes} points=\"{points}\"/>\n"
            );
        }
    }

    pub(super) fn area(&mut self, corners: Vec<[f64; 2]>, colour: Colour, opacity: f64) {
        let (colour, corners) = (hex(colour.on_light()), places(&corners));
        self.shapes += &format!("<polygon fill=\"{colour}\" fill-opacity=\"{opacity}\" points=\"{corners}\"/>\n");
    }

    /// A rectangle between two opposite corners.
    pub(super) fn rectangle(&mut self, [one, other]: [[f64; 2]; 2], colour: Colour) {
        let [x, y] = [0, 1].map(|axis| rounded(one[axis].min(other[axis])));
        let [width, height] = [0, 1].map(|axis| rounded((one[axis] - other[axis]).abs()));
        let colour = hex(colour.on_light());
        self.shapes +=
            &format!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{colour}\"/>\n");
    }

    pub(super) fn dot(&mut self, centre: [f64; 2], radius: f64, colour: Colour) {
        let ([x, y], colour) = (centre.map(rounded), hex(colour.on_light()));
        self.shapes += &format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{colour}\"/>\n");
    }

    /// Text with a font size in pixels, vertically centred at `at`.
    pub(super) fn text(&mut self, words: &str, at: [f64; 2], pixels: f64, colour: Colour, side: TextSide) {
        let ([x, y], words, colour) = (at.map(rounded), escaped(words), hex(colour.on_light()));
        let anchor = match side {
            TextSide::Start => "start",
            TextSide::Middle => "middle",
            TextSide::End => "end",
        };
        self.shapes += &format!(
            "<text x=\"{x}\" y=\"{y}\" dy=\".35em\" text-anchor=\"{anchor}\" font-size=\"{pixels}\" \
             fill=\"{colour}\">{words}</text>\n"
        );
    }

    /// `label` is the alternative text.
    pub(super) fn svg(&self, Size { width, height }: Size, label: &str) -> Result<Svg, ReportError> {
        if !(160..=10_000).contains(&width) || !(120..=10_000).contains(&height) {
            return Err(ReportError::Size { width, height });
        }
        let axis = self.axis.map(|axis| format!(" data-axis=\"{}\"", numbers(&axis, " "))).unwrap_or_default();
        Ok(Svg(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\"{axis} \
             stroke-linejoin=\"round\" font-family=\"system-ui, sans-serif\">\n{}</svg>\n",
            escaped(label),
            self.shapes
        )))
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

#[cfg(test)]
impl Svg {
    pub(super) fn bar_widths(&self) -> Vec<f64> {
        let bars = self.0.lines().filter(|line| line.starts_with("<rect"));
        bars.filter_map(|line| line.split(" width=\"").nth(1)?.split('"').next()?.parse().ok()).collect()
    }
}
