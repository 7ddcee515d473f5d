//! Further seeds of runs that are there: only what is missing is tracked and measured.

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

/// Where the sets of runs come from.
#[derive(Clone, Copy, Debug, Default)]
pub struct MoreOf<'a> {
    /// Sets on disk, known by their hashes.
    pub sets: &'a [PathBuf],
    /// Folder that the paths of the runs' scenarios are relative to, for runs whose set is not among them.
    pub scenario_folder: Option<&'a Path>,
    /// Directory that is searched for clips.
    pub mocap_directory: Option<&'a Path>,
    /// Whether the scenarios may name files outside of that folder.
    pub allow_outside: bool,
}

/// Tracks and measures the seeds that a gate asks for and the runs at these paths lack, at most so many of every run:
/// the baseline's own, or any where others are accepted and there are too few. Runs on other sets than the baseline's
/// are left alone: the gate refuses them.
///
/// # Errors
/// As of [`add_seeds`].
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

/// So many seeds after the last one of a run.
fn further_seeds(clip: &MeasuredClip, count: u64) -> Vec<u64> {
    let first = clip.seeds.iter().max().map_or(0, |last| last.saturating_add(1));
    (first..first.saturating_add(count)).collect()
}

/// Tracks and measures so many further seeds of every run at these paths, into a folder `seeds-FIRST-LAST` in the run's
/// own.
///
/// # Errors
/// [`ExperimentError::Argument`] if skiagraph did not track a run, or its set has to be named; [`ExperimentError`] if
/// its scenario draws another set, or tracking fails.
pub fn add_seeds(
    paths: &[PathBuf],
    count: u32,
    from: MoreOf<'_>,
    progress: &dyn Progress,
) -> Result<Vec<PathBuf>, ExperimentError> {
    let folders: Vec<PathBuf> = paths.iter().flat_map(|path| run_folders(path)).collect();
    // all or none: not some of the runs before one that has to be run by hand
    for folder in &folders {
        for clip in read_one(folder)?.clips.values() {
            recorded(folder, &further_seeds(clip, u64::from(count)))?;
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

/// The run in a folder, with its further seeds.
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
    let record = recorded(folder, seeds)?;
    let directory = Artefact::begin(Destination { path: &place, force: false }, ArtefactKind::Run)?;
    let (set, mut models) = set_of(folder, clip, from, progress)?;
    let tracked = track(&set.blind, &record.tracker, seeds, set.truth.refitted.as_ref(), &mut models, progress)?;
    directory.write_all(&tracked.files(&set.blind)?)?;
    // as elsewhere: the files on disk are measured
    let tracked = Tracked::read(directory.folder(), &set.blind.start.body)?;
    let results = measure(&set, &tracked, progress)?;
    directory.write_all(&results.files)?;
    directory.finish()?;
    Ok(place)
}

fn recorded(folder: &Path, seeds: &[u64]) -> Result<TrackRecord, ExperimentError> {
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
            detail: format!("{} has no {SCENARIO_FILE}; name its set with --set SET", folder.display()),
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
            detail: "this version of skiagraph, or other input files, draw another set; run all seeds again".to_owned(),
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
    fn the_seeds_of_the_baseline_are_missing_or_as_many_as_a_gate_needs() {
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
