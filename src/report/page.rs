//! The page.

use serde::Serialize;

use crate::evaluation::{Direction, METRICS, Metric, Run, Unit};

use super::contact_sheet::{cells, seconds};
use super::figures::{Figure, figures, per_frame};
use super::html::render_page;
use super::input::{FactGroup, worst_frame};
use super::verdict::{Verdict, verdict};
use super::{ReportError, ReportInput, ReportRun, Sheet, base64, cell, overlay, typical_run};

const TEMPLATE: &str = include_str!("page.html");
const SCRIPT: &str = include_str!("page.js");

/// The metrics that stand at the top, with what each means.
const HEADLINES: [(&str, &str); 6] = [
    ("humaneva_mm", "mean distance of the body's markers from the truth"),
    ("pa_mpjpe_mm", "the same for the pose alone, place and size set right"),
    ("body_orientation_deg", "how far the trunk is turned away"),
    ("silhouette_iou", "of the outlines agree (intersection over union)"),
    ("track_loss", "of the frames count as lost"),
    ("coverage", "of the markers have an estimate; errors speak of these alone"),
];

#[derive(Serialize)]
struct Page<'a> {
    script: &'static str,
    title: &'a str,
    tracker: &'a str,
    matched: bool,
    seeds: usize,
    verdict: Verdict,
    headlines: Vec<Headline>,
    sheet: Option<SheetOnPage<'a>>,
    figures: Vec<Figure>,
    metrics: Vec<MetricRow>,
    absent: Vec<AbsentRow<'a>>,
    has_frozen: bool,
    interval: &'a str,
    worst: Vec<WorstRow>,
    facts: &'a [FactGroup],
}

#[derive(Serialize)]
struct Headline {
    value: String,
    unit: &'static str,
    interval: Option<String>,
    meaning: &'static str,
}

#[derive(Serialize)]
struct MetricRow {
    title: &'static str,
    name: &'static str,
    unit: &'static str,
    better: &'static str,
    protocol: String,
    mean: String,
    interval: Option<String>,
    median: String,
    p90: String,
    max: String,
    coverage: String,
    frozen: Option<String>,
}

#[derive(Serialize)]
struct AbsentRow<'a> {
    title: &'static str,
    name: &'static str,
    needs: &'a str,
}

#[derive(Serialize)]
struct WorstRow {
    seed: u64,
    frame: usize,
    time: String,
    error: String,
    overlap: Option<String>,
    gap: Option<String>,
    shown: bool,
}

#[derive(Serialize)]
struct SheetOnPage<'a> {
    seed: u64,
    /// Whether any frame has a silhouette of the estimate.
    outlined: bool,
    colours: SheetColours,
    columns: Vec<SheetColumn<'a>>,
}

#[derive(Serialize)]
struct SheetColours {
    both: String,
    only_observed: String,
    only_estimated: String,
    /// Empty without props.
    props: String,
    truth: String,
    estimate: String,
}

#[derive(Serialize)]
struct SheetColumn<'a> {
    frame: usize,
    time: String,
    error: Option<String>,
    worst: bool,
    cells: Vec<SheetCell<'a>>,
}

#[derive(Serialize)]
struct SheetCell<'a> {
    camera: &'a str,
    overlap: Option<String>,
    png: String,
}

/// The whole page: HTML with style, script, plots and pictures inside, no network needed.
///
/// # Errors
/// [`ReportError`] without a run, when a sheet's frames do not fit its cameras, or when a plot or picture fails.
pub fn render(input: &ReportInput<'_>) -> Result<String, ReportError> {
    let runs: Vec<Run<'_>> = input.runs.iter().map(|run| run.run).collect();
    let typical = typical_run(&runs).map(|index| &input.runs[index]).ok_or(ReportError::NoRun)?;
    let page = Page {
        script: SCRIPT,
        title: input.title,
        tracker: input.tracker,
        matched: input.matched,
        seeds: input.runs.len(),
        verdict: verdict(input),
        headlines: HEADLINES.iter().filter_map(|(name, meaning)| headline(input, name, meaning)).collect(),
        sheet: input.sheet.map(|sheet| sheet_on_page(input, sheet)).transpose()?,
        figures: figures(input, typical)?,
        metrics: METRICS.iter().filter_map(|metric| metric_row(input, metric)).collect(),
        absent: METRICS.iter().filter_map(|metric| absent_row(input, metric)).collect(),
        has_frozen: input.frozen.is_some(),
        interval: &input.summary.interval,
        worst: worst_rows(input),
        facts: input.facts,
    };
    render_page(TEMPLATE, &page)
}

fn headline(input: &ReportInput<'_>, name: &str, meaning: &'static str) -> Option<Headline> {
    let metric = input.summary.metrics.get(name)?;
    let (value, unit) = (number(metric.mean, metric.unit), symbol(metric.unit));
    let interval = metric.ci95.map(|ends| between(ends.low, ends.high, metric.unit));
    Some(Headline { value, unit, interval, meaning })
}

fn metric_row(input: &ReportInput<'_>, metric: &Metric) -> Option<MetricRow> {
    let summary = input.summary.metrics.get(metric.name)?;
    let show = |value: f64| number(value, metric.unit);
    Some(MetricRow {
        title: metric.title,
        name: metric.name,
        unit: symbol(metric.unit),
        better: match metric.direction {
            Direction::LowerIsBetter => "lower is better",
            Direction::HigherIsBetter => "higher is better",
            Direction::Neither => "a diagnosis",
        },
        protocol: summary.protocol.clone(),
        mean: show(summary.mean),
        interval: summary.ci95.map(|ends| between(ends.low, ends.high, metric.unit)),
        median: show(summary.median),
        p90: show(summary.p90),
        max: show(summary.max),
        coverage: coverage(summary.coverage),
        frozen: input.frozen.and_then(|frozen| frozen.metrics.get(metric.name)).map(|value| show(value.mean)),
    })
}

fn absent_row<'a>(input: &ReportInput<'a>, metric: &Metric) -> Option<AbsentRow<'a>> {
    let needs = input.summary.absent.get(metric.name)?;
    Some(AbsentRow { title: metric.title, name: metric.name, needs })
}

/// A share as a percentage; 100 is all of it, not nearly all.
fn coverage(share: f64) -> String {
    format!("{:.1}", (1000.0 * share).floor() / 10.0)
}

/// The ten worst frames of all runs, no two within ten frames of each other in one run.
fn worst_rows(input: &ReportInput<'_>) -> Vec<WorstRow> {
    let of_run = |run: &ReportRun<'_>| {
        let errors = per_frame(run.run.evaluation, "humaneva_mm").to_vec();
        errors.into_iter().enumerate().filter_map(|(frame, error)| Some((frame, error?))).collect::<Vec<_>>()
    };
    let mut frames: Vec<(usize, usize, f64)> = Vec::new();
    for (index, run) in input.runs.iter().enumerate() {
        frames.extend(of_run(run).into_iter().map(|(frame, error)| (index, frame, error)));
    }
    frames.sort_by(|a, b| b.2.total_cmp(&a.2));
    let mut chosen: Vec<(usize, usize, f64)> = Vec::new();
    for (run, frame, error) in frames {
        if chosen.len() == 10 {
            break;
        }
        if chosen.iter().all(|(r, f, _)| *r != run || f.abs_diff(frame) > 10) {
            chosen.push((run, frame, error));
        }
    }
    chosen.into_iter().map(|(run, frame, error)| worst_row(input, &input.runs[run], frame, error)).collect()
}

fn worst_row(input: &ReportInput<'_>, run: &ReportRun<'_>, frame: usize, error: f64) -> WorstRow {
    let evaluation = run.run.evaluation;
    let at = |metric: &str| per_frame(evaluation, metric).get(frame).copied().flatten();
    let on_sheet = |sheet: &&Sheet<'_>| sheet.seed == run.run.seed && sheet.frames.iter().any(|f| f.frame == frame);
    WorstRow {
        seed: run.run.seed,
        frame,
        time: format!("{:.2} s", frame as f64 / evaluation.frames_per_second),
        error: number(error, Unit::Millimetre),
        overlap: at("silhouette_iou").map(|overlap| number(overlap, Unit::Fraction)),
        gap: at("energy_gap").map(|gap| number(gap, Unit::Energy)),
        shown: input.sheet.as_ref().is_some_and(on_sheet),
    }
}

fn sheet_on_page<'a>(input: &ReportInput<'_>, sheet: &'a Sheet<'a>) -> Result<SheetOnPage<'a>, ReportError> {
    let run = input.runs.iter().find(|run| run.run.seed == sheet.seed);
    let worst = run.and_then(|run| worst_frame(run.run.evaluation));
    let mut columns = Vec::new();
    for (frame, views) in sheet.frames.iter().zip(cells(sheet)?) {
        let mut shown = Vec::new();
        for (view, camera) in views.iter().zip(&sheet.rig.cameras) {
            shown.push(SheetCell {
                camera: &camera.name,
                overlap: view.overlap.map(|overlap| format!("{:.0} %", 100.0 * overlap)),
                png: base64::encode(&cell::png(&view.picture)?),
            });
        }
        columns.push(SheetColumn {
            frame: frame.frame,
            time: format!("{:.2} s", seconds(sheet, frame)),
            error: frame.error_mm().map(|error| format!("{error:.0} mm")),
            worst: worst == Some(frame.frame),
            cells: shown,
        });
    }
    let hex = |[red, green, blue]: [u8; 3]| format!("#{red:02x}{green:02x}{blue:02x}");
    let colours = SheetColours {
        both: hex(cell::BOTH),
        only_observed: hex(cell::ONLY_OBSERVED),
        only_estimated: hex(cell::ONLY_ESTIMATED),
        props: if sheet.props.is_empty() { String::new() } else { hex(cell::PROP) },
        truth: hex(overlay::Whose::Truth.colour()),
        estimate: hex(overlay::Whose::Estimate.colour()),
    };
    let outlined = sheet.frames.iter().any(|frame| frame.estimated.is_some());
    Ok(SheetOnPage { seed: sheet.seed, outlined, colours, columns })
}

/// A value for people: shares as percentages, the rest with a sensible number of decimals.
pub(super) fn number(value: f64, unit: Unit) -> String {
    let decimals = match unit {
        Unit::Fraction | Unit::Millimetre | Unit::Degree | Unit::Millisecond => 1,
        Unit::Second | Unit::MetrePerSecondSquared | Unit::BodyWeight => 2,
        Unit::MillimetrePerSecond | Unit::MetrePerSecondCubed => 0,
        Unit::Energy => 4,
    };
    let shown = if unit == Unit::Fraction { 100.0 * value } else { value };
    let text = format!("{shown:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() { text.trim_start_matches('-').to_owned() } else { text }
}

pub(super) fn symbol(unit: Unit) -> &'static str {
    if unit == Unit::Fraction { "%" } else { unit.symbol() }
}

pub(super) fn between(low: f64, high: f64, unit: Unit) -> String {
    format!("{} to {}", number(low, unit), number(high, unit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, told};

    fn page(story: &Story) -> String {
        told(story, |input| render(input).unwrap())
    }

    /// Set `SKIAGRAPH_REPORT_PAGE` to a path to look at the page in a browser.
    #[test]
    fn a_page_shows_everything_and_needs_no_network() {
        let html =
            page(&Story { seeds: 5, title: "Walk <& talk>", shown: &[1, 24, 48, 72, 96, 120], ..Story::default() });
        if let Some(path) = std::env::var_os("SKIAGRAPH_REPORT_PAGE") {
            std::fs::write(path, &html).unwrap();
        }
        assert!(html.starts_with("<!doctype html>") && html.trim_end().ends_with("</html>"));
        assert!(html.contains("Walk &lt;&amp; talk&gt;") && !html.contains("Walk <&"));
        assert_eq!(html.matches("data:image/png;base64,").count(), 7 * 4, "six frames, the worst, and four cameras");
        let outside = html.replace("http://www.w3.org/2000/svg", "");
        for reference in ["http:", "https:", "src=\"/", "@import", "<link"] {
            assert!(!outside.contains(reference), "the page refers to {reference}");
        }
        for heading in ["Error over the clip", "Error of every joint", "Effective sample size", "Worst frames"] {
            assert!(html.contains(heading), "{heading}");
        }
        assert!(html.contains("frame 0 (the start pose) left out"), "protocols are on the page");
    }

    #[test]
    fn the_least_that_can_be_reported_is_one_seed_without_pictures() {
        let html = page(&Story { layers: 0, energies: false, frozen: false, shown: &[], ..Story::default() });
        assert!(html.contains("No interval") && !html.contains("data:image/png"));
    }

    #[test]
    fn a_report_of_nothing_is_an_error() {
        let nothing = told(&Story::default(), |input| render(&ReportInput { runs: &[], ..*input }).is_err());
        assert!(nothing);
    }

    #[test]
    fn a_matched_body_is_said_on_the_page() {
        assert!(page(&Story { matched: true, ..Story::default() }).contains("Matched model"));
        assert!(!page(&Story { matched: false, ..Story::default() }).contains("Matched model"));
    }

    #[test]
    fn numbers_are_short_and_zero_has_no_sign() {
        assert_eq!(number(0.98765, Unit::Fraction), "98.8");
        assert_eq!(number(-0.00001, Unit::Energy), "0.0000");
        assert_eq!(number(-0.25, Unit::Energy), "-0.2500");
    }
}
