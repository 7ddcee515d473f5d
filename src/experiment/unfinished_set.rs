//! A set that is being drawn: what is whole survives an interruption, and the same command goes on with it.
//!
//! Everything lies in `NAME.partial` beside the set: `settings.toml`, by which the same command is known, with the key
//! that everything is drawn from; `finished.sha256`, the journal of whole files; and `set`, which moves to its place
//! when it is complete.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use super::destination::Destination;
use super::error::output;
use super::key_source::fresh_key;
use super::partial_directory::PartialDirectory;
use super::partial_file::beside;
use super::place::{sync_parent, write_synced};
use super::provenance::ResultKind;
use super::{ExperimentError, unfinished};
use crate::benchmark_set::SetError;
use crate::input::{self, excerpt, limits};
use crate::rng::ObservationKey;

const SETTINGS: &str = "settings.toml";
const JOURNAL: &str = "finished.sha256";
const SCHEMA: &str = "skiagraph.unfinished/1";
const KEY: &str = "--key";
const HEAD: &str = "# A set that is being drawn, or was interrupted. The same `skiagraph render` goes on with it; to begin \
                    anew, remove this folder.\n";

/// The place of a set that is being drawn.
#[derive(Debug)]
pub(super) struct UnfinishedSet {
    /// `None` once it is finished.
    directory: Option<PartialDirectory>,
    around: PathBuf,
    key: ObservationKey,
    /// Whether something is there that is worth keeping.
    is_kept: AtomicBool,
}

impl UnfinishedSet {
    /// Begins a set, or goes on with one of the same settings. Without a key that is `stated` the one that was begun
    /// with stays, or a fresh one is drawn.
    ///
    /// # Errors
    /// As [`PartialDirectory::begin`]; [`ExperimentError::OtherUnfinished`] where one of other settings was begun,
    /// unless `force` is given, which removes it.
    pub(super) fn begin(
        to: Destination<'_>,
        settings: &toml::Table,
        stated: Option<ObservationKey>,
    ) -> Result<Self, ExperimentError> {
        let around = beside(to.path, ".partial");
        let directory = PartialDirectory::begin_in(around.join("set"), to.path, ResultKind::Set, to.force)?;
        let there = match around.symlink_metadata() {
            Ok(_) => found_in(&around)?,
            Err(_) => FoundProgress::Nothing,
        };
        let begun = match there {
            FoundProgress::Settings(mut there) => {
                let known = take_key(&mut there);
                match difference(&there, settings).or_else(|| other_key(known, stated)) {
                    Some(_) if to.force => None,
                    Some(difference) => return Err(ExperimentError::OtherUnfinished { partial: around, difference }),
                    None => Some(known),
                }
            }
            FoundProgress::Nothing => None,
        };
        if begun.is_none() {
            remove(&around)?;
        }
        let key = begun.or(stated).map_or_else(fresh_key, Ok)?;
        let this = Self { directory: Some(directory), around, key, is_kept: AtomicBool::new(false) };
        if this.around.join("set").is_dir() {
            this.keep();
        } else {
            unfinished::begin(&this.around);
            this.write_settings(settings)?;
        }
        Ok(this)
    }

    /// The key of the drawing that was interrupted before it came to `place`; `None` where there is none.
    pub(super) fn key_begun(place: &Path) -> Option<ObservationKey> {
        match found_in(&beside(place, ".partial")) {
            Ok(FoundProgress::Settings(mut settings)) => Some(take_key(&mut settings)),
            _ => None,
        }
    }

    /// The key that everything drawn for the observations depends on.
    pub(super) fn key(&self) -> ObservationKey {
        self.key
    }

    fn write_settings(&self, settings: &toml::Table) -> Result<(), ExperimentError> {
        let path = self.around.join(SETTINGS);
        let mut settings = settings.clone();
        settings.insert(KEY.to_owned(), self.key.to_hex().into());
        let text = toml::to_string(&settings)
            .map_err(|e| ExperimentError::Malformed { path: path.clone(), detail: e.to_string() })?;
        fs::create_dir(&self.around).map_err(output(&self.around, "create the directory"))?;
        write_synced(&path, (HEAD.to_owned() + &text).as_bytes()).map_err(output(&path, "write"))?;
        let folder = self.folder();
        fs::create_dir(&folder).map_err(output(&folder, "create the directory"))
    }

    /// Where to draw meanwhile.
    pub(super) fn folder(&self) -> PathBuf {
        self.around.join("set")
    }

    /// The journal of the drawing.
    pub(super) fn journal(&self) -> PathBuf {
        self.around.join(JOURNAL)
    }

    /// There is something that is worth keeping.
    pub(super) fn keep(&self) {
        if !self.is_kept.swap(true, Ordering::SeqCst) {
            unfinished::end(&self.around);
            unfinished::keep(Some(&self.around));
        }
    }

    /// Has the set that stands in the place moved aside: other settings made it.
    pub(super) fn keep_other(&mut self) {
        self.directory.iter_mut().for_each(PartialDirectory::keep_other);
    }

    /// Puts the set in its place.
    ///
    /// # Errors
    /// As [`PartialDirectory::finish`].
    pub(super) fn finish(mut self) -> Result<(), ExperimentError> {
        let Some(directory) = self.directory.take() else { return Ok(()) };
        directory.finish().map_err(|error| self.told(error))?;
        self.is_kept.store(false, Ordering::SeqCst);
        Ok(())
    }

    /// What to tell of a drawing that ended early: progress is kept where the reason may pass, else removed.
    pub(super) fn told(&self, error: ExperimentError) -> ExperimentError {
        if !self.is_kept.load(Ordering::SeqCst) {
            return error;
        }
        let partial = self.around.clone();
        match error {
            ExperimentError::Interrupted => ExperimentError::ProgressSaved { partial },
            ExperimentError::Set(SetError::Differs { file }) => {
                let difference = format!(
                    "{file} would be another: a recording, a robot or this program has changed since, or a file that the \
                     scenario names"
                );
                ExperimentError::OtherUnfinished { partial, difference }
            }
            ExperimentError::Set(SetError::Io { .. }) | ExperimentError::Output { .. } => {
                ExperimentError::Unfinished { partial, source: Box::new(error) }
            }
            other => {
                self.is_kept.store(false, Ordering::SeqCst);
                other
            }
        }
    }
}

impl Drop for UnfinishedSet {
    fn drop(&mut self) {
        if !self.is_kept.load(Ordering::SeqCst) {
            // nobody is left to tell of a failure
            unfinished::remove(&self.around).ok();
            unfinished::end(&self.around);
            sync_parent(&self.around);
        }
        unfinished::keep(None);
    }
}

/// What makes one drawing the same as another, as text that is compared key by key.
pub(super) fn settings_of(scenario: &str, shards: Option<usize>) -> Result<toml::Table, ExperimentError> {
    let malformed = |e: toml::de::Error| ExperimentError::Malformed { path: SETTINGS.into(), detail: e.to_string() };
    let mut settings = toml::Table::new();
    settings.insert("schema".to_owned(), SCHEMA.into());
    settings.insert("version".to_owned(), env!("CARGO_PKG_VERSION").into());
    if let Some(shards) = shards {
        settings.insert("--shards".to_owned(), i64::try_from(shards).unwrap_or(i64::MAX).into());
    }
    settings.insert("scenario".to_owned(), scenario.parse::<toml::Table>().map_err(malformed)?.into());
    Ok(settings)
}

/// Takes the key out of settings; those of older versions know the public one alone.
fn take_key(settings: &mut toml::Table) -> ObservationKey {
    let text = settings.remove(KEY);
    text.and_then(|text| text.as_str()?.parse().ok()).unwrap_or_default()
}

/// What to say of a key that is not the one that was begun with; it is not told.
fn other_key(begun: ObservationKey, stated: Option<ObservationKey>) -> Option<String> {
    let words = "another key was begun with; leave out --key and observation.key to go on with that one";
    stated.filter(|stated| *stated != begun).map(|_| format!("{KEY}: {words}"))
}

enum FoundProgress {
    /// Nothing that could be gone on with.
    Nothing,
    Settings(toml::Table),
}

/// What is in a folder of the name of ours.
fn found_in(around: &Path) -> Result<FoundProgress, ExperimentError> {
    let not_ours = || ExperimentError::Occupied { path: around.to_owned() };
    if around.is_symlink() || !around.is_dir() {
        return Err(not_ours());
    }
    let names = fs::read_dir(around).map_err(output(around, "list"))?;
    let names: Vec<_> = names.flatten().map(|entry| entry.file_name()).collect();
    let ours = [SETTINGS, JOURNAL, "finished.writing", "set"];
    if names.iter().any(|name| !ours.iter().any(|ours| name == ours)) {
        return Err(not_ours());
    }
    let text = input::read_to_string(&around.join(SETTINGS), limits::SETTINGS).unwrap_or_default();
    let table = text.parse::<toml::Table>().ok();
    let table = table.filter(|table| table.get("schema").and_then(toml::Value::as_str) == Some(SCHEMA));
    match table {
        Some(_) if !around.join("set").is_dir() => Ok(FoundProgress::Nothing),
        Some(settings) => Ok(FoundProgress::Settings(settings)),
        // killed before anything was drawn
        None if names.iter().all(|name| name == SETTINGS) && (HEAD.starts_with(&text) || text.starts_with(HEAD)) => {
            Ok(FoundProgress::Nothing)
        }
        None => Err(not_ours()),
    }
}

fn remove(folder: &Path) -> Result<(), ExperimentError> {
    unfinished::remove(folder).map_err(output(folder, "remove the directory"))
}

/// The first key in which two tables differ, with both values.
fn difference(there: &toml::Table, here: &toml::Table) -> Option<String> {
    let (mut old, mut new) = (BTreeMap::new(), BTreeMap::new());
    flatten("", there, &mut old);
    flatten("", here, &mut new);
    let keys = || old.keys().chain(new.keys());
    let key = keys().find(|key| old.get(*key) != new.get(*key))?;
    let value = |table: &BTreeMap<String, String>| table.get(key).map_or("nothing".to_owned(), |text| excerpt(text));
    Some(format!("{key}: there {}, here {}", value(&old), value(&new)))
}

/// Every value by its key from the top, as `--set` names it.
fn flatten(prefix: &str, table: &toml::Table, into: &mut BTreeMap<String, String>) {
    for (key, value) in table {
        match value {
            toml::Value::Table(inner) if prefix.is_empty() && key == "scenario" => flatten("", inner, into),
            toml::Value::Table(inner) => flatten(&format!("{prefix}{key}."), inner, into),
            other => drop(into.insert(format!("{prefix}{key}"), other.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(text: &str) -> toml::Table {
        settings_of(text, None).unwrap()
    }

    fn begin(path: &Path, text: &str, force: bool) -> Result<UnfinishedSet, ExperimentError> {
        begin_with(path, text, force, Some(ObservationKey::PUBLIC))
    }

    fn begin_with(
        path: &Path,
        text: &str,
        force: bool,
        key: Option<ObservationKey>,
    ) -> Result<UnfinishedSet, ExperimentError> {
        UnfinishedSet::begin(Destination { path, force }, &settings(text), key)
    }

    #[test]
    fn a_key_that_was_drawn_is_kept_and_another_one_is_refused_without_being_told() {
        let root = tempfile::tempdir().unwrap();
        let place = root.path().join("walk");
        let set = begin_with(&place, "", false, None).unwrap();
        let key = set.key();
        assert!(!key.is_public());
        set.keep();
        drop(set);
        assert_eq!(UnfinishedSet::key_begun(&place), Some(key));
        for same in [None, Some(key)] {
            assert_eq!(begin_with(&place, "", false, same).unwrap().key(), key);
        }
        let refused = begin(&place, "", false).unwrap_err().to_string();
        assert!(refused.contains("--key: another key") && !refused.contains(&key.to_hex()), "{refused}");
        let anew = begin(&place, "", true).unwrap();
        assert!(anew.key().is_public());
        drop(anew);
        assert!(UnfinishedSet::key_begun(&place).is_none());
        assert_ne!(begin_with(&place, "", false, None).unwrap().key(), key);
    }

    #[test]
    fn what_was_kept_is_gone_on_with_by_the_same_settings_and_named_by_the_key_to_others() {
        let root = tempfile::tempdir().unwrap();
        let (place, around) = (root.path().join("walk"), root.path().join("walk.partial"));
        let set = begin(&place, "[rig.ring]\ncount = 4", false).unwrap();
        fs::write(set.folder().join("a"), "drawn").unwrap();
        set.keep();
        let said = set.told(ExperimentError::Interrupted);
        assert!(matches!(said, ExperimentError::ProgressSaved { .. }), "{said}");
        drop(set);
        let other = begin(&place, "[rig.ring]\ncount = 8", false).unwrap_err();
        assert!(other.to_string().contains("rig.ring.count: there 4, here 8"), "{other}");
        assert_eq!(other.exit_code(), 2);
        let same = begin(&place, "[rig.ring]\ncount = 4", false).unwrap();
        assert_eq!(fs::read_to_string(same.folder().join("a")).unwrap(), "drawn");
        drop(same);
        let anew = begin(&place, "[rig.ring]\ncount = 8", true).unwrap();
        assert!(!anew.folder().join("a").exists());
        drop(anew);
        assert!(!around.exists(), "nothing was worth keeping");
    }

    #[test]
    fn errors_that_do_not_pass_leave_nothing_and_a_full_disk_keeps_what_is_there() {
        let root = tempfile::tempdir().unwrap();
        let (place, around) = (root.path().join("walk"), root.path().join("walk.partial"));
        let set = begin(&place, "", false).unwrap();
        set.keep();
        let full = SetError::Io { path: "a".into(), action: "write", source: std::io::ErrorKind::StorageFull.into() };
        let said = set.told(full.into());
        assert!(said.exit_code() == 75 && said.to_string().contains("walk.partial: run the same"), "{said}");
        drop(set);
        assert!(around.exists());
        let set = begin(&place, "", false).unwrap();
        assert!(matches!(set.told(ExperimentError::NoTraining), ExperimentError::NoTraining));
        drop(set);
        assert!(!around.exists());
    }

    #[test]
    fn somebody_elses_folder_of_that_name_is_left_alone_and_what_died_early_is_not_in_the_way() {
        let root = tempfile::tempdir().unwrap();
        let (place, around) = (root.path().join("walk"), root.path().join("walk.partial"));
        fs::create_dir(&around).unwrap();
        fs::write(around.join("thesis.tex"), "years of work").unwrap();
        for force in [false, true] {
            assert!(matches!(begin(&place, "", force), Err(ExperimentError::Occupied { .. })));
        }
        fs::remove_file(around.join("thesis.tex")).unwrap();
        for begun in ["", &HEAD[..20]] {
            fs::create_dir_all(&around).unwrap();
            fs::write(around.join(SETTINGS), begun).unwrap();
            drop(begin(&place, "", false).unwrap());
        }
    }

    #[test]
    fn a_finished_set_stands_in_its_place_and_nothing_beside_it() {
        let root = tempfile::tempdir().unwrap();
        let place = root.path().join("walk");
        let set = begin(&place, "", false).unwrap();
        fs::write(set.folder().join("a"), "drawn").unwrap();
        set.keep();
        set.finish().unwrap();
        let names: Vec<_> = fs::read_dir(root.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(names, ["walk"]);
        assert_eq!(fs::read_to_string(place.join("a")).unwrap(), "drawn");
    }
}
