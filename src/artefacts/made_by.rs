//! What made an output: `made_by.json`, in every folder of this program. It alone is compared when a command finds an
//! earlier output, or unfinished work, at its place.
//!
//! A command replaces its own earlier output, made from the same inputs with the same settings. Outputs of other
//! commands are kept, unless the user has them moved aside.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::{ArtefactError, output};
use skiagraph_core::input::{self, excerpt, limits};

pub(crate) const MADE_BY: &str = "made_by.json";
const SCHEMA: &str = "skiagraph.made_by/1";

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct MadeBy {
    /// `skiagraph.made_by/1`.
    schema: String,
    /// Version of the program. Sets of other versions are not replaced, and their unfinished work is not resumed.
    version: String,
    /// The command, such as `skiagraph run`.
    pub(crate) command: String,
    /// What it read, by name: the hash of a set, the path of an estimate.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) inputs: BTreeMap<String, String>,
    pub(crate) settings: Value,
}

impl MadeBy {
    /// A command of this version with its settings, an object.
    pub(crate) fn new(command: &str, settings: Value) -> Self {
        let (schema, version) = (SCHEMA.to_owned(), env!("CARGO_PKG_VERSION").to_owned());
        Self { schema, version, command: command.to_owned(), inputs: BTreeMap::new(), settings }
    }

    pub(crate) fn of(mut self, name: &str, input: impl Into<String>) -> Self {
        self.inputs.insert(name.to_owned(), input.into());
        self
    }

    /// What determines each single seed: the same command without the numbers of its seeds.
    pub(crate) fn of_each_seed(&self) -> Self {
        let mut each = self.clone();
        if let Some(settings) = each.settings.as_object_mut() {
            settings.remove("seed");
            settings.remove("seeds");
        }
        each
    }

    /// The command that made what is in a folder; `None` if no file says so.
    pub(crate) fn at(folder: &Path) -> Option<Self> {
        let bytes = input::read(&folder.join(MADE_BY), limits::RECORD).ok()?;
        serde_json::from_slice(&bytes).ok().filter(|made_by: &Self| made_by.schema == SCHEMA)
    }

    pub(crate) fn text(&self) -> Result<String, ArtefactError> {
        let failed = |error| output(Path::new(MADE_BY), "write")(std::io::Error::other(error));
        Ok(serde_json::to_string_pretty(self).map_err(failed)? + "\n")
    }

    /// How the output in a folder differs from that of this command; `None` if it does not, or if the folder is missing
    /// or empty.
    pub(crate) fn difference_at(&self, folder: &Path) -> Option<String> {
        folder.read_dir().ok()?.next()?.ok()?;
        match Self::at(folder) {
            Some(there) => there.difference(self),
            None => Some(format!("it is of an earlier version: no {MADE_BY} says what made it")),
        }
    }

    /// The first key in which a command differs from the current one, with both values.
    pub(crate) fn difference(&self, now: &Self) -> Option<String> {
        let (old, new) = (self.by_key(), now.by_key());
        // another command differs in all keys, so the command is reported first
        let keys = || std::iter::once("command").chain(old.keys().chain(new.keys()).map(String::as_str));
        let key = keys().find(|key| old.get(*key) != new.get(*key))?;
        let value = |all: &BTreeMap<String, String>| all.get(key).map_or("nothing".to_owned(), |text| excerpt(text));
        Some(format!("{key}: was {}, now {}", value(&old), value(&new)))
    }

    /// As [`Self::difference`], also if the version is another one.
    pub(crate) fn difference_of_other_version(&self, now: &Self) -> Option<String> {
        let version = || format!("version: was {}, now {}", excerpt(&self.version), now.version);
        (self.version != now.version).then(version).or_else(|| self.difference(now))
    }

    fn by_key(&self) -> BTreeMap<String, String> {
        let mut all = self.inputs.clone();
        all.insert("command".to_owned(), self.command.clone());
        flatten("", &self.settings, &mut all);
        all
    }
}

/// Keys without a value and empty tables count as absent.
fn flatten(prefix: &str, tree: &Value, into: &mut BTreeMap<String, String>) {
    match tree {
        Value::Object(table) => {
            for (key, value) in table {
                let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
                flatten(&path, value, into);
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
    use serde_json::json;
    use std::fs;

    #[test]
    fn the_first_difference_has_both_values() {
        let run = MadeBy::new("run", json!({"seeds": 5, "rig": {"ring": {"count": 4}}}));
        let mut other = run.clone();
        other.settings["rig"]["ring"]["count"] = json!(8);
        assert_eq!(run.difference(&other).unwrap(), "rig.ring.count: was 4, now 8");
        assert_eq!(run.difference(&run), None);
        // another command first
        let evaluated = MadeBy::new("evaluate", json!({})).of("estimate", "mine.npz");
        assert_eq!(run.difference(&evaluated).unwrap(), "command: was run, now evaluate");
        let seedless = MadeBy::new("run", json!({"rig": {"ring": {"count": 4}}, "seeds": null}));
        assert_eq!(run.difference(&seedless).unwrap(), "seeds: was 5, now nothing");
        assert_eq!(run.of_each_seed().difference(&seedless), None);
        assert_eq!(run.difference(&run.clone().of("set", "0f")).unwrap(), "set: was nothing, now 0f");
        let older = MadeBy { version: "0.0.1".to_owned(), ..run.clone() };
        assert!(older.difference(&run).is_none() && older.difference_of_other_version(&run).is_some());
    }

    #[test]
    fn a_folder_records_the_command_that_made_it() {
        let root = tempfile::tempdir().unwrap();
        let same = MadeBy::new("evaluate", json!({"share": 0.1})).of("set", "0f");
        assert_eq!(same.difference_at(&root.path().join("nowhere")), None);
        assert_eq!(same.difference_at(root.path()), None);
        fs::write(root.path().join("run.json"), "{}").unwrap();
        assert!(same.difference_at(root.path()).unwrap().contains("of an earlier version"));
        fs::write(root.path().join(MADE_BY), same.text().unwrap()).unwrap();
        assert_eq!(same.difference_at(root.path()), None);
        assert_eq!(same.clone().of("set", "1e").difference_at(root.path()).unwrap(), "set: was 0f, now 1e");
    }
}
