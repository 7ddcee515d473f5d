//! A locked output path, and the directories created for it.

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::error::{ArtefactError, output};
use super::unfinished::{self, Unfinished};

/// Maximum number of attempts to lock, since the previous process may remove the lock's file at that moment.
const TRIES: usize = 100;

/// Attempts, 50 ms apart, to lock a path that another process uses for a moment.
const WAITS: usize = 600;

/// The path of a file or directory, locked against other processes of this program.
#[derive(Debug)]
pub(crate) struct LockedPlace {
    pub(crate) path: PathBuf,
    /// Parent directories that were created, innermost first.
    made: Vec<PathBuf>,
    /// `None` if the file system has no locks.
    lock: Option<Lock>,
}

impl LockedPlace {
    /// Creates the parent directories of `path`, locks it, and removes leftovers of killed processes beside it.
    ///
    /// # Errors
    /// [`ArtefactError::Busy`] while another process writes there, [`ArtefactError::Output`] if nothing can be
    /// written.
    pub(crate) fn take(path: &Path) -> Result<Self, ArtefactError> {
        let parent = parent_of(path);
        let made = parent.ancestors().take_while(|a| !a.as_os_str().is_empty() && !a.exists());
        let made: Vec<PathBuf> = made.map(Path::to_owned).collect();
        unfinished::made(&made);
        let mut place = Self { path: path.to_owned(), made, lock: None };
        fs::create_dir_all(parent).map_err(output(parent, "create the directory"))?;
        place.lock = Lock::take(path)?;
        if place.lock.is_some() {
            place.clear_leftovers();
        }
        Ok(place)
    }

    /// As [`Self::take`], but waits half a minute for another process.
    pub(crate) fn take_when_free(path: &Path) -> Result<Self, ArtefactError> {
        for _ in 0..WAITS {
            match Self::take(path) {
                Err(ArtefactError::Busy { .. }) => std::thread::sleep(Duration::from_millis(50)),
                taken => return taken,
            }
        }
        Self::take(path)
    }

    /// A hidden sibling that only this process uses: `.NAME.PURPOSE-PID`.
    pub(crate) fn beside(&self, purpose: &str) -> PathBuf {
        of_this_process(&self.path, purpose)
    }

    /// Removes leftovers: since the lock is held, all siblings of these kinds belong to processes that ended. A result
    /// that was being replaced when its process died is restored if nothing exists at the path.
    fn clear_leftovers(&self) {
        for leftover in self.siblings("replaced") {
            if self.path.symlink_metadata().is_err() {
                fs::rename(&leftover, &self.path).ok();
            }
        }
        for purpose in ["partial", "replaced", "writing"] {
            self.siblings(purpose).iter().for_each(|leftover| drop(unfinished::remove(leftover)));
        }
    }

    fn siblings(&self, purpose: &str) -> Vec<PathBuf> {
        let prefix = sibling(&self.path, ".", &format!(".{purpose}-"));
        let prefix = prefix.file_name().unwrap_or_default().as_encoded_bytes();
        let of_a_process = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().as_encoded_bytes();
            name.strip_prefix(prefix).is_some_and(|pid| !pid.is_empty() && pid.iter().all(u8::is_ascii_digit))
        };
        let entries = fs::read_dir(parent_of(&self.path)).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).filter(of_a_process).collect()
    }
}

impl Drop for LockedPlace {
    fn drop(&mut self) {
        self.lock.take();
        unfinished::remove_empty(&self.made);
    }
}

/// A locked file `.NAME.lock`, removed when dropped. The system releases the lock when the process ends in any way.
#[derive(Debug)]
struct Lock {
    // dropped first, so that the file is removed while locked and no other process can hold a lock on it
    _path: Unfinished,
    _file: File,
}

impl Lock {
    fn take(target: &Path) -> Result<Option<Self>, ArtefactError> {
        let path = sibling(target, ".", ".lock");
        for _ in 0..TRIES {
            let file = File::options().create(true).write(true).truncate(false).open(&path);
            let file = file.map_err(output(parent_of(target), "write into the directory"))?;
            match file.try_lock() {
                // where identity is unknown, the system cannot remove an open file
                Ok(()) if are_same(file.metadata(), fs::metadata(&path)) != Some(false) => {
                    return Ok(Some(Self { _path: Unfinished::begin(path), _file: file }));
                }
                // the previous owner has removed the file in between
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => break,
                Err(TryLockError::Error(_)) => {
                    fs::remove_file(&path).ok();
                    return Ok(None);
                }
            }
        }
        Err(ArtefactError::Busy { path: target.to_owned() })
    }
}

/// Whether two files are the same, also through links; `None` if the system does not report it.
#[cfg(unix)]
pub(super) fn are_same(a: io::Result<fs::Metadata>, b: io::Result<fs::Metadata>) -> Option<bool> {
    use std::os::unix::fs::MetadataExt;
    let identity = |found: fs::Metadata| (found.dev(), found.ino());
    Some(matches!((a.map(identity), b.map(identity)), (Ok(a), Ok(b)) if a == b))
}

/// Whether two files are the same, also through links; `None` if the system does not report it.
#[cfg(not(unix))]
pub(super) fn are_same(_: io::Result<fs::Metadata>, _: io::Result<fs::Metadata>) -> Option<bool> {
    None
}

/// Exchanges two paths in one step; `false` if the system or file system cannot.
#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn exchange(a: &Path, b: &Path) -> io::Result<bool> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    use rustix::io::Errno;
    match renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE) {
        Ok(()) => Ok(true),
        Err(Errno::NOSYS | Errno::INVAL | Errno::NOTSUP) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// Exchanges two paths in one step; `false` if the system or file system cannot.
#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn exchange(_: &Path, _: &Path) -> io::Result<bool> {
    Ok(false)
}

/// Replaces `old`, a result of this program, by `new`: in one step if the system can exchange them, else by way of
/// `aside`.
///
/// # Errors
/// [`ArtefactError::Output`]; `old` is then still at its path, or beside it with the suffix `replaced`.
pub(super) fn replace(new: &Path, old: &Path, aside: &Path) -> Result<(), ArtefactError> {
    let left = if exchange(new, old).map_err(output(old, "replace"))? {
        new
    } else {
        move_aside(new, old, aside)?;
        aside
    };
    unfinished::remove(left).map_err(output(left, "remove what was replaced"))
}

/// Replaces `old` by `new` and keeps `old` as `NAME~`. If this is interrupted at any point, `old` is never left under a
/// hidden name.
pub(super) fn keep_aside(new: &Path, old: &Path) -> Result<(), ArtefactError> {
    let aside = backup_of(old)?;
    // rename to the backup's name first, so that the exchange gives `old` that name
    fs::rename(new, &aside).map_err(output(&aside, "move the finished result here"))?;
    let exchanged = exchange(&aside, old).map_err(output(old, "replace"));
    if !matches!(exchanged, Ok(true)) {
        fs::rename(&aside, new).map_err(output(new, "move the finished result here"))?;
    }
    if exchanged? { Ok(()) } else { move_aside(new, old, &aside) }
}

/// Moves `old` to `aside` and `new` into its place, in two steps.
fn move_aside(new: &Path, old: &Path, aside: &Path) -> Result<(), ArtefactError> {
    fs::rename(old, aside).map_err(output(old, "move aside"))?;
    fs::rename(new, old).map_err(|source| {
        fs::rename(aside, old).ok();
        output(old, "move the finished result here")(source)
    })
}

/// The first free one of `NAME~`, `NAME~2`, `NAME~3` and so on.
pub(crate) fn backup_of(path: &Path) -> Result<PathBuf, ArtefactError> {
    let first = sibling(path, "", "~");
    let names = std::iter::once(first.clone()).chain((2..=1000).map(|number| sibling(path, "", &format!("~{number}"))));
    let mut free = names.filter(|path| path.symlink_metadata().is_err());
    free.next().ok_or(ArtefactError::Occupied { path: first })
}

pub(crate) fn write_synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Writes a file atomically; no other process may write to it at the same time.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ArtefactError> {
    let temporary = Unfinished::begin(of_this_process(path, "writing"));
    let written = write_synced(temporary.path(), bytes).and_then(|()| fs::rename(temporary.path(), path));
    written.map_err(output(path, "write"))
}

/// Syncs the directory of a renamed entry to the disk.
pub(crate) fn sync_parent(path: &Path) {
    if let Ok(parent) = File::open(parent_of(path)) {
        parent.sync_all().ok();
    }
}

pub(crate) fn parent_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The path in the same directory whose name has this prefix and suffix.
pub(crate) fn sibling(path: &Path, before: &str, behind: &str) -> PathBuf {
    let mut name = OsString::from(before);
    name.push(path.file_name().unwrap_or_default());
    name.push(behind);
    path.with_file_name(name)
}

/// A hidden sibling that only this process uses: `.NAME.PURPOSE-PID`.
pub(crate) fn of_this_process(path: &Path, purpose: &str) -> PathBuf {
    sibling(path, ".", &format!(".{purpose}-{}", std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn leftovers_of_dead_processes_are_removed_and_those_of_running_ones_kept() {
        let root = tempfile::tempdir().unwrap();
        for name in [".a.partial-17", ".a.replaced-17", ".b.partial-18", ".a.partial-mine", "a"] {
            fs::create_dir(root.path().join(name)).unwrap();
            fs::write(root.path().join(name).join("x"), name).unwrap();
        }
        fs::write(root.path().join(".a.writing-17"), "").unwrap();
        let living = LockedPlace::take(&root.path().join("b")).unwrap();
        fs::create_dir(root.path().join(".b.partial-19")).unwrap();
        drop(LockedPlace::take(&root.path().join("a")).unwrap());
        assert!(LockedPlace::take(&root.path().join("b")).is_err());
        assert_eq!(names(root.path()), [".a.partial-mine", ".b.lock", ".b.partial-19", "a"]);
        drop(living);
    }

    #[test]
    fn a_result_that_was_being_replaced_when_its_process_died_is_restored() {
        let root = tempfile::tempdir().unwrap();
        fs::create_dir(root.path().join(".a.replaced-17")).unwrap();
        fs::write(root.path().join(".a.replaced-17/run.json"), "old").unwrap();
        drop(LockedPlace::take(&root.path().join("a")).unwrap());
        assert_eq!(fs::read_to_string(root.path().join("a/run.json")).unwrap(), "old");
        assert_eq!(names(root.path()), ["a"]);
    }

    #[test]
    fn directories_are_exchanged_in_one_step_if_the_system_can() {
        let root = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| root.path().join(name));
        for path in [&a, &b] {
            fs::create_dir(path).unwrap();
            fs::write(path.join("name"), path.file_name().unwrap().as_encoded_bytes()).unwrap();
        }
        replace(&a, &b, &root.path().join("aside")).unwrap();
        assert_eq!(fs::read_to_string(b.join("name")).unwrap(), "a");
        assert_eq!(names(root.path()), ["b"]);
        if cfg!(target_os = "linux") {
            fs::create_dir(&a).unwrap();
            assert!(exchange(&a, &b).unwrap(), "Linux file systems support it");
            assert_eq!(fs::read_to_string(a.join("name")).unwrap(), "a");
        }
    }

    #[test]
    fn without_an_exchange_the_old_result_is_moved_aside_first() {
        let root = tempfile::tempdir().unwrap();
        let [new, old, aside] = ["new", "old", "old~"].map(|name| root.path().join(name));
        fs::write(&new, "new").unwrap();
        fs::write(&old, "old").unwrap();
        move_aside(&new, &old, &aside).unwrap();
        assert_eq!([&old, &aside].map(|path| fs::read_to_string(path).unwrap()), ["new", "old"]);
        assert!(move_aside(&new, &old, &root.path().join("other")).is_err());
        assert_eq!(fs::read_to_string(&old).unwrap(), "new", "back in its place");
    }
}
