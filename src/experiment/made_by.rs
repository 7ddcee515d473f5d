//! The command that made a result, as recorded in its files, and how it differs from the current command.
//!
//! Rule for existing results: a command replaces its own earlier result, made from the same inputs with the same
//! settings. Results of other commands are kept, unless the user has them moved aside.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::artefacts::{ArtefactKind, difference, is_signed, sibling};
use crate::benchmark_set::{BlindSet, EXPORT_README};
use crate::common::ExperimentError;
use crate::external::{EXTERNAL_FILE, ProgramOptions, ProgramSettings};
use crate::input::{self, limits};
use crate::measure::RUN_FILE;
use crate::measure::tracked::{POSES_FILE, TRACK_FILE};
use crate::npz::Npz;
use crate::prepare::scenario_copy::{SCENARIO_FILE, scenario_text};
use crate::scenario::{ScenarioFile, TrackerSettings};

/// The command that made a result, with its settings by key.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MadeBy(Value);

impl MadeBy {
    /// `skiagraph run` of a scenario, given as the text in a run's folder.
    ///
    /// # Errors
    /// [`ExperimentError::Malformed`] if the text is not TOML.
    pub(super) fn run(scenario: &str) -> Result<Self, ExperimentError> {
        let scenario: Value = toml::from_str(scenario)
            .map_err(|e| ExperimentError::Malformed { path: SCENARIO_FILE.into(), detail: e.to_string() })?;
        Ok(Self(json!({"command": "skiagraph run", "scenario": scenario})))
    }

    /// A tracker of this program on a set.
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

    /// An external program on a set.
    pub(super) fn program(set: &BlindSet, program: &ProgramSettings, seeds: &[u64]) -> Self {
        Self::programmed(&set.set_hash, &program.command, &ProgramOptions::of(program), json!(seeds))
    }

    fn programmed(set_hash: &str, program: &str, options: &ProgramOptions, seeds: Value) -> Self {
        let command = "skiagraph track --exec";
        Self(json!({
            "command": command, "--exec": program, "options": options, "seeds": seeds, "set hash": set_hash,
        }))
    }

    /// A measured estimate of another program; `estimate` is its path as given by the user.
    pub(super) fn evaluation(set_hash: &str, estimate: &str) -> Self {
        Self(json!({"command": "skiagraph evaluate", "estimate": estimate, "set hash": set_hash}))
    }

    /// An export with this title of a set; `readme` has its line about the set.
    pub(super) fn export(title: &str, readme: &str) -> Self {
        let set =
            readme.lines().nth(2).unwrap_or_default().trim_start_matches("The benchmark set ").trim_end_matches('.');
        Self(json!({"command": "skiagraph export", "format": title, "set": set}))
    }

    /// The settings that determine each single seed: the same without the seeds' numbers, and with another `key`.
    pub(super) fn of_each_seed(&self, key: &str, value: Value) -> Value {
        let mut settings = self.0.clone();
        (settings["seeds"], settings[key]) = (Value::Null, value);
        if let Some(scenario) = settings.get_mut("scenario") {
            (scenario["seed"], scenario["seeds"]) = (Value::Null, Value::Null);
        }
        settings
    }

    /// The command that made the result in a folder; `None` if its files do not record it.
    pub(super) fn at(folder: &Path) -> Option<Self> {
        let json = |name: &str| -> Option<Value> {
            serde_json::from_slice(&input::read(&folder.join(name), limits::RECORD).ok()?).ok()
        };
        let text = |value: &Value, key: &str| value[key].as_str().unwrap_or_default().to_owned();
        if let Ok(scenario) = input::read_to_string(&folder.join(SCENARIO_FILE), limits::SETTINGS) {
            return Self::run(&scenario).ok();
        }
        if let Some(track) = json(TRACK_FILE) {
            let calibrated = track["calibration"].as_array().is_some_and(|reports| !reports.is_empty());
            return Some(Self::tracked(&text(&track, "set_hash"), track["tracker"].clone(), calibrated, seeds(folder)));
        }
        if let Some(program) = json(EXTERNAL_FILE) {
            let options = serde_json::from_value(program["options"].clone()).unwrap_or_default();
            let command = text(&program, "command");
            return Some(Self::programmed(&text(&program, "set_hash"), &command, &options, seeds(folder)));
        }
        if let Some(run) = json(RUN_FILE) {
            return Some(Self::evaluation(&text(&run, "set_hash"), &text(&run, "estimate")));
        }
        let readme = input::read_to_string(&folder.join(EXPORT_README), limits::SETTINGS).ok()?;
        Some(Self::export(readme.lines().next()?, &readme))
    }

    /// As [`Self::difference_at`] for an evaluation, with the paths of estimates compared after `name` is applied to
    /// them.
    pub(super) fn difference_by(&self, folder: &Path, name: impl Fn(&str) -> String) -> Option<String> {
        let named = |mut made_by: Self| {
            let estimate = made_by.0.get_mut("estimate");
            estimate.into_iter().for_each(|path| *path = name(path.as_str().unwrap_or_default()).into());
            made_by.0
        };
        difference(&named(Self::at(folder)?), &named(self.clone()))
    }

    /// The first key in which the command that made the result in a folder differs from this one; `None` if there is no
    /// difference or no record.
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

/// Where results go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunPlace {
    /// The directory.
    pub path: PathBuf,
    /// A note if results of another scenario, or of other settings, are avoided.
    pub note: Option<String>,
}

impl RunPlace {
    /// The `given` place; else `runs/NAME`, or, if that has another run, the first of `runs/NAME-2` and so on that is
    /// free or has results of the same scenario with the same settings. Another run at a given place is refused later,
    /// when the output is begun.
    ///
    /// # Errors
    /// [`ExperimentError`] if the scenario cannot be serialised.
    pub fn new(file: &ScenarioFile, given: Option<&Path>) -> Result<Self, ExperimentError> {
        if let Some(path) = given {
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
            "{} has results of another scenario or of other settings; results were written to {}",
            first.display(),
            path.display()
        );
        Self { note: (path != first).then_some(note), path }
    }
}

/// `NAME`, or, if it has another result of this program, the first of `NAME-2` and so on that is free or has the same
/// result. Files of others at `NAME` are refused later, or moved aside with --force.
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
    fn a_folder_records_the_command_that_made_it() {
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
    fn results_go_to_a_free_place_or_that_of_the_same_scenario() {
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
            name == "walk-2" && note.as_ref().unwrap().contains("walk has results of another scenario"),
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
