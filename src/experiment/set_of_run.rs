//! The set that a run was made from.

use std::fs;
use std::path::{Path, PathBuf};

use super::rendering::draw;
use crate::benchmark_set::{BenchmarkSet, BlindSet};
use crate::common::{ExperimentError, Progress};
use crate::input::{self, limits};
use crate::prepare::scenario_copy::SCENARIO_FILE;
use crate::scenario::{ScenarioFile, program_in};
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

/// The set with this hash that a run was made from, read or drawn again, and the models of its trackers. `argument` is
/// named in messages.
///
/// # Errors
/// [`ExperimentError::Argument`] if the set must be named, [`ExperimentError::AnotherSet`] if the run's scenario gives
/// another one now.
pub(crate) fn set_of_run(
    folder: &Path,
    set_hash: &str,
    argument: &'static str,
    from: MoreOf<'_>,
    progress: &dyn Progress,
) -> Result<(BenchmarkSet, Models), ExperimentError> {
    let mut others = Vec::new();
    for path in from.sets {
        let set = BenchmarkSet::read(path)?;
        if set.blind.set_hash == set_hash {
            return Ok((set, Models::default()));
        }
        others.push((path, set.blind.set_hash));
    }
    let path = folder.join(SCENARIO_FILE);
    if !path.is_file() {
        if let Some((set, found)) = others.pop() {
            let detail = format!("the run's set has hash {set_hash}, this set has {found}");
            return Err(ExperimentError::AnotherSet { run: folder.to_owned(), set: set.clone(), detail });
        }
        return Err(ExperimentError::Argument {
            argument,
            detail: format!("{} has no {SCENARIO_FILE}; give its set with --set SET", folder.display()),
        });
    }
    let text = input::read_to_string(&path, limits::SETTINGS)
        .map_err(|source| ExperimentError::Unreadable { path: path.clone(), source })?;
    let base = from.scenario_folder.map_or_else(PathBuf::new, Path::to_owned);
    let base = fs::canonicalize(&base).unwrap_or(base);
    let mut file = ScenarioFile::parse(&without_programs(text), &path.display().to_string(), base, &[])?;
    from.mocap_directory.iter().for_each(|directory| file.allowed.allow(directory));
    if from.allow_outside {
        file.allowed.allow_anywhere();
    }
    let (set, _) = draw(&file, from.mocap_directory, progress)?;
    if set.blind.set_hash != set_hash {
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

/// Refuses a set that is not the one with this hash, because [`set_of_run`] would draw the run's scenario instead.
///
/// # Errors
/// [`ExperimentError::AnotherSet`], or one that says why a set cannot be read.
pub(crate) fn refuse_other_sets(run: &Path, set_hash: &str, sets: &[PathBuf]) -> Result<(), ExperimentError> {
    for path in sets {
        let found = BlindSet::read(path)?.set_hash;
        if found != set_hash {
            let detail = format!("the run's set has hash {set_hash}, this set has {found}");
            return Err(ExperimentError::AnotherSet { run: run.to_owned(), set: path.clone(), detail });
        }
    }
    Ok(())
}

/// A scenario without its trackers if one is a program, which no file may name; the set does not depend on them.
fn without_programs(text: String) -> String {
    let Ok(mut tree) = text.parse::<toml::Table>() else { return text };
    let has_program = serde_json::to_value(&tree).is_ok_and(|tree| program_in(&tree).is_some());
    if !has_program {
        return text;
    }
    tree.remove("tracker");
    tree.remove("methods");
    tree.to_string()
}
