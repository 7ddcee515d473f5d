//! Adds seeds to existing runs: only the missing seeds are tracked and measured.

use std::fs;
use std::path::{Path, PathBuf};

use super::rendering::draw;
use super::run::measure;
use super::run_reading::{MORE_SEEDS, run_folders};
use super::seed_advice::by_hand;
use super::tracking::track;
use super::{Baseline, read_runs};
use crate::artefacts::{Artefact, ArtefactKind, Destination};
use crate::benchmark_set::BenchmarkSet;
use crate::common::{ExperimentError, Progress, read_file};
use crate::evaluation::{FEWEST_SEEDS, GateRules, MeasuredClip, MeasuredRuns};
use crate::input::{self, limits};
use crate::measure::tracked::TRACK_FILE;
use crate::measure::{TrackRecord, Tracked};
use crate::prepare::scenario_copy::SCENARIO_FILE;
use crate::scenario::{ScenarioFile, json_tree};
use crate::train::Models;

/// The sources of the runs' sets.
#[derive(Clone, Copy, Debug, Default)]
pub struct MoreOf<'a> {
    /// Sets on disk, identified by their hashes.
    pub sets: &'a [PathBuf],
    /// Base folder of the paths in the runs' scenarios, for runs whose set is not among `sets`.
    pub scenario_folder: Option<&'a Path>,
    /// Directory that is searched for clips.
    pub mocap_directory: Option<&'a Path>,
    /// Whether the scenarios may name files outside that folder.
    pub allow_outside: bool,
}

/// Tracks and measures the seeds that a gate needs and the runs at these paths lack, at most `most` per run: the
/// baseline's seeds, or, if the rules accept other seeds, as many as are missing. Runs on other sets than the
/// baseline's are skipped, because the gate refuses them.
///
/// # Errors
/// As for [`add_seeds`].
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

/// The seeds that a run lacks for a gate, in ascending order.
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

/// The run in a folder, with its added seeds.
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
    let (set, mut models) = set_of(folder, clip, from, progress)?;
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

/// The set that a run was made from: read, or drawn again.
fn set_of(
    folder: &Path,
    clip: &MeasuredClip,
    from: MoreOf<'_>,
    progress: &dyn Progress,
) -> Result<(BenchmarkSet, Models), ExperimentError> {
    for path in from.sets {
        let set = BenchmarkSet::read(path)?;
        if set.blind.set_hash == clip.set_hash {
            return Ok((set, Models::default()));
        }
    }
    let path = folder.join(SCENARIO_FILE);
    if !path.is_file() {
        return Err(ExperimentError::Argument {
            argument: "--add-seeds",
            detail: format!("{} has no {SCENARIO_FILE}; give its set with --set SET", folder.display()),
        });
    }
    let text = input::read_to_string(&path, limits::SETTINGS)
        .map_err(|source| ExperimentError::Unreadable { path: path.clone(), source })?;
    let base = from.scenario_folder.map_or_else(PathBuf::new, Path::to_owned);
    let base = fs::canonicalize(&base).unwrap_or(base);
    let mut file = ScenarioFile::parse(&text, &path.display().to_string(), base, &[])?;
    from.mocap_directory.iter().for_each(|directory| file.allowed.allow(directory));
    if from.allow_outside {
        file.allowed.allow_anywhere();
    }
    let (set, _) = draw(&file, from.mocap_directory, progress)?;
    if set.blind.set_hash != clip.set_hash {
        return Err(ExperimentError::AnotherSet {
            run: folder.to_owned(),
            set: path,
            detail:
                "its scenario now gives another set, because skiagraph or input files have changed; run all seeds again"
                    .to_owned(),
        });
    }
    let models = Models::new(&file, &set.truth.recordings);
    Ok((set, models))
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
