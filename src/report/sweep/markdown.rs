//! The same as text: Markdown, for a repository.

use std::fmt::Write;

use super::analysis::{CostMeasure, Effect, cheapest_within, effects, pareto_front};
use super::figures::{labelled, maps};
use super::input::{SweepPageInput, SweepPoint};
use super::page::{choice, three_digits};
use super::shown;
use crate::report::GENERATOR;
use crate::report::displayed::{between, number, symbol};

/// Settings that have a row.
const ROWS: usize = 60;
/// Failed cells that have a line.
const FAILURES: usize = 20;

/// The findings of a sweep as Markdown; `command` is what made them.
pub fn sweep_markdown(input: &SweepPageInput, command: &str) -> String {
    let mut text = format!("<!-- {GENERATOR} -->\n# {}\n\n", input.title);
    if !input.description.is_empty() {
        text.push_str(&format!("{}\n\n", input.description));
    }
    text.push_str(&format!("    {command}\n\n"));
    // the command stands above
    for (name, value) in input.facts.iter().filter(|(name, _)| name != "command") {
        writeln!(text, "- {name}: {value}").ok();
    }
    text.push_str("\n## What to choose\n\n");
    for choice in [CostMeasure::Evaluations, CostMeasure::Processor].iter().filter_map(|cost| choice(input, *cost)) {
        writeln!(text, "- {choice}").ok();
    }
    text.push_str(
        "\nThe interval of a difference is Welch's over the seeds of both settings, which are not paired. The best of many \
         settings looks better than it is.\n",
    );
    if input.every.is_some() {
        writeln!(text, "\n{}", input.averages()).ok();
    }
    heat_maps(input, &mut text);
    matters(input, &mut text);
    failures(input, &mut text);
    table(input, &mut text);
    text
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
        "\n## What matters\n\nShare of the variance of the settings' means; of two axes beyond the sum of both.\n\n",
    );
    text.push_str("| axis | range | share | mean by value |\n|---|---:|---:|---|\n");
    let unit = input.objective.unit;
    let row = |effect: &Effect| {
        let axes: Vec<&str> = effect.axes.iter().map(|axis| axes[*axis].as_str()).collect();
        let means: Vec<String> =
            effect.means.iter().map(|(value, mean)| format!("{value}: {}", number(*mean, unit))).collect();
        format!(
            "| {} | {} {} | {:.1} % | {} |\n",
            axes.join(" x "),
            number(effect.range, unit),
            symbol(unit),
            100.0 * effect.share,
            shown::means(&means, ", ")
        )
    };
    single.iter().chain(&pairs).for_each(|effect| text.push_str(&row(effect)));
}

fn failures(input: &SweepPageInput, text: &mut String) {
    let count = |state: &str| input.settings.iter().flat_map(|p| &p.cells).filter(|cell| cell.state == state).count();
    let all: usize = input.settings.iter().map(|p| p.cells.len()).sum();
    writeln!(
        text,
        "\n## Failures\n\nThe tracker lost the body in {} of {all} cells (their errors count), {} cannot be run, {} have no \
         result.",
        count("diverged"),
        count("failed"),
        count("missing")
    )
    .ok();
    let all = input.settings.iter().flat_map(|point| point.cells.iter().map(move |cell| (point, cell)));
    for (point, cell) in all.filter(|(_, cell)| cell.state == "failed").take(FAILURES) {
        let why = cell.error.as_deref().and_then(|error| error.lines().next()).unwrap_or("unknown");
        writeln!(text, "\n- cell {} ({}, seed {}): {why}", cell.index, point.words, cell.seed).ok();
    }
}

fn table(input: &SweepPageInput, text: &mut String) {
    let front = pareto_front(&input.settings, CostMeasure::Evaluations, input.objective);
    let best =
        cheapest_within(&input.settings, CostMeasure::Evaluations, input.objective, 0.0).map(|choice| choice.best);
    let unit = input.objective.unit;
    let shown: Vec<usize> = match input.settings.len() <= ROWS {
        true => (0..input.settings.len()).collect(),
        false => front.clone(),
    };
    let title = if input.settings.len() <= ROWS { "All settings" } else { "The Pareto front by evaluations" };
    writeln!(text, "\n## {title}\n\nThe best in bold; `*` is on the Pareto front by evaluations.\n").ok();
    writeln!(
        text,
        "| {} | {} | 95 % interval | evaluations a frame | processor ms a frame | lost | |",
        input.axes.join(" | "),
        labelled(input)
    )
    .ok();
    writeln!(text, "|{}---:|---:|---:|---:|---:|---|", "---|".repeat(input.axes.len().max(1))).ok();
    for at in shown {
        let point: &SweepPoint = &input.settings[at];
        let mean = point.mean.map_or("-".to_owned(), |mean| number(mean, unit));
        let mean = if best == Some(at) { format!("**{mean}**") } else { mean };
        let cost = |cost: CostMeasure| cost.of_setting(point).map_or("-".to_owned(), three_digits);
        writeln!(
            text,
            "| {} | {mean} | {} | {} | {} | {} of {} | {} |",
            point.labels.join(" | "),
            point.interval.map_or("-".to_owned(), |i| between(i.low, i.high, unit)),
            cost(CostMeasure::Evaluations),
            cost(CostMeasure::Processor),
            point.diverged(),
            point.cells.len(),
            if front.contains(&at) { "*" } else { "" },
        )
        .ok();
    }
}
