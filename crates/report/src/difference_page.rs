//! The page of a comparison, of runs or of the methods of a scenario.

use serde::Serialize;

use super::comparison::{error_plot, shown as shown_metrics};
use super::difference_rows::{DescribedSide, how, seeds_of};
use super::difference_text::misread;
use super::displayed::{number, symbol};
use super::figures::ResponsiveSvg;
use super::html::render_page;
use super::{ComparedMethod, ReportError};
use skiagraph_eval::{AgainstBase, METRICS, RunComparison};

const TEMPLATE: &str = include_str!("difference_page.html");
/// Maximum number of sides on a page; each takes about 20 kB.
const SIDES: usize = 200;
/// Maximum number of sides named in the title.
const NAMED: usize = 20;

#[derive(Serialize)]
struct DifferencePage<'a> {
    title: String,
    base: &'a str,
    seeds: String,
    how: String,
    /// Sides whose estimates may have been misread.
    misread: Vec<String>,
    /// Headings of the table of all sides.
    columns: Vec<String>,
    /// The base, then the others.
    overview: Vec<OverviewRow<'a>>,
    /// Errors over time, if every side is one run of the same set.
    plot: Option<ResponsiveSvg>,
    sides: Vec<DescribedSide<'a>>,
    /// The number of sides, unless all are shown.
    of_sides: Option<usize>,
}

#[derive(Serialize)]
struct OverviewRow<'a> {
    name: &'a str,
    trackers: String,
    /// A reference, not a tracker to choose.
    knows_truth: bool,
    report: Option<&'a str>,
    cells: Vec<String>,
}

/// Self-contained HTML with all metrics, clips and markers of every side against the base. `runs` are the sides in the
/// same order, the base first, if each is one run of the same set; else empty.
///
/// # Errors
/// [`ReportError`] if the page cannot be rendered.
pub fn difference_page(comparison: &RunComparison, runs: &[ComparedMethod]) -> Result<String, ReportError> {
    let base = comparison.base.name.as_str();
    let sides: Vec<DescribedSide<'_>> =
        shown(&comparison.others).into_iter().map(|side| DescribedSide::new(side, base)).collect();
    let count = comparison.others.len();
    let names = if count <= NAMED {
        sides.iter().map(|side| side.name).collect::<Vec<_>>().join(", ")
    } else {
        format!("{count} sides")
    };
    let page = DifferencePage {
        title: format!("{names} against {base}"),
        base,
        seeds: seeds_of(comparison),
        how: how(comparison),
        misread: misread(comparison),
        columns: shown_metrics().map(|metric| format!("{}, {}", metric.title, symbol(metric.unit))).collect(),
        overview: overview(comparison, runs),
        plot: match runs {
            [] => None,
            runs => Some(ResponsiveSvg::of_lines(&error_plot(runs), true, [420, 320, 360])?),
        },
        sides,
        of_sides: (count > SIDES).then_some(count),
    };
    render_page(TEMPLATE, &page)
}

/// The main metrics of the base and of the shown sides.
fn overview<'a>(comparison: &'a RunComparison, runs: &'a [ComparedMethod]) -> Vec<OverviewRow<'a>> {
    let row = |name: &'a str, trackers: &[String], values: Option<&AgainstBase>, is_base: bool| {
        let mut cells = Vec::new();
        for metric in shown_metrics() {
            let found = values.and_then(|side| side.metrics.iter().find(|compared| compared.metric == metric.name));
            let value = found.map(|found| if is_base { found.difference.base } else { found.difference.other });
            cells.push(value.map_or_else(|| "–".to_owned(), |value| number(value, metric.unit)));
        }
        let run = runs.iter().find(|run| run.name == name);
        let knows_truth = run.is_some_and(|run| run.knows_truth);
        OverviewRow {
            name,
            trackers: trackers.join(", "),
            knows_truth,
            report: run.and_then(|run| run.report.as_deref()),
            cells,
        }
    };
    let base = &comparison.base;
    let mut rows = vec![row(&base.name, &base.trackers, comparison.others.first(), true)];
    for side in shown(&comparison.others) {
        rows.push(row(&side.side.name, &side.side.trackers, Some(side), false));
    }
    rows
}

/// All sides, or if there are too many, the best and the worst by the first metric, best first.
fn shown(others: &[AgainstBase]) -> Vec<&AgainstBase> {
    let mut sides: Vec<&AgainstBase> = others.iter().collect();
    if sides.len() <= SIDES {
        return sides;
    }
    let worse_by = |side: &AgainstBase| {
        let metric = side.metrics.iter().find(|metric| metric.metric == METRICS[0].name);
        metric.map_or(f64::INFINITY, |metric| metric.difference.difference)
    };
    sides.sort_by(|a, b| worse_by(a).total_cmp(&worse_by(b)));
    sides.drain(SIDES / 2..others.len() - SIDES / 2);
    sides
}

#[cfg(test)]
mod tests {
    use super::super::comparison::tests::method;
    use super::super::difference_text::tests::compared;
    use super::super::fixture::Story;
    use super::*;
    use skiagraph_eval::Finding;

    #[test]
    fn a_page_of_very_many_sides_shows_the_best_and_the_worst() {
        let mut many = compared(&["walk"]);
        let one = many.others[0].clone();
        let side = |at: i32| {
            let mut side = one.clone();
            side.side.name = format!("side-{at}-");
            side.metrics[0].difference.difference = f64::from((at * 7) % 1000);
            side
        };
        many.others = (0..1000).map(side).collect();
        let html = difference_page(&many, &[]).unwrap();
        assert!(html.contains("1000 sides against main") && html.contains("the 200 best and worst of 1000"), "{html}");
        assert_eq!(html.matches("<h2>side-").count(), SIDES);
        // 7 x 143 = 1001: the second best; 500 x 7 = 3500: in the middle
        assert!(html.contains("<h2>side-0-") && html.contains("<h2>side-143-") && !html.contains("<h2>side-500-"));
    }

    #[test]
    fn the_page_begins_with_the_findings_and_collapses_the_actors_own_values() {
        let mut comparison = compared(&["walk"]);
        let side = &mut comparison.others[0];
        let mut truth = side.metrics[0].clone();
        (truth.metric, truth.finding) = ("truth_foot_float_mm".to_owned(), Finding::Same);
        side.metrics.push(truth);
        let html = difference_page(&comparison, &[]).unwrap();
        let sentence = "HumanEva 3-D error, mm: my_change 34.6, main 30.4; worse by 4.2";
        let places = [sentence, "<h3>Metrics", "The actor's own values", "truth_foot_float_mm"];
        let places = places.map(|words| html.find(words).unwrap_or_else(|| panic!("{words}")));
        assert!(places.is_sorted(), "{places:?}");
        assert_eq!(html.matches("truth_foot_float_mm").count(), 1);
    }

    #[test]
    fn sides_and_their_errors_over_time_come_first() {
        let (comparison, story) = (compared(&["walk"]), Story { seeds: 3, ..Story::default() });
        let runs = [method("main", &story, true), method("my_change", &story, false)];
        let html = difference_page(&comparison, &runs).unwrap();
        let places = ["uses the ground truth", "<svg", "<h3>Metrics"].map(|words| html.find(words).unwrap());
        assert!(places.is_sorted(), "{places:?}");
        assert_eq!(html.matches("uses the ground truth").count(), 1);
        assert!(!difference_page(&comparison, &[]).unwrap().contains("<svg"));
    }

    #[test]
    fn a_page_has_all_metrics_clips_and_markers_and_needs_no_network() {
        let html = difference_page(&compared(&["walk", "<b>jump"]), &[]).unwrap();
        for part in ["HumanEva 3-D error, mm", "&lt;b&gt;jump", "left knee", "+4.2", "worse"] {
            assert!(html.contains(part), "{part}");
        }
        for reference in ["http:", "https:", "src=", "@import", "<link", "<b>jump"] {
            assert!(!html.contains(reference), "{reference}");
        }
    }
}
