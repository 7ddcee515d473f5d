//! Horizontal bars in groups, with intervals.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::axis::PlotAxis;
use super::style::{Canvas, Chart, FINE, PlotHead, draw_svg, failed, style_mesh, text_style};
use super::{Colour, Size, Stroke, Svg};
use crate::report::ReportError;

/// Groups of bars that start at zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BarPlot {
    /// Drawn above the plot where there is one.
    pub title: Option<String>,
    /// What the bars measure, with its unit.
    pub value_label: String,
    /// Names and colours of the bars of a group.
    pub legend: Vec<(String, Colour)>,
    /// The groups, from top to bottom.
    pub groups: Vec<BarGroup>,
    /// What the plot shows, for readers who cannot see it; empty for none.
    pub finding: String,
}

/// Bars under one name.
#[derive(Clone, Debug, PartialEq)]
pub struct BarGroup {
    /// The name.
    pub name: String,
    /// The bars, from top to bottom.
    pub bars: Vec<Bar>,
}

/// One bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// Its length, >= 0.
    pub value: f64,
    /// An interval around it.
    pub interval: Option<[f64; 2]>,
    /// Its colour.
    pub colour: Colour,
}

/// How far, in lengths of the longest bar, an interval may stretch the plot.
const FURTHEST: f64 = 2.0;
/// Lengths in CSS pixels.
const BAR: i32 = 11;
const BETWEEN_GROUPS: i32 = 11;
const ABOVE: i32 = 6;
const BELOW: i32 = 44;
const NAME_WIDTH: i32 = 84;
/// Of an average letter of a name.
const LETTER: f64 = 6.6;

impl BarPlot {
    /// The height that holds all bars comfortably, CSS pixels.
    pub fn height(&self, width: u32) -> u32 {
        let groups: i32 = self.groups.iter().map(|g| g.bars.len() as i32 * BAR + BETWEEN_GROUPS).sum();
        (self.head(width).height + ABOVE + groups + BELOW).max(120) as u32
    }

    /// Room for the longest name, at most two fifths of the width.
    fn name_width(&self, width: u32) -> i32 {
        let longest = self.groups.iter().map(|group| group.name.chars().count()).max().unwrap_or(0);
        ((LETTER * longest as f64) as i32 + 14).clamp(NAME_WIDTH, (width as i32 * 2 / 5).max(NAME_WIDTH))
    }

    fn head(&self, width: u32) -> PlotHead<'_> {
        let entries = self.legend.iter().map(|(name, colour)| (name.as_str(), Stroke::solid(*colour))).collect();
        PlotHead::new(self.title.as_deref(), entries, width)
    }

    /// Draws the plot `width` CSS pixels wide and as high as [`Self::height`] says.
    ///
    /// # Errors
    /// [`ReportError`] for a width outside 160 to 10 000, or when plotters fails.
    pub fn svg(&self, width: u32) -> Result<Svg, ReportError> {
        let head = self.head(width);
        let height = self.height(width);
        let label = self.title.as_ref().unwrap_or(&self.value_label);
        let label = &if self.finding.is_empty() { label.clone() } else { format!("{label}: {}", self.finding) };
        let names = self.name_width(width);
        draw_svg(Size { width, height }, label, |canvas| {
            head.draw(canvas)?;
            let mut top = head.height + ABOVE;
            // Vertical positions are CSS pixels, so that bars have the same height in every plot.
            let mut chart = ChartBuilder::on(canvas)
                .margin_top(top * FINE)
                .margin_left(names * FINE)
                .margin_right(44 * FINE)
                .x_label_area_size(BELOW * FINE)
                .build_cartesian_2d(
                    PlotAxis::round([0.0, self.greatest()]),
                    PlotAxis::round([f64::from(height as i32 - BELOW), f64::from(top)]),
                )
                .map_err(failed)?;
            let mut mesh = chart.configure_mesh();
            style_mesh(&mut mesh, &self.value_label, (width / 100) as usize);
            mesh.disable_y_mesh().disable_y_axis().draw().map_err(failed)?;
            let name_style = text_style(12.5, Colour::Ink, HPos::Right, VPos::Center);
            for group in &self.groups {
                let bars_top = top + BETWEEN_GROUPS / 2;
                let middle = bars_top + group.bars.len() as i32 * BAR / 2;
                canvas.draw_text(&group.name, &name_style, ((names - 8) * FINE, middle * FINE)).map_err(failed)?;
                for (bar, bar_top) in group.bars.iter().zip((bars_top..).step_by(BAR as usize)) {
                    bar.draw(canvas, &mut chart, f64::from(bar_top), self.greatest())?;
                }
                top += group.bars.len() as i32 * BAR + BETWEEN_GROUPS;
            }
            Ok(())
        })
    }

    /// The value at the right edge: an interval that goes further than twice the longest bar is cut off there.
    fn greatest(&self) -> f64 {
        let bars = || self.groups.iter().flat_map(|group| &group.bars);
        let longest = bars().map(|bar| bar.value).filter(|v| v.is_finite()).fold(0.0, f64::max);
        let ends = bars().filter_map(|bar| bar.interval).map(|[_, high]| high);
        let greatest = ends.filter(|v| v.is_finite()).fold(longest, f64::max).min(FURTHEST * longest);
        if greatest > 0.0 { 1.04 * greatest } else { 1.0 }
    }

    /// Whether an interval leaves the plot.
    pub fn cuts_off(&self) -> bool {
        let edge = self.greatest();
        self.groups.iter().flat_map(|group| &group.bars).any(|bar| bar.interval.is_some_and(|[_, high]| high > edge))
    }
}

impl Bar {
    fn draw(&self, canvas: &Canvas<'_>, chart: &mut Chart<'_, '_>, top: f64, edge: f64) -> Result<(), ReportError> {
        let corners = [(0.0, top + 0.5), (self.value, top + f64::from(BAR) - 0.5)];
        chart.draw_series([Rectangle::new(corners, self.colour.rgb().filled())]).map_err(failed)?;
        let middle = top + 0.5 * f64::from(BAR);
        let mut end = self.value;
        if let Some([low, high]) = self.interval {
            let high = high.min(edge);
            Stroke::solid(Colour::Ink).draw(chart, vec![(low.max(0.0), middle), (high, middle)], 1.5)?;
            end = end.max(high);
        }
        let (x, y) = chart.backend_coord(&(end, middle));
        let style = text_style(11.0, Colour::Faint, HPos::Left, VPos::Center);
        canvas.draw_text(&format!("{:.0}", self.value), &style, (x + 6 * FINE, y)).map_err(failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot() -> BarPlot {
        let bar = |value, colour| Bar { value, interval: Some([value - 2.0, value + 3.0]), colour };
        let group =
            |name: &str| BarGroup { name: name.into(), bars: vec![bar(10.0, Colour::Blue), bar(20.0, Colour::Orange)] };
        BarPlot {
            title: None,
            value_label: "mean error, mm".into(),
            legend: vec![("left".into(), Colour::Blue), ("right".into(), Colour::Orange)],
            groups: vec![group("wrist"), group("knee")],
            finding: "worst <wrist>".into(),
        }
    }

    #[test]
    fn bars_are_as_long_as_their_values() {
        let Svg(svg) = plot().svg(600).unwrap();
        let widths: Vec<f64> = svg
            .lines()
            .filter(|line| line.starts_with("<rect") && line.contains("fill=\"#"))
            .filter_map(|line| line.split(" width=\"").nth(1)?.split('"').next()?.parse().ok())
            .collect();
        assert_eq!(widths.len(), 4);
        assert!((widths[1] / widths[0] - 2.0).abs() < 0.01, "{widths:?}");
    }

    #[test]
    fn an_interval_far_beyond_the_bars_is_cut_off_and_said_to_be() {
        let mut plot = plot();
        assert!(!plot.cuts_off() && (plot.greatest() - 1.04 * 23.0).abs() < 1e-9);
        plot.groups[0].bars[0].interval = Some([1.0, 2000.0]);
        assert!(plot.cuts_off() && (plot.greatest() - 1.04 * FURTHEST * 20.0).abs() < 1e-9);
        assert!(plot.svg(600).is_ok());
    }

    #[test]
    fn the_height_grows_with_the_groups() {
        let mut taller = plot();
        taller.groups.extend(plot().groups);
        assert_eq!(taller.height(600) - plot().height(600), 2 * (2 * BAR + BETWEEN_GROUPS) as u32);
        assert!(BarPlot::default().svg(300).is_ok());
    }
}
