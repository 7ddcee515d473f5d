//! The page's plots, each with an explanation.

use serde::Serialize;

use crate::body::LANDMARKS;
use crate::evaluation::{Evaluation, JointSummary, LOSS_THRESHOLD_MM, SeedRun, mean};
use crate::motion_model::ModelOccupancy;
use crate::tracker::LayerRecord;

use super::comparison::median_line;
use super::error_map::{self, ErrorMap};
use super::input::worst_frames;
use super::plots::{Bar, BarGroup, BarPlot, Colour, Line, LinePlot, Size, SpanPlot, SpanRow, Stroke, Svg};
use super::{ReportError, ReportInput, ReportRun, Shown};

/// A plot at several widths; the page shows the one that fits.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ResponsiveSvg {
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

    /// Draws a line plot with these heights for the three widths.
    pub(super) fn of_lines(plot: &LinePlot, is_broad: bool, heights: [u32; 3]) -> Result<Self, ReportError> {
        let draw = |width, height| plot.svg(Size { width, height }).map(|Svg(text)| text);
        let broad = if is_broad { Some(draw(BROAD, heights[0])?) } else { None };
        Ok(Self { broad, wide: draw(WIDE, heights[1])?, narrow: draw(NARROW, heights[2])? })
    }
}

/// A plot with its explanation.
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
    Ok(Some(Figure {
        id,
        title,
        how_to_read,
        plot: ResponsiveSvg::of_lines(plot, span == Span::Whole, [330, 300, 270])?,
        about_search: ABOUT_SEARCH.contains(&id),
        over_frames: id != "pck",
    }))
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
    let name = |worst: &Shown| {
        if several {
            format!("worst: {}, seed {}", worst.frame, runs[worst.run].seed)
        } else {
            format!("worst: {}", worst.frame)
        }
    };
    let worst = worst_frames(&runs, 1).iter().map(|worst| (worst.frame as f64, name(worst))).collect();
    let plot = LinePlot {
        x_label: "set frame, from 0".into(),
        y_label: "mean marker error, mm".into(),
        lines: all,
        y_from: Some(0.0),
        y_to: Some(top),
        marks: worst,
        finding: error_finding(input, &runs),
        ..LinePlot::default()
    };
    let mut how = "Lower is better: mean distance of the fifteen body markers from their true positions.".to_owned();
    if several {
        how += " A wide band means that results depend strongly on the seed.";
    }
    if frozen_greatest > top {
        how += " The dashed line continues above the plot.";
    }
    if greatest > LOSS_THRESHOLD_MM {
        how += " Above 150 mm for fifteen frames in a row, the body counts as lost.";
    }
    lines("error", "Error over time", how, Span::Whole, &plot)
}

/// A summary of the error over time.
fn error_finding(input: &ReportInput<'_>, runs: &[SeedRun<'_>]) -> String {
    let mean = input.summary.metrics.get("humaneva_mm").map(|error| format!("mean {:.0} mm", error.mean));
    let worst = worst_frames(runs, 1).first().and_then(|worst| {
        let error = per_frame(runs[worst.run].evaluation, "humaneva_mm").get(worst.frame).copied().flatten()?;
        Some(format!("greatest {error:.0} mm in frame {} of seed {}", worst.frame, runs[worst.run].seed))
    });
    mean.into_iter().chain(worst).collect::<Vec<_>>().join(", ")
}

fn over_time(
    id: &'static str,
    title: &'static str,
    map: Option<ErrorMap>,
    run: &ReportRun<'_>,
) -> Result<Option<Figure>, ReportError> {
    let Some(ErrorMap { plot, how_to_read }) = map else { return Ok(None) };
    Ok(Some(Figure {
        id,
        title,
        how_to_read: format!("{how_to_read}{}", seed_note(run)),
        plot: ResponsiveSvg::new(true, |width| plot.svg(width))?,
        about_search: false,
        over_frames: true,
    }))
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
    let plot = SpanPlot {
        x_label: "set frame, from 0".into(),
        x_range: [0.0, frames],
        rows: rows.collect(),
        finding: stance_finding(run),
    };
    let how_to_read = format!(
        "Bars: frames in which the foot stands on the ground, determined from each body's geometry by the same rule.{}",
        seed_note(run)
    );
    Ok(Some(Figure {
        id: "stances",
        title: "Stances of each foot",
        how_to_read,
        plot: ResponsiveSvg::new(true, |width| plot.svg(width))?,
        about_search: false,
        over_frames: true,
    }))
}

/// A summary of the number of stances of each foot.
fn stance_finding(run: &ReportRun<'_>) -> String {
    let of_foot = |foot: &super::FootStances| {
        format!("{} stands {} times, in the estimate {}", foot.foot, foot.truth.len(), foot.estimate.len())
    };
    run.stances.iter().map(of_foot).collect::<Vec<_>>().join("; ")
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
        finding: joint_finding(input),
    };
    let mut how = format!("Shorter is better.{}{}", describe_worst(input), describe_sides(input));
    if input.summary.per_joint.iter().any(|joint| joint.ci95.is_some()) {
        how += " The thin line is the 95 % interval over seeds.";
    }
    if plot.cuts_off() {
        how += " An interval that reaches the right edge continues beyond it.";
    }
    Ok(Some(Figure {
        id: "joints",
        title: "Error per joint",
        how_to_read: how,
        plot: ResponsiveSvg::new(false, |width| plot.svg(width))?,
        about_search: false,
        over_frames: false,
    }))
}

/// Hands and feet are called worst if their mean error is this many times that of every other marker.
const CLEARLY: f64 = 1.1;

/// A sentence, after a space, on the worst markers: hands and feet if they are clearly worst, else the worst marker.
fn describe_worst(input: &ReportInput<'_>) -> String {
    let is_end = |joint: &&JointSummary| ["wrist", "ankle"].iter().any(|part| joint.joint.ends_with(part));
    let joints = &input.summary.per_joint;
    let (ends, others): (Vec<&JointSummary>, Vec<&JointSummary>) = joints.iter().partition(is_end);
    let means = |joints: &[&JointSummary]| joints.iter().map(|joint| joint.mean_mm).collect::<Vec<_>>();
    let (ends, others) = (means(&ends), means(&others));
    let greatest_of_others = others.iter().copied().fold(0.0, f64::max);
    match (mean(&ends), joints.iter().max_by(|a, b| a.mean_mm.total_cmp(&b.mean_mm))) {
        (Some(of_ends), _) if !others.is_empty() && of_ends > CLEARLY * greatest_of_others => {
            " Hands and feet are worst here, as is common, because they cover little of the silhouette.".to_owned()
        }
        (_, Some(worst)) if joints.len() > 1 => {
            format!(" Worst here: {}, {:.0} mm.", worst.joint.replace('_', " "), worst.mean_mm)
        }
        _ => String::new(),
    }
}

/// A sentence, after a space, on the joint whose sides differ most, if one error is at least twice the other and 30 mm
/// larger: then one limb is lost and the other is not.
fn describe_sides(input: &ReportInput<'_>) -> String {
    let joints = &input.summary.per_joint;
    let pair = |left: &JointSummary| {
        let part = left.joint.strip_prefix("left_")?.to_owned();
        let right = joints.iter().find(|joint| joint.joint.strip_prefix("right_") == Some(part.as_str()))?;
        Some((part.replace('_', " "), left.mean_mm, right.mean_mm))
    };
    let apart = |(_, left, right): &(String, f64, f64)| (left - right).abs();
    let one_sided = joints.iter().filter_map(pair).filter(|pair| apart(pair) >= pair.1.min(pair.2).max(30.0));
    one_sided.max_by(|one, other| apart(one).total_cmp(&apart(other))).map_or_else(String::new, |(part, left, right)| {
        let [worse, better] = if left > right { ["left", "right"] } else { ["right", "left"] };
        let (more, less) = (left.max(right), left.min(right));
        format!(" The {worse} {part} is {more:.0} mm off, the {better} one {less:.0} mm: one limb is lost, the other is not.")
    })
}

/// A summary of the worst and the best joint.
fn joint_finding(input: &ReportInput<'_>) -> String {
    let by_error = |a: &&JointSummary, b: &&JointSummary| a.mean_mm.total_cmp(&b.mean_mm);
    let joints = || input.summary.per_joint.iter();
    let words = |joint: &JointSummary| format!("{} with {:.0} mm", joint.joint.replace('_', " "), joint.mean_mm);
    match (joints().max_by(by_error), joints().min_by(by_error)) {
        (Some(worst), Some(best)) => format!("worst {}, best {}", words(worst), words(best)),
        _ => String::new(),
    }
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
        finding: input
            .summary
            .metrics
            .get("pck150")
            .map(|m| format!("{:.0} % within 150 mm", 100.0 * m.mean))
            .unwrap_or_default(),
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
        finding: energy_finding(run),
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

/// A summary of the number of frames in which the images prefer the estimate.
fn energy_finding(run: &ReportRun<'_>) -> String {
    let both =
        run.truth_energy.iter().zip(run.estimate_energy).filter_map(|(truth, estimate)| Some((*truth)? - (*estimate)?));
    let gaps: Vec<f64> = both.collect();
    let preferred = gaps.iter().filter(|gap| **gap > 0.0).count();
    format!("the estimate fits the images better than the truth in {preferred} of {} frames", gaps.len())
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
