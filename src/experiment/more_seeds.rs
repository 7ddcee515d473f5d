//! Further seeds of runs that are there: only what is missing is tracked and measured.

use std::fs;
use std::path::{Path, PathBuf};

use super::error::read_file;
use super::ours::ResultKind;
use super::partial_directory::PartialDirectory;
use super::run::{SCENARIO_FILE, draw, measure, write_all};
use super::run_reading::{MORE_SEEDS, run_folders};
use super::tracking::{TRACK_FILE, TrackRecord, Tracked, track};
use super::watch::Watch;
use super::{ExperimentError, Models, read_runs};
use crate::benchmark_set::BenchmarkSet;
use crate::evaluation::MeasuredClip;
use crate::input::{self, limits};
use crate::scenario::{ScenarioFile, json_tree};

/// Where the sets of runs come from.
#[derive(Clone, Copy, Debug, Default)]
pub struct MoreOf<'a> {
    /// Sets on disk, known by their hashes.
    pub sets: &'a [PathBuf],
    /// Folder that the paths of the runs' scenarios are relative to, for runs whose set is not among them.
    pub scenario_folder: Option<&'a Path>,
    /// Directory that is searched for clips.
    pub mocap_directory: Option<&'a Path>,
}

/// Tracks and measures so many further seeds of every run at a path, into a folder `seeds-FIRST-LAST` in the run's own.
///
/// # Errors
/// [`ExperimentError`] if a run's set is neither there nor made again by its scenario, or tracking fails.
pub fn add_seeds(
    path: &Path,
    count: u32,
    from: MoreOf<'_>,
    watch: &dyn Watch,
) -> Result<Vec<PathBuf>, ExperimentError> {
    let folders = run_folders(path);
    let mut written = Vec::new();
    for folder in &folders {
        let runs = read_runs(folder)?;
        for clip in runs.clips.values() {
            written.push(add_to(folder, clip, count, from, watch)?);
        }
    }
    Ok(written)
}

fn add_to(
    folder: &Path,
    clip: &MeasuredClip,
    count: u32,
    from: MoreOf<'_>,
    watch: &dyn Watch,
) -> Result<PathBuf, ExperimentError> {
    let first = clip.seeds.iter().max().map_or(0, |last| last + 1);
    let seeds: Vec<u64> = (first..first + u64::from(count)).collect();
    let last = first + u64::from(count).saturating_sub(1);
    let place = folder.join(format!("{MORE_SEEDS}{first}-{last}"));
    let record = recorded(folder)?;
    let directory = PartialDirectory::begin(&place, ResultKind::Run, false)?;
    let (set, mut models) = set_of(folder, clip, from, watch)?;
    let tracked = track(&set.blind, &record.tracker, &seeds, set.truth.refitted.as_ref(), &mut models, watch)?;
    write_all(&directory, &tracked.files(&set.blind)?)?;
    // as elsewhere: the files on disk are measured
    let tracked = Tracked::read(directory.folder(), &set.blind.start.body)?;
    let results = measure(&set, &tracked, watch)?;
    write_all(&directory, &results.files)?;
    directory.finish()?;
    Ok(place)
}

fn recorded(folder: &Path) -> Result<TrackRecord, ExperimentError> {
    let path = folder.join(TRACK_FILE);
    if !path.is_file() {
        return Err(ExperimentError::Argument {
            argument: "--add-seeds",
            detail: format!(
                "{} was not tracked by skiagraph; run your tracker with more seeds and evaluate them again",
                folder.display()
            ),
        });
    }
    json_tree::value_of_file(&read_file(&path, limits::RECORD)?)
        .map_err(|detail| ExperimentError::Malformed { path, detail })
}

/// The set that a run was made from: read, or drawn again.
fn set_of(
    folder: &Path,
    clip: &MeasuredClip,
    from: MoreOf<'_>,
    watch: &dyn Watch,
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
    let file = ScenarioFile::parse(&text, &path.display().to_string(), base, &[])?;
    let (set, _) = draw(&file, from.mocap_directory, watch)?;
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
