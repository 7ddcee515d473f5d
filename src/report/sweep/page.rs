//! The page.

use serde::Serialize;

use super::analysis::{Choice, CostMeasure, Effect, by_value, cheapest_within, effects, pareto_front};
use super::figures::{ErrorCurve, Map, TwoSizes, curves, maps, scatter, scatter_plot};
use super::input::{SweepCellState, SweepPageInput, SweepPoint};
use super::shown;
use crate::evaluation::Direction;
use crate::report::ReportError;
use crate::report::displayed::{between, number, symbol};
use crate::report::html::render_page;

const TEMPLATE: &str = include_str!("page.html");
/// Failed cells that have a row.
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
    /// How many of the best and of the worst have a row, where not all have.
    ends: Option<[usize; 2]>,
    /// Dots of a plot, where not all settings have one.
    dots: Option<usize>,
    /// Whether an interval leaves a plot.
    cut_off: bool,
    facts: &'a [(String, String)],
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
    more_cells: usize,
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
    let (every_axes, every) = input.unaveraged();
    let (single, pairs) = effects(every, every_axes.len()).unzip();
    let strongest = effects(&input.settings, input.axes.len()).map(|(single, _)| single);
    let unit = input.objective.unit;
    let rows = |effects: Vec<Effect>| {
        effects.into_iter().map(|effect| effect_row(input, every_axes, effect)).collect::<Vec<_>>()
    };
    let bad: Vec<(&SweepPoint, &SweepCellState)> = cells(input).filter(|(_, cell)| cell.state != "ok").collect();
    let shown = shown::rows(&input.settings, input.objective);
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
        curves: curves(input, strongest.as_deref())?,
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
        averages: input.averages(),
        axes: &input.axes,
        rows: table(input, &shown.settings),
        ends: shown.ends,
        dots: shown::thinned(input.settings.len()),
        cut_off: [CostMeasure::Evaluations, CostMeasure::Processor]
            .iter()
            .any(|cost| scatter_plot(input, *cost).cuts_off()),
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
        Some(at)
            if at == best && input.settings.iter().all(|point| is_no_cheaper(point, &input.settings[best], cost)) =>
        {
            "None is cheaper.".to_owned()
        }
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

/// Whether a setting costs as much as another or more, or has no result.
fn is_no_cheaper(point: &SweepPoint, than: &SweepPoint, cost: CostMeasure) -> bool {
    let costs = (cost.of_setting(point).filter(|_| point.mean.is_some()), cost.of_setting(than));
    !matches!(costs, (Some(one), Some(other)) if one < other)
}

fn effect_row(input: &SweepPageInput, axes: &[String], effect: Effect) -> EffectRow {
    let unit = input.objective.unit;
    let means: Vec<String> =
        effect.means.iter().map(|(value, mean)| format!("{value}: {}", number(*mean, unit))).collect();
    EffectRow {
        axes: effect.axes.iter().map(|axis| axes[*axis].as_str()).collect::<Vec<_>>().join(" x "),
        range: format!("{} {}", number(effect.range, unit), symbol(unit)),
        share: format!("{:.1} %", 100.0 * effect.share),
        means: shown::means(&means, " · "),
    }
}

/// How often the tracker lost the body, by the values of the axes, where that happened at all.
fn trouble(input: &SweepPageInput) -> Vec<TroubleRow> {
    let all = |state: &str| cells(input).filter(|(_, cell)| cell.state == state).count();
    if all("diverged") + all("failed") == 0 {
        return Vec::new();
    }
    let (axes, every) = input.unaveraged();
    let share = |point: &SweepPoint, state: &str| {
        let done = point.cells.iter().filter(|cell| cell.state != "missing").count();
        point.cells.iter().filter(|cell| cell.state == state).count() as f64 / done.max(1) as f64
    };
    let [diverged, failed] =
        ["diverged", "failed"].map(|state| every.iter().map(|p| share(p, state)).collect::<Vec<f64>>());
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

fn table<'a>(input: &'a SweepPageInput, shown: &[usize]) -> Vec<SettingRow<'a>> {
    let front = pareto_front(&input.settings, CostMeasure::Evaluations, input.objective);
    let best =
        cheapest_within(&input.settings, CostMeasure::Evaluations, input.objective, 0.0).map(|choice| choice.best);
    let unit = input.objective.unit;
    let links = shown::cells_per_row(shown.len());
    shown
        .iter()
        .map(|&at| {
            let point = &input.settings[at];
            SettingRow {
                labels: &point.labels,
                mean: point.mean.map_or("-".to_owned(), |mean| number(mean, unit)),
                interval: point.interval.map_or("-".to_owned(), |i| between(i.low, i.high, unit)),
                evaluations: point.evaluations.map_or("-".to_owned(), three_digits),
                processor: point.processor_ms.map_or("-".to_owned(), three_digits),
                diverged: point.diverged(),
                front: front.contains(&at),
                best: best == Some(at),
                more_cells: point.cells.len().saturating_sub(links),
                cells: point
                    .cells
                    .iter()
                    .take(links)
                    .map(|cell| CellLink { index: cell.index, state: cell.state, report: cell.report.as_deref() })
                    .collect(),
            }
        })
        .collect()
}

pub(super) fn three_digits(value: f64) -> String {
    match value.abs() {
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::input::EverySetting;
    use super::*;
    use crate::evaluation::find_metric;

    /// Three particle counts by two numbers of layers; more of either is better.
    pub(in super::super) fn grid() -> SweepPageInput {
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
            every: None,
            within: 5.0,
            facts: vec![("version".to_owned(), "0".to_owned())],
        }
    }

    #[test]
    fn the_page_has_choice_map_curve_effects_failures_and_links() {
        let page = sweep_page(&grid()).unwrap();
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
    fn the_page_of_very_many_settings_says_what_it_shows_and_stays_small() {
        let mut many = grid();
        many.axes = vec!["particles".to_owned()];
        let one = many.settings[0].clone();
        let setting = |at: usize| SweepPoint {
            words: format!("particles={at}"),
            labels: vec![at.to_string()],
            numbers: vec![Some(at as f64)],
            mean: Some(30.0 + at as f64),
            evaluations: Some(1.0 + at as f64),
            cells: one.cells.iter().cycle().take(30).cloned().collect(),
            ..one.clone()
        };
        many.settings = (0..20_000).map(setting).collect();
        let page = sweep_page(&many).unwrap();
        assert!(page.len() < 4_000_000, "{} bytes", page.len());
        for words in
            ["the 1000 best, then the 1000 worst, of 20000", "2000 of 20000 settings", "and 20 more", "runs.csv"]
        {
            assert!(page.contains(words), "no {words:?}");
        }
        let small = sweep_page(&grid()).unwrap();
        assert!(!small.contains("runs.csv") && !small.contains("evenly from the best"), "all is shown");
    }

    #[test]
    fn what_is_averaged_over_is_no_choice_but_matters() {
        let mut averaged = grid();
        let of_clip = |clip: &str, more: f64| -> Vec<SweepPoint> {
            let one = |p: &SweepPoint| SweepPoint {
                labels: [vec![clip.to_owned()], p.labels.clone()].concat(),
                mean: p.mean.map(|mean| mean + more),
                ..p.clone()
            };
            averaged.settings.iter().map(one).collect()
        };
        let settings = [of_clip("walk", -40.0), of_clip("run", 40.0)].concat();
        let axes = ["clip", "layers", "particles"].map(str::to_owned).to_vec();
        averaged.every = Some(EverySetting { over: vec!["clip".to_owned()], axes, settings });
        let page = sweep_page(&averaged).unwrap();
        for words in ["mean over all values of clip", "best particles=200 layers=5 (35", "80.0 mm", "clip = run"] {
            assert!(page.contains(words), "no {words:?}");
        }
    }

    #[test]
    fn a_sweep_of_one_setting_and_one_without_a_result_have_pages_too() {
        let mut one = grid();
        one.settings.truncate(1);
        one.settings[0].values.truncate(1);
        assert!(sweep_page(&one).unwrap().contains("cannot be told from one seed"));
        one.settings[0] = SweepPoint { labels: vec!["1".to_owned(), "50".to_owned()], ..SweepPoint::default() };
        sweep_page(&one).unwrap();
        one.settings.clear();
        assert!(sweep_page(&one).is_err());
    }
}
