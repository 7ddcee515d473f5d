//! An artefact: a file or folder that appears at its output path in one step, when it is complete.

use std::borrow::Cow;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::error::{ArtefactError, output};
use super::made_by::{MADE_BY, MadeBy};
use super::place::{LockedPlace, backup_of, keep_aside, replace, sync_parent, write_synced};
use super::provenance::{ArtefactKind, Listing, sign, sign_written};
use super::unfinished::{self, Unfinished};

/// Output path of a result.
#[derive(Clone, Copy, Debug)]
pub struct Destination<'a> {
    /// The file or directory.
    pub path: &'a Path,
    /// Replace a set made by the same command, and rename anything else, instead of refusing.
    pub force: bool,
}

/// A file or folder that is being written beside its output path, which is locked against other processes. If dropped
/// before it is finished, it is removed, and the output path is left untouched.
#[derive(Debug)]
pub(crate) struct Artefact {
    kind: ArtefactKind,
    /// Temporary path of a folder.
    folder: PathBuf,
    /// The temporary folder, unless the caller removes it.
    unfinished: Option<Unfinished>,
    place: LockedPlace,
    /// Whether to rename an existing result of this program instead of replacing it, because it has other settings.
    keeps_other: bool,
    /// The command, if a folder gets a file that says so.
    made_by: Option<MadeBy>,
    written: Mutex<Listing>,
}

impl Artefact {
    /// Begins a file or folder and creates its parent directories. An existing unmodified output of this program and
    /// kind will be replaced; anything else is refused, or with `force` renamed to `NAME~`.
    ///
    /// # Errors
    /// [`ArtefactError::Occupied`] if something else exists, [`ArtefactError::InTheWay`] if `force` cannot rename it,
    /// [`ArtefactError::Busy`] while another process writes to the path, [`ArtefactError::Output`] if nothing can be
    /// written.
    pub(crate) fn begin(to: Destination<'_>, kind: ArtefactKind) -> Result<Self, ArtefactError> {
        Self::begin_unless(to, kind, None)
    }

    /// Like [`Self::begin`], for a folder with the `made_by.json` of this command: the output of another command, or of
    /// the same with other settings, is not replaced.
    pub(crate) fn begin_folder(
        to: Destination<'_>,
        kind: ArtefactKind,
        made_by: MadeBy,
    ) -> Result<Self, ArtefactError> {
        Ok(Self::begin_unless(to, kind, made_by.difference_at(to.path))?.made_by(made_by))
    }

    /// Like [`Self::begin`]; `difference` is the first difference if an existing result was made with other settings.
    /// It is then refused, or with `force` renamed.
    ///
    /// # Errors
    /// Those of [`Self::begin`], and [`ArtefactError::OtherResult`].
    pub(crate) fn begin_unless(
        to: Destination<'_>,
        kind: ArtefactKind,
        difference: Option<String>,
    ) -> Result<Self, ArtefactError> {
        let mut this = Self::claim(to, kind)?;
        this.keeps_other = difference.is_some();
        if let Some(difference) = difference {
            if !to.force {
                return Err(ArtefactError::OtherResult { path: to.path.to_owned(), difference });
            }
            // report before the work if it cannot be renamed
            backup_of(to.path)?;
        }
        if kind != ArtefactKind::File {
            fs::create_dir(&this.folder).map_err(output(&this.folder, "create the directory"))?;
            this.unfinished = Some(Unfinished::begin(&this.folder));
        }
        Ok(this)
    }

    /// The same folder, which will say that this command made it.
    pub(crate) fn made_by(self, made_by: MadeBy) -> Self {
        Self { made_by: Some(made_by), ..self }
    }

    /// Like [`Self::begin`], with the temporary path `folder` on the same file system, which the caller creates and
    /// removes.
    pub(super) fn begin_in(folder: PathBuf, to: Destination<'_>, kind: ArtefactKind) -> Result<Self, ArtefactError> {
        Ok(Self { folder, ..Self::claim(to, kind)? })
    }

    fn claim(to: Destination<'_>, kind: ArtefactKind) -> Result<Self, ArtefactError> {
        let path = to.path;
        let is_foreign = path.symlink_metadata().is_ok() && !kind.is_own(path);
        let is_impossible = path.file_name().is_none() || (kind == ArtefactKind::File && path.is_dir());
        if is_impossible {
            return Err(ArtefactError::in_the_way(path));
        }
        if is_foreign && !to.force {
            return Err(ArtefactError::occupied(path));
        }
        if is_foreign {
            // report before the work if it cannot be renamed
            backup_of(path)?;
        }
        let place = LockedPlace::take(path)?;
        let folder = place.beside("partial");
        let written = Mutex::default();
        Ok(Self { kind, folder, unfinished: None, place, keeps_other: false, made_by: None, written })
    }

    /// Renames an existing result of this program instead of replacing it, because it has other settings.
    pub(crate) fn keep_other(&mut self) {
        self.keeps_other = true;
    }

    /// Temporary path to write the content of a folder to.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writes one file of a folder and syncs it to the disk.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), ArtefactError> {
        let path = self.folder.join(name);
        write_synced(&path, bytes).map_err(output(&self.place.path.join(name), "write"))?;
        self.written.lock().unwrap_or_else(PoisonError::into_inner).add(name, bytes);
        Ok(())
    }

    pub(crate) fn write_all(&self, files: &[(Cow<'static, str>, Vec<u8>)]) -> Result<(), ArtefactError> {
        files.iter().try_for_each(|(name, bytes)| self.write(name, bytes))
    }

    /// Moves a folder to its output path. The folder of a run contains only the files written with [`Self::write`];
    /// files from other processes are removed.
    ///
    /// # Errors
    /// [`ArtefactError::Output`] if it cannot be moved; the previous content is then restored.
    pub(crate) fn finish(self) -> Result<(), ArtefactError> {
        if let Some(made_by) = &self.made_by {
            self.write(MADE_BY, made_by.text()?.as_bytes())?;
        }
        match self.kind {
            // a set has its own listing
            ArtefactKind::Set | ArtefactKind::File => {}
            ArtefactKind::Folder => sign(&self.folder)?,
            ArtefactKind::Run => {
                sign_written(&self.folder, &self.written.lock().unwrap_or_else(PoisonError::into_inner))?;
            }
        }
        self.move_in(&self.folder)
    }

    /// Writes a file with these bytes to its output path. May be called repeatedly.
    pub(crate) fn put(&self, bytes: &[u8]) -> Result<(), ArtefactError> {
        let temporary = Unfinished::begin(self.place.beside("writing"));
        write_synced(temporary.path(), bytes).map_err(output(&self.place.path, "write"))?;
        self.move_in(temporary.path())
    }

    /// Moves a complete result to the output path, in one step if the system can.
    fn move_in(&self, whole: &Path) -> Result<(), ArtefactError> {
        let path = &self.place.path;
        unfinished::finish(whole, path, || {
            if path.symlink_metadata().is_ok() && (self.keeps_other || !self.kind.is_own(path)) {
                keep_aside(whole, path)
            } else if self.kind == ArtefactKind::File || path.symlink_metadata().is_err() {
                fs::rename(whole, path).map_err(output(path, "move the finished result here"))
            } else {
                replace(whole, path, &self.place.beside("replaced"))
            }
        })?;
        sync_parent(path);
        Ok(())
    }
}

/// Writes one file atomically. An existing file is replaced if this program wrote it, else refused, or with `force`
/// renamed.
pub fn put_file(to: Destination<'_>, bytes: &[u8]) -> Result<(), ArtefactError> {
    Artefact::begin(to, ArtefactKind::File)?.put(bytes)
}

/// Refuses, before any work, an output path for JUnit XML that has anything but JUnit XML written by this program; with
/// `force`, a file that this program did not write is accepted, and renamed later.
///
/// # Errors
/// [`ArtefactError::Occupied`], or [`ArtefactError::InTheWay`] for another result of this program.
pub fn keep_others_from_junit(to: Destination<'_>) -> Result<(), ArtefactError> {
    let Destination { path, force } = to;
    let is_junit = || {
        let mut head = [0; 5];
        fs::File::open(path).and_then(|mut file| file.read_exact(&mut head)).is_ok() && head == *b"<?xml"
    };
    let is_own = ArtefactKind::File.is_own(path);
    match path.symlink_metadata().is_err() || if is_own { is_junit() } else { force } {
        true => Ok(()),
        false if is_own => Err(ArtefactError::in_the_way(path)),
        false => Err(ArtefactError::occupied(path)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn junit_replaces_only_junit_written_by_this_program() {
        let root = tempfile::tempdir().unwrap();
        let free = |text: &str, force| {
            let path = root.path().join("gate.xml");
            fs::write(&path, text).unwrap();
            keep_others_from_junit(Destination { path: &path, force }).is_ok()
        };
        let ours = "<?xml version=\"1.0\"?>\n<testsuites><!-- <meta name=\"generator\" content=\"skiagraph 1\"> -->";
        assert!(free(ours, false) && !free("<?xml version=\"1.0\"?><testsuites/>", false));
        assert!(free("thesis", true) && !free("{\"schema\": \"skiagraph.run/1\"}", true), "never a run's numbers");
        let nothing = root.path().join("nothing");
        assert!(keep_others_from_junit(Destination { path: &nothing, force: false }).is_ok());
    }

    #[test]
    fn an_unwritable_path_is_named() {
        let root = tempfile::tempdir().unwrap();
        let put = |path: &Path, force| put_file(Destination { path, force }, b"one");
        fs::write(root.path().join("a"), "").unwrap();
        let error = put(&root.path().join("a/walk.model"), false).unwrap_err();
        assert!(error.to_string().contains("cannot"), "{error}");
        for force in [false, true] {
            assert!(matches!(put(root.path(), force).unwrap_err(), ArtefactError::InTheWay { .. }));
        }
    }
}
