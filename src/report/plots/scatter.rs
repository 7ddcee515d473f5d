//! Points with vertical intervals over a logarithmic axis, and a front through some of them.

use plotters::prelude::*;

use super::style::{FINE, PlotHead, draw_svg, failed, short, style_mesh};
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
            let ranges @ [_, y] = self.ranges();
            let mut chart = head.draw_above_axes(canvas, &self.y_label, ranges)?;
            let mut mesh = chart.configure_mesh();
            style_mesh(&mut mesh, &self.x_label, (size.width / 110) as usize);
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
                    }
                    let dot = group.colour.rgb().filled();
                    chart.draw_series([Circle::new((at, point.y), 4 * FINE, dot)]).map_err(failed)?;
                }
            }
            Ok(())
        })
    }

    /// Ranges of exponents and of values, with a margin; values begin at zero.
    pub(in crate::report) fn ranges(&self) -> [[f64; 2]; 2] {
        let points = || self.groups.iter().flat_map(ScatterGroup::drawn);
        let ends = |of: &dyn Fn(&ScatterPoint) -> f64| {
            points().map(|p| of(&p)).fold(None, |ends: Option<[f64; 2]>, value| {
                Some(ends.map_or([value, value], |[low, high]| [low.min(value), high.max(value)]))
            })
        };
        let [left, right] = ends(&|p| libm::log10(p.x)).unwrap_or([0.0, 1.0]);
        let [least, most] = ends(&|p| p.y).unwrap_or([0.0, 1.0]);
        let margin = 0.05 * (right - left).max(0.2);
        [[left - margin, right + margin], [least.min(0.0), (1.08 * most).max(least.min(0.0) + 1e-9)]]
    }
}

impl ScatterGroup {
    /// The points that have a place.
    pub(in crate::report) fn drawn(&self) -> impl Iterator<Item = ScatterPoint> + '_ {
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

fn power_of_ten(exponent: f64) -> String {
    let value = libm::pow(10.0, exponent);
    let step = libm::pow(10.0, libm::floor(exponent) - 1.0);
    short((value / step).round() * step)
}

#[cfg(test)]
mod tests {
    use super::*;

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
