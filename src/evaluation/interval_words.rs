//! What is said where intervals are printed.

use super::IntervalRule;
use super::bootstrap::RESAMPLES;
use super::interval::{BOOTSTRAP_RUNS, FEWEST_RUNS};

/// Simulated coverage of the mean's 95 % interval where one seed in ten loses the body, %, by number of seeds: from
/// `results/intervals.json`.
const COVERAGE_WITH_LOST_TRACKS: [(usize, u32); 4] = [(3, 0), (5, 0), (10, 0), (20, 0)];

/// How the interval of one metric was made, or why there is none. `clips` holds the values of the runs that have the metric,
/// `of` is the number of all runs.
pub(super) fn of_metric(clips: &[Vec<f64>], of: usize, rule: Option<IntervalRule>) -> String {
    match rule {
        Some(rule) => format!("{rule} over {}", counted(clips, of)),
        None => none(clips, of),
    }
}

/// How the intervals of a summary were made, or why there are none. `clips` holds one value a run.
pub(super) fn of_runs(clips: &[Vec<f64>]) -> String {
    let runs: usize = clips.iter().map(Vec::len).sum();
    let fewest = clips.iter().map(Vec::len).min().unwrap_or(0);
    if fewest < 2 || runs < FEWEST_RUNS {
        let none = none(clips, runs);
        let (first, rest) = none.split_at(1);
        return format!("{}{rest}: an interval takes {FEWEST_RUNS} seeds or more", first.to_uppercase());
    }
    let rule = match fewest >= BOOTSTRAP_RUNS {
        true => format!("BCa bootstrap of the seeds within each clip, {RESAMPLES} resamples, expanded percentiles"),
        false => "Student's t, on a logarithmic scale for errors above 0".to_owned(),
    };
    let coverage: Vec<String> =
        COVERAGE_WITH_LOST_TRACKS.iter().map(|(seeds, percent)| format!("{percent} % at {seeds} seeds")).collect();
    format!(
        "95 % intervals of the mean over {}, never over frames: {rule}. Where some seeds lose the body and others do not, they \
         hold the mean far less often than they say: with one lost in ten {} (results/intervals.md)",
        counted(clips, runs),
        coverage.join(", "),
    )
}

/// `2 seeds: no interval`
fn none(clips: &[Vec<f64>], of: usize) -> String {
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
