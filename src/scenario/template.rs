//! A scenario that is read many times with different overrides; its text is parsed once.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use serde_json::Value;

use super::overrides::{full_key, keys_of};
use super::read::set;
use super::tree::{settings_of, tree_of};
use super::{Scenario, ScenarioError, ScenarioFile};

/// A scenario file that is read many times with different overrides.
///
/// [`Self::with`] gives the same results and errors as [`ScenarioFile::parse`] with the same overrides, in a small part
/// of the time.
#[derive(Debug)]
pub struct ScenarioTemplate {
    file: ScenarioFile,
    /// The text with the file's own overrides.
    tree: Value,
    /// Full keys by the trackers of a scenario and the written key.
    known: Mutex<BTreeMap<(String, String), String>>,
}

impl ScenarioTemplate {
    /// A template of this file with its overrides.
    pub fn new(file: ScenarioFile) -> Result<Self, ScenarioError> {
        let mut tree = tree_of(&file.text, &file.origin)?;
        file.overrides.iter().try_for_each(|assignment| set(&mut tree, assignment))?;
        Ok(Self { file, tree, known: Mutex::default() })
    }

    /// The file without more overrides.
    pub fn file(&self) -> &ScenarioFile {
        &self.file
    }

    /// The file's text, without overrides.
    pub fn text(&self) -> &str {
        &self.file.text
    }

    /// The overrides of the file itself, with full keys.
    pub fn overrides(&self) -> &[String] {
        &self.file.overrides
    }

    /// The scenario with these overrides, each `key=value`, after those of the file.
    pub fn with(&self, overrides: &[String]) -> Result<ScenarioFile, ScenarioError> {
        match self.quickly_with(overrides) {
            Some(file) => Ok(file),
            None => {
                let all = [&self.file.overrides[..], overrides].concat();
                let file = ScenarioFile::parse(&self.file.text, &self.file.origin, self.file.folder.clone(), &all)?;
                self.learn(overrides, &file);
                Ok(ScenarioFile { path: self.file.path.clone(), ..file })
            }
        }
    }

    /// The value of a key, full or short, in this scenario, or its default; `None` if it has none.
    pub fn value(&self, scenario: &Scenario, key: &str) -> Option<Value> {
        let written = serde_json::to_value(scenario).ok()?;
        let find = |full: &str| full.split('.').try_fold(&written, |value, part| value.get(part)).cloned();
        find(&full_key(key, &keys_of(scenario)).ok()?)
    }

    /// The full key that a short one means in this scenario; unchanged if it is unknown or ambiguous.
    pub(crate) fn full_key(&self, key: &str) -> String {
        full_key(key, &keys_of(&self.file.scenario)).unwrap_or_else(|_| key.to_owned())
    }

    /// Remembers the full keys of overrides.
    fn learn(&self, overrides: &[String], file: &ScenarioFile) {
        let Ok(mut tree) = tree_of(&self.file.text, &self.file.origin) else { return };
        let own = self.file.overrides.len();
        for (at, full) in file.overrides.iter().enumerate() {
            let written = at.checked_sub(own).and_then(|at| overrides[at].split_once('='));
            if let (Some((key, _)), Some((full, _))) = (written, full.split_once('=')) {
                let at = (trackers_of(&tree), key.trim().to_owned());
                self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(at, full.to_owned());
            }
            set(&mut tree, full).ok();
        }
    }

    /// As [`Self::with`], using remembered keys; `None` if a key is not remembered or anything is invalid.
    fn quickly_with(&self, overrides: &[String]) -> Option<ScenarioFile> {
        let mut tree = self.tree.clone();
        let mut full = self.file.overrides.clone();
        for assignment in overrides {
            let (key, value) = assignment.split_once('=')?;
            let key = self.full(key.trim(), &tree)?;
            let assignment = format!("{key}={value}");
            set(&mut tree, &assignment).ok()?;
            full.push(assignment);
        }
        let scenario: Scenario = settings_of(tree).ok()?;
        scenario.first_problem().ok()?;
        Some(ScenarioFile { scenario, overrides: full, ..self.file.clone() })
    }

    /// The full key, if remembered; it depends on the trackers.
    fn full(&self, key: &str, tree: &Value) -> Option<String> {
        let at = (trackers_of(tree), key.to_owned());
        self.known.lock().unwrap_or_else(PoisonError::into_inner).get(&at).cloned()
    }
}

fn trackers_of(tree: &Value) -> String {
    let names = |table: &Value| {
        let names = table.as_object().into_iter().flat_map(|table| table.keys().map(String::as_str));
        names.collect::<Vec<_>>().join(",")
    };
    let methods = tree["methods"].as_object().into_iter().flatten();
    let methods: Vec<String> = methods.map(|(name, settings)| format!("{name}:{}", names(settings))).collect();
    format!("{};{}", names(&tree["tracker"]), methods.join(";"))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn strings(all: &[&str]) -> Vec<String> {
        all.iter().map(|one| (*one).to_owned()).collect()
    }

    #[test]
    fn a_template_gives_the_results_and_errors_of_parsing_the_file_again() {
        let text = super::super::DEFAULT_SCENARIO;
        let base = strings(&["particles=7"]);
        let file = ScenarioFile::parse(text, "walk.toml", PathBuf::new(), &base).unwrap();
        let template = ScenarioTemplate::new(file).unwrap();
        for more in [
            &[][..],
            &["particles=50", "rig.ring.count=2"],
            &["layers=3"],
            &["truth_images=[\"depth\"]"],
            &["layers=3", "particles=4"],
            &["annealed_particle_filter.layers=3", "seed=4"],
            &["tracker.frozen={}"],
            &["tracker.frozen={}", "particles=4"],
            &["tracker.gpdm={}"],
            &["partciles=50"],
            &["particles=0"],
            &["particles"],
            &["rig.ring.size_px=[160, 120]", "mismatch=none", "tracker_body.seed=3"],
        ] {
            let more = strings(more);
            let anew = ScenarioFile::parse(text, "walk.toml", PathBuf::new(), &[base.clone(), more.clone()].concat());
            // the second time with remembered keys
            for _ in 0..2 {
                match (template.with(&more), &anew) {
                    (Ok(found), Ok(anew)) => assert_eq!(found, *anew, "{more:?}"),
                    (Err(found), Err(anew)) => assert_eq!(found.to_string(), anew.to_string(), "{more:?}"),
                    (found, anew) => panic!("{more:?}: {found:?} and {anew:?}"),
                }
            }
        }
    }

    #[test]
    fn values_and_defaults_are_found_by_short_and_full_keys() {
        let template = ScenarioTemplate::new(ScenarioFile::built_in(&strings(&["particles=50"])).unwrap()).unwrap();
        let scenario = &template.file().scenario;
        let value = |key: &str| template.value(scenario, key);
        assert_eq!(value("particles"), Some(50.into()));
        assert_eq!(value("tracker.annealed_particle_filter.layers"), Some(5.into()));
        assert_eq!(value("rig.ring.count"), Some(4.into()));
        assert_eq!(value("plausibility.weight"), None);
    }
}
