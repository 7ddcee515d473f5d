//! Rows of bars along a common axis, for periods of time.

use super::axes::{Axis, PlotAxes};
use super::shapes::{PlotDrawing, TextSide};
use super::{Colour, Size, Svg};
use crate::ReportError;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpanPlot {
    /// Quantity of the horizontal axis with its unit.
    pub x_label: String,
    /// Its ends.
    pub x_range: [f64; 2],
    /// The rows, from top to bottom; consecutive ones with the same name are drawn over each other, as one.
    pub rows: Vec<SpanRow>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct SpanRow {
    pub name: String,
    pub colour: Colour,
    /// Beginning and end of every bar.
    pub spans: Vec<[f64; 2]>,
}

/// Lengths in CSS pixels.
const ROW: f64 = 24.0;
const BAR: f64 = 14.0;
const ABOVE: f64 = 6.0;
const BELOW: f64 = 44.0;
const NAME_WIDTH: f64 = 130.0;
/// Width of a letter of a name, a little above the mean.
const LETTER: f64 = 7.0;

impl SpanPlot {
    /// The height that the rows need, CSS pixels.
    pub fn height(&self) -> u32 {
        (ABOVE + self.lines().count() as f64 * ROW + BELOW).max(120.0) as u32
    }

    /// Draws the plot with this width, CSS pixels, and the height [`Self::height`].
    ///
    /// # Errors
    /// [`ReportError`] for a width outside 160 to 10 000.
    pub fn svg(&self, width: u32) -> Result<Svg, ReportError> {
        let height = self.height();
        let [from, to] = self.x_range;
        let ends = if to > from { [from, to] } else { [from, from + 1.0] };
        let longest = self.rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0);
        let name_width = NAME_WIDTH.max(LETTER * longest as f64 + 12.0);
        let axes = PlotAxes {
            x: Axis::round(ends, [name_width, f64::from(width) - 14.0], width / 70),
            y: Axis::of_pixels([f64::from(height) - BELOW, ABOVE]),
        };
        let mut drawing = PlotDrawing { axis: Some(axes.for_script()), ..PlotDrawing::default() };
        axes.draw_x(&mut drawing, &self.x_label, true);
        for (index, rows) in self.lines().enumerate() {
            let middle = ABOVE + ROW * (index as f64 + 0.5);
            rows.iter().take(1).for_each(|row| {
                drawing.text(&row.name, [name_width - 8.0, middle], 12.5, Colour::Ink, TextSide::End);
            });
            for (colour, [begin, end]) in rows.iter().flat_map(|row| row.spans.iter().map(|span| (row.colour, span))) {
                let [left, right] = [begin.max(from), end.min(to)].map(|value| axes.x.place(value));
                drawing.rectangle([[left, middle - 0.5 * BAR], [right, middle + 0.5 * BAR]], colour);
            }
        }
        let names: Vec<&str> = self.lines().filter_map(|rows| Some(rows.first()?.name.as_str())).collect();
        drawing.svg(Size { width, height }, &format!("{} over {}", names.join(", "), self.x_label))
    }

    /// Rows by name.
    fn lines(&self) -> impl Iterator<Item = &[SpanRow]> {
        self.rows.chunk_by(|a, b| a.name == b.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_their_spans_and_end_with_the_axis() {
        let row =
            |name: &str, spans: &[[f64; 2]]| SpanRow { name: name.into(), colour: Colour::Blue, spans: spans.to_vec() };
        let plot = SpanPlot {
            x_label: "time, s".into(),
            x_range: [0.0, 4.0],
            rows: vec![row("left foot", &[[0.0, 1.0], [2.0, 4.0]]), row("right foot", &[[3.0, 9.0]])],
        };
        let svg = plot.svg(600).unwrap();
        let widths = svg.bar_widths();
        assert_eq!(widths.len(), 3, "{svg:?}");
        assert!((widths[1] / widths[0] - 2.0).abs() < 0.01 && (widths[2] / widths[0] - 1.0).abs() < 0.01, "{widths:?}");
        assert!(svg.0.contains("left foot") && svg.0.contains("time, s"));
        let two = SpanPlot { rows: vec![row("foot", &[[0.0, 1.0]]), row("foot", &[[1.0, 2.0]])], ..plot.clone() };
        assert_eq!(two.height(), SpanPlot { rows: two.rows[..1].to_vec(), ..plot }.height());
        assert_eq!(two.svg(600).unwrap().0.matches(">foot</text>").count(), 1);
        assert!(SpanPlot::default().svg(300).is_ok());
    }
}
