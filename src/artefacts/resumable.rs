//! Work that survives an interruption and is resumed by the same command.
//!
//! It is stored in `NAME.partial` beside its output path, with the settings that identify the command.

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

/// The content of a folder of unfinished work.
#[derive(Debug)]
pub(crate) struct ResumableKind {
    /// The file with the settings, JSON or (`.toml`) TOML.
    pub(crate) settings: &'static str,
    /// Their schema.
    pub(crate) schema: &'static str,
    /// The beginning of the file.
    pub(crate) head: &'static str,
    /// Whether an entry of this name is work that can be resumed.
    pub(crate) is_work: fn(&str) -> bool,
    /// Other permitted entries.
    pub(crate) others: &'static [&'static str],
}

/// A folder of unfinished work. It is removed when dropped, unless it is marked with [`Self::keep`].
#[derive(Debug)]
pub(crate) struct Resumable {
    folder: Unfinished,
    settings: Value,
}

impl Resumable {
    /// Begins work with these settings, or resumes existing work unless its settings have a `difference`. The output
    /// path must be locked.
    ///
    /// # Errors
    /// [`ArtefactError::OtherUnfinished`] if there is a difference, unless `force` is given, which removes the existing
    /// work; [`ArtefactError::Occupied`] if the folder has other content.
    pub(crate) fn begin(
        to: Destination<'_>,
        kind: &ResumableKind,
        settings: Value,
        difference: impl FnOnce(&Value) -> Option<String>,
    ) -> Result<Self, ArtefactError> {
        let folder = folder_for(to.path);
        if let Some(existing) = kind.found_in(&folder)? {
            match difference(&existing) {
                None => return Ok(Self { folder: Unfinished::resume(folder), settings: existing }),
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

    /// The settings of unfinished work for an output path, if there is work that can be resumed.
    pub(crate) fn settings_at(place: &Path, kind: &ResumableKind) -> Option<Value> {
        kind.found_in(&folder_for(place)).ok().flatten()
    }

    /// An artefact whose temporary folder lies in this one.
    ///
    /// # Errors
    /// Those of [`Artefact::begin`].
    pub(crate) fn artefact(to: Destination<'_>, name: &str, kind: ArtefactKind) -> Result<Artefact, ArtefactError> {
        Artefact::begin_in(folder_for(to.path).join(name), to, kind)
    }

    /// The settings of the work.
    pub(crate) fn settings(&self) -> &Value {
        &self.settings
    }

    /// The folder.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Marks the folder as worth keeping.
    pub(crate) fn keep(&self) {
        self.folder.keep();
    }

    /// Whether the folder is worth keeping.
    pub(crate) fn is_kept(&self) -> bool {
        self.folder.is_kept()
    }

    /// Marks the folder for removal: the result is finished, or can never be made.
    pub(crate) fn discard(&self) {
        self.folder.discard();
    }

    /// The error for existing work with other settings.
    pub(crate) fn differs(&self, difference: String) -> ArtefactError {
        ArtefactError::OtherUnfinished { partial: self.folder().to_owned(), difference }
    }
}

impl ResumableKind {
    /// The settings of resumable work in a folder; an error if the folder has anything that this program does not write
    /// there.
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
        // killed before any work was done
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

/// The first key in which two tables of settings of the same schema differ, with both values.
pub(crate) fn difference(old: &Value, new: &Value) -> Option<String> {
    let (old, new) = (flattened(old), flattened(new));
    // another command differs in all keys, so the command is reported first
    let keys = || std::iter::once("command").chain(old.keys().chain(new.keys()).map(String::as_str));
    let key = keys().find(|key| old.get(*key) != new.get(*key))?;
    let value = |table: &BTreeMap<String, String>| table.get(key).map_or("nothing".to_owned(), |text| excerpt(text));
    Some(format!("{key}: was {}, now {}", value(&old), value(&new)))
}

/// Every value by its dotted key, as in overrides: without the keys of the tables around the settings.
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
        let new = settings.clone();
        Resumable::begin(Destination { path: place, force }, &KIND, settings, |old| difference(old, &new))
    }

    #[test]
    fn kept_work_is_resumed_with_the_same_settings_and_refused_with_others() {
        let root = tempfile::tempdir().unwrap();
        let (place, folder) = (root.path().join("walk"), root.path().join("walk.partial"));
        drop(begin(&place, 100, false).unwrap());
        assert!(!folder.exists(), "nothing was worth keeping");
        let work = begin(&place, 100, false).unwrap();
        fs::write(work.folder().join("work-1"), "done").unwrap();
        work.keep();
        drop(work);
        let other = begin(&place, 200, false).unwrap_err();
        assert!(other.to_string().contains("particles: was 100, now 200"), "{other}");
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
    fn a_foreign_folder_is_left_alone_and_one_of_a_process_killed_early_is_removed() {
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
    fn the_first_difference_is_reported_with_both_values_and_another_command_first() {
        let run = json!({"command": "run", "scenario": {"seeds": 5, "rig": {"ring": {"count": 4}}}});
        let mut other = run.clone();
        other["scenario"]["rig"]["ring"]["count"] = json!(8);
        assert_eq!(difference(&run, &other).unwrap(), "rig.ring.count: was 4, now 8");
        assert_eq!(difference(&run, &run), None);
        let evaluated = json!({"command": "evaluate", "estimate": "mine.npz"});
        assert_eq!(difference(&run, &evaluated).unwrap(), "command: was run, now evaluate");
        let seedless = json!({"command": "run", "scenario": {"rig": {"ring": {"count": 4}}}});
        assert_eq!(difference(&run, &seedless).unwrap(), "seeds: was 5, now nothing");
    }
}
