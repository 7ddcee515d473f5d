//! The two sides that a gate compares, and the checks that they can be compared.

use std::collections::BTreeSet;

use super::{FEWEST_SEEDS, GateRefusal, GateRules};
use crate::comparison::{
    IntervalUnit, MatchedRuns, MeasuredClip, MeasuredRuns, changed_settings, describe_seeds, set_difference,
};
use crate::interval_words::WITHOUT_SEEDS;

/// A run and a baseline, matched set by set.
pub(super) struct Sides<'a> {
    pub(super) baseline: &'a MeasuredRuns,
    pub(super) run: &'a MeasuredRuns,
    pub(super) rules: &'a GateRules,
    pub(super) matched: MatchedRuns<'a>,
}

impl<'a> Sides<'a> {
    /// Clip names with the matched sets of baseline and run.
    pub(super) fn sets(&self) -> impl Iterator<Item = (&'a str, &'a MeasuredClip, &'a MeasuredClip)> {
        self.matched.sets.iter().filter_map(|set| Some((set.clip, *set.base.first()?, *set.other.first()?)))
    }

    /// Refuses a run that lacks a set of the baseline.
    pub(super) fn check_sets(&self) -> Result<(), GateRefusal> {
        let names = |runs: &MeasuredRuns| runs.clips.keys().cloned().collect::<Vec<_>>().join(", ");
        let is_measured = |clip: &String| self.run.clips.contains_key(clip);
        if self.baseline.clips.is_empty() || !self.baseline.clips.keys().all(is_measured) {
            return Err(GateRefusal::Refused(format!(
                "the baseline has the clip(s) {}, the run {}; measure the run on all of them",
                names(self.baseline),
                names(self.run)
            )));
        }
        let is_matched = |set: &MeasuredClip| self.sets().any(|(_, base, _)| std::ptr::eq(base, set));
        let Some((clip, set)) = self.baseline.sets().find(|(_, set)| !is_matched(set)) else { return Ok(()) };
        let theirs = self.run.sets_of(clip);
        let what = theirs.first().and_then(|their| set_difference(set, their));
        let what = match (what, theirs.len().max(self.baseline.sets_of(clip).len())) {
            (Some(what), 0 | 1) => what,
            _ => format!("the run lacks its draw with the hash {:.12}", set.set_hash),
        };
        Err(GateRefusal::Refused(format!(
            "`{clip}` is another set than the baseline's ({what}); measure the run on the baseline's set, or save a \
             new baseline"
        )))
    }

    /// The unit of the intervals: the first of which there are enough.
    pub(super) fn unit(&self) -> Result<IntervalUnit, GateRefusal> {
        let needed = self.rules.seeds.max(FEWEST_SEEDS);
        let wanted = |unit: &IntervalUnit| self.rules.unit.is_none_or(|requested| requested == *unit);
        let enough = |unit: &IntervalUnit| self.matched.has_at_least(needed, *unit);
        if let Some(unit) = IntervalUnit::ALL.into_iter().filter(wanted).find(enough) {
            return Ok(unit);
        }
        let unit = self.rules.unit.unwrap_or_default();
        if unit == IntervalUnit::Seeds && self.matched.are_copies() {
            return Err(GateRefusal::Refused(format!(
                "all runs of a set are bit-identical, in run and baseline: the tracker draws no random numbers, copies \
                 are one observation, and a gate needs {needed}; {WITHOUT_SEEDS}"
            )));
        }
        if unit == IntervalUnit::Seeds {
            for (clip, base, run) in self.sets() {
                for (which, side) in [("the baseline", base), ("the run", run)] {
                    let found = side.seeds.len();
                    if found < needed {
                        return Err(GateRefusal::Refused(format!(
                            "{which} has {found} seed(s) of `{clip}`, a gate needs {needed} or more; run it with \
                             --seeds {needed}, or, if the tracker draws no random numbers, measure it on {needed} \
                             draws of the observation's noise or {needed} clips (docs/ci.md)"
                        )));
                    }
                }
            }
        }
        let of_each = if unit == IntervalUnit::Draws { ", of every clip" } else { "" };
        Err(GateRefusal::Refused(format!(
            "a gate over {unit} needs {needed} or more that run and baseline have in common and that differ{of_each}; \
             add them to both, or choose another unit"
        )))
    }

    /// Refuses seeds that differ from the baseline's unless the rules allow them; returns notes.
    pub(super) fn check_seeds(&self) -> Result<Vec<String>, GateRefusal> {
        let mut notes = Vec::new();
        for (clip, base, run) in self.sets().filter(|_| self.matched.unit == IntervalUnit::Seeds) {
            let [known, new] = [base, run].map(|side| side.seeds.iter().collect::<BTreeSet<_>>());
            if !self.rules.other_seeds && !new.is_superset(&known) {
                let [baseline, run] = [base, run].map(|side| describe_seeds(&side.seeds));
                return Err(GateRefusal::Refused(format!(
                    "`{clip}`: the baseline has seeds {baseline}, the run {run}; run the baseline's seeds (they are \
                     paired), or accept others with --other-seeds"
                )));
            }
            if known != new {
                let how = if self.matched.paired() { "those in common are paired" } else { "they are not paired" };
                notes.push(format!(
                    "`{clip}`: seeds {} against the baseline's {}: {how}",
                    describe_seeds(&run.seeds),
                    describe_seeds(&base.seeds)
                ));
            }
        }
        notes.extend(
            self.matched.seeds_left_out(["the baseline", "the run"]).into_iter().map(|out| format!("left out: {out}")),
        );
        Ok(notes)
    }

    /// Notes for the user about versions, settings and clips.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for (clip, base, run) in self.sets() {
            if base.version != run.version {
                notes.push(format!(
                    "`{clip}`: the baseline was measured by version {}, the run by {}",
                    base.version, run.version
                ));
            }
            if base.settings != run.settings || base.tracker != run.tracker {
                notes.push(format!(
                    "`{clip}`: the tracker's settings differ from the baseline's: {}",
                    changed(base, run)
                ));
            }
        }
        for (clip, base, run) in self.sets() {
            let more = run.markers_beyond(base).join(", ");
            if !more.is_empty() {
                notes.push(format!(
                    "`{clip}`: the baseline has no estimate of {more}, so its errors are over fewer markers"
                ));
            }
        }
        let more = self.run.clips.keys().filter(|clip| !self.baseline.clips.contains_key(*clip));
        notes.extend(more.map(|clip| format!("`{clip}` is not in the baseline and was not checked")));
        notes
    }
}

/// Describes how the trackers differ.
fn changed(base: &MeasuredClip, run: &MeasuredClip) -> String {
    if base.tracker == run.tracker {
        changed_settings(base.settings.as_ref(), run.settings.as_ref())
    } else {
        format!("{} instead of {}", run.tracker, base.tracker)
    }
}
