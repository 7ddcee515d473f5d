//! Atomic results: written next to their target, then moved in one step.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::ExperimentError;
use super::destination::Destination;
use super::error::output;
use super::ownership::{self, Listing};
use super::place::{LockedPlace, backup_of, replace, sync_parent, write_synced};
use super::provenance::{ResultKind, is_own_output};
use super::unfinished;

/// A directory under construction. Dropped before [`Self::finish`] it disappears, and what stood in its place is
/// untouched.
#[derive(Debug)]
pub(crate) struct PartialDirectory {
    kind: ResultKind,
    folder: PathBuf,
    place: LockedPlace,
    /// Whether the folder is another's to remove.
    is_anothers: bool,
    /// Whether what stands in the place is moved aside although it is ours: other settings made it.
    is_other: bool,
    /// What was written, as it was written.
    written: Mutex<Listing>,
}

impl PartialDirectory {
    /// Begins what shall become `target`. What is there already must be a result of ours of that kind, as it was
    /// written, which will be replaced; with `force` anything else is moved aside to `target~` instead of refused.
    ///
    /// # Errors
    /// [`ExperimentError::Occupied`] if something else is there, [`ExperimentError::Busy`] while another process writes
    /// there, [`ExperimentError::Output`] if nothing can be written.
    pub(crate) fn begin(target: &Path, kind: ResultKind, force: bool) -> Result<Self, ExperimentError> {
        Self::begin_unless(Destination { path: target, force }, kind, None)
    }

    /// As [`Self::begin`], where a result that stands there may have been made with other settings: by the first
    /// `difference`. Such a one is refused too, or moved aside with `force`.
    ///
    /// # Errors
    /// As [`Self::begin`], and [`ExperimentError::OtherResult`].
    pub(super) fn begin_unless(
        to: Destination<'_>,
        kind: ResultKind,
        difference: Option<String>,
    ) -> Result<Self, ExperimentError> {
        let (target, is_other) = (to.path, difference.is_some());
        let place = Self::claim(target, kind, to.force)?;
        match difference {
            Some(difference) if !to.force => {
                return Err(ExperimentError::OtherResult { path: target.to_owned(), difference });
            }
            // report before the work if it cannot be moved aside
            Some(_) => drop(backup_of(target)?),
            None => {}
        }
        let folder = place.beside("partial");
        fs::create_dir(&folder).map_err(output(&folder, "create the directory"))?;
        unfinished::begin(&folder);
        Ok(Self { kind, folder, place, is_anothers: false, is_other, written: Mutex::default() })
    }

    /// As [`Self::begin`], in `folder`, on the same file system: the caller makes it afterwards and removes what is
    /// left of it.
    ///
    /// # Errors
    /// As [`Self::begin`].
    pub(super) fn begin_in(
        folder: PathBuf,
        target: &Path,
        kind: ResultKind,
        force: bool,
    ) -> Result<Self, ExperimentError> {
        let place = Self::claim(target, kind, force)?;
        Ok(Self { kind, folder, place, is_anothers: true, is_other: false, written: Mutex::default() })
    }

    fn claim(target: &Path, kind: ResultKind, force: bool) -> Result<LockedPlace, ExperimentError> {
        let occupied = target.symlink_metadata().is_ok() && !is_own_output(target, kind);
        if target.file_name().is_none() || (occupied && !force) {
            return Err(ExperimentError::Occupied { path: target.to_owned() });
        }
        if occupied {
            // report before the work if it cannot be moved aside
            backup_of(target)?;
        }
        LockedPlace::take(target)
    }

    /// Has what stands in the place moved aside although it is ours: other settings made it.
    pub(super) fn keep_other(&mut self) {
        self.is_other = true;
    }

    /// Where to write meanwhile.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writes one file and makes sure that it is on the disk.
    ///
    /// # Errors
    /// [`ExperimentError::Output`] if it cannot be written.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), ExperimentError> {
        let path = self.folder.join(name);
        write_synced(&path, bytes).map_err(output(&self.place.path.join(name), "write"))?;
        self.written.lock().unwrap_or_else(PoisonError::into_inner).add(name, bytes);
        Ok(())
    }

    /// Puts the directory in its place: what stood there is replaced in one step where the system can exchange
    /// directories. Of a run it holds what was written by [`Self::write`] and nothing that another process put there.
    ///
    /// # Errors
    /// [`ExperimentError::Output`] if it cannot be moved; then what stood there stands there again.
    pub(crate) fn finish(self) -> Result<(), ExperimentError> {
        let target = &self.place.path;
        let signed = match self.kind {
            // a set lists its files itself
            ResultKind::Set => Ok(()),
            ResultKind::Export | ResultKind::Figures => ownership::sign(&self.folder),
            ResultKind::Run => {
                let written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
                ownership::sign_written(&self.folder, &written)
            }
        };
        signed.map_err(output(target, "list the files of the directory"))?;
        unfinished::finish(&self.folder, target, || self.put_in_place())?;
        sync_parent(target);
        Ok(())
    }

    fn put_in_place(&self) -> Result<(), ExperimentError> {
        let (folder, target) = (&self.folder, &self.place.path);
        if target.symlink_metadata().is_err() {
            return fs::rename(folder, target).map_err(output(target, "move the finished directory here"));
        }
        if !self.is_other && is_own_output(target, self.kind) {
            let old = replace(folder, target, &self.place.beside("replaced"))?;
            return unfinished::remove(&old).map_err(output(&old, "remove the replaced directory"));
        }
        // Under its later name before it is exchanged: wherever this stops, nothing of others is hidden.
        let aside = backup_of(target)?;
        fs::rename(folder, &aside).map_err(output(&aside, "move the finished directory here"))?;
        let spare = self.place.beside("partial");
        let old = replace(&aside, target, &spare).inspect_err(|_| drop(fs::rename(&aside, folder)))?;
        if old != aside {
            fs::rename(&old, &aside).map_err(output(&aside, "move aside"))?;
        }
        Ok(())
    }
}

impl Drop for PartialDirectory {
    fn drop(&mut self) {
        if self.is_anothers {
            return;
        }
        // After `finish` nothing is there any more; before, there is nobody left to tell.
        unfinished::remove(&self.folder).ok();
        unfinished::end(&self.folder);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRACK: &[u8] = b"{\n  \"schema\": \"skiagraph.track/1\"\n}\n";

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn begin(target: &Path, force: bool) -> Result<PartialDirectory, ExperimentError> {
        PartialDirectory::begin(target, ResultKind::Run, force)
    }

    /// A directory with a run of ours whose page says `text`.
    fn run_of_ours(target: &Path, text: &str) {
        let partial = begin(target, false).unwrap();
        partial.write("track.json", TRACK).unwrap();
        partial.write("report.html", text.as_bytes()).unwrap();
        partial.finish().unwrap();
    }

    #[test]
    fn an_abandoned_directory_leaves_nothing_and_touches_nothing() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        run_of_ours(&target, "old");
        let partial = begin(&target, false).unwrap();
        partial.write("report.html", b"new").unwrap();
        drop(partial);
        assert_eq!(names(root.path()), ["a"]);
        assert_eq!(fs::read_to_string(target.join("report.html")).unwrap(), "old");
    }

    #[test]
    fn an_abandoned_directory_takes_the_directories_made_for_it_with_it() {
        let root = tempfile::tempdir().unwrap();
        let partial = begin(&root.path().join("runs/deep/a"), false).unwrap();
        assert_eq!(names(root.path()), ["runs"]);
        drop(partial);
        assert!(names(root.path()).is_empty());
        begin(&root.path().join("runs/deep/a"), false).unwrap().finish().unwrap();
        assert_eq!(names(&root.path().join("runs/deep")), ["a"]);
    }

    #[test]
    fn a_finished_directory_takes_the_place_of_ours() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        for text in ["one", "two"] {
            run_of_ours(&target, text);
            assert_eq!(fs::read_to_string(target.join("report.html")).unwrap(), text);
        }
        assert_eq!(names(root.path()), ["a"]);
        assert_eq!(names(&target), ["report.html", ownership::LISTING, "track.json"]);
    }

    #[test]
    fn a_file_of_a_name_of_ours_that_somebody_else_wrote_or_changed_is_not_ours() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        fs::create_dir(&target).unwrap();
        fs::write(target.join("track.json"), "somebody's").unwrap();
        let refused = || matches!(begin(&target, false), Err(ExperimentError::Occupied { .. }));
        assert!(refused());
        ownership::sign(&target).unwrap();
        assert!(!refused());
        fs::write(target.join("track.json"), "somebody's again").unwrap();
        assert!(refused());
        begin(&target, true).unwrap().finish().unwrap();
        assert_eq!(fs::read_to_string(root.path().join("a~/track.json")).unwrap(), "somebody's again");
    }

    #[test]
    fn what_is_not_ours_is_refused_and_with_force_moved_aside() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        run_of_ours(&target, "old");
        fs::write(target.join("thesis.tex"), "years of work").unwrap();
        assert!(matches!(begin(&target, false).unwrap_err(), ExperimentError::Occupied { .. }));
        begin(&target, true).unwrap().finish().unwrap();
        assert_eq!(names(root.path()), ["a", "a~"]);
        assert_eq!(fs::read_to_string(root.path().join("a~/thesis.tex")).unwrap(), "years of work");
        // a second time it is moved beside the first
        fs::write(target.join("thesis.tex"), "more work").unwrap();
        begin(&target, true).unwrap().finish().unwrap();
        assert_eq!(names(root.path()), ["a", "a~", "a~2"]);
        assert_eq!(fs::read_to_string(root.path().join("a~2/thesis.tex")).unwrap(), "more work");
    }

    #[test]
    fn a_run_of_ours_that_other_settings_made_is_refused_and_with_force_moved_aside() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        run_of_ours(&target, "old");
        let other = |force| {
            let to = Destination { path: &target, force };
            PartialDirectory::begin_unless(to, ResultKind::Run, Some("seeds: there 5, here 2".to_owned()))
        };
        let refused = other(false).unwrap_err();
        assert!(refused.to_string().contains("seeds: there 5, here 2") && refused.exit_code() == 2, "{refused}");
        assert!(refused.to_string().contains("--out") && refused.to_string().contains("--force"), "{refused}");
        let partial = other(true).unwrap();
        partial.write("track.json", TRACK).unwrap();
        partial.finish().unwrap();
        assert_eq!(names(&target), [ownership::LISTING, "track.json"]);
        assert_eq!(fs::read_to_string(root.path().join("a~/report.html")).unwrap(), "old");
    }

    #[test]
    fn what_another_process_puts_into_a_run_that_is_being_written_does_not_enter_it() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        let partial = begin(&target, false).unwrap();
        partial.write("track.json", TRACK).unwrap();
        fs::create_dir_all(partial.folder().join("deep")).unwrap();
        for name in ["run.json", "deep/run.json"] {
            fs::write(partial.folder().join(name), "forged").unwrap();
        }
        partial.finish().unwrap();
        assert_eq!(names(&target), ["deep", ownership::LISTING, "track.json"]);
        assert_eq!(names(&target.join("deep")), [""; 0]);
        assert!(is_own_output(&target, ResultKind::Run));
    }
}
