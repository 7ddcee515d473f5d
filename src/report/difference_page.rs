//! The page of differences between runs.

use serde::Serialize;

use super::ReportError;
use super::difference_rows::{
    DifferenceRow, clip_rows, constant_rows, describe_lost, how, joint_rows, metric_rows, pairing, scope, seeds_of,
};
use super::difference_sentence::describe_side;
use super::difference_text::misread;
use super::html::render_page;
use crate::evaluation::{AgainstBase, METRICS, RunComparison};

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
    sides: Vec<PageSide<'a>>,
    /// The number of sides, unless all are shown.
    of_sides: Option<usize>,
}

#[derive(Serialize)]
struct PageSide<'a> {
    name: &'a str,
    /// The findings.
    sentence: String,
    trackers: String,
    pairing: &'static str,
    scope: String,
    lost: Option<String>,
    skipped: Vec<String>,
    tables: Vec<DifferenceTable>,
}

#[derive(Serialize)]
struct DifferenceTable {
    title: &'static str,
    first: &'static str,
    /// Whether rows have p values, findings and coverage.
    tested: bool,
    /// Whether it is initially collapsed.
    folded: bool,
    rows: Vec<DifferenceRow>,
}

/// Self-contained HTML with all metrics, clips and markers of every side against the base.
///
/// # Errors
/// [`ReportError`] if the page cannot be rendered.
pub fn difference_page(comparison: &RunComparison) -> Result<String, ReportError> {
    let table = |title, first, tested, rows| DifferenceTable { title, first, tested, folded: false, rows };
    let side = |side: &AgainstBase| {
        let tables = [
            table("Metrics", "Metric", true, metric_rows(side, true)),
            table("HumanEva 3-D error by clip, mm", "Clip", false, clip_rows(side)),
            table("Error by marker, mm", "Marker", false, joint_rows(side)),
            DifferenceTable {
                folded: true,
                ..table("The actor's own values, equal on both sides", "Metric", true, constant_rows(side))
            },
        ];
        tables.into_iter().filter(|table| !table.rows.is_empty()).collect()
    };
    let sides: Vec<PageSide<'_>> = shown(&comparison.others)
        .into_iter()
        .map(|other| PageSide {
            name: &other.side.name,
            sentence: describe_side(other, &comparison.base.name),
            trackers: other.side.trackers.join(", "),
            pairing: pairing(other),
            scope: scope(other),
            lost: describe_lost(&other.lost_tracks),
            skipped: other.skipped.clone(),
            tables: side(other),
        })
        .collect();
    let count = comparison.others.len();
    let names = if count <= NAMED {
        sides.iter().map(|side| side.name).collect::<Vec<_>>().join(", ")
    } else {
        format!("{count} sides")
    };
    let page = DifferencePage {
        title: format!("{names} against {}", comparison.base.name),
        base: &comparison.base.name,
        seeds: seeds_of(comparison),
        how: how(comparison),
        misread: misread(comparison),
        sides,
        of_sides: (count > SIDES).then_some(count),
    };
    render_page(TEMPLATE, &page)
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
    use super::super::difference_text::tests::compared;
    use super::*;
    use crate::evaluation::Finding;

    #[test]
    fn a_page_of_very_many_sides_shows_the_best_and_the_worst() {
        let mut many = compared(&["walk"]);
        let one = many.others[0].clone();
        many.others = (0..1000)
            .map(|at| {
                let mut side = one.clone();
                side.side.name = format!("side-{at}-");
                side.metrics[0].difference.difference = f64::from((at * 7) % 1000);
                side
            })
            .collect();
        let html = difference_page(&many).unwrap();
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
        let html = difference_page(&comparison).unwrap();
        let [sentence, table, fold, row] =
            ["my_change is worse than main: ", "<table", "The actor&#x27;s own values", "truth_foot_float_mm"]
                .map(|words| html.find(words).unwrap_or_else(|| panic!("{words}")));
        assert!(sentence < table && table < fold && fold < row);
        assert_eq!(html.matches("truth_foot_float_mm").count(), 1);
    }

    /// Set `SKIAGRAPH_DIFFERENCE_PAGE` to a path to look at the page in a browser.
    #[test]
    fn a_page_has_all_metrics_clips_and_markers_and_needs_no_network() {
        let html = difference_page(&compared(&["walk", "<b>jump"])).unwrap();
        if let Some(path) = std::env::var_os("SKIAGRAPH_DIFFERENCE_PAGE") {
            std::fs::write(path, &html).unwrap();
        }
        for part in ["HumanEva 3-D error, mm", "&lt;b&gt;jump", "left knee", "+4.2", "worse"] {
            assert!(html.contains(part), "{part}");
        }
        for reference in ["http:", "https:", "src=", "@import", "<link", "<b>jump"] {
            assert!(!html.contains(reference), "{reference}");
        }
    }
}
