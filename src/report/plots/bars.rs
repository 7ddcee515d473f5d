//! Horizontal bars in groups, with intervals.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::style::{FINE, draw_legend, draw_svg, failed, legend_places, short, text_style};
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

/// Heights in CSS pixels.
const BAR: i32 = 11;
const BETWEEN_GROUPS: i32 = 11;
const NAME_WIDTH: i32 = 84;

impl BarPlot {
    /// The height that holds all bars comfortably, CSS pixels.
    pub fn height(&self, width: u32) -> u32 {
        let groups: i32 = self.groups.iter().map(|g| g.bars.len() as i32 * BAR + BETWEEN_GROUPS).sum();
        (self.head(width).0 + groups + 44).max(120) as u32
    }

    /// Height above the bars, and the legend's places.
    fn head(&self, width: u32) -> (i32, Vec<[i32; 2]>) {
        let names: Vec<&str> = self.legend.iter().map(|(name, _)| name.as_str()).collect();
        let (places, legend_height) = legend_places(&names, width);
        (if self.title.is_some() { 28 } else { 0 } + legend_height + 6, places)
    }

    /// Draws the plot `width` CSS pixels wide and as high as [`Self::height`] says.
    ///
    /// # Errors
    /// [`ReportError`] for a width outside 160 to 10 000, or when plotters fails.
    pub fn svg(&self, width: u32) -> Result<Svg, ReportError> {
        let (head, places) = self.head(width);
        let height = self.height(width);
        let label = self.title.clone().unwrap_or_else(|| self.value_label.clone());
        draw_svg(Size { width, height }, &label, |canvas| {
            if let Some(title) = &self.title {
                let style = text_style(16.0, Colour::Ink, HPos::Left, VPos::Top);
                canvas.draw_text(title, &style, (0, 2 * FINE)).map_err(failed)?;
            }
            let entries: Vec<_> = self.legend.iter().map(|(name, c)| (name.as_str(), Stroke::solid(*c))).collect();
            draw_legend(canvas, &entries, &places, if self.title.is_some() { 28 } else { 0 })?;
            let bottom = height as i32 - 44;
            let mut chart = ChartBuilder::on(canvas)
                .margin_top(head * FINE)
                .margin_left(NAME_WIDTH * FINE)
                .margin_right(44 * FINE)
                .x_label_area_size(44 * FINE)
                .build_cartesian_2d(0.0..self.greatest(), f64::from(bottom)..f64::from(head))
                .map_err(failed)?;
            chart
                .configure_mesh()
                .disable_y_mesh()
                .disable_y_axis()
                .x_labels((width / 100) as usize)
                .max_light_lines(1)
                .bold_line_style(Stroke::solid(Colour::Grid).shape(1.0))
                .light_line_style(TRANSPARENT)
                .axis_style(Stroke::solid(Colour::Faint).shape(1.0))
                .set_all_tick_mark_size(4 * FINE)
                .label_style(text_style(12.0, Colour::Faint, HPos::Center, VPos::Center))
                .axis_desc_style(text_style(12.0, Colour::Faint, HPos::Center, VPos::Center))
                .x_label_formatter(&|value| short(*value))
                .x_desc(self.value_label.as_str())
                .draw()
                .map_err(failed)?;
            let mut top = head;
            for group in &self.groups {
                top += BETWEEN_GROUPS / 2;
                let middle = top + group.bars.len() as i32 * BAR / 2;
                let name = text_style(12.5, Colour::Ink, HPos::Right, VPos::Center);
                canvas.draw_text(&group.name, &name, ((NAME_WIDTH - 8) * FINE, middle * FINE)).map_err(failed)?;
                for bar in &group.bars {
                    let (y0, y1) = (f64::from(top) + 0.5, f64::from(top + BAR) - 0.5);
                    let rectangle = Rectangle::new([(0.0, y0), (bar.value, y1)], bar.colour.rgb().filled());
                    chart.draw_series([rectangle]).map_err(failed)?;
                    let end = self.draw_interval(&mut chart, bar, 0.5 * (y0 + y1))?;
                    let (x, y) = chart.backend_coord(&(end, 0.5 * (y0 + y1)));
                    let value = text_style(11.0, Colour::Faint, HPos::Left, VPos::Center);
                    canvas.draw_text(&format!("{:.0}", bar.value), &value, (x + 6 * FINE, y)).map_err(failed)?;
                    top += BAR;
                }
                top += BETWEEN_GROUPS - BETWEEN_GROUPS / 2;
            }
            Ok(())
        })
    }

    /// Draws the whisker, if any; where bar and whisker end.
    fn draw_interval<X>(
        &self,
        chart: &mut ChartContext<'_, SVGBackend<'_>, Cartesian2d<X, X>>,
        bar: &Bar,
        y: f64,
    ) -> Result<f64, ReportError>
    where
        X: Ranged<ValueType = f64>,
    {
        let Some([low, high]) = bar.interval else { return Ok(bar.value) };
        let whisker = LineSeries::new([(low.max(0.0), y), (high, y)], Stroke::solid(Colour::Ink).shape(1.5));
        chart.draw_series(whisker).map_err(failed)?;
        Ok(high.max(bar.value))
    }

    fn greatest(&self) -> f64 {
        let bars = self.groups.iter().flat_map(|group| &group.bars);
        let ends = bars.map(|bar| bar.interval.map_or(bar.value, |[_, high]| high.max(bar.value)));
        let greatest = ends.filter(|v| v.is_finite()).fold(0.0, f64::max);
        if greatest > 0.0 { 1.04 * greatest } else { 1.0 }
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
        }
    }

    #[test]
    fn bars_are_as_long_as_their_values() {
        let Svg(svg) = plot().svg(600).unwrap();
        let widths: Vec<f64> = svg
            .lines()
            .filter(|line| line.starts_with("<rect") && line.contains("fill=\"var(--plot-"))
            .filter_map(|line| line.split(" width=\"").nth(1)?.split('"').next()?.parse().ok())
            .collect();
        assert_eq!(widths.len(), 4);
        assert!((widths[1] / widths[0] - 2.0).abs() < 0.01, "{widths:?}");
    }

    #[test]
    fn the_height_grows_with_the_groups() {
        let mut taller = plot();
        taller.groups.extend(plot().groups);
        assert_eq!(taller.height(600) - plot().height(600), 2 * (2 * BAR + BETWEEN_GROUPS) as u32);
        assert!(BarPlot::default().svg(300).is_ok());
    }
}
