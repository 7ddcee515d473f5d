//! Errors of sets.

use std::io;
use std::path::{Path, PathBuf};

use skiagraph_core::input::plain;
use skiagraph_core::npz::NpzError;

/// Errors when making, writing, reading or verifying sets.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SetError {
    /// An error of the operating system: read-only directory, full disk, missing file.
    #[error("{}: cannot {action}: {source}", plain(path.display()))]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// The failed action, as in "cannot ...".
        action: &'static str,
        /// The operating system's error.
        source: io::Error,
    },
    /// The directory is not a complete set.
    #[error("{} is not a complete benchmark set: {}", plain(path.display()), plain(detail))]
    NotASet {
        /// The directory.
        path: PathBuf,
        /// What is missing.
        detail: String,
    },
    /// The truth is kept in another directory.
    #[error(
        "{0} has no truth: it was rendered with --truth, or its folder truth/ was removed; give the complete set with \
        `--truth DIR` (evaluate, verify, export), or use that folder instead of {0}",
        plain(set.display())
    )]
    NoTruth {
        /// The directory.
        set: PathBuf,
    },
    /// The set is of a recording, which has no truth, or the given truth belongs to another set.
    #[error("{0}")]
    OthersTruth(String),
    /// A file was changed or truncated.
    #[error(
        "{} was changed or truncated: its SHA-256 is {found}, the set lists {listed}; get the set again",
        plain(file)
    )]
    Tampered {
        /// Path inside the set.
        file: String,
        /// SHA-256 in the list.
        listed: String,
        /// SHA-256 of the file.
        found: String,
    },
    /// A file in the set's directory is not listed.
    #[error(
        "{} is not one of the set's files (files.sha256 does not list it); remove it or get the set again",
        plain(file)
    )]
    Unlisted {
        /// Path inside the set.
        file: String,
    },
    /// A listed file is reached through a symbolic link that leads out of the set's directory.
    #[error(
        "{} is a symbolic link that leads out of the set; replace it with the file itself (cp -rL copies a set so)",
        plain(file)
    )]
    LinkedOutside {
        /// Path inside the set.
        file: String,
    },
    /// A file does not have the expected content.
    #[error("{}: {}", plain(file), plain(detail))]
    Malformed {
        /// Path inside the set, or path of the file.
        file: String,
        /// What was expected and what was found.
        detail: String,
    },
    /// A file written before the interruption of a render differs from what is rendered now.
    #[error("{} differs from the file written before the interruption", plain(file))]
    Differs {
        /// Path inside the set.
        file: String,
    },
    /// The caller stopped the work.
    #[error("stopped before the set was complete")]
    Stopped,
    /// The parts of a set do not fit together.
    #[error("inconsistent parts of a set: {}", plain(detail))]
    Inconsistent {
        /// The inconsistency.
        detail: String,
    },
}

impl SetError {
    pub(super) fn io(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, action, source }
    }

    /// The same error with the file's path below `directory` instead of its path inside the set.
    pub(super) fn below(self, directory: &Path) -> Self {
        let of_set = |file: String| directory.join(file).display().to_string();
        match self {
            Self::Malformed { file, detail } => Self::Malformed { file: of_set(file), detail },
            Self::Tampered { file, listed, found } => Self::Tampered { file: of_set(file), listed, found },
            Self::Unlisted { file } => Self::Unlisted { file: of_set(file) },
            Self::LinkedOutside { file } => Self::LinkedOutside { file: of_set(file) },
            other => other,
        }
    }

    /// Whether the file is missing, unreadable or changed, which the check of all hashes reports.
    pub(super) fn is_hash_fault(&self) -> bool {
        matches!(self, Self::Tampered { .. } | Self::NotASet { .. } | Self::Io { .. })
    }

    pub(super) fn malformed(file: &str, detail: impl Into<String>) -> Self {
        Self::Malformed { file: file.to_string(), detail: detail.into() }
    }

    pub(super) fn inconsistent(detail: impl Into<String>) -> Self {
        Self::Inconsistent { detail: detail.into() }
    }
}

impl From<NpzError> for SetError {
    fn from(NpzError { file, detail }: NpzError) -> Self {
        Self::Malformed { file, detail }
    }
}
