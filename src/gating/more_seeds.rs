//! Adds seeds to existing runs: only the missing seeds are tracked and measured.

use std::path::{Path, PathBuf};

use super::Baseline;
use super::seed_advice::by_hand;
use crate::artefacts::{Artefact, ArtefactKind, Destination};
use crate::common::{ExperimentError, Progress, read_file};
use crate::measure::tracked::TRACK_FILE;
use crate::measure::{TrackRecord, Tracked};
use crate::runs::read_runs;
use crate::runs::reading::{MORE_SEEDS, run_folders};
use crate::runs::run::measure;
use crate::runs::set_of_run::{MoreOf, set_of_run};
use crate::runs::set_tracking::made_by_track;
use crate::scenario::json_tree;
use crate::tracking::track::track;
use skiagraph_core::input::limits;
use skiagraph_eval::{FEWEST_SEEDS, GateRules, MeasuredClip, MeasuredRuns};

/// Tracks and measures the seeds that a gate needs and the runs at these paths lack, at most `most` per run: the
/// baseline's seeds, or, if the rules accept other seeds, as many as are missing. Runs on other sets than the
/// baseline's are skipped, because the gate refuses them.
pub fn add_missing_seeds(
    paths: &[PathBuf],
    baseline: &Baseline,
    rules: &GateRules,
    most: u32,
    from: MoreOf<'_>,
    progress: &dyn Progress,
) -> Result<Vec<PathBuf>, ExperimentError> {
    let mut written = Vec::new();
    for folder in &paths.iter().flat_map(|path| run_folders(path)).collect::<Vec<_>>() {
        for (name, clip) in read_one(folder)?.sets() {
            let sets = baseline.runs.sets_of(name);
            let Some(base) = sets.into_iter().find(|base| base.set_hash == clip.set_hash) else { continue };
            let mut seeds = missing_seeds(base, clip, rules);
            seeds.truncate(most as usize);
            if !seeds.is_empty() {
                written.push(add_to(folder, clip, &seeds, from, progress)?);
            }
        }
    }
    Ok(written)
}

fn missing_seeds(base: &MeasuredClip, run: &MeasuredClip, rules: &GateRules) -> Vec<u64> {
    if rules.other_seeds {
        let lacking = rules.seeds.max(FEWEST_SEEDS).saturating_sub(run.seeds.len());
        return further_seeds(run, lacking as u64);
    }
    let mut seeds: Vec<u64> = base.seeds.iter().filter(|seed| !run.seeds.contains(seed)).copied().collect();
    seeds.sort_unstable();
    seeds
}

/// `count` seeds after the last one of a run.
fn further_seeds(clip: &MeasuredClip, count: u64) -> Vec<u64> {
    let first = clip.seeds.iter().max().map_or(0, |last| last.saturating_add(1));
    (first..first.saturating_add(count)).collect()
}

/// Tracks and measures `count` further seeds of every run at these paths, into a folder `seeds-FIRST-LAST` inside the
/// run's folder.
///
/// # Errors
/// [`ExperimentError::Argument`] if another program tracked a run, or its set must be named; [`ExperimentError`] if its
/// scenario gives another set, or tracking fails.
pub fn add_seeds(
    paths: &[PathBuf],
    count: u32,
    from: MoreOf<'_>,
    progress: &dyn Progress,
) -> Result<Vec<PathBuf>, ExperimentError> {
    let folders: Vec<PathBuf> = paths.iter().flat_map(|path| run_folders(path)).collect();
    // check all runs first, because some may have to be run by hand
    for folder in &folders {
        for clip in read_one(folder)?.clips.values() {
            track_record(folder, &further_seeds(clip, u64::from(count)))?;
        }
    }
    let mut written = Vec::new();
    for folder in &folders {
        let runs = read_one(folder)?;
        for clip in runs.clips.values() {
            written.push(add_to(folder, clip, &further_seeds(clip, u64::from(count)), from, progress)?);
        }
    }
    Ok(written)
}

fn read_one(folder: &Path) -> Result<MeasuredRuns, ExperimentError> {
    read_runs(&[folder.to_owned()])
}

fn add_to(
    folder: &Path,
    clip: &MeasuredClip,
    seeds: &[u64],
    from: MoreOf<'_>,
    progress: &dyn Progress,
) -> Result<PathBuf, ExperimentError> {
    let [first, last] = [seeds.first(), seeds.last()].map(|seed| seed.copied().unwrap_or_default());
    let place = folder.join(format!("{MORE_SEEDS}{first}-{last}"));
    let record = track_record(folder, seeds)?;
    let directory = Artefact::begin(Destination { path: &place, force: false }, ArtefactKind::Run)?;
    let (set, mut models) = set_of_run(folder, &clip.set_hash, "--add-seeds", from, progress)?;
    let directory = directory.made_by(made_by_track(&set.blind, &record.tracker, seeds));
    let tracked = track(&set.blind, &record.tracker, seeds, set.truth.refitted.as_ref(), &mut models, progress)?;
    directory.write_all(&tracked.files(&set.blind)?)?;
    // as everywhere, the files on disk are measured
    let tracked = Tracked::read(directory.folder(), &set.blind.start.body)?;
    let results = measure(&set, &tracked, progress)?;
    directory.write_all(&results.files)?;
    directory.finish()?;
    Ok(place)
}

fn track_record(folder: &Path, seeds: &[u64]) -> Result<TrackRecord, ExperimentError> {
    let path = folder.join(TRACK_FILE);
    if !path.is_file() {
        return Err(ExperimentError::Argument { argument: "--add-seeds", detail: by_hand(folder, seeds) });
    }
    json_tree::value_of_file(&read_file(&path, limits::RECORD)?)
        .map_err(|detail| ExperimentError::Malformed { path, detail })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(seeds: &[u64]) -> MeasuredClip {
        MeasuredClip { seeds: seeds.to_vec(), ..MeasuredClip::default() }
    }

    #[test]
    fn missing_seeds_are_those_of_the_baseline_or_as_many_as_a_gate_needs() {
        let mut rules = GateRules::from_metric("humaneva_mm", "2mm".parse().unwrap());
        assert_eq!(missing_seeds(&clip(&[0, 1, 2, 3, 4]), &clip(&[3, 0, 9]), &rules), [1, 2, 4]);
        assert!(missing_seeds(&clip(&[0, 1]), &clip(&[0, 1, 2]), &rules).is_empty());
        rules.other_seeds = true;
        assert_eq!(missing_seeds(&clip(&[0, 1, 2, 3, 4]), &clip(&[10, 11, 12]), &rules), [13, 14]);
        assert!(missing_seeds(&clip(&[0]), &clip(&[5, 6, 7, 8, 9]), &rules).is_empty());
        assert_eq!(further_seeds(&clip(&[]), 2), [0, 1]);
        assert!(further_seeds(&clip(&[u64::MAX]), 2).is_empty());
    }
}
