//! Sweeps in words: costs, rankings, failures.

use super::super::output::counted;
use super::super::summary::number;
use super::super::volume::duration;
use crate::evaluation::FEWEST_RUNS;
use crate::experiment::sweep::{SettingSummary, SweepCost, SweepSummary};

/// Failed cells that are told.
const FAILURES: usize = 5;

pub(super) fn cost_in_words(cost: &SweepCost) -> String {
    let learning = match cost.models_to_learn {
        0 => String::new(),
        _ => ", plus the time to learn motion models".to_owned(),
    };
    let [least, most] = cost.cell_s;
    format!(
        "{} is valid: {} ({} x {}) on {}\n  cost     a cell takes {} to {} on one core (measured on {})\n  \
         cost     all: about {} of one core, {} with {} at a time{learning}",
        cost.name,
        counted(cost.cells, "cell"),
        counted(cost.settings, "setting"),
        counted(cost.seeds, "seed"),
        counted(cost.sets, "set"),
        duration(least),
        duration(most),
        counted(cost.sampled, "setting"),
        duration(cost.core_s),
        duration(cost.run_s),
        counted(cost.jobs, "cell"),
    )
}

/// The best settings, the best first.
pub(super) fn ranking(summary: &SweepSummary, most: usize) -> String {
    let ranked = summary.ranked();
    let width = ranked.iter().take(most).map(|setting| setting.words.chars().count()).max().unwrap_or(0).max(8);
    let title = summary.metric().map_or(summary.objective.as_str(), |metric| metric.name);
    let mut lines = vec![format!(
        "  {:<width$}  {title:>14}   {:^20}  {:>11}  {:>12}  {:>4}",
        "setting", "95 % interval", "evaluations", "processor ms", "lost"
    )];
    lines.extend(ranked.iter().take(most).map(|setting| row(setting, width)));
    if ranked.len() > most {
        lines.push(format!("  and {} more", counted(ranked.len() - most, "setting")));
    }
    lines.push(format!(
        "\n  means over {}{}; evaluations and processor time are those of a frame; lost: seeds that lost the body",
        counted(summary.seeds.len(), "seed"),
        if summary.seeds.len() < FEWEST_RUNS { ", no interval below 3" } else { "" }
    ));
    lines.join("\n")
}

fn row(setting: &SettingSummary, width: usize) -> String {
    let interval = setting.ci95.map_or("-".to_owned(), |i| format!("{} to {}", number(i.low), number(i.high)));
    let value = |value: Option<f64>| value.map_or("-".to_owned(), number);
    format!(
        "  {:<width$}  {:>14}   {:^20}  {:>11}  {:>12}  {:>4}",
        setting.words,
        value(setting.mean),
        interval,
        value(setting.evaluations_per_frame),
        value(setting.processor_ms_per_frame),
        setting.diverged,
    )
}

pub(super) fn failures_in_words(failed: &[(usize, String)]) -> String {
    if failed.is_empty() {
        return String::new();
    }
    let mut lines = vec![format!("\n\n  {} cannot be run:", counted(failed.len(), "cell"))];
    lines.extend(failed.iter().take(FAILURES).map(|(index, error)| format!("  cell {index}: {error}")));
    if failed.len() > FAILURES {
        lines.push(format!("  and {} more", failed.len() - FAILURES));
    }
    lines.join("\n")
}
