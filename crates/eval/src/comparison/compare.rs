//! Compares one side with another, metric by metric.

use std::collections::BTreeSet;

use super::compared::{
    AgainstBase, ComparedMetric, Finding, JointDifference, LostTracks, NotComparable, RunComparison, SideFacts,
};
use super::interval_unit::IntervalUnit;
use super::judge::judge;
use super::matched_runs::{MatchedRuns, MatchedSet};
use super::measured_runs::{MeasuredClip, MeasuredRuns, describe_seeds};
use super::rate::Rate;
use crate::{METRICS, Metric, mean};
use skiagraph_core::body::LANDMARKS;

/// Metrics that agree if every marker has an estimate; the first of each pair is shown.
const ALIASES: [(&str, &str); 2] = [("humaneva_mm", "mpjpe_mm"), ("humaneva_mm", "humaneva_official_mm")];

/// Compares every side with the base. Sides on other sets with the same name are refused unless `across_sets`; then
/// their seeds and draws are compared unpaired. Intervals are over `unit`. By default they are over clips if both sides
/// have three in common, otherwise over draws of the noise if every clip has three, otherwise over seeds. If there are
/// too few of the requested unit, the next one in this order is used, and the scope states it.
///
/// # Errors
/// [`NotComparable`] naming the difference.
pub fn compare_runs(
    base: (&str, &MeasuredRuns),
    others: &[(&str, &MeasuredRuns)],
    across_sets: bool,
    unit: Option<IntervalUnit>,
) -> Result<RunComparison, NotComparable> {
    let against = |other: &(&str, &MeasuredRuns)| TwoSides::new(base, *other, across_sets, unit)?.compared(unit);
    Ok(RunComparison {
        schema: "skiagraph.compare/1".to_owned(),
        base: facts(base),
        others: others.iter().map(against).collect::<Result<_, _>>()?,
    })
}

fn facts((name, runs): (&str, &MeasuredRuns)) -> SideFacts {
    let trackers: BTreeSet<String> = runs.clips.values().map(|clip| clip.tracker.clone()).collect();
    let seeds = runs.clips.keys().map(|name| (name.clone(), describe_draws(&runs.sets_of(name)))).collect();
    SideFacts {
        name: name.to_owned(),
        trackers: trackers.into_iter().collect(),
        seeds,
        runs: runs.runs(),
        misread: Vec::new(),
    }
}

/// Seeds of the draws of a clip: `0 to 9`, `0 to 9 of each of 3 draws`, `0 to 9, 0 to 4 of 2 draws`.
fn describe_draws(sets: &[&MeasuredClip]) -> String {
    let mut seeds: Vec<String> = sets.iter().map(|set| describe_seeds(&set.seeds)).collect();
    seeds.dedup();
    match (sets.len(), seeds.len()) {
        (0 | 1, _) => seeds.concat(),
        (draws, 1) => format!("{} of each of {draws} draws", seeds[0]),
        (draws, _) => format!("{} of {draws} draws", seeds.join(", ")),
    }
}

/// Names the draws of a clip that the other side lacks by their set hashes; `None` if there are none.
fn unshared_draws(clip: &str, side: &str, mine: &[&MeasuredClip], theirs: &[&MeasuredClip]) -> Option<String> {
    let is_alone = |set: &&&MeasuredClip| theirs.iter().all(|their| set_difference(set, their).is_some());
    let hashes: Vec<String> = mine.iter().filter(is_alone).map(|set| format!("{:.12}", set.set_hash)).collect();
    let (plural, are) = if hashes.len() == 1 { ("", "is") } else { ("s", "are") };
    let named = hashes.join(", ");
    (!hashes.is_empty()).then(|| format!("draw{plural} {named} of `{clip}` {are} in `{side}` only"))
}

/// Names the markers that only the runs of one side estimate; `None` if there are none.
fn other_markers(clip: &str, side: &str, mine: &[&MeasuredClip], theirs: &[&MeasuredClip]) -> Option<String> {
    let (first, other) = (mine.first()?, theirs.first()?);
    let only = first.markers_beyond(other).join(", ");
    (!only.is_empty())
        .then(|| format!("`{clip}`: only `{side}` estimates {only}: compare the errors of single markers"))
}

/// The base and another side on their common sets.
struct TwoSides<'a> {
    names: [&'a str; 2],
    other: &'a MeasuredRuns,
    runs: MatchedRuns<'a>,
    skipped: Vec<String>,
}

impl<'a> TwoSides<'a> {
    fn new(
        base: (&'a str, &'a MeasuredRuns),
        other: (&'a str, &'a MeasuredRuns),
        across_sets: bool,
        unit: Option<IntervalUnit>,
    ) -> Result<Self, NotComparable> {
        let clips = MatchedRuns::across_sets(base.1, other.1);
        let names = |runs: &MeasuredRuns| runs.clips.keys().cloned().collect::<Vec<_>>().join(", ");
        let [base_name, other_name] = [base.0, other.0];
        if clips.sets.is_empty() {
            return Err(NotComparable(format!(
                "`{base_name}` and `{other_name}` have no common clip: {} and {}",
                names(base.1),
                names(other.1)
            )));
        }
        let same_sets = MatchedRuns::on_same_sets(base.1, other.1);
        let has_set = |clip: &str| same_sets.sets.iter().any(|set| set.clip == clip);
        let another = clips.sets.iter().filter(|set| !has_set(set.clip));
        let another = another.filter_map(|set| {
            let (base, other) = (set.base.first()?, set.other.first()?);
            let same_frames = base.frames == other.frames && base.frames_per_second == other.frames_per_second;
            Some((set.clip, set_difference(base, other)?, same_frames))
        });
        let another = another.collect::<Vec<_>>();
        if let Some((clip, what, same_frames)) = another.first().filter(|_| !across_sets) {
            // protocols of other frames differ, so that no metric is common
            let unpaired = if *same_frames { "; else compare them unpaired with --across-sets" } else { "" };
            return Err(NotComparable(format!(
                "`{clip}` was measured on different sets in `{base_name}` and `{other_name}` ({what}); if only the \
                 tracker or the calibration of its body differs, render one set and measure both on it with skiagraph \
                 track and its option --calibrate true or false{unpaired}"
            )));
        }
        let runs = if another.is_empty() { same_sets } else { clips };
        let alone = |mine: &MeasuredRuns, theirs: &MeasuredRuns, name: &str| -> Vec<String> {
            let only = mine.clips.keys().filter(|clip| !theirs.clips.contains_key(*clip));
            only.map(|clip| format!("clip `{clip}` is in `{name}` only")).collect()
        };
        let mut skipped = [alone(base.1, other.1, base.0), alone(other.1, base.1, other.0)].concat();
        for name in runs.clips().into_iter().filter(|_| runs.same_sets) {
            for (side, mine, theirs) in [(base.0, base.1, other.1), (other.0, other.1, base.1)] {
                skipped.extend(unshared_draws(name, side, &mine.sets_of(name), &theirs.sets_of(name)));
            }
        }
        for set in &runs.sets {
            skipped.extend(other_markers(set.clip, base.0, &set.base, &set.other));
            skipped.extend(other_markers(set.clip, other.0, &set.other, &set.base));
        }
        let runs = runs.with_unit(unit);
        skipped.extend(runs.seeds_left_out([base.0, other.0]));
        Ok(Self { names: [base.0, other.0], other: other.1, runs, skipped })
    }

    fn compared(mut self, requested: Option<IntervalUnit>) -> Result<AgainstBase, NotComparable> {
        let mut metrics: Vec<ComparedMetric> = METRICS.iter().filter_map(|metric| self.metric(metric)).collect();
        if metrics.is_empty() {
            let [base, other] = self.names;
            return Err(NotComparable(format!(
                "`{base}` and `{other}` have no common metric that was measured by the same protocol"
            )));
        }
        remove_aliases(&mut metrics, &self);
        judge(&mut metrics);
        let difference = |joint: &str| self.runs.difference(&|clip| clip.joint(joint));
        let joint = |joint: &str| Some(JointDifference { joint: joint.to_owned(), difference: difference(joint)? });
        Ok(AgainstBase {
            side: facts((self.names[1], self.other)),
            clips: self.runs.clips().into_iter().map(str::to_owned).collect(),
            unit: self.runs.unit,
            scope: self.runs.scope(requested),
            paired: self.runs.paired(),
            joints: LANDMARKS.iter().filter_map(|landmark| joint(landmark.name())).collect(),
            lost_tracks: self.lost_tracks(),
            skipped: self.skipped,
            metrics,
        })
    }

    fn without_value(&self, metric: &str) -> Vec<String> {
        let mut lacking = Vec::new();
        for set in &self.runs.sets {
            for (runs, side) in [&set.base, &set.other].into_iter().zip(self.names) {
                for run in runs {
                    let found = run.values(metric);
                    let lacks = |seed: &&u64| found.iter().all(|(with, _)| with != *seed);
                    let seeds: Vec<u64> = run.seeds.iter().filter(lacks).copied().collect();
                    if !seeds.is_empty() {
                        lacking.push(format!(
                            "`{}`, seed {} of `{side}` has no value",
                            set.clip,
                            describe_seeds(&seeds)
                        ));
                    }
                }
            }
        }
        lacking
    }

    /// All pairs of runs of the two sides on common sets.
    fn pairs(&self) -> impl Iterator<Item = (&'a MeasuredClip, &'a MeasuredClip)> {
        let of = |set: &MatchedSet<'a>| {
            let pairs = set.base.iter().copied().flat_map(|base| set.other.iter().map(move |other| (base, *other)));
            pairs.collect::<Vec<_>>()
        };
        self.runs.sets.iter().flat_map(of).collect::<Vec<_>>().into_iter()
    }

    fn metric(&mut self, metric: &Metric) -> Option<ComparedMetric> {
        let found: Vec<_> = self
            .pairs()
            .filter_map(|(a, b)| Some((a.metrics.get(metric.name)?, b.metrics.get(metric.name)?)))
            .collect();
        let first = found.first()?;
        if found.iter().any(|(a, b)| a.protocol != b.protocol || a.unit != b.unit) {
            self.skipped.push(format!("{} was measured by two protocols", metric.name));
            return None;
        }
        let of = |clip: &MeasuredClip| clip.values(metric.name);
        let difference = self.runs.difference(&of)?;
        let clips = self.runs.clips().into_iter();
        let per_clip = clips.filter_map(|name| Some((name.to_owned(), self.runs.of_clip(name).difference(&of)?)));
        Some(ComparedMetric {
            metric: metric.name.to_owned(),
            also: Vec::new(),
            unit: metric.unit,
            direction: metric.direction,
            p_holm: None,
            finding: Finding::NotShown,
            per_clip: per_clip.collect(),
            coverage: [0, 1].map(|side| self.coverage(side)),
            skipped: self.without_value(metric.name),
            protocol: first.0.protocol.clone(),
            difference,
        })
    }

    /// Runs of the base or of the other side.
    fn side(&self, side: usize) -> impl Iterator<Item = &'a MeasuredClip> {
        self.runs.sets.iter().flat_map(move |set| [&set.base, &set.other][side].iter().copied())
    }

    fn coverage(&self, side: usize) -> Option<f64> {
        let shares = self.side(side).flat_map(|run| run.values("coverage")).map(|(_, share)| share);
        mean(&shares.collect::<Vec<_>>())
    }

    fn lost_tracks(&self) -> LostTracks {
        let rate = |side: usize| lost_tracks(self.side(side));
        let (base, other) = (rate(0), rate(1));
        LostTracks { base, other, difference: base.zip(other).map(|(base, other)| base.difference(&other)) }
    }
}

/// The rate of runs that lost the body. Identical runs count once. A run on a recording, which has no truth, counts as
/// lost if it has no estimate at all.
pub fn lost_tracks<'a>(clips: impl Iterator<Item = &'a MeasuredClip>) -> Option<Rate> {
    let (mut lost, mut all) = (0, 0);
    for clip in clips {
        let tracked = clip.values("track_loss");
        let errors = if clip.values("humaneva_mm").is_empty() { "silhouette_iou" } else { "humaneva_mm" };
        let errors = clip.values(errors);
        let seeds = if clip.are_copies() { &clip.seeds[..1] } else { &clip.seeds };
        for seed in seeds {
            let of = |values: &[(u64, f64)]| values.iter().find(|(s, _)| s == seed).map(|(_, value)| *value);
            all += 1;
            lost += usize::from(of(&errors).is_none() || of(&tracked).is_some_and(|share| share > 0.0));
        }
    }
    Rate::new(lost, all)
}

/// Describes how two sets differ; `None` if they are the same.
pub(crate) fn set_difference(a: &MeasuredClip, b: &MeasuredClip) -> Option<String> {
    let short = |hash: &str| hash.chars().take(12).collect::<String>();
    if a.frames != b.frames {
        Some(format!("{} and {} frames", a.frames, b.frames))
    } else if a.frames_per_second != b.frames_per_second {
        Some(format!("{} and {} frames a second", a.frames_per_second, b.frames_per_second))
    } else if a.set_hash != b.set_hash {
        Some(format!("hashes {} and {}", short(&a.set_hash), short(&b.set_hash)))
    } else {
        None
    }
}

/// Pairs of a metric and an alias that need not be shown, given a predicate for whether two metrics agree in every run.
pub fn shown_once(agree: impl Fn(&str, &str) -> bool) -> Vec<(&'static str, &'static str)> {
    ALIASES.into_iter().filter(|(shown, alias)| agree(shown, alias)).collect()
}

fn remove_aliases(metrics: &mut Vec<ComparedMetric>, sides: &TwoSides<'_>) {
    let close = |a: &[(u64, f64)], b: &[(u64, f64)]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() <= 1e-9 * a.1.abs())
    };
    let agree = |one: &str, other: &str| {
        sides.pairs().flat_map(|(a, b)| [a, b]).all(|clip| close(&clip.values(one), &clip.values(other)))
    };
    for (shown, alias) in shown_once(agree) {
        if let Some(metric) = metrics.iter_mut().find(|metric| metric.metric == shown) {
            metric.also.push(alias.to_owned());
            metrics.retain(|metric| metric.metric != alias);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::difference::DifferenceRule;
    use super::super::measured_runs::MeasuredMetric;
    use super::super::measured_runs::fixture::clip;
    use super::*;
    use crate::Unit;

    fn side(clips: &[(&str, MeasuredClip)]) -> MeasuredRuns {
        let clips = clips.iter().map(|(name, clip)| ((*name).to_owned(), clip.clone())).collect();
        MeasuredRuns { clips, ..MeasuredRuns::default() }
    }

    const BASE: [f64; 5] = [30.0, 31.0, 29.0, 32.0, 30.0];
    const WORSE: [f64; 5] = [34.0, 35.5, 33.0, 36.0, 34.5];

    fn against(base: &MeasuredRuns, other: &MeasuredRuns) -> AgainstBase {
        compare_runs(("main", base), &[("mine", other)], false, None).unwrap().others.remove(0)
    }

    #[test]
    fn the_same_seeds_are_paired_and_other_seeds_are_not() {
        let base = side(&[("walk", clip("a", 0, &BASE))]);
        let paired = against(&base, &side(&[("walk", clip("a", 0, &WORSE))]));
        assert!(paired.paired);
        let error = &paired.metrics[0];
        assert_eq!((error.metric.as_str(), error.finding), ("humaneva_mm", Finding::Worse));
        assert_eq!(error.difference.rule, DifferenceRule::PairedT);
        assert_eq!(error.p_holm, error.difference.p, "the other metrics do not vary and are not tested");
        let unpaired = against(&base, &side(&[("walk", clip("a", 100, &WORSE))]));
        assert!(!unpaired.paired && unpaired.metrics[0].difference.rule == DifferenceRule::Welch);
        assert_eq!(paired.joints[0].joint, "pelvis");
        assert!((paired.joints[0].difference.difference - 0.5 * error.difference.difference).abs() < 1e-12);
    }

    #[test]
    fn copies_of_a_deterministic_run_show_no_difference_and_the_scope_states_the_remedy() {
        let base = side(&[("walk", clip("a", 0, &[30.0; 5]))]);
        let found = against(&base, &side(&[("walk", clip("a", 0, &[20.0; 5]))]));
        assert_eq!((found.metrics[0].finding, found.metrics[0].difference.p), (Finding::TooFew, None));
        assert!(found.scope.contains("bit-identical runs are one observation"), "{}", found.scope);
        assert_eq!(found.lost_tracks.base.unwrap().of, 1, "copies count once");
    }

    // 100 % against 17.9 % in every one of five pairs was "no difference shown".
    #[test]
    fn equal_difference_of_few_pairs_is_too_few() {
        let with_score = |errors: &[f64], score: f64| {
            let mut clip = clip("a", 0, errors);
            let per_seed = vec![Some(score); errors.len()];
            let metric = MeasuredMetric { unit: Unit::Fraction, protocol: String::new(), per_seed };
            clip.metrics.insert("pck150".to_owned(), metric);
            side(&[("walk", clip)])
        };
        let finding = |seeds: usize| {
            let base: Vec<f64> = (0..seeds).map(|i| 30.0 + i as f64).collect();
            let found = against(&with_score(&base, 1.0), &with_score(&base, 0.9));
            found.metrics.into_iter().find(|metric| metric.metric == "pck150").unwrap().finding
        };
        assert_eq!(finding(5), Finding::TooFew, "five of five in one direction happen by chance in 6 %");
        assert_eq!(finding(9), Finding::Worse);
    }

    #[test]
    fn clips_of_one_side_and_runs_without_a_value_are_named() {
        let mut lacking = WORSE;
        lacking[3] = f64::NAN;
        let base = side(&[("walk", clip("a", 0, &BASE)), ("jump", clip("j", 0, &BASE))]);
        let other = against(&base, &side(&[("walk", clip("a", 0, &lacking)), ("run", clip("r", 0, &BASE))]));
        assert_eq!(other.skipped, ["clip `jump` is in `main` only", "clip `run` is in `mine` only"]);
        assert_eq!(other.metrics[0].skipped, ["`walk`, seed 3 of `mine` has no value"]);
        assert_eq!(other.metrics[0].difference.runs, [4, 4], "the pair is left out");
        let lost = other.lost_tracks;
        assert_eq!((lost.base.unwrap().count, lost.other.unwrap().count), (0, 1), "no value at all is a lost track");
    }

    #[test]
    fn another_set_is_refused_by_name_and_compared_unpaired_on_request() {
        let base = side(&[("walk", clip("aaaa", 0, &BASE))]);
        let other = side(&[("walk", clip("bbbb", 0, &WORSE))]);
        let refused = compare_runs(("main", &base), &[("mine", &other)], false, None).unwrap_err();
        assert!(refused.to_string().contains("in `main` and `mine` (hashes aaaa and bbbb)"), "{refused}");
        let across = compare_runs(("main", &base), &[("mine", &other)], true, None).unwrap().others.remove(0);
        assert!(!across.paired && across.metrics[0].difference.rule == DifferenceRule::Welch);
        let elsewhere = side(&[("jump", clip("a", 0, &BASE))]);
        let refused = compare_runs(("main", &base), &[("mine", &elsewhere)], false, None).unwrap_err();
        assert_eq!(refused.to_string(), "`main` and `mine` have no common clip: walk and jump");
    }

    #[test]
    fn a_metric_by_another_protocol_is_left_out_and_named() {
        let base = side(&[("walk", clip("a", 0, &BASE))]);
        let mut other = side(&[("walk", clip("a", 0, &WORSE))]);
        if let Some(metric) = other.clips.get_mut("walk").and_then(|walk| walk.metrics.get_mut("humaneva_mm")) {
            metric.protocol = "otherwise".to_owned();
        }
        let found = against(&base, &other);
        assert_eq!(found.skipped, ["humaneva_mm was measured by two protocols"]);
        assert!(found.metrics.iter().all(|metric| metric.metric != "humaneva_mm"));
    }

    #[test]
    fn an_alias_with_the_same_values_is_shown_once() {
        let with_alias = |values: &[f64], off: f64| {
            let mut clip = clip("a", 0, values);
            let mut alias = clip.metrics["humaneva_mm"].clone();
            alias.per_seed[0] = alias.per_seed[0].map(|v| v + off);
            clip.metrics.insert("mpjpe_mm".to_owned(), alias);
            side(&[("walk", clip)])
        };
        let same = against(&with_alias(&BASE, 0.0), &with_alias(&WORSE, 0.0));
        assert_eq!(same.metrics[0].also, ["mpjpe_mm"]);
        assert!(same.metrics.iter().all(|metric| metric.metric != "mpjpe_mm"));
        let apart = against(&with_alias(&BASE, 0.0), &with_alias(&WORSE, 0.5));
        assert!(apart.metrics[0].also.is_empty() && apart.metrics[1].metric == "mpjpe_mm");
    }
}
