//! The HTML page of a sweep, and the parts that Markdown and the picture share with it.

use serde::Serialize;

use super::analysis::{Choice, CostMeasure, Effect, by_value, cheapest_within, effects, pareto_front};
use super::figures::{ErrorCurve, Map, TwoSizes, curves, maps, scatter, scatter_plot};
use super::input::SweepPageInput;
use super::shown;
use crate::evaluation::{Direction, FEWEST_RUNS};
use crate::report::ReportError;
use crate::report::displayed::{between, number, symbol};
use crate::report::html::render_page;
use crate::report::plots::ScatterPlot;
use crate::sweep::results::Status;
use crate::sweep::summary::{CellSummary, SettingSummary};

const TEMPLATE: &str = include_str!("page.html");
/// Maximum number of failed cells with a row.
const FAILURES: usize = 50;

#[derive(Serialize)]
struct SweepPage<'a> {
    title: &'a str,
    description: &'a str,
    objective: &'a str,
    unit: &'static str,
    lower_is_better: bool,
    settings: usize,
    cells: usize,
    missing: usize,
    seeds: usize,
    choices: Vec<String>,
    remarks: &'a [String],
    draws: bool,
    scatters: Vec<TwoSizes>,
    maps: Vec<Map>,
    map_axes: Option<[&'a str; 2]>,
    averaged: bool,
    curves: Vec<ErrorCurve>,
    effects: Option<Vec<EffectRow>>,
    pairs: Vec<EffectRow>,
    trouble: Vec<TroubleRow>,
    failures: Vec<FailureRow<'a>>,
    more_failures: usize,
    averages: String,
    axes: &'a [String],
    rows: Vec<SettingRow<'a>>,
    /// Whether there are enough seeds for intervals; otherwise rows have ranges over seeds.
    intervals: bool,
    /// The numbers of best and worst settings with a row, unless all settings have one.
    ends: Option<[usize; 2]>,
    /// The number of dots in a plot, unless all settings have one.
    dots: Option<usize>,
    /// Whether an interval extends beyond a plot.
    cut_off: bool,
    facts: &'a [(String, String)],
}

#[derive(Serialize)]
pub(super) struct EffectRow {
    pub(super) axes: String,
    pub(super) range: String,
    pub(super) share: String,
    pub(super) means: String,
}

#[derive(Serialize)]
struct TroubleRow {
    value: String,
    diverged: String,
    failed: String,
}

#[derive(Serialize)]
struct FailureRow<'a> {
    setting: String,
    cell: usize,
    seed: u64,
    state: &'a str,
    error: &'a str,
    report: Option<String>,
}

#[derive(Serialize)]
pub(super) struct SettingRow<'a> {
    pub(super) labels: &'a [String],
    pub(super) mean: String,
    pub(super) interval: String,
    pub(super) evaluations: String,
    pub(super) processor: String,
    pub(super) diverged: usize,
    pub(super) front: bool,
    pub(super) best: bool,
    cells: Vec<CellLink<'a>>,
    more_cells: usize,
}

#[derive(Serialize)]
struct CellLink<'a> {
    index: usize,
    state: &'a str,
    report: Option<String>,
}

/// The page of a sweep: self-contained HTML with inline plots.
///
/// # Errors
/// [`ReportError`] without a setting, or if a plot cannot be drawn.
pub fn sweep_page(input: &SweepPageInput) -> Result<String, ReportError> {
    if input.settings().is_empty() {
        return Err(ReportError::NoRun);
    }
    let (map_axes, maps, averaged) = maps(input);
    let (every_axes, every) = input.unaveraged();
    let (single, pairs) = effects(every, every_axes.len()).unzip();
    let strongest = effects(input.settings(), input.axes.len()).map(|(single, _)| single);
    let rows = |effects: Vec<Effect>| -> Vec<EffectRow> {
        effects.iter().map(|effect| effect_row(input, &every_axes, effect, " · ")).collect()
    };
    let is_bad = |status: Option<Status>| matches!(status, Some(Status::Diverged | Status::Failed));
    let bad: Vec<(&SettingSummary, &CellSummary)> =
        input.summary.all_cells().filter(|(_, cell)| is_bad(cell.status)).collect();
    let shown = shown::rows(input.settings(), input.objective);
    let scatter_plots = CostMeasure::ALL.map(|cost| scatter_plot(input, cost));
    // the cost of programs is not measured
    let drawn = scatter_plots.iter().filter(|plot| !plot.groups.is_empty());
    let page = SweepPage {
        title: &input.summary.name,
        description: &input.description,
        objective: input.objective.title,
        unit: symbol(input.objective.unit),
        lower_is_better: input.objective.direction != Direction::HigherIsBetter,
        settings: input.settings().len(),
        cells: input.summary.all_cells().count(),
        missing: input.summary.all_cells().filter(|(_, cell)| cell.status.is_none()).count(),
        seeds: input.summary.seeds.len(),
        choices: CostMeasure::ALL.iter().filter_map(|cost| choice(input, *cost)).collect(),
        remarks: &input.summary.remarks,
        draws: input.draws,
        scatters: drawn.map(scatter).collect::<Result<_, _>>()?,
        maps,
        map_axes: map_axes.map(|axes| axes.map(|axis| input.axes[axis].as_str())),
        averaged,
        curves: curves(input, strongest.as_deref())?,
        effects: single.map(rows),
        pairs: pairs.map(rows).unwrap_or_default(),
        trouble: trouble(input),
        failures: bad.iter().take(FAILURES).map(|(setting, cell)| failure(input, setting, cell)).collect(),
        more_failures: bad.len().saturating_sub(FAILURES),
        averages: input.averages(),
        axes: &input.axes,
        rows: table(input, &shown.settings),
        intervals: input.summary.has_intervals(),
        ends: shown.ends,
        dots: shown::thinned(input.settings().len()),
        cut_off: scatter_plots.iter().any(ScatterPlot::cuts_off),
        facts: &input.facts,
    };
    render_page(TEMPLATE, &page)
}

fn failure<'a>(input: &SweepPageInput, setting: &SettingSummary, cell: &'a CellSummary) -> FailureRow<'a> {
    FailureRow {
        setting: input.words(setting),
        cell: cell.index,
        seed: cell.seed,
        state: cell.state(),
        error: cell.error.as_deref().unwrap_or_default(),
        report: cell.report_file(),
    }
}

fn describe_cost(cost: CostMeasure, point: &SettingSummary) -> String {
    let value = cost.of_setting(point).map_or("?".to_owned(), three_digits);
    match cost {
        CostMeasure::Evaluations => format!("{value} likelihood evaluations a frame"),
        CostMeasure::Processor => format!("{value} ms of processor time a frame"),
    }
}

/// A setting with its mean, interval (or range over seeds) and cost.
fn describe_setting(input: &SweepPageInput, cost: CostMeasure, point: &SettingSummary) -> String {
    let unit = input.objective.unit;
    let mean = point.mean.map_or("?".to_owned(), |mean| number(mean, unit));
    let ends = match (point.ci95, point.range_over_seeds()) {
        (Some(i), _) => format!(", 95 % interval {}", between(i.low, i.high, unit)),
        (None, Some([low, high])) if point.present().len() < FEWEST_RUNS => {
            format!(", {} over {} seeds", between(low, high, unit), point.present().len())
        }
        _ => String::new(),
    };
    format!("{} ({mean} {}{ends}; {})", input.words(point), symbol(unit), describe_cost(cost, point))
}

/// Why it is unknown whether another setting is certainly within the limit of the best.
fn too_few_seeds(best: &SettingSummary, limit: &str) -> String {
    match best.present().len() {
        1 => format!("One seed cannot tell whether another is certainly within {limit} of it."),
        seeds => format!(
            "{seeds} seeds give a range but no interval (at least {FEWEST_RUNS} are needed), so they cannot tell whether \
             another is certainly within {limit} of it."
        ),
    }
}

/// The best setting, and the cheapest that is about as good.
pub(super) fn choice(input: &SweepPageInput, cost: CostMeasure) -> Option<String> {
    let Choice { best, by_mean, certain } = cheapest_within(input.settings(), cost, input.objective, input.within)?;
    let describe = |at: usize| describe_setting(input, cost, &input.settings()[at]);
    let limit = format!("{} {}", three_digits(input.within), symbol(input.objective.unit));
    let sure = match certain {
        Some(at)
            if at == best
                && input.settings().iter().all(|point| is_no_cheaper(point, &input.settings()[best], cost)) =>
        {
            "No setting is cheaper.".to_owned()
        }
        Some(at) if at == best => {
            format!("No cheaper setting is certainly within {limit} of it, by the 95 % interval of the difference.")
        }
        Some(at) => {
            format!(
                "The cheapest that is certainly within {limit} of it, by the 95 % interval of the difference: {}.",
                describe(at)
            )
        }
        None => too_few_seeds(&input.settings()[best], &limit),
    };
    let mean = if Some(by_mean) == certain || by_mean == best {
        String::new()
    } else {
        format!(" By the mean alone: {}.", describe(by_mean))
    };
    Some(format!(
        "By {}, the best is {}. {sure}{mean}",
        if cost == CostMeasure::Evaluations { "evaluations" } else { "processor time" },
        describe(best)
    ))
}

/// Whether a setting costs at least as much as another, or has no result.
fn is_no_cheaper(point: &SettingSummary, than: &SettingSummary, cost: CostMeasure) -> bool {
    let costs = (cost.of_setting(point).filter(|_| point.mean.is_some()), cost.of_setting(than));
    !matches!(costs, (Some(one), Some(other)) if one < other)
}

/// An effect as text, with its means separated by `between`.
pub(super) fn effect_row(input: &SweepPageInput, axes: &[String], effect: &Effect, between: &str) -> EffectRow {
    let unit = input.objective.unit;
    let means: Vec<String> =
        effect.means.iter().map(|(value, mean)| format!("{value}: {}", number(*mean, unit))).collect();
    EffectRow {
        axes: effect.axes.iter().map(|axis| axes[*axis].as_str()).collect::<Vec<_>>().join(" x "),
        range: format!("{} {}", number(effect.range, unit), symbol(unit)),
        share: format!("{:.1} %", 100.0 * effect.share),
        means: shown::means(&means, between),
    }
}

/// How many cells are graded lost, by the values of the axes; empty if none is.
fn trouble(input: &SweepPageInput) -> Vec<TroubleRow> {
    let count = |setting: &SettingSummary, status: Option<Status>| {
        setting.cells.iter().filter(|cell| cell.status == status).count()
    };
    let bad = [Status::Diverged, Status::Failed].map(Some);
    if input.settings().iter().all(|setting| bad.iter().all(|status| count(setting, *status) == 0)) {
        return Vec::new();
    }
    let (axes, every) = input.unaveraged();
    let share = |setting: &SettingSummary, status| {
        let done = setting.cells.len() - count(setting, None);
        count(setting, status) as f64 / done.max(1) as f64
    };
    let [diverged, failed] = bad.map(|status| every.iter().map(|p| share(p, status)).collect::<Vec<f64>>());
    let percent = |value: f64| format!("{:.0} %", 100.0 * value);
    let mut rows = Vec::new();
    for (axis, name) in axes.iter().enumerate() {
        let groups = by_value(every, &[axis], &diverged);
        let failed = by_value(every, &[axis], &failed);
        if groups.len() > 20 {
            continue;
        }
        rows.extend(groups.iter().zip(&failed).map(|((label, lost, _), (_, failed, _))| TroubleRow {
            value: format!("{name} = {}", label.join(" ")),
            diverged: percent(*lost),
            failed: percent(*failed),
        }));
    }
    rows
}

/// The rows of these settings.
pub(super) fn table<'a>(input: &'a SweepPageInput, shown: &[usize]) -> Vec<SettingRow<'a>> {
    let front = pareto_front(input.settings(), CostMeasure::Evaluations, input.objective);
    let best =
        cheapest_within(input.settings(), CostMeasure::Evaluations, input.objective, 0.0).map(|choice| choice.best);
    let unit = input.objective.unit;
    let links = shown::cells_per_row(shown.len());
    shown
        .iter()
        .map(|&at| {
            let point = &input.settings()[at];
            SettingRow {
                labels: &point.labels,
                mean: point.mean.map_or("-".to_owned(), |mean| number(mean, unit)),
                interval: point
                    .interval_or_range(input.summary.has_intervals())
                    .map_or("-".to_owned(), |[low, high]| between(low, high, unit)),
                evaluations: point.evaluations_per_frame.map_or("-".to_owned(), three_digits),
                processor: point.processor_ms_per_frame.map_or("-".to_owned(), three_digits),
                diverged: point.diverged,
                front: front.contains(&at),
                best: best == Some(at),
                more_cells: point.cells.len().saturating_sub(links),
                cells: point
                    .cells
                    .iter()
                    .take(links)
                    .map(|cell| CellLink { index: cell.index, state: cell.state(), report: cell.report_file() })
                    .collect(),
            }
        })
        .collect()
}

/// The title of the column of intervals.
pub(super) fn interval_title(input: &SweepPageInput) -> &'static str {
    if input.summary.has_intervals() { "95 % interval" } else { "range over seeds" }
}

pub(super) fn three_digits(value: f64) -> String {
    match value.abs() {
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

#[cfg(test)]
pub(super) mod tests;
