//! The page's plots, each with an explanation.

use serde::Serialize;

use skiagraph_core::body::LANDMARKS;
use skiagraph_eval::{Evaluation, JointSummary, SeedRun};
use skiagraph_track::motion_model::ModelOccupancy;
use skiagraph_track::tracker::LayerRecord;

use super::comparison::median_line;
use super::error_map::{self, ErrorMap};
use super::input::worst_frames;
use super::plots::{Bar, BarGroup, BarPlot, Colour, Line, LinePlot, Size, SpanPlot, SpanRow, Stroke, Svg};
use super::{ReportError, ReportInput, ReportRun, Shown};

/// A plot at several widths; the page shows the one that fits.
#[derive(Clone, Debug, Serialize)]
pub struct ResponsiveSvg {
    /// For the whole width of a page, if the plot has this size.
    pub(super) broad: Option<String>,
    /// For half the width of a page.
    pub(super) wide: String,
    /// For a phone.
    pub(super) narrow: String,
}

impl ResponsiveSvg {
    /// Draws a plot for each width; the full width only if `is_broad`.
    fn new(is_broad: bool, draw: impl Fn(u32) -> Result<Svg, ReportError>) -> Result<Self, ReportError> {
        let text = |width| draw(width).map(|Svg(text)| text);
        let broad = if is_broad { Some(text(BROAD)?) } else { None };
        Ok(Self { broad, wide: text(WIDE)?, narrow: text(NARROW)? })
    }

    /// Draws a line plot with these heights for the three widths, the full width only if `is_broad`.
    ///
    /// # Errors
    /// [`ReportError`] if it cannot be drawn.
    pub fn of_lines(plot: &LinePlot, is_broad: bool, heights: [u32; 3]) -> Result<Self, ReportError> {
        let draw = |width, height| plot.svg(Size { width, height }).map(|Svg(text)| text);
        let broad = if is_broad { Some(draw(BROAD, heights[0])?) } else { None };
        Ok(Self { broad, wide: draw(WIDE, heights[1])?, narrow: draw(NARROW, heights[2])? })
    }
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct Figure {
    /// Fragment identifier.
    pub(super) id: &'static str,
    title: &'static str,
    how_to_read: String,
    #[serde(flatten)]
    plot: ResponsiveSvg,
    /// Whether it concerns the search; such figures are collapsed.
    pub(super) about_search: bool,
    /// Whether its horizontal axis is the frame.
    over_frames: bool,
}

impl Figure {
    fn new(id: &'static str, title: &'static str, how_to_read: String, plot: ResponsiveSvg) -> Self {
        let (about_search, over_frames) = (ABOUT_SEARCH.contains(&id), !["pck", "joints"].contains(&id));
        Self { id, title, how_to_read, plot, about_search, over_frames }
    }

    /// The plot for half a page.
    pub(super) fn for_paper(&self) -> Svg {
        Svg(self.plot.wide.clone())
    }

    /// The caption: what it shows and how to read it.
    pub(super) fn caption(&self) -> String {
        format!("{}. {}", self.title, self.how_to_read)
    }
}

const BROAD: u32 = 1160;
const WIDE: u32 = 560;
const NARROW: u32 = 350;

/// Width of a figure on the page.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Span {
    Half,
    Whole,
}

/// All figures that the input allows. `typical` is the run for figures that show only one.
pub(super) fn figures(input: &ReportInput<'_>, typical: &ReportRun<'_>) -> Result<Vec<Figure>, ReportError> {
    let evaluation = typical.run.evaluation;
    let made = [
        error_over_frames(input)?,
        over_time("markers-over-time", "Error of each marker over time", error_map::of_markers(evaluation), typical)?,
        over_time(
            "cameras-over-time",
            "2-D error in each camera over time",
            error_map::of_cameras(evaluation),
            typical,
        )?,
        stances(typical)?,
        per_joint(input)?,
        pck_curve(input)?,
        energies(input, typical)?,
        effective_sample_size(typical)?,
        annealing(typical)?,
        occupancy(typical)?,
    ];
    Ok(made.into_iter().flatten().collect())
}

/// Figures that only the tracker's developers need.
const ABOUT_SEARCH: [&str; 3] = ["survival", "annealing", "occupancy"];

fn lines(
    id: &'static str,
    title: &'static str,
    how_to_read: String,
    span: Span,
    plot: &LinePlot,
) -> Result<Option<Figure>, ReportError> {
    if plot.lines.iter().all(|line| line.points.iter().all(|(_, value)| value.is_none())) {
        return Ok(None);
    }
    let drawn = ResponsiveSvg::of_lines(plot, span == Span::Whole, [330, 300, 270])?;
    Ok(Some(Figure::new(id, title, how_to_read, drawn)))
}

fn error_over_frames(input: &ReportInput<'_>) -> Result<Option<Figure>, ReportError> {
    let errors: Vec<&[Option<f64>]> =
        input.runs.iter().map(|run| per_frame(run.run.evaluation, "humaneva_mm")).collect();
    let several = input.runs.len() > 1;
    let name =
        if several { format!("tracker, median and range of {} seeds", input.runs.len()) } else { "tracker".to_owned() };
    let tracker = median_line(&name, Stroke::solid(Colour::Blue), &errors, |frame| frame as f64);
    let greatest = errors.iter().copied().flatten().flatten().fold(0.0_f64, |a, b| a.max(*b));
    let frozen = input.frozen.map(|frozen| per_frame(frozen, "humaneva_mm"));
    let frozen_greatest = frozen.into_iter().flatten().flatten().fold(0.0_f64, |a, b| a.max(*b));
    let top = 1.08 * greatest.max(frozen_greatest.min(2.0 * greatest)).max(10.0);
    let mut all = vec![tracker];
    all.extend(frozen.map(|f| Line::new("a tracker that never moves", Stroke::dashed(Colour::Grey), indexed(f))));
    let runs: Vec<SeedRun<'_>> = input.runs.iter().map(|run| run.run).collect();
    let mut worst = Vec::new();
    for Shown { run, frame } in worst_frames(&runs, 1) {
        worst.push((frame as f64, format!("worst: {frame}, seed {}", runs[run].seed)));
    }
    let plot = LinePlot {
        x_label: "set frame, from 0".into(),
        y_label: "mean marker error, mm".into(),
        lines: all,
        y_from: Some(0.0),
        y_to: Some(top),
        marks: worst,
        ..LinePlot::default()
    };
    let how = "Lower is better: mean distance of the fifteen body markers from their true positions. A wide band means that \
        results depend strongly on the seed. Above 150 mm for fifteen frames in a row, the body counts as lost. A line that \
        reaches the upper edge continues above it.";
    lines("error", "Error over time", how.into(), Span::Whole, &plot)
}

fn over_time(
    id: &'static str,
    title: &'static str,
    map: Option<ErrorMap>,
    run: &ReportRun<'_>,
) -> Result<Option<Figure>, ReportError> {
    let Some(ErrorMap { plot, how_to_read }) = map else { return Ok(None) };
    let drawn = ResponsiveSvg::new(true, |width| plot.svg(width))?;
    Ok(Some(Figure::new(id, title, format!("{how_to_read}{}", seed_note(run)), drawn)))
}

fn stances(run: &ReportRun<'_>) -> Result<Option<Figure>, ReportError> {
    let frames = run.run.evaluation.frames as f64;
    if run.stances.iter().all(|foot| foot.truth.is_empty() && foot.estimate.is_empty()) {
        return Ok(None);
    }
    let spans = |stances: &[[usize; 2]]| stances.iter().map(|stance| stance.map(|frame| frame as f64)).collect();
    let rows = run.stances.iter().flat_map(|foot| {
        [("true", Colour::Grey, &foot.truth), ("estimate", Colour::Blue, &foot.estimate)].map(
            |(whose, colour, stances)| SpanRow {
                name: format!("{}, {whose}", foot.foot),
                colour,
                spans: spans(stances),
            },
        )
    });
    let plot = SpanPlot { x_label: "set frame, from 0".into(), x_range: [0.0, frames], rows: rows.collect() };
    let how_to_read = format!(
        "Bars: frames in which the foot stands on the ground, determined from each body's geometry by the same rule.{}",
        seed_note(run)
    );
    let drawn = ResponsiveSvg::new(true, |width| plot.svg(width))?;
    Ok(Some(Figure::new("stances", "Stances of each foot", how_to_read, drawn)))
}

fn per_joint(input: &ReportInput<'_>) -> Result<Option<Figure>, ReportError> {
    let find = |name: &str| input.summary.per_joint.iter().find(|joint| joint.joint == name);
    let bar = |joint: &JointSummary, colour| Bar {
        value: joint.mean_mm,
        interval: joint.ci95.map(|interval| [interval.low, interval.high]),
        colour,
    };
    let mut groups: Vec<BarGroup> = Vec::new();
    for landmark in LANDMARKS.iter().map(|landmark| landmark.name()) {
        let (part, bars) = if let Some(part) = landmark.strip_prefix("left_") {
            let right = find(&format!("right_{part}")).map(|joint| bar(joint, Colour::Orange));
            (part, find(landmark).map(|joint| bar(joint, Colour::Blue)).into_iter().chain(right).collect())
        } else if landmark.starts_with("right_") {
            continue;
        } else {
            (landmark, find(landmark).map(|joint| bar(joint, Colour::Grey)).into_iter().collect())
        };
        groups.push(BarGroup { name: part.replace('_', " "), bars });
    }
    groups.retain(|group| !group.bars.is_empty());
    if groups.is_empty() {
        return Ok(None);
    }
    let legend = [("left", Colour::Blue), ("right", Colour::Orange), ("middle of the body", Colour::Grey)];
    let plot = BarPlot {
        title: None,
        value_label: "mean error, mm".into(),
        legend: legend.map(|(name, colour)| (name.to_owned(), colour)).into(),
        groups,
    };
    let how = "Shorter is better. Hands and feet often have the largest errors, because they cover little of the silhouette. \
        If left and right of a joint differ by much, one limb is lost and the other is not. The thin line is the 95 % \
        interval over seeds; one that reaches the right edge continues beyond it.";
    let drawn = ResponsiveSvg::new(false, |width| plot.svg(width))?;
    Ok(Some(Figure::new("joints", "Error per joint", how.into(), drawn)))
}

fn pck_curve(input: &ReportInput<'_>) -> Result<Option<Figure>, ReportError> {
    let curve = |evaluation: &Evaluation| -> Vec<(f64, Option<f64>)> {
        evaluation.pck_curve.iter().map(|point| (point.threshold_mm, Some(100.0 * point.fraction))).collect()
    };
    let curves: Vec<_> = input.runs.iter().map(|run| curve(run.run.evaluation)).collect();
    let shares: Vec<Vec<Option<f64>>> =
        curves.iter().map(|curve| curve.iter().map(|(_, share)| *share).collect()).collect();
    let threshold = |index: usize| curves[0].get(index).map_or(0.0, |(threshold, _)| *threshold);
    let tracker = median_line("tracker", Stroke::solid(Colour::Blue), &shares, threshold);
    let mut all = vec![tracker];
    let frozen = input.frozen.map(curve);
    all.extend(frozen.map(|points| Line::new("a tracker that never moves", Stroke::dashed(Colour::Grey), points)));
    let plot = LinePlot {
        x_label: "distance from the truth, mm".into(),
        y_label: "markers within it, %".into(),
        lines: all,
        y_from: Some(0.0),
        y_to: Some(100.0),
        ..LinePlot::default()
    };
    let how = "Higher is better: share of markers within the distance on the horizontal axis (PCK). The area under the \
        curve is the AUC metric.";
    lines("pck", "Share of markers within a distance", how.into(), Span::Half, &plot)
}

fn energies(input: &ReportInput<'_>, run: &ReportRun<'_>) -> Result<Option<Figure>, ReportError> {
    let plot = LinePlot {
        x_label: "set frame, from 0".into(),
        y_label: "energy (lower fits the images better)".into(),
        lines: vec![
            Line::new("at the true pose", Stroke::solid(Colour::Green), indexed(run.truth_energy)),
            Line::new("at the estimate", Stroke::dashed(Colour::Red), indexed(run.estimate_energy)),
        ],
        ..LinePlot::default()
    };
    let how = if input.own_likelihood {
        "Search or model? Where the dashed line is below the solid line, the images prefer a wrong pose: the \
         likelihood or the body model causes the error. Where it is above, the search missed a better pose."
    } else {
        "By skiagraph's silhouette likelihood on the set's body, because the program's own likelihood is unknown. Where the \
         dashed line is above the solid line, the silhouettes fit the true pose better; where it is below, they fit a wrong \
         pose better."
    };
    lines("energy", "Energy of truth and estimate", format!("{how}{}", seed_note(run)), Span::Whole, &plot)
}

fn effective_sample_size(run: &ReportRun<'_>) -> Result<Option<Figure>, ReportError> {
    let plot = LinePlot {
        x_label: "set frame, from 0".into(),
        y_label: "effective sample size".into(),
        lines: of_layers(run, |layer| layer.effective_sample_size),
        y_from: Some(0.0),
        ..LinePlot::default()
    };
    let how = "Effective number of particles after each layer. A steady line is healthy; a line near the bottom means \
        that almost all weight is on one particle.";
    lines("survival", "Effective sample size by layer", format!("{how}{}", seed_note(run)), Span::Half, &plot)
}

fn annealing(run: &ReportRun<'_>) -> Result<Option<Figure>, ReportError> {
    let plot = LinePlot {
        x_label: "set frame, from 0".into(),
        y_label: "λ, sharpness of the weights (log scale)".into(),
        lines: of_layers(run, |layer| layer.lambda),
        logarithmic: true,
        ..LinePlot::default()
    };
    let how = "The weights get sharper from layer to layer, so the search narrows. In every frame λ is set so that the \
        requested share of particles survives.";
    lines("annealing", "Annealing λ by layer", format!("{how}{}", seed_note(run)), Span::Half, &plot)
}

/// Stacked bands, one per model (`[GPDM graph]`, Fig. 7).
fn occupancy(run: &ReportRun<'_>) -> Result<Option<Figure>, ReportError> {
    let models = run.occupancy.iter().map(|models| models.len()).max().unwrap_or(0);
    if models < 2 {
        return Ok(None);
    }
    let up_to =
        |frame: &[ModelOccupancy], end: usize| frame[..end.min(frame.len())].iter().map(|m| m.particles).sum::<u32>();
    let band = |model: usize| {
        let ends = |frame: &&[ModelOccupancy]| [f64::from(up_to(frame, model)), f64::from(up_to(frame, model + 1))];
        let edges = run.occupancy.iter().map(ends).enumerate().map(|(frame, ends)| (frame as f64, ends));
        let stroke = Stroke::solid(Colour::from_rank(model, models));
        let points = edges.clone().map(|(frame, [_, high])| (frame, Some(high))).collect();
        Line {
            band: edges.map(|(x, ends)| (x, Some(ends))).collect(),
            ..Line::new(&format!("model {}", model + 1), stroke, points)
        }
    };
    let plot = LinePlot {
        x_label: "set frame, from 0".into(),
        y_label: "particles".into(),
        lines: (0..models).map(band).collect(),
        y_from: Some(0.0),
        ..LinePlot::default()
    };
    let recovered: u32 = run.occupancy.iter().copied().flatten().map(|m| m.recovered).sum();
    let how = format!(
        "Number of particles in each learned model before resampling, stacked: a motion that passes through several \
        models moves from band to band. Particles left the region known to their model and were reset {recovered} times.{}",
        seed_note(run)
    );
    lines("occupancy", "Particles per model", how, Span::Whole, &plot)
}

fn of_layers(run: &ReportRun<'_>, value: fn(&LayerRecord) -> f64) -> Vec<Line> {
    let count = run.layers.iter().map(|layers| layers.len()).max().unwrap_or(0);
    let of_layer = |layer: usize| {
        let finite = |frame: &[LayerRecord]| frame.get(layer).map(value).filter(|value| value.is_finite());
        let points = run.layers.iter().enumerate().map(|(frame, layers)| (frame as f64, finite(layers))).collect();
        Line::new(&format!("layer {}", layer + 1), Stroke::solid(Colour::from_rank(layer, count)), points)
    };
    (0..count).map(of_layer).collect()
}

fn seed_note(run: &ReportRun<'_>) -> String {
    format!(" Seed {}.", run.run.seed)
}

/// The values of a metric per frame; empty if it was not measured.
pub(super) fn per_frame<'a>(evaluation: &'a Evaluation, metric: &str) -> &'a [Option<f64>] {
    evaluation.metrics.get(metric).map_or(&[], |value| &value.per_frame)
}

fn indexed(values: &[Option<f64>]) -> Vec<(f64, Option<f64>)> {
    values.iter().enumerate().map(|(frame, value)| (frame as f64, *value)).collect()
}

#[cfg(test)]
mod tests;
