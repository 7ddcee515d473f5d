//! Work that survives an interruption: the same command goes on with it.
//!
//! It lies in `NAME.partial` beside its place, with the settings by which the same command is known.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::artefact::{Artefact, Destination};
use super::error::{ArtefactError, output};
use super::place::{sibling, write_synced};
use super::provenance::ArtefactKind;
use super::unfinished::{self, Unfinished};
use crate::input::{self, excerpt, limits};

/// What is in a folder of unfinished work.
#[derive(Debug)]
pub(crate) struct ResumableKind {
    /// The file with the settings, JSON or (`.toml`) TOML.
    pub(crate) settings: &'static str,
    /// Their schema.
    pub(crate) schema: &'static str,
    /// How the file begins.
    pub(crate) head: &'static str,
    /// Whether something of that name is work that can be gone on with.
    pub(crate) is_work: fn(&str) -> bool,
    /// What else may be there.
    pub(crate) others: &'static [&'static str],
}

/// A folder of unfinished work. Dropped it stays if there is something in it that is worth keeping.
#[derive(Debug)]
pub(crate) struct Resumable {
    folder: Unfinished,
    settings: Value,
}

impl Resumable {
    /// Begins with these settings, or goes on with what was begun unless that has a `difference`. The place must be
    /// locked.
    ///
    /// # Errors
    /// [`ArtefactError::OtherUnfinished`] where there is a difference, unless `force` is given, which removes what was
    /// begun; [`ArtefactError::Occupied`] where something else is there.
    pub(crate) fn begin(
        to: Destination<'_>,
        kind: &ResumableKind,
        settings: Value,
        difference: impl FnOnce(&Value) -> Option<String>,
    ) -> Result<Self, ArtefactError> {
        let folder = folder_for(to.path);
        if let Some(there) = kind.found_in(&folder)? {
            match difference(&there) {
                None => return Ok(Self { folder: Unfinished::resume(folder), settings: there }),
                Some(_) if to.force => {}
                Some(difference) => return Err(ArtefactError::OtherUnfinished { partial: folder, difference }),
            }
        }
        unfinished::remove(&folder).map_err(output(&folder, "remove the directory"))?;
        let this = Self { folder: Unfinished::begin(folder), settings };
        fs::create_dir(this.folder()).map_err(output(this.folder(), "create the directory"))?;
        let path = this.folder().join(kind.settings);
        let text = kind.text_of(&this.settings).map_err(|e| output(&path, "write")(std::io::Error::other(e)))?;
        write_synced(&path, text.as_bytes()).map_err(output(&path, "write"))?;
        Ok(this)
    }

    /// The settings of what was begun at a place; `None` where nothing can be gone on with.
    pub(crate) fn settings_at(place: &Path, kind: &ResumableKind) -> Option<Value> {
        kind.found_in(&folder_for(place)).ok().flatten()
    }

    /// What shall become a folder, written below this one.
    ///
    /// # Errors
    /// As [`Artefact::begin`].
    pub(crate) fn artefact(to: Destination<'_>, name: &str, kind: ArtefactKind) -> Result<Artefact, ArtefactError> {
        Artefact::begin_in(folder_for(to.path).join(name), to, kind)
    }

    /// The settings with which it was begun.
    pub(crate) fn settings(&self) -> &Value {
        &self.settings
    }

    /// The folder.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// There is something that is worth keeping.
    pub(crate) fn keep(&self) {
        self.folder.keep();
    }

    /// Whether there is something that is worth keeping.
    pub(crate) fn is_kept(&self) -> bool {
        self.folder.is_kept()
    }

    /// Nothing is worth keeping any more: the result is in its place, or can never be made.
    pub(crate) fn discard(&self) {
        self.folder.discard();
    }

    /// What to say where what is there was made otherwise.
    pub(crate) fn differs(&self, difference: String) -> ArtefactError {
        ArtefactError::OtherUnfinished { partial: self.folder().to_owned(), difference }
    }
}

impl ResumableKind {
    /// The settings of what can be gone on with; an error for a folder that holds anything else than what this program
    /// keeps there.
    fn found_in(&self, folder: &Path) -> Result<Option<Value>, ArtefactError> {
        if folder.symlink_metadata().is_err() {
            return Ok(None);
        }
        if folder.is_symlink() || !folder.is_dir() {
            return Err(ArtefactError::occupied(folder));
        }
        let entries = fs::read_dir(folder).map_err(output(folder, "list"))?.flatten();
        let names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        let is_work = |name: &String| (self.is_work)(name);
        let is_other = |name: &String| name == self.settings || self.others.contains(&name.as_str());
        let text = input::read_to_string(&folder.join(self.settings), limits::RECORD).unwrap_or_default();
        let settings = self.parse(&text).filter(|settings| settings["schema"] == self.schema);
        let has_work = names.iter().any(is_work);
        // killed before anything was worth keeping
        let died_early = !has_work && (self.head.starts_with(&text) || text.starts_with(self.head));
        if !names.iter().all(|name| is_work(name) || is_other(name)) || (settings.is_none() && !died_early) {
            return Err(ArtefactError::occupied(folder));
        }
        Ok(settings.filter(|_| has_work))
    }

    fn is_toml(&self) -> bool {
        self.settings.ends_with(".toml")
    }

    fn parse(&self, text: &str) -> Option<Value> {
        if self.is_toml() { toml::from_str(text).ok() } else { serde_json::from_str(text).ok() }
    }

    fn text_of(&self, settings: &Value) -> Result<String, String> {
        let text = if self.is_toml() {
            toml::to_string(settings).map_err(|e| e.to_string())
        } else {
            serde_json::to_string_pretty(settings).map(|text| text + "\n").map_err(|e| e.to_string())
        };
        Ok(self.head.to_owned() + &text?)
    }
}

fn folder_for(place: &Path) -> PathBuf {
    sibling(place, "", ".partial")
}

/// The first key in which two tables of settings differ, with both values. Their schemas were compared before.
pub(crate) fn difference(there: &Value, here: &Value) -> Option<String> {
    let (old, new) = (flattened(there), flattened(here));
    // another command differs in all keys; what it is says more than they do
    let keys = || std::iter::once("command").chain(old.keys().chain(new.keys()).map(String::as_str));
    let key = keys().find(|key| old.get(*key) != new.get(*key))?;
    let value = |table: &BTreeMap<String, String>| table.get(key).map_or("nothing".to_owned(), |text| excerpt(text));
    Some(format!("{key}: there {}, here {}", value(&old), value(&new)))
}

/// Every value by its key, as overrides name it: keys of the tables around the settings are left out.
fn flattened(settings: &Value) -> BTreeMap<String, String> {
    let mut all = BTreeMap::new();
    for (key, value) in settings.as_object().into_iter().flatten().filter(|(key, _)| *key != "schema") {
        let is_around = ["scenario", "tracker", "options", "run", "files"].contains(&key.as_str());
        flatten(if is_around { "" } else { key }, value, &mut all);
    }
    all
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

    const KIND: ResumableKind = ResumableKind {
        settings: "settings.toml",
        schema: "test/1",
        head: "# Work.\n",
        is_work: |name| name.starts_with("work-"),
        others: &["journal"],
    };

    fn begin(place: &Path, particles: u32, force: bool) -> Result<Resumable, ArtefactError> {
        let settings = json!({"schema": "test/1", "tracker": {"particles": particles}});
        let here = settings.clone();
        Resumable::begin(Destination { path: place, force }, &KIND, settings, |there| difference(there, &here))
    }

    #[test]
    fn what_was_kept_is_gone_on_with_by_the_same_settings_and_named_by_the_key_to_others() {
        let root = tempfile::tempdir().unwrap();
        let (place, folder) = (root.path().join("walk"), root.path().join("walk.partial"));
        drop(begin(&place, 100, false).unwrap());
        assert!(!folder.exists(), "nothing was worth keeping");
        let work = begin(&place, 100, false).unwrap();
        fs::write(work.folder().join("work-1"), "done").unwrap();
        work.keep();
        drop(work);
        let other = begin(&place, 200, false).unwrap_err();
        assert!(other.to_string().contains("particles: there 100, here 200"), "{other}");
        assert_eq!(other.exit_code(), 2);
        let same = begin(&place, 100, false).unwrap();
        assert!(same.is_kept() && same.folder().join("work-1").exists());
        drop(same);
        let anew = begin(&place, 200, true).unwrap();
        assert!(!anew.is_kept() && !anew.folder().join("work-1").exists());
        fs::write(anew.folder().join("work-1"), "done").unwrap();
        anew.keep();
        anew.discard();
        drop(anew);
        assert!(!folder.exists());
    }

    #[test]
    fn somebody_elses_folder_of_that_name_is_left_alone_and_what_died_early_is_not_in_the_way() {
        let root = tempfile::tempdir().unwrap();
        let (place, folder) = (root.path().join("walk"), root.path().join("walk.partial"));
        fs::create_dir(&folder).unwrap();
        for (name, text) in [("thesis.tex", "years of work"), ("settings.toml", "mine = true"), ("work-1", "mine")] {
            fs::write(folder.join(name), text).unwrap();
            for force in [false, true] {
                assert!(matches!(begin(&place, 1, force), Err(ArtefactError::Occupied { .. })), "{name}");
            }
            fs::remove_file(folder.join(name)).unwrap();
        }
        for begun in ["", "# Wo", "# Work.\nschema = \"test/1\"\n"] {
            fs::create_dir_all(&folder).unwrap();
            fs::write(folder.join("settings.toml"), begun).unwrap();
            drop(begin(&place, 1, false).unwrap());
            assert!(!folder.exists());
        }
    }

    #[test]
    fn the_first_key_that_differs_is_named_with_both_values_and_another_command_before_all() {
        let run = json!({"command": "run", "scenario": {"seeds": 5, "rig": {"ring": {"count": 4}}}});
        let mut other = run.clone();
        other["scenario"]["rig"]["ring"]["count"] = json!(8);
        assert_eq!(difference(&run, &other).unwrap(), "rig.ring.count: there 4, here 8");
        assert_eq!(difference(&run, &run), None);
        let evaluated = json!({"command": "evaluate", "estimate": "mine.npz"});
        assert_eq!(difference(&run, &evaluated).unwrap(), "command: there run, here evaluate");
        let seedless = json!({"command": "run", "scenario": {"rig": {"ring": {"count": 4}}}});
        assert_eq!(difference(&run, &seedless).unwrap(), "seeds: there 5, here nothing");
    }
}
