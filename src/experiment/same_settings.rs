//! What made a result, as its files tell it, and the first difference from what is about to be made.
//!
//! The rule for what is there already: a command replaces its own earlier result, made from the same inputs with the
//! same settings. What took work and was made otherwise stays, unless it is to be moved aside.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};

use super::external::EXTERNAL_FILE;
use super::results::RUN_FILE;
use super::scenario_copy::SCENARIO_FILE;
use super::tracking::{POSES_FILE, TRACK_FILE};
use crate::benchmark_set::BlindSet;
use crate::experiment::{ExperimentError, ProgramOptions, ProgramSettings};
use crate::input::{self, excerpt, limits};
use crate::npz::Npz;
use crate::scenario::TrackerSettings;

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

/// The first key in which two trees differ, with both values.
pub(super) fn difference(there: &Value, here: &Value) -> Option<String> {
    let (mut old, mut new) = (BTreeMap::new(), BTreeMap::new());
    flatten("", there, &mut old);
    flatten("", here, &mut new);
    // another command differs in all keys; what it is says more than they do
    let keys = || std::iter::once("command").chain(old.keys().chain(new.keys()).map(String::as_str));
    let key = keys().find(|key| old.get(*key) != new.get(*key))?;
    let value = |table: &BTreeMap<String, String>| table.get(key).map_or("nothing".to_owned(), |text| excerpt(text));
    Some(format!("{key}: there {}, here {}", value(&old), value(&new)))
}

/// Every value by its key from the top, as overrides name it. Keys without a value and empty tables count as absent.
fn flatten(prefix: &str, tree: &Value, into: &mut BTreeMap<String, String>) {
    match tree {
        Value::Object(table) => {
            for (key, value) in table {
                match prefix.is_empty() && ["scenario", "tracker", "options", "run", "files"].contains(&key.as_str()) {
                    true => flatten("", value, into),
                    false if prefix.is_empty() => flatten(key, value, into),
                    false => flatten(&format!("{prefix}.{key}"), value, into),
                }
            }
        }
        Value::Null => {}
        Value::String(text) => drop(into.insert(prefix.to_owned(), text.clone())),
        other => drop(into.insert(prefix.to_owned(), other.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_key_that_differs_is_named_with_both_values_and_another_command_before_all() {
        let a = MadeBy::run("seeds = 5\n[rig.ring]\ncount = 4").unwrap();
        let b = MadeBy::run("seeds = 5\n[rig.ring]\ncount = 8").unwrap();
        assert_eq!(difference(&a.0, &b.0).unwrap(), "rig.ring.count: there 4, here 8");
        assert_eq!(difference(&a.0, &a.0), None);
        let evaluated = MadeBy::evaluation("0f", "mine.npz");
        assert_eq!(difference(&a.0, &evaluated.0).unwrap(), "command: there skiagraph run, here skiagraph evaluate");
        let other = MadeBy::evaluation("0f", "mine.trc");
        assert_eq!(difference(&evaluated.0, &other.0).unwrap(), "estimate: there mine.npz, here mine.trc");
        let seedless = MadeBy::run("[rig.ring]\ncount = 4").unwrap();
        assert_eq!(difference(&a.0, &seedless.0).unwrap(), "seeds: there 5, here nothing");
    }

    #[test]
    fn a_folder_tells_what_made_it_or_nothing() {
        let root = tempfile::tempdir().unwrap();
        let same = MadeBy::evaluation("0f", "mine.npz");
        assert_eq!(same.difference_at(root.path()), None, "nothing is there");
        std::fs::write(root.path().join(RUN_FILE), r#"{"set_hash": "0f", "estimate": "mine.npz"}"#).unwrap();
        assert_eq!(same.difference_at(root.path()), None);
        let other = MadeBy::evaluation("1e", "mine.npz");
        assert_eq!(other.difference_at(root.path()).unwrap(), "set hash: there 0f, here 1e");
        std::fs::write(root.path().join(SCENARIO_FILE), "seeds = 2").unwrap();
        assert!(same.difference_at(root.path()).unwrap().contains("there skiagraph run"));
    }
}
