//! Unfinished output of this process, which is removed when the process is interrupted.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::error::{ArtefactError, NOTHING_WRITTEN};
use super::made_by::MADE_BY;

struct Register {
    begun: Vec<PathBuf>,
    /// Directories that were created for them, innermost first; removed if empty.
    made: Vec<PathBuf>,
    /// Saved progress, which an interruption does not remove.
    kept: Option<PathBuf>,
    finished: Option<PathBuf>,
}

static REGISTER: Mutex<Register> =
    Mutex::new(Register { begun: Vec::new(), made: Vec::new(), kept: None, finished: None });

fn register() -> MutexGuard<'static, Register> {
    REGISTER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file or directory that is being written: removed when dropped and when the process is interrupted, unless it was
/// finished before, or is kept.
#[derive(Debug)]
pub(crate) struct Unfinished {
    path: PathBuf,
    is_kept: AtomicBool,
}

impl Unfinished {
    pub(crate) fn begin(path: impl Into<PathBuf>) -> Self {
        let path = path.into();
        register().begun.push(path.clone());
        Self { path, is_kept: AtomicBool::new(false) }
    }

    /// Work that an earlier process kept at `path`.
    pub(crate) fn resume(path: impl Into<PathBuf>) -> Self {
        let this = Self { path: path.into(), is_kept: AtomicBool::new(false) };
        this.keep();
        this
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Keeps it when it is dropped and when the process is interrupted, so that the same command can resume it.
    pub(crate) fn keep(&self) {
        if !self.is_kept.swap(true, Ordering::SeqCst) {
            let mut register = register();
            register.begun.retain(|begun| *begun != self.path);
            register.kept = Some(self.path.clone());
        }
    }

    pub(crate) fn is_kept(&self) -> bool {
        self.is_kept.load(Ordering::SeqCst)
    }

    /// Removes it when it is dropped, even if it was kept.
    pub(crate) fn discard(&self) {
        self.is_kept.store(false, Ordering::SeqCst);
    }

    /// Moves it to `target` with `move_there`, during which it cannot be removed; afterwards it is finished.
    pub(crate) fn finish<E>(&self, target: &Path, move_there: impl FnOnce() -> Result<(), E>) -> Result<(), E> {
        finish(&self.path, target, move_there)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.is_kept() {
            // a finished path no longer exists; otherwise a failure could not be reported anywhere
            remove(&self.path).ok();
        }
        let mut register = register();
        register.begun.retain(|begun| *begun != self.path);
        if register.kept.as_ref() == Some(&self.path) {
            register.kept = None;
        }
    }
}

/// Moves `path` to `target` with `move_there`, during which it cannot be removed; afterwards it is finished.
pub(super) fn finish<E>(path: &Path, target: &Path, move_there: impl FnOnce() -> Result<(), E>) -> Result<(), E> {
    let mut register = register();
    move_there()?;
    register.begun.retain(|begun| begun != path);
    register.finished = Some(target.to_owned());
    Ok(())
}

/// Registers directories, innermost first, that were created for unfinished output: empty ones are removed when the
/// process is interrupted.
pub(super) fn made(directories: &[PathBuf]) {
    register().made.extend_from_slice(directories);
}

/// Removes the empty ones of these directories, innermost first.
pub(super) fn remove_empty(directories: &[PathBuf]) {
    directories.iter().for_each(|directory| drop(fs::remove_dir(directory)));
    register().made.retain(|made| !directories.contains(made));
}

/// Removes all unfinished output of this process and returns the message for the user. The process must end afterwards:
/// nothing can be begun or finished any more.
pub fn abandon() -> String {
    let mut register = register();
    for path in std::mem::take(&mut register.begun) {
        // Threads may still be writing into a directory, so removing it may need several attempts.
        (0..5).find(|_| remove(&path).is_ok());
    }
    register.made.iter().for_each(|directory| drop(fs::remove_dir(directory)));
    let existing = |path: &Option<PathBuf>| path.clone().filter(|path| path.exists());
    let message = match (existing(&register.kept), existing(&register.finished)) {
        (Some(partial), _) => ArtefactError::ProgressSaved { partial }.to_string(),
        (None, Some(path)) => format!("interrupted; {} was already written", path.display()),
        (None, None) => NOTHING_WRITTEN.to_owned(),
    };
    std::mem::forget(register);
    message
}

/// Removes a file, or a directory with everything below it; a missing path is not an error.
pub(crate) fn remove(path: &Path) -> io::Result<()> {
    let removed = match path.symlink_metadata() {
        Ok(found) if found.is_dir() => {
            // what says whose folder it is goes last: if this process is killed before, the next one still knows
            for entry in fs::read_dir(path).into_iter().flatten().flatten().filter(|entry| entry.file_name() != MADE_BY)
            {
                remove(&entry.path())?;
            }
            fs::remove_dir_all(path)
        }
        Ok(_) => fs::remove_file(path),
        Err(error) => Err(error),
    };
    removed.or_else(|error| if error.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(error) })
}
