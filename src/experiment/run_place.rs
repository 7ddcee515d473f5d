//! Where the results of `skiagraph run` go.

use std::fs;
use std::path::{Path, PathBuf};

use super::ExperimentError;
use super::provenance::{ResultKind, is_own_output};
use super::scenario_copy::{SCENARIO_FILE, scenario_text};
use crate::scenario::ScenarioFile;

/// Where results go, and what a user should know of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunPlace {
    /// The directory.
    pub path: PathBuf,
    /// That results of another scenario, or of other settings, are avoided.
    pub note: Option<String>,
}

/// What is at a place, for somebody who wants to run a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Found {
    Nothing,
    /// A run of the same scenario with the same settings.
    Same,
    /// A run of another scenario, or with other settings, or one of `skiagraph track`.
    OtherRun,
    NotOurs,
}

impl RunPlace {
    /// The place that the user `asked` for; else `runs/NAME`, or where that holds another run the first of
    /// `runs/NAME-2` and so on where nothing is or the results of the same scenario with the same settings. At a place
    /// that was asked for another run is refused when it is begun.
    ///
    /// # Errors
    /// [`ExperimentError`] if the scenario cannot be written down.
    pub fn new(file: &ScenarioFile, asked: Option<&Path>) -> Result<Self, ExperimentError> {
        let text = scenario_text(&file.scenario)?;
        if let Some(path) = asked {
            return Ok(Self { path: path.to_owned(), note: None });
        }
        Ok(Self::first_free(&Path::new("runs").join(&file.scenario.name), &text))
    }

    fn first_free(first: &Path, text: &str) -> Self {
        let path = free_place(first, |path| found_at(path, text) == Found::OtherRun);
        let note = format!(
            "{} holds results of another scenario or of other settings; results were written to {}",
            first.display(),
            path.display()
        );
        Self { note: (path != first).then_some(note), path }
    }
}

/// `NAME`, or where it holds a result of ours that was made otherwise, the first of `NAME-2` and so on where nothing is
/// or the same. What is not ours at `NAME` is refused later, or with --force moved aside, as anywhere.
pub(super) fn free_place(first: &Path, is_other: impl Fn(&Path) -> bool) -> PathBuf {
    let numbered = |number: u32| {
        let mut name = first.file_name().unwrap_or_default().to_owned();
        name.push(format!("-{number}"));
        first.with_file_name(name)
    };
    if !is_other(first) {
        return first.to_owned();
    }
    let is_free = |path: &PathBuf| path.symlink_metadata().is_err() || is_own_output(path, ResultKind::Run);
    let further = (2..).map(numbered).find(|path| is_free(path) && !is_other(path));
    further.unwrap_or_else(|| first.to_owned())
}

fn found_at(path: &Path, text: &str) -> Found {
    if path.symlink_metadata().is_err() {
        return Found::Nothing;
    }
    if !is_own_output(path, ResultKind::Run) {
        return Found::NotOurs;
    }
    match fs::read_to_string(path.join(SCENARIO_FILE)) {
        Ok(there) if there == text => Found::Same,
        Err(_) if fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none()) => Found::Nothing,
        _ => Found::OtherRun,
    }
}

#[cfg(test)]
mod tests {
    use super::super::ownership;
    use super::*;

    #[test]
    fn results_go_where_the_same_scenario_is_or_nothing() {
        let root = tempfile::tempdir().unwrap();
        let run = |name: &str, scenario: &str| {
            fs::create_dir(root.path().join(name)).unwrap();
            fs::write(root.path().join(name).join("track.json"), "{\"schema\": \"skiagraph.track/1\"}").unwrap();
            fs::write(root.path().join(name).join(SCENARIO_FILE), scenario).unwrap();
            ownership::sign(&root.path().join(name)).unwrap();
        };
        let place = |text: &str| {
            let place = RunPlace::first_free(&root.path().join("walk"), text);
            (place.path.file_name().unwrap().to_str().unwrap().to_owned(), place.note)
        };
        assert_eq!(place("one"), ("walk".to_owned(), None));
        run("walk", "one");
        assert_eq!(place("one"), ("walk".to_owned(), None));
        let (name, note) = place("two");
        assert!(
            name == "walk-2" && note.as_ref().unwrap().contains("walk holds results of another scenario"),
            "{note:?}"
        );
        fs::create_dir(root.path().join("walk-2")).unwrap();
        assert_eq!(place("two").0, "walk-2", "an empty directory is free");
        fs::write(root.path().join("walk-2/thesis.tex"), "years of work").unwrap();
        run("walk-3", "two");
        assert_eq!(place("two").0, "walk-3");
        assert_eq!(place("three").0, "walk-4");
    }
}
