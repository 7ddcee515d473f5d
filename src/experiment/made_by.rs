//! What made a result, as its files tell it, the first difference from what is about to be made, and where that goes.
//!
//! The rule for what is there already: a command replaces its own earlier result, made from the same inputs with the
//! same settings. What took work and was made otherwise stays, unless it is to be moved aside.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::external::EXTERNAL_FILE;
use super::results::RUN_FILE;
use super::scenario_copy::{SCENARIO_FILE, scenario_text};
use super::tracking::{POSES_FILE, TRACK_FILE};
use crate::artefacts::{ArtefactKind, difference, is_signed, sibling};
use crate::benchmark_set::BlindSet;
use crate::experiment::{ExperimentError, ProgramOptions, ProgramSettings};
use crate::input::{self, limits};
use crate::npz::Npz;
use crate::scenario::{ScenarioFile, TrackerSettings};

/// What made a result, key by key.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MadeBy(Value);

impl MadeBy {
    /// A scenario that is run, as it stands in a run's folder.
    ///
    /// # Errors
    /// [`ExperimentError::Malformed`] where the text is no TOML.
    pub(super) fn run(scenario: &str) -> Result<Self, ExperimentError> {
        let scenario: Value = toml::from_str(scenario)
            .map_err(|e| ExperimentError::Malformed { path: SCENARIO_FILE.into(), detail: e.to_string() })?;
        Ok(Self(json!({"command": "skiagraph run", "scenario": scenario})))
    }

    /// A tracker of ours on a set.
    pub(super) fn track(set: &BlindSet, tracker: &TrackerSettings, seeds: &[u64]) -> Self {
        let calibrate = set.start.calibrate && matches!(tracker, TrackerSettings::AnnealedParticleFilter(_));
        Self::tracked(&set.set_hash, json!(tracker), calibrate, json!(seeds))
    }

    fn tracked(set_hash: &str, tracker: Value, calibrate: bool, seeds: Value) -> Self {
        let command = "skiagraph track";
        Self(json!({
            "command": command, "tracker": tracker, "--calibrate": calibrate, "seeds": seeds, "set hash": set_hash,
        }))
    }

    /// A program on a set.
    pub(super) fn program(set: &BlindSet, program: &ProgramSettings, seeds: &[u64]) -> Self {
        Self::programmed(&set.set_hash, &program.command, &ProgramOptions::of(program), json!(seeds))
    }

    fn programmed(set_hash: &str, program: &str, options: &ProgramOptions, seeds: Value) -> Self {
        let command = "skiagraph track --exec";
        Self(json!({
            "command": command, "--exec": program, "options": options, "seeds": seeds, "set hash": set_hash,
        }))
    }

    /// A measured estimate of another program; `estimate` is its path as the user gave it.
    pub(super) fn evaluation(set_hash: &str, estimate: &str) -> Self {
        Self(json!({"command": "skiagraph evaluate", "estimate": estimate, "set hash": set_hash}))
    }

    /// What makes each seed of it: the same without their numbers, and what else it depends on.
    pub(super) fn of_each_seed(&self, key: &str, value: Value) -> Value {
        let mut settings = self.0.clone();
        (settings["seeds"], settings[key]) = (Value::Null, value);
        settings
    }

    /// What made the result in a folder; `None` where its files do not tell.
    pub(super) fn at(folder: &Path) -> Option<Self> {
        let json = |name: &str| -> Option<Value> {
            serde_json::from_slice(&input::read(&folder.join(name), limits::RECORD).ok()?).ok()
        };
        let word = |value: &Value, key: &str| value[key].as_str().unwrap_or_default().to_owned();
        if let Ok(scenario) = input::read_to_string(&folder.join(SCENARIO_FILE), limits::SETTINGS) {
            return Self::run(&scenario).ok();
        }
        if let Some(track) = json(TRACK_FILE) {
            let calibrated = track["calibration"].as_array().is_some_and(|reports| !reports.is_empty());
            return Some(Self::tracked(&word(&track, "set_hash"), track["tracker"].clone(), calibrated, seeds(folder)));
        }
        if let Some(program) = json(EXTERNAL_FILE) {
            let options = serde_json::from_value(program["options"].clone()).unwrap_or_default();
            let command = word(&program, "command");
            return Some(Self::programmed(&word(&program, "set_hash"), &command, &options, seeds(folder)));
        }
        json(RUN_FILE).map(|run| Self::evaluation(&word(&run, "set_hash"), &word(&run, "estimate")))
    }

    /// As [`Self::difference_at`] of an evaluation, its estimates compared by what `name` makes of their paths.
    pub(super) fn difference_by(&self, folder: &Path, name: impl Fn(&str) -> String) -> Option<String> {
        let named = |mut made_by: Self| {
            let estimate = made_by.0.get_mut("estimate");
            estimate.into_iter().for_each(|path| *path = name(path.as_str().unwrap_or_default()).into());
            made_by.0
        };
        difference(&named(Self::at(folder)?), &named(self.clone()))
    }

    /// The first key in which what made the result in a folder differs from this; `None` where nothing does, or nothing
    /// is told.
    pub(super) fn difference_at(&self, folder: &Path) -> Option<String> {
        difference(&Self::at(folder)?.0, &self.0)
    }
}

/// Seeds of the poses in a folder.
fn seeds(folder: &Path) -> Value {
    let read = || {
        let bytes = input::read(&folder.join(POSES_FILE), limits::ARRAYS).ok()?;
        Npz::from_bytes(POSES_FILE, &bytes).ok()?.whole_numbers(POSES_FILE, "seeds").ok()
    };
    json!(read())
}

/// Where results go, and what a user should know of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunPlace {
    /// The directory.
    pub path: PathBuf,
    /// That results of another scenario, or of other settings, are avoided.
    pub note: Option<String>,
}

impl RunPlace {
    /// The place that the user `asked` for; else `runs/NAME`, or where that holds another run the first of
    /// `runs/NAME-2` and so on where nothing is or the results of the same scenario with the same settings. At a place
    /// that was asked for another run is refused when it is begun.
    ///
    /// # Errors
    /// [`ExperimentError`] if the scenario cannot be written down.
    pub fn new(file: &ScenarioFile, asked: Option<&Path>) -> Result<Self, ExperimentError> {
        if let Some(path) = asked {
            return Ok(Self { path: path.to_owned(), note: None });
        }
        let first = Path::new("runs").join(&file.scenario.name);
        Ok(Self::first_free(&first, &MadeBy::run(&scenario_text(&file.scenario)?)?))
    }

    fn first_free(first: &Path, made_by: &MadeBy) -> Self {
        let is_same = |path: &Path| MadeBy::at(path).is_some_and(|there| difference(&there.0, &made_by.0).is_none());
        let is_other = |path: &Path| is_signed(path) && !is_same(path);
        let path = free_place(first, is_other);
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
    if !is_other(first) {
        return first.to_owned();
    }
    let is_free = |path: &PathBuf| path.symlink_metadata().is_err() || ArtefactKind::Run.is_own(path);
    let mut further = (2..).map(|number: u32| sibling(first, "", &format!("-{number}")));
    further.find(|path| is_free(path) && !is_other(path)).unwrap_or_else(|| first.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artefacts::sign;
    use std::fs;

    #[test]
    fn a_folder_tells_what_made_it_or_nothing() {
        let root = tempfile::tempdir().unwrap();
        let same = MadeBy::evaluation("0f", "mine.npz");
        assert_eq!(same.difference_at(root.path()), None, "nothing is there");
        fs::write(root.path().join(RUN_FILE), r#"{"set_hash": "0f", "estimate": "mine.npz"}"#).unwrap();
        assert_eq!(same.difference_at(root.path()), None);
        let other = MadeBy::evaluation("1e", "mine.npz");
        assert_eq!(other.difference_at(root.path()).unwrap(), "set hash: was 0f, now 1e");
        fs::write(root.path().join(SCENARIO_FILE), "seeds = 2").unwrap();
        assert!(same.difference_at(root.path()).unwrap().contains("was skiagraph run"));
    }

    #[test]
    fn results_go_where_the_same_scenario_is_or_nothing() {
        let root = tempfile::tempdir().unwrap();
        let run = |name: &str, scenario: &str| {
            fs::create_dir(root.path().join(name)).unwrap();
            fs::write(root.path().join(name).join("track.json"), "{\"schema\": \"skiagraph.track/1\"}").unwrap();
            fs::write(root.path().join(name).join(SCENARIO_FILE), scenario).unwrap();
            sign(&root.path().join(name)).unwrap();
        };
        let place = |text: &str| {
            let place = RunPlace::first_free(&root.path().join("walk"), &MadeBy::run(text).unwrap());
            (place.path.file_name().unwrap().to_str().unwrap().to_owned(), place.note)
        };
        assert_eq!(place("name = 'one'"), ("walk".to_owned(), None));
        run("walk", "name = 'one'");
        assert_eq!(place("name = 'one'"), ("walk".to_owned(), None));
        let (name, note) = place("name = 'two'");
        assert!(
            name == "walk-2" && note.as_ref().unwrap().contains("walk holds results of another scenario"),
            "{note:?}"
        );
        fs::create_dir(root.path().join("walk-2")).unwrap();
        assert_eq!(place("name = 'two'").0, "walk-2", "an empty directory is free");
        fs::write(root.path().join("walk-2/thesis.tex"), "years of work").unwrap();
        run("walk-3", "name = 'two'");
        assert_eq!(place("name = 'two'").0, "walk-3");
        assert_eq!(place("name = 'three'").0, "walk-4");
    }
}
