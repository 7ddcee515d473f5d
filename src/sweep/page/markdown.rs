//! The page of a sweep as Markdown, for a repository.

use std::fmt::Write;

use super::analysis::{CostMeasure, effects, pareto_front};
use super::figures::{labelled, maps};
use super::html::{choice, effect_row, interval_title, table};
use super::input::SweepPageInput;
use crate::report::GENERATOR;
use crate::sweep::results::Status;

/// Maximum number of settings with a row.
const ROWS: usize = 60;
/// Maximum number of failed cells with a line.
const FAILURES: usize = 20;

/// The findings of a sweep as Markdown.
pub fn sweep_markdown(input: &SweepPageInput) -> String {
    let mut text = format!("<!-- {GENERATOR} -->\n# {}\n\n", input.summary.name);
    if !input.description.is_empty() {
        text.push_str(&format!("{}\n\n", input.description));
    }
    text.push_str("## What to choose\n\n");
    for choice in CostMeasure::ALL.iter().filter_map(|cost| choice(input, *cost)) {
        writeln!(text, "- {choice}").ok();
    }
    input.summary.remarks.iter().for_each(|remark| text.push_str(&format!("- {remark}\n")));
    text.push('\n');
    if input.summary.has_intervals() {
        text.push_str(
            "The interval of a difference is Welch's over the seeds of both settings, which are not paired. ",
        );
    }
    text.push_str("The best of many settings looks better than it is.\n");
    if input.every.is_some() {
        writeln!(text, "\n{}", input.averages()).ok();
    }
    heat_maps(input, &mut text);
    matters(input, &mut text);
    failures(input, &mut text);
    settings(input, &mut text);
    method(input, &mut text);
    text
}

fn method(input: &SweepPageInput, text: &mut String) {
    writeln!(text, "\n## Method\n\n    {}\n", input.command).ok();
    // the command has its own line
    for (name, value) in input.facts.iter().filter(|(name, _)| name != "command") {
        writeln!(text, "- {name}: {value}").ok();
    }
}

fn heat_maps(input: &SweepPageInput, text: &mut String) {
    let (axes, maps, averaged) = maps(input);
    let Some([down, across]) = axes else { return };
    writeln!(text, "\n## {} (down) by {} (across)\n", input.axes[down], input.axes[across]).ok();
    let aside = if averaged { ", averaged over all other axes" } else { "" };
    writeln!(text, "Mean {}{aside}.", labelled(input)).ok();
    for map in maps {
        let title = if map.title.is_empty() { String::new() } else { format!("\n{}\n", map.title) };
        writeln!(text, "{title}\n| | {} |", map.columns.join(" | ")).ok();
        writeln!(text, "|---|{}", "---:|".repeat(map.columns.len())).ok();
        for (name, cells) in &map.rows {
            let cells: Vec<&str> =
                cells.iter().map(|cell| if cell.text.is_empty() { "-" } else { &cell.text }).collect();
            writeln!(text, "| {name} | {} |", cells.join(" | ")).ok();
        }
    }
}

fn matters(input: &SweepPageInput, text: &mut String) {
    let (axes, every) = input.unaveraged();
    let Some((single, pairs)) = effects(every, axes.len()) else { return };
    text.push_str(
        "\n## What matters\n\nShare of the variance of the settings' means; for two axes, what exceeds the sum of both.\n\n",
    );
    text.push_str("| axis | range | share | mean by value |\n|---|---:|---:|---|\n");
    for effect in single.iter().chain(&pairs) {
        let row = effect_row(input, &axes, effect, ", ");
        writeln!(text, "| {} | {} | {} | {} |", row.axes, row.range, row.share, row.means).ok();
    }
}

fn failures(input: &SweepPageInput, text: &mut String) {
    let count = |status| input.summary.all_cells().filter(|(_, cell)| cell.status == status).count();
    writeln!(
        text,
        "\n## Failures\n\n{} of {} cells are graded lost (included in the means), {} cannot be run, {} \
         have no result.",
        count(Some(Status::Diverged)),
        input.summary.all_cells().count(),
        count(Some(Status::Failed)),
        count(None)
    )
    .ok();
    let failed = input.summary.all_cells().filter(|(_, cell)| cell.status == Some(Status::Failed));
    for (setting, cell) in failed.take(FAILURES) {
        let why = cell.error.as_deref().and_then(|error| error.lines().next()).unwrap_or("unknown");
        writeln!(text, "\n- cell {} ({}, seed {}): {why}", cell.index, input.words(setting), cell.seed).ok();
    }
}

fn settings(input: &SweepPageInput, text: &mut String) {
    let are_all = input.settings().len() <= ROWS;
    let shown = if are_all {
        (0..input.settings().len()).collect()
    } else {
        pareto_front(input.settings(), CostMeasure::Evaluations, input.objective)
    };
    let title = if are_all { "All settings" } else { "The Pareto front by evaluations" };
    writeln!(text, "\n## {title}\n\nThe best is in bold; `*` marks the Pareto front by evaluations.\n").ok();
    writeln!(
        text,
        "| {} | {} | {} | evaluations a frame | processor ms a frame | lost | |",
        input.axes.join(" | "),
        labelled(input),
        interval_title(input)
    )
    .ok();
    writeln!(text, "|{}---:|---:|---:|---:|---:|---|", "---|".repeat(input.axes.len().max(1))).ok();
    for (at, row) in shown.iter().zip(table(input, &shown)) {
        let mean = if row.best { format!("**{}**", row.mean) } else { row.mean };
        writeln!(
            text,
            "| {} | {mean} | {} | {} | {} | {} of {} | {} |",
            row.labels.join(" | "),
            row.interval,
            row.evaluations,
            row.processor,
            row.diverged,
            input.settings()[*at].cells.len(),
            if row.front { "*" } else { "" },
        )
        .ok();
    }
}
