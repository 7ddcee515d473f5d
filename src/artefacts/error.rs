//! Errors of artefacts.

use std::io;
use std::path::{Path, PathBuf};

use skiagraph_core::input::plain;

/// Message for an interruption that leaves nothing.
pub(crate) const NOTHING_WRITTEN: &str = "interrupted; nothing was written";

/// An error of writing a result, or an interruption that leaves progress.
#[derive(Debug, thiserror::Error)]
pub enum ArtefactError {
    /// A result cannot be written.
    #[error("{}: cannot {action}: {source}", plain(path.display()))]
    Output {
        path: PathBuf,
        /// The failed action, as in "cannot ...".
        action: &'static str,
        /// The operating system's error.
        source: io::Error,
    },
    /// Another skiagraph process writes to the same path.
    #[error(
        "{path}: another skiagraph process is writing here; wait until it has finished, or write elsewhere",
        path = path.display()
    )]
    Busy { path: PathBuf },
    /// An output path would overwrite an input.
    #[error(
        "{path}: the output would replace or change {input}, which the command reads; write elsewhere",
        path = path.display(), input = input.display()
    )]
    IsInput { path: PathBuf, input: PathBuf },
    /// A file that skiagraph did not write exists at the output path.
    #[error(
        "{}: this exists and is not an unchanged skiagraph result; write elsewhere, or use --force to rename it to NAME~",
        plain(path.display())
    )]
    Occupied { path: PathBuf },
    /// A file or folder that this command neither replaces nor renames exists where it writes.
    #[error(
        "{}: this exists and is not an unchanged skiagraph result; --force does not rename it here, so move it away, or \
        write elsewhere",
        plain(path.display())
    )]
    InTheWay { path: PathBuf },
    /// A skiagraph result that was made with other settings exists at the output path.
    #[error(
        "{}: this is a result made with other settings ({}); write elsewhere, or use --force to rename it to NAME~",
        plain(path.display()),
        plain(difference)
    )]
    OtherResult { path: PathBuf, difference: String },
    /// The user interrupted work that can be resumed: training, a sweep, rendering a set, tracking several seeds.
    #[error("interrupted; progress is saved in {}: run the same command to resume", plain(partial.display()))]
    ProgressSaved {
        /// The file or directory with the progress.
        partial: PathBuf,
    },
    /// Unfinished work with other settings exists for the output path.
    #[error(
        "{}: an interrupted command with other settings saved its progress here ({}); repeat that command to resume it, or \
         use --force to discard the progress",
        plain(partial.display()),
        plain(difference)
    )]
    OtherUnfinished { partial: PathBuf, difference: String },
}

impl ArtefactError {
    pub(super) fn occupied(path: &Path) -> Self {
        Self::Occupied { path: path.to_owned() }
    }

    pub(super) fn in_the_way(path: &Path) -> Self {
        Self::InTheWay { path: path.to_owned() }
    }

    /// The process's exit code: 75 if another process is writing or no space is left, 130 after an interruption.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Busy { .. } => 75,
            // there may be space later
            Self::Output { source, .. } if is_no_room(source) => 75,
            Self::ProgressSaved { .. } => 130,
            _ => 2,
        }
    }
}

/// Whether writing failed for lack of space: the disk is full, or a quota or `ulimit -f` is reached.
pub(crate) fn is_no_room(error: &io::Error) -> bool {
    // errors of this program's own size limits for inputs have no error number of the operating system
    let is_too_large = error.kind() == io::ErrorKind::FileTooLarge && error.raw_os_error().is_some();
    is_too_large || matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded)
}

/// Converts an error of an action on a file or directory, worded as in "cannot ...".
pub(crate) fn output(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> ArtefactError {
    let path = path.to_owned();
    move |source| ArtefactError::Output { path, action, source }
}
