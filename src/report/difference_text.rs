//! Differences of runs as text: for a terminal, and as Markdown for a pull request.

use super::difference_rows::{
    DifferenceRow, clip_rows, describe_constants, describe_lost, how, joint_rows, metric_rows, pairing, scope, seeds_of,
};
use super::difference_sentence::describe_side;
use crate::evaluation::{AgainstBase, RunComparison};

/// A table for a terminal with the main metrics, or with `all` also the other metrics and markers.
pub fn comparison_text(comparison: &RunComparison, all: bool) -> String {
    let base = &comparison.base;
    let mut lines = misread(comparison);
    lines.push(format!("base: {} ({}), {}", base.name, base.trackers.join(", "), seeds_of(comparison)));
    for side in &comparison.others {
        lines.push(String::new());
        lines.push(format!(
            "{} ({}) against {}, {}",
            side.side.name,
            side.side.trackers.join(", "),
            base.name,
            pairing(side)
        ));
        lines.push(format!("  {}", describe_side(side, &base.name)));
        lines.extend(table("metric", &metric_rows(side, all)));
        lines.extend(table("HumanEva 3-D error by clip, mm", &clip_rows(side)));
        if all {
            lines.extend(table("error by marker, mm", &joint_rows(side)));
            lines.extend(describe_constants(side).map(|words| format!("  {words}")));
        }
        lines.extend(describe_lost(&side.lost_tracks).map(|line| format!("  {line}")));
        lines.extend(left_out(side).into_iter().map(|line| format!("  left out: {line}")));
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

/// Clips, metrics and runs that were left out.
fn left_out(side: &AgainstBase) -> Vec<String> {
    let mut all = side.skipped.clone();
    for metric in &side.metrics {
        all.extend(metric.skipped.iter().map(|skipped| format!("{}: {skipped}", metric.metric)));
    }
    all
}

/// The same as Markdown, with the long part collapsed.
pub fn comparison_markdown(comparison: &RunComparison) -> String {
    let base = &comparison.base;
    let mut text: String = misread(comparison).iter().map(|line| format!("**{}**\n\n", cell(line))).collect();
    let how = how(comparison);
    for side in &comparison.others {
        text.push_str(&format!("### {} against {}\n\n", cell(&side.side.name), cell(&base.name)));
        text.push_str(&format!("**{}**\n\n", cell(&describe_side(side, &base.name))));
        text.push_str(&format!("{}; {}.\n\n", pairing(side), cell(&seeds_of(comparison))));
        text.push_str(&markdown_table("metric", &metric_rows(side, false)));
        text.push_str(&markdown_table("HumanEva 3-D error by clip, mm", &clip_rows(side)));
        if let Some(lost) = describe_lost(&side.lost_tracks) {
            text.push_str(&format!("{}{}.\n\n", lost[..1].to_uppercase(), &lost[1..]));
        }
        text.push_str(&format!("{}.\n\n", cell(&scope(side))));
        for line in left_out(side) {
            text.push_str(&format!("- left out: {}\n", cell(&line)));
        }
        let (all, joints) = (metric_rows(side, true), joint_rows(side));
        let constants = describe_constants(side).map(|words| format!("{}.\n\n", cell(&words))).unwrap_or_default();
        let more = [markdown_table("metric", &all), markdown_table("error by marker, mm", &joints), constants].concat();
        text.push_str(&format!(
            "\n<details><summary>All metrics and markers</summary>\n\n{more}\n{how}.\n\n</details>\n\n"
        ));
    }
    text
}

fn markdown_table(title: &str, rows: &[DifferenceRow]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mut text =
        format!("| {title} | base | other | difference | 95 % interval | p | |\n|---|--:|--:|--:|--:|--:|---|\n");
    for row in rows {
        let finding = if row.class.is_empty() { row.finding.to_owned() } else { format!("**{}**", row.finding) };
        let cells = [&row.title, &row.base, &row.other, &row.difference, &row.interval, &row.p, &finding];
        text.push_str(&format!("| {} |\n", cells.map(|text| cell(text)).join(" | ")));
    }
    text.push('\n');
    text
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
    use crate::evaluation::{DifferenceRule, MeasuredClip, MeasuredMetric, MeasuredRuns, Unit, compare_runs};
    use std::collections::BTreeMap;

    /// Five seeds of a metric.
    pub(in crate::report) fn millimetres(values: [f64; 5]) -> MeasuredMetric {
        MeasuredMetric {
            unit: Unit::Millimetre,
            protocol: "no alignment".to_owned(),
            per_seed: values.map(Some).to_vec(),
        }
    }

    /// A clip of nine frames with five seeds of these metrics.
    pub(in crate::report) fn measured_clip(metrics: BTreeMap<String, MeasuredMetric>) -> MeasuredClip {
        MeasuredClip {
            set_hash: "a".to_owned(),
            frames: 9,
            frames_per_second: 60.0,
            tracker: "frozen".to_owned(),
            scene_hash: None,
            settings: None,
            version: "0.1.0".to_owned(),
            seeds: (0..5).collect(),
            metrics,
            joints: BTreeMap::new(),
        }
    }

    pub(in crate::report) fn compared(clips: &[&str]) -> RunComparison {
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
        let line = text.lines().find(|line| line.contains("HumanEva 3-D error, mm")).unwrap();
        for part in ["30.4", "34.6", "+4.2", "3.9 to 4.5", "<0.001", "worse"] {
            assert!(line.contains(part), "{part}: {line}");
        }
        assert!(text.contains("paired by clip x seed") && !text.contains("by clip, mm"), "{text}");
        assert!(text.contains("intervals are over 5 seeds of one clip (walk, 0.1 s): they do not cover"), "{text}");
        assert!(comparison_text(&compared(&["walk", "jump"]), true).contains("by clip, mm"));
        assert!(comparison_text(&compared(&["walk"]), true).contains("left knee"));
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
            (
                DifferenceRule::Exact,
                true,
                "p: two-sided, the sign test on pairs where all differ by the same; adjusted",
            ),
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
        let text = comparison_markdown(&compared(&["a|b", "<img>@all"]));
        assert!(text.contains("&#124;") && !text.contains("<img>") && !text.contains("@all"), "{text}");
        assert!(text.contains("my\\_change against main") && text.contains("**worse**"), "{text}");
        for line in text.lines().filter(|line| line.starts_with('|')) {
            assert_eq!(line.matches('|').count(), 8, "{line}");
        }
    }
}
