//! Results that are whole or absent: written beside their place, then renamed into it.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::ExperimentError;
use super::error::output;
use super::ownership;
use crate::benchmark_set::{is_set, verify_hashes};

const LOCK: &str = ".lock";

/// A directory under construction. Dropped before [`Self::finish`] it disappears, and what stood in its place is untouched.
#[derive(Debug)]
pub(crate) struct PartialDirectory {
    target: PathBuf,
    folder: PathBuf,
    /// Directories above that were not there before, innermost first.
    made: Vec<PathBuf>,
    // Held while the process lives: a leftover of a killed process is one whose lock is free.
    _lock: File,
}

impl PartialDirectory {
    /// Begins what shall become `target`. What is there already must be a result of ours (all its entries are among `ours`, and
    /// its listing says that they are as we wrote them), which will be replaced; with `force` anything else is moved aside to
    /// `target~` instead of refused.
    ///
    /// # Errors
    /// [`ExperimentError::Occupied`] if something else is there, [`ExperimentError::Output`] if nothing can be written.
    pub(crate) fn begin(target: &Path, ours: &[&str], force: bool) -> Result<Self, ExperimentError> {
        if target.file_name().is_none() {
            return Err(ExperimentError::Occupied { path: target.to_owned() });
        }
        if target.symlink_metadata().is_ok() && !holds_only(target, ours) && !force {
            return Err(ExperimentError::Occupied { path: target.to_owned() });
        }
        let parent = parent_of(target);
        let made = parent.ancestors().take_while(|a| !a.as_os_str().is_empty() && !a.exists());
        let made = made.map(Path::to_owned).collect();
        fs::create_dir_all(parent).map_err(output(parent, "create the directory"))?;
        remove_leftovers(target);
        let folder = beside(target, &format!(".partial-{}", std::process::id()));
        fs::create_dir(&folder).map_err(output(parent, "write into the directory"))?;
        let lock = File::create(folder.join(LOCK));
        if let Ok(lock) = &lock {
            // Where the file system has no locks, leftovers stay; that harms nobody.
            lock.try_lock().ok();
        }
        match lock {
            Ok(lock) => Ok(Self { target: target.to_owned(), folder, made, _lock: lock }),
            Err(source) => {
                fs::remove_dir_all(&folder).ok();
                Err(output(&folder, "write into the directory")(source))
            }
        }
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
        let written = File::create(&path).and_then(|mut file| {
            io::Write::write_all(&mut file, bytes)?;
            file.sync_all()
        });
        written.map_err(output(&self.target.join(name), "write"))
    }

    /// Puts the directory in its place.
    ///
    /// # Errors
    /// [`ExperimentError::Output`] if it cannot be moved; then what stood there stands there again.
    pub(crate) fn finish(self, ours: &[&str]) -> Result<(), ExperimentError> {
        fs::remove_file(self.folder.join(LOCK)).map_err(output(&self.folder, "finish the directory"))?;
        // a set lists its files itself
        if !is_set(&self.folder) {
            ownership::sign(&self.folder).map_err(output(&self.target, "list the files of the directory"))?;
        }
        let old = if self.target.symlink_metadata().is_ok() {
            let replaced = holds_only(&self.target, ours);
            let aside = if replaced {
                beside(&self.target, &format!(".replaced-{}", std::process::id()))
            } else {
                beside_visibly(&self.target)?
            };
            fs::rename(&self.target, &aside).map_err(output(&self.target, "move aside"))?;
            Some((aside, replaced))
        } else {
            None
        };
        if let Err(source) = fs::rename(&self.folder, &self.target) {
            if let Some((aside, _)) = &old {
                fs::rename(aside, &self.target).ok();
            }
            return Err(output(&self.target, "move the finished directory here")(source));
        }
        if let Ok(parent) = File::open(parent_of(&self.target)) {
            parent.sync_all().ok();
        }
        if let Some((aside, true)) = old {
            fs::remove_dir_all(&aside).map_err(output(&aside, "remove the replaced directory"))?;
        }
        Ok(())
    }
}

impl Drop for PartialDirectory {
    fn drop(&mut self) {
        // After `finish` nothing is there any more; before, there is nobody left to tell.
        fs::remove_dir_all(&self.folder).ok();
        // Only those that are empty go: after `finish` none is.
        self.made.iter().for_each(|made| drop(fs::remove_dir(made)));
    }
}

/// Whether `path` is a directory all of whose entries are among `ours` and as we wrote them; an empty one is nobody's loss.
fn holds_only(path: &Path, ours: &[&str]) -> bool {
    let Ok(entries) = fs::read_dir(path) else { return false };
    let names: Vec<_> = entries.flatten().map(|entry| entry.file_name()).collect();
    let known = |name: &str| name == ownership::LISTING || ours.contains(&name);
    let as_written = || if is_set(path) { verify_hashes(path).is_ok() } else { ownership::is_signed(path) };
    !path.is_symlink()
        && names.iter().all(|name| name.to_str().is_some_and(known))
        && (names.is_empty() || as_written())
}

/// Removes what killed processes left beside `target`.
fn remove_leftovers(target: &Path) {
    let prefix = beside(target, ".partial-");
    let prefix = prefix.file_name().unwrap_or_default().to_string_lossy().into_owned();
    for entry in fs::read_dir(parent_of(target)).into_iter().flatten().flatten() {
        if !entry.file_name().to_string_lossy().starts_with(&prefix) {
            continue;
        }
        if File::open(entry.path().join(LOCK)).is_ok_and(|lock| lock.try_lock().is_ok()) {
            fs::remove_dir_all(entry.path()).ok();
        }
    }
}

/// A hidden sibling of `target`, on the same file system.
fn beside(target: &Path, suffix: &str) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(target.file_name().unwrap_or_default());
    name.push(suffix);
    target.with_file_name(name)
}

/// `target~`, which must be free.
fn beside_visibly(target: &Path) -> Result<PathBuf, ExperimentError> {
    let mut name = target.file_name().unwrap_or_default().to_owned();
    name.push("~");
    let aside = target.with_file_name(name);
    if aside.symlink_metadata().is_ok() { Err(ExperimentError::Occupied { path: aside }) } else { Ok(aside) }
}

fn parent_of(target: &Path) -> &Path {
    target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: &[&str] = &["run.json"];

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn an_abandoned_directory_leaves_nothing_and_touches_nothing() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        fs::create_dir(&target).unwrap();
        fs::write(target.join("run.json"), "old").unwrap();
        ownership::sign(&target).unwrap();
        let partial = PartialDirectory::begin(&target, OURS, false).unwrap();
        partial.write("run.json", b"new").unwrap();
        drop(partial);
        assert_eq!(names(root.path()), ["a"]);
        assert_eq!(fs::read_to_string(target.join("run.json")).unwrap(), "old");
    }

    #[test]
    fn an_abandoned_directory_takes_the_directories_made_for_it_with_it() {
        let root = tempfile::tempdir().unwrap();
        let partial = PartialDirectory::begin(&root.path().join("runs/deep/a"), OURS, false).unwrap();
        assert_eq!(names(root.path()), ["runs"]);
        drop(partial);
        assert!(names(root.path()).is_empty());
        PartialDirectory::begin(&root.path().join("runs/deep/a"), OURS, false).unwrap().finish(OURS).unwrap();
        assert_eq!(names(&root.path().join("runs/deep")), ["a"]);
    }

    #[test]
    fn a_finished_directory_takes_the_place_of_ours() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        for text in ["one", "two"] {
            let partial = PartialDirectory::begin(&target, OURS, false).unwrap();
            partial.write("run.json", text.as_bytes()).unwrap();
            partial.finish(OURS).unwrap();
            assert_eq!(fs::read_to_string(target.join("run.json")).unwrap(), text);
        }
        let files = vec!["run.json".to_owned(), ownership::LISTING.to_owned()];
        assert_eq!((names(root.path()), names(&target)), (vec!["a".to_owned()], files));
    }

    #[test]
    fn a_file_of_a_name_of_ours_that_somebody_else_wrote_or_changed_is_not_ours() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        fs::create_dir(&target).unwrap();
        fs::write(target.join("run.json"), "somebody's").unwrap();
        let refused = || matches!(PartialDirectory::begin(&target, OURS, false), Err(ExperimentError::Occupied { .. }));
        assert!(refused());
        ownership::sign(&target).unwrap();
        assert!(!refused());
        fs::write(target.join("run.json"), "somebody's again").unwrap();
        assert!(refused());
        PartialDirectory::begin(&target, OURS, true).unwrap().finish(OURS).unwrap();
        assert_eq!(fs::read_to_string(root.path().join("a~/run.json")).unwrap(), "somebody's again");
    }

    #[test]
    fn what_is_not_ours_is_refused_and_with_force_moved_aside() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        fs::create_dir(&target).unwrap();
        fs::write(target.join("run.json"), "old").unwrap();
        fs::write(target.join("thesis.tex"), "years of work").unwrap();
        let refused = PartialDirectory::begin(&target, OURS, false).unwrap_err();
        assert!(matches!(refused, ExperimentError::Occupied { .. }));
        PartialDirectory::begin(&target, OURS, true).unwrap().finish(OURS).unwrap();
        assert_eq!(names(root.path()), ["a", "a~"]);
        assert_eq!(fs::read_to_string(root.path().join("a~/thesis.tex")).unwrap(), "years of work");
    }

    #[test]
    fn leftovers_of_the_dead_are_removed_and_those_of_the_living_kept() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        let dead = root.path().join(".a.partial-0");
        fs::create_dir(&dead).unwrap();
        fs::write(dead.join(LOCK), "").unwrap();
        let living = root.path().join(".a.partial-1");
        fs::create_dir(&living).unwrap();
        let lock = File::create(living.join(LOCK)).unwrap();
        lock.lock().unwrap();
        PartialDirectory::begin(&target, OURS, false).unwrap().finish(OURS).unwrap();
        assert_eq!(names(root.path()), [".a.partial-1", "a"]);
    }
}
