//! The page that compares several methods.

use std::collections::BTreeMap;

use serde::Serialize;

use super::ReportError;
use super::html::render_page;
use super::page::{between, number, symbol};
use super::plots::{Colour, Line, LinePlot, Size, Stroke, Svg};
use crate::evaluation::{METRICS, Metric, Summary, quantile};

const TEMPLATE: &str = include_str!("comparison.html");
/// Metrics of the table.
const COLUMNS: [&str; 6] =
    ["humaneva_mm", "mpjpe_root_mm", "pa_mpjpe_mm", "body_orientation_deg", "track_loss", "coverage"];
const COLOURS: [Colour; 7] =
    [Colour::Blue, Colour::Orange, Colour::Green, Colour::Red, Colour::Purple, Colour::Amber, Colour::Ink];

/// The input of a comparison page. All methods tracked the same clip with the same seeds.
#[derive(Clone, Copy, Debug)]
pub struct ComparisonInput<'a> {
    /// The scenario's title.
    pub title: &'a str,
    /// Number of frames.
    pub frames: usize,
    /// Number of seeds.
    pub seeds: usize,
    /// Whether actor and tracker have the same body.
    pub matched: bool,
    /// The methods, at least one.
    pub methods: &'a [ComparedMethod],
}

/// One method of a comparison.
#[derive(Clone, Debug)]
pub struct ComparedMethod {
    /// Its name; its report is `NAME/report.html`.
    pub name: String,
    /// Its tracker, in words.
    pub tracker: String,
    /// All its seeds together.
    pub summary: Summary,
    /// Mean of every metric for a tracker that never moves.
    pub frozen: BTreeMap<String, f64>,
    /// Error (HumanEva, mm) of every seed over the frames, `[seed][frame]`.
    pub errors: Vec<Vec<Option<f64>>>,
}

#[derive(Serialize)]
struct ComparisonPage<'a> {
    title: &'a str,
    frames: usize,
    seeds: usize,
    matched: bool,
    interval: &'a str,
    columns: Vec<String>,
    rows: Vec<MethodRow<'a>>,
    plot: String,
}

#[derive(Serialize)]
struct MethodRow<'a> {
    name: &'a str,
    tracker: &'a str,
    cells: Vec<String>,
}

fn shown() -> impl Iterator<Item = &'static Metric> {
    METRICS.iter().filter(|metric| COLUMNS.contains(&metric.name))
}

impl<'a> MethodRow<'a> {
    fn new(method: &'a ComparedMethod) -> Self {
        let cell = |metric: &Metric| {
            method.summary.metrics.get(metric.name).map_or_else(
                || "-".to_owned(),
                |m| {
                    let ends = m.ci95.map(|i| format!(" ({})", between(i.low, i.high, m.unit))).unwrap_or_default();
                    let is_worse = method.frozen.get(metric.name).is_some_and(|floor| metric.is_worse(m.mean, *floor));
                    format!("{}{}{ends}", if is_worse { "▼ " } else { "" }, number(m.mean, m.unit))
                },
            )
        };
        Self { name: &method.name, tracker: &method.tracker, cells: shown().map(cell).collect() }
    }
}

/// The page: HTML with its plot inside, no network needed.
///
/// # Errors
/// [`ReportError`] without a method, or where the plot cannot be drawn.
pub fn comparison_page(input: &ComparisonInput<'_>) -> Result<String, ReportError> {
    let first = input.methods.first().ok_or(ReportError::NoRun)?;
    let Svg(plot) = error_plot(input.methods).svg(Size { width: 1160, height: 420 })?;
    let page = ComparisonPage {
        title: input.title,
        frames: input.frames,
        seeds: input.seeds,
        matched: input.matched,
        interval: &first.summary.interval,
        columns: shown().map(|metric| format!("{} {}", metric.title, symbol(metric.unit))).collect(),
        rows: input.methods.iter().map(MethodRow::new).collect(),
        plot,
    };
    render_page(TEMPLATE, &page)
}

/// The error of every method over the frames (as in `[GPDM graph]`, Fig. 6): the median over seeds.
pub fn error_plot(methods: &[ComparedMethod]) -> LinePlot {
    let line = |(index, method): (usize, &ComparedMethod)| {
        let frames = method.errors.iter().map(Vec::len).max().unwrap_or(0);
        let median = |frame: usize| {
            let mut present: Vec<f64> =
                method.errors.iter().filter_map(|seed| seed.get(frame).copied().flatten()).collect();
            present.sort_by(f64::total_cmp);
            quantile(&present, 0.5)
        };
        let points = (0..frames).map(|frame| (frame as f64, median(frame))).collect();
        let colour = COLOURS[index % COLOURS.len()];
        let stroke = if index < COLOURS.len() { Stroke::solid(colour) } else { Stroke::dashed(colour) };
        Line::new(&method.name.replace('_', " "), stroke, points)
    };
    LinePlot {
        x_label: "set frame, from 0".to_owned(),
        y_label: "mean marker error, mm".to_owned(),
        lines: methods.iter().enumerate().map(line).collect(),
        y_from: Some(0.0),
        ..LinePlot::default()
    }
}
