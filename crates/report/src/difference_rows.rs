//! Differences of two sides as rows of text, for terminals, Markdown and pages.

use serde::Serialize;

use super::displayed::{between_to, number, number_to, signed_to, symbol};
use skiagraph_eval::{
    AgainstBase, ComparedMetric, Difference, DifferenceRule, Finding, IntervalUnit, LostTracks, MAIN_METRICS, Rate,
    RunComparison, Unit, find_metric,
};

/// One metric, clip or joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct DifferenceRow {
    pub(super) title: String,
    pub(super) name: String,
    /// What a metric says; empty for a clip or joint.
    pub(super) meaning: &'static str,
    pub(super) base: String,
    pub(super) other: String,
    pub(super) difference: String,
    pub(super) interval: String,
    pub(super) p: String,
    pub(super) finding: &'static str,
    /// `better`, `worse` or nothing.
    pub(super) class: &'static str,
    pub(super) coverage: String,
    /// Details: rule, protocol and omissions.
    pub(super) notes: String,
    pub(super) bar: Option<IntervalBar>,
    pub(super) is_main: bool,
}

/// Positions of the difference and its interval, in percent of a width whose middle is 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct IntervalBar {
    low: f64,
    width: f64,
    at: f64,
}

impl IntervalBar {
    fn from_difference(difference: &Difference) -> Option<Self> {
        let ends = difference.ci95?;
        let scale = 1.1 * ends.low.abs().max(ends.high.abs());
        let place = |value: f64| 50.0 + 50.0 * value / scale;
        let low = place(ends.low);
        (scale > 0.0).then(|| Self { low, width: place(ends.high) - low, at: place(difference.difference) })
    }
}

impl DifferenceRow {
    pub(super) fn from_metric(metric: &ComparedMetric) -> Self {
        let known = find_metric(&metric.metric);
        let title = known.map_or(metric.metric.as_str(), |known| known.title);
        let unit = symbol(metric.unit);
        let title = if unit.is_empty() { title.to_owned() } else { format!("{title}, {unit}") };
        let [base, other] = metric.coverage.map(|share| share.map_or_else(|| "-".to_owned(), percent));
        let mut notes = vec![format!("{}.", metric.difference), format!("{}.", metric.protocol)];
        notes.extend((!metric.also.is_empty()).then(|| format!("Equal in every run: {}.", metric.also.join(", "))));
        notes.extend(metric.skipped.iter().map(|skipped| format!("{skipped}.")));
        Self {
            meaning: known.map_or("", |known| known.meaning),
            p: metric.p_holm.map(describe_p).unwrap_or_default(),
            finding: describe_finding(metric.finding),
            class: class(metric.finding),
            coverage: if base == other { base } else { format!("{base} → {other}") },
            notes: notes.join(" "),
            is_main: MAIN_METRICS.contains(&metric.metric.as_str()),
            ..Self::plain(title, &metric.metric, &metric.difference, metric.unit)
        }
    }

    /// The row of a clip or a joint, without a test.
    pub(super) fn plain(title: String, name: &str, difference: &Difference, unit: Unit) -> Self {
        Self {
            title,
            name: name.to_owned(),
            meaning: "",
            base: number(difference.base, unit),
            other: number(difference.other, unit),
            difference: signed_to(difference.difference, unit, difference.difference),
            interval: match (difference.ci95, difference.rule) {
                (Some(ends), _) => between_to(ends.low, ends.high, unit, difference.difference),
                (None, DifferenceRule::Exact) => "exact".to_owned(),
                (None, _) => format!("too few {}", difference.over),
            },
            p: String::new(),
            finding: "",
            class: "",
            coverage: String::new(),
            notes: String::new(),
            bar: IntervalBar::from_difference(difference),
            is_main: false,
        }
    }
}

/// A side against the base, as text.
#[derive(Serialize)]
pub(super) struct DescribedSide<'a> {
    pub(super) name: &'a str,
    pub(super) trackers: String,
    pub(super) sentence: Option<String>,
    pub(super) pairing: &'static str,
    pub(super) scope: String,
    pub(super) lost: Option<String>,
    /// Clips, metrics and runs that were left out.
    pub(super) left_out: Vec<String>,
    pub(super) metrics: Vec<DifferenceRow>,
    /// HumanEva's error by clip; empty for a single clip.
    pub(super) clips: Vec<DifferenceRow>,
    pub(super) joints: Vec<DifferenceRow>,
    /// The actor's own values that are equal on both sides.
    pub(super) constants: Vec<DifferenceRow>,
}

impl<'a> DescribedSide<'a> {
    pub(super) fn new(side: &'a AgainstBase, base: &str) -> Self {
        let mut left_out = side.skipped.clone();
        for metric in &side.metrics {
            left_out.extend(metric.skipped.iter().map(|skipped| format!("{}: {skipped}", metric.metric)));
        }
        // values of the actor, equal on both sides
        let is_constant =
            |metric: &&ComparedMetric| metric.metric.starts_with("truth_") && metric.finding == Finding::Same;
        let (constants, metrics): (Vec<_>, Vec<_>) = side.metrics.iter().partition(is_constant);
        let rows = |metrics: Vec<&ComparedMetric>| metrics.into_iter().map(DifferenceRow::from_metric).collect();
        Self {
            name: &side.side.name,
            trackers: side.side.trackers.join(", "),
            sentence: describe_side(side, base),
            pairing: pairing(side),
            scope: scope(side),
            lost: describe_lost(&side.lost_tracks),
            left_out,
            metrics: rows(metrics),
            clips: clip_rows(side),
            joints: joint_rows(side),
            constants: rows(constants),
        }
    }
}

/// One sentence of fixed form on the first metric; `None` if the sides have none in common.
fn describe_side(side: &AgainstBase, base: &str) -> Option<String> {
    let metric = side.metrics.first()?;
    let row = DifferenceRow::from_metric(metric);
    let DifferenceRow { title, base: of_base, other, difference, interval, finding, .. } = row;
    let name = &side.side.name;
    // a tracker that leaves hard frames out errs less in the others
    let coverage = match metric.coverage {
        [Some(covers), Some(other)] if covers < 1.0 || other < 1.0 => {
            format!("; coverage {name} {}, {base} {}", percent(other), percent(covers))
        }
        _ => String::new(),
    };
    let shown = match (metric.finding, metric.difference.ci95) {
        (Finding::Better | Finding::Worse, Some(ends)) => {
            let (unit, by) = (metric.unit, metric.difference.difference);
            let (low, high) = if by < 0.0 { (-ends.high, -ends.low) } else { (ends.low, ends.high) };
            format!("{finding} by {} ({} at 95 %)", number_to(by.abs(), unit, by), between_to(low, high, unit, by))
        }
        _ => format!("difference {difference} (95 %: {interval}): {finding}"),
    };
    Some(format!("{title}: {name} {other}, {base} {of_base}; {shown}{coverage}."))
}

/// Rows of HumanEva's error by clip; empty for a single clip.
fn clip_rows(side: &AgainstBase) -> Vec<DifferenceRow> {
    let of = |metric: &ComparedMetric| {
        let rows = metric.per_clip.iter();
        rows.map(|(clip, found)| DifferenceRow::plain(clip.clone(), clip, found, metric.unit)).collect()
    };
    let error = side.metrics.iter().find(|metric| metric.metric == "humaneva_mm");
    if side.clips.len() > 1 { error.map(of).unwrap_or_default() } else { Vec::new() }
}

fn joint_rows(side: &AgainstBase) -> Vec<DifferenceRow> {
    let row = |joint: &skiagraph_eval::JointDifference| {
        DifferenceRow::plain(joint.joint.replace('_', " "), &joint.joint, &joint.difference, Unit::Millimetre)
    };
    side.joints.iter().map(row).collect()
}

/// `1 of 10 runs (0 to 40 %) lost the body, against 0 of 10 (0 to 28 %): +10 % (-19 to 40 %)`
fn describe_lost(lost: &LostTracks) -> Option<String> {
    let rate = |rate: &Rate| {
        let ends = rate.ci95;
        format!("{} of {} ({} to {})", rate.count, rate.of, whole(ends.low), percent(ends.high))
    };
    let (base, other, difference) = (lost.base?, lost.other?, lost.difference?);
    let ends = difference.ci95;
    // zero has no minus
    let whole = |share: f64| (100.0 * share).round() + 0.0;
    Some(format!(
        "runs that lost the body: {}, base {}; difference {:+.0} % ({:+.0} to {:+.0} %)",
        rate(&other),
        rate(&base),
        whole(difference.difference),
        whole(ends.low),
        whole(ends.high)
    ))
}

/// `walk, seeds 0 to 9; jump, seeds 0 to 4`
pub(super) fn seeds_of(comparison: &RunComparison) -> String {
    let seeds = comparison.base.seeds.iter();
    seeds.map(|(clip, seeds)| format!("{clip}, seeds {seeds}")).collect::<Vec<_>>().join("; ")
}

fn pairing(side: &AgainstBase) -> &'static str {
    match (side.paired, side.unit) {
        (false, _) => "unpaired",
        (true, IntervalUnit::Seeds) => "paired by clip x seed",
        (true, IntervalUnit::Draws) => "paired by clip x noise draw",
        (true, IntervalUnit::Clips) => "paired by clip",
    }
}

/// Tests that p values come from: rule of the difference, whether the sides are paired, and the name.
const TESTS: [(DifferenceRule, bool, &str); 4] = [
    (DifferenceRule::PairedT, true, "Student's t test on pairs"),
    (DifferenceRule::Welch, false, "Welch's t test"),
    (DifferenceRule::Exact, true, "the sign test on pairs where all differ by the same"),
    (DifferenceRule::Exact, false, "the rank test where no run varies"),
];

/// How differences, intervals and p values are made; names the tests that the p values of this comparison come from.
pub(super) fn how(comparison: &RunComparison) -> String {
    let is_used = |(rule, paired, _): &(DifferenceRule, bool, &str)| {
        let sides = comparison.others.iter().filter(|side| side.paired == *paired);
        sides.flat_map(|side| &side.metrics).any(|m| m.p_holm.is_some() && m.difference.rule == *rule)
    };
    let tests: Vec<&str> = TESTS.iter().filter(|test| is_used(test)).map(|(.., name)| *name).collect();
    let p = if tests.is_empty() {
        "p: none, because there are too few runs".to_owned()
    } else {
        let tests = tests.join(", or ");
        format!("p: two-sided, {tests}; adjusted by Holm for the number of metrics; a finding needs p <= 0.05")
    };
    format!("Difference: other minus base, mean over clips of each clip's mean, with its 95 % interval. {p}")
}

/// What the intervals cover, as a sentence.
fn scope(side: &AgainstBase) -> String {
    let mut letters = side.scope.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

fn whole(share: f64) -> String {
    format!("{:.0}", 100.0 * share)
}

fn percent(share: f64) -> String {
    let shown = (1000.0 * share).floor() / 10.0;
    if shown.fract() == 0.0 { format!("{shown:.0} %") } else { format!("{shown:.1} %") }
}

fn describe_p(p: f64) -> String {
    match p {
        p if p < 0.001 => "<0.001".to_owned(),
        p if p >= 0.9995 => "1".to_owned(),
        p => format!("{p:.3}"),
    }
}

fn describe_finding(finding: Finding) -> &'static str {
    match finding {
        Finding::Better => "better",
        Finding::Worse => "worse",
        Finding::Differs => "differs",
        Finding::Same => "equal",
        Finding::NotShown => "no difference shown",
        Finding::TooFew => "too few runs to show",
    }
}

fn class(finding: Finding) -> &'static str {
    match finding {
        Finding::Better => "better",
        Finding::Worse => "worse",
        _ => "",
    }
}
