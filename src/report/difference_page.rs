//! The page of differences between runs.

use serde::Serialize;

use super::ReportError;
use super::difference_rows::{
    DifferenceRow, HOW, clip_rows, joint_rows, lost_in_words, metric_rows, pairing, seeds_of,
};
use super::html::render_page;
use crate::evaluation::RunComparison;

const TEMPLATE: &str = include_str!("difference_page.html");

#[derive(Serialize)]
struct DifferencePage<'a> {
    title: String,
    base: &'a str,
    seeds: String,
    how: &'static str,
    sides: Vec<PageSide<'a>>,
}

#[derive(Serialize)]
struct PageSide<'a> {
    name: &'a str,
    trackers: String,
    pairing: &'static str,
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
    rows: Vec<DifferenceRow>,
}

/// HTML with all metrics, clips and markers of every side against the base; no network needed.
///
/// # Errors
/// [`ReportError`] if the page cannot be rendered.
pub fn difference_page(comparison: &RunComparison) -> Result<String, ReportError> {
    let side = |side: &'_ crate::evaluation::AgainstBase| {
        let tables = [
            DifferenceTable { title: "Metrics", first: "Metric", tested: true, rows: metric_rows(side, true) },
            DifferenceTable {
                title: "HumanEva 3-D error by clip, mm",
                first: "Clip",
                tested: false,
                rows: clip_rows(side),
            },
            DifferenceTable { title: "Error by marker, mm", first: "Marker", tested: false, rows: joint_rows(side) },
        ];
        tables.into_iter().filter(|table| !table.rows.is_empty()).collect()
    };
    let sides: Vec<PageSide<'_>> = comparison
        .others
        .iter()
        .map(|other| PageSide {
            name: &other.side.name,
            trackers: other.side.trackers.join(", "),
            pairing: pairing(other),
            lost: lost_in_words(&other.lost_tracks),
            skipped: other.skipped.clone(),
            tables: side(other),
        })
        .collect();
    let names: Vec<&str> = sides.iter().map(|side| side.name).collect();
    let title = format!("{} against {}", names.join(", "), comparison.base.name);
    render_page(
        TEMPLATE,
        &DifferencePage { title, base: &comparison.base.name, seeds: seeds_of(comparison), how: HOW, sides },
    )
}

#[cfg(test)]
mod tests {
    use super::super::difference_text::tests::compared;
    use super::*;

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
