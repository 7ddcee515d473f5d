//! Errors of sets.

use std::io;
use std::path::{Path, PathBuf};

use crate::input::plain;
use crate::npz::NpzError;

/// Errors of making, writing, reading and verifying sets.
#[derive(Debug, thiserror::Error)]
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
    /// The truth is kept apart.
    #[error(
        "{0} has no truth: it was rendered with --truth; give the folder with `--truth DIR` (evaluate, verify, export), or \
        name that folder in place of {0}",
        plain(set.display())
    )]
    NoTruth {
        /// The directory.
        set: PathBuf,
    },
    /// The truth that was given is not the set's.
    #[error(
        "{} is not the truth of {}: it has hash {found}, expected {expected}; give the folder that `render --truth` named",
        plain(truth.display()),
        plain(set.display())
    )]
    OthersTruth {
        /// The directory.
        set: PathBuf,
        /// The directory that was given for its truth.
        truth: PathBuf,
        /// The set's hash.
        expected: String,
        /// That of the other.
        found: String,
    },
    /// A file was changed.
    #[error(
        "{} was changed or truncated: its SHA-256 is {found}, the set lists {listed}; get the set again",
        plain(file)
    )]
    Tampered {
        /// Path inside the set.
        file: String,
        /// What it should be.
        listed: String,
        /// What it is.
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
    /// A shard is gone.
    #[error(
        "{}: this shard is missing, of {shards} that the set lists; get it again, or render the set again with --shards \
        {shards}",
        plain(file)
    )]
    MissingShard {
        /// Path inside the set.
        file: String,
        /// Number of shards in the listing.
        shards: usize,
    },
    /// A shard is not as it was written.
    #[error("{}: this shard is damaged: {}; get it again, or render the set again", plain(file), plain(detail))]
    BrokenShard {
        /// Path inside the set.
        file: String,
        /// What is wrong.
        detail: String,
    },
    /// A file does not have the expected content.
    #[error("{}: {}", plain(file), plain(detail))]
    Malformed {
        /// Path inside the set, or of the file itself.
        file: String,
        /// What was expected and what was found.
        detail: String,
    },
    /// A file of a set that is drawn on was written with other content before.
    #[error("{} differs from the file of that name that was written before the interruption", plain(file))]
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

    /// The same about a file of the set in `directory`, named as it was from the set's own point of view.
    pub(super) fn below(self, directory: &Path) -> Self {
        let of_set = |file: String| directory.join(file).display().to_string();
        match self {
            Self::Malformed { file, detail } => Self::Malformed { file: of_set(file), detail },
            Self::Tampered { file, listed, found } => Self::Tampered { file: of_set(file), listed, found },
            Self::Unlisted { file } => Self::Unlisted { file: of_set(file) },
            Self::LinkedOutside { file } => Self::LinkedOutside { file: of_set(file) },
            Self::MissingShard { file, shards } => Self::MissingShard { file: of_set(file), shards },
            Self::BrokenShard { file, detail } => Self::BrokenShard { file: of_set(file), detail },
            other => other,
        }
    }

    /// Whether it is that of a file which is missing or was changed, as a check of all hashes finds it.
    pub(super) fn is_of_hashes(&self) -> bool {
        matches!(
            self,
            Self::Tampered { .. }
                | Self::NotASet { .. }
                | Self::Io { .. }
                | Self::MissingShard { .. }
                | Self::BrokenShard { .. }
        )
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
