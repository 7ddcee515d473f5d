//! How many seeds, draws or clips would decide a gate.

use std::path::Path;

use crate::runs::reading::MORE_SEEDS;
use skiagraph_core::input::shell_word;
use skiagraph_eval::{IntervalUnit, MoreSeeds, describe_seeds};

/// A note on the seeds, draws or clips that checks lack; `None` if more would not help.
pub(super) fn lacking_note(unit: IntervalUnit, lacking: impl IntoIterator<Item = MoreSeeds>) -> Option<String> {
    let (mut more, mut is_of_both) = (0, false);
    for lacked in lacking {
        match lacked {
            MoreSeeds::OfRun(count) => more = more.max(count),
            MoreSeeds::OfBoth(count) => (more, is_of_both) = (more.max(count), true),
            MoreSeeds::TooMany => {}
        }
    }
    let sides = if is_of_both { "run and baseline" } else { "the run" };
    (more > 0)
        .then(|| format!("undecided: {more} more {unit} of {sides} would decide it (docs/ci.md says how to add them)"))
}

/// How to add seeds to a run that another program tracked.
pub(super) fn by_hand(folder: &Path, seeds: &[u64]) -> String {
    let shown = |path: &Path| shell_word(&path.to_string_lossy());
    let (run, more) = (shown(folder), shown(&folder.join(format!("{MORE_SEEDS}more"))));
    format!(
        "cannot run the tracker of {run}; track its set with the seeds {} into {more}, and evaluate them (docs/ci.md)",
        describe_seeds(seeds)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greatest_number_is_noted() {
        let note = |lacking: &[MoreSeeds]| lacking_note(IntervalUnit::Seeds, lacking.iter().copied());
        assert_eq!((note(&[]), note(&[MoreSeeds::TooMany])), (None, None));
        let of_run = note(&[MoreSeeds::OfRun(2), MoreSeeds::OfRun(3)]).unwrap();
        assert!(of_run.starts_with("undecided: 3 more seeds of the run would decide it"), "{of_run}");
        let of_both = lacking_note(IntervalUnit::Draws, [MoreSeeds::OfRun(2), MoreSeeds::OfBoth(7)]).unwrap();
        assert!(of_both.starts_with("undecided: 7 more draws of run and baseline"), "{of_both}");
    }
}
