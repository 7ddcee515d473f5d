//! The result of a gate: as text, Markdown, JUnit XML and annotations for GitHub Actions.

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, Value};
use serde::Serialize;

use super::ReportError;
use super::difference_text::cell;
use super::displayed::{between_to, number, number_to, symbol};
use skiagraph_eval::{Check, CheckKind, GateOutcome, GateVerdict, IntervalUnit, MoreSeeds, find_metric};

/// A gate's outcome with the names of the run and the baseline.
#[derive(Clone, Copy, Debug)]
pub struct GateReport<'a> {
    /// The run.
    pub run: &'a str,
    /// The baseline.
    pub baseline: &'a str,
    /// The outcome.
    pub outcome: &'a GateOutcome,
    /// The verdict to report for an inconclusive check.
    pub inconclusive: GateVerdict,
}

impl GateReport<'_> {
    fn headline(&self) -> String {
        let relation = match self.outcome.verdict {
            GateVerdict::Pass => "is within the margins of",
            GateVerdict::Fail => "is worse than",
            GateVerdict::Inconclusive => "may be worse than",
        };
        format!("{}: {} {relation} the baseline {}", self.outcome.verdict.word(), self.run, self.baseline)
    }

    /// Warnings about runs whose estimate may have been misread.
    fn misread(&self) -> impl Iterator<Item = String> {
        self.outcome.misread.iter().map(|hint| format!("the estimate may have been misread: {hint}"))
    }

    fn reported(&self, verdict: GateVerdict) -> GateVerdict {
        if verdict == GateVerdict::Inconclusive { self.inconclusive } else { verdict }
    }

    /// One line per check, failing ones first; exact checks that pass share a line.
    pub fn text(&self) -> String {
        let mut lines: Vec<String> = self.misread().collect();
        lines.extend([self.headline(), String::new()]);
        let mut checks: Vec<&Check> = self.outcome.checks.iter().filter(|check| !is_quiet(check)).collect();
        checks.sort_by_key(|check| std::cmp::Reverse(check.verdict));
        let width = checks.iter().map(|check| name(check).chars().count()).max().unwrap_or(0);
        let line =
            |check: &&Check| format!("  {:<12}  {:<width$}  {}", check.verdict.word(), name(check), finding(check));
        lines.extend(checks.iter().map(line));
        let quiet = self.outcome.checks.iter().filter(|check| is_quiet(check)).count();
        if quiet > 0 {
            lines.push(format!(
                "  PASS          metrics compared exactly, such as those of the truth: {quiet} unchanged"
            ));
        }
        lines.push(format!("  {}", self.outcome.scope));
        lines.extend(self.outcome.notes.iter().map(|note| format!("  note: {note}")));
        lines.join("\n")
    }

    /// A table for a pull request.
    pub fn markdown(&self) -> String {
        let misread: String = self.misread().map(|line| format!("**{}**\n\n", cell(&line))).collect();
        let mut text = format!("{misread}### {}\n\n| | check | finding |\n|---|---|---|\n", cell(&self.headline()));
        for check in self.outcome.checks.iter().filter(|check| !is_quiet(check)) {
            let mark = match check.verdict {
                GateVerdict::Pass => "PASS".to_owned(),
                other => format!("**{}**", other.word()),
            };
            text.push_str(&format!("| {mark} | {} | {} |\n", cell(&name(check)), cell(&finding(check))));
        }
        text.push_str(&format!("\n{}\n", cell(&self.outcome.scope)));
        self.outcome.notes.iter().for_each(|note| text.push_str(&format!("\n- {}", cell(note))));
        text
    }

    /// `::error`, `::warning` and `::notice` lines, which GitHub Actions shows at the top of a run; an inconclusive
    /// check has the level of its reported verdict.
    pub fn annotations(&self) -> String {
        let mut lines = Vec::new();
        for check in &self.outcome.checks {
            let level = match (check.verdict, self.reported(check.verdict)) {
                (GateVerdict::Pass, _) => continue,
                (_, GateVerdict::Pass) => "notice",
                (_, GateVerdict::Fail) => "error",
                (_, GateVerdict::Inconclusive) => "warning",
            };
            let title = escaped(&format!("{} {}", check.verdict.word(), name(check)), true);
            lines.push(format!("::{level} title={title}::{}", escaped(&finding(check), false)));
        }
        for line in self.misread() {
            lines.insert(0, format!("::warning title=the estimate may have been misread::{}", escaped(&line, false)));
        }
        if lines.is_empty() {
            lines.push(format!("::notice title=skiagraph gate::{}", escaped(&self.headline(), false)));
        }
        lines.join("\n")
    }

    /// JUnit XML with one test case per check; an inconclusive check has its reported verdict.
    ///
    /// # Errors
    /// [`ReportError`] if it cannot be rendered.
    pub fn junit(&self) -> Result<String, ReportError> {
        #[derive(Serialize)]
        struct JunitCase {
            name: String,
            verdict: &'static str,
            is_open: bool,
            finding: String,
        }
        let case = |check: &Check| JunitCase {
            name: xml(&name(check)),
            verdict: self.reported(check.verdict).word(),
            is_open: check.verdict == GateVerdict::Inconclusive,
            finding: xml(&finding(check)),
        };
        let cases: Vec<JunitCase> = self.outcome.checks.iter().map(case).collect();
        let count =
            |verdict| self.outcome.checks.iter().filter(|check| self.reported(check.verdict) == verdict).count();
        let mut environment = Environment::new();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        environment.add_template("junit", JUNIT)?;
        Ok(environment.get_template("junit")?.render(Value::from(Serde(&serde_json::json!({
            "suite": xml(&format!("skiagraph gate: {} against {}", self.run, self.baseline)),
            "cases": cases,
            "misread": self.misread().map(|line| xml(&line)).collect::<Vec<_>>(),
            "failures": count(GateVerdict::Fail),
            "errors": count(GateVerdict::Inconclusive),
            "generator": super::GENERATOR,
        }))))?)
    }
}

const JUNIT: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<testsuites><!-- <meta name="generator" content="{{ generator }}"> -->
<testsuite name="{{ suite }}" tests="{{ cases|length }}" failures="{{ failures }}" errors="{{ errors }}" skipped="0">
{% for case in cases %}<testcase classname="skiagraph.gate" name="{{ case.name }}">{% if case.verdict == "FAIL" %}<failure {% if case.is_open %}type="inconclusive" {% endif %}message="{{ case.finding }}"/>{% elif case.verdict == "INCONCLUSIVE" %}<error type="inconclusive" message="{{ case.finding }}"/>{% else %}<system-out>{% if case.is_open %}inconclusive: {% endif %}{{ case.finding }}</system-out>{% endif %}</testcase>
{% endfor %}{% if misread %}<system-out>{{ misread|join(". ") }}</system-out>
{% endif %}</testsuite>
</testsuites>
"#;

/// Removes characters that XML 1.0 does not allow.
fn xml(text: &str) -> String {
    text.chars().filter(|c| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}')).collect()
}

/// Escapes text for workflow commands: `%` and line breaks, and in properties also `:` and `,`.
fn escaped(text: &str, is_property: bool) -> String {
    let mut safe = String::new();
    for character in text.chars() {
        match character {
            '%' | '\r' | '\n' => safe.push_str(&format!("%{:02X}", u32::from(character))),
            ':' | ',' if is_property => safe.push_str(&format!("%{:02X}", u32::from(character))),
            c if c.is_control() => safe.push(' '),
            c => safe.push(c),
        }
    }
    safe
}

fn is_quiet(check: &Check) -> bool {
    check.kind == CheckKind::Exact && check.verdict == GateVerdict::Pass
}

fn name(check: &Check) -> String {
    let kind = if check.kind == CheckKind::Exact { ", exactly" } else { "" };
    match &check.clip {
        Some(clip) => format!("{} in {clip}{kind}", check.metric),
        None => format!("{}{kind}", check.metric),
    }
}

/// `3.1 mm worse (1.2 to 5.0), margin 2.0 mm; 34.6 against 31.5; Student's t on 10 pairs of seeds`
fn finding(check: &Check) -> String {
    let (Some(worse), Some(found), Some(margin)) = (check.worse_by, &check.difference, check.margin) else {
        return check.reason.clone().unwrap_or_else(|| "unchanged".to_owned());
    };
    let unit = check.unit;
    let symbol = symbol(unit);
    let lower = find_metric(&check.metric).is_none_or(|metric| metric.is_worse(1.0, 0.0));
    let (word, shown) = if worse < 0.0 { ("better", -worse) } else { ("worse", worse) };
    let ends = match check.worse_by_ci95 {
        Some(ends) if worse < 0.0 => format!("{} {symbol} at 95 %", between_to(-ends.high, -ends.low, unit, worse)),
        Some(ends) => format!("{} {symbol} at 95 %", between_to(ends.low, ends.high, unit, worse)),
        None => "no run varies".to_owned(),
    };
    let mut text = format!(
        "{} {symbol} {word} ({ends}), margin {} {symbol}; {} against {}, {} is better; {}",
        number_to(shown, unit, worse),
        number(margin, unit),
        number(found.other, unit),
        number(found.base, unit),
        if lower { "lower" } else { "higher" },
        found
    );
    if let Some(more) = check.more_seeds {
        text.push_str(&match more {
            MoreSeeds::OfRun(1) => "; 1 more seed of the run would decide it".to_owned(),
            MoreSeeds::OfRun(more) => format!("; {more} more seeds of the run would decide it"),
            MoreSeeds::OfBoth(more) => match found.over {
                IntervalUnit::Seeds => format!("; {more} more seeds of run and baseline each would decide it"),
                unit => format!("; {more} more {unit}, measured for run and baseline, would decide it"),
            },
            MoreSeeds::TooMany => {
                format!("; the difference is close to the margin: more {} are unlikely to decide it", found.over)
            }
        });
    }
    text.extend(check.reason.iter().map(|reason| format!("; {reason}")));
    text
}

#[cfg(test)]
mod tests {
    use super::super::difference_text::tests::{measured_clip, millimetres};
    use super::*;
    use skiagraph_eval::{GateRules, MeasuredRuns, gate};
    use std::collections::BTreeMap;

    fn runs(errors: [f64; 5]) -> MeasuredRuns {
        let metrics = [("humaneva_mm", errors), ("truth_foot_float_mm", [1.0; 5])];
        let clip = measured_clip(metrics.map(|(name, values)| (name.to_owned(), millimetres(values))).into());
        MeasuredRuns { clips: BTreeMap::from([("walk".to_owned(), clip)]), ..MeasuredRuns::default() }
    }

    fn outcome(shift: f64, wobble: f64) -> GateOutcome {
        let base = [30.0, 31.0, 29.0, 32.0, 30.0];
        let mut errors = base;
        errors.iter_mut().enumerate().for_each(|(i, e)| *e += shift + wobble * [1.0, -1.0, 0.5, -0.5, 0.2][i]);
        gate(&runs(base), &runs(errors), &GateRules::from_metric("humaneva_mm", "2mm".parse().unwrap())).unwrap()
    }

    fn report<'a>(run: &'a str, baseline: &'a str, outcome: &'a GateOutcome) -> GateReport<'a> {
        GateReport { run, baseline, outcome, inconclusive: GateVerdict::Inconclusive }
    }

    #[test]
    fn a_failure_has_its_difference_interval_and_baseline() {
        let outcome = outcome(4.0, 0.3);
        let report = report("runs/mine", "walk", &outcome);
        let text = report.text();
        assert!(text.starts_with("FAIL: runs/mine is worse than the baseline walk"), "{text}");
        assert!(text.contains("4.0 mm worse (3.7 to 4.3 mm at 95 %), margin 2.0 mm; 34.4 against 30.4"), "{text}");
        assert!(text.contains("compared exactly"), "{text}");
        assert!(report.markdown().contains("| **FAIL** | humaneva\\_mm |"), "{}", report.markdown());
        assert!(report.annotations().starts_with("::error title=FAIL humaneva_mm::4.0 mm worse"));
        let junit = report.junit().unwrap();
        assert!(junit.contains("failures=\"1\" errors=\"0\""), "{junit}");
        assert!(junit.contains("<failure message=\"4.0 mm worse"), "{junit}");
    }

    #[test]
    fn an_inconclusive_gate_has_the_number_of_seeds_that_would_decide_it() {
        let outcome = outcome(1.2, 1.5);
        let report = report("r", "b", &outcome);
        assert!(report.text().contains("more seed"), "{}", report.text());
        assert!(report.annotations().starts_with("::warning"));
        assert!(report.junit().unwrap().contains("errors=\"1\""));
        let passing = GateReport { inconclusive: GateVerdict::Pass, ..report };
        let junit = passing.junit().unwrap();
        assert!(junit.contains("failures=\"0\" errors=\"0\"") && !junit.contains("<error"), "{junit}");
        assert!(junit.contains("<system-out>inconclusive: "), "{junit}");
        assert!(passing.annotations().starts_with("::notice title=INC"));
        let failing = GateReport { inconclusive: GateVerdict::Fail, ..report };
        let junit = failing.junit().unwrap();
        assert!(junit.contains("failures=\"1\" errors=\"0\"") && !junit.contains("<error"), "{junit}");
        assert!(junit.contains("<failure type=\"inconclusive\" ") && failing.annotations().starts_with("::error"));
    }

    #[test]
    fn names_break_neither_xml_nor_workflow_commands() {
        let outcome = outcome(4.0, 0.3);
        let junit = report("a\"<b>&\u{1}", "x\n::error::y", &outcome).junit().unwrap();
        let document = roxmltree::Document::parse(&junit).unwrap();
        let suite = document.descendants().find(|node| node.has_tag_name("testsuite")).unwrap();
        assert_eq!(suite.attribute("name"), Some("skiagraph gate: a\"<b>& against x::error::y"));
        assert_eq!(document.descendants().filter(|node| node.has_tag_name("testcase")).count(), 3);
        assert_eq!(escaped("50%\n::x", false), "50%25%0A::x");
        assert_eq!(escaped("a:b,c", true), "a%3Ab%2Cc");
    }
}
