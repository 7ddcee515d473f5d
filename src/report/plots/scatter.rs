//! Points with vertical intervals over a logarithmic axis, and a front through some of them.

use plotters::prelude::*;

use super::axis::{PlotAxis, power_of_ten};
use super::short_number::short;
use super::style::{Canvas, FINE, PlotHead, draw_svg, failed, style_mesh};
use super::{Colour, Size, Stroke, Svg};
use crate::report::ReportError;

/// Points in groups, one colour each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScatterPlot {
    /// What the horizontal axis is, with its unit; it counts in powers of ten.
    pub x_label: String,
    /// What the vertical axis is, with its unit.
    pub y_label: String,
    /// The points.
    pub groups: Vec<ScatterGroup>,
    /// Points that are joined in steps, in order of their positions.
    pub front: Vec<[f64; 2]>,
}

/// Points of one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct ScatterGroup {
    /// Name in the legend.
    pub name: String,
    /// Their colour.
    pub colour: Colour,
    /// The points; those that are not finite, or not above 0 on the horizontal axis, are left out.
    pub points: Vec<ScatterPoint>,
}

/// A point and the interval of its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatterPoint {
    /// Position, above 0.
    pub x: f64,
    /// Value.
    pub y: f64,
    /// Lower and upper end of its interval.
    pub interval: Option<[f64; 2]>,
}

/// How far, in sizes of the greatest value, an interval may stretch the plot.
const FURTHEST: f64 = 2.0;

impl ScatterPlot {
    /// Draws the plot.
    ///
    /// # Errors
    /// [`ReportError`] for a size outside 160 x 120 to 10 000 x 10 000, or when plotters fails.
    pub fn svg(&self, size: Size) -> Result<Svg, ReportError> {
        let mut entries: Vec<(&str, Stroke)> =
            self.groups.iter().map(|group| (group.name.as_str(), Stroke::solid(group.colour))).collect();
        if !self.front.is_empty() {
            entries.push(("Pareto front", Stroke::dashed(Colour::Ink)));
        }
        let head = PlotHead::new(None, entries, size.width);
        draw_svg(size, &format!("{} over {}", self.y_label, self.x_label), |canvas| {
            let [x, y] = self.ranges();
            let axes = [PlotAxis::logarithmic(x), PlotAxis::round(y)];
            let mut chart = head.draw_above_axes(canvas, &self.y_label, axes)?;
            let mut mesh = chart.configure_mesh();
            style_mesh(&mut mesh, &format!("{} (logarithmic)", self.x_label), (size.width / 70) as usize);
            mesh.x_label_formatter(&|exponent| power_of_ten(*exponent))
                .y_labels((size.height / 45) as usize)
                .y_label_formatter(&|value| short(*value))
                .draw()
                .map_err(failed)?;
            Stroke::dashed(Colour::Ink).draw(&mut chart, steps(&self.front), 1.2)?;
            for group in &self.groups {
                let line = Stroke::solid(group.colour).shape(1.0);
                for point in group.drawn() {
                    let at = libm::log10(point.x);
                    if let Some(ends) = point.interval {
                        let bar = ends.map(|end| (at, end.clamp(y[0], y[1])));
                        chart.draw_series(LineSeries::new(bar, line)).map_err(failed)?;
                        if ends[1] > y[1] {
                            let place = chart.backend_coord(&(at, y[1]));
                            draw_arrow(canvas, place, group.colour)?;
                        }
                    }
                    let dot = group.colour.rgb().filled();
                    chart.draw_series([Circle::new((at, point.y), 4 * FINE, dot)]).map_err(failed)?;
                }
            }
            Ok(())
        })
    }

    /// Whether an interval continues above the plot.
    pub(crate) fn cuts_off(&self) -> bool {
        let [_, [_, top]] = self.ranges();
        self.groups.iter().flat_map(ScatterGroup::drawn).any(|point| point.interval.is_some_and(|[_, high]| high > top))
    }

    /// Ranges of exponents and of values, with a margin; values begin at zero. Intervals are in it whole, but for what
    /// goes further than twice the greatest value.
    pub(crate) fn ranges(&self) -> [[f64; 2]; 2] {
        let points = || self.groups.iter().flat_map(ScatterGroup::drawn);
        let ends = |of: &dyn Fn(&ScatterPoint) -> f64| {
            points().map(|p| of(&p)).fold(None, |ends: Option<[f64; 2]>, value| {
                Some(ends.map_or([value, value], |[low, high]| [low.min(value), high.max(value)]))
            })
        };
        let [left, right] = ends(&|p| libm::log10(p.x)).unwrap_or([0.0, 1.0]);
        let [least, most] = ends(&|p| p.y).unwrap_or([0.0, 1.0]);
        let margin = 0.05 * (right - left).max(0.2);
        let highest = points().filter_map(|p| p.interval).map(|[_, high]| high).filter(|high| high.is_finite());
        let most = highest.fold(most, f64::max).min((FURTHEST * most).max(most));
        let lowest = points().filter_map(|p| p.interval).map(|[low, _]| low).filter(|low| low.is_finite());
        let least = lowest.fold(least, f64::min).max((FURTHEST * least).min(0.0));
        [[left - margin, right + margin], [least.min(0.0), (1.05 * most).max(least.min(0.0) + 1e-9)]]
    }
}

impl ScatterGroup {
    /// The points that have a place.
    pub(crate) fn drawn(&self) -> impl Iterator<Item = ScatterPoint> + '_ {
        self.points.iter().copied().filter(|p| p.x > 0.0 && p.x.is_finite() && p.y.is_finite())
    }
}

/// Between two points of a front nothing better is known than the cheaper one.
fn steps(front: &[[f64; 2]]) -> Vec<(f64, f64)> {
    let mut path = Vec::new();
    for [x, y] in front.iter().copied().filter(|[x, _]| *x > 0.0) {
        let x = libm::log10(x);
        if let Some((_, before)) = path.last().copied() {
            path.push((x, before));
        }
        path.push((x, y));
    }
    path
}

/// A head at the top of an interval that continues above the plot.
fn draw_arrow(canvas: &Canvas<'_>, (x, y): (i32, i32), colour: Colour) -> Result<(), ReportError> {
    let [width, height] = [4 * FINE, 7 * FINE];
    let head = vec![(x, y), (x - width, y + height), (x + width, y + height)];
    canvas.draw(&Polygon::new(head, colour.rgb().filled())).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(intervals: [[f64; 2]; 2]) -> ScatterPlot {
        let point = |x, y, interval| ScatterPoint { x, y, interval: Some(interval) };
        let points = vec![point(100.0, 5.0, intervals[0]), point(1000.0, 2.0, intervals[1])];
        let group = ScatterGroup { name: "one".to_owned(), colour: Colour::Blue, points };
        ScatterPlot { x_label: "evaluations".to_owned(), groups: vec![group], ..ScatterPlot::default() }
    }

    #[test]
    fn intervals_are_whole_and_one_that_goes_on_for_ever_has_an_arrow() {
        let whole = plot([[3.0, 8.0], [1.0, 3.0]]);
        let [_, [low, high]] = whole.ranges();
        assert!(low == 0.0 && high > 8.0 && !whole.cuts_off());
        let wild = plot([[3.0, 800.0], [1.0, 3.0]]);
        assert!(wild.cuts_off() && wild.ranges()[1][1] < 11.0);
        let arrows =
            |plot: &ScatterPlot| plot.svg(Size { width: 600, height: 300 }).unwrap().0.matches("<polygon").count();
        assert_eq!([arrows(&whole), arrows(&wild)], [0, 1]);
    }

    #[test]
    fn the_logarithmic_axis_says_so_and_its_ticks_are_round() {
        let Svg(svg) = plot([[3.0, 8.0], [1.0, 3.0]]).svg(Size { width: 600, height: 300 }).unwrap();
        for words in ["evaluations (logarithmic)", ">\n200\n<", ">\n500\n<", ">\n1000\n<"] {
            assert!(svg.contains(words), "{words}");
        }
    }

    #[test]
    fn a_front_is_drawn_in_steps_and_points_that_have_no_place_are_left_out() {
        assert_eq!(steps(&[[1.0, 9.0], [10.0, 4.0]]), [(0.0, 9.0), (1.0, 9.0), (1.0, 4.0)]);
        let point = |x, y| ScatterPoint { x, y, interval: Some([y - 1.0, y + 1.0]) };
        let group = ScatterGroup {
            name: "one".to_owned(),
            colour: Colour::Blue,
            points: vec![point(10.0, 5.0), point(1000.0, 2.0), point(0.0, 1.0), point(5.0, f64::NAN)],
        };
        let plot =
            ScatterPlot { groups: vec![group], front: vec![[10.0, 5.0], [1000.0, 2.0]], ..ScatterPlot::default() };
        let Svg(svg) = plot.svg(Size { width: 600, height: 300 }).unwrap();
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(svg.contains("Pareto front"));
    }
}
