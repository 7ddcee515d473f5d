//! The page.

use std::collections::HashSet;

use serde::Serialize;

use super::analysis::{Choice, CostMeasure, Effect, by_value, cheapest_within, effects, pareto_front};
use super::input::{SweepCellState, SweepPageInput, SweepPoint};
use crate::evaluation::{Direction, mean};
use crate::report::ReportError;
use crate::report::html::render_page;
use crate::report::page::{between, number, symbol};
use crate::report::plots::{Colour, Line, LinePlot, ScatterGroup, ScatterPlot, ScatterPoint, Size, Stroke, Svg};

const TEMPLATE: &str = include_str!("page.html");
const PLOT: Size = Size { width: 760, height: 420 };
/// Failed cells that have a row.
const FAILURES: usize = 50;
/// Settings that have a row; `runs.csv` has all.
const ROWS: usize = 2000;
/// Heat maps side by side at most; with more the other axes are averaged.
const MAPS: usize = 9;
/// Values of an axis of a heat map, and of one that a plot goes along.
const WIDEST: usize = 40;
const LONGEST: usize = 200;
/// Lines of a plot at most.
const LINES: usize = 6;
const COLOURS: [Colour; LINES] =
    [Colour::Blue, Colour::Orange, Colour::Green, Colour::Red, Colour::Purple, Colour::Amber];

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
    scatters: Vec<String>,
    maps: Vec<Map>,
    map_axes: Option<[&'a str; 2]>,
    averaged: bool,
    curves: Vec<ErrorCurve>,
    effects: Option<Vec<EffectRow>>,
    pairs: Vec<EffectRow>,
    trouble: Vec<TroubleRow>,
    failures: Vec<FailureRow<'a>>,
    more_failures: usize,
    axes: &'a [String],
    rows: Vec<SettingRow<'a>>,
    more_rows: usize,
    facts: &'a [(String, String)],
}

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
    /// 0 (best) to 100 (worst) of all maps; absent for an empty cell.
    shade: Option<u32>,
}

#[derive(Serialize)]
struct ErrorCurve {
    axis: String,
    plot: String,
}

#[derive(Serialize)]
struct EffectRow {
    axes: String,
    range: String,
    share: String,
    means: String,
}

#[derive(Serialize)]
struct TroubleRow {
    value: String,
    diverged: String,
    failed: String,
}

#[derive(Serialize)]
struct FailureRow<'a> {
    setting: &'a str,
    cell: usize,
    seed: u64,
    state: &'a str,
    error: &'a str,
    report: Option<&'a str>,
}

#[derive(Serialize)]
struct SettingRow<'a> {
    labels: &'a [String],
    mean: String,
    interval: String,
    evaluations: String,
    processor: String,
    diverged: usize,
    front: bool,
    best: bool,
    cells: Vec<CellLink<'a>>,
}

#[derive(Serialize)]
struct CellLink<'a> {
    index: usize,
    state: &'a str,
    report: Option<&'a str>,
}

/// The page of a sweep: HTML with its plots inside, no network needed.
///
/// # Errors
/// [`ReportError`] without a setting, or where a plot cannot be drawn.
pub fn sweep_page(input: &SweepPageInput) -> Result<String, ReportError> {
    if input.settings.is_empty() {
        return Err(ReportError::NoRun);
    }
    let (map_axes, maps, averaged) = maps(input);
    let both = effects(&input.settings, input.axes.len());
    let (single, pairs) = both.unzip();
    let unit = input.objective.unit;
    let rows = |effects: Vec<Effect>| effects.into_iter().map(|effect| effect_row(input, effect)).collect::<Vec<_>>();
    let bad: Vec<(&SweepPoint, &SweepCellState)> = cells(input).filter(|(_, cell)| cell.state != "ok").collect();
    let page = SweepPage {
        title: &input.title,
        description: &input.description,
        objective: input.objective.title,
        unit: symbol(unit),
        lower_is_better: input.objective.direction != Direction::HigherIsBetter,
        settings: input.settings.len(),
        cells: cells(input).count(),
        missing: bad.iter().filter(|(_, cell)| cell.state == "missing").count(),
        seeds: input.seeds.len(),
        choices: [CostMeasure::Evaluations, CostMeasure::Processor]
            .iter()
            .filter_map(|cost| choice(input, *cost))
            .collect(),
        scatters: [CostMeasure::Evaluations, CostMeasure::Processor]
            .iter()
            .map(|cost| scatter(input, *cost))
            .collect::<Result<_, _>>()?,
        maps,
        map_axes: map_axes.map(|axes| axes.map(|axis| input.axes[axis].as_str())),
        averaged,
        curves: curves(input, single.as_deref())?,
        effects: single.map(rows),
        pairs: pairs.map(rows).unwrap_or_default(),
        trouble: trouble(input),
        failures: bad
            .iter()
            .filter(|(_, cell)| cell.state != "missing")
            .take(FAILURES)
            .map(|(point, cell)| FailureRow {
                setting: &point.words,
                cell: cell.index,
                seed: cell.seed,
                state: cell.state,
                error: cell.error.as_deref().unwrap_or_default(),
                report: cell.report.as_deref(),
            })
            .collect(),
        more_failures: bad.iter().filter(|(_, cell)| cell.state != "missing").count().saturating_sub(FAILURES),
        axes: &input.axes,
        rows: table(input),
        more_rows: input.settings.len().saturating_sub(ROWS),
        facts: &input.facts,
    };
    render_page(TEMPLATE, &page)
}

fn cells(input: &SweepPageInput) -> impl Iterator<Item = (&SweepPoint, &SweepCellState)> {
    input.settings.iter().flat_map(|point| point.cells.iter().map(move |cell| (point, cell)))
}

fn cost_in_words(cost: CostMeasure, point: &SweepPoint) -> String {
    let value = cost.of_setting(point).map_or("?".to_owned(), three_digits);
    match cost {
        CostMeasure::Evaluations => format!("{value} likelihood evaluations a frame"),
        CostMeasure::Processor => format!("{value} ms of processor time a frame"),
    }
}

/// The best setting, and the cheapest that is about as good.
pub(super) fn choice(input: &SweepPageInput, cost: CostMeasure) -> Option<String> {
    let Choice { best, by_mean, surely } = cheapest_within(&input.settings, cost, input.objective, input.within)?;
    let unit = input.objective.unit;
    let told = |at: usize| {
        let point = &input.settings[at];
        let mean = point.mean.map_or("?".to_owned(), |mean| number(mean, unit));
        let ends =
            point.interval.map(|i| format!(", 95 % interval {}", between(i.low, i.high, unit))).unwrap_or_default();
        format!("{} ({mean} {}{ends}; {})", point.words, symbol(unit), cost_in_words(cost, point))
    };
    let limit = format!("{} {}", three_digits(input.within), symbol(unit));
    let sure = match surely {
        Some(at) if at == best => {
            format!(
                "None that is cheaper is surely within {limit} of it (the 95 % interval of the difference reaches beyond)."
            )
        }
        Some(at) => {
            format!("Cheapest that is surely within {limit} of it (95 % interval of the difference): {}.", told(at))
        }
        None => format!("Whether another is surely within {limit} of it cannot be told from one seed."),
    };
    let mean = if Some(by_mean) == surely || by_mean == best {
        String::new()
    } else {
        format!(" By its mean alone {} would do.", told(by_mean))
    };
    Some(format!(
        "By {}: best {}. {sure}{mean}",
        if cost == CostMeasure::Evaluations { "evaluations" } else { "processor time" },
        told(best)
    ))
}

fn scatter(input: &SweepPageInput, cost: CostMeasure) -> Result<String, ReportError> {
    let axis = grouping_axis(input);
    let mut groups: Vec<ScatterGroup> = Vec::new();
    for point in &input.settings {
        let (Some(x), Some(y)) = (cost.of_setting(point), point.mean) else { continue };
        let name =
            axis.map_or_else(|| "settings".to_owned(), |axis| format!("{} {}", input.axes[axis], point.labels[axis]));
        let dot = ScatterPoint { x, y, interval: point.interval.map(|i| [i.low, i.high]) };
        match groups.iter_mut().find(|group| group.name == name) {
            Some(group) => group.points.push(dot),
            None => groups.push(ScatterGroup { name, colour: COLOURS[groups.len() % LINES], points: vec![dot] }),
        }
    }
    let front = pareto_front(&input.settings, cost, input.objective);
    let place = |at: usize| Some([cost.of_setting(&input.settings[at])?, input.settings[at].mean?]);
    let plot = ScatterPlot {
        x_label: match cost {
            CostMeasure::Evaluations => "likelihood evaluations a frame".to_owned(),
            CostMeasure::Processor => "processor time a frame, ms".to_owned(),
        },
        y_label: labelled(input),
        groups,
        front: front.into_iter().filter_map(place).collect(),
    };
    plot.svg(PLOT).map(|Svg(svg)| svg)
}

/// The axis that colours tell apart: with few values, none of them numbers if there is such a one.
fn grouping_axis(input: &SweepPageInput) -> Option<usize> {
    let count = |axis: &usize| labels(input, *axis).len();
    let few: Vec<usize> = (0..input.axes.len()).filter(|axis| (2..=LINES).contains(&count(axis))).collect();
    let named = few
        .iter()
        .copied()
        .find(|axis| input.settings.iter().any(|p| p.numbers.get(*axis).copied().flatten().is_none()));
    named.or_else(|| few.into_iter().min_by_key(count))
}

/// The values of an axis in the order of the plan.
fn labels(input: &SweepPageInput, axis: usize) -> Vec<String> {
    let mut seen: HashSet<&str> = HashSet::new();
    let all = input.settings.iter().filter_map(|point| point.labels.get(axis)).filter(|label| !label.is_empty());
    all.filter(|label| seen.insert(label)).cloned().collect()
}

/// Particles over layers where they are axes, else the two numeric axes with the most values.
fn map_axes(input: &SweepPageInput) -> Option<[usize; 2]> {
    let named = |name: &str| input.axes.iter().position(|axis| axis == name || axis.ends_with(&format!(".{name}")));
    let varied = |axis: &usize| labels(input, *axis).len() > 1;
    if let Some(pair) = named("particles").zip(named("layers")).filter(|(a, b)| varied(a) && varied(b)) {
        return Some([pair.0, pair.1]);
    }
    let is_number = |axis: &usize| input.settings.iter().all(|p| p.numbers.get(*axis).copied().flatten().is_some());
    let mut numeric: Vec<usize> = (0..input.axes.len()).filter(|axis| varied(axis) && is_number(axis)).collect();
    numeric.sort_by_key(|axis| std::cmp::Reverse(labels(input, *axis).len()));
    match numeric.as_slice() {
        [a, b, ..] => Some([*a, *b]),
        _ => None,
    }
}

pub(super) fn maps(input: &SweepPageInput) -> (Option<[usize; 2]>, Vec<Map>, bool) {
    let Some(axes) = map_axes(input) else { return (None, Vec::new(), false) };
    let [vertical, horizontal] = axes;
    if axes.iter().any(|axis| labels(input, *axis).len() > WIDEST) {
        return (None, Vec::new(), false);
    }
    let others: Vec<usize> = (0..input.axes.len()).filter(|axis| !axes.contains(axis)).collect();
    let of = |point: &SweepPoint| -> String {
        let words = others.iter().map(|axis| format!("{}={}", input.axes[*axis], point.labels[*axis]));
        words.collect::<Vec<_>>().join(" ")
    };
    let mut kinds: Vec<String> = Vec::new();
    for kind in input.settings.iter().map(of) {
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
        let fits = |p: &&SweepPoint| {
            p.labels[vertical] == *line && p.labels[horizontal] == *column && (averaged || of(p) == *kind)
        };
        input.settings.iter().filter(fits).filter_map(|p| p.mean).collect()
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
        // errors differ by factors, so that shades count in logarithms where they can
        let place = match least > 0.0 && most > least {
            true => libm::log(middle / least) / libm::log(most / least),
            false if most > least => (middle - least) / (most - least),
            false => 0.0,
        };
        let place = if input.objective.direction == Direction::HigherIsBetter { 1.0 - place } else { place };
        let note = match values.len() {
            1 => String::new(),
            count => format!("mean of {count} settings"),
        };
        MapCell {
            text: number(middle, input.objective.unit),
            note,
            shade: Some((100.0 * place).round().clamp(0.0, 100.0) as u32),
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

/// The values of an axis, numbers by size.
fn sorted(input: &SweepPageInput, axis: usize) -> Vec<String> {
    let mut found = labels(input, axis);
    found.sort_by(|a, b| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => a.total_cmp(&b),
        _ => std::cmp::Ordering::Equal,
    });
    found
}

/// The objective over every axis that counts something, one line for every value of the strongest other axis.
fn curves(input: &SweepPageInput, effects: Option<&[Effect]>) -> Result<Vec<ErrorCurve>, ReportError> {
    let mut curves = Vec::new();
    for axis in 0..input.axes.len() {
        let values = sorted(input, axis);
        if !(3..=LONGEST).contains(&values.len()) || values.iter().any(|value| value.parse::<f64>().is_err()) {
            continue;
        }
        let few = |other: &usize| *other != axis && (2..=LINES).contains(&labels(input, *other).len());
        let strongest = effects.and_then(|effects| effects.iter().map(|effect| effect.axes[0]).find(few));
        let other = strongest.or_else(|| (0..input.axes.len()).find(few));
        let kinds = other.map_or_else(|| vec![String::new()], |other| sorted(input, other));
        let line = |(number, kind): (usize, &String)| {
            let points = values.iter().map(|value| {
                let fits =
                    |p: &&SweepPoint| p.labels[axis] == *value && other.is_none_or(|other| p.labels[other] == *kind);
                let found: Vec<f64> = input.settings.iter().filter(fits).filter_map(|p| p.mean).collect();
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
        let Svg(plot) = plot.svg(Size { width: 560, height: 320 })?;
        curves.push(ErrorCurve { axis: input.axes[axis].clone(), plot });
    }
    Ok(curves)
}

fn effect_row(input: &SweepPageInput, effect: Effect) -> EffectRow {
    let unit = input.objective.unit;
    let means = effect.means.iter().map(|(value, mean)| format!("{value}: {}", number(*mean, unit)));
    EffectRow {
        axes: effect.axes.iter().map(|axis| input.axes[*axis].as_str()).collect::<Vec<_>>().join(" x "),
        range: format!("{} {}", number(effect.range, unit), symbol(unit)),
        share: format!("{:.1} %", 100.0 * effect.share),
        means: means.collect::<Vec<_>>().join(" · "),
    }
}

/// How often the tracker lost the body, by the values of the axes, where that happened at all.
fn trouble(input: &SweepPageInput) -> Vec<TroubleRow> {
    let all = |state: &str| cells(input).filter(|(_, cell)| cell.state == state).count();
    if all("diverged") + all("failed") == 0 {
        return Vec::new();
    }
    let share = |point: &SweepPoint, state: &str| {
        let done = point.cells.iter().filter(|cell| cell.state != "missing").count();
        point.cells.iter().filter(|cell| cell.state == state).count() as f64 / done.max(1) as f64
    };
    let [diverged, failed] =
        ["diverged", "failed"].map(|state| input.settings.iter().map(|p| share(p, state)).collect::<Vec<f64>>());
    let percent = |value: f64| format!("{:.0} %", 100.0 * value);
    let mut rows = Vec::new();
    for (axis, name) in input.axes.iter().enumerate() {
        let groups = by_value(&input.settings, &[axis], &diverged);
        let failed = by_value(&input.settings, &[axis], &failed);
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

fn table(input: &SweepPageInput) -> Vec<SettingRow<'_>> {
    let front = pareto_front(&input.settings, CostMeasure::Evaluations, input.objective);
    let best =
        cheapest_within(&input.settings, CostMeasure::Evaluations, input.objective, 0.0).map(|choice| choice.best);
    let unit = input.objective.unit;
    let row = |(at, point): (usize, &SweepPoint)| (at, point.mean.map_or("-".to_owned(), |mean| number(mean, unit)));
    let texts: Vec<(usize, String)> = input.settings.iter().enumerate().take(ROWS).map(row).collect();
    texts
        .into_iter()
        .map(|(at, mean)| {
            let point = &input.settings[at];
            SettingRow {
                labels: &point.labels,
                mean,
                interval: point.interval.map_or("-".to_owned(), |i| between(i.low, i.high, unit)),
                evaluations: point.evaluations.map_or("-".to_owned(), three_digits),
                processor: point.processor_ms.map_or("-".to_owned(), three_digits),
                diverged: point.diverged(),
                front: front.contains(&at),
                best: best == Some(at),
                cells: point
                    .cells
                    .iter()
                    .map(|cell| CellLink { index: cell.index, state: cell.state, report: cell.report.as_deref() })
                    .collect(),
            }
        })
        .collect()
}

pub(super) fn labelled(input: &SweepPageInput) -> String {
    match symbol(input.objective.unit) {
        "" => input.objective.title.to_owned(),
        unit => format!("{}, {unit}", input.objective.title),
    }
}

pub(super) fn three_digits(value: f64) -> String {
    match value.abs() {
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::find_metric;

    fn input() -> SweepPageInput {
        let mut settings = Vec::new();
        for (p, particles) in [50.0, 100.0, 200.0].into_iter().enumerate() {
            for (l, layers) in [1.0, 5.0].into_iter().enumerate() {
                let value = 90.0 - 20.0 * p as f64 - 15.0 * l as f64;
                let index = settings.len() * 3;
                let cell = |seed: usize| SweepCellState {
                    index: index + seed,
                    seed: seed as u64,
                    state: if value > 80.0 && seed == 0 { "diverged" } else { "ok" },
                    error: None,
                    report: (seed == 1).then(|| format!("reports/{index}/report.html")),
                };
                settings.push(SweepPoint {
                    words: format!("particles={particles} layers={layers}"),
                    labels: vec![layers.to_string(), particles.to_string()],
                    numbers: vec![Some(layers), Some(particles)],
                    values: vec![value - 1.0, value, value + 1.0],
                    mean: Some(value),
                    interval: None,
                    evaluations: Some(particles * layers),
                    processor_ms: Some(0.1 * particles * layers),
                    frozen: Some(200.0),
                    cells: (0..3).map(cell).collect(),
                });
            }
        }
        SweepPageInput {
            title: "planted".to_owned(),
            description: "Errors that are known.".to_owned(),
            objective: find_metric("humaneva_mm").unwrap(),
            seeds: vec![0, 1, 2],
            axes: vec!["layers".to_owned(), "particles".to_owned()],
            settings,
            within: 5.0,
            facts: vec![("version".to_owned(), "0".to_owned())],
        }
    }

    #[test]
    fn the_page_has_choice_map_curve_effects_failures_and_links() {
        let page = sweep_page(&input()).unwrap();
        for words in [
            "best particles=200 layers=5 (35",
            "likelihood evaluations a frame",
            "Pareto front",
            "<td class=\"map\"",
            "layers x particles",
            "reports/0/report.html",
            "particles = 50",
            "diverged",
        ] {
            assert!(page.contains(words), "no {words:?}");
        }
        assert!(!page.contains("http://") || page.contains("www.w3.org"), "no network");
    }

    #[test]
    fn a_sweep_of_one_setting_and_one_without_a_result_have_pages_too() {
        let mut one = input();
        one.settings.truncate(1);
        one.settings[0].values.truncate(1);
        assert!(sweep_page(&one).unwrap().contains("cannot be told from one seed"));
        one.settings[0] = SweepPoint { labels: vec!["1".to_owned(), "50".to_owned()], ..SweepPoint::default() };
        sweep_page(&one).unwrap();
        one.settings.clear();
        assert!(sweep_page(&one).is_err());
    }
}
