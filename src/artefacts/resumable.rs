//! Work that survives an interruption and is resumed by the same command.
//!
//! It is stored in `NAME.partial` beside its output path, with the `made_by.json` of the command.

use std::fs;
use std::path::{Path, PathBuf};

use super::artefact::{Artefact, Destination};
use super::error::{ArtefactError, output};
use super::made_by::{MADE_BY, MadeBy};
use super::place::{sibling, write_synced};
use super::provenance::ArtefactKind;
use super::unfinished::{self, Unfinished};
use skiagraph_core::input::{self, limits};

/// How the file of a command begins.
const BEGINNING: &str = "{\n  \"schema\": \"skiagraph.made_by/";

#[derive(Debug)]
pub(crate) struct ResumableKind {
    /// Whether an entry of this name is work that can be resumed.
    pub(crate) is_work: fn(&str) -> bool,
    /// Other permitted entries.
    pub(crate) others: &'static [&'static str],
}

/// A folder of unfinished work. It is removed when dropped, unless it is marked with [`Self::keep`].
#[derive(Debug)]
pub(crate) struct Resumable {
    folder: Unfinished,
    made_by: MadeBy,
}

impl Resumable {
    /// Begins the work of a command, or resumes existing work unless it has a `difference`. The output path must be
    /// locked.
    ///
    /// # Errors
    /// [`ArtefactError::OtherUnfinished`] if there is a difference, unless `force` is given, which removes the existing
    /// work; [`ArtefactError::InTheWay`] if the folder has other content.
    pub(crate) fn begin(
        to: Destination<'_>,
        kind: &ResumableKind,
        made_by: MadeBy,
        difference: impl FnOnce(&MadeBy) -> Option<String>,
    ) -> Result<Self, ArtefactError> {
        let folder = folder_for(to.path);
        if let Some(existing) = kind.found_in(&folder)? {
            match difference(&existing) {
                None => return Ok(Self { folder: Unfinished::resume(folder), made_by: existing }),
                Some(_) if to.force => {}
                Some(difference) => return Err(ArtefactError::OtherUnfinished { partial: folder, difference }),
            }
        }
        unfinished::remove(&folder).map_err(output(&folder, "remove the directory"))?;
        let this = Self { folder: Unfinished::begin(folder), made_by };
        fs::create_dir(this.folder()).map_err(output(this.folder(), "create the directory"))?;
        let path = this.folder().join(MADE_BY);
        write_synced(&path, this.made_by.text()?.as_bytes()).map_err(output(&path, "write"))?;
        Ok(this)
    }

    /// An artefact whose temporary folder lies in this one.
    pub(crate) fn artefact(to: Destination<'_>, name: &str, kind: ArtefactKind) -> Result<Artefact, ArtefactError> {
        Artefact::begin_in(folder_for(to.path).join(name), to, kind)
    }

    pub(crate) fn made_by(&self) -> &MadeBy {
        &self.made_by
    }

    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn keep(&self) {
        self.folder.keep();
    }

    pub(crate) fn is_kept(&self) -> bool {
        self.folder.is_kept()
    }

    /// Marks the folder for removal: the result is finished, or can never be made.
    pub(crate) fn discard(&self) {
        self.folder.discard();
    }

    pub(crate) fn differs(&self, difference: String) -> ArtefactError {
        ArtefactError::OtherUnfinished { partial: self.folder().to_owned(), difference }
    }
}

impl ResumableKind {
    /// The command of resumable work in a folder; an error if the folder has anything that this program does not write
    /// there.
    fn found_in(&self, folder: &Path) -> Result<Option<MadeBy>, ArtefactError> {
        if folder.symlink_metadata().is_err() {
            return Ok(None);
        }
        if folder.is_symlink() || !folder.is_dir() {
            return Err(ArtefactError::in_the_way(folder));
        }
        let entries = fs::read_dir(folder).map_err(output(folder, "list"))?.flatten();
        let names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        let is_work = |name: &String| (self.is_work)(name);
        let is_other = |name: &String| name == MADE_BY || self.others.contains(&name.as_str());
        let made_by = MadeBy::at(folder);
        let has_work = names.iter().any(is_work);
        // killed while the file was being written, before any work was done
        let died_early = || match input::read_to_string(&folder.join(MADE_BY), limits::RECORD) {
            Ok(text) => BEGINNING.starts_with(&text) || text.starts_with(BEGINNING),
            Err(_) => names.is_empty(),
        };
        let is_ours = made_by.is_some() || (!has_work && died_early());
        if !names.iter().all(|name| is_work(name) || is_other(name)) || !is_ours {
            return Err(ArtefactError::in_the_way(folder));
        }
        Ok(made_by.filter(|_| has_work))
    }
}

fn folder_for(place: &Path) -> PathBuf {
    sibling(place, "", ".partial")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const KIND: ResumableKind = ResumableKind { is_work: |name| name.starts_with("work-"), others: &["journal"] };

    fn begin(place: &Path, force: bool) -> Result<Resumable, ArtefactError> {
        let made_by = MadeBy::new("test", json!({}));
        let new = made_by.clone();
        Resumable::begin(Destination { path: place, force }, &KIND, made_by, |old| old.difference(&new))
    }

    #[test]
    fn a_foreign_folder_is_left_alone_and_one_of_a_process_killed_early_is_removed() {
        let root = tempfile::tempdir().unwrap();
        let (place, folder) = (root.path().join("walk"), root.path().join("walk.partial"));
        fs::create_dir(&folder).unwrap();
        for (name, text) in [("thesis.tex", "years of work"), (MADE_BY, "mine"), ("work-1", "mine")] {
            fs::write(folder.join(name), text).unwrap();
            for force in [false, true] {
                // the message must not suggest --force, which is refused as well
                let refused = begin(&place, force).unwrap_err().to_string();
                assert!(refused.contains("walk.partial") && refused.contains("move it away"), "{name}: {refused}");
            }
            fs::remove_file(folder.join(name)).unwrap();
        }
        for begun in ["", "{\n  \"sch", "{\n  \"schema\": \"skiagraph.made_by/1\",\n  \"ver"] {
            fs::create_dir_all(&folder).unwrap();
            fs::write(folder.join(MADE_BY), begun).unwrap();
            drop(begin(&place, false).unwrap());
            assert!(!folder.exists());
        }
    }
}
