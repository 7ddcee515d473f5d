//! The summary table of a run.

use super::output::counted;
use crate::measure::{Hint, RunRecord};
use crate::runs::{MethodComparison, MethodRecord};
use skiagraph_eval::{MAIN_METRICS, METRICS, MetricSummary, SegmentationQuality, find_metric};
use skiagraph_report::{aliases, describe_bodies, partial_share};

/// Whether a metric is in the table; `--json` and the report have all metrics. Coverage has a separate column.
fn is_shown(name: &str) -> bool {
    name != "coverage" && MAIN_METRICS.contains(&name)
}

fn joint_map_lines(hint: &Hint) -> Option<String> {
    let quoted = |text: &String| toml::Value::String(text.clone()).to_string();
    let line = |(theirs, ours): (&String, &String)| format!("{} = {}\n", quoted(theirs), quoted(ours));
    let lines: String = hint.joint_map.iter().map(line).collect();
    (!lines.is_empty()).then(|| format!("# joints.toml, for --joint-map joints.toml\n{lines}"))
}

/// A warning if the estimate may have been misread, then the summary table: mean, 95 % interval, coverage, and the
/// frozen tracker's value; worse values are marked. Unavailable metrics follow.
pub(super) fn table(record: &RunRecord) -> String {
    if record.observation.as_ref().is_some_and(|facts| facts.is_footage()) {
        return of_footage(record);
    }
    let bodies = describe_bodies(record.matched);
    let seeds = record.seeds.len();
    let plural = if seeds == 1 { "" } else { "s" };
    let mut lines: Vec<String> = Vec::new();
    lines.extend(record.hint.as_ref().map(|hint| format!("The estimate may have been misread: {}.\n", hint.text)));
    lines.extend(record.hint.as_ref().and_then(joint_map_lines));
    lines.extend([
        format!(
            "{}: {} on {} frames at {} Hz, {seeds} seed{plural}, {bodies}",
            record.scenario, record.tracker, record.frames, record.frames_per_second
        ),
        String::new(),
        format!("  {:<37} {:>9}   {:^20}  {:>8}  {:>9}", "", "mean", "95 % interval", "coverage", "frozen"),
    ]);
    let is_worse = |name: &str| record.verdict.worse_than_frozen.iter().any(|worse| worse == name);
    let same: Vec<(&str, &str)> =
        aliases(&record.summary).into_iter().filter(|(shown, alias)| is_shown(shown) && is_shown(alias)).collect();
    let is_alias = |name: &str| same.iter().any(|(_, alias)| *alias == name);
    for metric in METRICS.iter().filter(|metric| is_shown(metric.name) && !is_alias(metric.name)) {
        if let Some(summary) = record.summary.metrics.get(metric.name) {
            let title = match metric.unit.symbol() {
                "" => metric.title.to_owned(),
                symbol => format!("{} ({symbol})", metric.title),
            };
            let frozen = record.frozen.get(metric.name).map_or_else(|| "-".to_owned(), |value| number(*value));
            let (mean, coverage) = (number(summary.mean), coverage(summary.coverage));
            let mark = if is_worse(metric.name) { '▼' } else { ' ' };
            let interval = interval(summary, &record.summary.interval);
            lines.push(format!("  {title:<37} {mean:>9} {mark} {interval:^20}  {coverage:>8}  {frozen:>9}"));
        }
    }
    let title = |name: &str| find_metric(name).map_or_else(|| name.to_owned(), |metric| metric.title.to_owned());
    let equal = |(shown, alias): &(&str, &str)| format!("  {}: equal to {} in this run", title(alias), title(shown));
    lines.extend(same.iter().map(equal));
    let absent = MAIN_METRICS
        .iter()
        .filter(|name| is_shown(name))
        .filter_map(|name| Some((name, record.summary.absent.get(*name)?)));
    lines.extend(absent.map(|(name, needs)| format!("  no {name}: {needs}")));
    lines.push(String::new());
    lines.extend(record.read_as.as_ref().map(|read_as| format!("  {}", read_as.describe())));
    lines.extend(worse_legend(&record.verdict.worse_than_frozen));
    lines.push(format!("  {}", record.summary.interval));
    if let Some(error) = record.summary.metrics.get("humaneva_mm") {
        lines.push(format!("  protocol: {}", error.protocol));
    }
    if !record.learned_from.is_empty() {
        lines.push(format!("  learned from: {}", record.learned_from.join("; ")));
    }
    if let Some(SegmentationQuality { recall: Some(recall), precision: Some(precision), .. }) = record.segmentation {
        lines.push(format!("  observed silhouettes: recall {recall:.3}, precision {precision:.3}"));
    }
    lines.push(format!("  {}", record.verdict.line));
    lines.extend(record.verdict.preferred.as_ref().map(|preferred| format!("  {}", preferred.describe())));
    lines.join("\n")
}

/// The table of a run on a recording: how well it explains the images.
fn of_footage(record: &RunRecord) -> String {
    let seeds = counted(record.seeds.len(), "seed");
    let mut lines = vec![
        format!(
            "{}: {} on {} frames at {} Hz, {seeds}, a recording: how well the images are explained",
            record.scenario, record.tracker, record.frames, record.frames_per_second
        ),
        String::new(),
        format!("  {:<37} {:>9}   {:^20}  {:>9}", "", "mean", "95 % interval", "frozen"),
    ];
    for metric in METRICS {
        let Some(summary) = record.summary.metrics.get(metric.name) else { continue };
        let title = [metric.title, metric.unit.symbol()].join(" ");
        let frozen = record.frozen.get(metric.name).map_or_else(|| "-".to_owned(), |value| number(*value));
        let interval = interval(summary, &record.summary.interval);
        lines.push(format!("  {:<37} {:>9}   {interval:^20}  {frozen:>9}", title.trim(), number(summary.mean)));
    }
    let overlaps = record.summary.per_camera.iter().filter_map(|own| Some((&own.camera, own.overlap?)));
    lines.extend(
        overlaps.map(|(camera, overlap)| format!("  {:<37} {:>9}", format!("overlap in {camera}"), number(overlap))),
    );
    let is_shown = |name: &str| {
        ["worst image", "far below", "left out", "measured through"].iter().any(|word| name.starts_with(word))
    };
    let facts = record.facts.iter().flat_map(|group| group.facts.iter().map(|fact| (group.title.as_str(), fact)));
    let shown = facts.filter(|(title, (name, _))| *title == "Reference" || is_shown(name)).map(|(_, fact)| fact);
    lines.push(String::new());
    lines.extend(shown.map(|(name, value)| format!("  {name}: {value}")));
    lines.join("\n")
}

/// The legend of the mark, with the metrics that are marked only in the report. A larger error of the acceleration
/// alone is not mentioned: small errors of position suffice for it.
fn worse_legend(worse: &[String]) -> Option<String> {
    let (marked, others): (Vec<&str>, Vec<&str>) = worse.iter().map(String::as_str).partition(|name| is_shown(name));
    match (marked.is_empty(), others.as_slice()) {
        (true, [] | ["acceleration_error_m_per_s2"]) => None,
        (true, _) => Some(format!("  worse than a tracker that never moves (frozen): {}", others.join(", "))),
        (false, []) => Some("  ▼ worse than a tracker that never moves (frozen)".to_owned()),
        (false, _) => Some(format!("  ▼ worse than a tracker that never moves (frozen); also {}", others.join(", "))),
    }
}

/// The table of several methods: mean error with its interval, and lost limbs and frames.
pub(super) fn methods(comparison: &MethodComparison) -> String {
    let bodies = describe_bodies(comparison.matched);
    let (frames, rate) = (comparison.frames, comparison.frames_per_second);
    let seeds = counted(comparison.seeds.len(), "seed");
    let mut lines = vec![
        format!("{}: {frames} frames at {rate} Hz, {seeds}, {bodies}", comparison.scenario),
        String::new(),
        format!(
            "  {:<28} {:>9}   {:^20}  {:>8}  {:>15}  {:>14}",
            "HumanEva error, mm", "mean", "95 % interval", "coverage", "limb >150 mm", "body lost"
        ),
    ];
    let floor = |method: &MethodRecord| method.frozen.get("humaneva_mm").copied().unwrap_or(f64::INFINITY);
    let legend = comparison.methods.values().next().map_or("", |method| method.summary.interval.as_str());
    for (name, method) in &comparison.methods {
        if let Some(error) = method.summary.metrics.get("humaneva_mm") {
            let share =
                |name: &str| method.summary.metrics.get(name).map_or_else(|| "-".to_owned(), |m| number(m.mean));
            let (limb, lost) = (share("lost_limb"), share("track_loss"));
            let name = if method.given_roots { format!("{name} (oracle roots)") } else { name.clone() };
            let (mean, mark) = (number(error.mean), if error.mean > floor(method) { '▼' } else { ' ' });
            let (interval, covered) = (interval(error, legend), coverage(error.coverage));
            lines.push(format!("  {name:<28} {mean:>9} {mark} {interval:^20}  {covered:>8}  {limb:>15}  {lost:>14}"));
        }
    }
    lines.push(String::new());
    if comparison.methods.values().any(|m| m.summary.metrics.get("humaneva_mm").is_some_and(|e| e.mean > floor(m))) {
        lines.push("  ▼ worse than a tracker that never moves".to_owned());
    }
    let partial = comparison.methods.iter().filter(|(_, method)| partial_share(&method.summary).is_some());
    let partial: Vec<&str> = partial.map(|(name, _)| name.as_str()).collect();
    if !partial.is_empty() {
        lines.push(format!("  frames without an estimate count in no error; many have none in {}", partial.join(", ")));
    }
    if !legend.is_empty() {
        lines.push(format!("  {legend}"));
    }
    let mut learned: Vec<&str> =
        comparison.methods.values().flat_map(|m| &m.learned_from).map(String::as_str).collect();
    learned.sort_unstable();
    learned.dedup();
    if !learned.is_empty() {
        lines.push(format!("  learned from: {}", learned.join("; ")));
    }
    lines.join("\n")
}

/// The interval, or why there is none.
fn interval(summary: &MetricSummary, legend: &str) -> String {
    let ends = summary.ci95.map(|ends| format!("{} to {}", number(ends.low), number(ends.high)));
    ends.unwrap_or_else(|| without_interval(&summary.interval, legend).to_owned())
}

/// Why there is no interval; a dash if the legend below the table says it.
fn without_interval<'a>(why: &'a str, legend: &str) -> &'a str {
    if legend.to_lowercase().starts_with(&why.to_lowercase()) { "-" } else { why }
}

/// What coverage below 100 % means for an error beside it.
pub(super) fn partly_covered(share: f64) -> String {
    format!("coverage {}: errors are those of the markers with an estimate only", coverage(share))
}

/// A share in percent, rounded down: 100 % means exactly all.
fn coverage(share: f64) -> String {
    format!("{:.1} %", (1000.0 * share).floor() / 10.0)
}

/// At most four significant digits; zero has no sign.
pub(super) fn number(value: f64) -> String {
    let text = match value.abs() {
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        v if v >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    };
    if text == "-0.000" { text.trim_start_matches('-').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_the_figures_that_matter() {
        assert_eq!([1234.5, 56.78, -3.456, 0.1234].map(number), ["1234", "56.8", "-3.46", "0.123"]);
        assert_eq!([-0.0, -0.0004, 0.0].map(number), ["0.000"; 3], "zero has no sign");
    }

    #[test]
    fn a_coverage_below_all_is_not_rounded_to_all() {
        assert_eq!([1.0, 0.9999, 0.5, 0.0].map(coverage), ["100.0 %", "99.9 %", "50.0 %", "0.0 %"]);
    }

    #[test]
    fn a_missing_interval_is_explained_once() {
        let legend = "A clip with 1 seed: no interval: an interval needs 3 seeds or more";
        assert_eq!(without_interval("a clip with 1 seed: no interval", legend), "-");
        assert_eq!(without_interval("0 of 5 seeds: no interval", legend), "0 of 5 seeds: no interval");
    }

    #[test]
    fn the_mark_has_a_legend_only_if_a_row_is_marked() {
        let legend = |names: &[&str]| worse_legend(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
        let (error, acceleration) = ("humaneva_mm", "acceleration_error_m_per_s2");
        assert_eq!([legend(&[]), legend(&[acceleration])], [None, None]);
        let marked = "  ▼ worse than a tracker that never moves (frozen)";
        assert_eq!(legend(&[error]).as_deref(), Some(marked));
        assert_eq!(legend(&[error, acceleration]), Some(format!("{marked}; also {acceleration}")));
        let other = "velocity_error_mm_per_s";
        assert_eq!(legend(&[other]), Some(format!("  worse than a tracker that never moves (frozen): {other}")));
    }

    #[test]
    fn every_metric_of_the_table_exists() {
        for name in MAIN_METRICS {
            assert!(skiagraph_eval::find_metric(name).is_some(), "{name}");
        }
    }
}
