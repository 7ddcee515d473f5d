//! The page that compares several methods.

use std::collections::BTreeMap;

use serde::Serialize;

use super::ReportError;
use super::displayed::{between, number, symbol};
use super::html::render_page;
use super::plots::{Colour, Line, LinePlot, Size, Stroke, Svg};
use crate::evaluation::{ClipValues, IntervalUnit, METRICS, Metric, Summary, difference, do_pair, quantile};

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
    verdict: String,
    rows: Vec<MethodRow<'a>>,
    /// For broad pages and for phones.
    plot: String,
    narrow: String,
}

#[derive(Serialize)]
struct MethodRow<'a> {
    name: &'a str,
    tracker: &'a str,
    cells: Vec<String>,
    band: Option<Band>,
}

/// A method's error with its interval as a bar, in per cent of the greatest.
#[derive(Serialize)]
struct Band {
    error: f64,
    low: f64,
    width: f64,
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
        Self { name: &method.name, tracker: &method.tracker, cells: shown().map(cell).collect(), band: None }
    }
}

/// The page: HTML with its plot inside, no network needed.
///
/// # Errors
/// [`ReportError`] without a method, or where the plot cannot be drawn.
pub fn comparison_page(input: &ComparisonInput<'_>) -> Result<String, ReportError> {
    let mut methods: Vec<&ComparedMethod> = input.methods.iter().collect();
    methods.sort_by(|a, b| error_of(a).total_cmp(&error_of(b)));
    let first = methods.first().ok_or(ReportError::NoRun)?;
    let plot = error_plot(input.methods);
    let (Svg(broad), Svg(narrow)) =
        (plot.svg(Size { width: 1160, height: 420 })?, plot.svg(Size { width: 350, height: 360 })?);
    let page = ComparisonPage {
        title: input.title,
        frames: input.frames,
        seeds: input.seeds,
        matched: input.matched,
        interval: &first.summary.interval,
        columns: shown().map(|metric| format!("{} {}", metric.title, symbol(metric.unit))).collect(),
        verdict: verdict(&methods),
        rows: bands(&methods),
        plot: broad,
        narrow,
    };
    render_page(TEMPLATE, &page)
}

/// Mean error, mm; infinite where there is none, so that it comes last.
pub(super) fn error_of(method: &ComparedMethod) -> f64 {
    method.summary.metrics.get("humaneva_mm").map_or(f64::INFINITY, |error| error.mean)
}

/// A row a method, with its error and interval to one scale.
fn bands<'a>(methods: &[&'a ComparedMethod]) -> Vec<MethodRow<'a>> {
    let error = |method: &ComparedMethod| {
        let error = method.summary.metrics.get("humaneva_mm")?;
        Some((error.mean, error.ci95.map_or([error.mean; 2], |ends| [ends.low, ends.high])))
    };
    let greatest =
        methods.iter().filter_map(|m| error(m)).map(|(mean, [_, high])| high.min(2.0 * mean)).fold(1e-9, f64::max);
    let band = |(mean, [low, high]): (f64, [f64; 2])| {
        let part = |value: f64| (1000.0 * (value / greatest).clamp(0.0, 1.0)).round() / 10.0;
        Band { error: part(mean), low: part(low), width: (part(high) - part(low)).max(0.4) }
    };
    methods.iter().map(|method| MethodRow { band: error(method).map(band), ..MethodRow::new(method) }).collect()
}

/// In words: which method is best, and whether it is surely better than the next.
pub(super) fn verdict(methods: &[&ComparedMethod]) -> String {
    let measured: Vec<&&ComparedMethod> = methods.iter().filter(|method| error_of(method).is_finite()).collect();
    let [best, rest @ ..] = measured.as_slice() else { return "No method has an error that could be measured.".into() };
    let alone = format!("{} has the least mean marker error, {:.1} mm", best.name, error_of(best));
    let Some(next) = rest.first() else { return format!("{alone}.") };
    let values = |method: &ComparedMethod| -> Vec<(u64, f64)> {
        let runs = method.summary.runs.iter().zip(&method.summary.metrics["humaneva_mm"].per_run);
        runs.filter_map(|(run, value)| Some((run.seed, (*value)?))).collect()
    };
    let seeds = |method: &ComparedMethod| method.summary.runs.iter().map(|run| run.seed).collect::<Vec<u64>>();
    let clip = ClipValues { base: values(best), other: values(next) };
    let found = difference(&[clip], do_pair(&seeds(best), &seeds(next)), IntervalUnit::Seeds);
    let more = found.as_ref().map_or(0.0, |found| found.difference);
    match found.and_then(|found| found.ci95) {
        Some(ends) if ends.low > 0.0 => format!(
            "{alone}. It is better than the next, {}, by {more:.1} mm (95 %: {}).",
            next.name,
            between(ends.low, ends.high, crate::evaluation::Unit::Millimetre)
        ),
        Some(ends) => format!(
            "{alone}, but cannot be told from {} with these seeds: the difference is {more:.1} mm (95 %: {}).",
            next.name,
            between(ends.low, ends.high, crate::evaluation::Unit::Millimetre)
        ),
        None => format!("{alone}; {} has {:.1} mm. Too few seeds to say more.", next.name, error_of(next)),
    }
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
        let ends = |frame: usize| {
            let present = || method.errors.iter().filter_map(|seed| seed.get(frame).copied().flatten());
            let low = present().min_by(f64::total_cmp)?;
            Some([low, present().max_by(f64::total_cmp)?])
        };
        let band = if method.errors.len() > 1 { (0..frames).map(|f| (f as f64, ends(f))).collect() } else { vec![] };
        let colour = COLOURS[index % COLOURS.len()];
        let stroke = if index < COLOURS.len() { Stroke::solid(colour) } else { Stroke::dashed(colour) };
        Line { band, ..Line::new(&method.name.replace('_', " "), stroke, points) }
    };
    let in_words = |method: &ComparedMethod| format!("{} {:.0} mm", method.name.replace('_', " "), error_of(method));
    LinePlot {
        x_label: "set frame, from 0".to_owned(),
        y_label: "mean marker error, mm".to_owned(),
        lines: methods.iter().enumerate().map(line).collect(),
        y_from: Some(0.0),
        finding: methods.iter().filter(|m| error_of(m).is_finite()).map(in_words).collect::<Vec<_>>().join(", "),
        ..LinePlot::default()
    }
}
