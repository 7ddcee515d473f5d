//! Sets and runs as arguments: whether a folder is what was asked for, before anything in it is read.

use std::path::Path;

use crate::benchmark_set::is_set;
use crate::common::ExperimentError;
use crate::measure::RUN_FILE;
use crate::scenario::similar_file;

/// Files of which a tracker's folder has one.
const FILES_OF_RUNS: [&str; 4] = [RUN_FILE, "poses.npz", "track.json", "program.json"];

/// Checks that this may be a set: refuses a misspelt path, a scenario and a run.
///
/// # Errors
/// [`ExperimentError::Argument`] that says what was found instead.
pub(super) fn expect_set(set: &Path) -> Result<(), ExperimentError> {
    expect_there("SET", set)?;
    if set.is_file() && set.extension().is_some_and(|extension| extension == "toml") {
        let what = format!(
            "is a scenario or another file of settings, and the directory of a benchmark set was expected: make the set \
             first with skiagraph render {} --out SET",
            set.display()
        );
        return Err(mistaken("SET", set, &what));
    }
    if !is_set(set) && is_run(set) {
        let what = "is a run, and a benchmark set was expected: give the set that the run was made on";
        return Err(mistaken("SET", set, what));
    }
    Ok(())
}

/// Checks that this may be a run or a file of estimates: refuses a misspelt path and a set.
///
/// # Errors
/// [`ExperimentError::Argument`] that says what was found instead.
pub(super) fn expect_run(run: &Path) -> Result<(), ExperimentError> {
    expect_there("RUN", run)?;
    if is_set(run) && !is_run(run) {
        let what = "is a benchmark set, and a run was expected: make one with skiagraph track SET --tracker NAME --out \
                    RUN, and measure it with skiagraph evaluate SET RUN";
        return Err(mistaken("RUN", run, what));
    }
    Ok(())
}

/// Checks the arguments of a command that takes a set and then a run; `command` is its name.
///
/// # Errors
/// [`ExperimentError::Argument`], also if they are exchanged.
pub(super) fn expect_set_and_run(command: &str, set: &Path, run: &Path) -> Result<(), ExperimentError> {
    if is_set(run) && !is_set(set) && (is_run(set) || set.is_file()) {
        let detail = format!(
            "the two are exchanged, {} is the set: skiagraph {command} {} {}",
            run.display(),
            run.display(),
            set.display()
        );
        return Err(ExperimentError::Argument { argument: "SET RUN", detail });
    }
    expect_set(set)?;
    expect_run(run)
}

/// Refuses a path that does not exist if a sibling has a similar name; any other missing path is reported when it is
/// read.
fn expect_there(argument: &'static str, path: &Path) -> Result<(), ExperimentError> {
    match similar_file(path).filter(|_| !path.exists()) {
        Some(guess) => {
            let detail = format!("no such file or folder: {}; did you mean {guess}?", path.display());
            Err(ExperimentError::Argument { argument, detail })
        }
        None => Ok(()),
    }
}

fn is_run(folder: &Path) -> bool {
    FILES_OF_RUNS.iter().any(|file| folder.join(file).is_file())
}

fn mistaken(argument: &'static str, path: &Path, what: &str) -> ExperimentError {
    ExperimentError::Argument { argument, detail: format!("{} {what}", path.display()) }
}
