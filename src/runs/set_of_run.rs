//! The set that a run was made from.

use std::fs;
use std::path::{Path, PathBuf};

use crate::artefacts::{MADE_BY, MadeBy};
use crate::common::{ExperimentError, Progress};
use crate::prepare::scenario_copy::SCENARIO_FILE;
use crate::rendering::draw;
use crate::scenario::{RUN_COMMAND, ScenarioFile, program_in};
use crate::train::Models;
use skiagraph_core::input::{self, limits};
use skiagraph_set::{BenchmarkSet, BlindSet};

/// The sources of the runs' sets.
#[derive(Clone, Copy, Debug, Default)]
pub struct MoreOf<'a> {
    /// Sets on disk, identified by their hashes.
    pub sets: &'a [PathBuf],
    /// Base folder of the paths in the runs' scenarios, for runs whose set is not among `sets`.
    pub scenario_folder: Option<&'a Path>,
    /// Directory that is searched for clips.
    pub mocap_directory: Option<&'a Path>,
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
    let Some(text) = recorded_scenario(folder)? else {
        if let Some((set, found)) = others.pop() {
            let detail = format!("the run's set has hash {set_hash}, this set has {found}");
            return Err(ExperimentError::AnotherSet { run: folder.to_owned(), set: set.clone(), detail });
        }
        let detail = format!("{} has no scenario; give its set with --set SET", folder.display());
        return Err(ExperimentError::Argument { argument, detail });
    };
    let base = from.scenario_folder.map_or_else(PathBuf::new, Path::to_owned);
    let base = fs::canonicalize(&base).unwrap_or(base);
    let file = ScenarioFile::parse(&text, &folder.join(MADE_BY).display().to_string(), base, &[])?;
    let (set, _) = draw(&file, from.mocap_directory, progress)?;
    if set.blind.set_hash != set_hash {
        return Err(ExperimentError::AnotherSet {
            run: folder.to_owned(),
            set: folder.join(MADE_BY),
            detail:
                "its scenario now gives another set, because skiagraph or input files have changed; run all seeds again"
                    .to_owned(),
        });
    }
    let models = Models::new(&file.folder, &set.truth.recordings);
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

/// The scenario of a run, as its folder records it; `None` for a run of a set. It has no trackers if one is a program,
/// which no file may name; the set does not depend on them.
fn recorded_scenario(folder: &Path) -> Result<Option<String>, ExperimentError> {
    // runs of earlier versions have it in a file of its own
    let older = || toml::from_str(&input::read_to_string(&folder.join(SCENARIO_FILE), limits::SETTINGS).ok()?).ok();
    let recorded = MadeBy::at(folder).filter(|made_by| made_by.command == RUN_COMMAND).map(|made_by| made_by.settings);
    let Some(mut tree) = recorded.or_else(older) else { return Ok(None) };
    if let (Some(_), Some(keys)) = (program_in(&tree), tree.as_object_mut()) {
        keys.remove("tracker");
        keys.remove("methods");
    }
    let malformed =
        |error: toml::ser::Error| ExperimentError::Malformed { path: folder.join(MADE_BY), detail: error.to_string() };
    toml::to_string(&tree).map(Some).map_err(malformed)
}
