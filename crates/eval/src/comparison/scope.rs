//! What intervals are over.

use super::interval_unit::IntervalUnit;
use super::matched_runs::{MatchedRuns, MatchedSet};
use super::measured_runs::{MeasuredClip, describe_seeds};
use crate::interval::FEWEST_RUNS;
use crate::interval_words::WITHOUT_SEEDS;

/// Greatest number of clips that a sentence names.
const NAMED: usize = 6;

impl MatchedRuns<'_> {
    /// What the intervals are over; `requested` is the requested unit.
    pub(crate) fn scope(&self, requested: Option<IntervalUnit>) -> String {
        format!("{}{}", describe(self, requested), repeated(self))
    }

    /// Seeds that are omitted because the other side lacks them; `names` are those of the sides.
    pub(crate) fn seeds_left_out(&self, names: [&str; 2]) -> Vec<String> {
        if !self.leaves_seeds_out() {
            return Vec::new();
        }
        let of_set = |set: &MatchedSet<'_>| -> Vec<String> {
            let is_draw = self.sets.iter().filter(|other| other.clip == set.clip).count() > 1;
            let hash = set.base.first().filter(|_| is_draw).map(|run| format!(", draw {:.12}", run.set_hash));
            let place = format!("`{}`{}", set.clip, hash.unwrap_or_default());
            let unshared = set.unshared_seeds().into_iter().zip(names).filter(|(seeds, _)| !seeds.is_empty());
            let describe = |(seeds, name): (Vec<u64>, &str)| {
                let (plural, are, have) = if seeds.len() == 1 { ("", "is", "has") } else { ("s", "are", "have") };
                format!("seed{plural} {} of {place} {are} in `{name}` only and {have} no pair", describe_seeds(&seeds))
            };
            unshared.map(describe).collect()
        };
        self.sets.iter().flat_map(of_set).collect()
    }
}

/// One sentence of fixed form; which motions and noise each unit covers is in `docs/ci.md`.
fn describe(matched: &MatchedRuns<'_>, requested: Option<IntervalUnit>) -> String {
    let (clips, names) = (matched.clips().len(), describe_clips(matched));
    let instead = requested.filter(|unit| *unit != matched.unit);
    let instead =
        instead.map(|unit| format!("too few {unit} that differ ({FEWEST_RUNS} or more); ")).unwrap_or_default();
    if matched.unit == IntervalUnit::Seeds && matched.are_copies() {
        return format!("{instead}bit-identical runs are one observation: no interval; {WITHOUT_SEEDS}");
    }
    let draws = |clip: &&str| -> usize {
        let sets = matched.sets.iter().filter(|set| set.clip == *clip);
        sets.map(|set| set.base.len().min(set.other.len())).sum()
    };
    let counts: Vec<usize> = match matched.unit {
        IntervalUnit::Seeds if matched.leaves_seeds_out() => {
            matched.sets.iter().map(MatchedSet::seeds_in_common).collect()
        }
        IntervalUnit::Seeds => {
            matched.sets.iter().flat_map(|set| set.base.iter().chain(&set.other)).map(|run| run.seeds.len()).collect()
        }
        IntervalUnit::Draws => matched.clips().iter().map(draws).collect(),
        IntervalUnit::Clips => vec![clips],
    };
    let (least, most) =
        counts.iter().fold((usize::MAX, 0), |(least, most), count| (least.min(*count), most.max(*count)));
    let count = if least == most { most.to_string() } else { format!("{least} to {most}") };
    let few = if matched.sets.len() > 1 { 2 } else { FEWEST_RUNS };
    if matched.unit == IntervalUnit::Seeds && least < few {
        return format!(
            "{instead}no interval over seeds: {count} of {FEWEST_RUNS} or more ({names}); without random numbers, \
             {WITHOUT_SEEDS}"
        );
    }
    let unit = match matched.unit {
        IntervalUnit::Seeds if matched.leaves_seeds_out() => "pairs of seeds".to_owned(),
        unit => unit.to_string(),
    };
    format!("{instead}intervals over {count} {unit}; clips: {clips} ({names})")
}

/// Describes runs that are copies of others; empty if none or all are.
fn repeated(matched: &MatchedRuns<'_>) -> String {
    let runs = matched.sets.iter().flat_map(|set| set.base.iter().chain(&set.other).map(|run| (set.clip, *run)));
    let found = runs.map(|(clip, run)| (clip, run.repeated_seeds())).find(|(_, seeds)| !seeds.is_empty());
    let Some((clip, seeds)) = found else { return String::new() };
    format!(
        "; seed {} of `{clip}` is bit-identical to an earlier seed: if it is a copy, intervals are too narrow",
        describe_seeds(&seeds)
    )
}

/// `walk, 5.0 s; jump, 2.0 s`
fn describe_clips(matched: &MatchedRuns<'_>) -> String {
    let names = matched.clips();
    let seconds = |name: &str| {
        let set = matched.sets.iter().find(|set| set.clip == name).and_then(|set| set.base.first().copied());
        set.map(length).unwrap_or_default()
    };
    let shown: Vec<String> = names.iter().take(NAMED).map(|name| format!("{name}{}", seconds(name))).collect();
    let more = match names.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!("; and {more} more"),
    };
    format!("{}{more}", shown.join("; "))
}

fn length(set: &MeasuredClip) -> String {
    if set.frames_per_second > 0.0 {
        format!(", {:.1} s", set.frames as f64 / set.frames_per_second)
    } else {
        String::new()
    }
}

#[cfg(test)]
mod tests {
    use super::super::measured_runs::{MeasuredRuns, fixture};
    use super::*;

    fn walk(first: u64, errors: &[f64]) -> MeasuredRuns {
        let mut runs = MeasuredRuns::default();
        runs.add("walk", fixture::clip("a", first, errors)).unwrap();
        runs
    }

    /// Regression: five pairs were described as 5 to 8 seeds, without the three omitted seeds.
    #[test]
    fn partly_shared_seeds_are_counted_in_pairs_and_those_without_a_pair_are_named() {
        let error = |seed: u32| 30.0 + f64::from(seed * seed % 7);
        let side = |first, seeds: u32| walk(first, &(0..seeds).map(error).collect::<Vec<_>>());
        let (base, other) = (side(0, 5), side(1, 7));
        let matched = MatchedRuns::on_same_sets(&base, &other).with_unit(None);
        let scope = matched.scope(None);
        assert!(scope.starts_with("intervals over 4 pairs of seeds; clips: 1 (walk, 1.7 s)"), "{scope}");
        assert_eq!(
            matched.seeds_left_out(["main", "mine"]),
            [
                "seed 0 of `walk` is in `main` only and has no pair",
                "seeds 5 to 7 of `walk` are in `mine` only and have no pair"
            ]
        );
        let unpaired = side(3, 12);
        let matched = MatchedRuns::on_same_sets(&base, &unpaired).with_unit(None);
        assert!(!matched.paired() && matched.seeds_left_out(["main", "mine"]).is_empty(), "nothing is left out");
        assert!(matched.scope(None).starts_with("intervals over 5 to 12 seeds; "), "{}", matched.scope(None));
    }

    #[test]
    fn one_run_per_side_has_a_remedy_and_a_copied_seed_is_named() {
        let scope = |errors: &[f64]| {
            let runs = walk(0, errors);
            MatchedRuns::on_same_sets(&runs, &runs).with_unit(None).scope(None)
        };
        let one = scope(&[3.0]);
        assert!(one.starts_with("no interval over seeds: 1 of 3 or more (walk, 1.7 s)"), "{one}");
        assert!(one.contains("observation.seed=2"), "{one}");
        let copied = scope(&[3.0, 4.0, 3.0, 5.0]);
        let named = "; seed 2 of `walk` is bit-identical to an earlier seed: if it is a copy, intervals are too narrow";
        assert!(copied.ends_with(named), "{copied}");
    }

    #[test]
    fn many_clips_are_counted_and_some_are_named() {
        let mut runs = MeasuredRuns::default();
        for name in 'a'..='h' {
            runs.add(&name.to_string(), fixture::clip(&name.to_string(), 0, &[1.0, 2.0])).unwrap();
        }
        let words = MatchedRuns::on_same_sets(&runs, &runs).with_unit(None).scope(None);
        assert!(words.starts_with("intervals over 8 clips; clips: 8 (a, 1.7 s; "), "{words}");
        assert!(words.contains("; and 2 more)"), "{words}");
        let seeds = MatchedRuns::on_same_sets(&runs, &runs).with_unit(Some(IntervalUnit::Seeds)).scope(None);
        assert!(seeds.starts_with("intervals over 2 seeds; clips: 8"), "{seeds}");
    }
}
