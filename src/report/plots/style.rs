//! Colours, strokes and text of plots, and their SVG.

use plotters::chart::MeshStyle;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::Size;
use super::axis::PlotAxis;
use super::short_number::short;
use crate::report::GENERATOR;
use crate::report::ReportError;

/// Plotters draws on whole pixels; drawing this many times larger keeps lines smooth.
pub(super) const FINE: i32 = 8;

/// Lengths of dashes and of the gaps between them.
const DASH: i32 = 6 * FINE;
const GAP: i32 = 4 * FINE;

/// A colour with a value for light and one for dark paper. All are distinct for the common forms of colour blindness
/// (`[Okabe 2008]`) in lightness or hue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Colour {
    Ink,
    Faint,
    Grid,
    Blue,
    Orange,
    Green,
    Red,
    Purple,
    Amber,
    Grey,
    /// Steps of a ramp from light to deep, for things that have an order; `0..6`.
    Ramp(u8),
}

const ALL: [Colour; 16] = [
    Colour::Ink,
    Colour::Faint,
    Colour::Grid,
    Colour::Blue,
    Colour::Orange,
    Colour::Green,
    Colour::Red,
    Colour::Purple,
    Colour::Amber,
    Colour::Grey,
    Colour::Ramp(0),
    Colour::Ramp(1),
    Colour::Ramp(2),
    Colour::Ramp(3),
    Colour::Ramp(4),
    Colour::Ramp(5),
];

impl Colour {
    /// Name of the CSS variable, value on light paper, value on dark paper.
    fn entry(self) -> (&'static str, [u8; 3], [u8; 3]) {
        match self {
            Self::Ink => ("plot-ink", [0x1c, 0x27, 0x32], [0xe8, 0xed, 0xf2]),
            Self::Faint => ("plot-faint", [0x5c, 0x6b, 0x7a], [0x9f, 0xad, 0xbb]),
            Self::Grid => ("plot-grid", [0xe0, 0xe5, 0xea], [0x2e, 0x3a, 0x46]),
            Self::Blue => ("plot-blue", [0x00, 0x68, 0xb0], [0x5a, 0xb4, 0xf0]),
            Self::Orange => ("plot-orange", [0xcc, 0x5a, 0x00], [0xff, 0x9d, 0x52]),
            Self::Green => ("plot-green", [0x00, 0x8a, 0x62], [0x2f, 0xd6, 0x9c]),
            Self::Red => ("plot-red", [0xd1, 0x1f, 0x3c], [0xff, 0x6b, 0x7c]),
            Self::Purple => ("plot-purple", [0x95, 0x4a, 0x8c], [0xe0, 0x9a, 0xd4]),
            Self::Amber => ("plot-amber", [0x9a, 0x6c, 0x00], [0xf0, 0xc0, 0x4a]),
            Self::Grey => ("plot-grey", [0x78, 0x86, 0x94], [0x8d, 0x9b, 0xa9]),
            Self::Ramp(0) => ("plot-ramp0", [0x9b, 0xc8, 0xe8], [0x2c, 0x53, 0x75]),
            Self::Ramp(1) => ("plot-ramp1", [0x63, 0xa6, 0xd8], [0x39, 0x71, 0xa0]),
            Self::Ramp(2) => ("plot-ramp2", [0x2f, 0x86, 0xc4], [0x4a, 0x90, 0xc8]),
            Self::Ramp(3) => ("plot-ramp3", [0x14, 0x66, 0xa6], [0x68, 0xae, 0xe2]),
            Self::Ramp(4) => ("plot-ramp4", [0x0d, 0x48, 0x80], [0x9c, 0xcc, 0xf0]),
            Self::Ramp(_) => ("plot-ramp5", [0x0a, 0x2a, 0x54], [0xd4, 0xe9, 0xfb]),
        }
    }

    /// Step `index` of `count` on the ramp.
    pub fn from_rank(index: usize, count: usize) -> Self {
        if count > 1 { Self::Ramp((5 * index / (count - 1)).min(5) as u8) } else { Self::Blue }
    }

    pub(super) fn rgb(self) -> RGBColor {
        let (_, [red, green, blue], _) = self.entry();
        RGBColor(red, green, blue)
    }
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stroke {
    /// Its colour.
    pub colour: Colour,
    /// Whether it is dashed.
    pub dashed: bool,
}

impl Stroke {
    /// An unbroken line.
    pub fn solid(colour: Colour) -> Self {
        Self { colour, dashed: false }
    }

    /// A dashed line.
    pub fn dashed(colour: Colour) -> Self {
        Self { colour, dashed: true }
    }

    pub(super) fn shape(self, width: f64) -> ShapeStyle {
        self.colour.rgb().stroke_width((width * f64::from(FINE)) as u32)
    }

    /// Draws a line through points of a chart, `width` CSS pixels wide.
    pub(super) fn draw(
        self,
        chart: &mut Chart<'_, '_>,
        points: Vec<(f64, f64)>,
        width: f64,
    ) -> Result<(), ReportError> {
        let shape = self.shape(width);
        let drawn = match self.dashed {
            true => chart.draw_series(DashedLineSeries::new(points, DASH, GAP, shape)).map(drop),
            false => chart.draw_series(LineSeries::new(points, shape)).map(drop),
        };
        drawn.map_err(failed)
    }
}

/// `:root` declarations of every plot colour for light or dark paper.
pub fn css_variables(dark: bool) -> String {
    let declare = |colour: Colour| {
        let (name, on_light, on_dark) = colour.entry();
        format!("--{name}:{};", hex(if dark { on_dark } else { on_light }))
    };
    ALL.into_iter().map(declare).collect()
}

/// Rules that give whatever is drawn in a plot's colour the variable of that colour.
pub fn css_rules() -> String {
    let rule = |colour: Colour| {
        let (name, on_light, _) = colour.entry();
        let value = hex(on_light);
        format!("svg [stroke=\"{value}\"]{{stroke:var(--{name})}}svg [fill=\"{value}\"]{{fill:var(--{name})}}")
    };
    ALL.into_iter().map(rule).collect()
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

/// A finished plot, to be put into a page as it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Svg(pub String);

impl Svg {
    /// The same as a file of its own in the colours of white paper, without a style sheet.
    pub(in crate::report) fn for_paper(&self) -> String {
        self.0.replacen('>', &format!("><metadata>{GENERATOR}</metadata>"), 1)
    }

    /// The same as a file of its own, which follows the reader's light or dark theme.
    pub fn standalone(&self) -> String {
        let (light, dark, rules) = (css_variables(false), css_variables(true), css_rules());
        let style = format!("<style>svg{{{light}}}@media (prefers-color-scheme:dark){{svg{{{dark}}}}}{rules}</style>");
        self.0.replacen('>', &format!("><metadata>{GENERATOR}</metadata>{style}"), 1)
    }
}

pub(super) type Canvas<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Where the horizontal axis of a plot over frames is, so that a page's script can point at a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AxisPlace {
    /// Ends of the axis, fine pixels.
    pub(super) pixels: [i32; 2],
    /// Top and bottom of the plot, fine pixels.
    pub(super) heights: [i32; 2],
    /// The values at its ends.
    pub(super) values: [f64; 2],
}

impl AxisPlace {
    /// Of a chart with these ranges.
    pub(super) fn of(chart: &Chart<'_, '_>, x: [f64; 2], y: [f64; 2]) -> Self {
        let [(left, top), (right, bottom)] = [chart.backend_coord(&(x[0], y[1])), chart.backend_coord(&(x[1], y[0]))];
        Self { pixels: [left, right], heights: [top, bottom], values: x }
    }

    fn attribute(&self) -> String {
        let ([left, right], [top, bottom], [from, to]) = (self.pixels, self.heights, self.values);
        format!(" data-axis=\"{left} {right} {top} {bottom} {from} {to}\"")
    }
}

/// Runs `draw` on an empty canvas of `size`, then gives the SVG a head by which it is scalable.
pub(super) fn draw_svg(
    size: Size,
    label: &str,
    draw: impl FnOnce(&Canvas<'_>) -> Result<(), ReportError>,
) -> Result<Svg, ReportError> {
    draw_svg_over_frames(size, label, |canvas| draw(canvas).map(|()| None))
}

/// As [`draw_svg`], of a plot that may tell where its axis is.
pub(super) fn draw_svg_over_frames(
    size: Size,
    label: &str,
    draw: impl FnOnce(&Canvas<'_>) -> Result<Option<AxisPlace>, ReportError>,
) -> Result<Svg, ReportError> {
    let Size { width, height } = size;
    if !(160..=10_000).contains(&width) || !(120..=10_000).contains(&height) {
        return Err(ReportError::Size { width, height });
    }
    let (fine_width, fine_height) = (width * FINE as u32, height * FINE as u32);
    let mut text = String::new();
    let axis = {
        let canvas = SVGBackend::with_string(&mut text, (fine_width, fine_height)).into_drawing_area();
        let axis = draw(&canvas)?;
        canvas.present().map_err(|error| ReportError::Plot(error.to_string()))?;
        axis
    };
    let head_end = text.find('>').ok_or_else(|| ReportError::Plot("an SVG without a head".into()))?;
    let body = &text[head_end..];
    let label = label.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    let axis = axis.map(|axis| axis.attribute()).unwrap_or_default();
    Ok(Svg(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {fine_width} {fine_height}\" role=\"img\" aria-label=\"{label}\"{axis} \
         stroke-linejoin=\"round\"{body}"
    )))
}

pub(super) fn failed<E: std::error::Error + Send + Sync>(error: DrawingAreaErrorKind<E>) -> ReportError {
    ReportError::Plot(error.to_string())
}

/// Text of `pixels` CSS pixels.
pub(super) fn text_style(pixels: f64, colour: Colour, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    // Plotters divides sizes by 1.24 on their way into SVG.
    let size = pixels * 1.24 * f64::from(FINE);
    let mut style = TextStyle::from(("system-ui, sans-serif", size).into_font());
    style.color = colour.rgb().to_backend_color();
    style.pos(Pos::new(horizontal, vertical))
}

/// The head of a plot: its title, if any, and a legend that wraps.
pub(super) struct PlotHead<'a> {
    title: Option<&'a str>,
    entries: Vec<(&'a str, Stroke)>,
    places: Vec<[i32; 2]>,
    /// Its height, CSS pixels.
    pub(super) height: i32,
}

const TITLE_HEIGHT: i32 = 28;
const LEGEND_ROW: i32 = 20;

impl<'a> PlotHead<'a> {
    /// The head of a plot `width` CSS pixels wide.
    pub(super) fn new(title: Option<&'a str>, entries: Vec<(&'a str, Stroke)>, width: u32) -> Self {
        let mut at = [0, if title.is_some() { TITLE_HEIGHT } else { 0 }];
        let mut places = Vec::new();
        for (name, _) in &entries {
            let needed = 34 + (6.6 * name.chars().count() as f64) as i32;
            if at[0] > 0 && at[0] + needed > width as i32 {
                at = [0, at[1] + LEGEND_ROW];
            }
            places.push(at);
            at[0] += needed + 10;
        }
        let height = at[1] + if entries.is_empty() { 0 } else { LEGEND_ROW };
        Self { title, entries, places, height }
    }

    pub(super) fn draw(&self, canvas: &Canvas<'_>) -> Result<(), ReportError> {
        if let Some(title) = self.title {
            let style = text_style(16.0, Colour::Ink, HPos::Left, VPos::Top);
            canvas.draw_text(title, &style, (0, 2 * FINE)).map_err(failed)?;
        }
        let style = text_style(12.5, Colour::Ink, HPos::Left, VPos::Center);
        for ((name, stroke), [x, y]) in self.entries.iter().zip(&self.places) {
            let (x, y) = (x * FINE, (y + LEGEND_ROW / 2) * FINE);
            let swatch = vec![(x, y), (x + 24 * FINE, y)];
            match stroke.dashed {
                true => canvas.draw(&DashedPathElement::new(swatch, DASH, GAP, stroke.shape(3.0))),
                false => canvas.draw(&PathElement::new(swatch, stroke.shape(3.0))),
            }
            .map_err(failed)?;
            canvas.draw_text(name, &style, (x + 30 * FINE, y)).map_err(failed)?;
        }
        Ok(())
    }

    /// Draws the head and the label of the vertical axis, and puts these axes below, empty.
    pub(super) fn draw_above_axes<'c, 'b>(
        &self,
        canvas: &'c Canvas<'b>,
        y_label: &str,
        [x, y]: [PlotAxis; 2],
    ) -> Result<Chart<'c, 'b>, ReportError> {
        self.draw(canvas)?;
        let unit = text_style(12.0, Colour::Faint, HPos::Left, VPos::Top);
        canvas.draw_text(y_label, &unit, (0, (self.height + 4) * FINE)).map_err(failed)?;
        ChartBuilder::on(canvas)
            .margin_top((self.height + 26) * FINE)
            .margin_right(14 * FINE)
            .x_label_area_size(40 * FINE)
            .y_label_area_size(46 * FINE)
            .build_cartesian_2d(x, y)
            .map_err(failed)
    }
}

/// A chart on two axes.
pub(super) type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<PlotAxis, PlotAxis>>;

/// The lines and labels that the axes of every plot share.
pub(super) fn style_mesh<'b>(
    mesh: &mut MeshStyle<'_, 'b, PlotAxis, PlotAxis, SVGBackend<'_>>,
    x_label: &str,
    ticks: usize,
) {
    let text = text_style(12.0, Colour::Faint, HPos::Center, VPos::Center);
    mesh.x_labels(ticks)
        .max_light_lines(1)
        .bold_line_style(Stroke::solid(Colour::Grid).shape(1.0))
        .light_line_style(TRANSPARENT)
        .axis_style(Stroke::solid(Colour::Faint).shape(1.0))
        .set_all_tick_mark_size(4 * FINE)
        .label_style(text.clone())
        .axis_desc_style(text)
        .x_label_formatter(&|value| short(*value))
        .x_desc(x_label);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rules of a page tell colours by their values.
    #[test]
    fn no_two_colours_have_the_same_value() {
        let mut values: Vec<[u8; 3]> = ALL.iter().map(|colour| colour.entry().1).collect();
        values.sort();
        assert!(values.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[test]
    fn a_legend_that_is_too_long_wraps() {
        let entry = |name| (name, Stroke::solid(Colour::Blue));
        let head = PlotHead::new(None, ["one", "two", "a rather long name"].map(entry).into(), 150);
        assert_eq!(head.places[0], [0, 0]);
        assert!(head.places[2][0] == 0 && head.places[2][1] > 0);
        assert_eq!(head.height, head.places[2][1] + LEGEND_ROW);
        assert_eq!(PlotHead::new(None, vec![], 150).height, 0);
        assert_eq!(PlotHead::new(Some("title"), vec![], 150).height, TITLE_HEIGHT);
    }
}
