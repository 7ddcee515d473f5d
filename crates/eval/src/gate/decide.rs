//! The gate's checks and their verdicts.

use std::collections::{BTreeMap, BTreeSet};

use super::more_seeds::seeds_to_decide;
use super::sides::Sides;
use super::{Check, CheckKind, GateOutcome, GateRefusal, GateRules, GateVerdict, MetricMargin};
use crate::comparison::{
    Difference, DifferenceRule, IntervalUnit, MatchedRuns, MeasuredClip, MeasuredRuns, holm, lost_tracks,
    seeds_in_words,
};
use crate::{Direction, Interval, Unit, find_metric};

/// One-sided: a worsening beyond the margin is found in at most 2.5 % of runs that worsen by exactly the margin.
const SIGNIFICANCE: f64 = 0.025;

/// Holds a run against a baseline, over the unit that the rules ask for; unasked over seeds within the baseline's sets
/// where there are enough, else over draws of the noise, else over clips.
///
/// # Errors
/// [`GateRefusal`] naming the difference of set, protocol or seeds, or the rule that cannot be checked.
pub fn gate(baseline: &MeasuredRuns, run: &MeasuredRuns, rules: &GateRules) -> Result<GateOutcome, GateRefusal> {
    let mut sides = Sides { baseline, run, rules, matched: MatchedRuns::on_same_sets(baseline, run) };
    sides.check_sets()?;
    sides.matched.unit = sides.unit()?;
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
            return Err(GateRefusal::Rule(format!("budget of {metric}: the baseline has no clip `{unknown}`")));
        }
        if clip.is_some() && self.matched.unit == IntervalUnit::Clips {
            let message = "of one clip, but the intervals run over clips; name no clip, or gate on draws or seeds";
            return Err(GateRefusal::Rule(format!("budget of {metric}: {message}")));
        }
        let (mut checked, mut lacking_runs, mut valued) = (self.matched.clone(), Vec::new(), false);
        checked.sets.retain(|set| {
            let known = set.base.first().is_some_and(|base| base.metrics.contains_key(metric));
            known && clip.is_none_or(|clip| clip == set.clip)
        });
        for (name, base, run) in self.sets().filter(|(name, ..)| clip.is_none_or(|clip| clip == *name)) {
            let Some(known) = base.metrics.get(metric) else { continue };
            if let Some(new) = run.metrics.get(metric).filter(|new| new.protocol != known.protocol) {
                let [baseline, run] = [known, new].map(|metric| metric.protocol.clone());
                return Err(GateRefusal::Protocol { metric: metric.to_owned(), clip: name.to_owned(), baseline, run });
            }
            let (before, now) = (base.values(metric), run.values(metric));
            let lacks = |values: &[(u64, f64)], seed: &u64| values.iter().all(|(with, _)| with != seed);
            // a seed without a value in the baseline either is no worse
            let excused = |seed: &u64| base.seeds.contains(seed) && lacks(&before, seed);
            let lacking = run.seeds.iter().filter(|seed| lacks(&now, seed) && !excused(seed));
            let lacking: Vec<u64> = lacking.copied().collect();
            if !lacking.is_empty() && !before.is_empty() {
                lacking_runs.push(format!("`{name}`, seed {}", seeds_in_words(&lacking)));
            }
            valued |= !before.is_empty();
        }
        if !valued {
            let message = format!("budget of {metric}: the baseline has no value of it; see skiagraph baseline show");
            return Err(GateRefusal::Rule(message));
        }
        Ok(RunsOfCheck { checked, lacking: lacking_runs })
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
        let RunsOfCheck { checked, lacking } = self.values(name, budget.clip.as_deref())?;
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
        if !lacking.is_empty() {
            // left out it would be a way to pass
            let reason = format!("no value in {}", lacking.join("; "));
            return Ok(Check { reason: Some(reason), ..check(GateVerdict::Fail) });
        }
        let of = |clip: &MeasuredClip| clip.values(name);
        let Some(found) = checked.difference(&of) else {
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
            return Err(GateRefusal::Rule(format!("exact: there is no metric `{unknown}`")));
        }
        let has_value = |name: &str| self.sets().any(|(_, base, _)| !base.values(name).is_empty());
        if let Some(name) = self.rules.exact.iter().find(|name| !has_value(name)) {
            let message = format!("exact: the baseline has no value of {name}; see skiagraph baseline show");
            return Err(GateRefusal::Rule(message));
        }
        let of_truth = |name: &String| self.rules.exact_truth && name.starts_with("truth_");
        let names: BTreeSet<&String> = self.sets().flat_map(|(_, base, _)| base.metrics.keys()).collect();
        let wanted = names.into_iter().filter(|name| of_truth(name) || self.rules.exact.contains(name));
        Ok(wanted.map(|name| self.exactly(name)).collect())
    }

    fn exactly(&self, name: &str) -> Check {
        let mut changes = Vec::new();
        for (clip, base, run) in self.sets() {
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

    /// A guard as well: fails if more runs lose the body than chance explains.
    fn lost_tracks(&self) -> Option<Check> {
        let known = lost_tracks(self.sets().map(|(_, base, _)| base))?;
        let new = lost_tracks(self.sets().map(|(_, _, run)| run))?;
        let found = known.difference(&new);
        // zero has no minus
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

/// The sets of a check, and the runs that have no value where the baseline has.
struct RunsOfCheck<'a> {
    checked: MatchedRuns<'a>,
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

#[cfg(test)]
mod tests {
    use super::super::super::comparison::fixture::clip;
    use super::super::MoreSeeds;
    use super::*;

    const BASE: [f64; 6] = [30.0, 31.0, 29.0, 32.0, 30.5, 29.5];

    fn runs(set: &str, first: u64, shift: f64, wobble: f64) -> MeasuredRuns {
        let errors: Vec<f64> =
            BASE.iter().enumerate().map(|(i, e)| e + shift + wobble * [1.0, -1.0, 0.5][i % 3]).collect();
        of_clip("walk", clip(set, first, &errors))
    }

    fn of_clip(name: &str, clip: MeasuredClip) -> MeasuredRuns {
        MeasuredRuns { clips: BTreeMap::from([(name.to_owned(), clip)]), ..MeasuredRuns::default() }
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
        let few = of_clip("walk", clip("a", 0, &BASE[..4]));
        assert!(refused(&few).contains("has 4 seed(s) of `walk`, a gate needs 5"), "{}", refused(&few));
        let elsewhere = of_clip("jump", clip("a", 0, &BASE));
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

    /// Six sets of a deterministic tracker, one run each: draws of a clip's noise, or clips.
    fn deterministic(is_draws: bool, shift: f64, wobble: f64) -> MeasuredRuns {
        let mut all = MeasuredRuns::default();
        for (number, error) in BASE.iter().enumerate() {
            let error = error + shift + wobble * [1.0, -1.0, 0.5][number % 3];
            let mut clip = clip(&format!("set-{number}"), 0, &[error]);
            clip.scene_hash = Some("scene".to_owned());
            all.add(&if is_draws { "walk".to_owned() } else { format!("clip-{number}") }, clip).unwrap();
        }
        all
    }

    /// A deterministic tracker has one run a set: the gate refused it.
    #[test]
    fn a_deterministic_tracker_is_gated_over_draws_of_the_noise_or_over_clips() {
        for (is_draws, unit, words) in [
            (
                true,
                IntervalUnit::Draws,
                "6 draws of the noise of one clip (walk, 1.7 s): they say nothing about other motions",
            ),
            (false, IntervalUnit::Clips, "6 clips"),
        ] {
            let base = deterministic(is_draws, 0.0, 0.0);
            let found = |shift, wobble| gate(&base, &deterministic(is_draws, shift, wobble), &rules("2mm")).unwrap();
            let passed = found(0.3, 0.2);
            assert_eq!((passed.verdict, passed.unit), (GateVerdict::Pass, unit));
            assert!(passed.scope.contains(words), "{}", passed.scope);
            assert_eq!(passed.checks[0].difference.as_ref().unwrap().freedom, Some(5.0));
            assert_eq!(found(4.0, 0.2).verdict, GateVerdict::Fail);
            let open = found(1.9, 1.0);
            assert_eq!(open.verdict, GateVerdict::Inconclusive);
            let more = open.checks[0].more_seeds;
            assert!(matches!(more, Some(MoreSeeds::OfBoth(_) | MoreSeeds::TooMany)), "new sets for both: {more:?}");
        }
    }

    #[test]
    fn copies_of_one_run_are_refused_with_what_to_do_and_so_is_a_unit_of_which_there_are_too_few() {
        let copies = |error: f64| of_clip("walk", clip("a", 0, &[error; 6]));
        let refused = gate(&copies(30.0), &copies(20.0), &rules("2mm")).unwrap_err().to_string();
        assert!(refused.contains("one observation") && refused.contains("observation.seed=2"), "{refused}");
        let asked = |unit| GateRules { unit: Some(unit), ..rules("2mm") };
        let (base, run) = (runs("a", 0, 0.0, 0.0), runs("a", 0, 0.3, 0.2));
        let refused = gate(&base, &run, &asked(IntervalUnit::Clips)).unwrap_err().to_string();
        assert!(refused.contains("a gate over clips needs 5"), "{refused}");
        assert_eq!(gate(&base, &run, &asked(IntervalUnit::Seeds)).unwrap().verdict, GateVerdict::Pass);
    }

    #[test]
    fn a_run_that_lacks_a_draw_of_the_baseline_is_refused() {
        let mut run = deterministic(true, 0.0, 0.0);
        run.draws.get_mut("walk").unwrap().pop();
        let refused = gate(&deterministic(true, 0.0, 0.0), &run, &rules("2mm")).unwrap_err().to_string();
        assert!(refused.contains("lacks that with the hash set-5"), "{refused}");
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
