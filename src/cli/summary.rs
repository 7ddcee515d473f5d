//! A run's numbers as a table for people.

use crate::evaluation::{METRICS, MetricSummary};
use crate::experiment::{Comparison, RunRecord};

/// Metrics that the table shows; `--json` and the report have all.
const SHOWN: [&str; 9] = [
    "humaneva_mm",
    "mpjpe_mm",
    "mpjpe_root_mm",
    "pa_mpjpe_mm",
    "body_orientation_deg",
    "silhouette_iou",
    "pck150",
    "track_loss",
    "energy_gap",
];

/// The summary table: mean, 95 % interval, and the frozen floor beside.
pub(super) fn table(record: &RunRecord) -> String {
    let model = if record.matched { "matched model" } else { "mismatched model" };
    let seeds = record.seeds.len();
    let plural = if seeds == 1 { "" } else { "s" };
    let mut lines = vec![
        format!(
            "{}: {} on {} frames at {} Hz, {seeds} seed{plural}, {model}",
            record.scenario, record.tracker, record.frames, record.frames_per_second
        ),
        String::new(),
        format!("  {:<34} {:>9}  {:^19}  {:>9}", "", "mean", "95 % interval", "frozen"),
    ];
    for metric in METRICS.iter().filter(|metric| SHOWN.contains(&metric.name)) {
        if let Some(summary) = record.summary.metrics.get(metric.name) {
            let title = match metric.unit.symbol() {
                "" => metric.title.to_owned(),
                symbol => format!("{} ({symbol})", metric.title),
            };
            let frozen = record.frozen.get(metric.name).map_or_else(|| "-".to_owned(), |value| number(*value));
            lines.push(format!("  {title:<34} {:>9}  {:^19}  {frozen:>9}", number(summary.mean), interval(summary)));
        }
    }
    lines.push(String::new());
    if let Some(error) = record.summary.metrics.get("humaneva_mm") {
        lines.push(format!("  protocol: {}", error.protocol));
    }
    if !record.learned_from.is_empty() {
        lines.push(format!("  learned from: {}", record.learned_from.join("; ")));
    }
    lines.push(format!("  {}", record.verdict.line));
    lines.extend(record.verdict.cause.as_ref().map(|cause| format!("  {cause}")));
    lines.join("\n")
}

/// Several methods: mean error, its interval, and the frames lost.
pub(super) fn methods(comparison: &Comparison) -> String {
    let model = if comparison.matched { "matched model" } else { "mismatched model" };
    let (frames, rate, seeds) = (comparison.frames, comparison.frames_per_second, comparison.seeds.len());
    let mut lines = vec![
        format!("{}: {frames} frames at {rate} Hz, {seeds} seed(s), {model}", comparison.scenario),
        String::new(),
        format!("  {:<28} {:>9}  {:^19}  {:>11}", "HumanEva error, mm", "mean", "95 % interval", "frames lost"),
    ];
    for (name, method) in &comparison.methods {
        if let Some(error) = method.summary.metrics.get("humaneva_mm") {
            let lost = method.summary.metrics.get("track_loss").map_or_else(|| "-".to_owned(), |m| number(m.mean));
            let name = if method.given_roots { format!("{name} (oracle roots)") } else { name.clone() };
            lines.push(format!("  {name:<28} {:>9}  {:^19}  {lost:>11}", number(error.mean), interval(error)));
        }
    }
    let mut learned: Vec<&str> =
        comparison.methods.values().flat_map(|m| &m.learned_from).map(String::as_str).collect();
    learned.sort_unstable();
    learned.dedup();
    if !learned.is_empty() {
        lines.extend([String::new(), format!("  learned from: {}", learned.join("; "))]);
    }
    lines.join("\n")
}

fn interval(summary: &MetricSummary) -> String {
    summary.ci95.map_or_else(|| "-".to_owned(), |i| format!("{} to {}", number(i.low), number(i.high)))
}

/// Four figures at most.
fn number(value: f64) -> String {
    match value.abs() {
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        v if v >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_the_figures_that_matter() {
        assert_eq!([1234.5, 56.78, -3.456, 0.1234].map(number), ["1234", "56.8", "-3.46", "0.123"]);
    }

    #[test]
    fn every_metric_of_the_table_exists() {
        for name in SHOWN {
            assert!(crate::evaluation::find_metric(name).is_some(), "{name}");
        }
    }
}
