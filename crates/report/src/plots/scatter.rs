//! Points with vertical intervals over a logarithmic axis, and a Pareto front.

use super::axes::{Axis, PlotAxes, PlotHead, ends};
use super::shapes::PlotDrawing;
use super::{Colour, Size, Stroke, Svg};
use crate::ReportError;

/// Points in groups, one colour each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScatterPlot {
    /// Quantity of the horizontal axis with its unit; the axis is logarithmic.
    pub x_label: String,
    /// Quantity of the vertical axis with its unit.
    pub y_label: String,
    pub groups: Vec<ScatterGroup>,
    /// Points of the front, joined in steps, in order of their positions.
    pub front: Vec<[f64; 2]>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct ScatterGroup {
    pub name: String,
    pub colour: Colour,
    /// The points; points that are not finite, or not above 0 on the horizontal axis, are left out.
    pub points: Vec<ScatterPoint>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatterPoint {
    /// Position, above 0.
    pub x: f64,
    pub y: f64,
    /// Lower and upper end of its interval.
    pub interval: Option<[f64; 2]>,
}

/// Maximum extent of an interval, in multiples of the largest value.
const FURTHEST: f64 = 2.0;

impl ScatterPlot {
    /// Draws the plot as SVG.
    ///
    /// # Errors
    /// [`ReportError`] for a size outside 160 x 120 to 10 000 x 10 000.
    pub fn svg(&self, size: Size) -> Result<Svg, ReportError> {
        let Size { width, height } = size;
        let mut entries: Vec<(&str, Stroke)> =
            self.groups.iter().map(|group| (group.name.as_str(), Stroke::solid(group.colour))).collect();
        if !self.front.is_empty() {
            entries.push(("Pareto front", Stroke::dashed(Colour::Ink)));
        }
        let head = PlotHead::new(None, entries, width);
        let [across, up] = head.plot_below(width, height);
        let [x, y] = self.ranges();
        let y_axis = Axis::round(y, up, (height / 45).max(2));
        let axes = PlotAxes { x: Axis::logarithmic(x, y_axis.beside(across), width / 70), y: y_axis };
        let mut drawing = PlotDrawing::default();
        head.draw_with_label(&mut drawing, &self.y_label);
        axes.draw_y(&mut drawing);
        axes.draw_x(&mut drawing, &format!("{} (logarithmic)", self.x_label), true);
        let front = steps(&self.front).into_iter().map(|(x, y)| axes.at([x, y])).collect();
        drawing.line(front, Stroke::dashed(Colour::Ink), 1.2);
        for group in &self.groups {
            for point in group.drawn() {
                point.draw(&mut drawing, &axes, y, group.colour);
            }
        }
        drawing.svg(size, &format!("{} over {}", self.y_label, self.x_label))
    }

    /// Ranges of exponents and of values, with a margin; values begin at zero. The range includes the intervals up to
    /// twice the largest value.
    fn ranges(&self) -> [[f64; 2]; 2] {
        let points = || self.groups.iter().flat_map(ScatterGroup::drawn);
        let [left, right] = ends(points().map(|p| libm::log10(p.x))).unwrap_or([0.0, 1.0]);
        let [least, most] = ends(points().map(|p| p.y)).unwrap_or([0.0, 1.0]);
        let margin = 0.05 * (right - left).max(0.2);
        let highest = points().filter_map(|p| p.interval).map(|[_, high]| high).filter(|high| high.is_finite());
        let most = highest.fold(most, f64::max).min((FURTHEST * most).max(most));
        let lowest = points().filter_map(|p| p.interval).map(|[low, _]| low).filter(|low| low.is_finite());
        let least = lowest.fold(least, f64::min).max((FURTHEST * least).min(0.0));
        [[left - margin, right + margin], [least.min(0.0), (1.05 * most).max(least.min(0.0) + 1e-9)]]
    }
}

impl ScatterGroup {
    fn drawn(&self) -> impl Iterator<Item = ScatterPoint> + '_ {
        self.points.iter().copied().filter(|p| p.x > 0.0 && p.x.is_finite() && p.y.is_finite())
    }
}

/// The path of a front in steps: between two points, the cheaper one is the best known.
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

impl ScatterPoint {
    /// Draws the point and its interval, with an arrow if the interval continues above the plot.
    fn draw(&self, drawing: &mut PlotDrawing, axes: &PlotAxes, [least, most]: [f64; 2], colour: Colour) {
        let x = libm::log10(self.x);
        if let Some(ends) = self.interval {
            let line = ends.map(|end| axes.at([x, end.clamp(least, most)]));
            drawing.line(line.into(), Stroke::solid(colour), 1.0);
            if ends[1] > most {
                let [x, y] = axes.at([x, most]);
                drawing.area(vec![[x, y], [x - 4.0, y + 7.0], [x + 4.0, y + 7.0]], colour, 1.0);
            }
        }
        drawing.dot(axes.at([x, self.y]), 4.0, colour);
    }
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
    fn intervals_fit_into_the_plot_and_a_very_wide_one_has_an_arrow() {
        let whole = plot([[3.0, 8.0], [1.0, 3.0]]);
        let [_, [low, high]] = whole.ranges();
        assert!(low == 0.0 && high > 8.0);
        let wild = plot([[3.0, 800.0], [1.0, 3.0]]);
        assert!(wild.ranges()[1][1] < 11.0);
        let arrows =
            |plot: &ScatterPlot| plot.svg(Size { width: 600, height: 300 }).unwrap().0.matches("<polygon").count();
        assert_eq!([arrows(&whole), arrows(&wild)], [0, 1]);
    }

    #[test]
    fn the_logarithmic_axis_says_so_and_its_ticks_are_round() {
        let Svg(svg) = plot([[3.0, 8.0], [1.0, 3.0]]).svg(Size { width: 600, height: 300 }).unwrap();
        for words in ["evaluations (logarithmic)", ">200<", ">500<", ">1000<"] {
            assert!(svg.contains(words), "{words}");
        }
    }

    #[test]
    fn a_front_is_drawn_in_steps_and_points_that_cannot_be_drawn_are_left_out() {
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
