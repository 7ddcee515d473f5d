//! Paths through a plane, both axes to one scale, in panels beside each other or one above the other.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::axis::PlotAxis;
use super::short_number::short;
use super::style::{FINE, PlotHead, draw_svg, failed, style_mesh, text_style};
use super::{Size, Stroke, Svg};
use crate::report::ReportError;

/// Panels that share a legend.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathPlot {
    /// What the plot shows, for readers who cannot see it.
    pub label: String,
    /// Names and strokes of the legend.
    pub legend: Vec<(String, Stroke)>,
    /// The panels, at least one.
    pub panels: Vec<PathPanel>,
}

/// One plane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathPanel {
    /// What the horizontal axis is.
    pub x_label: String,
    /// What the vertical axis is.
    pub y_label: String,
    /// The paths.
    pub paths: Vec<Path>,
}

/// A path; a dot marks where it begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// How it is drawn.
    pub stroke: Stroke,
    /// Points in order; those that are not finite are left out.
    pub points: Vec<[f64; 2]>,
}

impl PathPlot {
    /// Draws the panels in `columns` columns.
    ///
    /// # Errors
    /// [`ReportError`] for a size outside 160 x 120 to 10 000 x 10 000, or when plotters fails.
    pub fn svg(&self, size: Size, columns: usize) -> Result<Svg, ReportError> {
        let entries = self.legend.iter().map(|(name, stroke)| (name.as_str(), *stroke)).collect();
        let head = PlotHead::new(None, entries, size.width);
        draw_svg(size, &self.label, |canvas| {
            head.draw(canvas)?;
            let (_, below) = canvas.split_vertically((head.height + 2) * FINE);
            let rows = self.panels.len().div_ceil(columns.max(1)).max(1);
            let areas = below.split_evenly((rows, columns.max(1)));
            areas.iter().zip(&self.panels).try_for_each(|(area, panel)| panel.draw(area))
        })
    }
}

impl PathPanel {
    fn draw(&self, area: &super::style::Canvas<'_>) -> Result<(), ReportError> {
        const MARGINS: [i32; 4] = [22, 12, 38, 46];
        let [top, right, bottom, left] = MARGINS.map(|pixels| pixels * FINE);
        let unit = text_style(12.0, super::Colour::Faint, HPos::Left, VPos::Top);
        area.draw_text(&self.y_label, &unit, (0, 2 * FINE)).map_err(failed)?;
        let (width, height) = area.dim_in_pixel();
        let free = [width as i32 - left - right, height as i32 - top - bottom].map(|pixels| f64::from(pixels.max(1)));
        let [x, y] = self.ranges(free);
        let mut chart = ChartBuilder::on(area)
            .margin_top(top)
            .margin_right(right)
            .x_label_area_size(bottom)
            .y_label_area_size(left)
            .build_cartesian_2d(PlotAxis::round(x), PlotAxis::round(y))
            .map_err(failed)?;
        let mut mesh = chart.configure_mesh();
        style_mesh(&mut mesh, &self.x_label, 5);
        mesh.y_labels(5).y_label_formatter(&|value| short(*value)).draw().map_err(failed)?;
        for path in &self.paths {
            let finite: Vec<(f64, f64)> =
                path.points.iter().filter(|p| p.iter().all(|v| v.is_finite())).map(|[x, y]| (*x, *y)).collect();
            let Some(first) = finite.first().copied() else { continue };
            path.stroke.draw(&mut chart, finite, 1.8)?;
            let dot = path.stroke.colour.rgb().filled();
            chart.draw_series([Circle::new(first, 4 * FINE, dot)]).map_err(failed)?;
        }
        Ok(())
    }

    /// Ranges about the middle of all points that show a unit equally long on both axes.
    fn ranges(&self, pixels: [f64; 2]) -> [[f64; 2]; 2] {
        let points = || self.paths.iter().flat_map(|path| &path.points).filter(|p| p.iter().all(|v| v.is_finite()));
        let ends = |axis: usize| {
            points().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[axis]), high.max(p[axis])])
        };
        let ends = if points().next().is_some() { [ends(0), ends(1)] } else { [[0.0, 1.0]; 2] };
        let per_pixel = |axis: usize| 1.1 * (ends[axis][1] - ends[axis][0]) / pixels[axis];
        let scale = per_pixel(0).max(per_pixel(1)).max(1e-12);
        [0, 1].map(|axis| {
            let (middle, half) = (0.5 * (ends[axis][0] + ends[axis][1]), 0.5 * scale * pixels[axis]);
            [middle - half, middle + half]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Colour;
    use super::*;

    fn panel(points: Vec<[f64; 2]>) -> PathPanel {
        let path = Path { stroke: Stroke::solid(Colour::Blue), points };
        PathPanel { paths: vec![path], ..PathPanel::default() }
    }

    #[test]
    fn a_unit_is_equally_long_on_both_axes_and_every_point_is_inside() {
        let [x, y] = panel(vec![[0.0, 0.0], [2.0, 1.0], [f64::NAN, 9.0]]).ranges([300.0, 300.0]);
        assert!((x[1] - x[0] - 2.2).abs() < 1e-12 && (y[1] - y[0] - 2.2).abs() < 1e-12);
        assert!(x[0] < 0.0 && x[1] > 2.0 && y[0] < 0.0 && (1.0..9.0).contains(&y[1]));
    }

    #[test]
    fn panels_are_drawn_with_their_legend_and_a_path_of_no_point_is_none() {
        let plot = PathPlot {
            label: "latents".into(),
            legend: vec![("learned".into(), Stroke::solid(Colour::Blue))],
            panels: vec![panel(vec![[0.0, 0.0], [1.0, 1.0]]), panel(vec![])],
        };
        let Svg(svg) = plot.svg(Size { width: 560, height: 300 }, 2).unwrap();
        assert!(svg.contains("learned") && svg.matches("<circle ").count() == 1);
    }
}
