//! Finds all errors of a scenario, not only the first: after each error the key is removed from the tree (or replaced
//! by a valid value if it is required), and the rest is read again.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::diagnostic::Diagnostic;
use super::json_tree::{Problem, TreeError};
use super::program::program_in;
use super::read::{covers, set, with_full_key};
use super::tree::{at, describe_other_kind, settings_of, tree_of};
use super::{DEFAULT_SCENARIO, Scenario, ScenarioError, ScenarioFile};
use skiagraph_core::input::{self, limits};

const MOST_ERRORS: usize = 200;

#[derive(Clone, Debug)]
pub struct Survey {
    /// The scenario without its invalid keys; `None` if it cannot be read at all.
    pub file: Option<ScenarioFile>,
    /// All errors: those of the file in its order, then missing keys and overrides; empty if the scenario is valid by
    /// itself.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a scenario (`None`: the built-in one) with overrides as [`ScenarioFile::open`] does, collecting all errors.
pub fn survey(path: Option<&Path>, overrides: &[String]) -> Result<Survey, ScenarioError> {
    let sound = match path {
        None => ScenarioFile::built_in(overrides),
        Some(path) => ScenarioFile::open(path, overrides),
    };
    match sound {
        Ok(file) => Ok(Survey { file: Some(file), diagnostics: Vec::new() }),
        Err(ScenarioError::Unsound(first)) => Ok(Repair::new(path, overrides)?.survey(first)),
        Err(unreadable) => Err(unreadable),
    }
}

struct Repair<'a> {
    file: ScenarioFile,
    overrides: &'a [String],
    tree: Value,
    diagnostics: Vec<Diagnostic>,
    /// Dotted keys that were invalid.
    removed: Vec<String>,
}

impl<'a> Repair<'a> {
    fn new(path: Option<&Path>, overrides: &'a [String]) -> Result<Self, ScenarioError> {
        let mut file = ScenarioFile::built_in(&[])?;
        file.text = DEFAULT_SCENARIO.to_owned();
        if let Some(path) = path {
            file.text = input::read_to_string(path, limits::SETTINGS)
                .map_err(|source| ScenarioError::Unreadable { path: path.to_owned(), source })?;
            file.origin = path.display().to_string();
            file.folder = path.parent().map(Path::to_owned).unwrap_or_default();
            file.path = Some(PathBuf::from(path));
        }
        Ok(Self { file, overrides, tree: Value::Null, diagnostics: Vec::new(), removed: Vec::new() })
    }

    fn survey(mut self, first: Diagnostic) -> Survey {
        let whole = self.read_all().is_some();
        // errors of the file in its order, then missing keys and overrides
        self.diagnostics.sort_by_key(|diagnostic| diagnostic.place.as_ref().map_or(usize::MAX, |place| place.line));
        if self.diagnostics.is_empty() {
            self.diagnostics.push(first);
        }
        Survey { file: whole.then_some(self.file), diagnostics: self.diagnostics }
    }

    fn read_all(&mut self) -> Option<()> {
        match tree_of(&self.file.text, &self.file.origin) {
            Ok(tree) => self.tree = tree,
            Err(diagnostic) => {
                self.diagnostics.push(diagnostic);
                return None;
            }
        }
        // the first error says what the file is; its keys would all be unknown
        if describe_other_kind(&self.tree).is_some() || program_in(&self.tree).is_some() {
            return None;
        }
        self.file.scenario = self.settings()?;
        for assignment in self.overrides {
            let applied = with_full_key(assignment, &self.file.scenario).and_then(|full| {
                set(&mut self.tree, &full)?;
                Ok(full)
            });
            match applied {
                Ok(full) => self.file.overrides.push(full),
                Err(diagnostic) => self.diagnostics.push(diagnostic),
            }
            self.file.scenario = self.settings()?;
        }
        while let Err(problem) = self.file.scenario.first_problem() {
            if self.diagnostics.len() >= MOST_ERRORS {
                return None;
            }
            // a problem may exist only because of a removed key
            let follows = |needed: &str| self.removed.iter().any(|removed| removed.starts_with(needed));
            if !problem.needs.is_some_and(follows) {
                self.diagnostics.push(self.file.problem(&problem));
            }
            if !self.remove(&problem.key) {
                return None;
            }
            self.file.scenario = self.settings()?;
        }
        Some(())
    }

    /// The settings of the tree after removal of all invalid keys.
    fn settings(&mut self) -> Option<Scenario> {
        for _ in 0..MOST_ERRORS {
            match settings_of(self.tree.clone()) {
                Ok(scenario) => return Some(scenario),
                Err(error) => self.repair(error)?,
            }
        }
        None
    }

    fn repair(&mut self, error: TreeError) -> Option<()> {
        if let Problem::Missing { key: field } = error.problem {
            let key = joined(&error.key, field);
            if !self.removed.contains(&key) {
                self.report(error.clone(), &key);
            }
            let number = self.removed.len();
            let table = at(&mut self.tree, &error.key)?.as_object_mut()?;
            table.insert(field.to_owned(), placeholder(field, number)?);
            return Some(());
        }
        let inside = error.unknown().map(|word| joined(&error.key, word));
        let key = inside.filter(|key| at(&mut self.tree, key).is_some()).unwrap_or(error.key.clone());
        let consequence = self.removed.iter().any(|removed| removed.starts_with(&key) && !key.is_empty());
        if !consequence {
            self.report(error, &key);
        }
        self.remove(&key).then_some(())
    }

    fn report(&mut self, error: TreeError, key: &str) {
        let error = error.with_range(&self.tree, Scenario::first_problem);
        let culprit = self.file.overrides.iter().rev().find(|assignment| covers(assignment, key));
        self.diagnostics.push(match culprit {
            Some(assignment) => error.of_override(assignment),
            None => error.in_text(&self.file.origin, &self.file.text),
        });
    }

    fn remove(&mut self, key: &str) -> bool {
        let whole = key.trim_end_matches(|c: char| c == ']' || c == '[' || c.is_ascii_digit());
        let key = if key.ends_with(']') { whole } else { key };
        let (table, name) = key.rsplit_once('.').unwrap_or(("", key));
        let Some(table) = at(&mut self.tree, table).and_then(Value::as_object_mut) else { return false };
        let was_there = table.remove(name).is_some();
        self.removed.push(key.to_owned());
        was_there
    }
}

fn joined(table: &str, key: &str) -> String {
    if table.is_empty() { key.to_owned() } else { format!("{table}.{key}") }
}

/// A valid value for a required key that was invalid or missing.
fn placeholder(key: &str, number: usize) -> Option<Value> {
    Some(match key {
        "schema" => json!("skiagraph.scenario/1"),
        "name" => json!(format!("unnamed{number}")),
        "motion" => json!({ "clip": "embedded:walk" }),
        "clip" => json!("embedded:walk"),
        "clips" => json!([{ "clip": "embedded:run" }]),
        "shape" => json!({ "sphere": { "radius_m": 0.1 } }),
        "size_m" => json!([1.0, 1.0, 1.0]),
        "radius_m" | "length_m" | "impulse_ns" | "length" | "girth" => json!(1.0),
        "place_m" => json!([0.0, 0.0, 0.0]),
        "size_px" => json!([64, 64]),
        "matrix" => json!([[60.0, 0.0, 32.0], [0.0, 60.0, 32.0], [0.0, 0.0, 1.0]]),
        "rotation" => json!([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
        "translation_m" => json!([0.0, 1.0, 3.0]),
        "at" => json!(0.0),
        "link" => json!("pelvis"),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = "schema = \"skiagraph.scenario/1\"\nname = \"a\"\n\n[motion]\nclip = \"embedded:walk\"\n";

    fn errors_of(text: &str, overrides: &[&str]) -> Vec<String> {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("a.toml");
        std::fs::write(&path, text).unwrap();
        let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
        let found = survey(Some(&path), &overrides).unwrap();
        let folder = format!("{}/", root.path().display());
        found.diagnostics.iter().map(|diagnostic| diagnostic.to_string().replace(&folder, "")).collect()
    }

    fn assert_errors(text: &str, overrides: &[&str], expected: &[&str]) {
        let errors = errors_of(text, overrides);
        assert_eq!(errors.len(), expected.len(), "{errors:#?}");
        for (error, expected) in errors.iter().zip(expected) {
            assert!(error.contains(expected), "no {expected:?} in {error}");
        }
    }

    #[test]
    fn a_valid_scenario_has_no_errors_and_is_read_unchanged() {
        let found = survey(None, &["seed=3".to_owned()]).unwrap();
        assert!(found.diagnostics.is_empty());
        assert_eq!(found.file.unwrap(), ScenarioFile::built_in(&["seed=3".to_owned()]).unwrap());
    }

    #[test]
    fn missing_keys_are_reported_once_and_the_rest_is_read() {
        let text = "[motion]\nfirst_frame = 0\n[[prop]]\nname = \"a\"\nshape = { sphere = { radius_m = -1.0 } }\n\
                    [[prop]]\nshape = 3\nplace_m = [0, 0]\nname = \"b\"\n";
        let errors = errors_of(text, &["robot=x", "tracker.frosen={}"]);
        for expected in [
            "missing key `schema`",
            "missing key `name`",
            "missing key `clip`",
            "missing key `place_m`",
            "prop[1].shape",
            "prop[1].place_m",
            "override robot=x: `robot` is ambiguous:",
            "override tracker.frosen={}",
            "motion.first_frame: expected a frame number from 1",
            "prop[0].shape.sphere.radius_m: expected 0.001 to 1000",
        ] {
            assert_eq!(errors.iter().filter(|error| error.contains(expected)).count(), 1, "{expected}: {errors:#?}");
        }
        assert_eq!(errors.len(), 10, "{errors:#?}");
    }

    #[test]
    fn consequences_of_an_error_are_not_reported() {
        let text = format!("{SMALL}[actor]\ncontact = \"simulat\"\nfriction = 0.5\n");
        assert_errors(&text, &[], &["did you mean `simulate`?"]);
        let text = format!("{SMALL}[[training.clips]]\nclip = 3\n[tracker.gpdm]\n");
        assert_errors(&text, &[], &["training.clips[0].clip"]);
        assert_errors(&format!("{SMALL}[tracker.frosen]\n"), &[], &["did you mean `frozen`?"]);
    }
}
