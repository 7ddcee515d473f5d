//! The text printed with intervals.

use std::collections::BTreeSet;

use super::IntervalRule;
use super::interval::{FEWEST_RUNS, are_equal};
use super::seed_run::{SeedRun, by_clip};

/// How to get an interval for a tracker that draws no random numbers.
pub(super) const WITHOUT_SEEDS: &str = "measure it on several draws of the observation's noise \
    (skiagraph render SCENARIO observation.seed=2 --out SET-2, and so on, if the scenario has noise) or on several \
    clips, one run each, and give the folder of all runs";

/// Simulated coverage of the mean's 95 % interval where one seed in ten loses the body, %, by number of seeds: from
/// `results/intervals.json`.
const COVERAGE_WITH_LOST_TRACKS: [(usize, u32); 4] = [(3, 30), (5, 40), (10, 65), (20, 85)];

/// Describes how the interval of one metric was computed, or why there is none. `clips` holds the values of the runs
/// that have the metric, `of` is the number of all runs.
pub(super) fn of_metric(clips: &[Vec<f64>], of: usize, rule: Option<IntervalRule>) -> String {
    match rule {
        Some(rule) => format!("{rule} over {}", counted(clips, of)),
        None => none(clips, of),
    }
}

/// Describes how the intervals of a summary were computed and what they cover, or why there are none.
pub(super) fn of_summary(runs: &[SeedRun<'_>]) -> String {
    let clips = by_clip(runs, &vec![Some(0.0); runs.len()]);
    if are_copies(runs) {
        return format!(
            "{} with bit-identical estimates: the tracker draws no random numbers, and copies are one observation. \
             No interval; {WITHOUT_SEEDS}",
            counted(&clips, runs.len())
        );
    }
    let words = of_runs(&clips);
    let names: BTreeSet<&str> = runs.iter().map(|run| run.clip).collect();
    match (names.len(), runs.first().map(|run| run.evaluation)) {
        (1, Some(first)) if clips[0].len() >= FEWEST_RUNS && first.frames_per_second > 0.0 => {
            let seconds = first.frames as f64 / first.frames_per_second;
            format!("{words}. They are of one clip of {seconds:.1} s and do not cover other motions or other noise")
        }
        _ => words,
    }
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
    let coverage: Vec<String> =
        COVERAGE_WITH_LOST_TRACKS.iter().map(|(seeds, percent)| format!("{percent} % at {seeds} seeds")).collect();
    format!(
        "95 % intervals of the mean over {}, never over frames: Student's t, on a logarithmic scale for errors above 0. \
         If some seeds lose the body and others do not, coverage is far below 95 %: with one seed in ten lost {} \
         (results/intervals.md)",
        counted(clips, runs),
        coverage.join(", "),
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
    fn the_stated_coverage_is_the_simulated_one() {
        let study: serde_json::Value = serde_json::from_str(include_str!("../../../results/intervals.json")).unwrap();
        let rows = study["one_clip"].as_array().unwrap();
        for (seeds, percent) in COVERAGE_WITH_LOST_TRACKS {
            let is_it = |row: &&serde_json::Value| row["distribution"] == "one in ten lost" && row["seeds"] == seeds;
            let covered = rows.iter().find(is_it).unwrap()["now"]["covered"].as_f64().unwrap();
            assert_eq!((100.0 * covered).round(), f64::from(percent), "{seeds} seeds");
        }
    }

    #[test]
    fn several_clips_are_counted_in_runs() {
        let clips = vec![vec![0.0; 3], vec![0.0; 4]];
        assert!(
            of_runs(&clips).starts_with("95 % intervals of the mean over 7 runs of 2 clips"),
            "{}",
            of_runs(&clips)
        );
        assert_eq!(of_runs(&[vec![0.0]]), "1 seed: no interval: an interval needs 3 seeds or more");
        assert_eq!(of_metric(&[], 5, None), "0 of 5 seeds: no interval");
        assert_eq!(of_metric(&[vec![0.0; 5]], 5, None), "5 seeds: all equal");
        assert_eq!(of_metric(&[vec![0.0; 2]], 2, None), "2 seeds: no interval");
    }
}
