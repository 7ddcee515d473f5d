//! Tests of `decide.rs`.

use super::super::super::comparison::fixture::clip;
use super::super::MoreSeeds;
use super::*;

const BASE: [f64; 6] = [30.0, 31.0, 29.0, 32.0, 30.5, 29.5];

fn runs(set: &str, first: u64, shift: f64, wobble: f64) -> MeasuredRuns {
    let errors: Vec<f64> = BASE.iter().enumerate().map(|(i, e)| e + shift + wobble * [1.0, -1.0, 0.5][i % 3]).collect();
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
fn an_interval_below_the_margin_passes_above_it_fails_and_around_it_is_inconclusive() {
    assert_eq!(verdict_of(&runs("a", 0, 0.3, 0.2), "2mm"), GateVerdict::Pass);
    assert_eq!(verdict_of(&runs("a", 0, 4.0, 0.2), "2mm"), GateVerdict::Fail);
    assert_eq!(verdict_of(&runs("a", 0, -9.0, 1.0), "2mm"), GateVerdict::Pass, "better is not worse");
    assert_eq!(verdict_of(&runs("a", 0, 0.0, 0.0), "0mm"), GateVerdict::Pass, "the same run at any margin");
    let outcome = gate(&runs("a", 0, 0.0, 0.0), &runs("a", 0, 1.0, 1.5), &rules("2mm")).unwrap();
    assert_eq!(outcome.verdict, GateVerdict::Inconclusive);
    assert!(outcome.checks[0].more_seeds.is_some(), "{:?}", outcome.checks[0]);
}

/// Both sides estimate 4 of 5 markers, but other ones: the better error is over easier markers.
#[test]
fn other_markers_at_equal_coverage_fail() {
    let of_marker = |marker: &str, shift: f64| {
        let mut runs = runs("a", 0, shift, 0.2);
        let clip = runs.clips.get_mut("walk").unwrap();
        let errors = clip.joints.remove("pelvis").unwrap();
        clip.joints.insert("thorax".to_owned(), errors.clone());
        clip.joints.insert("left_wrist".to_owned(), vec![None; errors.len()]);
        clip.joints.insert(marker.to_owned(), errors);
        runs
    };
    let (base, run) = (of_marker("left_wrist", 0.0), of_marker("pelvis", -9.0));
    let outcome = gate(&base, &run, &rules("2mm")).unwrap();
    let coverage = outcome.checks.iter().find(|check| check.kind == CheckKind::Coverage).unwrap();
    let reason = coverage.reason.clone().unwrap();
    assert!(outcome.verdict == GateVerdict::Fail && reason.contains("no estimate of left_wrist,"), "{reason}");
    let notes = outcome.notes.concat();
    assert!(notes.contains("the baseline has no estimate of pelvis"), "{notes}");
    let compared = crate::compare_runs(("one", &base), &[("two", &run)], false, None).unwrap();
    let skipped = compared.others[0].skipped.concat();
    assert!(
        skipped.contains("only `one` estimates left_wrist") && skipped.contains("only `two` estimates pelvis"),
        "{skipped}"
    );
}

#[test]
fn runs_that_cannot_be_compared_with_the_baseline_are_refused_with_the_difference() {
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
fn a_run_passes_against_itself_if_a_seed_has_no_estimate() {
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
    assert_eq!([1.0, 3.0].map(|shift| found(&runs("a", 0, 0.0, 0.0), shift)), [GateVerdict::Pass, GateVerdict::Fail]);
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
fn exact_metrics_must_not_change_in_the_last_bit() {
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
fn rules_that_name_no_known_metric_or_clip_are_refused() {
    let base = runs("a", 0, 0.0, 0.0);
    let refused = |rules: GateRules| gate(&base, &base, &rules).unwrap_err().to_string();
    assert!(refused(GateRules { budgets: vec![], ..rules("2mm") }).contains("no budget"));
    assert!(refused(GateRules::from_metric("nothing", "2mm".parse().unwrap())).contains("no metric `nothing`"));
    assert!(refused(GateRules::from_metric("recovery_s", "1".parse().unwrap())).contains("use track_loss"));
    assert!(refused(GateRules::from_metric("energy_gap", "2".parse().unwrap())).contains("a diagnosis"));
    assert!(refused(GateRules::from_metric("pa_mpjpe_mm", "2mm".parse().unwrap())).contains("baseline has no value"));
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

/// A deterministic tracker has one run per set; the gate once refused it.
#[test]
fn a_deterministic_tracker_is_gated_over_draws_of_the_noise_or_over_clips() {
    for (is_draws, unit, words) in
        [(true, IntervalUnit::Draws, "over 6 draws; clips: 1 (walk, 1.7 s)"), (false, IntervalUnit::Clips, "6 clips")]
    {
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
fn copies_of_one_run_are_refused_with_advice_and_so_is_a_unit_of_which_there_are_too_few() {
    let copies = |error: f64| of_clip("walk", clip("a", 0, &[error; 6]));
    let refused = gate(&copies(30.0), &copies(20.0), &rules("2mm")).unwrap_err().to_string();
    assert!(refused.contains("one observation") && refused.contains("observation.seed=2"), "{refused}");
    let with_unit = |unit| GateRules { unit: Some(unit), ..rules("2mm") };
    let (base, run) = (runs("a", 0, 0.0, 0.0), runs("a", 0, 0.3, 0.2));
    let refused = gate(&base, &run, &with_unit(IntervalUnit::Clips)).unwrap_err().to_string();
    assert!(refused.contains("a gate over clips needs 5"), "{refused}");
    assert_eq!(gate(&base, &run, &with_unit(IntervalUnit::Seeds)).unwrap().verdict, GateVerdict::Pass);
}

#[test]
fn a_run_that_lacks_a_draw_of_the_baseline_is_refused() {
    let mut run = deterministic(true, 0.0, 0.0);
    run.draws.get_mut("walk").unwrap().pop();
    let refused = gate(&deterministic(true, 0.0, 0.0), &run, &rules("2mm")).unwrap_err().to_string();
    assert!(refused.contains("lacks its draw with the hash set-5"), "{refused}");
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

/// A baseline of an earlier version has metrics that no run has any more.
#[test]
fn a_gone_metric_of_the_truth_is_ignored() {
    let mut base = runs("a", 0, 0.0, 0.0);
    let metrics = &mut base.clips.get_mut("walk").unwrap().metrics;
    let known = metrics["humaneva_mm"].clone();
    metrics.insert("truth_zmp_outside".to_owned(), known.clone());
    let outcome = gate(&base, &runs("a", 0, 0.0, 0.0), &rules("2mm")).unwrap();
    assert_eq!(outcome.verdict, GateVerdict::Pass, "{:?}", outcome.checks);
    base.clips.get_mut("walk").unwrap().metrics.insert("truth_foot_float_mm".to_owned(), known);
    let outcome = gate(&base, &runs("a", 0, 0.0, 0.0), &rules("2mm")).unwrap();
    assert_eq!(outcome.verdict, GateVerdict::Fail, "{:?}", outcome.checks);
    // and lacks metrics that later runs have
    let outcome = gate(&runs("a", 0, 0.0, 0.0), &base, &rules("2mm")).unwrap();
    assert_eq!(outcome.verdict, GateVerdict::Pass, "{:?}", outcome.checks);
}
