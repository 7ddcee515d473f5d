//! Horizontal bars in groups, with intervals.

use super::axes::{Axis, PlotAxes, PlotHead};
use super::shapes::{PlotDrawing, TextSide};
use super::{Colour, Size, Stroke, Svg};
use crate::ReportError;

/// Groups of bars that start at zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BarPlot {
    pub title: Option<String>,
    /// The measured quantity with its unit.
    pub value_label: String,
    pub legend: Vec<(String, Colour)>,
    /// The groups, from top to bottom.
    pub groups: Vec<BarGroup>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct BarGroup {
    pub name: String,
    /// The bars, from top to bottom.
    pub bars: Vec<Bar>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// Its length, >= 0.
    pub value: f64,
    pub interval: Option<[f64; 2]>,
    pub colour: Colour,
}

/// Maximum extent of an interval, in multiples of the longest bar.
const FURTHEST: f64 = 2.0;
/// Lengths in CSS pixels.
const BAR: f64 = 11.0;
const BETWEEN_GROUPS: f64 = 11.0;
const ABOVE: f64 = 6.0;
const BELOW: f64 = 44.0;
const NAME_WIDTH: f64 = 84.0;
/// Width of an average letter of a name.
const LETTER: f64 = 6.6;

impl BarPlot {
    /// The height that the bars need, CSS pixels.
    pub fn height(&self, width: u32) -> u32 {
        let groups: f64 = self.groups.iter().map(BarGroup::height).sum();
        (self.head(width).height + ABOVE + groups + BELOW).max(120.0) as u32
    }

    fn head(&self, width: u32) -> PlotHead<'_> {
        let entries = self.legend.iter().map(|(name, colour)| (name.as_str(), Stroke::solid(*colour))).collect();
        PlotHead::new(self.title.as_deref(), entries, width)
    }

    /// Draws the plot with this width, CSS pixels, and the height [`Self::height`].
    ///
    /// # Errors
    /// [`ReportError`] for a width outside 160 to 10 000.
    pub fn svg(&self, width: u32) -> Result<Svg, ReportError> {
        let (head, height) = (self.head(width), self.height(width));
        let longest = self.groups.iter().map(|group| group.name.chars().count()).max().unwrap_or(0);
        let left = (LETTER * longest as f64 + 14.0).clamp(NAME_WIDTH, (0.4 * f64::from(width)).max(NAME_WIDTH));
        let mut top = head.height + ABOVE;
        let across = [left, f64::from(width) - 44.0];
        let axes = PlotAxes {
            x: Axis::round([0.0, self.greatest()], across, width / 100),
            y: Axis::of_pixels([f64::from(height) - BELOW, top]),
        };
        let mut drawing = PlotDrawing::default();
        head.draw(&mut drawing);
        axes.draw_x(&mut drawing, &self.value_label, true);
        for group in &self.groups {
            let bars_top = top + 0.5 * BETWEEN_GROUPS;
            let middle = bars_top + 0.5 * BAR * group.bars.len() as f64;
            drawing.text(&group.name, [left - 8.0, middle], 12.5, Colour::Ink, TextSide::End);
            for (index, bar) in group.bars.iter().enumerate() {
                bar.draw(&mut drawing, &axes.x, bars_top + BAR * index as f64, self.greatest());
            }
            top += group.height();
        }
        let name = self.title.as_ref().unwrap_or(&self.value_label);
        drawing.svg(Size { width, height }, name)
    }

    /// The value at the right edge; an interval beyond twice the longest bar is cut off there.
    fn greatest(&self) -> f64 {
        let bars = || self.groups.iter().flat_map(|group| &group.bars);
        let longest = bars().map(|bar| bar.value).filter(|v| v.is_finite()).fold(0.0, f64::max);
        let ends = bars().filter_map(|bar| bar.interval).map(|[_, high]| high);
        let greatest = ends.filter(|v| v.is_finite()).fold(longest, f64::max).min(FURTHEST * longest);
        if greatest > 0.0 { 1.04 * greatest } else { 1.0 }
    }
}

impl BarGroup {
    fn height(&self) -> f64 {
        self.bars.len() as f64 * BAR + BETWEEN_GROUPS
    }
}

impl Bar {
    fn draw(&self, drawing: &mut PlotDrawing, axis: &Axis, top: f64, edge: f64) {
        drawing.rectangle([[axis.place(0.0), top + 0.5], [axis.place(self.value), top + BAR - 0.5]], self.colour);
        let middle = top + 0.5 * BAR;
        let mut end = self.value;
        if let Some([low, high]) = self.interval {
            let high = high.min(edge);
            let line = [low.max(0.0), high].map(|value| [axis.place(value), middle]);
            drawing.line(line.into(), Stroke::solid(Colour::Ink), 1.5);
            end = end.max(high);
        }
        let beside = [axis.place(end) + 6.0, middle];
        drawing.text(&format!("{:.0}", self.value), beside, 11.0, Colour::Faint, TextSide::Start);
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
        let widths = plot().svg(600).unwrap().bar_widths();
        assert_eq!(widths.len(), 4);
        assert!((widths[1] / widths[0] - 2.0).abs() < 0.01, "{widths:?}");
    }

    #[test]
    fn an_interval_far_beyond_the_bars_is_cut_off() {
        let mut plot = plot();
        assert!((plot.greatest() - 1.04 * 23.0).abs() < 1e-9);
        plot.groups[0].bars[0].interval = Some([1.0, 2000.0]);
        assert!((plot.greatest() - 1.04 * FURTHEST * 20.0).abs() < 1e-9);
        assert!(plot.svg(600).is_ok());
    }

    #[test]
    fn the_height_grows_with_the_groups() {
        let mut taller = plot();
        taller.groups.extend(plot().groups);
        assert_eq!(taller.height(600) - plot().height(600), 2 * (2.0 * BAR + BETWEEN_GROUPS) as u32);
        assert!(BarPlot::default().svg(300).is_ok());
    }
}
