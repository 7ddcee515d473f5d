//! The page of a ladder: a curve per tracker and axis, and where the error doubles.

use serde::Serialize;

use super::figures::{COLOURS, TwoSizes};
use super::input::SweepPageInput;
use crate::evaluation::{Direction, Metric};
use crate::observation::CorruptionAxis;
use crate::report::ReportError;
use crate::report::displayed::{between, number, symbol};
use crate::report::html::render_page;
use crate::report::plots::{Colour, Line, LinePlot, Stroke};
use crate::sweep::coverage;
use crate::sweep::ladder::{Ladder, LadderCurve, LadderLevel};

const TEMPLATE: &str = include_str!("ladder.html");

#[derive(Serialize)]
struct LadderPage<'a> {
    title: &'a str,
    objective: &'a str,
    unit: &'static str,
    lower_is_better: bool,
    trackers: usize,
    draws: usize,
    incomplete: usize,
    remarks: &'a [String],
    axes: Vec<AxisPart<'a>>,
    facts: &'a [(String, String)],
}

#[derive(Serialize)]
struct AxisPart<'a> {
    title: String,
    meaning: &'a str,
    levels: Vec<String>,
    rows: Vec<CurveRow<'a>>,
    plot: TwoSizes,
}

#[derive(Serialize)]
struct CurveRow<'a> {
    tracker: &'a str,
    cells: Vec<LevelCell>,
    doubles: String,
}

#[derive(Serialize)]
struct LevelCell {
    mean: String,
    interval: String,
    lost: usize,
    /// The share of the markers that have an estimate, unless all have one.
    coverage: Option<String>,
}

impl LadderCurve {
    /// The axis with its unit.
    pub(crate) fn title(&self) -> String {
        if self.unit.is_empty() { self.axis.clone() } else { format!("{}, {}", self.axis, self.unit) }
    }

    /// Where the error doubles, in words.
    pub(crate) fn doubling(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match (self.doubles_at, self.levels.last()) {
            (Some(level), _) => format!("{level:.3}{unit}"),
            (None, Some(last)) if self.clean().is_some_and(|clean| clean > 0.0) => {
                format!("above {}{unit}", last.level)
            }
            _ => "-".to_owned(),
        }
    }
}

impl LadderLevel {
    /// The mean as text.
    pub(crate) fn mean_text(&self, metric: &Metric) -> String {
        self.mean.map_or("-".to_owned(), |mean| number(mean, metric.unit))
    }
}

/// The page of a ladder: self-contained HTML with inline plots.
///
/// # Errors
/// [`ReportError`] without a curve, or if a plot cannot be drawn.
pub fn ladder_page(ladder: &Ladder, input: &SweepPageInput) -> Result<String, ReportError> {
    let of_axes: Vec<&[LadderCurve]> = ladder.curves.chunk_by(|a, b| a.axis == b.axis).collect();
    let Some(first) = of_axes.first() else { return Err(ReportError::NoRun) };
    let page = LadderPage {
        title: &ladder.name,
        objective: input.objective.title,
        unit: symbol(input.objective.unit),
        lower_is_better: input.objective.direction != Direction::HigherIsBetter,
        trackers: first.len(),
        draws: ladder.draws,
        incomplete: ladder.incomplete,
        remarks: &ladder.remarks,
        axes: of_axes.iter().map(|curves| part(curves, input)).collect::<Result<_, _>>()?,
        facts: &input.facts,
    };
    render_page(TEMPLATE, &page)
}

fn part<'a>(curves: &'a [LadderCurve], input: &SweepPageInput) -> Result<AxisPart<'a>, ReportError> {
    let first = curves.first().ok_or(ReportError::NoRun)?;
    let plot = LinePlot {
        x_label: first.title(),
        y_label: super::figures::labelled(input),
        lines: curves.iter().enumerate().map(|(number, curve)| line(curve, number)).chain(still(first)).collect(),
        y_from: Some(0.0),
        marks: match curves {
            [only] => only.doubles_at.map(|level| (level, "twice the clean error".to_owned())).into_iter().collect(),
            _ => Vec::new(),
        },
        ..LinePlot::default()
    };
    let metric = input.objective;
    let cell = |level: &LadderLevel| LevelCell {
        mean: level.mean_text(metric),
        interval: level.ci95.map_or_else(String::new, |ends| between(ends.low, ends.high, metric.unit)),
        lost: level.lost,
        coverage: coverage::note(level.coverage),
    };
    let row = |curve: &'a LadderCurve| CurveRow {
        tracker: &curve.tracker,
        cells: curve.levels.iter().map(cell).collect(),
        doubles: curve.doubling(),
    };
    Ok(AxisPart {
        title: first.title(),
        meaning: CorruptionAxis::named(&first.axis).map_or("", |axis| axis.formula),
        levels: first.levels.iter().map(|level| level.level.to_string()).collect(),
        rows: curves.iter().map(row).collect(),
        plot: TwoSizes::new(|size| plot.svg(size))?,
    })
}

fn line(curve: &LadderCurve, number: usize) -> Line {
    let points = curve.levels.iter().map(|level| (level.level, level.mean)).collect();
    let band = curve.levels.iter().map(|level| (level.level, level.ci95.map(|ends| [ends.low, ends.high])));
    let stroke = Stroke::solid(COLOURS[number % COLOURS.len()]);
    Line { band: band.collect(), ..Line::new(&curve.tracker, stroke, points) }
}

/// The error of a tracker that never moves.
fn still(curve: &LadderCurve) -> Option<Line> {
    let frozen = curve.frozen()?;
    let points = curve.levels.iter().map(|level| (level.level, Some(frozen))).collect();
    Some(Line::new("never moves", Stroke::dashed(Colour::Faint), points))
}
