//! Scatter plots, heat maps and curves of a sweep.

use std::collections::HashSet;

use serde::Serialize;

use super::analysis::{CostMeasure, Effect, effects, pareto_front};
use super::input::SweepPageInput;
use super::{heat, shown};
use crate::evaluation::{Direction, mean};
use crate::report::displayed::{number, symbol};
use crate::report::plots::{
    Colour, HeatCell, HeatPlot, Line, LinePlot, ScatterGroup, ScatterPlot, ScatterPoint, Size, Stroke, Svg,
};
use crate::report::{FigureFile, ReportError};
use crate::sweep::summary::SettingSummary;

/// Sizes of plots on wide screens and on phones.
pub(super) const SIZES: [Size; 2] = [Size { width: 580, height: 350 }, Size { width: 350, height: 300 }];
/// Maximum number of heat maps; if there would be more, the other axes are averaged.
const MAPS: usize = 9;
/// Maximum number of values of an axis of a heat map.
const WIDEST: usize = 40;
/// Maximum number of values of an axis of a line plot.
const LONGEST: usize = 200;
/// Maximum number of lines in a plot.
const LINES: usize = 6;
pub(super) const COLOURS: [Colour; LINES] =
    [Colour::Blue, Colour::Orange, Colour::Green, Colour::Red, Colour::Purple, Colour::Amber];

#[derive(Serialize)]
pub(super) struct Map {
    pub(super) title: String,
    pub(super) columns: Vec<String>,
    pub(super) rows: Vec<(String, Vec<MapCell>)>,
}

#[derive(Clone, Default, Serialize)]
pub(super) struct MapCell {
    pub(super) text: String,
    note: String,
    /// 0 (best) to 1 (worst) of all maps; absent for an empty cell.
    pub(super) place: Option<f64>,
    /// Its background on a light and on a dark page, as CSS colours.
    grounds: [String; 2],
}

#[derive(Serialize)]
pub(super) struct ErrorCurve {
    pub(super) axis: String,
    pub(super) plot: TwoSizes,
}

/// A plot as SVG for wide screens and for phones.
#[derive(Serialize)]
pub(super) struct TwoSizes {
    pub(super) wide: String,
    narrow: String,
}

impl TwoSizes {
    pub(super) fn new(draw: impl Fn(Size) -> Result<Svg, ReportError>) -> Result<Self, ReportError> {
        let [Svg(wide), Svg(narrow)] = [draw(SIZES[0])?, draw(SIZES[1])?];
        Ok(Self { wide, narrow })
    }
}

/// Error over cost with the Pareto front, as SVG.
pub(super) fn scatter(plot: &ScatterPlot) -> Result<TwoSizes, ReportError> {
    TwoSizes::new(|size| plot.svg(size))
}

/// Error over cost with the Pareto front.
pub(super) fn scatter_plot(input: &SweepPageInput, cost: CostMeasure) -> ScatterPlot {
    let axis = grouping_axis(input);
    let mut groups: Vec<ScatterGroup> = Vec::new();
    let is_drawn = |point: &SettingSummary| cost.of_setting(point).is_some();
    for point in shown::dots(input.settings(), input.objective, is_drawn).into_iter().map(|at| &input.settings()[at]) {
        let (Some(x), Some(y)) = (cost.of_setting(point), point.mean) else { continue };
        let name =
            axis.map_or_else(|| "settings".to_owned(), |axis| format!("{} {}", input.axes[axis], point.labels[axis]));
        let dot = ScatterPoint { x, y, interval: point.ci95.map(|i| [i.low, i.high]) };
        match groups.iter_mut().find(|group| group.name == name) {
            Some(group) => group.points.push(dot),
            None => groups.push(ScatterGroup { name, colour: COLOURS[groups.len() % LINES], points: vec![dot] }),
        }
    }
    let front = shown::front(&pareto_front(input.settings(), cost, input.objective));
    let place = |at: usize| Some([cost.of_setting(&input.settings()[at])?, input.settings()[at].mean?]);
    ScatterPlot {
        x_label: match cost {
            CostMeasure::Evaluations => "likelihood evaluations a frame".to_owned(),
            CostMeasure::Processor => "processor time a frame, ms".to_owned(),
        },
        y_label: labelled(input),
        groups,
        front: front.into_iter().filter_map(place).collect(),
    }
}

/// The axis shown by colour: one with few values, preferably not numeric.
fn grouping_axis(input: &SweepPageInput) -> Option<usize> {
    let count = |axis: &usize| labels(input, *axis).len();
    let few: Vec<usize> = (0..input.axes.len()).filter(|axis| (2..=LINES).contains(&count(axis))).collect();
    let named = few.iter().copied().find(|axis| !input.is_numeric(*axis));
    named.or_else(|| few.into_iter().min_by_key(count))
}

/// The values of an axis in the order of the plan.
pub(super) fn labels(input: &SweepPageInput, axis: usize) -> Vec<String> {
    let mut seen: HashSet<&str> = HashSet::new();
    let all = input.settings().iter().filter_map(|point| point.labels.get(axis)).filter(|label| !label.is_empty());
    all.filter(|label| seen.insert(label)).cloned().collect()
}

/// Particles over layers if both are axes, else the two numeric axes with the most values.
fn map_axes(input: &SweepPageInput) -> Option<[usize; 2]> {
    let named = |name: &str| input.axes.iter().position(|axis| axis == name || axis.ends_with(&format!(".{name}")));
    let varied = |axis: &usize| labels(input, *axis).len() > 1;
    if let Some(pair) = named("particles").zip(named("layers")).filter(|(a, b)| varied(a) && varied(b)) {
        return Some([pair.0, pair.1]);
    }
    let mut numeric: Vec<usize> =
        (0..input.axes.len()).filter(|axis| varied(axis) && input.is_numeric(*axis)).collect();
    numeric.sort_by_key(|axis| std::cmp::Reverse(labels(input, *axis).len()));
    match numeric.as_slice() {
        [a, b, ..] => Some([*a, *b]),
        _ => None,
    }
}

/// The axes of the heat maps, the maps, and whether they are averaged over the other axes.
pub(super) fn maps(input: &SweepPageInput) -> (Option<[usize; 2]>, Vec<Map>, bool) {
    let Some(axes) = map_axes(input) else { return (None, Vec::new(), false) };
    let [vertical, horizontal] = axes;
    if axes.iter().any(|axis| labels(input, *axis).len() > WIDEST) {
        return (None, Vec::new(), false);
    }
    let others: Vec<usize> = (0..input.axes.len()).filter(|axis| !axes.contains(axis)).collect();
    let of = |point: &SettingSummary| -> String {
        let words = others.iter().map(|axis| format!("{}={}", input.axes[*axis], point.labels[*axis]));
        words.collect::<Vec<_>>().join(" ")
    };
    let mut kinds: Vec<String> = Vec::new();
    for kind in input.settings().iter().map(of) {
        if !kinds.contains(&kind) && kinds.len() <= MAPS {
            kinds.push(kind);
        }
    }
    let averaged = kinds.len() > MAPS;
    if averaged {
        kinds = vec!["mean over all other axes".to_owned()];
    }
    let (columns, lines) = (sorted(input, horizontal), sorted(input, vertical));
    let value = |kind: &String, line: &String, column: &String| -> Vec<f64> {
        let fits = |p: &&SettingSummary| {
            p.labels[vertical] == *line && p.labels[horizontal] == *column && (averaged || of(p) == *kind)
        };
        input.settings().iter().filter(fits).filter_map(|p| p.mean).collect()
    };
    let mut all: Vec<f64> = Vec::new();
    for kind in &kinds {
        for line in &lines {
            all.extend(columns.iter().filter_map(|column| mean(&value(kind, line, column))));
        }
    }
    let [least, most] = all.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, m], v| [l.min(*v), m.max(*v)]);
    let cell = |kind: &String, line: &String, column: &String| {
        let values = value(kind, line, column);
        let Some(middle) = mean(&values) else { return MapCell::default() };
        // errors differ by factors, so shades are logarithmic if all values are positive
        let place = if most <= least {
            0.0
        } else if least > 0.0 {
            libm::log(middle / least) / libm::log(most / least)
        } else {
            (middle - least) / (most - least)
        };
        let place = if input.objective.direction == Direction::HigherIsBetter { 1.0 - place } else { place };
        let note = match values.len() {
            1 => String::new(),
            count => format!("mean of {count} settings"),
        };
        MapCell {
            text: number(middle, input.objective.unit),
            note,
            place: Some(place),
            grounds: [heat::on_light(place), heat::on_dark(place)].map(heat::hex),
        }
    };
    let maps = kinds
        .iter()
        .map(|kind| Map {
            title: kind.clone(),
            columns: columns.clone(),
            rows: lines
                .iter()
                .map(|line| (line.clone(), columns.iter().map(|column| cell(kind, line, column)).collect()))
                .collect(),
        })
        .collect();
    (Some(axes), maps, averaged)
}

/// The values of an axis, with numbers sorted by size.
fn sorted(input: &SweepPageInput, axis: usize) -> Vec<String> {
    let mut found = labels(input, axis);
    found.sort_by(|a, b| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => a.total_cmp(&b),
        _ => std::cmp::Ordering::Equal,
    });
    found
}

/// The objective over every numeric axis, with one line per value of the strongest other axis.
pub(super) fn curves(input: &SweepPageInput, effects: Option<&[Effect]>) -> Result<Vec<ErrorCurve>, ReportError> {
    let mut curves = Vec::new();
    for axis in 0..input.axes.len() {
        let values = sorted(input, axis);
        if !(2..=LONGEST).contains(&values.len()) || values.iter().any(|value| value.parse::<f64>().is_err()) {
            continue;
        }
        let few = |other: &usize| *other != axis && (2..=LINES).contains(&labels(input, *other).len());
        let strongest = effects.and_then(|effects| effects.iter().map(|effect| effect.axes[0]).find(few));
        let other = strongest.or_else(|| (0..input.axes.len()).find(few));
        let kinds = other.map_or_else(|| vec![String::new()], |other| sorted(input, other));
        let line = |(number, kind): (usize, &String)| {
            let points = values.iter().map(|value| {
                let fits = |p: &&SettingSummary| {
                    p.labels[axis] == *value && other.is_none_or(|other| p.labels[other] == *kind)
                };
                let found: Vec<f64> = input.settings().iter().filter(fits).filter_map(|p| p.mean).collect();
                (value.parse().unwrap_or_default(), mean(&found))
            });
            let name = other.map_or_else(String::new, |other| format!("{} {kind}", input.axes[other]));
            Line::new(&name, Stroke::solid(COLOURS[number % LINES]), points.collect())
        };
        let plot = LinePlot {
            x_label: input.axes[axis].clone(),
            y_label: labelled(input),
            lines: kinds.iter().enumerate().map(line).collect(),
            y_from: Some(0.0),
            ..LinePlot::default()
        };
        curves.push(ErrorCurve { axis: input.axes[axis].clone(), plot: TwoSizes::new(|size| plot.svg(size))? });
    }
    Ok(curves)
}

/// The objective with its unit.
pub(super) fn labelled(input: &SweepPageInput) -> String {
    match symbol(input.objective.unit) {
        "" => input.objective.title.to_owned(),
        unit => format!("{}, {unit}", input.objective.title),
    }
}

/// The figures of a sweep: the objective over either cost, heat maps, and the objective along every axis.
///
/// # Errors
/// [`ReportError`] without a setting, or if a plot cannot be drawn.
pub fn sweep_figures(input: &SweepPageInput) -> Result<Vec<FigureFile>, ReportError> {
    if input.settings().is_empty() {
        return Err(ReportError::NoRun);
    }
    let what = labelled(input);
    let mut files = Vec::new();
    for (cost, name, over) in [
        (CostMeasure::Evaluations, "cost-evaluations", "likelihood evaluations"),
        (CostMeasure::Processor, "cost-processor", "processor time"),
    ] {
        let plot = scatter_plot(input, cost);
        if plot.groups.is_empty() {
            continue;
        }
        let caption = format!(
            "{what} over {over}: one dot per setting{}. No cheaper setting is better than one on the dashed Pareto front.{}",
            if input.summary.has_intervals() { ", with its 95 % interval over seeds" } else { "" },
            if plot.cuts_off() { " A bar with an arrow continues above the plot." } else { "" }
        );
        files.push(FigureFile::new(name, caption, &plot.svg(SIZES[0])?));
    }
    if let (Some(axes), maps, _) = maps(input) {
        let [down, across] = axes.map(|axis| input.axes[axis].clone());
        for (index, map) in maps.iter().enumerate() {
            let of = if map.title.is_empty() { String::new() } else { format!(" ({})", map.title) };
            let caption = format!("Mean {what}: {down} (down) by {across} (across){of}. Orange is worse.");
            files.push(FigureFile::new(&format!("map-{}", index + 1), caption, &map.plot(&down, &across).svg()?));
        }
    }
    let strongest = effects(input.settings(), input.axes.len()).map(|(single, _)| single);
    for curve in curves(input, strongest.as_deref())? {
        let name = format!("axis-{}", curve.axis.replace(|letter: char| !letter.is_ascii_alphanumeric(), "-"));
        let caption = format!("{what} over {}: means over all other axes.", curve.axis);
        files.push(FigureFile::new(&name, caption, &Svg(curve.plot.wide)));
    }
    Ok(files)
}

impl Map {
    fn plot(&self, down: &str, across: &str) -> HeatPlot {
        let cell = |cell: &MapCell| Some(HeatCell { text: cell.text.clone(), ground: heat::on_light(cell.place?) });
        HeatPlot {
            down: down.to_owned(),
            across: across.to_owned(),
            columns: self.columns.clone(),
            rows: self.rows.iter().map(|(name, cells)| (name.clone(), cells.iter().map(cell).collect())).collect(),
        }
    }
}
