//! Errors of artefacts.

use std::io;
use std::path::{Path, PathBuf};

use crate::input::plain;

/// What is said of an interruption that leaves nothing.
pub(crate) const NOTHING_WRITTEN: &str = "interrupted; nothing was written";

/// Why nothing is written to a place, or what is left there.
#[derive(Debug, thiserror::Error)]
pub enum ArtefactError {
    /// A result cannot be written.
    #[error("{}: cannot {action}: {source}", plain(path.display()))]
    Output {
        /// The file or directory.
        path: PathBuf,
        /// The failed action, as in "cannot ...".
        action: &'static str,
        /// The operating system's error.
        source: io::Error,
    },
    /// Another skiagraph process writes to the same path.
    #[error(
        "{path}: another skiagraph process is writing here; wait until it has finished, or choose another --out",
        path = path.display()
    )]
    Busy {
        /// The path.
        path: PathBuf,
    },
    /// An output path would overwrite an input.
    #[error(
        "{path}: this --out would replace or change {input}, which the command reads; choose another --out",
        path = path.display(), input = input.display()
    )]
    IsInput {
        /// The path.
        path: PathBuf,
        /// The input.
        input: PathBuf,
    },
    /// A file that skiagraph did not write exists at the output path.
    #[error(
        "{}: this exists and is not an unchanged skiagraph result; choose another --out, or use --force to rename it to \
        NAME~",
        plain(path.display())
    )]
    Occupied {
        /// The path.
        path: PathBuf,
    },
    /// A result of skiagraph exists at the output path that was made otherwise.
    #[error(
        "{}: a result exists here that was made otherwise ({}); choose another --out, or use --force to move it aside, to \
        NAME~",
        plain(path.display()),
        plain(difference)
    )]
    OtherResult {
        /// The path.
        path: PathBuf,
        /// The first difference.
        difference: String,
    },
    /// The user interrupted work that can be resumed: a training, a sweep, a set that is drawn, seeds that are tracked.
    #[error("interrupted; progress is saved in {}: run the same command to resume", plain(partial.display()))]
    ProgressSaved {
        /// The file or directory with the progress.
        partial: PathBuf,
    },
    /// Something else was begun at a place.
    #[error(
        "{}: another result was begun here and interrupted, which differs ({}); repeat that command to resume it, or \
        remove it with --force",
        plain(partial.display()),
        plain(difference)
    )]
    OtherUnfinished {
        /// The directory with the progress.
        partial: PathBuf,
        /// The first difference.
        difference: String,
    },
}

impl ArtefactError {
    pub(super) fn occupied(path: &Path) -> Self {
        Self::Occupied { path: path.to_owned() }
    }

    /// The process's exit code: 75 where another process is at work or no room is left, 130 after an interruption.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Busy { .. } => 75,
            // there may be room later
            Self::Output { source, .. } if is_no_room(source) => 75,
            Self::ProgressSaved { .. } => 130,
            _ => 2,
        }
    }
}

/// Whether nothing more can be written for now: the disk is full, or a quota or `ulimit -f` is reached.
pub(crate) fn is_no_room(error: &io::Error) -> bool {
    // our own limits of files that are read are told without the system's number
    let is_too_large = error.kind() == io::ErrorKind::FileTooLarge && error.raw_os_error().is_some();
    is_too_large || matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded)
}

/// The failed action on a file or directory, as in "cannot ...".
pub(crate) fn output(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> ArtefactError {
    let path = path.to_owned();
    move |source| ArtefactError::Output { path, action, source }
}
