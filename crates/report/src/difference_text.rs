//! Differences of runs as text: for a terminal, and as Markdown for a pull request.

use serde::Serialize;

use super::ReportError;
use super::difference_rows::{DescribedSide, DifferenceRow, how, seeds_of};
use super::html::render_text;
use skiagraph_eval::RunComparison;

const MARKDOWN: &str = include_str!("comparison.md");

/// A table for a terminal with the main metrics, or with `all` also the other metrics and markers.
pub fn comparison_text(comparison: &RunComparison, all: bool) -> String {
    let base = &comparison.base;
    let mut lines = misread(comparison);
    lines.push(format!("base: {} ({}), {}", base.name, base.trackers.join(", "), seeds_of(comparison)));
    for side in &comparison.others {
        let mut said = DescribedSide::new(side, &base.name);
        said.metrics.retain(|row| all || row.is_main);
        lines.push(String::new());
        lines.push(format!("{} ({}) against {}, {}", said.name, said.trackers, base.name, said.pairing));
        lines.extend(said.sentence.map(|sentence| format!("  {sentence}")));
        lines.extend(table("metric", &said.metrics));
        lines.extend(table("HumanEva 3-D error by clip, mm", &said.clips));
        if all {
            lines.extend(table("error by marker, mm", &said.joints));
            let constants: Vec<&str> = said.constants.iter().map(|row| row.name.as_str()).collect();
            if !constants.is_empty() {
                lines.push(format!("  the actor's own values are equal on both sides: {}", constants.join(", ")));
            }
        }
        lines.extend(said.lost.map(|line| format!("  {line}")));
        lines.extend(said.left_out.iter().map(|line| format!("  left out: {line}")));
        lines.push(format!("  {}", side.scope));
    }
    lines.push(format!("\n  {}", how(comparison)));
    lines.join("\n")
}

/// Warnings about sides whose estimates may have been misread.
pub(super) fn misread(comparison: &RunComparison) -> Vec<String> {
    let sides = std::iter::once(&comparison.base).chain(comparison.others.iter().map(|other| &other.side));
    let line = |name: &str, hint: &String| format!("{name}: the estimate may have been misread: {hint}");
    sides.flat_map(|side| side.misread.iter().map(move |hint| line(&side.name, hint))).collect()
}

fn table(title: &str, rows: &[DifferenceRow]) -> Vec<String> {
    if rows.is_empty() {
        return Vec::new();
    }
    let width = rows.iter().map(|row| row.title.chars().count()).max().unwrap_or(0).max(title.len());
    let line = |cells: [&str; 7]| {
        let [title, base, other, difference, interval, p, finding] = cells;
        format!("  {title:<width$} {base:>9} {other:>9} {difference:>10}  {interval:^20} {p:>7}  {finding}")
            .trim_end()
            .to_owned()
    };
    let mut lines = vec![String::new(), line([title, "base", "other", "difference", "95 % interval", "p", ""])];
    lines.extend(
        rows.iter()
            .map(|row| line([&row.title, &row.base, &row.other, &row.difference, &row.interval, &row.p, row.finding])),
    );
    lines
}

#[derive(Serialize)]
struct MarkdownComparison<'a> {
    base: &'a str,
    seeds: String,
    how: String,
    misread: Vec<String>,
    sides: Vec<DescribedSide<'a>>,
}

/// The same as Markdown, with the long part collapsed.
///
/// # Errors
/// [`ReportError`] if it cannot be rendered.
pub fn comparison_markdown(comparison: &RunComparison) -> Result<String, ReportError> {
    let base = comparison.base.name.as_str();
    let content = MarkdownComparison {
        base,
        seeds: seeds_of(comparison),
        how: how(comparison),
        misread: misread(comparison),
        sides: comparison.others.iter().map(|side| DescribedSide::new(side, base)).collect(),
    };
    render_text(MARKDOWN, &content)
}

/// Escapes text so that it cannot end a cell, start markup or mention a user: names of folders and clips are untrusted.
pub(super) fn cell(text: &str) -> String {
    let mut safe = String::new();
    for character in text.chars() {
        match character {
            '|' | '\\' | '`' | '<' | '>' | '[' | ']' | '@' => safe.push_str(&format!("&#{};", u32::from(character))),
            '_' => safe.push_str("\\_"),
            c if c.is_control() => safe.push(' '),
            c => safe.push(c),
        }
    }
    safe
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use skiagraph_eval::{DifferenceRule, MeasuredClip, MeasuredMetric, MeasuredRuns, Unit, compare_runs};
    use std::collections::BTreeMap;

    pub(crate) fn millimetres(values: [f64; 5]) -> MeasuredMetric {
        let per_seed = values.map(Some).to_vec();
        MeasuredMetric { unit: Unit::Millimetre, protocol: "no alignment".to_owned(), per_seed }
    }

    /// A clip of nine frames with five seeds of these metrics.
    pub(crate) fn measured_clip(metrics: BTreeMap<String, MeasuredMetric>) -> MeasuredClip {
        MeasuredClip {
            set_hash: "a".to_owned(),
            frames: 9,
            frames_per_second: 60.0,
            tracker: "frozen".to_owned(),
            version: "0.1.0".to_owned(),
            seeds: (0..5).collect(),
            metrics,
            ..MeasuredClip::default()
        }
    }

    pub(crate) fn compared(clips: &[&str]) -> RunComparison {
        let side = |errors: [f64; 5]| {
            let metric = millimetres(errors);
            let metrics = BTreeMap::from([("humaneva_mm".to_owned(), metric)]);
            let joints = BTreeMap::from([("left_knee".to_owned(), errors.map(Some).to_vec())]);
            let clip = MeasuredClip { joints, ..measured_clip(metrics) };
            let clips = clips.iter().map(|name| ((*name).to_owned(), clip.clone())).collect();
            MeasuredRuns { clips, ..MeasuredRuns::default() }
        };
        let (base, other) = (side([30.0, 31.0, 29.0, 32.0, 30.0]), side([34.0, 35.5, 33.0, 36.0, 34.5]));
        compare_runs(("main", &base), &[("my_change", &other)], false, None).unwrap()
    }

    #[test]
    fn the_table_has_difference_interval_and_finding_in_one_line() {
        let text = comparison_text(&compared(&["walk"]), false);
        // the last of them: the summary's sentence comes before the table
        let line = text.lines().rfind(|line| line.contains("HumanEva 3-D error, mm")).unwrap();
        for part in ["30.4", "34.6", "+4.2", "3.9 to 4.5", "<0.001", "worse"] {
            assert!(line.contains(part), "{part}: {line}");
        }
        assert!(text.contains("paired by clip x seed") && !text.contains("by clip, mm"), "{text}");
        assert!(text.contains("intervals over 5 seeds; clips: 1 (walk, 0.1 s)"), "{text}");
        assert!(comparison_text(&compared(&["walk", "jump"]), true).contains("by clip, mm"));
        assert!(comparison_text(&compared(&["walk"]), true).contains("left knee"));
    }

    // a tracker that died after six frames was "better", and nothing beside it said so
    #[test]
    fn coverage_stands_beside_the_finding() {
        let mut comparison = compared(&["walk"]);
        assert!(!comparison_text(&comparison, false).contains("coverage my_change"));
        comparison.others[0].metrics[0].coverage = [Some(1.0), Some(0.179)];
        let text = comparison_text(&comparison, false);
        assert!(text.contains("; coverage my_change 17.9 %, main 100 %."), "{text}");
    }

    #[test]
    fn the_footnote_names_the_tests_that_the_p_values_come_from() {
        let with = |rule: DifferenceRule, paired: bool| {
            let mut comparison = compared(&["walk"]);
            comparison.others[0].paired = paired;
            comparison.others[0].metrics.iter_mut().for_each(|metric| metric.difference.rule = rule);
            comparison_text(&comparison, false).lines().last().unwrap().to_owned()
        };
        for (rule, paired, name) in [
            (DifferenceRule::PairedT, true, "p: two-sided, Student's t test on pairs; adjusted by Holm"),
            (DifferenceRule::Welch, false, "p: two-sided, Welch's t test; adjusted by Holm"),
            (DifferenceRule::Exact, true, "p: two-sided, the sign test on pairs where all differ by the same;"),
            (DifferenceRule::Exact, false, "p: two-sided, the rank test where no run varies; adjusted"),
        ] {
            assert!(with(rule, paired).contains(name), "{rule:?}: {}", with(rule, paired));
        }
        let mut without = compared(&["walk"]);
        without.others[0].metrics.iter_mut().for_each(|metric| metric.p_holm = None);
        assert!(comparison_text(&without, false).contains("p: none, because there are too few runs"));
    }

    #[test]
    fn names_cannot_break_the_markdown() {
        let text = comparison_markdown(&compared(&["a|b", "<img>@all"])).unwrap();
        assert!(text.contains("&#124;") && !text.contains("<img>") && !text.contains("@all"), "{text}");
        assert!(text.contains("my\\_change against main") && text.contains("**worse**"), "{text}");
        for line in text.lines().filter(|line| line.starts_with('|')) {
            assert_eq!(line.matches('|').count(), 8, "{line}");
        }
    }
}
