//! Unfinished outputs of this process, which are removed when it is stopped.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::ExperimentError;

struct Register {
    /// Files and directories that are worth nothing unless they are finished.
    begun: Vec<PathBuf>,
    /// Directories that were made for them, innermost first: removed where they are empty.
    made: Vec<PathBuf>,
    /// Where finished parts of a training are kept.
    kept: Option<PathBuf>,
    /// The last result that was put in its place.
    finished: Option<PathBuf>,
}

static REGISTER: Mutex<Register> =
    Mutex::new(Register { begun: Vec::new(), made: Vec::new(), kept: None, finished: None });

fn register() -> MutexGuard<'static, Register> {
    REGISTER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on `path` is removed when the process is stopped.
pub(crate) fn begin(path: &Path) {
    register().begun.push(path.to_owned());
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

/// `path` is gone, or finished.
pub(crate) fn end(path: &Path) {
    register().begun.retain(|begun| begun != path);
}

/// `path`, which `finish` is about to move to `target`, cannot be removed meanwhile; afterwards it is finished.
pub(crate) fn finish<E>(path: &Path, target: &Path, finish: impl FnOnce() -> Result<(), E>) -> Result<(), E> {
    let mut register = register();
    finish()?;
    register.begun.retain(|begun| begun != path);
    register.finished = Some(target.to_owned());
    Ok(())
}

/// What an interrupted training leaves on purpose; `None` once the training is done.
pub(super) fn keep(partial: Option<&Path>) {
    register().kept = partial.map(Path::to_owned);
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
        (Some(partial), _) => ExperimentError::ProgressSaved { partial }.to_string(),
        (None, Some(path)) => format!("interrupted; {} was already written", path.display()),
        (None, None) => ExperimentError::Interrupted.to_string(),
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
