//! Unfinished work of this process, which is removed when it is stopped.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::error::{ArtefactError, NOTHING_WRITTEN};

struct Register {
    /// Files and directories that are worth nothing unless they are finished.
    begun: Vec<PathBuf>,
    /// Directories that were made for them, innermost first: removed where they are empty.
    made: Vec<PathBuf>,
    /// What an interruption leaves on purpose.
    kept: Option<PathBuf>,
    /// The last result that was put in its place.
    finished: Option<PathBuf>,
}

static REGISTER: Mutex<Register> =
    Mutex::new(Register { begun: Vec::new(), made: Vec::new(), kept: None, finished: None });

fn register() -> MutexGuard<'static, Register> {
    REGISTER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file or directory that is being written: removed when it is dropped and when the process is stopped, unless it is
/// moved to its place before, or worth keeping.
#[derive(Debug)]
pub(crate) struct Unfinished {
    path: PathBuf,
    is_kept: AtomicBool,
}

impl Unfinished {
    /// What shall be written to `path`.
    pub(crate) fn begin(path: impl Into<PathBuf>) -> Self {
        let path = path.into();
        register().begun.push(path.clone());
        Self { path, is_kept: AtomicBool::new(false) }
    }

    /// What was kept at `path` by an earlier process.
    pub(crate) fn resume(path: impl Into<PathBuf>) -> Self {
        let this = Self { path: path.into(), is_kept: AtomicBool::new(false) };
        this.keep();
        this
    }

    /// Where it is written.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// From now on it stays when it is dropped and when the process is stopped: the same command goes on with it.
    pub(crate) fn keep(&self) {
        if !self.is_kept.swap(true, Ordering::SeqCst) {
            let mut register = register();
            register.begun.retain(|begun| *begun != self.path);
            register.kept = Some(self.path.clone());
        }
    }

    /// Whether it stays.
    pub(crate) fn is_kept(&self) -> bool {
        self.is_kept.load(Ordering::SeqCst)
    }

    /// Has it removed when it is dropped, although it was kept.
    pub(crate) fn discard(&self) {
        self.is_kept.store(false, Ordering::SeqCst);
    }

    /// Has it moved to `target`. It cannot be removed meanwhile; afterwards it is finished.
    pub(crate) fn finish<E>(&self, target: &Path, move_there: impl FnOnce() -> Result<(), E>) -> Result<(), E> {
        finish(&self.path, target, move_there)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.is_kept() {
            // where it is finished nothing is there any more; before, nobody is left to tell of a failure
            remove(&self.path).ok();
        }
        let mut register = register();
        register.begun.retain(|begun| *begun != self.path);
        if register.kept.as_ref() == Some(&self.path) {
            register.kept = None;
        }
    }
}

/// Has `path` moved to `target`. It cannot be removed meanwhile; afterwards it is finished.
pub(super) fn finish<E>(path: &Path, target: &Path, move_there: impl FnOnce() -> Result<(), E>) -> Result<(), E> {
    let mut register = register();
    move_there()?;
    register.begun.retain(|begun| begun != path);
    register.finished = Some(target.to_owned());
    Ok(())
}

/// These directories, innermost first, were made for what is begun: empty ones are removed when the process is stopped.
pub(super) fn made(directories: &[PathBuf]) {
    register().made.extend_from_slice(directories);
}

/// Removes directories that were made and are empty, innermost first; the others stay.
pub(super) fn remove_empty(directories: &[PathBuf]) {
    directories.iter().for_each(|directory| drop(fs::remove_dir(directory)));
    register().made.retain(|made| !directories.contains(made));
}

/// Removes everything that this process has begun and not finished, for good: nothing can be begun or finished
/// afterwards. For a process that ends at once. Returns what to tell the user.
pub fn abandon() -> String {
    let mut register = register();
    for path in std::mem::take(&mut register.begun) {
        // Threads may still be writing below a directory: what they add is removed by another try.
        (0..5).find(|_| remove(&path).is_ok());
    }
    register.made.iter().for_each(|directory| drop(fs::remove_dir(directory)));
    let there = |path: &Option<PathBuf>| path.clone().filter(|path| path.exists());
    let said = match (there(&register.kept), there(&register.finished)) {
        (Some(partial), _) => ArtefactError::ProgressSaved { partial }.to_string(),
        (None, Some(path)) => format!("interrupted; {} was already written", path.display()),
        (None, None) => NOTHING_WRITTEN.to_owned(),
    };
    std::mem::forget(register);
    said
}

/// Removes a file or a directory with all that is below; done as well if nothing is there.
pub(crate) fn remove(path: &Path) -> io::Result<()> {
    let removed = match path.symlink_metadata() {
        Ok(found) if found.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(error) => Err(error),
    };
    removed.or_else(|error| if error.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(error) })
}
