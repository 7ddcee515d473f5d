//! Checks that set and run arguments are folders of the right kind, before reading their content.

use std::path::Path;

use crate::common::ExperimentError;
use crate::measure::RUN_FILE;
use crate::scenario::similar_file;
use skiagraph_set::is_set;

/// A folder with any of these files is a run.
const RUN_FILES: [&str; 4] = [RUN_FILE, "poses.npz", "track.json", "program.json"];

/// Refuses a missing path, a scenario, another file and a run.
pub(super) fn expect_set(set: &Path) -> Result<(), ExperimentError> {
    refuse_misspelt("SET", set)?;
    if !set.exists() {
        let detail = format!(
            "no such folder: {}; expected the directory of a benchmark set, as skiagraph render SCENARIO --out SET makes it",
            set.display()
        );
        return Err(ExperimentError::Argument { argument: "SET", detail });
    }
    if set.is_file() && set.extension().is_some_and(|extension| extension == "toml") {
        let what = format!(
            "is a scenario, but the directory of a benchmark set was expected: make the set with skiagraph render \
             {} --out SET",
            set.display()
        );
        return Err(wrong_kind("SET", set, &what));
    }
    if set.is_file() {
        return Err(wrong_kind("SET", set, "is a file, but the directory of a benchmark set was expected"));
    }
    if !is_set(set) && is_run(set) {
        let what = "is a run, but a benchmark set was expected: give the set that the run was made on";
        return Err(wrong_kind("SET", set, what));
    }
    Ok(())
}

/// Refuses a misspelt path and a set.
pub(super) fn expect_run(run: &Path) -> Result<(), ExperimentError> {
    refuse_misspelt("RUN", run)?;
    if is_set(run) && !is_run(run) {
        let what = "is a benchmark set, but a run was expected: make one with skiagraph track SET --tracker NAME --out \
                    RUN, and measure it with skiagraph evaluate SET RUN";
        return Err(wrong_kind("RUN", run, what));
    }
    Ok(())
}

/// Checks the arguments of a command that takes a set and then a run; `command` is its name.
///
/// # Errors
/// [`ExperimentError::Argument`], also if the two are swapped.
pub(super) fn expect_set_and_run(command: &str, set: &Path, run: &Path) -> Result<(), ExperimentError> {
    if is_set(run) && !is_set(set) && (is_run(set) || set.is_file()) {
        let detail = format!(
            "SET and RUN are swapped: {} is the set; use skiagraph {command} {} {}",
            run.display(),
            run.display(),
            set.display()
        );
        return Err(ExperimentError::Argument { argument: "SET RUN", detail });
    }
    expect_set(set)?;
    expect_run(run)
}

/// Refuses a path that does not exist if a sibling has a similar name.
fn refuse_misspelt(argument: &'static str, path: &Path) -> Result<(), ExperimentError> {
    match similar_file(path).filter(|_| !path.exists()) {
        Some(guess) => {
            let detail = format!("no such file or folder: {}; did you mean {guess}?", path.display());
            Err(ExperimentError::Argument { argument, detail })
        }
        None => Ok(()),
    }
}

pub(super) fn is_run(folder: &Path) -> bool {
    RUN_FILES.iter().any(|file| folder.join(file).is_file())
}

fn wrong_kind(argument: &'static str, path: &Path, what: &str) -> ExperimentError {
    ExperimentError::Argument { argument, detail: format!("{} {what}", path.display()) }
}
