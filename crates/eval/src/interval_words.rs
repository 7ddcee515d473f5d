//! The text printed with intervals.

use super::IntervalRule;
use super::interval::{FEWEST_RUNS, are_equal};
use super::seed_run::{SeedRun, by_clip};

/// How to get an interval for a tracker that draws no random numbers.
pub(super) const WITHOUT_SEEDS: &str =
    "measure it on several draws of the noise (observation.seed=2 and so on) or on several clips (docs/ci.md)";

/// Describes how the interval of one metric was computed, or why there is none. `clips` holds the values of the runs
/// that have the metric, `of` is the number of all runs.
pub(super) fn of_metric(clips: &[Vec<f64>], of: usize, rule: Option<IntervalRule>) -> String {
    match rule {
        Some(rule) => format!("{rule} over {}", counted(clips, of)),
        None => none(clips, of),
    }
}

/// Describes how the intervals of a summary were computed, or why there are none.
pub(super) fn of_summary(runs: &[SeedRun<'_>]) -> String {
    let clips = by_clip(runs, &vec![Some(0.0); runs.len()]);
    if are_copies(runs) {
        let counted = counted(&clips, runs.len());
        return format!(
            "{counted} with bit-identical estimates, which are one observation: no interval; {WITHOUT_SEEDS}"
        );
    }
    of_runs(&clips)
}

/// Whether every clip has two or more runs and all have equal evaluations, which imply equal estimates in practice.
fn are_copies(runs: &[SeedRun<'_>]) -> bool {
    let first = |run: &SeedRun<'_>| runs.iter().find(|other| other.clip == run.clip).map(|first| first.evaluation);
    let lone = |run: &SeedRun<'_>| runs.iter().filter(|other| other.clip == run.clip).count() < 2;
    !runs.is_empty() && runs.iter().all(|run| !lone(run) && first(run) == Some(run.evaluation))
}

/// Describes how intervals over seeds are computed, or why there are none. `clips` holds one value per run.
fn of_runs(clips: &[Vec<f64>]) -> String {
    let runs: usize = clips.iter().map(Vec::len).sum();
    let fewest = clips.iter().map(Vec::len).min().unwrap_or(0);
    if fewest < 2 || runs < FEWEST_RUNS {
        let none = none(clips, runs);
        let (first, rest) = none.split_at(1);
        return format!("{}{rest}: an interval needs {FEWEST_RUNS} seeds or more", first.to_uppercase());
    }
    format!(
        "95 % intervals of the mean over {}: Student's t, of errors above 0 on a logarithmic scale",
        counted(clips, runs)
    )
}

/// `2 seeds: no interval`, `5 seeds: all equal`
fn none(clips: &[Vec<f64>], of: usize) -> String {
    let fewest = clips.iter().map(Vec::len).min().unwrap_or(0);
    if fewest >= 2 && clips.iter().map(Vec::len).sum::<usize>() >= FEWEST_RUNS && are_equal(clips) {
        return format!("{}: all equal", counted(clips, of));
    }
    match clips.len() {
        0 | 1 => format!("{}: no interval", counted(clips, of)),
        _ if clips.iter().any(|runs| runs.len() == 1) => "a clip with 1 seed: no interval".to_owned(),
        _ => format!("{}: no interval", counted(clips, of)),
    }
}

/// `3 seeds`, `3 of 5 seeds`, `6 runs of 2 clips`
fn counted(clips: &[Vec<f64>], of: usize) -> String {
    let runs: usize = clips.iter().map(Vec::len).sum();
    let number = if runs == of { runs.to_string() } else { format!("{runs} of {of}") };
    let plural = if of == 1 { "" } else { "s" };
    match clips.len() {
        0 | 1 => format!("{number} seed{plural}"),
        several => format!("{number} run{plural} of {several} clips"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_clips_are_counted_in_runs() {
        let words = of_runs(&[vec![0.0; 3], vec![0.0; 4]]);
        assert!(words.starts_with("95 % intervals of the mean over 7 runs of 2 clips"), "{words}");
        assert_eq!(of_runs(&[vec![0.0]]), "1 seed: no interval: an interval needs 3 seeds or more");
        assert_eq!(of_metric(&[], 5, None), "0 of 5 seeds: no interval");
        assert_eq!(of_metric(&[vec![0.0; 5]], 5, None), "5 seeds: all equal");
        assert_eq!(of_metric(&[vec![0.0; 2]], 2, None), "2 seeds: no interval");
    }
}
