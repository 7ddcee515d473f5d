//! Why bytes are no archive of arrays, or arrays make none.

use crate::input::plain;

/// What is wrong with an archive of arrays.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {}", plain(file), plain(detail))]
pub struct NpzError {
    /// What the archive is called.
    pub file: String,
    /// What was expected and what was found.
    pub detail: String,
}

impl NpzError {
    pub(crate) fn new(file: &str, detail: impl Into<String>) -> Self {
        Self { file: file.to_owned(), detail: detail.into() }
    }
}
