//! Lines over a common axis, with optional bands.

use super::axes::{Axis, PlotAxes, PlotHead, ends};
use super::shapes::{PlotDrawing, TextSide};
use super::{Colour, Size, Stroke, Svg};
use crate::ReportError;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinePlot {
    pub title: Option<String>,
    /// Quantity of the horizontal axis with its unit.
    pub x_label: String,
    /// Quantity of the vertical axis with its unit.
    pub y_label: String,
    pub lines: Vec<Line>,
    /// Lower end of the vertical axis; by default the minimum.
    pub y_from: Option<f64>,
    /// Upper end of the vertical axis; by default the maximum. Lines are cut off above it.
    pub y_to: Option<f64>,
    /// Whether the vertical axis is logarithmic; values at or below zero are then missing.
    pub logarithmic: bool,
    /// Marks on the horizontal axis: position and name.
    pub marks: Vec<(f64, String)>,
}

/// One line; it breaks where a value is missing.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Name in the legend; lines without a name are not listed.
    pub name: String,
    pub stroke: Stroke,
    pub points: Vec<(f64, Option<f64>)>,
    /// Positions, lower and upper ends of the band; empty for none.
    pub band: Vec<(f64, Option<[f64; 2]>)>,
}

impl Line {
    pub fn new(name: &str, stroke: Stroke, points: Vec<(f64, Option<f64>)>) -> Self {
        Self { name: name.to_owned(), stroke, points, band: vec![] }
    }

    fn logarithm(&self) -> Self {
        let log = |value: f64| (value > 0.0).then(|| libm::log10(value));
        let points = self.points.iter().map(|(x, value)| (*x, value.and_then(log))).collect();
        let log_band = |[low, high]: [f64; 2]| Some([log(low)?, log(high)?]);
        let band = self.band.iter().map(|(x, band)| (*x, band.and_then(log_band))).collect();
        Self { name: self.name.clone(), stroke: self.stroke, points, band }
    }

    fn draw(&self, drawing: &mut PlotDrawing, axes: &PlotAxes, [least, greatest]: [f64; 2]) {
        for run in present_runs(&self.band) {
            let upper = run.iter().map(|(x, [_, high])| axes.at([*x, high.clamp(least, greatest)]));
            let lower = run.iter().rev().map(|(x, [low, _])| axes.at([*x, low.clamp(least, greatest)]));
            drawing.area(upper.chain(lower).collect(), self.stroke.colour, 0.22);
        }
        for run in present_runs(&self.points).into_iter().flat_map(|run| clip(&run, greatest)) {
            drawing.line(run.into_iter().map(|(x, y)| axes.at([x, y])).collect(), self.stroke, 2.0);
        }
    }

    fn values(&self) -> impl Iterator<Item = f64> {
        let of_band = self.band.iter().filter_map(|(_, band)| *band).flatten();
        self.points.iter().filter_map(|(_, value)| *value).chain(of_band)
    }

    fn positions(&self) -> impl Iterator<Item = f64> {
        self.points.iter().map(|(x, _)| *x).chain(self.band.iter().map(|(x, _)| *x))
    }
}

impl LinePlot {
    /// Draws the plot as SVG.
    ///
    /// # Errors
    /// [`ReportError`] for a size outside 160 x 120 to 10 000 x 10 000.
    pub fn svg(&self, size: Size) -> Result<Svg, ReportError> {
        let name = self.title.clone().unwrap_or_else(|| format!("{} over {}", self.y_label, self.x_label));
        if !self.logarithmic {
            return self.drawn(size).svg(size, &name);
        }
        let log = |limit: Option<f64>| limit.filter(|limit| *limit > 0.0).map(libm::log10);
        let lines = self.lines.iter().map(Line::logarithm).collect();
        let plot = Self { lines, y_from: log(self.y_from), y_to: log(self.y_to), ..self.clone() };
        plot.drawn(size).svg(size, &name)
    }

    fn drawn(&self, Size { width, height }: Size) -> PlotDrawing {
        let named = self.lines.iter().filter(|line| !line.name.is_empty());
        let entries = named.map(|line| (line.name.as_str(), line.stroke)).collect();
        let head = PlotHead::new(self.title.as_deref(), entries, width);
        let [across, up] = head.plot_below(width, height);
        let [x, y] = self.ranges();
        let ticks = (height / 45).max(2);
        let y_axis = if self.logarithmic { Axis::logarithmic(y, up, ticks) } else { Axis::round(y, up, ticks) };
        let across = y_axis.beside(across);
        let positions = self.lines.iter().flat_map(Line::positions);
        let axes = PlotAxes { x: Axis::along(positions, x, across, width / 70), y: y_axis };
        let mut drawing = PlotDrawing { axis: Some(axes.for_script()), ..PlotDrawing::default() };
        head.draw_with_label(&mut drawing, &self.y_label);
        axes.draw_y(&mut drawing);
        axes.draw_x(&mut drawing, &self.x_label, false);
        self.lines.iter().for_each(|line| line.draw(&mut drawing, &axes, y));
        for (at, name) in self.marks.iter().filter(|(at, _)| (x[0]..=x[1]).contains(at)) {
            draw_mark(&mut drawing, axes.x.place(*at), [across, up], name);
        }
        drawing
    }

    /// Horizontal and vertical range; never empty.
    fn ranges(&self) -> [[f64; 2]; 2] {
        let positions = self.lines.iter().flat_map(Line::positions);
        let [least, greatest] = extent(self.lines.iter().flat_map(Line::values));
        let margin = 0.06 * (greatest - least);
        let y = [self.y_from.unwrap_or(least - margin), self.y_to.unwrap_or(greatest + margin)];
        [extent(positions), extent(y.into_iter())]
    }
}

/// Draws a vertical line at `x` with its name beside it, on the side with more space.
fn draw_mark(drawing: &mut PlotDrawing, x: f64, [[left, right], [bottom, top]]: [[f64; 2]; 2], name: &str) {
    drawing.line(vec![[x, bottom], [x, top]], Stroke::dashed(Colour::Faint), 1.0);
    let near_right_end = x - left > 0.7 * (right - left);
    let (side, offset) = if near_right_end { (TextSide::End, -5.0) } else { (TextSide::Start, 5.0) };
    drawing.text(name, [x + offset, top + 8.0], 12.0, Colour::Faint, side);
}

/// Minimum and maximum; a range of length 1 for a single value, `[0, 1]` for none.
fn extent(values: impl Iterator<Item = f64>) -> [f64; 2] {
    match ends(values) {
        Some([low, high]) if high > low => [low, high],
        Some([low, _]) => [low, low + 1.0],
        None => [0.0, 1.0],
    }
}

/// The stretches without missing values.
fn present_runs<T: Copy>(points: &[(f64, Option<T>)]) -> Vec<Vec<(f64, T)>> {
    let stretches = points.split(|(_, value)| value.is_none());
    let runs = stretches.map(|run| run.iter().filter_map(|(x, value)| Some((*x, (*value)?))).collect());
    runs.filter(|run: &Vec<_>| !run.is_empty()).collect()
}

/// The parts of a line at or below `top`, cut where it crosses.
fn clip(run: &[(f64, f64)], top: f64) -> Vec<Vec<(f64, f64)>> {
    let mut parts = vec![vec![]];
    for (index, (x, y)) in run.iter().copied().enumerate() {
        let before = index.checked_sub(1).map(|i| run[i]);
        if let Some((x0, y0)) = before.filter(|(_, y0)| (*y0 > top) != (y > top)) {
            let crossing = (x0 + (x - x0) * (top - y0) / (y - y0), top);
            parts.last_mut().into_iter().for_each(|part| part.push(crossing));
        }
        if y <= top {
            parts.last_mut().into_iter().for_each(|part| part.push((x, y)));
        } else if parts.last().is_some_and(|part| !part.is_empty()) {
            parts.push(vec![]);
        }
    }
    parts.retain(|part| part.len() > 1);
    parts
}

#[cfg(test)]
mod tests {
    use super::super::css_rules;
    use super::*;

    #[test]
    fn a_line_is_cut_where_it_leaves_the_plot_and_where_it_returns() {
        let run = [(0.0, 0.0), (1.0, 2.0), (2.0, 2.0), (3.0, 0.0)];
        let parts = clip(&run, 1.0);
        assert_eq!(parts, [vec![(0.0, 0.0), (0.5, 1.0)], vec![(2.5, 1.0), (3.0, 0.0)]]);
        assert_eq!(clip(&run, 5.0), [run.to_vec()]);
    }

    #[test]
    fn a_logarithmic_axis_spaces_powers_of_ten_evenly_and_names_them() {
        let points = vec![(0.0, Some(1.0)), (1.0, Some(10.0)), (2.0, Some(100.0)), (3.0, Some(0.0))];
        let line = Line::new("", Stroke::solid(Colour::Blue), points);
        assert_eq!(line.logarithm().points, [(0.0, Some(0.0)), (1.0, Some(1.0)), (2.0, Some(2.0)), (3.0, None)]);
        let plot = LinePlot { lines: vec![line], logarithmic: true, ..LinePlot::default() };
        let Svg(svg) = plot.svg(Size { width: 400, height: 300 }).unwrap();
        assert!(svg.contains(">10<") && svg.contains(">100<"));
    }

    #[test]
    fn a_missing_value_breaks_the_line() {
        let runs = present_runs(&[(0.0, Some(1)), (1.0, None), (2.0, Some(3)), (3.0, Some(4))]);
        assert_eq!(runs, [vec![(0.0, 1)], vec![(2.0, 3), (3.0, 4)]]);
    }

    #[test]
    fn a_plot_names_its_lines_follows_the_theme_and_draws_dashes() {
        let points: Vec<_> = (0..50).map(|i| (f64::from(i), Some(f64::from(i * i)))).collect();
        let mut line = Line::new("error <mm>", Stroke::solid(Colour::Blue), points.clone());
        line.band = points.iter().map(|(x, y)| (*x, y.map(|y| [y - 5.0, y + 5.0]))).collect();
        let plot = LinePlot {
            title: Some("Error & time".into()),
            x_label: "frame".into(),
            y_label: "mm".into(),
            lines: vec![line, Line::new("", Stroke::dashed(Colour::Red), points)],
            marks: vec![(20.0, "worst".into())],
            ..LinePlot::default()
        };
        let Svg(svg) = plot.svg(Size { width: 700, height: 300 }).unwrap();
        assert!(svg.contains("error &lt;mm&gt;") && svg.contains("aria-label=\"Error &amp; time\""));
        assert_eq!(svg.matches("<polyline fill=\"none\" stroke=\"#0068b0\" stroke-width=\"2\" points").count(), 1);
        assert_eq!(svg.matches("stroke=\"#d11f3c\" stroke-width=\"2\" stroke-dasharray").count(), 1, "a dashed line");
        assert!(css_rules().contains("svg [stroke=\"#0068b0\"]{stroke:var(--plot-blue)}"));
        assert!(svg.contains("<polygon ") && svg.contains("worst"));
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn a_plot_without_lines_has_empty_axes_and_one_of_zero_size_is_an_error() {
        assert!(LinePlot::default().svg(Size { width: 400, height: 200 }).is_ok());
        assert!(matches!(LinePlot::default().svg(Size { width: 0, height: 200 }), Err(ReportError::Size { .. })));
    }
}
