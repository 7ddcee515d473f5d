//! The page of a sweep, as HTML and as Markdown: failures, which setting to choose, means along the axes, all settings.

mod facts;

use serde::Serialize;

use super::by_axis::{AxisMeans, ByAxis, MeanOfTracker, Separation, Verdict};
use super::choice::{cheapest_within, pareto_front};
use super::plan::PlannedSweep;
use super::results::Status;
use super::summary::{SettingSummary, SweepSummary};
use crate::common::ExperimentError;
use skiagraph_eval::{Direction, Interval, Metric, Unit, find_metric};
use skiagraph_report::displayed::{between, number, symbol};
use skiagraph_report::html::{render_page, render_text};
use skiagraph_report::plots::{Colour, Line, LinePlot, ScatterGroup, ScatterPlot, ScatterPoint, Size, Stroke, Svg};
use skiagraph_report::{FigureFile, ReportError};

const HTML: &str = include_str!("page.html");
const MARKDOWN: &str = include_str!("page.md");
/// Most settings with a row, and most dots in the scatter plot; `runs.csv` has all.
const MOST_ROWS: usize = 1000;
const MOST_FAILURES: usize = 50;
const MOST_CELLS: usize = 20;
/// Default of how much worse than the best a setting may be, in the objective's unit: millimetres, degrees.
const WITHIN: f64 = 5.0;
/// The same for shares and energies.
const WITHIN_SHARE: f64 = 0.02;
/// Sizes of plots on wide screens and on phones.
const SIZES: [Size; 2] = [Size { width: 580, height: 350 }, Size { width: 350, height: 300 }];
const COLOURS: [Colour; 6] = [Colour::Blue, Colour::Orange, Colour::Green, Colour::Red, Colour::Purple, Colour::Amber];

/// A sweep's results and their provenance.
#[derive(Clone, Debug)]
pub struct SweepReport {
    every: SweepSummary,
    /// The settings; those that differ only in averaged axes are merged.
    summary: SweepSummary,
    over: Vec<String>,
    by_axis: ByAxis,
    description: String,
    objective: &'static Metric,
    /// How much worse than the best a setting may be, in the objective's unit.
    within: f64,
    /// Provenance: names and values.
    facts: Vec<(String, String)>,
}

#[derive(Serialize)]
struct Page<'a> {
    title: &'a str,
    description: &'a str,
    objective: String,
    lower_is_better: bool,
    settings: usize,
    cells: usize,
    missing: usize,
    seeds: usize,
    unit: &'static str,
    remarks: &'a [String],
    lost: usize,
    failed: usize,
    failures: Vec<FailureRow<'a>>,
    choices: Vec<ChoiceRow>,
    left_out: usize,
    scatter: Option<TwoSizes>,
    trackers: &'a [String],
    means: Vec<MeanCell>,
    axes_shown: Vec<AxisPart<'a>>,
    averages: String,
    axes: &'a [String],
    rows: Vec<SettingRow<'a>>,
    intervals: bool,
    facts: &'a [(String, String)],
}

#[derive(Serialize)]
struct FailureRow<'a> {
    setting: &'a str,
    cell: usize,
    seed: u64,
    state: &'a str,
    error: &'a str,
    report: Option<String>,
}

#[derive(Serialize)]
struct ChoiceRow {
    role: String,
    setting: String,
    mean: String,
    interval: String,
    evaluations: String,
}

#[derive(Serialize)]
struct AxisPart<'a> {
    axis: &'a str,
    rows: Vec<(&'a str, Vec<MeanCell>)>,
    doubles: Option<Vec<String>>,
    separation: Vec<String>,
    plot: Option<TwoSizes>,
}

#[derive(Serialize)]
struct MeanCell {
    mean: String,
    note: String,
}

#[derive(Serialize)]
struct SettingRow<'a> {
    labels: &'a [String],
    mean: String,
    interval: String,
    coverage: String,
    evaluations: String,
    processor: String,
    lost: usize,
    best: bool,
    front: bool,
    cells: Vec<CellLink<'a>>,
    more_cells: usize,
}

#[derive(Serialize)]
struct CellLink<'a> {
    index: usize,
    state: &'a str,
    report: Option<String>,
}

/// A plot as SVG for wide screens and for phones.
#[derive(Serialize)]
struct TwoSizes {
    wide: String,
    narrow: String,
}

impl TwoSizes {
    fn new(draw: impl Fn(Size) -> Result<Svg, ReportError>) -> Result<Self, ReportError> {
        let [Svg(wide), Svg(narrow)] = [draw(SIZES[0])?, draw(SIZES[1])?];
        Ok(Self { wide, narrow })
    }
}

impl SweepReport {
    /// Reads the existing results; `within` is how much worse than the best a setting may be.
    pub fn new(sweep: &PlannedSweep, within: Option<f64>) -> Result<Self, ExperimentError> {
        let every = SweepSummary::new(sweep)?;
        let objective = find_metric(&every.objective).ok_or_else(|| ExperimentError::Argument {
            argument: "objective",
            detail: format!("`{}` is not a metric", every.objective),
        })?;
        if every.missing == every.cells {
            return Err(ExperimentError::SweepIncomplete { path: sweep.root.clone() });
        }
        let over = sweep.definition()?.sweep.average_over;
        let usual = if matches!(objective.unit, Unit::Fraction | Unit::Energy) { WITHIN_SHARE } else { WITHIN };
        Ok(Self {
            by_axis: ByAxis::new(sweep, &every)?,
            summary: every.averaged_over(&over),
            description: sweep.plan.description.clone(),
            within: within.unwrap_or(usual),
            facts: facts::facts(sweep, &every),
            every,
            over,
            objective,
        })
    }

    /// The page: self-contained HTML with inline plots.
    pub fn html(&self) -> Result<String, ReportError> {
        render_page(HTML, &self.page()?)
    }

    /// The page as Markdown, for a repository.
    pub fn markdown(&self) -> Result<String, ReportError> {
        render_text(MARKDOWN, &self.page()?)
    }

    /// The plots: error against cost, and along every axis of numbers.
    pub fn figures(&self) -> Result<Vec<FigureFile>, ReportError> {
        let mut files = Vec::new();
        if let Some(plot) = self.scatter() {
            let caption = "Error against cost: one dot per setting without frames left out, with its 95 % interval over \
                           seeds. No cheaper setting is better than one on the dashed Pareto front.";
            files.push(FigureFile::new("cost-evaluations", caption.to_owned(), &plot.svg(SIZES[0])?));
        }
        for axis in &self.by_axis.axes {
            if let Some(plot) = self.line_plot(axis) {
                let name = format!("axis-{}", axis.axis.replace(|letter: char| !letter.is_ascii_alphanumeric(), "-"));
                let caption = format!("Mean over {}, with 95 % intervals over {}.", axis.axis, self.by_axis.unit);
                files.push(FigureFile::new(&name, caption, &plot.svg(SIZES[0])?));
            }
        }
        Ok(files)
    }

    fn page(&self) -> Result<Page<'_>, ReportError> {
        let summary = &self.summary;
        if summary.settings.is_empty() {
            return Err(ReportError::NoRun);
        }
        let count = |status| self.every.all_cells().filter(|(_, cell)| cell.status == status).count();
        let averages = if self.over.is_empty() { String::new() } else { self.over.join(", ") };
        Ok(Page {
            title: &summary.name,
            description: &self.description,
            objective: self.objective_with_unit(),
            lower_is_better: self.objective.direction != Direction::HigherIsBetter,
            settings: summary.settings.len(),
            cells: summary.cells,
            missing: summary.missing,
            seeds: summary.seeds.len(),
            unit: self.by_axis.unit,
            remarks: &summary.remarks,
            lost: count(Some(Status::Diverged)),
            failed: count(Some(Status::Failed)),
            failures: self.failures(),
            choices: self.choices(),
            left_out: summary.settings.iter().filter(|setting| !setting.is_judged()).count(),
            scatter: self.scatter().map(|plot| TwoSizes::new(|size| plot.svg(size))).transpose()?,
            trackers: &self.by_axis.trackers,
            means: self.by_axis.all.iter().map(|mean| self.mean_cell(mean)).collect(),
            axes_shown: self.by_axis.axes.iter().map(|axis| self.axis_part(axis)).collect::<Result<_, _>>()?,
            averages,
            axes: &summary.axes,
            rows: self.rows(),
            intervals: summary.has_intervals(),
            facts: &self.facts,
        })
    }

    fn objective_with_unit(&self) -> String {
        match symbol(self.objective.unit) {
            "" => self.objective.title.to_owned(),
            unit => format!("{}, {unit}", self.objective.title),
        }
    }

    fn failures(&self) -> Vec<FailureRow<'_>> {
        let bad = self.every.all_cells().filter(|(_, cell)| {
            matches!(cell.status, Some(Status::Diverged | Status::Failed))
                || cell.coverage.is_some_and(|coverage| coverage < 1.0)
        });
        let mut bad: Vec<_> = bad.collect();
        bad.sort_by_key(|(_, cell)| (cell.status != Some(Status::Failed), cell.index));
        bad.into_iter()
            .take(MOST_FAILURES)
            .map(|(setting, cell)| FailureRow {
                setting: &setting.words,
                cell: cell.index,
                seed: cell.seed,
                state: if cell.state() == "ok" { "incomplete" } else { cell.state() },
                error: cell.error.as_deref().unwrap_or_default(),
                report: cell.report_file(),
            })
            .collect()
    }

    /// The best setting, and the cheapest that are about as good.
    fn choices(&self) -> Vec<ChoiceRow> {
        let settings = &self.summary.settings;
        let Some(best) = self.summary.ranked().first().copied() else { return Vec::new() };
        let mut rows = vec![self.choice("best".to_owned(), best)];
        if let Some(choice) = cheapest_within(settings, self.objective, self.within) {
            let limit = format!("{} {}", three_digits(self.within), symbol(self.objective.unit));
            if let Some(certain) = choice.certain {
                let role = format!("cheapest within {limit}, by the 95 % interval of the difference");
                rows.push(self.choice(role, &settings[certain]));
            }
            rows.push(self.choice(format!("cheapest within {limit}, by the mean"), &settings[choice.by_mean]));
        }
        rows
    }

    fn choice(&self, role: String, setting: &SettingSummary) -> ChoiceRow {
        ChoiceRow {
            role,
            setting: setting.words.clone(),
            mean: self.value(setting.mean),
            interval: self.interval(setting.ci95),
            evaluations: setting.evaluations_per_frame.map_or("-".to_owned(), three_digits),
        }
    }

    fn scatter(&self) -> Option<ScatterPlot> {
        let mut groups: Vec<ScatterGroup> = Vec::new();
        for setting in self.summary.ranked().into_iter().take(MOST_ROWS) {
            let (Some(x), Some(y)) = (setting.evaluations_per_frame, setting.mean) else { continue };
            let tracker = self.by_axis.trackers.iter().find(|tracker| setting.is_of(tracker));
            let name = tracker.cloned().unwrap_or_default();
            let dot = ScatterPoint { x, y, interval: setting.ci95.map(|ends| [ends.low, ends.high]) };
            match groups.iter_mut().find(|group| group.name == name) {
                Some(group) => group.points.push(dot),
                None => {
                    let colour = COLOURS[groups.len() % COLOURS.len()];
                    groups.push(ScatterGroup { name, colour, points: vec![dot] });
                }
            }
        }
        let settings = &self.summary.settings;
        let place = |at: usize| Some([settings[at].evaluations_per_frame?, settings[at].mean?]);
        let front = pareto_front(settings, self.objective).into_iter().filter_map(place).collect();
        let x_label = "likelihood evaluations a frame".to_owned();
        let plot = ScatterPlot { x_label, y_label: self.objective_with_unit(), groups, front };
        (!plot.groups.is_empty()).then_some(plot)
    }

    fn axis_part<'a>(&'a self, axis: &'a AxisMeans) -> Result<AxisPart<'a>, ReportError> {
        let cells = |means: &[MeanOfTracker]| means.iter().map(|mean| self.mean_cell(mean)).collect();
        let doubles = axis.doubles_at.iter().any(Option::is_some).then(|| {
            axis.doubles_at.iter().map(|level| level.map_or("-".to_owned(), |level| format!("{level:.3}"))).collect()
        });
        Ok(AxisPart {
            axis: &axis.axis,
            rows: axis.values.iter().map(|one| (one.value.as_str(), cells(&one.means))).collect(),
            doubles,
            separation: axis.separation.iter().map(|found| found.as_ref().map_or("-".to_owned(), words)).collect(),
            plot: self.line_plot(axis).map(|plot| TwoSizes::new(|size| plot.svg(size))).transpose()?,
        })
    }

    /// The objective along an axis of numbers: a line per tracker with its interval, and the tracker that never moves.
    fn line_plot(&self, axis: &AxisMeans) -> Option<LinePlot> {
        let places: Vec<f64> = axis.values.iter().map(|one| one.value.parse().ok()).collect::<Option<_>>()?;
        let mut lines = Vec::new();
        for (number, tracker) in self.by_axis.trackers.iter().take(COLOURS.len()).enumerate() {
            let of_tracker = axis.values.iter().filter_map(|one| one.means.get(number));
            let mut line = Line::new(tracker, Stroke::solid(COLOURS[number]), Vec::new());
            for (place, mean) in places.iter().zip(of_tracker) {
                line.points.push((*place, mean.mean));
                line.band.push((*place, mean.ci95.map(|ends| [ends.low, ends.high])));
            }
            lines.push(line);
        }
        let frozen: Vec<(f64, Option<f64>)> = places
            .iter()
            .zip(&axis.values)
            .map(|(place, one)| (*place, one.means.first().and_then(|mean| mean.frozen)))
            .collect();
        if frozen.iter().any(|(_, value)| value.is_some()) {
            lines.push(Line::new("never moves", Stroke::dashed(Colour::Faint), frozen));
        }
        let (x_label, y_label) = (axis.axis.clone(), self.objective_with_unit());
        Some(LinePlot { x_label, y_label, lines, y_from: Some(0.0), ..LinePlot::default() })
    }

    fn mean_cell(&self, mean: &MeanOfTracker) -> MeanCell {
        let mut words = Vec::new();
        if mean.ci95.is_some() {
            words.push(self.interval(mean.ci95));
        }
        if mean.lost > 0 {
            words.push(format!("{} lost", mean.lost));
        }
        if mean.missing > 0 {
            words.push(format!("{} missing", mean.missing));
        }
        if let Some(coverage) = mean.coverage.filter(|coverage| *coverage < 1.0) {
            words.push(format!("{} estimated", percent(coverage)));
        }
        MeanCell { mean: self.value(mean.mean), note: words.join(", ") }
    }

    /// Settings that are judged, best first, then the others.
    fn rows(&self) -> Vec<SettingRow<'_>> {
        let settings = &self.summary.settings;
        let front = pareto_front(settings, self.objective);
        let mut shown = self.summary.ranked();
        let judged = shown.len();
        shown.extend(settings.iter().filter(|setting| !setting.is_judged()));
        let mut rows = Vec::new();
        for (at, setting) in shown.into_iter().take(MOST_ROWS).enumerate() {
            let ends = setting.interval_or_range(self.summary.has_intervals());
            let cells = setting.cells.iter().take(MOST_CELLS);
            rows.push(SettingRow {
                labels: &setting.labels,
                mean: self.value(setting.mean),
                interval: self.interval(ends.map(|[low, high]| Interval { low, high })),
                coverage: setting.coverage.map_or("-".to_owned(), percent),
                evaluations: setting.evaluations_per_frame.map_or("-".to_owned(), three_digits),
                processor: setting.processor_ms_per_frame.map_or("-".to_owned(), three_digits),
                lost: setting.diverged,
                best: at == 0 && judged > 0,
                front: front.iter().any(|other| std::ptr::eq(&settings[*other], setting)),
                cells: cells
                    .map(|cell| CellLink { index: cell.index, state: cell.state(), report: cell.report_file() })
                    .collect(),
                more_cells: setting.cells.len().saturating_sub(MOST_CELLS),
            });
        }
        rows
    }

    fn value(&self, value: Option<f64>) -> String {
        value.map_or("-".to_owned(), |value| number(value, self.objective.unit))
    }

    fn interval(&self, ends: Option<Interval>) -> String {
        ends.map_or("-".to_owned(), |ends| between(ends.low, ends.high, self.objective.unit))
    }
}

/// A share in percent; one below 1 never reads as 100 %.
pub(crate) fn percent(share: f64) -> String {
    if share >= 1.0 { "100 %".to_owned() } else { format!("{:.1} %", (100.0 * share).min(99.9)) }
}

fn three_digits(value: f64) -> String {
    match value.abs() {
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

/// Whether the values of an axis can be told apart.
fn words(Separation { effect, verdict, rank_agreement }: &Separation) -> String {
    let verdict = match verdict {
        Verdict::Apart => "intervals apart",
        Verdict::CeilingReached => "ceiling reached: no two intervals are apart",
        Verdict::Scattered => "no two intervals are apart: more seeds or draws are needed",
        Verdict::NoIntervals => "no intervals",
    };
    let ranks = rank_agreement.map_or(String::new(), |tau| format!(", ranks agree by {tau:.2}"));
    let effect = effect.map_or(String::new(), |effect| format!("{:.0} %, ", 100.0 * effect));
    format!("{effect}{verdict}{ranks}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_below_one_is_not_shown_as_whole() {
        assert_eq!([1.0, 0.99999, 0.12].map(percent), ["100 %", "99.9 %", "12.0 %"]);
        assert_eq!([0.5, 12.34, 25_000.0].map(three_digits), ["0.50", "12.3", "25000"]);
    }
}
