//! One side against another, metric by metric.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::difference::{ClipValues, Difference, DifferenceRule, difference, do_pair, independent_difference};
use super::holm::holm;
use super::measured_runs::{MeasuredClip, MeasuredRuns, seeds_in_words};
use super::rate::{Rate, RateDifference};
use crate::body::LANDMARKS;
use crate::evaluation::{Direction, METRICS, Metric, Unit, find_metric, mean};

/// A finding holds where its p value, adjusted for the number of metrics, is at most this.
const SIGNIFICANCE: f64 = 0.05;

/// Metrics that agree wherever every marker is estimated, the one that is shown first.
const ALIASES: [(&str, &str); 2] = [("humaneva_mm", "mpjpe_mm"), ("humaneva_mm", "humaneva_official_mm")];

/// Several sides against the first: what `skiagraph compare --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunComparison {
    /// `skiagraph.compare/1`.
    pub schema: String,
    /// The side that all others are compared with.
    pub base: SideFacts,
    /// The others, in the order in which they were given.
    pub others: Vec<AgainstBase>,
}

/// What a side is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SideFacts {
    /// As the user calls it.
    pub name: String,
    /// Its trackers.
    pub trackers: Vec<String>,
    /// Seeds of every clip, in words.
    pub seeds: BTreeMap<String, String>,
    /// Runs, clip x seed.
    pub runs: usize,
}

/// One side against the base.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AgainstBase {
    /// The side.
    #[serde(flatten)]
    pub side: SideFacts,
    /// Clips that both have.
    pub clips: Vec<String>,
    /// Whether runs of the seeds in common are paired by clip x seed ([`do_pair`]); a metric of which all runs tell
    /// more has a rule without pairs.
    pub paired: bool,
    /// What was left out, and why.
    pub skipped: Vec<String>,
    /// Metric by metric, in the order of [`METRICS`].
    pub metrics: Vec<ComparedMetric>,
    /// Marker by marker, in the order of [`LANDMARKS`].
    pub joints: Vec<JointDifference>,
    /// Runs that lost the body.
    pub lost_tracks: LostTracks,
}

/// One metric of two sides.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedMetric {
    /// [`Metric::name`].
    pub metric: String,
    /// Metrics with the same value in every run, which are not shown again.
    pub also: Vec<String>,
    /// Unit of all values but p.
    pub unit: Unit,
    /// Which way it is better.
    pub direction: Direction,
    /// Over all common clips.
    #[serde(flatten)]
    pub difference: Difference,
    /// The p value adjusted for the number of metrics ([`holm`]).
    pub p_holm: Option<f64>,
    /// What can be said.
    pub finding: Finding,
    /// Clip by clip.
    pub per_clip: BTreeMap<String, Difference>,
    /// Mean coverage of the runs of base and other: errors speak of the rest of the markers only.
    pub coverage: [Option<f64>; 2],
    /// Runs without a value, left out with their pairs.
    pub skipped: Vec<String>,
    /// Joint set, alignment, mask rule and frames, of the first clip.
    pub protocol: String,
}

/// What can be said of a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// The other side is better.
    Better,
    /// The other side is worse.
    Worse,
    /// They differ in a metric that is neither better nor worse.
    Differs,
    /// Equal in every run.
    Same,
    /// No difference is shown.
    NotShown,
    /// Too few runs to say.
    TooFew,
}

/// The error of one marker.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointDifference {
    /// [`crate::body::Landmark::name`].
    pub joint: String,
    /// Mean error, millimetres, over all common clips.
    #[serde(flatten)]
    pub difference: Difference,
}

/// Runs that lost the body: runs with a frame that counts as lost, and runs that could not be measured at all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LostTracks {
    /// Of the base.
    pub base: Option<Rate>,
    /// Of the other side.
    pub other: Option<Rate>,
    /// Other minus base.
    pub difference: Option<RateDifference>,
}

/// Why sides cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotComparable {
    /// They have no clip in common.
    #[error("`{base}` and `{other}` have no clip in common: {base_clips} and {other_clips}")]
    NoClip {
        /// Name of the base.
        base: String,
        /// Name of the other side.
        other: String,
        /// Clips of the base.
        base_clips: String,
        /// Clips of the other side.
        other_clips: String,
    },
    /// A clip was measured on two sets.
    #[error(
        "`{clip}` is another set in `{other}` than in `{base}` ({what}); measure both on one set, or compare them \
         unpaired with --across-sets"
    )]
    Sets {
        /// The clip.
        clip: String,
        /// Name of the base.
        base: String,
        /// Name of the other side.
        other: String,
        /// The difference, in words.
        what: String,
    },
    /// Nothing was measured on both sides in the same way.
    #[error("`{base}` and `{other}` have no metric in common that was measured by the same protocol")]
    NoMetric {
        /// Name of the base.
        base: String,
        /// Name of the other side.
        other: String,
    },
}

/// Compares every side with the base. Sides on other sets of the same name are refused unless `across_sets`; then they
/// are compared unpaired.
///
/// # Errors
/// [`NotComparable`] naming the difference.
pub fn compare_runs(
    base: (&str, &MeasuredRuns),
    others: &[(&str, &MeasuredRuns)],
    across_sets: bool,
) -> Result<RunComparison, NotComparable> {
    let against = |other: &(&str, &MeasuredRuns)| TwoSides::new(base, *other, across_sets)?.compared();
    Ok(RunComparison {
        schema: "skiagraph.compare/1".to_owned(),
        base: facts(base),
        others: others.iter().map(against).collect::<Result<_, _>>()?,
    })
}

fn facts((name, runs): (&str, &MeasuredRuns)) -> SideFacts {
    let trackers: BTreeSet<String> = runs.clips.values().map(|clip| clip.tracker.clone()).collect();
    let seeds = runs.clips.iter().map(|(name, clip)| (name.clone(), seeds_in_words(&clip.seeds))).collect();
    SideFacts { name: name.to_owned(), trackers: trackers.into_iter().collect(), seeds, runs: runs.runs() }
}

/// Base and another side on their common clips.
struct TwoSides<'a> {
    names: [&'a str; 2],
    other: &'a MeasuredRuns,
    clips: Vec<(&'a str, &'a MeasuredClip, &'a MeasuredClip)>,
    skipped: Vec<String>,
    one_set: bool,
}

impl<'a> TwoSides<'a> {
    fn new(
        base: (&'a str, &'a MeasuredRuns),
        other: (&'a str, &'a MeasuredRuns),
        across_sets: bool,
    ) -> Result<Self, NotComparable> {
        let common =
            base.1.clips.iter().filter_map(|(name, clip)| Some((name.as_str(), clip, other.1.clips.get(name)?)));
        let clips: Vec<_> = common.collect();
        let names = |runs: &MeasuredRuns| runs.clips.keys().cloned().collect::<Vec<_>>().join(", ");
        let [base_name, other_name] = [base.0, other.0].map(str::to_owned);
        if clips.is_empty() {
            let (base_clips, other_clips) = (names(base.1), names(other.1));
            return Err(NotComparable::NoClip { base: base_name, other: other_name, base_clips, other_clips });
        }
        let another = clips.iter().find_map(|(name, a, b)| Some((*name, set_difference(a, b)?)));
        if let Some((clip, what)) = another.as_ref().filter(|_| !across_sets) {
            let (clip, what) = ((*clip).to_owned(), what.clone());
            return Err(NotComparable::Sets { clip, base: base_name, other: other_name, what });
        }
        let alone = |mine: &MeasuredRuns, theirs: &MeasuredRuns, name: &str| -> Vec<String> {
            let only = mine.clips.keys().filter(|clip| !theirs.clips.contains_key(*clip));
            only.map(|clip| format!("clip `{clip}` is in `{name}` only")).collect()
        };
        let skipped = [alone(base.1, other.1, base.0), alone(other.1, base.1, other.0)].concat();
        Ok(Self { names: [base.0, other.0], other: other.1, clips, skipped, one_set: another.is_none() })
    }

    fn compared(mut self) -> Result<AgainstBase, NotComparable> {
        let mut metrics: Vec<ComparedMetric> = METRICS.iter().filter_map(|metric| self.metric(metric)).collect();
        if metrics.is_empty() {
            let [base, other] = self.names.map(str::to_owned);
            return Err(NotComparable::NoMetric { base, other });
        }
        shown_once_in(&mut metrics, &self);
        judge(&mut metrics);
        let difference = |joint: &str| self.difference(&self.values(|clip| clip.joint(joint)).0);
        let joint = |joint: &str| Some(JointDifference { joint: joint.to_owned(), difference: difference(joint)? });
        Ok(AgainstBase {
            side: facts((self.names[1], self.other)),
            clips: self.clips.iter().map(|(name, ..)| (*name).to_owned()).collect(),
            paired: self.one_set && self.clips.iter().all(|(_, a, b)| do_pair(&a.seeds, &b.seeds)),
            joints: LANDMARKS.iter().filter_map(|landmark| joint(landmark.name())).collect(),
            lost_tracks: self.lost_tracks(),
            skipped: self.skipped,
            metrics,
        })
    }

    fn difference(&self, clips: &[ClipValues]) -> Option<Difference> {
        if self.one_set { difference(clips) } else { independent_difference(clips) }
    }

    /// Values of both sides, clip by clip, and which runs have none. Of sides with the same seeds, a seed that lacks a
    /// value on one side is left out on both.
    fn values(&self, of: impl Fn(&MeasuredClip) -> Vec<(u64, f64)>) -> (Vec<ClipValues>, Vec<String>) {
        let (mut clips, mut skipped) = (Vec::new(), Vec::new());
        for (name, base, other) in &self.clips {
            let (mut values, sides) = (ClipValues { base: of(base), other: of(other) }, [base, other]);
            for ((clip, found), side) in sides.into_iter().zip([&values.base, &values.other]).zip(self.names) {
                let lacks = |seed: &&u64| found.iter().all(|(with, _)| with != *seed);
                let lacking: Vec<u64> = clip.seeds.iter().filter(lacks).copied().collect();
                if !lacking.is_empty() {
                    skipped.push(format!("`{name}`, seed {} of `{side}` has no value", seeds_in_words(&lacking)));
                }
            }
            if self.one_set && same_seeds(base, other) {
                let [a, b] = [&values.base, &values.other].map(|v| v.iter().map(|(s, _)| *s).collect::<BTreeSet<_>>());
                values.base.retain(|(seed, _)| b.contains(seed));
                values.other.retain(|(seed, _)| a.contains(seed));
            }
            clips.push(values);
        }
        (clips, skipped)
    }

    fn metric(&mut self, metric: &Metric) -> Option<ComparedMetric> {
        let found: Vec<_> = self
            .clips
            .iter()
            .filter_map(|(_, a, b)| Some((a.metrics.get(metric.name)?, b.metrics.get(metric.name)?)))
            .collect();
        let first = found.first()?;
        if found.iter().any(|(a, b)| a.protocol != b.protocol || a.unit != b.unit) {
            self.skipped.push(format!("{} was measured by two protocols", metric.name));
            return None;
        }
        let (values, skipped) = self.values(|clip| clip.values(metric.name));
        let difference = self.difference(&values)?;
        let clips = self.clips.iter().zip(&values);
        let per_clip = clips.filter_map(|((name, ..), values)| {
            Some(((*name).to_owned(), self.difference(std::slice::from_ref(values))?))
        });
        Some(ComparedMetric {
            metric: metric.name.to_owned(),
            also: Vec::new(),
            unit: metric.unit,
            direction: metric.direction,
            p_holm: None,
            finding: Finding::NotShown,
            per_clip: per_clip.collect(),
            coverage: [0, 1].map(|side| self.coverage(side)),
            skipped,
            protocol: first.0.protocol.clone(),
            difference,
        })
    }

    fn coverage(&self, side: usize) -> Option<f64> {
        let of = |(_, a, b): &(&str, &MeasuredClip, &MeasuredClip)| [a, b][side].values("coverage");
        mean(&self.clips.iter().flat_map(of).map(|(_, share)| share).collect::<Vec<_>>())
    }

    fn lost_tracks(&self) -> LostTracks {
        let rate = |side: usize| lost_tracks(self.clips.iter().map(|(_, a, b)| [*a, *b][side]));
        let (base, other) = (rate(0), rate(1));
        LostTracks { base, other, difference: base.zip(other).map(|(base, other)| base.difference(&other)) }
    }
}

/// The rate of runs that lost the body.
pub fn lost_tracks<'a>(clips: impl Iterator<Item = &'a MeasuredClip>) -> Option<Rate> {
    let (mut lost, mut all) = (0, 0);
    for clip in clips {
        let (tracked, errors) = (clip.values("track_loss"), clip.values("humaneva_mm"));
        for seed in &clip.seeds {
            let of = |values: &[(u64, f64)]| values.iter().find(|(s, _)| s == seed).map(|(_, value)| *value);
            all += 1;
            lost += usize::from(of(&errors).is_none() || of(&tracked).is_some_and(|share| share > 0.0));
        }
    }
    Rate::new(lost, all)
}

/// How two sets differ, in words; `None` if they are one.
pub(in crate::evaluation) fn set_difference(a: &MeasuredClip, b: &MeasuredClip) -> Option<String> {
    let short = |hash: &str| hash.chars().take(12).collect::<String>();
    match () {
        () if a.frames != b.frames => Some(format!("{} and {} frames", a.frames, b.frames)),
        () if a.frames_per_second != b.frames_per_second => {
            Some(format!("{} and {} frames a second", a.frames_per_second, b.frames_per_second))
        }
        () if a.set_hash != b.set_hash => Some(format!("hashes {} and {}", short(&a.set_hash), short(&b.set_hash))),
        () => None,
    }
}

fn same_seeds(a: &MeasuredClip, b: &MeasuredClip) -> bool {
    let set = |clip: &MeasuredClip| clip.seeds.iter().copied().collect::<BTreeSet<u64>>();
    set(a) == set(b)
}

/// Names that `ALIASES` need not show again, for a predicate that tells whether two metrics agree in every run:
/// shown, with what is left out beside it.
pub fn shown_once(agree: impl Fn(&str, &str) -> bool) -> Vec<(&'static str, &'static str)> {
    ALIASES.into_iter().filter(|(shown, alias)| agree(shown, alias)).collect()
}

fn shown_once_in(metrics: &mut Vec<ComparedMetric>, sides: &TwoSides<'_>) {
    let close = |a: &[(u64, f64)], b: &[(u64, f64)]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() <= 1e-9 * a.1.abs())
    };
    let agree = |one: &str, other: &str| {
        sides.clips.iter().flat_map(|(_, a, b)| [a, b]).all(|clip| close(&clip.values(one), &clip.values(other)))
    };
    for (shown, alias) in shown_once(agree) {
        if let Some(metric) = metrics.iter_mut().find(|metric| metric.metric == shown) {
            metric.also.push(alias.to_owned());
            metrics.retain(|metric| metric.metric != alias);
        }
    }
}

/// Adjusts p values over all metrics of the estimate, and says what holds.
fn judge(metrics: &mut [ComparedMetric]) {
    // what is said of the actor is no test of the tracker
    let of_estimate = |metric: &ComparedMetric| !metric.metric.starts_with("truth_");
    let tested: Vec<usize> =
        (0..metrics.len()).filter(|i| of_estimate(&metrics[*i]) && metrics[*i].difference.p.is_some()).collect();
    let p: Vec<f64> = tested.iter().filter_map(|i| metrics[*i].difference.p).collect();
    for (index, adjusted) in tested.into_iter().zip(holm(&p)) {
        metrics[index].p_holm = Some(adjusted);
    }
    metrics.iter_mut().for_each(|metric| metric.finding = finding(metric));
}

fn finding(metric: &ComparedMetric) -> Finding {
    let Difference { base, other, rule, difference, .. } = metric.difference;
    let is_worse = find_metric(&metric.metric).is_some_and(|m| m.is_worse(other, base));
    let direction = match (metric.direction, is_worse) {
        (Direction::Neither, _) => Finding::Differs,
        (_, true) => Finding::Worse,
        (_, false) => Finding::Better,
    };
    match rule {
        DifferenceRule::Exact if difference == 0.0 => Finding::Same,
        DifferenceRule::Exact => direction,
        DifferenceRule::TooFew => Finding::TooFew,
        _ if metric.p_holm.is_some_and(|p| p <= SIGNIFICANCE) => direction,
        _ => Finding::NotShown,
    }
}

#[cfg(test)]
mod tests {
    use super::super::measured_runs::fixture::clip;
    use super::*;

    fn side(clips: &[(&str, MeasuredClip)]) -> MeasuredRuns {
        MeasuredRuns { clips: clips.iter().map(|(name, clip)| ((*name).to_owned(), clip.clone())).collect() }
    }

    const BASE: [f64; 5] = [30.0, 31.0, 29.0, 32.0, 30.0];
    const WORSE: [f64; 5] = [34.0, 35.5, 33.0, 36.0, 34.5];

    fn against(base: &MeasuredRuns, other: &MeasuredRuns) -> AgainstBase {
        compare_runs(("main", base), &[("mine", other)], false).unwrap().others.remove(0)
    }

    #[test]
    fn the_same_seeds_are_paired_and_other_seeds_are_not() {
        let base = side(&[("walk", clip("a", 0, &BASE))]);
        let paired = against(&base, &side(&[("walk", clip("a", 0, &WORSE))]));
        assert!(paired.paired);
        let error = &paired.metrics[0];
        assert_eq!(
            (error.metric.as_str(), error.finding, error.difference.rule),
            ("humaneva_mm", Finding::Worse, DifferenceRule::PairedT)
        );
        assert_eq!(error.p_holm, error.difference.p, "the other metrics do not vary and are no tests");
        let unpaired = against(&base, &side(&[("walk", clip("a", 100, &WORSE))]));
        assert!(!unpaired.paired && unpaired.metrics[0].difference.rule == DifferenceRule::Welch);
        assert_eq!(paired.joints[0].joint, "pelvis");
        assert!((paired.joints[0].difference.difference - 0.5 * error.difference.difference).abs() < 1e-12);
    }

    /// It said "unpaired" where its numbers were those of pairs.
    #[test]
    fn seeds_in_common_are_said_to_be_paired_where_one_side_has_more() {
        let more = [BASE.to_vec(), vec![30.5, 31.5]].concat();
        let found = against(&side(&[("walk", clip("a", 0, &more))]), &side(&[("walk", clip("a", 0, &WORSE))]));
        assert!(found.paired && found.metrics[0].difference.rule == DifferenceRule::PairedT, "{:?}", found.metrics[0]);
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
        let refused = compare_runs(("main", &base), &[("mine", &other)], false).unwrap_err();
        assert!(refused.to_string().contains("(hashes aaaa and bbbb)"), "{refused}");
        let across = compare_runs(("main", &base), &[("mine", &other)], true).unwrap().others.remove(0);
        assert!(!across.paired && across.metrics[0].difference.rule == DifferenceRule::Welch);
        let elsewhere = side(&[("jump", clip("a", 0, &BASE))]);
        let refused = compare_runs(("main", &base), &[("mine", &elsewhere)], false).unwrap_err();
        assert_eq!(refused.to_string(), "`main` and `mine` have no clip in common: walk and jump");
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
