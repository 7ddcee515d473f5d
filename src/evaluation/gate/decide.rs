//! The gate's checks and their verdicts.

use std::collections::{BTreeMap, BTreeSet};

use super::more_seeds::seeds_to_decide;
use super::{Check, CheckKind, FEWEST_SEEDS, GateOutcome, GateRefusal, GateRules, GateVerdict, MetricMargin};
use crate::evaluation::comparison::{
    ClipValues, Difference, DifferenceRule, MeasuredClip, MeasuredRuns, changed_settings, difference, do_pair, holm,
    lost_tracks, seeds_in_words, set_difference,
};
use crate::evaluation::{Direction, Interval, Unit, find_metric};

/// One-sided: a worsening beyond the margin is found in at most 2.5 % of runs that worsen by exactly the margin.
const SIGNIFICANCE: f64 = 0.025;

/// Holds a run against a baseline.
///
/// # Errors
/// [`GateRefusal`] naming the difference of set, protocol or seeds, or the rule that cannot be checked.
pub fn gate(baseline: &MeasuredRuns, run: &MeasuredRuns, rules: &GateRules) -> Result<GateOutcome, GateRefusal> {
    let sides = Sides { baseline, run, rules };
    sides.check_sets()?;
    let mut notes = sides.check_seeds()?;
    if rules.budgets.is_empty() {
        return Err(GateRefusal::Rule(
            "no budget is given; name a metric and its margin, as in --margin 2mm".to_owned(),
        ));
    }
    let mut checks: Vec<Check> = rules.budgets.iter().map(|budget| sides.budget(budget)).collect::<Result<_, _>>()?;
    adjust_failures(&mut checks);
    checks.extend(sides.exact()?);
    checks.extend(sides.coverage()?);
    checks.extend(sides.lost_tracks());
    notes.extend(sides.notes());
    let verdict = checks.iter().map(|check| check.verdict).max().unwrap_or(GateVerdict::Pass);
    Ok(GateOutcome { schema: "skiagraph.gate_outcome/1".to_owned(), verdict, misread: Vec::new(), checks, notes })
}

struct Sides<'a> {
    baseline: &'a MeasuredRuns,
    run: &'a MeasuredRuns,
    rules: &'a GateRules,
}

impl Sides<'_> {
    /// Clips of the baseline with those of the run.
    fn clips(&self) -> impl Iterator<Item = (&String, &MeasuredClip, &MeasuredClip)> {
        self.baseline.clips.iter().filter_map(|(name, base)| Some((name, base, self.run.clips.get(name)?)))
    }

    fn check_sets(&self) -> Result<(), GateRefusal> {
        let names = |runs: &MeasuredRuns| runs.clips.keys().cloned().collect::<Vec<_>>().join(", ");
        if self.baseline.clips.is_empty() || self.clips().count() < self.baseline.clips.len() {
            return Err(GateRefusal::Clips { baseline: names(self.baseline), run: names(self.run) });
        }
        match self.clips().find_map(|(name, base, run)| Some((name, set_difference(base, run)?))) {
            Some((clip, what)) => Err(GateRefusal::Set { clip: clip.clone(), what }),
            None => Ok(()),
        }
    }

    /// Refuses too few and, unasked, other seeds.
    fn check_seeds(&self) -> Result<Vec<String>, GateRefusal> {
        let needed = self.rules.seeds.max(FEWEST_SEEDS);
        let mut notes = Vec::new();
        for (clip, base, run) in self.clips() {
            for (which, side) in [("the baseline", base), ("the run", run)] {
                let found = side.seeds.len();
                if found < needed {
                    return Err(GateRefusal::Seeds { which, clip: clip.clone(), found, needed });
                }
            }
            let [known, new] = [base, run].map(|side| side.seeds.iter().collect::<BTreeSet<_>>());
            if !self.rules.other_seeds && !new.is_superset(&known) {
                let [baseline, run] = [base, run].map(|side| seeds_in_words(&side.seeds));
                return Err(GateRefusal::SeedPolicy { clip: clip.clone(), baseline, run });
            }
            if known != new {
                let how = if do_pair(&base.seeds, &run.seeds) {
                    "those in common are paired if that tells more"
                } else {
                    "not paired"
                };
                notes.push(format!(
                    "`{clip}`: seeds {} against the baseline's {}: {how}",
                    seeds_in_words(&run.seeds),
                    seeds_in_words(&base.seeds)
                ));
            }
        }
        Ok(notes)
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for (clip, base, run) in self.clips() {
            if base.version != run.version {
                notes.push(format!(
                    "`{clip}`: the baseline was measured by version {}, the run by {}",
                    base.version, run.version
                ));
            }
            if base.settings != run.settings || base.tracker != run.tracker {
                notes.push(format!("`{clip}`: the tracker's settings are not the baseline's: {}", changed(base, run)));
            }
        }
        let more = self.run.clips.keys().filter(|clip| !self.baseline.clips.contains_key(*clip));
        notes.extend(more.map(|clip| format!("`{clip}` is not in the baseline and was not checked")));
        notes
    }

    /// Values of a metric in the clips of a budget; a protocol other than the baseline's is refused.
    fn values(&self, metric: &str, clip: Option<&str>) -> Result<ClipsOfCheck, GateRefusal> {
        if let Some(unknown) = clip.filter(|clip| !self.baseline.clips.contains_key(*clip)) {
            return Err(GateRefusal::Rule(format!("budget of {metric}: the baseline has no clip `{unknown}`")));
        }
        let mut values = ClipsOfCheck::default();
        for (name, base, run) in self.clips().filter(|(name, ..)| clip.is_none_or(|clip| clip == *name)) {
            let Some(known) = base.metrics.get(metric) else { continue };
            if let Some(new) = run.metrics.get(metric).filter(|new| new.protocol != known.protocol) {
                let [baseline, run] = [known, new].map(|metric| metric.protocol.clone());
                return Err(GateRefusal::Protocol { metric: metric.to_owned(), clip: name.clone(), baseline, run });
            }
            let clip = ClipValues { base: base.values(metric), other: run.values(metric) };
            let lacks = |values: &[(u64, f64)], seed: &u64| values.iter().all(|(with, _)| with != seed);
            // a seed without a value in the baseline either is no worse
            let excused = |seed: &u64| base.seeds.contains(seed) && lacks(&clip.base, seed);
            let lacking = run.seeds.iter().filter(|seed| lacks(&clip.other, seed) && !excused(seed));
            let lacking: Vec<u64> = lacking.copied().collect();
            if !lacking.is_empty() && !clip.base.is_empty() {
                values.lacking.push(format!("`{name}`, seed {}", seeds_in_words(&lacking)));
            }
            values.clips.push(clip);
        }
        if values.clips.iter().all(|clip| clip.base.is_empty()) {
            let message = format!("budget of {metric}: the baseline has no value of it; see skiagraph baseline show");
            return Err(GateRefusal::Rule(message));
        }
        Ok(values)
    }

    fn budget(&self, budget: &MetricMargin) -> Result<Check, GateRefusal> {
        let name = budget.metric.as_str();
        let metric =
            find_metric(name).ok_or_else(|| GateRefusal::Rule(format!("budget: there is no metric `{name}`")))?;
        if ONLY_OF_LOST_RUNS.contains(&name) {
            let message = format!("budget: {name} is measured only in runs that lose the body; use track_loss");
            return Err(GateRefusal::Rule(message));
        }
        let sign = match metric.direction {
            Direction::LowerIsBetter => 1.0,
            Direction::HigherIsBetter => -1.0,
            Direction::Neither => {
                return Err(GateRefusal::Rule(format!("budget: {name} is a diagnosis, neither better nor worse")));
            }
        };
        let values = self.values(name, budget.clip.as_deref())?;
        let check = |verdict| Check {
            metric: name.to_owned(),
            clip: budget.clip.clone(),
            kind: CheckKind::Budget,
            verdict,
            unit: metric.unit,
            difference: None,
            worse_by: None,
            worse_by_ci95: None,
            margin: None,
            more_seeds: None,
            reason: None,
        };
        if !values.lacking.is_empty() {
            // left out it would be a way to pass
            let reason = format!("no value in {}", values.lacking.join("; "));
            return Ok(Check { reason: Some(reason), ..check(GateVerdict::Fail) });
        }
        let Some(found) = difference(&values.clips) else {
            return Err(GateRefusal::Rule(format!("budget of {name}: nothing to compare")));
        };
        let margin = budget.margin.resolve(name, metric.unit, found.base)?;
        let worse_by = sign * found.difference;
        let ends = found.ci95.map(|ends| match sign > 0.0 {
            true => ends,
            false => Interval { low: -ends.high, high: -ends.low },
        });
        let verdict = match found.rule {
            DifferenceRule::TooFew => GateVerdict::Inconclusive,
            _ => verdict(worse_by, ends, margin),
        };
        let more_seeds = (verdict == GateVerdict::Inconclusive).then(|| {
            let paired = matches!(found.rule, DifferenceRule::PairedT | DifferenceRule::PairedBootstrap);
            seeds_to_decide(&values.clips, paired, (margin - worse_by).abs())
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
            return Err(GateRefusal::Rule(format!("exact: there is no metric `{unknown}`")));
        }
        let has_value = |name: &str| self.clips().any(|(_, base, _)| !base.values(name).is_empty());
        if let Some(name) = self.rules.exact.iter().find(|name| !has_value(name)) {
            let message = format!("exact: the baseline has no value of {name}; see skiagraph baseline show");
            return Err(GateRefusal::Rule(message));
        }
        let of_truth = |name: &String| self.rules.exact_truth && name.starts_with("truth_");
        let names: BTreeSet<&String> = self.clips().flat_map(|(_, base, _)| base.metrics.keys()).collect();
        let wanted = names.into_iter().filter(|name| of_truth(name) || self.rules.exact.contains(name));
        Ok(wanted.map(|name| self.exactly(name)).collect())
    }

    fn exactly(&self, name: &str) -> Check {
        let mut changes = Vec::new();
        for (clip, base, run) in self.clips() {
            let (known, new): (BTreeMap<u64, f64>, BTreeMap<u64, f64>) =
                (base.values(name).into_iter().collect(), run.values(name).into_iter().collect());
            // what is said of the truth is the same whatever the seed
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
        Check {
            metric: name.to_owned(),
            clip: None,
            kind: CheckKind::Exact,
            verdict: if changes.is_empty() { GateVerdict::Pass } else { GateVerdict::Fail },
            unit: find_metric(name).map_or(Unit::Fraction, |metric| metric.unit),
            difference: None,
            worse_by: None,
            worse_by_ci95: None,
            margin: None,
            more_seeds: None,
            reason,
        }
    }

    /// A guard: errors leave out what has no estimate. Inconclusive only where the mean fell by more than the margin.
    fn coverage(&self) -> Result<Option<Check>, GateRefusal> {
        let any = self.clips().any(|(_, base, _)| !base.values("coverage").is_empty());
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

    /// A guard as well: fails if more runs lose the body than chance explains.
    fn lost_tracks(&self) -> Option<Check> {
        let known = lost_tracks(self.clips().map(|(_, base, _)| base))?;
        let new = lost_tracks(self.clips().map(|(_, _, run)| run))?;
        let found = known.difference(&new);
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
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
        self.rules.lost_tracks.then(|| Check {
            metric: "lost_tracks".to_owned(),
            clip: None,
            kind: CheckKind::LostTracks,
            verdict: if found.ci95.low > 0.0 { GateVerdict::Fail } else { GateVerdict::Pass },
            unit: Unit::Fraction,
            difference: None,
            worse_by: Some(found.difference),
            worse_by_ci95: Some(found.ci95),
            margin: None,
            more_seeds: None,
            reason: Some(reason),
        })
    }
}

/// Metrics that a run has only if it lost the body: a better tracker would lack them.
const ONLY_OF_LOST_RUNS: [&str; 2] = ["time_to_loss_s", "recovery_s"];

/// Values of the clips of a check, and the runs that have none where the baseline has.
#[derive(Default)]
struct ClipsOfCheck {
    clips: Vec<ClipValues>,
    lacking: Vec<String>,
}

fn verdict(worse_by: f64, ends: Option<Interval>, margin: f64) -> GateVerdict {
    match ends {
        // nothing varies: the difference is what it is
        None if worse_by <= margin => GateVerdict::Pass,
        None => GateVerdict::Fail,
        Some(ends) if ends.low > margin => GateVerdict::Fail,
        Some(ends) if ends.high <= margin => GateVerdict::Pass,
        Some(_) => GateVerdict::Inconclusive,
    }
}

/// Of several budgets one may seem to fail by chance: failures must hold with Holm's adjustment too. Passing needs
/// none, since all must pass.
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

/// How the trackers differ, in words.
fn changed(base: &MeasuredClip, run: &MeasuredClip) -> String {
    match base.tracker == run.tracker {
        true => changed_settings(base.settings.as_ref(), run.settings.as_ref()),
        false => format!("{} instead of {}", run.tracker, base.tracker),
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::comparison::fixture::clip;
    use super::*;

    const BASE: [f64; 6] = [30.0, 31.0, 29.0, 32.0, 30.5, 29.5];

    fn runs(set: &str, first: u64, shift: f64, wobble: f64) -> MeasuredRuns {
        let errors: Vec<f64> =
            BASE.iter().enumerate().map(|(i, e)| e + shift + wobble * [1.0, -1.0, 0.5][i % 3]).collect();
        MeasuredRuns { clips: BTreeMap::from([("walk".to_owned(), clip(set, first, &errors))]) }
    }

    fn rules(margin: &str) -> GateRules {
        GateRules::from_metric("humaneva_mm", margin.parse().unwrap())
    }

    fn verdict_of(run: &MeasuredRuns, margin: &str) -> GateVerdict {
        gate(&runs("a", 0, 0.0, 0.0), run, &rules(margin)).unwrap().verdict
    }

    #[test]
    fn the_interval_below_the_margin_passes_above_it_fails_and_about_it_says_nothing() {
        assert_eq!(verdict_of(&runs("a", 0, 0.3, 0.2), "2mm"), GateVerdict::Pass);
        assert_eq!(verdict_of(&runs("a", 0, 4.0, 0.2), "2mm"), GateVerdict::Fail);
        assert_eq!(verdict_of(&runs("a", 0, 1.9, 1.0), "2mm"), GateVerdict::Inconclusive);
        assert_eq!(verdict_of(&runs("a", 0, -9.0, 1.0), "2mm"), GateVerdict::Pass, "better is no worse");
    }

    #[test]
    fn the_same_run_passes_at_any_margin_and_an_inconclusive_one_tells_how_many_seeds_it_lacks() {
        assert_eq!(verdict_of(&runs("a", 0, 0.0, 0.0), "0mm"), GateVerdict::Pass);
        let outcome = gate(&runs("a", 0, 0.0, 0.0), &runs("a", 0, 1.0, 1.5), &rules("2mm")).unwrap();
        assert_eq!(outcome.verdict, GateVerdict::Inconclusive);
        assert!(outcome.checks[0].more_seeds.is_some(), "{:?}", outcome.checks[0]);
    }

    #[test]
    fn what_cannot_be_held_against_the_baseline_is_refused_with_the_difference() {
        let base = runs("a", 0, 0.0, 0.0);
        let refused = |run: &MeasuredRuns| gate(&base, run, &rules("2mm")).unwrap_err().to_string();
        assert!(refused(&runs("b", 0, 0.0, 0.0)).contains("hashes a and b"));
        assert!(refused(&runs("a", 50, 0.0, 0.0)).contains("seeds 0 to 5, the run 50 to 55"));
        let few = MeasuredRuns { clips: BTreeMap::from([("walk".to_owned(), clip("a", 0, &BASE[..4]))]) };
        assert!(refused(&few).contains("has 4 seed(s) of `walk`, a gate needs 5"), "{}", refused(&few));
        let elsewhere = MeasuredRuns { clips: BTreeMap::from([("jump".to_owned(), clip("a", 0, &BASE))]) };
        assert!(refused(&elsewhere).contains("clip(s) walk, the run jump"));
        let mut otherwise = runs("a", 0, 0.0, 0.0);
        otherwise.clips.get_mut("walk").unwrap().metrics.get_mut("humaneva_mm").unwrap().protocol = "new".to_owned();
        assert!(refused(&otherwise).contains("another protocol than the baseline's: `as ever`, now `new`"));
        let accepted = GateRules { other_seeds: true, ..rules("9mm") };
        let outcome = gate(&base, &runs("a", 50, 0.3, 0.2), &accepted).unwrap();
        assert!(outcome.verdict == GateVerdict::Pass && outcome.notes[0].contains("not paired"), "{outcome:?}");
    }

    #[test]
    fn a_run_without_a_value_fails_and_so_does_a_tracker_that_estimates_less() {
        let mut diverged = runs("a", 0, 0.0, 0.0);
        diverged.clips.get_mut("walk").unwrap().metrics.get_mut("humaneva_mm").unwrap().per_seed[2] = None;
        let outcome = gate(&runs("a", 0, 0.0, 0.0), &diverged, &rules("2mm")).unwrap();
        assert_eq!(outcome.checks[0].reason.as_deref(), Some("no value in `walk`, seed 2"));
        assert_eq!(outcome.verdict, GateVerdict::Fail);
        let mut shy = runs("a", 0, 0.0, 0.0);
        shy.clips.get_mut("walk").unwrap().metrics.get_mut("coverage").unwrap().per_seed = vec![Some(0.8); 6];
        let outcome = gate(&runs("a", 0, 0.0, 0.0), &shy, &rules("2mm")).unwrap();
        let failed: Vec<_> = outcome.checks.iter().filter(|c| c.verdict == GateVerdict::Fail).map(|c| c.kind).collect();
        assert_eq!(failed, [CheckKind::Coverage]);
    }

    #[test]
    fn a_run_passes_against_itself_where_a_seed_has_no_estimate() {
        let without = |first: u64, lacking: &[usize]| {
            let mut runs = runs("a", first, 0.0, 0.0);
            let metric = runs.clips.get_mut("walk").unwrap().metrics.get_mut("humaneva_mm").unwrap();
            lacking.iter().for_each(|index| metric.per_seed[*index] = None);
            runs
        };
        let found = |run: &MeasuredRuns| gate(&without(0, &[2]), run, &rules("2mm")).unwrap();
        assert_eq!(found(&without(0, &[2])).verdict, GateVerdict::Pass);
        let worse = found(&without(0, &[2, 4]));
        assert_eq!(worse.checks[0].reason.as_deref(), Some("no value in `walk`, seed 4"));
        let accepted = GateRules { other_seeds: true, ..rules("2mm") };
        let others = gate(&without(0, &[2]), &without(50, &[2]), &accepted).unwrap();
        assert_eq!(others.checks[0].reason.as_deref(), Some("no value in `walk`, seed 52"));
    }

    #[test]
    fn one_value_of_six_decides_nothing_and_the_same_change_of_all_six_decides() {
        let mut rare = runs("a", 0, 0.0, 0.0);
        let metric = rare.clips.get_mut("walk").unwrap().metrics.get_mut("humaneva_mm").unwrap();
        metric.per_seed.iter_mut().skip(1).for_each(|value| *value = None);
        let found = |base: &MeasuredRuns, shift| gate(base, &runs("a", 0, shift, 0.0), &rules("2mm")).unwrap().verdict;
        assert_eq!(found(&rare, 0.0), GateVerdict::Inconclusive);
        assert_eq!(
            [1.0, 3.0].map(|shift| found(&runs("a", 0, 0.0, 0.0), shift)),
            [GateVerdict::Pass, GateVerdict::Fail]
        );
    }

    #[test]
    fn all_six_runs_lost_fail_and_one_of_six_may_be_chance() {
        let with_lost = |lost: usize| {
            let mut runs = runs("a", 0, 0.0, 0.0);
            let metric = runs.clips.get_mut("walk").unwrap().metrics.get_mut("track_loss").unwrap();
            metric.per_seed = (0..6).map(|seed| Some(if seed < lost { 0.3 } else { 0.0 })).collect();
            runs
        };
        assert_eq!(verdict_of(&with_lost(1), "2mm"), GateVerdict::Pass);
        assert_eq!(verdict_of(&with_lost(6), "2mm"), GateVerdict::Fail);
    }

    #[test]
    fn exact_metrics_must_not_change_by_the_last_bit() {
        let mut changed = runs("a", 0, 0.0, 0.0);
        let error = changed.clips.get_mut("walk").unwrap().metrics.get_mut("humaneva_mm").unwrap();
        error.per_seed[1] = error.per_seed[1].map(|v: f64| f64::from_bits(v.to_bits() + 1));
        let exact = GateRules { exact: vec!["humaneva_mm".to_owned()], ..rules("2mm") };
        let outcome = gate(&runs("a", 0, 0.0, 0.0), &changed, &exact).unwrap();
        let check = outcome.checks.iter().find(|check| check.kind == CheckKind::Exact).unwrap();
        assert_eq!(check.verdict, GateVerdict::Fail);
        assert!(check.reason.as_deref().unwrap().starts_with("`walk`, seed 1: 31 is now 31.0000"), "{check:?}");
        let same = gate(&runs("a", 0, 0.0, 0.0), &runs("a", 0, 0.0, 0.0), &exact).unwrap();
        assert_eq!(same.verdict, GateVerdict::Pass);
    }

    #[test]
    fn rules_that_name_nothing_are_refused() {
        let base = runs("a", 0, 0.0, 0.0);
        let refused = |rules: GateRules| gate(&base, &base, &rules).unwrap_err().to_string();
        assert!(refused(GateRules { budgets: vec![], ..rules("2mm") }).contains("no budget"));
        assert!(refused(GateRules::from_metric("nothing", "2mm".parse().unwrap())).contains("no metric `nothing`"));
        assert!(refused(GateRules::from_metric("recovery_s", "1".parse().unwrap())).contains("use track_loss"));
        assert!(refused(GateRules::from_metric("energy_gap", "2".parse().unwrap())).contains("a diagnosis"));
        assert!(
            refused(GateRules::from_metric("pa_mpjpe_mm", "2mm".parse().unwrap())).contains("baseline has no value")
        );
        let exact = GateRules { exact: vec!["lag_ms".to_owned()], ..rules("2mm") };
        assert!(refused(exact).contains("exact: the baseline has no value of lag_ms"));
        let of_clip = |clip: &str| {
            let mut rules = rules("2mm");
            rules.budgets[0].clip = Some(clip.to_owned());
            rules
        };
        assert!(refused(of_clip("jump")).contains("no clip `jump`"));
        assert!(gate(&base, &base, &of_clip("walk")).is_ok());
    }

    #[test]
    fn a_higher_score_is_not_worse() {
        let with_pck = |score: f64| {
            let mut runs = runs("a", 0, 0.0, 0.0);
            let walk = runs.clips.get_mut("walk").unwrap();
            let mut metric = walk.metrics["coverage"].clone();
            metric.per_seed = vec![Some(score); 6];
            walk.metrics.insert("pck150".to_owned(), metric);
            runs
        };
        let pck = GateRules::from_metric("pck150", "2%".parse().unwrap());
        let verdict = |score| gate(&with_pck(0.9), &with_pck(score), &pck).unwrap().verdict;
        assert_eq!([0.95, 0.89, 0.85].map(verdict), [GateVerdict::Pass, GateVerdict::Pass, GateVerdict::Fail]);
    }
}
