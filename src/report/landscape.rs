//! The energy of poses on a plane through the truth.

use super::drawing::{encoded, new_picture, pixel};
use super::model_distances::colour;
use super::{ReportError, base64};

/// Energies on a square grid around the truth, with its marks.
#[derive(Clone, Debug)]
pub struct LandscapePlot {
    /// Alternative text.
    pub label: String,
    /// Names of the directions, across and up.
    pub directions: [String; 2],
    /// Distance of the edges from the truth, mm.
    pub reach_mm: f64,
    /// Points along an edge.
    pub points: usize,
    /// Row by row from below.
    pub energies: Vec<f64>,
    /// The lowest point of the plane, mm.
    pub minimum_mm: [f64; 2],
    /// The estimate, projected onto the plane, mm.
    pub estimate_mm: [f64; 2],
}

/// Edge of the picture and margins around it, CSS pixels.
const EDGE: f64 = 300.0;
const LEFT: f64 = 52.0;
const AROUND: f64 = 12.0;
const BELOW: f64 = 62.0;

impl LandscapePlot {
    /// The plot as SVG, with a picture inside. Blue is low, red is high.
    ///
    /// # Errors
    /// [`ReportError`] without points.
    pub fn svg(&self) -> Result<String, ReportError> {
        let edge = self.points as u32;
        let mut picture = new_picture(edge, edge)?;
        let low = self.energies.iter().copied().fold(f64::INFINITY, f64::min);
        let high = self.energies.iter().copied().filter(|e| e.is_finite()).fold(low, f64::max);
        let rows = self.energies.chunks(self.points.max(1)).rev().flatten();
        for (place, energy) in picture.pixels_mut().iter_mut().zip(rows) {
            *place = pixel(colour(((energy - low) / (high - low).max(f64::MIN_POSITIVE)) as f32));
        }
        let picture = base64::encode(&encoded(&picture)?);
        let (width, height) = (LEFT + EDGE + AROUND, AROUND + EDGE + BELOW);
        let at = |[a, b]: [f64; 2]| {
            let along = |mm: f64| EDGE * 0.5 * (1.0 + mm / self.reach_mm).clamp(0.0, 2.0);
            [along(a), EDGE - along(b)]
        };
        let ([tx, ty], [mx, my], [ex, ey]) = (at([0.0; 2]), at(self.minimum_mm), at(self.estimate_mm));
        let [across, up] = self.directions.each_ref().map(|name| escaped(name));
        let (middle, reach, label) = (0.5 * EDGE, self.reach_mm, escaped(&self.label));
        Ok(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
             aria-label=\"{label}\" font-family=\"system-ui, sans-serif\" font-size=\"12\" \
             fill=\"var(--plot-faint,#5C6B7A)\"><g transform=\"translate({LEFT} {AROUND})\">\
             <image width=\"{EDGE}\" height=\"{EDGE}\" preserveAspectRatio=\"none\" \
             href=\"data:image/png;base64,{picture}\"/>\
             <circle cx=\"{tx:.1}\" cy=\"{ty:.1}\" r=\"6\" fill=\"none\" stroke=\"#fff\" stroke-width=\"2.5\"/>\
             <path d=\"M{mx:.1} {my:.1}m-6 0h12m-6 -6v12\" stroke=\"#fff\" stroke-width=\"2.5\"/>\
             <path d=\"M{ex:.1} {ey:.1}m-5 -5l10 10m0 -10l-10 10\" stroke=\"#000\" stroke-width=\"2.5\"/>\
             <text x=\"0\" y=\"{y}\">-{reach:.0}</text><text x=\"{EDGE}\" y=\"{y}\" text-anchor=\"end\">{reach:.0} mm</text>\
             <text x=\"{middle}\" y=\"{below}\" text-anchor=\"middle\">{across}</text>\
             <text transform=\"translate(-14 {middle}) rotate(-90)\" text-anchor=\"middle\">{up}</text></g></svg>",
            y = EDGE + 16.0,
            below = EDGE + 38.0,
        ))
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_where_they_belong_and_names_are_escaped() {
        let plot = LandscapePlot {
            label: "frame 3".to_owned(),
            directions: ["<twist>".to_owned(), "yaw".to_owned()],
            reach_mm: 100.0,
            points: 2,
            energies: vec![0.0, 1.0, 2.0, 3.0],
            minimum_mm: [-100.0, -100.0],
            estimate_mm: [50.0, 100.0],
        };
        let svg = plot.svg().unwrap();
        assert!(svg.contains("cx=\"150.0\" cy=\"150.0\""), "the truth is in the middle");
        assert!(svg.contains("M0.0 300.0m") && svg.contains("M225.0 0.0m"), "{svg}");
        assert!(svg.contains("&lt;twist>") && !svg.contains("<twist>"));
        assert!(LandscapePlot { points: 0, ..plot }.svg().is_err());
    }
}
