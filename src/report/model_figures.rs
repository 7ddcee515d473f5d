//! The plots of a motion model's page.

use super::ReportError;
use super::figures::ResponsiveSvg;
use super::model_input::{LatentPath, ModelPageInput, OneModel};
use super::plots::{Colour, Line, LinePlot, Path, PathPanel, PathPlot, Size, Stroke, Svg};

/// Colours of models, in rotation; red is reserved for the prediction.
const COLOURS: [Colour; 6] = [Colour::Blue, Colour::Orange, Colour::Green, Colour::Purple, Colour::Amber, Colour::Ink];

/// With more models than this there is no legend.
const MOST_NAMED: usize = 6;

pub(super) fn colour(model: usize) -> Colour {
    COLOURS[model % COLOURS.len()]
}

/// Learned latents and mean prediction of one model (`[GPDM graph]`, Figs. 2 and 5a): the first principal axis against
/// the others.
pub(super) fn latents(index: usize, model: &OneModel) -> Result<ResponsiveSvg, ReportError> {
    let learned = Stroke::solid(colour(index));
    let predicted = Stroke::dashed(Colour::Red);
    let dimensions = model.learned.first().map_or(0, Vec::len);
    let panel = |y: usize| {
        let flat = |path: &LatentPath| path.iter().map(|z| [z[0], z.get(y).copied().unwrap_or(0.0)]).collect();
        PathPanel {
            x_label: "principal axis 1".to_owned(),
            y_label: if y < dimensions { format!("axis {}", y + 1) } else { String::new() },
            paths: vec![
                Path { stroke: learned, points: flat(&model.learned) },
                Path { stroke: predicted, points: flat(&model.predicted) },
            ],
        }
    };
    let panels: Vec<PathPanel> = (1..dimensions.clamp(2, 3)).map(panel).collect();
    let plot = PathPlot {
        label: format!("Latent space of model {}", index + 1),
        legend: vec![("learned".to_owned(), learned), ("mean prediction".to_owned(), predicted)],
        panels,
    };
    let count = plot.panels.len() as u32;
    let draw = |width, height, columns: u32| plot.svg(Size { width, height }, columns as usize).map(|Svg(text)| text);
    Ok(ResponsiveSvg { broad: None, wide: draw(560, 330, count)?, narrow: draw(350, 40 + 270 * count, 1)? })
}

/// Distance between recording and simulation per frame (`[GPDM graph]`, Figs. 3 and 5b).
pub(super) fn errors(input: &ModelPageInput<'_>) -> Result<ResponsiveSvg, ReportError> {
    let mut lines = Vec::new();
    if let Some(other) = &input.against {
        let points = other.errors.iter().enumerate().map(|(frame, e)| (frame as f64, Some(*e))).collect();
        lines.push(Line::new(&other.name, Stroke::solid(Colour::Grey), points));
    }
    let few = input.models.len() <= MOST_NAMED;
    for (index, model) in input.models.iter().enumerate() {
        let first = model.start as f64;
        let points = model.errors.iter().enumerate().map(|(i, e)| (first + i as f64, Some(*e))).collect();
        let name = if few { format!("model {}", index + 1) } else { String::new() };
        lines.push(Line::new(&name, Stroke::solid(colour(index)), points));
    }
    if let Some(threshold) = input.threshold {
        let end = input.models.last().map_or(0, |m| m.start + m.errors.len()).saturating_sub(1) as f64;
        let level = vec![(0.0, Some(threshold)), (end, Some(threshold))];
        lines.push(Line::new("TH", Stroke::dashed(Colour::Faint), level));
    }
    let plot = LinePlot {
        x_label: "training frame".to_owned(),
        y_label: "distance between simulation and recording, rad\u{b2}".to_owned(),
        lines,
        y_from: Some(0.0),
        ..LinePlot::default()
    };
    ResponsiveSvg::of_lines(&plot, true, [330, 300, 280])
}
