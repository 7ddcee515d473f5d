//! The gate's checks and their verdicts.

use std::collections::{BTreeMap, BTreeSet};

use super::more_seeds::seeds_to_decide;
use super::sides::Sides;
use super::{Check, CheckKind, GateOutcome, GateRefusal, GateRules, GateVerdict, MetricMargin};
use crate::comparison::{
    Difference, DifferenceRule, IntervalUnit, MatchedRuns, MeasuredClip, MeasuredRuns, describe_seeds, holm,
    lost_tracks,
};
use crate::{Direction, Interval, Unit, find_metric, gone_metric};

/// One-sided: a worsening beyond the margin is found in at most 2.5 % of runs that worsen by exactly the margin.
const SIGNIFICANCE: f64 = 0.025;

/// Compares a run with a baseline, over the unit that the rules request; by default over seeds within the baseline's
/// sets if there are enough, else over draws of the noise, else over clips.
///
/// # Errors
/// [`GateRefusal`] that names the difference of set, protocol or seeds, or the rule that cannot be checked.
pub fn gate(baseline: &MeasuredRuns, run: &MeasuredRuns, rules: &GateRules) -> Result<GateOutcome, GateRefusal> {
    let mut sides = Sides { baseline, run, rules, matched: MatchedRuns::on_same_sets(baseline, run) };
    sides.check_sets()?;
    sides.matched.unit = sides.unit()?;
    let mut notes = sides.check_seeds()?;
    if rules.budgets.is_empty() {
        return Err(GateRefusal::Refused(
            "no budget is given; name a metric and its margin, as in --margin 2mm".to_owned(),
        ));
    }
    let mut checks: Vec<Check> = rules.budgets.iter().map(|budget| sides.budget(budget)).collect::<Result<_, _>>()?;
    adjust_failures(&mut checks);
    checks.extend(sides.exact()?);
    let coverage = sides.coverage()?;
    checks.extend(sides.markers().or(coverage));
    checks.extend(sides.lost_tracks());
    notes.extend(sides.notes());
    let verdict = checks.iter().map(|check| check.verdict).max().unwrap_or(GateVerdict::Pass);
    notes.sort();
    notes.dedup();
    let (unit, scope) = (sides.matched.unit, sides.matched.scope(rules.unit));
    let schema = "skiagraph.gate_outcome/1".to_owned();
    Ok(GateOutcome { schema, verdict, misread: Vec::new(), unit, scope, checks, notes })
}

impl<'a> Sides<'a> {
    /// Values of a metric in the clips of a budget; a protocol other than the baseline's is refused.
    fn values(&self, metric: &str, clip: Option<&str>) -> Result<RunsOfCheck<'a>, GateRefusal> {
        if let Some(unknown) = clip.filter(|clip| !self.baseline.clips.contains_key(*clip)) {
            return Err(GateRefusal::Refused(format!("budget of {metric}: the baseline has no clip `{unknown}`")));
        }
        if clip.is_some() && self.matched.unit == IntervalUnit::Clips {
            let message =
                "it names one clip, but the intervals are over clips; name no clip, or gate over draws or seeds";
            return Err(GateRefusal::Refused(format!("budget of {metric}: {message}")));
        }
        let (mut checked, mut lacking_runs, mut valued) = (self.matched.clone(), Vec::new(), false);
        checked.sets.retain(|set| {
            let known = set.base.first().is_some_and(|base| base.metrics.contains_key(metric));
            known && clip.is_none_or(|clip| clip == set.clip)
        });
        for (name, base, run) in self.sets().filter(|(name, ..)| clip.is_none_or(|clip| clip == *name)) {
            let Some(known) = base.metrics.get(metric) else { continue };
            if let Some(new) = run.metrics.get(metric).filter(|new| new.protocol != known.protocol) {
                return Err(GateRefusal::Refused(format!(
                    "{metric} in `{name}` was measured by another protocol than the baseline's: `{}`, now `{}`; save a \
                     new baseline",
                    known.protocol, new.protocol
                )));
            }
            let (before, now) = (base.values(metric), run.values(metric));
            let lacks = |values: &[(u64, f64)], seed: &u64| values.iter().all(|(with, _)| with != seed);
            // a seed without a value in run and baseline is not worse
            let excused = |seed: &u64| base.seeds.contains(seed) && lacks(&before, seed);
            let lacking = run.seeds.iter().filter(|seed| lacks(&now, seed) && !excused(seed));
            let lacking: Vec<u64> = lacking.copied().collect();
            if !lacking.is_empty() && !before.is_empty() {
                lacking_runs.push(format!("`{name}`, seed {}", describe_seeds(&lacking)));
            }
            valued |= !before.is_empty();
        }
        if !valued {
            let message =
                format!("budget of {metric}: the baseline has no value of this metric; see skiagraph baseline show");
            return Err(GateRefusal::Refused(message));
        }
        Ok(RunsOfCheck { checked, lacking: lacking_runs })
    }

    fn budget(&self, budget: &MetricMargin) -> Result<Check, GateRefusal> {
        let name = budget.metric.as_str();
        let metric =
            find_metric(name).ok_or_else(|| GateRefusal::Refused(format!("budget: there is no metric `{name}`")))?;
        if ONLY_OF_LOST_RUNS.contains(&name) {
            let message = format!("budget: {name} is measured only in runs that lose the body; use track_loss");
            return Err(GateRefusal::Refused(message));
        }
        let sign = match metric.direction {
            Direction::LowerIsBetter => 1.0,
            Direction::HigherIsBetter => -1.0,
            Direction::Neither => {
                return Err(GateRefusal::Refused(format!("budget: {name} is a diagnosis, neither better nor worse")));
            }
        };
        let RunsOfCheck { checked, lacking } = self.values(name, budget.clip.as_deref())?;
        let check =
            |verdict| Check { clip: budget.clip.clone(), ..Check::new(name, CheckKind::Budget, metric.unit, verdict) };
        if !lacking.is_empty() {
            // otherwise a run could pass by omitting values
            let reason = format!("no value in {}", lacking.join("; "));
            return Ok(Check { reason: Some(reason), ..check(GateVerdict::Fail) });
        }
        let of = |clip: &MeasuredClip| clip.values(name);
        let Some(found) = checked.difference(&of) else {
            return Err(GateRefusal::Refused(format!("budget of {name}: nothing to compare")));
        };
        let margin = budget.margin.resolve(name, metric.unit, found.base)?;
        let worse_by = sign * found.difference;
        let ends = found.ci95.map(|ends| if sign > 0.0 { ends } else { Interval { low: -ends.high, high: -ends.low } });
        let verdict = match found.rule {
            DifferenceRule::TooFew => GateVerdict::Inconclusive,
            _ => verdict(worse_by, ends, margin),
        };
        let more_seeds = (verdict == GateVerdict::Inconclusive).then(|| {
            let paired = found.rule == DifferenceRule::PairedT;
            seeds_to_decide(&checked.values(&of), paired, found.over, (margin - worse_by).abs())
        });
        Ok(Check {
            difference: Some(found),
            worse_by: Some(worse_by),
            worse_by_ci95: ends,
            margin: Some(margin),
            more_seeds: more_seeds.flatten(),
            ..check(verdict)
        })
    }

    /// Metrics that must not change at all.
    fn exact(&self) -> Result<Vec<Check>, GateRefusal> {
        if let Some(unknown) = self.rules.exact.iter().find(|name| find_metric(name).is_none()) {
            return Err(GateRefusal::Refused(format!("exact: there is no metric `{unknown}`")));
        }
        let has_value = |name: &str| self.sets().any(|(_, base, _)| !base.values(name).is_empty());
        if let Some(name) = self.rules.exact.iter().find(|name| !has_value(name)) {
            let message = format!("exact: the baseline has no value of {name}; see skiagraph baseline show");
            return Err(GateRefusal::Refused(message));
        }
        // runs of this version lack the metrics that only baselines of earlier versions have
        let of_truth =
            |name: &String| self.rules.exact_truth && name.starts_with("truth_") && gone_metric(name).is_none();
        let names: BTreeSet<&String> = self.sets().flat_map(|(_, base, _)| base.metrics.keys()).collect();
        let wanted = names.into_iter().filter(|name| of_truth(name) || self.rules.exact.contains(name));
        Ok(wanted.map(|name| self.exactly(name)).collect())
    }

    fn exactly(&self, name: &str) -> Check {
        let mut changes = Vec::new();
        for (clip, base, run) in self.sets() {
            let (known, new): (BTreeMap<u64, f64>, BTreeMap<u64, f64>) =
                (base.values(name).into_iter().collect(), run.values(name).into_iter().collect());
            // metrics of the truth do not depend on the seed
            let of_truth = name.starts_with("truth_");
            for (seed, value) in &known {
                let now = new.get(seed).or_else(|| if of_truth { new.values().next() } else { None });
                match now {
                    Some(now) if now == value => {}
                    Some(now) => changes.push(format!("`{clip}`, seed {seed}: {value} is now {now}")),
                    None if run.seeds.contains(seed) || of_truth => {
                        changes.push(format!("`{clip}`, seed {seed}: no value"))
                    }
                    None => {}
                }
            }
        }
        let reason = changes.first().map(|first| match changes.len() {
            1 => first.clone(),
            several => format!("{first}, and {} more", several - 1),
        });
        let verdict = if changes.is_empty() { GateVerdict::Pass } else { GateVerdict::Fail };
        let unit = find_metric(name).map_or(Unit::Fraction, |metric| metric.unit);
        Check { reason, ..Check::new(name, CheckKind::Exact, unit, verdict) }
    }

    /// Fails if a marker of the baseline is never estimated: coverage may be equal by other markers, and errors are
    /// then over other markers too.
    fn markers(&self) -> Option<Check> {
        for (clip, base, run) in self.sets() {
            let lost = base.markers_beyond(run).join(", ");
            if !lost.is_empty() {
                let reason = Some(format!("`{clip}`: no estimate of {lost}, so errors are over other markers"));
                let check = Check::new("coverage", CheckKind::Coverage, Unit::Fraction, GateVerdict::Fail);
                return Some(Check { reason, ..check });
            }
        }
        None
    }

    /// The coverage, because errors leave out markers without an estimate. Inconclusive only if the mean fell by more
    /// than the margin.
    fn coverage(&self) -> Result<Option<Check>, GateRefusal> {
        let any = self.sets().any(|(_, base, _)| !base.values("coverage").is_empty());
        let budgeted = self.rules.budgets.iter().any(|budget| budget.metric == "coverage");
        if !any || budgeted {
            return Ok(None);
        }
        let margin = self.rules.coverage;
        let mut check = self.budget(&MetricMargin { metric: "coverage".to_owned(), margin, clip: None })?;
        check.kind = CheckKind::Coverage;
        check.more_seeds = None;
        let fell = check.worse_by.zip(check.margin).is_some_and(|(worse_by, margin)| worse_by > margin);
        if check.verdict == GateVerdict::Inconclusive && !fell {
            check.verdict = GateVerdict::Pass;
        }
        Ok(Some(check))
    }

    /// Fails if more runs lose the body than chance explains.
    fn lost_tracks(&self) -> Option<Check> {
        let known = lost_tracks(self.sets().map(|(_, base, _)| base))?;
        let new = lost_tracks(self.sets().map(|(_, _, run)| run))?;
        let found = known.difference(&new);
        // avoids -0
        let percent = |share: f64| format!("{:.0} %", (100.0 * share).round() + 0.0);
        let reason = format!(
            "{} of {} runs lost the body, baseline {} of {}; difference {} ({} to {})",
            new.count,
            new.of,
            known.count,
            known.of,
            percent(found.difference),
            percent(found.ci95.low),
            percent(found.ci95.high)
        );
        let verdict = if found.ci95.low > 0.0 { GateVerdict::Fail } else { GateVerdict::Pass };
        self.rules.lost_tracks.then(|| Check {
            worse_by: Some(found.difference),
            worse_by_ci95: Some(found.ci95),
            reason: Some(reason),
            ..Check::new("lost_tracks", CheckKind::LostTracks, Unit::Fraction, verdict)
        })
    }
}

/// Metrics that only runs that lose the body have: a better tracker would lack them.
const ONLY_OF_LOST_RUNS: [&str; 2] = ["time_to_loss_s", "recovery_s"];

/// The sets of a check, and the runs that lack a value that the baseline has.
struct RunsOfCheck<'a> {
    checked: MatchedRuns<'a>,
    lacking: Vec<String>,
}

fn verdict(worse_by: f64, ends: Option<Interval>, margin: f64) -> GateVerdict {
    match ends {
        // nothing varies: the difference is exact
        None if worse_by <= margin => GateVerdict::Pass,
        None => GateVerdict::Fail,
        Some(ends) if ends.low > margin => GateVerdict::Fail,
        Some(ends) if ends.high <= margin => GateVerdict::Pass,
        Some(_) => GateVerdict::Inconclusive,
    }
}

/// One of several budgets may fail by chance, so failures must remain significant after Holm's adjustment. Passes need
/// no adjustment, because all must pass.
fn adjust_failures(checks: &mut [Check]) {
    let p_of = |check: &Check| {
        let (found, margin) = (check.difference.as_ref()?, check.margin?);
        let mirrored = Difference { difference: check.worse_by?, ..found.clone() };
        mirrored.p_above(margin)
    };
    let tested: Vec<(usize, f64)> =
        checks.iter().enumerate().filter_map(|(index, check)| Some((index, p_of(check)?))).collect();
    let adjusted = holm(&tested.iter().map(|(_, p)| *p).collect::<Vec<_>>());
    for ((index, _), p) in tested.into_iter().zip(adjusted) {
        let check = &mut checks[index];
        if check.verdict == GateVerdict::Fail && p > SIGNIFICANCE {
            check.verdict = GateVerdict::Inconclusive;
            check.reason = Some(format!("beyond the margin, but not after Holm's adjustment (p {p:.3})"));
        }
    }
}

#[cfg(test)]
mod tests;
