//! Bars along a common axis, row by row: when something lasted.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::axis::PlotAxis;
use super::style::{AxisPlace, FINE, draw_svg_over_frames, failed, style_mesh, text_style};
use super::{Colour, Size, Svg};
use crate::report::ReportError;

/// Rows of bars.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpanPlot {
    /// What the horizontal axis is, with its unit.
    pub x_label: String,
    /// Its ends.
    pub x_range: [f64; 2],
    /// The rows, from top to bottom.
    pub rows: Vec<SpanRow>,
    /// What the plot shows, for readers who cannot see it; empty for none.
    pub finding: String,
}

/// One row.
#[derive(Clone, Debug, PartialEq)]
pub struct SpanRow {
    /// Drawn before the row.
    pub name: String,
    /// Colour of its bars.
    pub colour: Colour,
    /// Beginning and end of every bar.
    pub spans: Vec<[f64; 2]>,
}

/// Lengths in CSS pixels.
const ROW: i32 = 24;
const BAR: i32 = 14;
const ABOVE: i32 = 6;
const BELOW: i32 = 44;
const NAME_WIDTH: i32 = 130;

impl SpanPlot {
    /// The height that holds all rows, CSS pixels.
    pub fn height(&self) -> u32 {
        (ABOVE + self.rows.len() as i32 * ROW + BELOW).max(120) as u32
    }

    /// Draws the plot `width` CSS pixels wide and as high as [`Self::height`] says.
    ///
    /// # Errors
    /// [`ReportError`] for a width outside 160 to 10 000, or when plotters fails.
    pub fn svg(&self, width: u32) -> Result<Svg, ReportError> {
        let height = self.height();
        let label = format!("{} over {}", self.names(), self.x_label);
        let label = if self.finding.is_empty() { label } else { format!("{label}: {}", self.finding) };
        let [from, to] = self.x_range;
        let x_range = if to > from { from..to } else { from..from + 1.0 };
        let ends = [x_range.start, x_range.end];
        draw_svg_over_frames(Size { width, height }, &label, |canvas| {
            let mut chart = ChartBuilder::on(canvas)
                .margin_top(ABOVE * FINE)
                .margin_left(NAME_WIDTH * FINE)
                .margin_right(14 * FINE)
                .x_label_area_size(BELOW * FINE)
                .build_cartesian_2d(
                    PlotAxis::round(ends),
                    PlotAxis::round([f64::from(height as i32 - BELOW), f64::from(ABOVE)]),
                )
                .map_err(failed)?;
            let mut mesh = chart.configure_mesh();
            style_mesh(&mut mesh, &self.x_label, (width / 70) as usize);
            mesh.disable_y_mesh().disable_y_axis().draw().map_err(failed)?;
            let names = text_style(12.5, Colour::Ink, HPos::Right, VPos::Center);
            for (row, middle) in self.rows.iter().zip((ABOVE + ROW / 2..).step_by(ROW as usize)) {
                canvas.draw_text(&row.name, &names, ((NAME_WIDTH - 8) * FINE, middle * FINE)).map_err(failed)?;
                let (top, bottom) = (f64::from(middle - BAR / 2), f64::from(middle + BAR / 2));
                let bars = row.spans.iter().map(|[begin, end]| {
                    Rectangle::new([(begin.max(from), top), (end.min(to), bottom)], row.colour.rgb().filled())
                });
                chart.draw_series(bars).map_err(failed)?;
            }
            Ok(Some(AxisPlace::of(&chart, ends, [f64::from(height as i32 - BELOW), f64::from(ABOVE)])))
        })
    }

    fn names(&self) -> String {
        self.rows.iter().map(|row| row.name.as_str()).collect::<Vec<_>>().join(", ")
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
            finding: "left foot twice".into(),
        };
        let Svg(svg) = plot.svg(600).unwrap();
        let widths: Vec<f64> = svg
            .lines()
            .filter(|line| line.starts_with("<rect") && line.contains("fill=\"#"))
            .filter_map(|line| line.split(" width=\"").nth(1)?.split('"').next()?.parse().ok())
            .collect();
        assert_eq!(widths.len(), 3, "{svg}");
        assert!((widths[1] / widths[0] - 2.0).abs() < 0.01 && (widths[2] / widths[0] - 1.0).abs() < 0.01, "{widths:?}");
        assert!(svg.contains("left foot") && svg.contains("time, s"));
        assert!(SpanPlot::default().svg(300).is_ok());
    }
}
