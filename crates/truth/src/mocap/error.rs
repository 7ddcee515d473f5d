//! Errors of recordings.

use std::fmt::Display;
use std::path::PathBuf;

use skiagraph_core::input::plain;

/// Errors of reading and editing recordings. Each message gives the location, what was expected and what was found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MocapError {
    /// The file is missing or not readable.
    #[error("{}: cannot be read: {source}", plain(path.display()))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// A file that is no recording or has unexpected content, or a clip whose joints do not pair left and right.
    #[error("{0}")]
    Refused(String),
    /// An invalid setting, or a clip that cannot be repeated; no file is named.
    #[error("{0}")]
    Setting(String),
}

impl MocapError {
    /// What was expected in this place of a file, and what was found.
    pub(super) fn at(place: impl Display, expected: impl Display, found: impl Display) -> Self {
        Self::Refused(mismatch(place, expected, found))
    }

    /// What was expected of a setting or a clip, and what was found.
    pub(super) fn of_setting(setting: impl Display, expected: impl Display, found: impl Display) -> Self {
        Self::Setting(mismatch(setting, expected, found))
    }

    /// Too few frames with a pose.
    pub(super) fn too_few_frames(file: &str, frames: usize) -> Self {
        Self::at(file, "frames with a pose", frames)
    }
}

fn mismatch(place: impl Display, expected: impl Display, found: impl Display) -> String {
    format!("{}: expected {}, found {}", plain(place), plain(expected), plain(found))
}
