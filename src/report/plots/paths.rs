//! Paths through a plane with equal scales on both axes, in panels.

use super::axes::{Axis, LABEL_WIDTH, PlotAxes, PlotHead, ends};
use super::shapes::{PlotDrawing, TextSide};
use super::{Colour, Size, Stroke, Svg};
use crate::report::ReportError;

/// Panels that share a legend.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathPlot {
    /// Alternative text.
    pub label: String,
    /// Names and strokes of the legend.
    pub legend: Vec<(String, Stroke)>,
    /// The panels, at least one.
    pub panels: Vec<PathPanel>,
}

/// One plane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathPanel {
    /// Label of the horizontal axis.
    pub x_label: String,
    /// Label of the vertical axis.
    pub y_label: String,
    /// The paths.
    pub paths: Vec<Path>,
}

/// A path; a dot marks its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// How it is drawn.
    pub stroke: Stroke,
    /// Points in order; points that are not finite are left out.
    pub points: Vec<[f64; 2]>,
}

impl PathPlot {
    /// Draws the panels in `columns` columns.
    ///
    /// # Errors
    /// [`ReportError`] for a size outside 160 x 120 to 10 000 x 10 000.
    pub fn svg(&self, size: Size, columns: usize) -> Result<Svg, ReportError> {
        let entries = self.legend.iter().map(|(name, stroke)| (name.as_str(), *stroke)).collect();
        let head = PlotHead::new(None, entries, size.width);
        let mut drawing = PlotDrawing::default();
        head.draw(&mut drawing);
        let columns = columns.max(1);
        let rows = self.panels.len().div_ceil(columns).max(1);
        let above = head.height + 2.0;
        let panel = [f64::from(size.width) / columns as f64, (f64::from(size.height) - above) / rows as f64];
        for (index, shown) in self.panels.iter().enumerate() {
            let corner = [panel[0] * (index % columns) as f64, above + panel[1] * (index / columns) as f64];
            shown.draw(&mut drawing, corner, panel);
        }
        drawing.svg(size, &self.label)
    }
}

impl PathPanel {
    fn draw(&self, drawing: &mut PlotDrawing, [left, top]: [f64; 2], [width, height]: [f64; 2]) {
        drawing.text(&self.y_label, [left, top + 8.0], 12.0, Colour::Faint, TextSide::Start);
        let across = [left + LABEL_WIDTH, (left + width - 12.0).max(left + LABEL_WIDTH + 1.0)];
        let up = [(top + height - 38.0).max(top + 23.0), top + 22.0];
        let ranges = |across: [f64; 2]| self.ranges([across[1] - across[0], up[0] - up[1]]);
        let across = Axis::round(ranges(across)[1], up, 5).beside(across);
        let [x, y] = ranges(across);
        let axes = PlotAxes { x: Axis::round(x, across, 5), y: Axis::round(y, up, 5) };
        axes.draw_y(drawing);
        axes.draw_x(drawing, &self.x_label, true);
        for path in &self.paths {
            let points: Vec<[f64; 2]> = path.finite().map(|point| axes.at(*point)).collect();
            let Some(first) = points.first().copied() else { continue };
            drawing.line(points, path.stroke, 1.8);
            drawing.dot(first, 4.0, path.stroke.colour);
        }
    }

    /// Ranges around the middle of all points, with equal scales on both axes.
    fn ranges(&self, pixels: [f64; 2]) -> [[f64; 2]; 2] {
        let along =
            |axis: usize| ends(self.paths.iter().flat_map(Path::finite).map(|point| point[axis])).unwrap_or([0.0, 1.0]);
        let ends = [along(0), along(1)];
        let per_pixel = |axis: usize| 1.1 * (ends[axis][1] - ends[axis][0]) / pixels[axis];
        let scale = per_pixel(0).max(per_pixel(1)).max(1e-12);
        [0, 1].map(|axis| {
            let (middle, half) = (0.5 * (ends[axis][0] + ends[axis][1]), 0.5 * scale * pixels[axis]);
            [middle - half, middle + half]
        })
    }
}

impl Path {
    fn finite(&self) -> impl Iterator<Item = &[f64; 2]> {
        self.points.iter().filter(|point| point.iter().all(|value| value.is_finite()))
    }
}

#[cfg(test)]
mod tests {
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
    fn panels_are_drawn_with_their_legend_and_a_path_without_points_is_left_out() {
        let plot = PathPlot {
            label: "latents".into(),
            legend: vec![("learned".into(), Stroke::solid(Colour::Blue))],
            panels: vec![panel(vec![[0.0, 0.0], [1.0, 1.0]]), panel(vec![])],
        };
        let Svg(svg) = plot.svg(Size { width: 560, height: 300 }, 2).unwrap();
        assert!(svg.contains("learned") && svg.matches("<circle ").count() == 1);
    }
}
