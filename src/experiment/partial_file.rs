//! Atomic writing of one file.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::error::output;
use super::place::{LockedPlace, backup_of, replace, sync_parent, write_synced};
use super::provenance::is_own_file;
use super::unfinished;
use super::{Destination, ExperimentError};

/// The path with `suffix` behind its name.
pub(super) fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(suffix);
    path.with_file_name(name)
}

/// The place of a file that this process alone writes.
#[derive(Debug)]
pub(super) struct PartialFile {
    place: LockedPlace,
    /// Whether what is there is moved aside although it is ours: other settings made it.
    is_other: bool,
}

impl PartialFile {
    /// Begins what shall become the file `path`. What is there already must be a file of ours, which is replaced; with
    /// `force` anything else is moved aside to `path~` instead of refused. Directories above are made.
    ///
    /// # Errors
    /// [`ExperimentError::Occupied`] if something else is there, [`ExperimentError::Busy`] while another process writes
    /// there, [`ExperimentError::Output`] if nothing can be written.
    pub(super) fn begin(path: &Path, force: bool) -> Result<Self, ExperimentError> {
        Self::begin_unless(Destination { path, force }, None)
    }

    /// As [`Self::begin`], where a file of ours that is there may have been made with other settings: by the first
    /// `difference`. Such a one is refused too, or moved aside with `force`.
    ///
    /// # Errors
    /// As [`Self::begin`], and [`ExperimentError::OtherResult`].
    pub(super) fn begin_unless(to: Destination<'_>, difference: Option<String>) -> Result<Self, ExperimentError> {
        let Destination { path, force } = to;
        let occupied = path.symlink_metadata().is_ok() && !is_own_file(path);
        if path.file_name().is_none() || path.is_dir() || (occupied && !force) {
            return Err(ExperimentError::Occupied { path: path.to_owned() });
        }
        let is_other = difference.is_some();
        if let Some(difference) = difference.filter(|_| !force) {
            return Err(ExperimentError::OtherResult { path: path.to_owned(), difference });
        }
        if occupied || is_other {
            backup_of(path)?;
        }
        Ok(Self { place: LockedPlace::take(path)?, is_other })
    }

    /// Puts the bytes in their place, whole; what was there stays until then. May be called again.
    ///
    /// # Errors
    /// [`ExperimentError::Output`] that names the file.
    pub(super) fn put(&self, bytes: &[u8]) -> Result<(), ExperimentError> {
        let (path, meanwhile) = (&self.place.path, self.place.beside("writing"));
        unfinished::begin(&meanwhile);
        let written = write_synced(&meanwhile, bytes).map_err(output(path, "write"));
        let done = written.and_then(|()| unfinished::finish(&meanwhile, path, || self.put_in_place(&meanwhile)));
        if done.is_err() {
            fs::remove_file(&meanwhile).ok();
            unfinished::end(&meanwhile);
        }
        sync_parent(path);
        done
    }

    fn put_in_place(&self, meanwhile: &Path) -> Result<(), ExperimentError> {
        let path = &self.place.path;
        if path.symlink_metadata().is_err() || (!self.is_other && is_own_file(path)) {
            return fs::rename(meanwhile, path).map_err(output(path, "write"));
        }
        let aside = backup_of(path)?;
        let old = replace(meanwhile, path, &aside)?;
        if old == aside { Ok(()) } else { fs::rename(&old, &aside).map_err(output(&aside, "move aside")) }
    }
}

/// Writes one file, whole: what is there is replaced if this program wrote it, else refused or, with `force`, moved
/// aside.
///
/// # Errors
/// [`ExperimentError::Occupied`] if something else is there, [`ExperimentError::Output`] if nothing can be written.
pub fn put_file(to: Destination<'_>, bytes: &[u8]) -> Result<(), ExperimentError> {
    PartialFile::begin(to.path, to.force)?.put(bytes)
}

/// Refuses, before any work, a place for JUnit XML where something else than such a file of ours is; with `force` what
/// we did not write is moved aside later.
///
/// # Errors
/// [`ExperimentError::Occupied`].
pub fn keep_others_from_junit(to: Destination<'_>) -> Result<(), ExperimentError> {
    let Destination { path, force } = to;
    let is_junit = || {
        let mut head = [0; 5];
        fs::File::open(path).and_then(|mut file| file.read_exact(&mut head)).is_ok() && head == *b"<?xml"
    };
    let ours = is_own_file(path);
    let free = path.symlink_metadata().is_err() || if ours { is_junit() } else { force };
    if free { Ok(()) } else { Err(ExperimentError::Occupied { path: path.to_owned() }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(path: &Path, bytes: &[u8], force: bool) -> Result<(), ExperimentError> {
        put_file(Destination { path, force }, bytes)
    }

    const ONE: &[u8] = b"{\"schema\": \"skiagraph.one/1\"}";
    const TWO: &[u8] = b"{\"schema\": \"skiagraph.two/1\"}";

    #[test]
    fn a_file_of_ours_is_replaced_whole_and_nothing_else_is_left() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("deep/walk.json");
        put(&path, ONE, false).unwrap();
        put(&path, TWO, false).unwrap();
        assert_eq!(fs::read(&path).unwrap(), TWO);
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn a_file_of_others_is_refused_and_with_force_moved_aside() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("thesis.html");
        fs::write(&path, "<html>years of work").unwrap();
        assert!(matches!(put(&path, ONE, false).unwrap_err(), ExperimentError::Occupied { .. }));
        put(&path, ONE, true).unwrap();
        assert_eq!(fs::read(&path).unwrap(), ONE);
        assert_eq!(fs::read(root.path().join("thesis.html~")).unwrap(), b"<html>years of work");
        assert_eq!(fs::read_dir(root.path()).unwrap().count(), 2);
    }

    #[test]
    fn junit_replaces_only_junit_of_ours() {
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
    fn a_place_that_cannot_be_written_is_named() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("a"), "").unwrap();
        let error = put(&root.path().join("a/walk.model"), b"one", false).unwrap_err();
        assert!(error.to_string().contains("cannot"), "{error}");
        for force in [false, true] {
            assert!(matches!(put(root.path(), b"one", force).unwrap_err(), ExperimentError::Occupied { .. }));
        }
    }
}
