//! The runs of two sides on common sets, and their values by unit.

use std::collections::{BTreeMap, BTreeSet};

use super::IntervalUnit;
use super::difference::{ClipValues, Difference, difference, should_pair};
use super::measured_runs::{MeasuredClip, MeasuredRuns};
use crate::interval::FEWEST_RUNS;
use crate::mean;

/// The runs of two sides on one set, or on all sets of one clip if the sides have different sets.
#[derive(Clone, Debug)]
pub(crate) struct MatchedSet<'a> {
    /// The clip.
    pub clip: &'a str,
    /// Runs of the base.
    pub base: Vec<&'a MeasuredClip>,
    /// Runs of the other side.
    pub other: Vec<&'a MeasuredClip>,
}

/// Two sides, set by set, and the unit of their intervals.
#[derive(Clone, Debug)]
pub(crate) struct MatchedRuns<'a> {
    /// Sorted by clip name, then in the order of the base's draws.
    pub sets: Vec<MatchedSet<'a>>,
    /// Whether both sides were measured on the same sets.
    pub same_sets: bool,
    /// Unit of the intervals.
    pub unit: IntervalUnit,
}

impl<'a> MatchedRuns<'a> {
    /// The common sets of both sides, by hash.
    pub(crate) fn on_same_sets(base: &'a MeasuredRuns, other: &'a MeasuredRuns) -> Self {
        let matched = |(clip, set): (&'a String, &'a MeasuredClip)| {
            let theirs = other.sets_of(clip).into_iter().find(|their| are_same_set(set, their))?;
            Some(MatchedSet { clip, base: vec![set], other: vec![theirs] })
        };
        Self { sets: base.sets().filter_map(matched).collect(), same_sets: true, unit: IntervalUnit::Seeds }
    }

    /// The common clips of both sides, each with all its sets, equal or not.
    pub(crate) fn across_sets(base: &'a MeasuredRuns, other: &'a MeasuredRuns) -> Self {
        let names = base.clips.keys().filter(|name| other.clips.contains_key(*name));
        let matched = |clip: &'a String| MatchedSet { clip, base: base.sets_of(clip), other: other.sets_of(clip) };
        Self { sets: names.map(matched).collect(), same_sets: false, unit: IntervalUnit::Seeds }
    }

    /// With the unit of the widest scope that has at least three values, up to the requested one; otherwise seeds.
    pub(crate) fn with_unit(mut self, requested: Option<IntervalUnit>) -> Self {
        let most = requested.unwrap_or(IntervalUnit::Clips);
        let possible = |unit: &IntervalUnit| *unit <= most && self.has_at_least(FEWEST_RUNS, *unit);
        self.unit = IntervalUnit::ALL.into_iter().rev().find(possible).unwrap_or_default();
        self
    }

    /// The sets of one clip, over draws or seeds.
    pub(crate) fn of_clip(&self, clip: &str) -> Self {
        let sets = self.sets.iter().filter(|set| set.clip == clip).cloned().collect();
        let requested = (self.unit == IntervalUnit::Seeds).then_some(IntervalUnit::Seeds);
        Self { sets, ..self.clone() }.with_unit(requested)
    }

    /// Names of the clips, in order.
    pub(crate) fn clips(&self) -> Vec<&'a str> {
        let mut names: Vec<&str> = self.sets.iter().map(|set| set.clip).collect();
        names.dedup();
        names
    }

    /// Whether both sides have at least this number of units in every stratum: seeds of every set, draws of every clip,
    /// or clips in total. Identical runs of a deterministic tracker count as one, and so do draws that change nothing.
    pub(crate) fn has_at_least(&self, fewest: usize, unit: IntervalUnit) -> bool {
        match unit {
            IntervalUnit::Seeds => !self.are_copies() && self.sets.iter().all(|set| set.fewest_seeds() >= fewest),
            IntervalUnit::Draws => {
                let of =
                    |clip: &str| -> Vec<&MatchedSet<'_>> { self.sets.iter().filter(|set| set.clip == clip).collect() };
                let count = |sets: &[&MatchedSet<'_>]| {
                    if self.same_sets {
                        sets.len()
                    } else {
                        sets.iter().map(|set| set.base.len().min(set.other.len())).sum()
                    }
                };
                !self.sets.is_empty()
                    && self.clips().into_iter().map(of).all(|sets| count(&sets) >= fewest && !are_alike(&sets))
            }
            IntervalUnit::Clips => self.clips().len() >= fewest,
        }
    }

    /// Whether the runs of every set are identical on both sides, so that neither tracker draws random numbers.
    pub(crate) fn are_copies(&self) -> bool {
        !self.sets.is_empty()
            && self.sets.iter().all(|set| set.base.iter().chain(&set.other).all(|run| run.are_copies()))
    }

    pub(crate) fn paired(&self) -> bool {
        match self.unit {
            IntervalUnit::Seeds => {
                self.same_sets && (self.are_copies() || self.sets.iter().all(MatchedSet::should_pair))
            }
            IntervalUnit::Draws => self.same_sets,
            IntervalUnit::Clips => true,
        }
    }

    /// Whether seeds are paired, and some seeds of a side have no pair.
    pub(crate) fn leaves_seeds_out(&self) -> bool {
        let is_partly_shared = |set: &MatchedSet<'_>| set.unshared_seeds().iter().any(|seeds| !seeds.is_empty());
        self.unit == IntervalUnit::Seeds
            && !self.are_copies()
            && self.paired()
            && self.sets.iter().any(is_partly_shared)
    }

    /// The difference, other minus base, over the units.
    pub(crate) fn difference(&self, of: &dyn Fn(&MeasuredClip) -> Vec<(u64, f64)>) -> Option<Difference> {
        difference(&self.values(of), self.paired(), self.unit)
    }

    /// Values of both sides by unit, from the values of the seeds of every set. In sets with the same seeds on both
    /// sides, a seed without a value on one side is omitted on both.
    pub(crate) fn values(&self, of: &dyn Fn(&MeasuredClip) -> Vec<(u64, f64)>) -> Vec<ClipValues> {
        let one = self.are_copies();
        // for seeds, `difference` omits them and counts the remaining pairs
        let averaged = self.unit != IntervalUnit::Seeds;
        let seeds: Vec<(&str, SetValues)> =
            self.sets.iter().map(|set| (set.clip, set.values(of, self.same_sets && averaged, one))).collect();
        if self.unit == IntervalUnit::Seeds {
            return seeds.into_iter().map(|(_, values)| values.pooled()).collect();
        }
        let mut clips: BTreeMap<&str, ClipValues> = BTreeMap::new();
        for (clip, values) in &seeds {
            clips.entry(clip).or_default().add_draws(values, self.same_sets);
        }
        if self.unit == IntervalUnit::Draws {
            return clips.into_values().collect();
        }
        let mut all = ClipValues::default();
        for (number, clip) in (0..).zip(clips.values()) {
            let average = |values: &[(u64, f64)]| mean(&values.iter().map(|(_, value)| *value).collect::<Vec<_>>());
            all.base.extend(average(&clip.base).map(|value| (number, value)));
            all.other.extend(average(&clip.other).map(|value| (number, value)));
        }
        vec![all]
    }
}

impl MeasuredRuns {
    /// Whether there are at least this number of units: seeds of every set, draws of every clip, or clips. Identical
    /// runs of a deterministic tracker count as one.
    pub fn has_at_least(&self, fewest: usize, unit: IntervalUnit) -> bool {
        MatchedRuns::on_same_sets(self, self).has_at_least(fewest, unit)
    }
}

fn are_same_set(a: &MeasuredClip, b: &MeasuredClip) -> bool {
    a.set_hash == b.set_hash && a.frames == b.frames && a.frames_per_second == b.frames_per_second
}

/// Whether draws of one clip change nothing: the first runs of all sets have the same values.
fn are_alike(sets: &[&MatchedSet<'_>]) -> bool {
    let first_of = |run: &MeasuredClip| {
        let first = |values: &Vec<Option<f64>>| values.first().copied().flatten();
        let metrics = run.metrics.iter().map(|(name, metric)| (name.clone(), first(&metric.per_seed)));
        metrics.chain(run.joints.iter().map(|(name, values)| (name.clone(), first(values)))).collect::<Vec<_>>()
    };
    let value = |set: &MatchedSet<'_>| [&set.base, &set.other].map(|side| side.first().map(|run| first_of(run)));
    sets.len() > 1 && sets.windows(2).all(|pair| value(pair[0]) == value(pair[1]))
}

/// Values of the seeds of one or several sets.
struct SetValues {
    base: Vec<Vec<(u64, f64)>>,
    other: Vec<Vec<(u64, f64)>>,
}

impl MatchedSet<'_> {
    /// Number of seeds of the side with fewer.
    fn fewest_seeds(&self) -> usize {
        let count = |side: &[&MeasuredClip]| side.iter().map(|run| run.seeds.len()).sum::<usize>();
        count(&self.base).min(count(&self.other))
    }

    /// Seeds of each side that the other lacks, sorted.
    pub(crate) fn unshared_seeds(&self) -> [Vec<u64>; 2] {
        let seeds = |side: &[&MeasuredClip]| side.iter().flat_map(|run| run.seeds.clone()).collect::<BTreeSet<u64>>();
        let (base, other) = (seeds(&self.base), seeds(&self.other));
        [base.difference(&other).copied().collect(), other.difference(&base).copied().collect()]
    }

    pub(crate) fn seeds_in_common(&self) -> usize {
        let unshared = self.unshared_seeds()[0].len();
        self.base.iter().map(|run| run.seeds.len()).sum::<usize>().saturating_sub(unshared)
    }

    fn should_pair(&self) -> bool {
        match (self.base.as_slice(), self.other.as_slice()) {
            ([base], [other]) => should_pair(&base.seeds, &other.seeds),
            _ => false,
        }
    }

    /// Values of the seeds; those of one run if all `copies` are identical.
    fn values(&self, of: &dyn Fn(&MeasuredClip) -> Vec<(u64, f64)>, same_set: bool, copies: bool) -> SetValues {
        let side = |runs: &[&MeasuredClip]| -> Vec<Vec<(u64, f64)>> {
            let once = |values: Vec<(u64, f64)>| values.into_iter().take(1).map(|(_, value)| (0, value)).collect();
            runs.iter().map(|run| if copies { once(of(run)) } else { of(run) }).collect()
        };
        let mut values = SetValues { base: side(&self.base), other: side(&self.other) };
        if let ([base], [other], true) = (self.base.as_slice(), self.other.as_slice(), same_set && !copies)
            && same_seeds(base, other)
        {
            let seeds = |values: &[Vec<(u64, f64)>]| values.iter().flatten().map(|(s, _)| *s).collect::<BTreeSet<_>>();
            let [a, b] = [seeds(&values.base), seeds(&values.other)];
            values.base.iter_mut().for_each(|values| values.retain(|(seed, _)| b.contains(seed)));
            values.other.iter_mut().for_each(|values| values.retain(|(seed, _)| a.contains(seed)));
        }
        values
    }
}

fn same_seeds(a: &MeasuredClip, b: &MeasuredClip) -> bool {
    let set = |clip: &MeasuredClip| clip.seeds.iter().copied().collect::<BTreeSet<u64>>();
    set(a) == set(b)
}

impl SetValues {
    /// The values of all seeds. Those of several sets are not paired and are numbered consecutively.
    fn pooled(self) -> ClipValues {
        let side = |mut sets: Vec<Vec<(u64, f64)>>| match sets.len() {
            1 => sets.remove(0),
            _ => (0..).zip(sets.into_iter().flatten().map(|(_, value)| value)).collect(),
        };
        ClipValues { base: side(self.base), other: side(self.other) }
    }
}

impl ClipValues {
    /// Adds the mean of every set of a clip with the set's number. If a set lacks values on one side, it is omitted on
    /// both.
    fn add_draws(&mut self, values: &SetValues, same_sets: bool) {
        let means = |sets: &[Vec<(u64, f64)>]| -> Vec<f64> {
            sets.iter().filter_map(|set| mean(&set.iter().map(|(_, value)| *value).collect::<Vec<_>>())).collect()
        };
        let (base, other) = (means(&values.base), means(&values.other));
        if same_sets && (base.is_empty() || other.is_empty()) {
            return;
        }
        let numbered = |side: &mut Vec<(u64, f64)>, means: Vec<f64>| {
            let first = side.len() as u64;
            side.extend((first..).zip(means));
        };
        numbered(&mut self.base, base);
        numbered(&mut self.other, other);
    }
}

#[cfg(test)]
mod tests {
    use super::super::DifferenceRule;
    use super::super::measured_runs::fixture;
    use super::*;

    fn error(clip: &MeasuredClip) -> Vec<(u64, f64)> {
        clip.values("humaneva_mm")
    }

    /// Clips with draws with the errors of their seeds.
    fn runs(clips: &[(&str, &[&[f64]])]) -> MeasuredRuns {
        let mut all = MeasuredRuns::default();
        for (name, draws) in clips {
            for (number, errors) in draws.iter().enumerate() {
                let mut clip = fixture::clip(&format!("{name}-{number}"), 0, errors);
                clip.scene_hash = Some((*name).to_owned());
                all.add(name, clip).unwrap();
            }
        }
        all
    }

    /// Five motions on which the sides differ by 4, -4, 3, -3 and 0, with little variation between seeds: the mean
    /// difference is precise over seeds, but not over clips.
    #[test]
    fn clips_are_the_cluster_form_a_t_interval_of_the_differences_of_their_means() {
        let [a, b, c, d, e] =
            [[30.0, 30.1, 29.9], [40.0, 40.2, 39.8], [50.0, 50.1, 49.9], [20.0; 3], [60.0, 60.1, 59.9]];
        let moved = |values: [f64; 3], by: f64| [values[0] + by + 0.05, values[1] + by - 0.05, values[2] + by];
        let (a2, b2, c2, d2, e2) = (moved(a, 4.0), moved(b, -4.0), moved(c, 3.0), moved(d, -3.0), moved(e, 0.0));
        let base = runs(&[("a", &[&a]), ("b", &[&b]), ("c", &[&c]), ("d", &[&d]), ("e", &[&e])]);
        let other = runs(&[("a", &[&a2]), ("b", &[&b2]), ("c", &[&c2]), ("d", &[&d2]), ("e", &[&e2])]);
        let matched = MatchedRuns::on_same_sets(&base, &other).with_unit(None);
        let found = matched.difference(&error).unwrap();
        assert_eq!((found.over, found.rule, found.runs), (IntervalUnit::Clips, DifferenceRule::PairedT, [5, 5]));
        assert_eq!(found.freedom, Some(4.0), "number of clips minus one");
        // standard deviation of 4, -4, 3, -3, 0: sqrt(50 / 4); scipy.stats.t.ppf(0.975, 4) = 2.776445
        let half = 2.776_445 * (50.0_f64 / 4.0 / 5.0).sqrt();
        let ends = found.ci95.unwrap();
        assert!((ends.high - ends.low - 2.0 * half).abs() < 1e-4, "{ends:?} {half}");
        let seeds = MatchedRuns::on_same_sets(&base, &other).with_unit(Some(IntervalUnit::Seeds));
        let narrow = seeds.difference(&error).unwrap();
        assert_eq!((narrow.over, narrow.runs), (IntervalUnit::Seeds, [15, 15]));
        assert!(narrow.standard_error.unwrap() < 0.05 && (narrow.difference - found.difference).abs() < 1e-9);
    }

    #[test]
    fn draws_are_the_means_of_their_seeds_and_are_paired_by_their_sets() {
        let base = runs(&[("walk", &[&[30.0, 32.0], &[31.0, 31.0], &[35.0, 37.0], &[28.0, 28.0]])]);
        let other = runs(&[("walk", &[&[33.0, 33.0], &[32.0, 34.0], &[38.0, 38.0], &[29.0, 30.0]])]);
        let matched = MatchedRuns::on_same_sets(&base, &other).with_unit(None);
        assert_eq!(matched.unit, IntervalUnit::Draws);
        let values = matched.values(&error);
        assert_eq!(values[0].base, [(0, 31.0), (1, 31.0), (2, 36.0), (3, 28.0)]);
        let found = matched.difference(&error).unwrap();
        assert_eq!((found.runs, found.freedom, found.difference), ([4, 4], Some(3.0), 1.875));
        assert_eq!(found.to_string(), "Student's t on 4 pairs of draws");
    }

    #[test]
    fn two_clips_are_too_few_and_their_seeds_are_the_unit() {
        let base = runs(&[("a", &[&[1.0, 2.0, 4.0]]), ("b", &[&[3.0, 5.0, 4.0]])]);
        let other = runs(&[("a", &[&[2.0, 2.5, 4.0]]), ("b", &[&[3.0, 6.0, 4.5]])]);
        let matched = MatchedRuns::on_same_sets(&base, &other).with_unit(Some(IntervalUnit::Clips));
        assert_eq!(matched.unit, IntervalUnit::Seeds);
        let words = matched.scope(Some(IntervalUnit::Clips));
        assert!(words.starts_with("too few clips that differ (3 or more); "), "{words}");
    }

    /// Regression: five copies gave "exact, better".
    #[test]
    fn five_copies_of_a_deterministic_run_are_one_observation_of_a_set() {
        let (base, other) = (runs(&[("walk", &[&[30.0; 5]])]), runs(&[("walk", &[&[20.0; 5]])]));
        let matched = MatchedRuns::on_same_sets(&base, &other).with_unit(None);
        let found = matched.difference(&error).unwrap();
        assert_eq!((found.rule, found.p, found.runs), (DifferenceRule::TooFew, None, [1, 1]));
        assert!(!matched.has_at_least(2, IntervalUnit::Seeds));
        let words = matched.scope(None);
        assert!(words.contains("bit-identical") && words.contains("observation.seed=2"), "{words}");
        // against a tracker that varies its value is exact, and the other's seeds are the unit
        let random = runs(&[("walk", &[&[31.0, 32.0, 30.0, 33.0, 31.5]])]);
        let matched = MatchedRuns::on_same_sets(&base, &random).with_unit(None);
        let found = matched.difference(&error).unwrap();
        assert_eq!((found.rule, found.runs), (DifferenceRule::PairedT, [5, 5]));
    }

    #[test]
    fn a_deterministic_tracker_has_an_interval_over_draws_and_none_where_draws_change_nothing() {
        let draws: Vec<[f64; 1]> = [30.0, 31.0, 32.5, 29.0, 30.5].map(|error| [error]).into();
        let slices: Vec<&[f64]> = draws.iter().map(<[f64; 1]>::as_slice).collect();
        let worse: Vec<[f64; 1]> = draws.iter().map(|[error]| [error + 2.0 + 0.1 * (error - 30.0)]).collect();
        let worse: Vec<&[f64]> = worse.iter().map(<[f64; 1]>::as_slice).collect();
        let (base, other) = (runs(&[("walk", &slices)]), runs(&[("walk", &worse)]));
        let matched = MatchedRuns::on_same_sets(&base, &other).with_unit(None);
        assert_eq!(matched.unit, IntervalUnit::Draws);
        assert!(matched.difference(&error).unwrap().ci95.is_some_and(|ends| ends.low > 1.5));
        let exact: [&[f64]; 3] = [&[30.0], &[30.0], &[30.0]];
        let (base, other) = (runs(&[("walk", &exact)]), runs(&[("walk", &exact)]));
        let matched = MatchedRuns::on_same_sets(&base, &other).with_unit(None);
        assert!(!matched.has_at_least(3, IntervalUnit::Draws), "observation.seed changes nothing in exact silhouettes");
    }
}
